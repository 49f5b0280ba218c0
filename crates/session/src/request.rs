//! Requests that complete later.

use std::time::Duration;

use vimc4_device::{Condition, Time};

use crate::{ControlError, Pause};

/// The number of a request, which its [completion](Completion) names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RequestId(pub(crate) u64);

/// The end of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Completion {
    /// Time has arrived at its destination, or never will.
    Advanced(Result<Time, ControlError>),
    /// Time is paused.
    Paused(Pause),
}

/// Where time is to go.
#[derive(Clone, Debug, PartialEq)]
pub enum Destination {
    /// So much later.
    After(Duration),
    /// The first instant at which a condition holds.
    Until(Condition),
}

/// How the caller wants a request to go on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdvanceRequest {
    /// Go on.
    #[default]
    Go,
    /// Stop where time is, until further notice.
    Pause,
    /// Go on as long as no input is needed for it.
    Unaided,
    /// Give up.
    Cancel,
}

/// The progress of time that advances to a destination.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The controller's time.
    pub now: Time,
    /// The destination; `None` while the condition is still being forecast.
    pub to: Option<Time>,
    /// It is paused.
    pub paused: bool,
}

/// What is left to do after a unit of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// Nothing is due now.
    Idle,
    /// More is due now.
    More,
    /// More is due now, but inputs that have arrived come first.
    Yield,
}
