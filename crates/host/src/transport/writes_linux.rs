//! Whether clients wrote to a terminal before or after the last of them closed it.
//!
//! The near end of a pseudo-terminal reads what all clients wrote as one stream. Where one client follows
//! another quickly, only the order of writing and closing tells whose bytes wait. inotify keeps that order.
//! It merges equal events, so a client that writes a thousand times is one event that nobody has to read.

use std::mem::{MaybeUninit, take};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use rustix::fs::inotify::{self, CreateFlags, ReadFlags, Reader, WatchFlags};

/// How many terminals of a process are watched. Users may have 128 instances of inotify.
const MOST: u32 = 16;

static WATCHED: AtomicU32 = AtomicU32::new(0);

/// The order of writes and closings of one terminal.
#[derive(Debug)]
pub(super) struct Writes {
    inotify: Option<OwnedFd>,
    /// Somebody wrote before the last closing, and after it.
    before: bool,
    after: bool,
    /// A closing has been seen here. Another inotify instance may report it a moment earlier.
    closed: bool,
}

/// Whose bytes wait after a client has closed the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Writer {
    /// The client that has closed it.
    Former,
    /// The next client, or both of them.
    Next,
    /// No client: everything has been read.
    Nobody,
    /// Nobody can tell.
    Unknown,
}

impl Writes {
    /// Watches the terminal at a path, if the system lets it.
    pub(super) fn new(path: &Path) -> Writes {
        let may = WATCHED.fetch_add(1, Ordering::Relaxed) < MOST;
        let watch = || {
            let inotify = inotify::init(CreateFlags::NONBLOCK | CreateFlags::CLOEXEC).ok()?;
            let flags = WatchFlags::MODIFY | WatchFlags::CLOSE;
            inotify::add_watch(&inotify, path, flags).ok().map(|_| inotify)
        };
        let inotify = may.then(watch).flatten();
        if inotify.is_none() {
            WATCHED.fetch_sub(1, Ordering::Relaxed);
        }
        Writes { inotify, before: false, after: false, closed: false }
    }

    /// Takes in what has happened. Returns whether somebody has closed the terminal.
    pub(super) fn look(&mut self) -> bool {
        let Some(inotify) = &self.inotify else { return false };
        let mut buffer = [MaybeUninit::uninit(); 1_024];
        let mut events = Reader::new(inotify, &mut buffer);
        let mut is_closed = false;
        while let Ok(event) = events.next() {
            if event.events().contains(ReadFlags::MODIFY) {
                self.after = true;
            }
            if event.events().intersects(ReadFlags::CLOSE_WRITE | ReadFlags::CLOSE_NOWRITE) {
                self.before |= take(&mut self.after);
                is_closed = true;
            }
        }
        self.closed |= is_closed;
        is_closed
    }

    /// Everything that had been written at the last look has been read.
    pub(super) fn are_read(&mut self) {
        (self.before, self.after) = (false, false);
    }

    /// The bytes of the closed client are complete: later bytes belong to the next client.
    pub(super) fn has_left(&mut self) {
        (self.before, self.closed) = (false, false);
    }

    /// Whose bytes wait.
    pub(super) fn writer(&mut self) -> Writer {
        self.look();
        if self.inotify.is_none() {
            Writer::Unknown
        } else if !self.closed {
            // All that has been written so far precedes the closing.
            Writer::Former
        } else if self.after {
            Writer::Next
        } else if self.before {
            Writer::Former
        } else {
            Writer::Nobody
        }
    }
}

impl Drop for Writes {
    fn drop(&mut self) {
        if self.inotify.is_some() {
            WATCHED.fetch_sub(1, Ordering::Relaxed);
        }
    }
}
