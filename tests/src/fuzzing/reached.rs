//! What a corpus has reached.

use std::collections::BTreeSet;

use vimc4_isel_wire::Reply;
use vimc4_lpkf::language::Status;

/// What inputs have made controllers do, over any number of runs. Models and commands go by their
/// names and mnemonics.
#[derive(Clone, Debug, Default)]
pub struct Reached {
    /// Commands taken from the line; what an isel controller stores, when it is stored.
    pub commands: BTreeSet<(&'static str, &'static str)>,
    /// Lines of programs that an isel controller executed.
    pub lines: BTreeSet<(&'static str, &'static str)>,
    /// Single bytes that an isel controller answered to a command.
    pub replies: BTreeSet<(&'static str, &'static str, Reply)>,
    /// Commands that an LPKF controller has done and said so.
    pub done: BTreeSet<(&'static str, &'static str)>,
    /// Commands that an LPKF controller answered with data.
    pub data: BTreeSet<(&'static str, &'static str)>,
    /// What an LPKF controller said was wrong, asked or not.
    pub statuses: BTreeSet<(&'static str, Status)>,
    /// Signals that were set or cleared, by name.
    pub signals: BTreeSet<(&'static str, String, bool)>,
}

impl Reached {
    /// Adds what another run has reached.
    pub fn add(&mut self, other: Reached) {
        self.commands.extend(other.commands);
        self.lines.extend(other.lines);
        self.replies.extend(other.replies);
        self.done.extend(other.done);
        self.data.extend(other.data);
        self.statuses.extend(other.statuses);
        self.signals.extend(other.signals);
    }
}
