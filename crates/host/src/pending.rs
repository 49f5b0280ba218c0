//! A controller's answers to requests through its handles.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Wake, Waker};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

use tokio::sync::oneshot;

use crate::ControlError;

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
