//! Waiting without being in the way of anybody.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

use pyo3::prelude::*;

use crate::error;

/// How long the main thread waits until it looks whether there was a signal, such as Ctrl-C. Only it
/// does: Python tells signals to no other thread.
const LOOK: Duration = Duration::from_millis(50);

struct Unpark(Thread);

impl Wake for Unpark {
    fn wake(self: Arc<Self>) {
        self.0.unpark();
    }
}

/// Waits until `poll` has something, without Python's lock; `None` when that has not been by the
/// deadline.
///
/// # Errors
///
/// What a signal's handler raises, `KeyboardInterrupt` above all.
pub(crate) fn wait<T: Send>(
    py: Python<'_>,
    deadline: Option<Instant>,
    mut poll: impl FnMut(&mut Context<'_>) -> Poll<T> + Send,
) -> PyResult<Option<T>> {
    let mut hears_signals = true;
    loop {
        // Also before it is found that there is nothing to wait for: who waits for a great many things, one
        // after the other, may never have to.
        py.check_signals()?;
        let look = hears_signals.then(|| Instant::now() + LOOK);
        let until = match (deadline, look) {
            (Some(deadline), Some(look)) => Some(deadline.min(look)),
            (deadline, look) => deadline.or(look),
        };
        let came = py.detach(|| {
            let waker = Waker::from(Arc::new(Unpark(thread::current())));
            let mut cx = Context::from_waker(&waker);
            loop {
                if let Poll::Ready(output) = poll(&mut cx) {
                    return Some(output);
                }
                match until {
                    None => thread::park(),
                    Some(until) => match until.checked_duration_since(Instant::now()) {
                        Some(left) if !left.is_zero() => thread::park_timeout(left),
                        _ => return None,
                    },
                }
            }
        });
        if came.is_some() {
            return Ok(came);
        }
        if deadline.is_some_and(|deadline| deadline <= Instant::now()) {
            return Ok(None);
        }
        hears_signals = is_main_thread(py)?;
    }
}

/// Waits for what a controller answers.
pub(crate) fn answer<T: Send>(py: Python<'_>, mut pending: vimc4::Pending<T>) -> PyResult<T> {
    match wait(py, None, |cx| Pin::new(&mut pending).poll(cx))? {
        Some(answer) => answer.map_err(|error| error::of_control(py, &error)),
        None => Err(error::broken("it waits without a deadline")),
    }
}

/// The moment at which so many seconds will have passed; `None` if that is never.
pub(crate) fn deadline(seconds: Option<f64>) -> Option<Instant> {
    let seconds = seconds?.max(0.0);
    Instant::now().checked_add(Duration::try_from_secs_f64(seconds).ok()?)
}

fn is_main_thread(py: Python<'_>) -> PyResult<bool> {
    let threading = py.import("threading")?;
    let main = threading.call_method0("main_thread")?.getattr("ident")?;
    main.eq(threading.call_method0("get_ident")?)
}

/// Everything that is shared here is whole at any time, so a panic elsewhere is no reason to stop.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
