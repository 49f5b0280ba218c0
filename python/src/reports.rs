//! Everything that happens, for those who take their time.

use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};

use pyo3::prelude::*;
use vimc4::{EventFilter, Report, Tap};

use crate::convert::{kinds, plain};
use crate::error;
use crate::pending::Pending;
use crate::waiting::{deadline, lock, wait};

/// The reports of one or several emulators.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Reports {
    reports: Arc<Mutex<vimc4::Reports>>,
    /// `None` once every emulator that is to be watched is.
    tap: Mutex<Option<Tap>>,
}

impl Reports {
    pub(crate) fn tap(&self) -> PyResult<Tap> {
        lock(&self.tap).clone().ok_or_else(|| error::broken("these reports are complete"))
    }

    fn next(reports: &Mutex<vimc4::Reports>, cx: &mut Context<'_>) -> Poll<Option<Report>> {
        lock(reports).poll_next(cx)
    }
}

#[pymethods]
impl Reports {
    #[new]
    fn new(wants: Vec<String>, room: usize) -> PyResult<Reports> {
        let (mut others, mut events) = ((false, false), Vec::new());
        for word in wants {
            match word.as_str() {
                "inputs" => others.0 = true,
                "sent" => others.1 = true,
                _ => events.push(word),
            }
        }
        let wanted = EventFilter { kinds: kinds(&events)?, inputs: others.0, sent: others.1 };
        let (tap, reports) = vimc4::Reports::new(wanted, room);
        Ok(Reports { reports: Arc::new(Mutex::new(reports)), tap: Mutex::new(Some(tap)) })
    }

    /// No other emulator will be watched: the reports end with those that are.
    fn complete(&self) {
        lock(&self.tap).take();
    }

    /// The next report that is there, or None.
    fn take(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let report = lock(&self.reports).take();
        report.map(|report| Ok(plain(py, &report)?.unbind())).transpose()
    }

    /// Waits for the next report, no longer than so many seconds; None when nothing will come any more.
    #[pyo3(signature = (timeout=None))]
    fn wait(&self, py: Python<'_>, timeout: Option<f64>) -> PyResult<Option<Py<PyAny>>> {
        let report = wait(py, deadline(timeout), |cx| Reports::next(&self.reports, cx))?
            .ok_or_else(|| error::late(py, timeout.unwrap_or_default()))?;
        report.map(|report| Ok(plain(py, &report)?.unbind())).transpose()
    }

    /// The next report, to be awaited; None when nothing will come any more.
    fn next_report(&self) -> Pending {
        let reports = Arc::clone(&self.reports);
        let next = std::future::poll_fn(move |cx| Reports::next(&reports, cx));
        Pending::new(next, |py, report| match report {
            Some(report) => Ok(plain(py, &report)?.unbind()),
            None => Ok(py.None()),
        })
    }
}
