//! How far the reading of a recording has come, for somebody who waits for it at a terminal.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

use crate::recording::file::Share;

/// What takes no longer needs no words.
const LONG: Duration = Duration::from_millis(500);

/// So often it is said.
const BETWEEN: Duration = Duration::from_millis(200);

/// A line that is written over as it is read on, and is gone when that is over.
pub(super) struct Shown<'s> {
    share: Option<&'s Share>,
    /// When it is said next.
    next: Instant,
    is_there: bool,
}

impl<'s> Shown<'s> {
    /// Nothing is said where nobody is at a terminal.
    pub(super) fn new(share: Option<&'s Share>) -> Shown<'s> {
        let share = share.filter(|_| io::stderr().is_terminal());
        Shown { share, next: Instant::now() + LONG, is_there: false }
    }

    /// Says how far it is, if it is time for that.
    pub(super) fn tell(&mut self) {
        let Some(share) = self.share.and_then(Share::thousandths) else { return };
        let now = Instant::now();
        if share < 1_000 && now >= self.next {
            (self.next, self.is_there) = (now + BETWEEN, true);
            // Who cannot be told waits all the same.
            let _ = write!(io::stderr(), "\r{} % is read; Ctrl-C ends it ", share / 10);
        }
    }
}

impl Drop for Shown<'_> {
    fn drop(&mut self) {
        if self.is_there {
            let _ = write!(io::stderr(), "\r{:32}\r", "");
        }
    }
}
