//! Answers that are on their way, to be waited for or awaited.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};

use pyo3::prelude::*;
use vimc4::{ControlError, Progress};

use crate::alarm::Ear;
use crate::bell::Bell;
use crate::convert::typed;
use crate::error;
use crate::waiting::{deadline, lock, wait};

/// Makes what Python gets, once it is there.
type Answer = Box<dyn FnOnce(Python<'_>) -> PyResult<Py<PyAny>> + Send>;

type Awaited = Pin<Box<dyn Future<Output = Answer> + Send>>;

/// An answer that is on its way: wait() for it, or await it. What was asked for takes effect
/// whether or not anybody does.
#[pyclass(frozen, subclass, generic, module = "vimc4._vimc4")]
pub(crate) struct Pending {
    stage: Mutex<Stage>,
    /// What is given up when somebody stops waiting.
    journey: Option<Arc<Mutex<vimc4::TimeAdvance>>>,
    /// Hears of expectations that fail meanwhile.
    ear: Option<Ear>,
}

enum Stage {
    Awaited(Awaited),
    Answered(Answer),
    Known(PyResult<Py<PyAny>>),
    /// Only while it is changed.
    Changing,
}

impl Pending {
    /// The answer of a controller; `tell` puts it into Python's words.
    pub(crate) fn of<T: Send + 'static>(
        reply: impl Future<Output = Result<T, ControlError>> + Send + 'static,
        tell: impl FnOnce(Python<'_>, T) -> PyResult<Py<PyAny>> + Send + 'static,
    ) -> Pending {
        Pending::new(reply, |py, reply| match reply {
            Ok(value) => tell(py, value),
            Err(error) => Err(error::of_control(py, &error)),
        })
    }

    /// An expectation that fails meanwhile is heard.
    pub(crate) fn hearing(self, ear: Ear) -> Pending {
        Pending { ear: Some(ear), ..self }
    }

    /// Any answer.
    pub(crate) fn new<T: Send + 'static>(
        future: impl Future<Output = T> + Send + 'static,
        tell: impl FnOnce(Python<'_>, T) -> PyResult<Py<PyAny>> + Send + 'static,
    ) -> Pending {
        let answer = async {
            let value = future.await;
            Box::new(move |py: Python<'_>| tell(py, value)) as Answer
        };
        Pending { stage: Mutex::new(Stage::Awaited(Box::pin(answer))), journey: None, ear: None }
    }

    /// Time on its way.
    pub(crate) fn journey(
        py: Python<'_>,
        journey: vimc4::TimeAdvance,
        ear: Ear,
    ) -> PyResult<Py<Journey>> {
        let journey = Arc::new(Mutex::new(journey));
        let goes = Arc::clone(&journey);
        let reply = std::future::poll_fn(move |cx| Pin::new(&mut *lock(&goes)).poll(cx));
        let mut pending = Pending::of(reply, |py, at| Ok(at.as_nanos().into_pyobject(py)?.into()));
        (pending.journey, pending.ear) = (Some(journey), Some(ear));
        Py::new(py, PyClassInitializer::from(pending).add_subclass(Journey))
    }

    /// Whether the answer is there, or something has failed; if not, the waker is told when it is.
    fn poll(&self, cx: &mut Context<'_>) -> Poll<()> {
        if self.ear.as_ref().is_some_and(|ear| ear.hears(cx)) {
            return Poll::Ready(());
        }
        let mut stage = lock(&self.stage);
        if let Stage::Awaited(future) = &mut *stage {
            match future.as_mut().poll(cx) {
                Poll::Ready(answer) => *stage = Stage::Answered(answer),
                Poll::Pending => return Poll::Pending,
            }
        }
        Poll::Ready(())
    }

    fn give_up(&self) {
        if let Some(journey) = &self.journey {
            lock(journey).cancel();
        }
    }
}

#[pymethods]
impl Pending {
    /// Waits for the answer; with a time in seconds, no longer than so. Time that is on its way is
    /// given up if it does not arrive.
    #[pyo3(signature = (timeout=None))]
    fn wait(&self, py: Python<'_>, timeout: Option<f64>) -> PyResult<Py<PyAny>> {
        match wait(py, deadline(timeout), |cx| self.poll(cx)) {
            Ok(Some(())) => self.result(py),
            Ok(None) => {
                self.give_up();
                Err(error::late(py, timeout.unwrap_or_default()))
            }
            Err(error) => {
                self.give_up();
                Err(error)
            }
        }
    }

    /// The answer that is there.
    fn result(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        if let Some(ear) = &self.ear {
            ear.check(py).inspect_err(|_| self.give_up())?;
        }
        let stage = std::mem::replace(&mut *lock(&self.stage), Stage::Changing);
        // Python code runs here: the lock must not be held.
        let known = match stage {
            Stage::Answered(answer) => answer(py),
            Stage::Known(known) => known,
            Stage::Awaited(_) | Stage::Changing => Err(error::broken("there is no answer yet")),
        };
        let copy =
            known.as_ref().map(|value| value.clone_ref(py)).map_err(|error| error.clone_ref(py));
        *lock(&self.stage) = Stage::Known(known);
        copy
    }

    /// Whether the answer is there; if not, the bell rings with the key when it may be.
    fn ready_or_ring(&self, bell: &Bell, key: u64) -> bool {
        self.poll(&mut Context::from_waker(&bell.waker(key))).is_ready()
    }

    /// Nobody waits any more.
    fn abandon(&self) {
        self.give_up();
    }

    #[pyo3(name = "__await__")]
    fn awaited<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        py.import("vimc4._aio")?.call_method1("wait", (slf,))?.call_method0("__await__")
    }
}

/// Time on its way: it can be watched, held up and given up.
#[pyclass(frozen, extends = Pending, module = "vimc4._vimc4")]
pub(crate) struct Journey;

#[pymethods]
impl Journey {
    /// Holds it up, after a few milliseconds at most.
    fn pause(slf: &Bound<'_, Self>) -> PyResult<()> {
        Journey::ask(slf, |journey| journey.pause())
    }

    /// Goes on after a pause.
    fn resume(slf: &Bound<'_, Self>) -> PyResult<()> {
        Journey::ask(slf, |journey| journey.resume())
    }

    /// Gives it up. Whoever waits for it gets `Cancelled`, unless time has arrived before.
    fn cancel(slf: &Bound<'_, Self>) -> PyResult<()> {
        Journey::ask(slf, |journey| {
            journey.cancel();
            Ok(())
        })
    }

    /// How far it has come.
    #[getter]
    fn progress(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let Progress { now, to, paused } = Journey::ask(slf, |journey| Ok(journey.progress()))?;
        let to = to.map(vimc4::Time::as_nanos);
        typed(py, "Progress", (now.as_nanos(), to, paused))
    }
}

impl Journey {
    fn ask<T>(
        slf: &Bound<'_, Self>,
        what: impl FnOnce(&vimc4::TimeAdvance) -> Result<T, ControlError>,
    ) -> PyResult<T> {
        let pending = slf.as_super().get();
        let journey = pending.journey.as_ref().ok_or_else(|| error::broken("no journey"))?;
        what(&lock(journey)).map_err(|error| error::of_control(slf.py(), &error))
    }
}
