//! Why an expectation is not met, before that is put into words.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use vimc4_device::Time;

/// Why an expectation is not met, before that is put into words.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Failed {
    pub(super) at: Time,
    /// The entry that shows it; `None` if it is between two.
    pub(super) entry: Option<u64>,
    pub(super) why: Why,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Why {
    /// A clause has come only this many times, and the watch is over.
    Missing { stage: usize, clause: usize, came: u64 },
    /// A clause has come this many times, which is too many.
    TooOften { stage: usize, clause: usize, came: u64 },
    /// A stage has begun this soon after the one before, which is too soon.
    TooEarly { stage: usize, clause: usize, waited: Duration },
    /// A stage was not complete in time.
    TooLate { stage: usize, clause: usize, came: u64 },
    /// The state of a rule did not hold, or only since then.
    NotHeld { since: Option<Time> },
    /// What had to follow has not, in time or at all.
    NotFollowed { began: Time, over: bool },
    /// What a rule is about has never happened.
    NeverCame,
    /// This many entries at the beginning have been dropped.
    Forgotten { dropped: u64 },
}

impl Failed {
    /// Which sort of failure it is.
    pub(super) fn reason(&self) -> Reason {
        match self.why {
            Why::Missing { .. } => Reason::Missing,
            Why::TooOften { .. } => Reason::TooOften,
            Why::TooEarly { .. } => Reason::TooEarly,
            Why::TooLate { .. } => Reason::TooLate,
            Why::NotHeld { .. } => Reason::NotHeld,
            Why::NotFollowed { .. } => Reason::NotFollowed,
            Why::NeverCame => Reason::NeverCame,
            Why::Forgotten { .. } => Reason::Forgotten,
        }
    }
}

/// Sorts of failures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Reason {
    /// Something has not come, or not often enough.
    Missing,
    /// Something has come too often, or at all.
    TooOften,
    /// Something has come too soon after what was before.
    TooEarly,
    /// Something has not come in time.
    TooLate,
    /// A state did not hold, or not for long enough.
    NotHeld,
    /// What had to follow has not.
    NotFollowed,
    /// What a rule is about has never happened.
    NeverCame,
    /// The oldest entries are no longer in the journal.
    Forgotten,
}
