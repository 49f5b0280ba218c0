//! Where the emulation differs from the recording that it was opened on.

use vimc4_device::Time;
use vimc4_timeline::BranchId;
use vimc4_timeline::recording::Mismatch;

/// The most differences that are kept. Later ones are only counted.
const KEPT_MAX: usize = 10_000;

/// A place of the history at which the emulation differs from the recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The branch of the history that has the recorded inputs.
    pub branch: BranchId,
    /// What differs there, and when.
    pub mismatch: Mismatch,
}

/// Which replies are shown where the emulation differs from the recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Replies {
    /// Those of the emulation.
    #[default]
    Emulated,
    /// Those of the recording.
    Recorded,
}

/// What is known of the differences.
#[derive(Clone, Debug, Default)]
pub(crate) struct Differences {
    pub(crate) list: Vec<Difference>,
    /// How many more there are.
    pub(crate) more: u64,
    /// Nobody has been told yet that there are any.
    pub(crate) is_news: bool,
    pub(crate) shown: Replies,
    /// Where the last walk ended.
    pub(crate) from: Time,
}

impl Differences {
    pub(crate) fn push(&mut self, branch: BranchId, mismatch: Mismatch) {
        self.is_news |= self.list.is_empty();
        match self.list.len() < KEPT_MAX {
            true => self.list.push(Difference { branch, mismatch }),
            false => self.more += 1,
        }
    }
}
