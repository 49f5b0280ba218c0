//! Bytes that a device sends at one time.

use bytes::Bytes;
use vimc4_device::Time;

/// The most bytes that are gathered into one write, give or take one output of the device.
const LONGEST: usize = 1_024;

/// Gathers the bytes that a device sends at one time, so that they cost one write.
#[derive(Default)]
pub(crate) struct Transmission {
    first: Option<(Time, Bytes)>,
    /// All bytes, if there are more than in `first`.
    all: Vec<u8>,
}

impl Transmission {
    /// Whether bytes sent at this time belong to it, and there is space for them.
    pub(crate) fn has_space_at(&self, at: Time) -> bool {
        self.all.len() < LONGEST && self.first.as_ref().is_none_or(|(first, _)| *first == at)
    }

    /// Adds bytes.
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

    /// Takes all bytes, and their time.
    pub(crate) fn take(&mut self) -> Option<(Time, Bytes)> {
        let (at, first) = self.first.take()?;
        let all = std::mem::take(&mut self.all);
        Some((at, if all.is_empty() { first } else { all.into() }))
    }
}
