//! Expectations that fail while somebody waits for something else.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::task::{Context, Waker};
use std::thread::{self, ThreadId};

use pyo3::prelude::*;
use vimc4::Failure;

use crate::error;
use crate::waiting::lock;

/// The failures of an emulator's expectations that nobody has heard of yet. Each is for the thread
/// that has begun to watch, which is that of the test: a driver in another thread is left alone.
#[derive(Default)]
pub(crate) struct Alarms(Mutex<State>);

#[derive(Default)]
struct State {
    raised: Vec<(u64, ThreadId, Failure)>,
    waiting: BTreeMap<u64, Waker>,
    /// The number of the next ear.
    next: u64,
}

impl Alarms {
    /// The expectation of this number has failed.
    pub(crate) fn raise(&self, number: u64, hearer: ThreadId, failure: &Failure) {
        let mut state = lock(&self.0);
        state.raised.push((number, hearer, failure.clone()));
        std::mem::take(&mut state.waiting).into_values().for_each(Waker::wake);
    }

    /// Nobody needs to hear of the expectation of this number any more.
    pub(crate) fn silence(&self, number: u64) {
        lock(&self.0).raised.retain(|(own, ..)| *own != number);
    }

    /// For somebody who is about to wait.
    pub(crate) fn ear(self: &Arc<Self>) -> Ear {
        let mut state = lock(&self.0);
        state.next += 1;
        Ear { alarms: Arc::clone(self), number: state.next }
    }
}

/// Hears of failures while something else is waited for.
pub(crate) struct Ear {
    alarms: Arc<Alarms>,
    number: u64,
}

impl Ear {
    /// Whether something has failed that this thread has to hear of; if not, the waker is told when it
    /// may have.
    pub(crate) fn hears(&self, cx: &mut Context<'_>) -> bool {
        let mut state = lock(&self.alarms.0);
        let this = thread::current().id();
        if state.raised.iter().any(|(_, hearer, _)| *hearer == this) {
            return true;
        }
        state.waiting.insert(self.number, cx.waker().clone());
        false
    }

    /// Raises what has failed in this thread, once.
    pub(crate) fn check(&self, py: Python<'_>) -> PyResult<()> {
        let this = thread::current().id();
        let failure = {
            let raised = &mut lock(&self.alarms.0).raised;
            let place = raised.iter().position(|(_, hearer, _)| *hearer == this);
            place.map(|place| raised.remove(place).2)
        };
        failure.map_or(Ok(()), |failure| Err(error::unmet(py, &failure)))
    }
}

impl Drop for Ear {
    fn drop(&mut self) {
        lock(&self.alarms.0).waiting.remove(&self.number);
    }
}
