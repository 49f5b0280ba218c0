//! The threads that controllers run on.

use std::future::Future;
use std::io;
use std::sync::Arc;
use std::thread::{self, JoinHandle, ThreadId};

use tokio::runtime::{self, EnterGuard, Handle};
use tokio::sync::oneshot;

/// A thread with an event queue, on which any number of controllers run.
///
/// A controller costs a task, not a thread: a thousand idle ones share one without using it.
/// Controllers of one worker take turns, each for a few milliseconds at most; what must not
/// wait for a neighbour has a worker of its own.
///
/// Copies are the same worker. It ends with the last of them, and with it what still runs there.
#[derive(Clone, Debug)]
pub struct Worker(Arc<Thread>);

#[derive(Debug)]
struct Thread {
    runtime: Handle,
    id: ThreadId,
    stop: Option<oneshot::Sender<()>>,
    /// `None` if it belongs to somebody else.
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts a thread of this name.
    ///
    /// # Errors
    ///
    /// If the system gives no thread or no event queue.
    pub fn start(name: &str) -> io::Result<Worker> {
        let runtime = runtime::Builder::new_current_thread().enable_all().build()?;
        let handle = runtime.handle().clone();
        let (stop, stopped) = oneshot::channel();
        let thread = thread::Builder::new().name(name.to_owned()).spawn(move || {
            // Either word means the end: that it shall stop, or that nobody can say so any more.
            let _ = runtime.block_on(stopped);
        })?;
        Ok(Worker(Arc::new(Thread {
            runtime: handle,
            id: thread.thread().id(),
            stop: Some(stop),
            thread: Some(thread),
        })))
    }

    /// This thread, which has to be in a current-thread runtime of tokio with everything
    /// enabled. Controllers run on it whenever it awaits something, so it must not block for
    /// them, as [`Pending::wait`](crate::Pending::wait) does.
    #[must_use]
    pub fn here() -> Worker {
        let runtime = Handle::current();
        Worker(Arc::new(Thread { runtime, id: thread::current().id(), stop: None, thread: None }))
    }

    /// Whether this is the worker's thread.
    #[must_use]
    pub fn is_here(&self) -> bool {
        self.0.id == thread::current().id()
    }

    /// While the guard lives, transports that this thread opens belong to the worker.
    pub fn enter(&self) -> EnterGuard<'_> {
        self.0.runtime.enter()
    }

    /// Runs something on the worker.
    pub fn spawn(&self, work: impl Future<Output = ()> + Send + 'static) {
        // The task ends by itself or with the worker; nobody waits for its handle.
        drop(self.0.runtime.spawn(work));
    }
}

impl Drop for Thread {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take()
            && self.id != thread::current().id()
        {
            // A panic in one of its tasks has been printed already.
            let _ = thread.join();
        }
    }
}
