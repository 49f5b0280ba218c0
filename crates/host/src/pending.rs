//! A controller's answers to requests through its handles.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Wake, Waker};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

use thiserror::Error;
use tokio::sync::oneshot;
use vimc4_device::{DeedError, Time};

/// Why a controller did not do what it was told.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ControlError {
    /// It is no longer running.
    #[error("the emulator has ended")]
    Ended,
    /// The deed is not possible: it has no such signal, or the signal no such value.
    #[error(transparent)]
    Deed(#[from] DeedError),
    /// Its time cannot be moved.
    #[error("time moves by itself with this clock; use the manual clock to move it")]
    RunsByItself,
    /// Its time stands still.
    #[error("time is paused; step, or resume it first")]
    Paused,
    /// Its time goes on, and only a controller whose time is paused is led step by step.
    #[error("time goes on; pause it first")]
    NotPaused,
    /// It cannot do that, being what it is or as it was set up; the words say what to do instead.
    #[error("{0}")]
    Unsupported(&'static str),
    /// The journey through time was cancelled.
    #[error("given up at {at}; what would have happened later has not")]
    Cancelled {
        /// The controller's time then.
        at: Time,
    },
    /// The awaited event has not happened in this time.
    #[error("nothing within {0:?}; it may come later, or never")]
    Late(Duration),
    /// It runs on, perhaps without end, and the condition does not hold as far as was looked ahead:
    /// [`MAX_CAUSES`](vimc4_device::MAX_CAUSES) causes.
    #[error("not by {until}, as far as is looked ahead; `advance` goes further")]
    Unforeseen {
        /// The controller's time then.
        until: Time,
    },
    /// It comes to rest, and the condition never holds.
    #[error(
        "this never happens unless something else does first; give the command or the order that \
         leads there before"
    )]
    Never,
}

/// An answer that is on its way.
#[derive(Debug)]
#[must_use = "wait for the reply, or its result is lost"]
pub struct Pending<T>(oneshot::Receiver<Result<T, ControlError>>);

impl<T> Pending<T> {
    /// A reply that comes when somebody gives the answer. If nobody will, it says that the
    /// emulator has ended.
    pub fn promised() -> (oneshot::Sender<Result<T, ControlError>>, Pending<T>) {
        let (answer, reply) = oneshot::channel();
        (answer, Pending(reply))
    }

    /// Blocks this thread until the answer is there.
    pub fn wait(self) -> Result<T, ControlError> {
        block_on(self)
    }

    /// Blocks this thread until the answer is there, but no longer than this.
    pub fn wait_within(self, limit: Duration) -> Result<T, ControlError> {
        block_until(self, Instant::now().checked_add(limit))
            .unwrap_or(Err(ControlError::Late(limit)))
    }
}

impl<T> Future for Pending<T> {
    type Output = Result<T, ControlError>;

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.0).poll(cx).map(|reply| reply.unwrap_or(Err(ControlError::Ended)))
    }
}

/// Waits for a future on this thread. The executors of tokio refuse to do so inside of tasks;
/// this one does what it is told, so the blocking methods work everywhere.
pub fn block_on<F: Future + Unpin>(mut future: F) -> F::Output {
    loop {
        // Without a deadline it does not give up.
        if let Some(output) = block_until(&mut future, None) {
            return output;
        }
    }
}

/// The same up to a moment.
fn block_until<F: Future + Unpin>(future: F, deadline: Option<Instant>) -> Option<F::Output> {
    struct Unpark(Thread);

    impl Wake for Unpark {
        fn wake(self: Arc<Self>) {
            self.0.unpark();
        }
    }

    let waker = Waker::from(Arc::new(Unpark(thread::current())));
    let mut cx = Context::from_waker(&waker);
    // Inside of a task tokio would hold back what is ready after a hundred such waits, until the
    // task comes to a pause. It will not: it is blocked here.
    let mut future = tokio::task::unconstrained(future);
    loop {
        if let Poll::Ready(output) = Pin::new(&mut future).poll(&mut cx) {
            return Some(output);
        }
        match deadline {
            None => thread::park(),
            Some(deadline) => match deadline.checked_duration_since(Instant::now()) {
                Some(left) if !left.is_zero() => thread::park_timeout(left),
                _ => return None,
            },
        }
    }
}
