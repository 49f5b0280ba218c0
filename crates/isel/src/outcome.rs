//! What a part of the firmware leads to.

use crate::activity::{Plan, Purpose};
use crate::why::{By, Why};

/// What has to happen next because of what a motion, a stop or a line of a program has come to.
/// Only `dispatch` acts on it, so that none of these needs to know who comes after it.
#[derive(Debug)]
#[must_use = "it must be dispatched"]
pub(crate) enum Outcome {
    /// Nothing: what is under way goes on, or all is done.
    Nothing,
    /// What was done as a job is over, well or with an error.
    Finished(Purpose, Result<(), Why>),
    /// The motion of a job has stopped, and this is left of it.
    Stopped(Purpose, Plan, By),
    /// The program halts and waits to be started again.
    ProgramHalts(By),
    /// The program is over, well or with an error.
    ProgramEnds(Result<(), Why>),
}
