//! Time that advances to a destination, for callers.

use std::future::Future;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::sync::{mpsc, oneshot, watch};
use vimc4_device::Time;
use vimc4_session::AdvanceRequest;
pub use vimc4_session::Progress;

use crate::ControlError;
use crate::pending::Pending;

/// Time that advances to a destination, by [`advance`](crate::Handle::advance) or
/// [`run_until`](crate::Handle::run_until). As a future it returns the time of arrival.
///
/// A long advance, such as a program of an hour in manual time, can be watched, paused, resumed, and
/// cancelled. While it is paused, time stands still, and the controller can be used as at any other
/// moment. Dropping it does not cancel the advance.
///
/// Requests and bytes that arrive during the advance wait for its end. During an advance of more than
/// 100,000 causes, as to an event that an endless program never reaches, they are carried out between
/// two causes, and a condition is forecast again. The next advance begins where this one has ended.
#[derive(Debug)]
#[must_use = "wait for the advance, or its result is lost"]
pub struct TimeAdvance {
    reply: Pending<Time>,
    request: Arc<Mutex<AdvanceRequest>>,
    /// Has the controller look at the request.
    nudge: mpsc::UnboundedSender<()>,
    progress: watch::Receiver<Progress>,
    by_itself: bool,
}

/// How many advances of a controller have been requested and cancelled.
#[derive(Debug, Default)]
pub(crate) struct AdvanceCounts {
    requested: AtomicU64,
    /// The first so many are cancelled.
    cancelled: AtomicU64,
    /// The first so many are cancelled if they need an input.
    unaided: AtomicU64,
}

impl AdvanceCounts {
    pub(crate) fn cancel_all(&self) {
        self.cancelled.store(self.requested.load(Ordering::Acquire), Ordering::Release);
    }

    pub(crate) fn cancel_all_that_need_inputs(&self) {
        self.unaided.store(self.requested.load(Ordering::Acquire), Ordering::Release);
    }
}

/// The controller's side of an advance: completes it.
#[derive(Debug)]
pub(crate) struct AdvanceCompletion {
    reply: oneshot::Sender<Result<Time, ControlError>>,
    request: Arc<Mutex<AdvanceRequest>>,
    counts: Arc<AdvanceCounts>,
    /// How many advances were requested before it.
    number: u64,
    progress: watch::Sender<Progress>,
}

impl TimeAdvance {
    /// An advance in a time that passes by itself, or that does not. `nudge` has the controller look at
    /// the request.
    pub(crate) fn begin(
        by_itself: bool,
        nudge: mpsc::UnboundedSender<()>,
        counts: &Arc<AdvanceCounts>,
    ) -> (AdvanceCompletion, TimeAdvance) {
        let number = counts.requested.fetch_add(1, Ordering::AcqRel);
        let (answer, reply) = Pending::promised();
        let (sender, progress) = watch::channel(Progress::default());
        let request = Arc::new(Mutex::new(AdvanceRequest::Go));
        let completion = AdvanceCompletion {
            reply: answer,
            request: Arc::clone(&request),
            counts: Arc::clone(counts),
            number,
            progress: sender,
        };
        (completion, TimeAdvance { reply, request, nudge, progress, by_itself })
    }

    /// Pauses the advance, after a few milliseconds at most.
    ///
    /// # Errors
    ///
    /// If time passes by itself: then it cannot be held up.
    pub fn pause(&self) -> Result<(), ControlError> {
        self.unless_by_itself(AdvanceRequest::Pause)
    }

    /// Goes on after a pause. After an input, a condition is forecast again.
    ///
    /// # Errors
    ///
    /// If time passes by itself, so that it has not been paused.
    pub fn resume(&self) -> Result<(), ControlError> {
        self.unless_by_itself(AdvanceRequest::Go)
    }

    /// Cancels the advance, after a few milliseconds at most. The result is
    /// [`ControlError::Cancelled`] then, unless time has arrived before.
    pub fn cancel(&self) {
        self.set_request(AdvanceRequest::Cancel);
    }

    /// The latest progress.
    #[must_use]
    pub fn progress(&self) -> Progress {
        *self.progress.borrow()
    }

    /// The next progress after the one that was returned last; `None` when the advance has ended.
    pub async fn next_progress(&mut self) -> Option<Progress> {
        self.progress.changed().await.ok()?;
        Some(*self.progress.borrow_and_update())
    }

    /// Blocks this thread until the advance has ended.
    pub fn wait(self) -> Result<Time, ControlError> {
        self.reply.wait()
    }

    /// Blocks this thread until the advance has ended, but no longer than this. That does not cancel it.
    pub fn wait_within(self, limit: Duration) -> Result<Time, ControlError> {
        self.reply.wait_within(limit)
    }

    fn unless_by_itself(&self, request: AdvanceRequest) -> Result<(), ControlError> {
        if self.by_itself {
            return Err(ControlError::RunsByItself);
        }
        self.set_request(request);
        Ok(())
    }

    fn set_request(&self, request: AdvanceRequest) {
        let mut present = lock(&self.request);
        // A cancelled advance stays cancelled.
        if *present != AdvanceRequest::Cancel {
            *present = request;
        }
        // If the controller has ended, there is no advance any more.
        let _ = self.nudge.send(());
    }
}

impl Future for TimeAdvance {
    type Output = Result<Time, ControlError>;

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.reply).poll(cx)
    }
}

impl AdvanceCompletion {
    /// How the caller wants the advance to go on.
    pub(crate) fn request(&self) -> AdvanceRequest {
        let is_among = |count: &AtomicU64| self.number < count.load(Ordering::Acquire);
        match *lock(&self.request) {
            _ if is_among(&self.counts.cancelled) => AdvanceRequest::Cancel,
            AdvanceRequest::Go if is_among(&self.counts.unaided) => AdvanceRequest::Unaided,
            request => request,
        }
    }

    pub(crate) fn report(&self, progress: Progress) {
        self.progress.send_if_modified(|known| std::mem::replace(known, progress) != progress);
    }

    /// The advance has ended.
    pub(crate) fn complete(self, result: Result<Time, ControlError>) {
        // The caller may have stopped waiting for the result.
        let _ = self.reply.send(result);
    }
}

/// A request is complete at any time, so a panic elsewhere is no reason to stop.
fn lock(request: &Mutex<AdvanceRequest>) -> MutexGuard<'_, AdvanceRequest> {
    request.lock().unwrap_or_else(PoisonError::into_inner)
}
