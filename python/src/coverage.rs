//! How much of what a controller can do was met.

use std::path::PathBuf;

use pyo3::prelude::*;

use crate::convert::plain;
use crate::error;

/// How much of what a controller can do was met: commands, their answers, the states that they found and
/// what stopped them.
#[pyclass(frozen, eq, module = "vimc4._vimc4")]
#[derive(PartialEq)]
pub(crate) struct Coverage(pub(crate) vimc4::Coverage);

#[pymethods]
impl Coverage {
    /// What a file has that `--coverage` or `--vimc4-coverage` has written.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Coverage> {
        let read = py.detach(|| vimc4::read_coverage(path));
        read.map(Coverage).map_err(|error| error::of_coverage_file(py, &error))
    }

    /// What `json` has written.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Coverage> {
        let read = vimc4::Coverage::from_json(text);
        read.map(Coverage).map_err(|error| error::raise(py, "CoverageError", error.to_string()))
    }

    /// Adds it to a file, which is created if it is not there, and returns what is in it then. Several
    /// processes may do so at the same time.
    fn add_to(&self, py: Python<'_>, path: PathBuf) -> PyResult<Coverage> {
        let added = py.detach(|| vimc4::add_coverage(path, &self.0));
        added.map(Coverage).map_err(|error| error::of_coverage_file(py, &error))
    }

    /// Both together, of the same model.
    #[pyo3(name = "__add__")]
    fn add(&self, py: Python<'_>, other: &Bound<'_, Coverage>) -> PyResult<Coverage> {
        let mut sum = self.0.clone();
        sum.merge(&other.get().0)
            .map_err(|error| error::raise(py, "CoverageError", error.to_string()))?;
        Ok(Coverage(sum))
    }

    /// The model.
    #[getter]
    fn model(&self) -> &str {
        &self.0.model
    }

    /// Every form of every command, with its answers, states and stops, and how often each was met.
    fn commands<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.0.commands)
    }

    /// How much was met of each kind.
    fn totals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.0.totals())
    }

    /// A line for each form of a command: how much of it was met.
    fn table(&self) -> String {
        self.0.table()
    }

    /// What was never met, in sentences.
    fn missing(&self) -> Vec<String> {
        self.0.missing()
    }

    /// As a page of HTML that needs nothing else.
    fn html(&self) -> String {
        self.0.html()
    }

    /// For viewers of the coverage of sources: the text that it is about, which belongs at this path, and
    /// a tracefile of lcov.
    fn lcov(&self, path: &str) -> (String, String) {
        let lcov = self.0.lcov(path);
        (lcov.source, lcov.tracefile)
    }

    /// As the files have it.
    fn json(&self) -> String {
        self.0.to_json()
    }

    fn __repr__(&self) -> String {
        let commands = self.0.totals().commands;
        let (met, possible) = (commands.met, commands.possible);
        format!("<vimc4.Coverage of {}: {met} of {possible} commands>", self.0.model)
    }
}
