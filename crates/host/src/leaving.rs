//! What leaves a device at one time.

use bytes::Bytes;
use vimc4_device::Time;

use crate::wire::CHUNK;

/// What leaves the device at one time, so that it costs one write.
#[derive(Default)]
pub(crate) struct Leaving {
    first: Option<(Time, Bytes)>,
    /// All of it, if it is more than the first.
    all: Vec<u8>,
}

impl Leaving {
    /// Whether something that is said at a time belongs to it, and there is room.
    pub(crate) fn is_at(&self, at: Time) -> bool {
        self.all.len() < CHUNK && self.first.as_ref().is_none_or(|(first, _)| *first == at)
    }

    pub(crate) fn add(&mut self, at: Time, bytes: Bytes) {
        match &self.first {
            None => self.first = Some((at, bytes)),
            Some((_, first)) => {
                if self.all.is_empty() {
                    self.all.extend_from_slice(first);
                }
                self.all.extend_from_slice(&bytes);
            }
        }
    }

    pub(crate) fn take(&mut self) -> Option<(Time, Bytes)> {
        let (at, first) = self.first.take()?;
        let all = std::mem::take(&mut self.all);
        Some((at, if all.is_empty() { first } else { all.into() }))
    }
}
