//! What a part of the firmware leads to.

use crate::activity::{Plan, Purpose};
use crate::why::{By, Why};

/// What has to happen next as a consequence of a motion, a stop or a line of a program. Only
/// `dispatch` acts on it, so that none of these needs to know what comes after it.
#[derive(Debug)]
#[must_use = "it must be dispatched"]
pub(crate) enum Outcome {
    /// Nothing: the activity goes on, or everything is done.
    Nothing,
    /// A job has ended, with success or an error.
    Finished(Purpose, Result<(), Why>),
    /// The motion of a job has stopped, and this is left of it.
    Stopped(Purpose, Plan, By),
    /// The program halts and waits to be started again.
    ProgramHalts(By),
    /// The program has ended, with success or an error.
    ProgramEnds(Result<(), Why>),
}
