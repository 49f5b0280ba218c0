//! Places in a history.

use serde::{Deserialize, Serialize};
use vimc4_device::Time;

/// A point of one branch, exact to the single cause: how many inputs of the branch the device has
/// been given, how many bytes of the next one, how many causes have been performed since, and the
/// time.
///
/// Moments of a branch are ordered as they come one after the other. Two things that happen at
/// one instant have two moments.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Moment {
    /// How many inputs of the branch have been given, whole.
    pub inputs: u64,
    /// How many bytes of the next input have been given, if that is bytes.
    pub bytes: u64,
    /// How many causes have been performed since the last input, or the last of these bytes.
    pub causes: u64,
    /// The model time.
    pub at: Time,
}

impl Moment {
    /// Inputs, bytes and causes, without the time that has passed since.
    pub(crate) fn counts(self) -> (u64, u64, u64) {
        (self.inputs, self.bytes, self.causes)
    }
}

/// The number of a branch of a history. The first is 0.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct BranchId(pub u32);

/// A moment of one of the branches of a history.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Place {
    /// The branch.
    pub branch: BranchId,
    /// The moment.
    pub moment: Moment,
}

/// What brings a history from one moment to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// The device did something by itself.
    Cause,
    /// A byte of an input came.
    Byte(u8),
    /// An input came that is not bytes.
    Input,
}
