//! What happened, as far back as it is kept.

use pyo3::prelude::*;
use pyo3::types::{PyList, PyString};
use vimc4::{Move, Names};

use crate::convert::typed;

/// What happened, oldest first: `vimc4.Journal` has the words for it.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Journal {
    journal: vimc4::Journal,
    names: Names,
    axes: usize,
}

impl Journal {
    pub(crate) fn new(journal: vimc4::Journal, names: Names, axes: usize) -> Journal {
        Journal { journal, names, axes }
    }
}

#[pymethods]
impl Journal {
    /// The oldest entries that are not there any more because there was no room.
    #[getter]
    fn dropped(&self) -> u64 {
        self.journal.dropped()
    }

    /// In words, a line for each.
    fn story(&self, py: Python<'_>) -> Vec<String> {
        py.detach(|| self.journal.story(&self.names))
    }

    /// As lines of JSON.
    fn json_lines(&self, py: Python<'_>) -> String {
        py.detach(|| self.journal.json_lines(&self.names))
    }

    /// Every entry as a dict.
    fn entries<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let loads = py.import("json")?.getattr("loads")?;
        let text = self.json_lines(py);
        let skip = usize::from(self.journal.dropped() > 0);
        let list = PyList::empty(py);
        for line in text.lines().skip(skip) {
            list.append(loads.call1((PyString::new(py, line),))?)?;
        }
        Ok(list)
    }

    /// The motions, each with its box.
    fn moves(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        self.journal.moves().iter().map(|one| self.told(py, one)).collect()
    }
}

impl Journal {
    fn told(&self, py: Python<'_>, one: &Move) -> PyResult<Py<PyAny>> {
        let Move { command, began, ended, from, to, low, high, steps } = one;
        let point =
            |point: &vimc4::Point| point.iter().take(self.axes).copied().collect::<Vec<_>>();
        typed(
            py,
            "Move",
            (
                command.map(|number| number.0),
                began.as_nanos(),
                ended.map(vimc4::Time::as_nanos),
                point(from),
                point(to),
                point(low),
                point(high),
                *steps,
            ),
        )
    }
}
