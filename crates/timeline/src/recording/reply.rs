//! The bytes of one reply, recorded or emulated.

use std::fmt;

use vimc4_device::{Time, escape};

/// The bytes of one reply follow each other within this many nanoseconds.
pub(super) const PAUSE: u64 = 3_000_000;

/// The most bytes of a reply that are kept.
const BYTES_MAX: usize = 256;

/// The bytes of a reply. There may be none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reply {
    /// The bytes, the first 256 of them.
    pub bytes: Vec<u8>,
    /// The time of the first byte.
    pub first: Option<Time>,
    /// The time of the last byte.
    pub last: Option<Time>,
}

impl Reply {
    pub(super) fn push(&mut self, (at, byte): (Time, u8)) {
        self.first.get_or_insert(at);
        self.last = Some(at);
        if self.bytes.len() < BYTES_MAX {
            self.bytes.push(byte);
        }
    }
}

impl fmt::Display for Reply {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.bytes.is_empty() {
            true => f.write_str("nothing"),
            false => f.write_str(&escape(&self.bytes)),
        }
    }
}
