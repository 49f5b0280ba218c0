//! Models and machines: by name, from files, and made in the program.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::error;

/// A model of controller, made from the text of a profile.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Model(pub(crate) vimc4::Model);

/// A machine, made from the text of a profile.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Machine(pub(crate) Arc<vimc4::Machine>);

#[pymethods]
impl Model {
    /// A model from a profile in TOML.
    #[new]
    fn new(py: Python<'_>, profile: &str) -> PyResult<Model> {
        vimc4::Model::from_toml(profile)
            .map(Model)
            .map_err(|error| error::raise(py, "ProfileError", format!("{error}; {}", error.help)))
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    fn __repr__(&self) -> String {
        format!("<vimc4.Model {}>", self.0.name())
    }
}

#[pymethods]
impl Machine {
    /// A machine from a profile in TOML.
    #[new]
    fn new(py: Python<'_>, profile: &str) -> PyResult<Machine> {
        vimc4::Machine::from_toml(profile)
            .map(|machine| Machine(Arc::new(machine)))
            .map_err(|error| error::raise(py, "ProfileError", format!("{error}; {}", error.help)))
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    fn __repr__(&self) -> String {
        format!("<vimc4.Machine {}>", self.0.name)
    }
}

/// The model that is meant by a name, a file or a `Model`.
pub(crate) fn the_model(meant: &Bound<'_, PyAny>) -> PyResult<vimc4::Model> {
    if let Ok(model) = meant.cast::<Model>() {
        return Ok(model.get().0.clone());
    }
    vimc4::model(&text(meant)?).map_err(|error| error::of(meant.py(), &error))
}

/// The machine that is meant by a name, a file or a `Machine`.
pub(crate) fn the_machine(meant: &Bound<'_, PyAny>) -> PyResult<Arc<vimc4::Machine>> {
    if let Ok(machine) = meant.cast::<Machine>() {
        return Ok(Arc::clone(&machine.get().0));
    }
    vimc4::machine(&text(meant)?).map_err(|error| error::of(meant.py(), &error))
}

/// A text, or a path as text.
fn text(meant: &Bound<'_, PyAny>) -> PyResult<String> {
    let path = meant.py().import("os")?.call_method1("fspath", (meant,))?;
    Ok(path.cast::<PyString>()?.to_str()?.to_owned())
}

/// The names of the models that are built in.
#[pyfunction]
pub(crate) fn models() -> Vec<&'static str> {
    vimc4::models()
}

/// The names of the machines that are built in.
#[pyfunction]
pub(crate) fn machines() -> Vec<&'static str> {
    vimc4::machines()
}

/// The profile of a built-in model as TOML, to start one's own from.
#[pyfunction]
pub(crate) fn model_profile(py: Python<'_>, name: &str) -> PyResult<&'static str> {
    vimc4::model_profile(name).map_err(|error| error::of(py, &error))
}

/// The profile of a built-in machine as TOML, to start one's own from.
#[pyfunction]
pub(crate) fn machine_profile(py: Python<'_>, name: &str) -> PyResult<&'static str> {
    vimc4::machine_profile(name).map_err(|error| error::of(py, &error))
}
