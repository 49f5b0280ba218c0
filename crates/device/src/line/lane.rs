//! One direction of the line, on which characters take their time.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::Time;

/// A character is a start bit, eight data bits and a stop bit.
pub(super) const BITS: u64 = 10;

/// One direction of the line. Characters follow each other without gaps from `start` on; the
/// time of each is computed from there, so that rounding never adds up.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Lane {
    queue: VecDeque<u8>,
    start: Time,
    passed: u64,
    baud: u32,
}

impl Lane {
    pub(super) fn push(&mut self, bytes: &[u8], at: Time, baud: u32) {
        if self.queue.is_empty() {
            (self.start, self.passed, self.baud) = (at, 0, baud);
        }
        self.queue.extend(bytes);
    }

    pub(super) fn len(&self) -> usize {
        self.queue.len()
    }

    pub(super) fn first(&self) -> Option<u8> {
        self.queue.front().copied()
    }

    /// When the stop bit of the first character will have passed.
    pub(super) fn due(&self) -> Option<Time> {
        (!self.queue.is_empty()).then(|| {
            let span = span_of((self.passed + 1) * BITS, self.baud);
            self.start.after_nanos(span)
        })
    }

    /// Takes the first character, whose stop bit passes now; the next one has the speed of now.
    pub(super) fn pop(&mut self, baud: u32) -> Option<u8> {
        let due = self.due()?;
        let byte = self.queue.pop_front()?;
        if self.queue.is_empty() {
            // An empty lane has one form only, so that equal lines compare equal.
            *self = Lane::default();
        } else if baud == self.baud {
            self.passed += 1;
        } else {
            (self.start, self.passed, self.baud) = (due, 0, baud);
        }
        Some(byte)
    }
}

/// How long this many bits take, in nanoseconds; 0 at speed 0, that of a line on which characters
/// take no time.
pub(super) fn span_of(bits: u64, baud: u32) -> u64 {
    if baud == INSTANT {
        return 0;
    }
    let span = (u128::from(bits) * 1_000_000_000).div_ceil(u128::from(baud));
    u64::try_from(span).unwrap_or(u64::MAX)
}

/// The speed of a line on which characters take no time.
pub(super) const INSTANT: u32 = 0;
