//! A controller without a thread, a clock or a port, in virtual time.

use std::sync::Mutex;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyString};
use vimc4::device::{Controller, Device, Harness as Driven, Line, Output, OwnedInput};
use vimc4::{Condition, Family, Names, Order, Time};

use crate::convert::{event, kinds, plain, span};
use crate::waiting::lock;
use crate::{error, profiles};

/// A controller in virtual time: bytes go in, time passes as it is told to, and what comes out waits
/// with its times until it is taken.
#[pyclass(frozen, eq, module = "vimc4._vimc4")]
pub(crate) struct Harness {
    driven: Mutex<Driven<Line<Controller>>>,
    pub(crate) family: Family,
    names: Names,
}

/// Equal is what has come to the same state and has the same things to say.
impl PartialEq for Harness {
    fn eq(&self, other: &Harness) -> bool {
        // One after the other: two threads may compare the same two.
        let copy = lock(&self.driven).clone();
        let other = lock(&other.driven);
        copy.device().state() == other.device().state() && copy.outputs() == other.outputs()
    }
}

impl Harness {
    pub(crate) fn of(driven: Driven<Line<Controller>>, family: Family, names: Names) -> Harness {
        Harness { driven: Mutex::new(driven), family, names }
    }

    pub(crate) fn device(&self) -> Line<Controller> {
        lock(&self.driven).device().clone()
    }

    /// What is meant by bytes, which arrive on the line, or by an order as people type it.
    fn inputs(&self, what: &Bound<'_, PyAny>) -> PyResult<Vec<OwnedInput>> {
        let py = what.py();
        let wrong = |text: String| error::raise(py, "OrderError", text);
        if let Ok(bytes) = what.extract::<&[u8]>() {
            return Ok(vec![OwnedInput::Bytes(bytes::Bytes::copy_from_slice(bytes))]);
        }
        let text = what.cast::<PyString>().map_err(|_| {
            PyTypeError::new_err(
                "bytes go in on the line, and a text is an order: b\"@0P\\r\" or \"press stop\"",
            )
        })?;
        let order = Order::read(text.to_str()?, &self.names).map_err(|e| wrong(e.to_string()))?;
        match order {
            Some(Order::Do(deed)) => {
                deed.inputs(self.names.signals()).map_err(|error| wrong(error.to_string()))
            }
            _ => Err(wrong(format!(
                "`{text}` is nothing that is done to a controller, as press, turn, set and power are"
            ))),
        }
    }

    fn condition(&self, py: Python<'_>, text: &str) -> PyResult<Condition> {
        let condition = vimc4::read_condition(text, &self.names);
        condition.map_err(|error| error::raise(py, "ConditionError", error.to_string()))
    }
}

/// What has come out, as dicts.
pub(crate) fn told(py: Python<'_>, outputs: Vec<Output>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    for output in outputs {
        match output {
            Output::Bytes(at, bytes) => {
                let dict = PyDict::new(py);
                dict.set_item("at", at.as_nanos())?;
                dict.set_item("bytes", PyBytes::new(py, &bytes))?;
                list.append(dict)?;
            }
            Output::Event(stamp, happened) => list.append(event(py, stamp, &happened)?)?,
            // It is an event, too, for those who watch that.
            Output::Flash(..) => {}
        }
    }
    Ok(list)
}

#[pymethods]
impl Harness {
    #[new]
    #[pyo3(signature = (
        model=None, machine=None, *, line_pacing=false, flash=b"".as_slice(), watching=Vec::new(),
    ))]
    fn new(
        py: Python<'_>,
        model: Option<&Bound<'_, PyAny>>,
        machine: Option<&Bound<'_, PyAny>>,
        line_pacing: bool,
        flash: &[u8],
        watching: Vec<String>,
    ) -> PyResult<Harness> {
        let default = |name: &str| PyString::new(py, name).into_any();
        let model = profiles::the_model(model.unwrap_or(&default("imc4")))?;
        let machine = profiles::the_machine(machine.unwrap_or(&default("bench")))?;
        let controller = vimc4::bare(&model, &machine, flash)
            .map_err(|error| error::raise(py, "FlashError", error.to_string()))?;
        let names = model.names(controller.signals());
        let line = if line_pacing { Line::paced(controller) } else { Line::ideal(controller) };
        Ok(Harness::of(Driven::new(line).watching(kinds(&watching)?), model.family(), names))
    }

    /// The present, in nanoseconds.
    #[getter]
    fn now(&self) -> u64 {
        lock(&self.driven).now().as_nanos()
    }

    /// When something happens next if nobody does anything; None if it waits for an input.
    #[getter]
    fn due(&self) -> Option<u64> {
        lock(&self.driven).due().map(Time::as_nanos)
    }

    // --- what goes in ---

    /// Something happens now: bytes arrive on the line, or a text is an order, as in `press stop`.
    fn give(&self, what: &Bound<'_, PyAny>) -> PyResult<()> {
        let inputs = self.inputs(what)?;
        what.py().detach(|| {
            let mut driven = lock(&self.driven);
            inputs.iter().for_each(|input| driven.input(input.as_input()));
        });
        Ok(())
    }

    /// Plans the same for later: a span from now, as in `500ms`, or a time in nanoseconds.
    fn plan(&self, at: &Bound<'_, PyAny>, what: &Bound<'_, PyAny>) -> PyResult<()> {
        let inputs = self.inputs(what)?;
        let at = match at.extract::<u64>() {
            Ok(nanos) => Time::from_nanos(nanos),
            Err(_) => lock(&self.driven).now() + span(at)?,
        };
        let mut driven = lock(&self.driven);
        inputs.iter().for_each(|input| driven.plan(at, input.as_input()));
        Ok(())
    }

    /// Sends bytes, lets everything happen that follows from them, and takes the bytes that have come
    /// out.
    fn ask<'py>(&self, py: Python<'py>, data: &[u8]) -> PyResult<Bound<'py, PyBytes>> {
        let answer = py.detach(|| lock(&self.driven).ask(data));
        let answer = answer.map_err(|error| error::raise(py, "Endless", error.to_string()))?;
        Ok(PyBytes::new(py, &answer))
    }

    // --- how time passes ---

    /// Lets happen the one thing that happens next, and says when that was; None if nothing does.
    fn step(&self, py: Python<'_>) -> Option<u64> {
        py.detach(|| lock(&self.driven).step()).map(Time::as_nanos)
    }

    /// Lets so much time pass, with everything that happens in it, and says what time it is then.
    fn advance(&self, by: &Bound<'_, PyAny>) -> PyResult<u64> {
        let span = span(by)?;
        by.py().detach(|| lock(&self.driven).advance(span));
        Ok(self.now())
    }

    /// Lets time pass up to a time in nanoseconds.
    fn run_to(&self, py: Python<'_>, at: u64) {
        py.detach(|| lock(&self.driven).run_to(Time::from_nanos(at)));
    }

    /// Lets everything happen that is planned and that the controller does by itself, and says what
    /// time it is then.
    fn run_to_rest(&self, py: Python<'_>) -> PyResult<u64> {
        let rest = py.detach(|| lock(&self.driven).run_to_rest());
        rest.map_err(|error| error::raise(py, "Endless", error.to_string()))?;
        Ok(self.now())
    }

    /// Lets time pass up to the first instant at which the condition holds, and says when that is; None
    /// if everything comes to rest before.
    fn run_until(&self, py: Python<'_>, condition: &str) -> PyResult<Option<u64>> {
        let condition = self.condition(py, condition)?;
        Ok(py.detach(|| lock(&self.driven).run_until(&condition)).map(Time::as_nanos))
    }

    // --- what comes out ---

    /// The step counters of the axes, X first.
    fn position(&self) -> Vec<i64> {
        let driven = lock(&self.driven);
        driven.device().view(driven.now()).axes.iter().map(|axis| axis.position).collect()
    }

    /// A picture of the controller.
    fn view<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let view = {
            let driven = lock(&self.driven);
            driven.device().view(driven.now())
        };
        plain(py, &view)
    }

    /// Takes the bytes that have come out.
    fn take_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &lock(&self.driven).take_bytes())
    }

    /// Takes everything that has come out, in the order in which it happened, each with its time:
    /// `bytes` that leave on the line, and the events that are watched.
    fn drain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let outputs = lock(&self.driven).drain().collect();
        told(py, outputs)
    }

    /// Another one in the same state, with the same plans, that goes its own way from here.
    fn copy(&self) -> Harness {
        Harness::of(lock(&self.driven).clone(), self.family, self.names.clone())
    }

    fn __copy__(&self) -> Harness {
        self.copy()
    }

    fn __repr__(&self) -> String {
        format!("<vimc4.Harness at {}>", lock(&self.driven).now())
    }
}
