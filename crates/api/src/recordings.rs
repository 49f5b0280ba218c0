//! Recordings: those that are kept anyway, and those that a client begins.

use std::sync::{Mutex, MutexGuard, PoisonError};

use vimc4::RecordingFile;

/// What is recorded of a controller.
#[derive(Debug)]
pub(crate) struct Recordings {
    /// Begun by a client.
    own: Mutex<Option<RecordingFile>>,
    /// Begun with the controller.
    other: Option<RecordingFile>,
}

impl Recordings {
    pub(crate) fn beside(other: Option<&RecordingFile>) -> Recordings {
        Recordings { own: Mutex::default(), other: other.cloned() }
    }

    pub(crate) fn own(&self) -> MutexGuard<'_, Option<RecordingFile>> {
        self.own.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The one that is read.
    pub(crate) fn present(&self) -> Option<RecordingFile> {
        self.own().clone().or_else(|| self.other.clone())
    }
}
