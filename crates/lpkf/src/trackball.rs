//! The trackball.

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::Time;

use crate::language::Trackball;

/// How often a position is sent, ns.
const PERIOD: u64 = 1_000_000_000;

/// A trackball and what it is used for.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Ball {
    /// The axis that it moves.
    pub(crate) axis: u8,
    /// What it is open for.
    pub(crate) open: Option<Trackball>,
    /// When the next position is sent.
    pub(crate) due: Option<Time>,
    /// By how many steps it was turned while the axis still moved.
    pub(crate) waiting: i64,
}

impl Ball {
    /// `!OI`.
    pub(crate) fn open(&mut self, use_of: Trackball, now: Time) {
        self.open = Some(use_of);
        self.due = (use_of == Trackball::MoveAndReport).then(|| now.after_nanos(PERIOD));
    }

    /// `!CI`, and what remains after `IN`: the axis is chosen at the ball.
    pub(crate) fn close(&mut self) {
        *self = Ball { axis: self.axis, ..Ball::default() };
    }

    /// A second has passed, and the axis is at a place that is sent now.
    pub(crate) fn report_place(&mut self, place: i64, now: Time) -> Bytes {
        self.due = Some(now.after_nanos(PERIOD));
        format!("A{place}\r").into()
    }

    /// The ball was turned by this many steps each way. Returns what is sent of that.
    pub(crate) fn turned(&mut self, x: i64, y: i64) -> Option<Bytes> {
        match self.open? {
            Trackball::Report => return Some(format!("B{x},{y}\r").into()),
            Trackball::Move | Trackball::MoveAndReport => self.waiting += x,
        }
        None
    }
}
