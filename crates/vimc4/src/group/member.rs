//! A controller in a group.

use std::collections::VecDeque;

use vimc4_catalogue::Controller;
use vimc4_device::{DeedError, Device as _, Harness, Kinds, Output, SignalId, settable};

/// A controller of the group that it has joined, and of its copies. Another group panics that has fewer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Member(pub(super) usize);

/// A controller, and what has come out of it.
#[derive(Clone, Debug)]
pub(super) struct Seat {
    pub(super) harness: Harness<Controller>,
    /// The kinds of events that are kept.
    pub(super) kept: Kinds,
    pub(super) outputs: VecDeque<Output>,
}

impl Seat {
    /// The signal of this name, if it takes this value.
    pub(super) fn setting(&self, name: &str, value: i32) -> Result<SignalId, DeedError> {
        settable(&self.harness.device().signals(), name, value).map(|signal| signal.id)
    }
}
