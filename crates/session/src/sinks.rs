//! The sinks that watch a controller.

use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use vimc4_device::Time;

use crate::{EventFilter, Report, ReportKind, Sink};

/// The number of a sink, to detach it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SinkId(u64);

/// The sinks of a controller, and the reports they want together.
#[derive(Default)]
pub struct Sinks {
    /// The name of the controller in reports.
    name: Arc<str>,
    attached: Vec<AttachedSink>,
    /// The number of the last sink.
    last: u64,
    /// What they want together; `None` if there is none.
    wants: Option<EventFilter>,
    /// When one of them wants to know that time has passed.
    due: Option<Time>,
    /// Whether one of them could take no more when it was asked last.
    is_full: bool,
}

struct AttachedSink {
    id: SinkId,
    wants: EventFilter,
    sink: Box<dyn Sink>,
}

impl Sinks {
    /// Names the controller.
    pub fn set_name(&mut self, name: &str) {
        self.name = Arc::from(name);
    }

    /// The reports that they want together; `None` if there are no sinks.
    #[must_use]
    pub fn wants(&self) -> Option<EventFilter> {
        self.wants
    }

    /// Attaches a sink. If it wants inputs, it first gets the reports with which they begin.
    pub fn add(
        &mut self,
        mut sink: Box<dyn Sink>,
        at: Time,
        beginning: impl FnOnce() -> Vec<ReportKind>,
        explain: &dyn Fn(&[u8]) -> String,
    ) -> SinkId {
        let wants = sink.wants();
        if wants.inputs {
            for what in beginning() {
                let report = Report { controller: Arc::clone(&self.name), at, what };
                sink.report(&report, explain);
            }
        }
        self.last += 1;
        let id = SinkId(self.last);
        self.attached.push(AttachedSink { id, wants, sink });
        self.update();
        id
    }

    /// Detaches a sink. Returns whether it was still attached.
    pub fn remove(&mut self, id: SinkId) -> bool {
        let before = self.attached.len();
        self.attached.retain(|attached| attached.id != id);
        self.update();
        self.attached.len() < before
    }

    /// Detaches the sinks that want inputs.
    pub fn end_recordings(&mut self) {
        self.attached.retain(|attached| !attached.wants.inputs);
        self.update();
    }

    /// Passes a report to the sinks that want it, and detaches those that have enough. Returns
    /// whether less is wanted from now on.
    pub fn report(
        &mut self,
        at: Time,
        what: ReportKind,
        explain: &dyn Fn(&[u8]) -> String,
    ) -> bool {
        let report = Report { controller: Arc::clone(&self.name), at, what };
        let (mut has_enough, mut due) = (false, None);
        for AttachedSink { wants, sink, .. } in &mut self.attached {
            if wants.include(&report.what) {
                sink.report(&report, explain);
                has_enough |= sink.has_enough();
            }
            due = earlier(due, sink.due());
        }
        self.due = due;
        if has_enough {
            self.attached.retain(|attached| !attached.sink.has_enough());
            self.update();
        }
        has_enough
    }

    /// Tells the sinks that want inputs that everything that followed from one has been reported.
    pub fn settle(&mut self, at: Time, state: &dyn Fn() -> serde_json::Value) {
        if self.wants.is_some_and(|wants| wants.inputs) {
            let recordings = self.attached.iter_mut().filter(|attached| attached.wants.inputs);
            recordings.for_each(|attached| attached.sink.settled(at, state));
        }
    }

    /// Waits until all of them can take more reports.
    pub fn poll_ready(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        let waits = |attached: &mut AttachedSink| attached.sink.poll_ready(cx).is_pending();
        self.is_full = self.attached.iter_mut().map(waits).fold(false, |any, waits| any | waits);
        if self.is_full { Poll::Pending } else { Poll::Ready(()) }
    }

    /// Whether one of them can take no more now.
    pub fn are_full(&mut self) -> bool {
        self.poll_ready(&mut Context::from_waker(Waker::noop())).is_pending()
    }

    /// Whether one of them could take no more when it was asked last.
    #[must_use]
    pub fn were_full(&self) -> bool {
        self.is_full
    }

    /// When one of them wants to know that time has passed.
    #[must_use]
    pub fn due(&self) -> Option<Time> {
        self.due
    }

    /// Tells the sinks that asked for it that time has passed. Returns whether any did.
    pub fn pass(&mut self, at: Time) -> bool {
        if self.due.is_none_or(|due| due > at) {
            return false;
        }
        for AttachedSink { sink, .. } in &mut self.attached {
            if sink.due().is_some_and(|due| due <= at) {
                sink.passes(at);
            }
        }
        self.update_due();
        // A sink that names no later time does not hold up the others.
        self.due = self.due.filter(|due| *due > at);
        true
    }

    /// One of them wants to know it at another time.
    pub fn update_due(&mut self) {
        let dues = self.attached.iter().map(|attached| attached.sink.due());
        self.due = dues.fold(None, earlier);
    }

    fn update(&mut self) {
        self.update_due();
        let wants = self.attached.iter().map(|attached| attached.wants);
        self.wants = wants.reduce(EventFilter::and);
    }
}

fn earlier(one: Option<Time>, other: Option<Time>) -> Option<Time> {
    one.into_iter().chain(other).min()
}
