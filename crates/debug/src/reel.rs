//! A recording whose history is made while it is read.
//!
//! A long recording takes a while to be read and played. The user need not wait for that: the
//! history is what has been read so far, and reading continues when there is time and wherever a
//! walk reaches its end. The whole recording lies on one way through the history; other branches
//! have nothing of it.

use std::fmt;

use vimc4_catalogue::State;
use vimc4_device::{CommandNumber, LineState, OwnedInput, Time};
use vimc4_timeline::BranchId;
use vimc4_timeline::recording::Mismatch;

/// A source of recorded entries, one after the other; implemented by the code that has the file.
pub trait Reel {
    /// What comes next, and when; `None` at the end.
    ///
    /// # Errors
    ///
    /// Why reading cannot continue, and where, in a sentence. After an error it is not called
    /// again.
    fn next(&mut self) -> Result<Option<(Time, Recorded)>, String>;

    /// How much of it has been read, in thousandths, if that is known.
    fn share(&self) -> Option<u32>;

    /// What people should know of it once it is read to its end, in a sentence: what is missing of
    /// it, for example.
    fn notice(&self) -> Option<String> {
        None
    }
}

/// A recorded entry, for the controller at hand.
#[derive(Clone, Debug, PartialEq)]
pub enum Recorded {
    /// An input was given.
    Given(OwnedInput),
    /// It was put into a state by the named party.
    Put(String, Box<LineState<State>>),
    /// The moment got a name.
    Mark(String),
    /// The emulation differs from what was recorded before.
    Differs(Mismatch),
    /// Time has passed up to then.
    Passed,
}

/// How reading has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Read {
    /// More is known than before, and there may be more.
    More,
    /// Everything is read.
    All,
    /// It was interrupted.
    Cancelled,
    /// The next entry cannot be read; with the reason, in a sentence.
    Broken(String),
}

/// What is still to be read of a recording.
pub(crate) struct Unread {
    /// `None` when there is no more. A copy of a debugger knows what was read by the time of
    /// copying.
    pub(crate) reel: Option<Box<dyn Reel>>,
    /// The branch that continues with what is read next.
    pub(crate) branch: BranchId,
    /// The command that began last.
    pub(crate) last: Option<CommandNumber>,
    /// Why reading cannot continue.
    pub(crate) failure: Option<String>,
    /// What is to be told of it, once.
    pub(crate) notice: Option<String>,
    /// Its commands are the lines of the source.
    pub(crate) lists: bool,
}

impl Clone for Unread {
    fn clone(&self) -> Unread {
        let Unread { branch, last, lists, .. } = *self;
        Unread { reel: None, branch, last, failure: self.failure.clone(), notice: None, lists }
    }
}

impl fmt::Debug for Unread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Unread").field("branch", &self.branch).finish_non_exhaustive()
    }
}
