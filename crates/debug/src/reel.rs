//! A recording whose history is made while it is read.
//!
//! A long recording takes a while to be read and played. Nobody has to wait for that: what has been
//! read by now is the history, and it is read on when there is time, and wherever a walk comes to its
//! end. All that was recorded is on one way through the history; on another branch nothing of it
//! comes.

use std::fmt;

use vimc4_catalogue::State;
use vimc4_device::{CommandNumber, OwnedInput, Time};
use vimc4_timeline::BranchId;

/// What was recorded, one thing after the other. Whoever has the file reads it.
pub trait Reel {
    /// What comes next, and when; `None` at the end.
    ///
    /// # Errors
    ///
    /// Why it cannot be read on, and where, in a sentence. It is not asked again then.
    fn next(&mut self) -> Result<Option<(Time, Recorded)>, String>;

    /// How much of it has been read, in thousandths, as far as that can be known.
    fn share(&self) -> Option<u32>;
}

/// Something that was recorded, for the controller at hand.
#[derive(Clone, Debug, PartialEq)]
pub enum Recorded {
    /// Something was given.
    Given(OwnedInput),
    /// Somebody, who is named, has put it into a state.
    Put(String, Box<State>),
    /// The moment was given a name.
    Mark(String),
    /// Time has passed up to then.
    Passed,
}

/// How reading on has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Read {
    /// More is known than before, and there may be more.
    More,
    /// Everything is read.
    All,
    /// It was broken off.
    Cancelled,
    /// What comes next cannot be read, and why, in a sentence.
    Broken(String),
}

/// What is still to be read of a recording.
pub(crate) struct Unread {
    /// `None` when there is no more: of a copy of a debugger is known what was read by then.
    pub(crate) reel: Option<Box<dyn Reel>>,
    /// The branch that goes on with what comes next.
    pub(crate) branch: BranchId,
    /// The command that began last.
    pub(crate) last: Option<CommandNumber>,
    /// Why it cannot be read on.
    pub(crate) failure: Option<String>,
    /// Its commands are the lines of the source.
    pub(crate) lists: bool,
}

impl Clone for Unread {
    fn clone(&self) -> Unread {
        let Unread { branch, last, lists, .. } = *self;
        Unread { reel: None, branch, last, failure: self.failure.clone(), lists }
    }
}

impl fmt::Debug for Unread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Unread").field("branch", &self.branch).finish_non_exhaustive()
    }
}
