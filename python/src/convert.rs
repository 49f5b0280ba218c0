//! Values of the library in Python's words, and the other way.

use std::time::Duration;

use pyo3::call::PyCallArgs;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyInt, PyString};
use serde::Serialize;
use vimc4::Kinds;

/// A named tuple of `vimc4._types`.
pub(crate) fn typed<'py, A: PyCallArgs<'py>>(
    py: Python<'py>,
    name: &str,
    values: A,
) -> PyResult<Py<PyAny>> {
    Ok(py.import("vimc4._types")?.getattr(name)?.call1(values)?.unbind())
}

/// What is written down as JSON elsewhere, as plain dicts, lists and bytes.
pub(crate) fn plain<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    Ok(pythonize::pythonize(py, value)?)
}

/// An event with its time and the number of its command.
pub(crate) fn event<'py>(
    py: Python<'py>,
    stamp: vimc4::Stamp,
    event: &vimc4::Event,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("at", stamp.at.as_nanos())?;
    dict.set_item("command", stamp.command.map(|number| number.0))?;
    dict.update(plain(py, event)?.cast::<PyDict>()?.as_mapping())?;
    Ok(dict)
}

/// A span of time with its unit: `"250ms"`, or a `timedelta`.
pub(crate) fn span(span: &Bound<'_, PyAny>) -> PyResult<Duration> {
    if let Ok(text) = span.cast::<PyString>() {
        let text = text.to_str()?;
        return vimc4::parse_duration(text).map_err(|wrong| {
            PyValueError::new_err(format!(
                "`{text}` {wrong}; write a number that is not negative with ns, us, ms, s, min or h, as in 250ms"
            ))
        });
    }
    span.extract().map_err(|_| {
        PyTypeError::new_err(
            "a span of time is a text with a unit, as in \"250ms\", or a timedelta that is not negative",
        )
    })
}

/// The value of a signal, a whole number.
pub(crate) fn level(value: &Bound<'_, PyAny>) -> PyResult<i32> {
    value.extract().map_err(|error: PyErr| match value.is_instance_of::<PyInt>() {
        true => PyValueError::new_err(format!(
            "no signal can be {value}; those that are a contact can be 0 or 1"
        )),
        false => error,
    })
}

/// Kinds of events, by their words.
pub(crate) fn kinds(words: &[String]) -> PyResult<Kinds> {
    const KINDS: [(&str, Kinds); 9] = [
        ("command", Kinds::COMMAND),
        ("answer", Kinds::ANSWER),
        ("motion", Kinds::MOTION),
        ("switch", Kinds::SWITCH),
        ("signal", Kinds::SIGNAL),
        ("port", Kinds::PORT),
        ("flash", Kinds::FLASH),
        ("line", Kinds::LINE),
        ("warning", Kinds::WARNING),
    ];
    words.iter().try_fold(Kinds::NONE, |kinds, word| {
        match KINDS.iter().find(|(name, _)| name == word) {
            Some((_, kind)) => Ok(kinds.and(*kind)),
            None => {
                let known = KINDS.map(|(name, _)| name).join(", ");
                let text = format!("`{word}` is no kind of event; there are {known}");
                Err(PyValueError::new_err(text))
            }
        }
    })
}
