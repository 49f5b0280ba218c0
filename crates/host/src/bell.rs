//! Asking only what has called.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

/// Stands between a task and one of the many things it waits for, and asks that thing only when it
/// has called since it was asked last.
///
/// A task that is woken does not know by what. To ask everything costs more than a controller takes
/// for its answer; to look at a bell costs a load from memory. The thing behind a bell has to wake
/// the asking task whenever there is something new, and must not be changed unnoticed: after a
/// change the bell has to be [rung](Bell::ring).
#[derive(Debug, Default)]
pub(crate) struct Bell(Option<Arc<Rope>>);

/// What is pulled to wake the task.
#[derive(Debug)]
struct Rope {
    rung: AtomicBool,
    task: Waker,
}

impl Wake for Rope {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.rung.store(true, Ordering::Release);
        self.task.wake_by_ref();
    }
}

impl Bell {
    /// Asks, if the bell was rung; the first time, and for another task, always. What has an answer
    /// may have more and is asked again.
    pub(crate) fn answer<T>(
        &mut self,
        cx: &mut Context<'_>,
        ask: impl FnOnce(&mut Context<'_>) -> Poll<T>,
    ) -> Poll<T> {
        let rope = match &self.0 {
            Some(rope) if rope.task.will_wake(cx.waker()) => {
                // Nothing is lost between the look and the swap: it stays rung until it is asked.
                if !rope.rung.load(Ordering::Relaxed) || !rope.rung.swap(false, Ordering::Acquire) {
                    return Poll::Pending;
                }
                Arc::clone(rope)
            }
            _ => {
                let task = cx.waker().clone();
                let rope = Arc::new(Rope { rung: AtomicBool::new(false), task });
                self.0 = Some(Arc::clone(&rope));
                rope
            }
        };
        let waker = Waker::from(rope);
        let answer = ask(&mut Context::from_waker(&waker));
        if answer.is_ready() {
            self.ring();
        }
        answer
    }

    /// It is asked again next time.
    pub(crate) fn ring(&mut self) {
        if let Some(rope) = &self.0 {
            rope.rung.store(true, Ordering::Release);
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
    fn only_what_has_called_is_asked() {
        let task = Arc::new(Task::default());
        let waker = Waker::from(Arc::clone(&task));
        let mut cx = Context::from_waker(&waker);
        let mut bell = Bell::default();
        let (mut asked, mut kept) = (0, None);
        let mut ask = |bell: &mut Bell, cx: &mut Context<'_>, answer: Poll<u8>| {
            let answer = bell.answer(cx, |cx| {
                asked += 1;
                kept = Some(cx.waker().clone());
                answer
            });
            (answer, asked, kept.clone())
        };
        let (_, asked, kept) = ask(&mut bell, &mut cx, Poll::Pending);
        assert_eq!(asked, 1);
        assert_eq!(ask(&mut bell, &mut cx, Poll::Ready(1)).1, 1);
        // It calls: the task is woken, and asks until there is nothing more.
        kept.unwrap().wake();
        assert_eq!(task.0.load(Ordering::Relaxed), 1);
        assert_eq!(ask(&mut bell, &mut cx, Poll::Ready(1)).1, 2);
        assert_eq!(ask(&mut bell, &mut cx, Poll::Pending).1, 3);
        assert_eq!(ask(&mut bell, &mut cx, Poll::Ready(1)).1, 3);
        // It is rung for what was changed, and begins anew with another task.
        bell.ring();
        assert_eq!(ask(&mut bell, &mut cx, Poll::Pending).1, 4);
        let other = Waker::from(Arc::new(Task::default()));
        assert_eq!(ask(&mut bell, &mut Context::from_waker(&other), Poll::Pending).1, 5);
    }
}
