//! Somebody is told that something has happened.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use tokio::sync::Notify;
use vimc4_answers::feed::Ring;

/// Rings when something has happened anywhere, if anybody listens.
#[derive(Debug, Default)]
pub(crate) struct Bell {
    listeners: AtomicUsize,
    rings: Notify,
}

/// Somebody who wants to hear the bell.
#[derive(Debug)]
pub(crate) struct Listener(Arc<Bell>);

impl Bell {
    pub(crate) fn listen(self: &Arc<Bell>) -> Listener {
        self.listeners.fetch_add(1, Ordering::AcqRel);
        Listener(Arc::clone(self))
    }

    /// Resolves when something has happened since the last time.
    pub(crate) async fn rung(&self) {
        self.rings.notified().await;
    }

    /// What rings it.
    pub(crate) fn ringer(self: &Arc<Bell>) -> Ring {
        let bell = Arc::clone(self);
        Arc::new(move || bell.ring())
    }

    fn ring(&self) {
        if self.listeners.load(Ordering::Acquire) > 0 {
            self.rings.notify_one();
        }
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.0.listeners.fetch_sub(1, Ordering::AcqRel);
    }
}
