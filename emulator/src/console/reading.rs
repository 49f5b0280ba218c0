//! How far a search has come, for somebody who waits for it.

use std::io::{self, IsTerminal, Write};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use vimc4_device::Time;

use super::cancel::Cancel;
use crate::recording::file::Share;

/// What takes no longer needs no words.
const LONG: Duration = Duration::from_millis(300);

/// The time between two messages.
const BETWEEN: Duration = Duration::from_millis(200);

/// Shows how far a search has come. The text is empty when the search is over.
pub(crate) type Show = Arc<dyn Fn(&str) + Send + Sync>;

/// On a line of the terminal that is written over each time and cleared at the end; `None` without a terminal.
pub(crate) fn on_terminal() -> Option<Show> {
    io::stderr().is_terminal().then(|| -> Show {
        Arc::new(|text: &str| {
            // Who cannot be told waits all the same.
            let _ = match text {
                "" => write!(io::stderr(), "\r{:64}\r", ""),
                text => write!(io::stderr(), "\r{text:63} "),
            };
        })
    })
}

/// Goes on until somebody wants it to end, and shows meanwhile how far it has come.
pub(crate) struct SearchProgress {
    cancel: Cancel,
    show: Option<Show>,
    share: Option<Share>,
    /// How much of the recording had been read when this began.
    begun: Option<u32>,
    next: Instant,
    is_shown: bool,
}

impl SearchProgress {
    pub(crate) fn new(cancel: &Cancel, show: Option<Show>, share: Option<Share>) -> SearchProgress {
        let begun = share.as_ref().and_then(Share::thousandths);
        let next = Instant::now() + LONG;
        SearchProgress { cancel: cancel.clone(), show, share, begun, next, is_shown: false }
    }

    /// Whether to go on, at this time of the controller.
    pub(crate) fn goes_on(&mut self, at: Time) -> ControlFlow<()> {
        self.show(at);
        match self.cancel.is_wished() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    fn show(&mut self, at: Time) {
        let Some(show) = &self.show else { return };
        let now = Instant::now();
        if now < self.next {
            return;
        }
        (self.next, self.is_shown) = (now + BETWEEN, true);
        let read = self.share.as_ref().and_then(Share::thousandths);
        let seconds = at.as_nanos() as f64 / 1e9;
        match read.filter(|_| read != self.begun) {
            Some(read) => {
                show(&format!("{} % is read, at {seconds:.3} s; Ctrl-C ends it", read / 10))
            }
            None => show(&format!("searching, at {seconds:.3} s; Ctrl-C ends it")),
        }
    }
}

impl Drop for SearchProgress {
    fn drop(&mut self) {
        if let Some(show) = self.show.as_ref().filter(|_| self.is_shown) {
            show("");
        }
    }
}
