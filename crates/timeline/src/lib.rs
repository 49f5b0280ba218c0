//! The history of a simulated device: what happened, why, and what else could have happened.
//!
//! What a device does follows from its state, its inputs and their times alone. So its whole past
//! is its first state and its inputs: giving the inputs again brings back any moment. A [`History`]
//! keeps them, with some states on the way so that this is quick. It stands at one moment and moves
//! like a tape, forward and back, by single causes or to any time. An input that is given in the
//! past does not erase what came after it: it begins a branch.
#![forbid(unsafe_code)]

mod history;
mod moment;
pub mod recording;
mod search;
mod snapshots;
mod stretch;
mod tape;
mod waypoints;

pub use history::{Branch, History, Known, Limits, Usage};
pub use moment::{Act, BranchId, Moment, Place};
pub use search::{Begins, Found, Progress, Sought, Which};
pub use stretch::Stretch;
