//! What is ended in order, also if somebody ends the program before it is finished.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::endings;
use crate::failure::Failure;

/// Something that is written until it is ended: by who writes it, or by Ctrl-C. Only one of them does it.
pub(crate) struct Kept<T>(Arc<Mutex<Option<T>>>);

impl<T> Kept<T> {
    /// Something that nobody but its owner ends.
    pub(crate) fn new(thing: T) -> Kept<T> {
        Kept(Arc::new(Mutex::new(Some(thing))))
    }

    /// Writes on it. Once somebody ends the program this does not come back.
    pub(crate) fn with<R>(&self, write: impl FnOnce(&mut T) -> R) -> R {
        self.lock().as_mut().map(write).unwrap_or_else(|| endings::wait_for_end())
    }

    /// Ends it. Whoever else ends it waits for that.
    pub(crate) fn finish<R>(self, end: impl FnOnce(T) -> R) -> R {
        let mut thing = self.lock();
        thing.take().map(end).unwrap_or_else(|| endings::wait_for_end())
    }

    fn lock(&self) -> MutexGuard<'_, Option<T>> {
        if endings::has_begun() {
            endings::wait_for_end();
        }
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T: Send + 'static> Kept<T> {
    /// Has it ended like this if somebody ends the program before it is finished.
    ///
    /// # Errors
    ///
    /// If the system has no means to wait for that.
    pub(crate) fn ended(
        self,
        end: impl FnOnce(T) -> Result<(), Failure> + Send + 'static,
    ) -> Result<Kept<T>, Failure> {
        let kept = Arc::clone(&self.0);
        endings::before_end(move || {
            let mut thing = kept.lock().unwrap_or_else(PoisonError::into_inner);
            thing.take().map_or(Ok(()), end)
        })?;
        Ok(self)
    }
}
