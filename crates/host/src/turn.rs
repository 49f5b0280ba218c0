//! A turn for the reactor.

use std::future::{Future, poll_fn};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

use tokio::task::yield_now;

/// Lets the reactor look at the world, and comes back when it has. [`yield_now`] by itself comes
/// back as soon as anything wakes the task, and the control that has just been used does.
pub(crate) async fn reactor_turn() {
    struct Turn {
        task: Waker,
        over: AtomicBool,
    }

    impl Wake for Turn {
        fn wake(self: Arc<Self>) {
            self.over.store(true, Ordering::Release);
            self.task.wake_by_ref();
        }
    }

    let mut turn: Option<Arc<Turn>> = None;
    poll_fn(move |cx| {
        if let Some(turn) = &turn {
            return if turn.over.load(Ordering::Acquire) { Poll::Ready(()) } else { Poll::Pending };
        }
        let begun = Arc::new(Turn { task: cx.waker().clone(), over: AtomicBool::new(false) });
        let waker = Waker::from(Arc::clone(&begun));
        turn = Some(begun);
        pin!(yield_now()).poll(&mut Context::from_waker(&waker))
    })
    .await;
}
