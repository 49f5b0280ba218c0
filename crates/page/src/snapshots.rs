//! The states that somebody wanted to go back to.

use std::collections::BTreeMap;

use vimc4_catalogue::State;
use vimc4_device::{LineState, Time};

/// One of them.
#[derive(Clone, Debug)]
pub(crate) struct Snapshot {
    pub(crate) name: String,
    pub(crate) at: Time,
    pub(crate) state: LineState<State>,
}

/// All of them, by numbers.
#[derive(Debug, Default)]
pub(crate) struct Snapshots {
    pub(crate) kept: BTreeMap<u64, Snapshot>,
    last: u64,
}

impl Snapshots {
    pub(crate) fn keep(&mut self, snapshot: Snapshot) -> u64 {
        self.last += 1;
        self.kept.insert(self.last, snapshot);
        self.last
    }
}
