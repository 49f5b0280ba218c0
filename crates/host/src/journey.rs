//! Time on its way to somewhere.

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

/// Time that has been sent somewhere, by [`advance`](crate::Handle::advance) or
/// [`run_until`](crate::Handle::run_until): the reply says when it has arrived.
///
/// A long way, such as a program of an hour in manual time, can be watched while it is gone, paused
/// and resumed, and given up. While it is paused time stands still, and the controller can be
/// looked at, asked and operated as at any other moment. Dropping a journey does not end it.
///
/// What is asked, ordered and sent while time is on its way has its turn when it has arrived, so that
/// one thing comes after the other. On a way of more than 100,000 causes, such as one to something
/// that an endless program never does, it has its turn between two of them, at the time that has
/// come by then; a condition is forecast anew if that has changed anything. Other journeys always
/// begin where the one before has ended.
#[derive(Debug)]
#[must_use = "wait for the journey, or its result is lost"]
pub struct Journey {
    reply: Pending<Time>,
    wish: Arc<Mutex<AdvanceRequest>>,
    /// Has the controller look at the wish.
    nudge: mpsc::UnboundedSender<()>,
    progress: watch::Receiver<Progress>,
    by_itself: bool,
}

/// The requests to all journeys of a controller that have been requested so far.
#[derive(Debug, Default)]
pub(crate) struct Wishes {
    /// How many have been asked for.
    asked: AtomicU64,
    /// So many of them are given up.
    cancelled: AtomicU64,
    /// So many of them are given up where they need something from outside.
    unaided: AtomicU64,
}

impl Wishes {
    pub(crate) fn cancel_all(&self) {
        self.cancelled.store(self.asked.load(Ordering::Acquire), Ordering::Release);
    }

    pub(crate) fn leave_unaided(&self) {
        self.unaided.store(self.asked.load(Ordering::Acquire), Ordering::Release);
    }
}

/// The controller's side of a journey.
#[derive(Debug)]
pub(crate) struct Ticket {
    reply: oneshot::Sender<Result<Time, ControlError>>,
    wish: Arc<Mutex<AdvanceRequest>>,
    of_all: Arc<Wishes>,
    /// How many were asked for before it.
    number: u64,
    progress: watch::Sender<Progress>,
}

impl Journey {
    /// A journey in a time that goes by itself, or that does not. `nudge` has the controller look at
    /// what is asked of it.
    pub(crate) fn begin(
        by_itself: bool,
        nudge: mpsc::UnboundedSender<()>,
        of_all: &Arc<Wishes>,
    ) -> (Ticket, Journey) {
        let (of_all, number) = (Arc::clone(of_all), of_all.asked.fetch_add(1, Ordering::AcqRel));
        let (answer, reply) = Pending::promised();
        let (tell, progress) = watch::channel(Progress::default());
        let wish = Arc::new(Mutex::new(AdvanceRequest::Go));
        let ticket =
            Ticket { reply: answer, wish: Arc::clone(&wish), of_all, number, progress: tell };
        (ticket, Journey { reply, wish, nudge, progress, by_itself })
    }

    /// Holds it up, after a few milliseconds at most.
    ///
    /// # Errors
    ///
    /// If time moves by itself: that cannot be held up.
    pub fn pause(&self) -> Result<(), ControlError> {
        self.unless_by_itself(AdvanceRequest::Pause)
    }

    /// Goes on after a pause. If something has gone in meanwhile, a condition is forecast anew.
    ///
    /// # Errors
    ///
    /// If time moves by itself, so that it has not been paused.
    pub fn resume(&self) -> Result<(), ControlError> {
        self.unless_by_itself(AdvanceRequest::Go)
    }

    /// Gives it up, after a few milliseconds at most. The reply is
    /// [`ControlError::Cancelled`] then, unless time has arrived before.
    pub fn cancel(&self) {
        self.wish(AdvanceRequest::Cancel);
    }

    /// How far it had come last.
    #[must_use]
    pub fn progress(&self) -> Progress {
        *self.progress.borrow()
    }

    /// How far it has come, when it has come further than was last told; `None` when it is over.
    pub async fn next_progress(&mut self) -> Option<Progress> {
        self.progress.changed().await.ok()?;
        Some(*self.progress.borrow_and_update())
    }

    /// Blocks this thread until it is over.
    pub fn wait(self) -> Result<Time, ControlError> {
        self.reply.wait()
    }

    /// Blocks this thread until it is over, but no longer than this. That does not cancel it.
    pub fn wait_within(self, limit: Duration) -> Result<Time, ControlError> {
        self.reply.wait_within(limit)
    }

    fn unless_by_itself(&self, wish: AdvanceRequest) -> Result<(), ControlError> {
        if self.by_itself {
            return Err(ControlError::RunsByItself);
        }
        self.wish(wish);
        Ok(())
    }

    fn wish(&self, wish: AdvanceRequest) {
        let mut wished = lock(&self.wish);
        // What is given up is not taken up again.
        if *wished != AdvanceRequest::Cancel {
            *wished = wish;
        }
        // If nobody hears it, there is no journey any more.
        let _ = self.nudge.send(());
    }
}

impl Future for Journey {
    type Output = Result<Time, ControlError>;

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.reply).poll(cx)
    }
}

impl Ticket {
    pub(crate) fn wish(&self) -> AdvanceRequest {
        let of_all = |count: &AtomicU64| self.number < count.load(Ordering::Acquire);
        match *lock(&self.wish) {
            _ if of_all(&self.of_all.cancelled) => AdvanceRequest::Cancel,
            AdvanceRequest::Go if of_all(&self.of_all.unaided) => AdvanceRequest::Unaided,
            wish => wish,
        }
    }

    pub(crate) fn tell(&self, progress: Progress) {
        self.progress.send_if_modified(|told| std::mem::replace(told, progress) != progress);
    }

    /// It is over.
    pub(crate) fn end(self, end: Result<Time, ControlError>) {
        // The caller may have stopped waiting for the answer.
        let _ = self.reply.send(end);
    }
}

/// A wish is whole at any time, so a panic elsewhere is no reason to stop.
fn lock(wish: &Mutex<AdvanceRequest>) -> MutexGuard<'_, AdvanceRequest> {
    wish.lock().unwrap_or_else(PoisonError::into_inner)
}
