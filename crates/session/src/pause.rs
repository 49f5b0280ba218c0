//! Time stands still.

use vimc4_device::Time;

use crate::{BreakpointId, Source};

/// Time is paused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pause {
    /// The controller's time when it was paused.
    pub at: Time,
    /// The source of the pause; `None` if it was a breakpoint that is listed here.
    pub by: Option<Source>,
    /// The breakpoints that were met.
    pub breakpoints: Vec<BreakpointId>,
}

/// What a step has done while time is paused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The device has done one thing by itself.
    Cause,
    /// An input has gone in that had waited behind what was due.
    Input,
    /// Nothing but time has passed, up to where a breakpoint is met.
    Time,
    /// Nothing: the device waits for an input.
    Rest,
}
