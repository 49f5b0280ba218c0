//! What every group of figures needs.

use super::cores::Cores;
use super::launch::Launcher;

/// What every group needs.
pub(super) struct Bench {
    /// Starts the emulator and the baselines.
    pub(super) launcher: Launcher,
    /// Where servers and clients run.
    pub(super) cores: Cores,
    /// Whether the runs are short.
    pub(super) quick: bool,
}

impl Bench {
    /// The one for a full run, the other for a quick one.
    pub(super) fn either<T>(&self, full: T, quick: T) -> T {
        if self.quick { quick } else { full }
    }
}
