//! A controller in a group.

use std::collections::VecDeque;

use vimc4_catalogue::Controller;
use vimc4_device::{Harness, Kinds, Output};

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
