//! Polling only what has called its waker.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

/// Stands between a task and one of the many futures it waits for, and polls that future only when it
/// has called its waker since the last poll.
///
/// A task that is woken does not know by which future. To poll all of them costs more than a
/// controller takes for its reply. To look at a flag costs a load from memory. The future behind a flag
/// has to call its waker whenever there is something new. A future that is replaced needs another flag.
#[derive(Debug, Default)]
pub(crate) struct WakeFlag(Option<Arc<FlagWaker>>);

/// Raises the flag, and wakes the task.
#[derive(Debug)]
struct FlagWaker {
    is_raised: AtomicBool,
    task: Waker,
}

impl Wake for FlagWaker {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.is_raised.store(true, Ordering::Release);
        self.task.wake_by_ref();
    }
}

impl WakeFlag {
    /// Polls if the flag is raised; the first time, and for another task, always. A future that is ready
    /// may have more and is polled again.
    pub(crate) fn poll<T>(
        &mut self,
        cx: &mut Context<'_>,
        poll: impl FnOnce(&mut Context<'_>) -> Poll<T>,
    ) -> Poll<T> {
        let flag = match &self.0 {
            Some(flag) if flag.task.will_wake(cx.waker()) => {
                // Nothing is lost between load and swap: the flag stays raised until the poll.
                if !flag.is_raised.load(Ordering::Relaxed)
                    || !flag.is_raised.swap(false, Ordering::Acquire)
                {
                    return Poll::Pending;
                }
                Arc::clone(flag)
            }
            _ => {
                let task = cx.waker().clone();
                let flag = Arc::new(FlagWaker { is_raised: AtomicBool::new(false), task });
                self.0 = Some(Arc::clone(&flag));
                flag
            }
        };
        let waker = Waker::from(flag);
        let result = poll(&mut Context::from_waker(&waker));
        if result.is_ready() {
            self.raise();
        }
        result
    }

    /// Has the future polled next time.
    fn raise(&self) {
        if let Some(flag) = &self.0 {
            flag.is_raised.store(true, Ordering::Release);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU32;

    use super::*;

    #[derive(Debug, Default)]
    struct Task(AtomicU32);

    impl Wake for Task {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn only_a_future_that_has_called_is_polled() {
        let task = Arc::new(Task::default());
        let waker = Waker::from(Arc::clone(&task));
        let mut cx = Context::from_waker(&waker);
        let mut flag = WakeFlag::default();
        let (mut asked, mut kept) = (0, None);
        let mut ask = |flag: &mut WakeFlag, cx: &mut Context<'_>, answer: Poll<u8>| {
            let answer = flag.poll(cx, |cx| {
                asked += 1;
                kept = Some(cx.waker().clone());
                answer
            });
            (answer, asked, kept.clone())
        };
        let (_, asked, kept) = ask(&mut flag, &mut cx, Poll::Pending);
        assert_eq!(asked, 1);
        assert_eq!(ask(&mut flag, &mut cx, Poll::Ready(1)).1, 1);
        // It calls: the task is woken, and polls until there is nothing more.
        kept.unwrap().wake();
        assert_eq!(task.0.load(Ordering::Relaxed), 1);
        assert_eq!(ask(&mut flag, &mut cx, Poll::Ready(1)).1, 2);
        assert_eq!(ask(&mut flag, &mut cx, Poll::Pending).1, 3);
        assert_eq!(ask(&mut flag, &mut cx, Poll::Ready(1)).1, 3);
        // The flag can be raised by hand, and another task polls at once.
        flag.raise();
        assert_eq!(ask(&mut flag, &mut cx, Poll::Pending).1, 4);
        let other = Waker::from(Arc::new(Task::default()));
        assert_eq!(ask(&mut flag, &mut Context::from_waker(&other), Poll::Pending).1, 5);
    }
}
