//! Ending what is under way.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Whether somebody wants what is under way to end.
#[derive(Clone, Default)]
pub(crate) struct Cancel {
    wished: Arc<AtomicBool>,
    /// Another place to look whether to cancel: the keyboard, where Ctrl-C is a key like others.
    pub(crate) look: Option<fn() -> bool>,
    /// What ends what is under way elsewhere: the controller that runs is paused.
    elsewhere: Arc<Mutex<Option<End>>>,
}

type End = Box<dyn Fn() + Send>;

impl Cancel {
    pub(crate) fn wish(&self) {
        self.wished.store(true, Ordering::Relaxed);
        let elsewhere = self.elsewhere.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(end) = &*elsewhere {
            end();
        }
    }

    /// Nobody wants that any more.
    pub(crate) fn forget(&self) {
        self.wished.store(false, Ordering::Relaxed);
    }

    pub(crate) fn is_wished(&self) -> bool {
        self.wished.load(Ordering::Relaxed) || self.look.is_some_and(|look| look())
    }

    /// What there is to do elsewhere so that it ends.
    pub(crate) fn also(&self, end: Option<End>) {
        *self.elsewhere.lock().unwrap_or_else(PoisonError::into_inner) = end;
    }
}
