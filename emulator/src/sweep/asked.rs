//! What is being found out, so that it is not found out twice at the same time.

use std::collections::BTreeSet;
use std::sync::{Condvar, Mutex, PoisonError};

use vimc4::sweep::Moment;

/// The moments to which a run is on its way.
#[derive(Default)]
pub(super) struct Asked {
    moments: Mutex<BTreeSet<Moment>>,
    ended: Condvar,
}

/// A run that is on its way to a moment, until this is dropped.
pub(super) struct Asking<'a> {
    asked: &'a Asked,
    moment: Moment,
}

impl Asked {
    /// Somebody goes to a moment. If another is on its way there already, waits for it instead.
    pub(super) fn begin(&self, moment: Moment) -> Option<Asking<'_>> {
        let mut moments = self.moments.lock().unwrap_or_else(PoisonError::into_inner);
        if moments.insert(moment.clone()) {
            return Some(Asking { asked: self, moment });
        }
        drop(self.ended.wait_while(moments, |moments| moments.contains(&moment)));
        None
    }
}

impl Drop for Asking<'_> {
    fn drop(&mut self) {
        let mut moments = self.asked.moments.lock().unwrap_or_else(PoisonError::into_inner);
        moments.remove(&self.moment);
        self.asked.ended.notify_all();
    }
}
