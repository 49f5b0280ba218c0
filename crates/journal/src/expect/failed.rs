//! Why an expectation is not met, before that is put into words.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use vimc4_device::Time;

/// Why an expectation is not met, before that is put into words.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Failed {
    pub(super) at: Time,
    /// The entry in which it shows; `None` if it is between two.
    pub(super) entry: Option<u64>,
    pub(super) why: Why,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Why {
    /// A clause has come no more than so many times, and it is over.
    Missing { stage: usize, clause: usize, came: u64 },
    /// A clause has come so many times.
    TooOften { stage: usize, clause: usize, came: u64 },
    /// A stage has begun so soon after the one before.
    TooEarly { stage: usize, clause: usize, waited: Duration },
    /// A stage was not complete in time.
    TooLate { stage: usize, clause: usize, came: u64 },
    /// The state of a rule was not so, or only since then.
    NotHeld { since: Option<Time> },
    /// What had to follow has not, in time or at all.
    NotFollowed { began: Time, over: bool },
    /// It has never come to what a rule is about.
    NeverCame,
    /// So many entries at the beginning are not there any more.
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
    /// A state was not so, or not for long enough.
    NotHeld,
    /// What had to follow has not.
    NotFollowed,
    /// It has never come to what a rule is about.
    NeverCame,
    /// What was longest ago is not in the journal any more.
    Forgotten,
}
