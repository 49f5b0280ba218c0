//! The sinks that watch a controller.

use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use vimc4_device::{Device, Time};

use crate::{Report, Sink, Wants, What};

/// The number of a sink, to detach it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SinkId(u64);

/// The sinks of a controller, and the reports they want together. Reports that no sink wants are
/// not produced.
#[derive(Default)]
pub struct Sinks {
    /// What the controller is called in reports.
    name: Arc<str>,
    watching: Vec<Watching>,
    /// The last number that a sink was given.
    last: u64,
    wants: Wants,
    /// When one of them wants to be told that time has passed.
    due: Option<Time>,
    /// Whether one of them could take no more when it was asked last.
    is_full: bool,
}

/// A sink, and what it wants.
struct Watching {
    id: SinkId,
    wants: Wants,
    sink: Box<dyn Sink>,
}

impl Sinks {
    /// Gives the controller its name.
    pub fn call(&mut self, name: &str) {
        self.name = Arc::from(name);
    }

    /// What all of them want.
    pub fn wants(&self) -> Wants {
        self.wants
    }

    /// Whether nobody watches.
    pub fn is_empty(&self) -> bool {
        self.watching.is_empty()
    }

    /// Lets a sink watch from now on. If it wants inputs, it is first told the state in which they
    /// begin.
    pub fn add<D: Device>(
        &mut self,
        mut sink: Box<dyn Sink>,
        device: &D,
        beginning: impl FnOnce() -> Vec<What>,
    ) -> SinkId {
        let wants = sink.wants();
        if wants.inputs {
            for what in beginning() {
                let report = Report { controller: Arc::clone(&self.name), at: device.now(), what };
                sink.report(&report, &|command| device.explain(command));
            }
        }
        self.last += 1;
        let id = SinkId(self.last);
        self.watching.push(Watching { id, wants, sink });
        self.add_up();
        id
    }

    /// Detaches a sink. Returns whether it was still attached.
    pub fn remove(&mut self, id: SinkId) -> bool {
        let before = self.watching.len();
        self.watching.retain(|watching| watching.id != id);
        self.add_up();
        self.watching.len() < before
    }

    /// Detaches the sinks that want inputs.
    pub fn end_recordings(&mut self) {
        self.watching.retain(|watching| !watching.wants.inputs);
        self.add_up();
    }

    /// Passes a report to the sinks that want it, and detaches those that have seen enough. Returns
    /// whether less is wanted from now on.
    pub fn tell<D: Device>(
        &mut self,
        device: &D,
        at: Time,
        wanted: impl Fn(&Wants) -> bool,
        what: impl FnOnce() -> What,
    ) -> bool {
        if self.watching.is_empty() || !wanted(&self.wants) {
            return false;
        }
        let report = Report { controller: Arc::clone(&self.name), at, what: what() };
        let explain = |command: &[u8]| device.explain(command);
        let (mut enough, mut due) = (false, None);
        for Watching { wants, sink, .. } in &mut self.watching {
            if wanted(wants) {
                sink.report(&report, &explain);
                enough |= sink.has_enough();
            }
            due = sooner(due, sink.due());
        }
        self.due = due;
        if enough {
            self.watching.retain(|of| !of.sink.has_enough());
            self.add_up();
        }
        enough
    }

    /// Tells the sinks that want inputs that everything that followed from one has been reported.
    pub fn settle<D: Device>(&mut self, device: &D, state: &dyn Fn() -> serde_json::Value) {
        if !self.wants.inputs {
            return;
        }
        let at = device.now();
        for Watching { sink, .. } in self.watching.iter_mut().filter(|of| of.wants.inputs) {
            sink.settled(at, state);
        }
    }

    /// Waits until all of them can take more reports.
    pub fn poll_ready(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        let waits = |of: &mut Watching| of.sink.poll_ready(cx).is_pending();
        self.is_full = self.watching.iter_mut().map(waits).fold(false, |any, waits| any | waits);
        if self.is_full { Poll::Pending } else { Poll::Ready(()) }
    }

    /// Whether one of them can take no more now.
    pub fn are_full(&mut self) -> bool {
        self.poll_ready(&mut Context::from_waker(Waker::noop())).is_pending()
    }

    /// Whether one of them could take no more when it was asked last.
    pub fn were_full(&self) -> bool {
        self.is_full
    }

    /// When one of them wants to be told that time has passed.
    pub fn due(&self) -> Option<Time> {
        self.due
    }

    /// Tells the sinks that asked for it that time has passed. Returns whether any did.
    pub fn pass(&mut self, at: Time) -> bool {
        if self.due.is_none_or(|due| due > at) {
            return false;
        }
        for Watching { sink, .. } in &mut self.watching {
            if sink.due().is_some_and(|due| due <= at) {
                sink.passes(at);
            }
        }
        self.look_again();
        // A sink that names no later time does not hold up the others.
        self.due = self.due.filter(|due| *due > at);
        true
    }

    /// One of them wants to be told at another time.
    pub fn look_again(&mut self) {
        self.due = self.watching.iter().fold(None, |due, of| sooner(due, of.sink.due()));
    }

    fn add_up(&mut self) {
        self.look_again();
        self.wants = self.watching.iter().fold(Wants::default(), |all, of| all.and(of.wants));
    }
}

fn sooner(one: Option<Time>, other: Option<Time>) -> Option<Time> {
    one.into_iter().chain(other).min()
}
