//! The history of a simulated device: what was, how it came to be, and what else could have been.
//!
//! A device decides everything it does by its state and by the inputs that it gets and when. So
//! its whole past is its first state and its inputs: any moment of it comes back by giving the
//! inputs again. A [`History`] keeps them, with some states on the way so that this is quick, and
//! stands at one moment, like a tape in a recorder: forward and back, by single causes or to any
//! time. An input that is given in the past does not erase what came after it: it begins a
//! branch.
#![forbid(unsafe_code)]

mod history;
mod moment;
pub mod recording;
mod search;
mod snapshots;
mod stretch;
mod tape;

pub use history::{Branch, History, Limits, Usage};
pub use moment::{Act, BranchId, Moment, Place};
pub use search::{Begins, Found, Progress, Sought, Which};
pub use stretch::Stretch;
