//! Where the conversation is written: standard error and a file.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::Duration;

use vimc4::{Traffic, Verbosity};

use crate::output::shown_in_line;

/// What is wrong with the file is said again after so many lines that were lost.
const REMINDER: u64 = 100_000;

/// How many lines wait for a slow terminal or disk before new ones are left out.
const WAITING: usize = 1_000;

/// Writes lines in a thread of its own, so that a terminal that stands still does not hold up
/// a controller. The thread begins with the first line.
#[derive(Clone)]
pub(crate) struct Log(Arc<Shared>);

struct Shared {
    /// `None` if there is no thread to be had.
    lines: OnceLock<Option<SyncSender<Entry>>>,
    file: Option<File>,
    /// What the file is called.
    name: String,
    /// How many lines have not been written.
    lost: AtomicU64,
}

enum Entry {
    Terminal(String),
    File(String),
    Flush(SyncSender<()>),
}

impl Log {
    /// Opens the file, if there is to be one.
    pub(crate) fn open(file: Option<&Path>) -> io::Result<Log> {
        let name = file.map(|path| shown_in_line(&path.display().to_string())).unwrap_or_default();
        let file =
            file.map(|path| OpenOptions::new().create(true).append(true).open(path)).transpose()?;
        Ok(Log(Arc::new(Shared { lines: OnceLock::new(), file, name, lost: AtomicU64::new(0) })))
    }

    /// Where lines are sent to; the first one starts the thread.
    fn lines(&self) -> Option<&SyncSender<Entry>> {
        let start = || {
            let (lines, entries) = sync_channel(WAITING);
            let shared = Arc::clone(&self.0);
            let thread = thread::Builder::new().name("log".to_owned());
            thread.spawn(move || shared.write(&entries)).ok().map(|_| lines)
        };
        self.0.lines.get_or_init(start).as_ref()
    }

    /// A sink for standard error.
    pub(crate) fn terminal(
        &self,
        verbosity: Verbosity,
        prefix: String,
    ) -> Traffic<impl FnMut(String) + Send + use<>> {
        let log = self.clone();
        Traffic::new(verbosity, move |line| log.add(Entry::Terminal(format!("{prefix}{line}"))))
    }

    /// A sink for the file.
    pub(crate) fn file(&self, prefix: String) -> Traffic<impl FnMut(String) + Send + use<>> {
        let log = self.clone();
        Traffic::new(Verbosity::Conversation, move |line| {
            log.add(Entry::File(format!("{prefix}{line}")));
        })
    }

    fn add(&self, entry: Entry) {
        if self.lines().is_none_or(|lines| lines.try_send(entry).is_err()) {
            self.0.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Waits a moment for what is still to be written.
    pub(crate) fn flush(&self) {
        let Some(Some(lines)) = self.0.lines.get() else { return };
        let (done, flushed) = sync_channel(1);
        if lines.try_send(Entry::Flush(done)).is_ok() {
            let _ = flushed.recv_timeout(Duration::from_millis(10));
        }
    }
}

impl Shared {
    /// The thread. What cannot be written to the terminal cannot be reported either.
    fn write(&self, entries: &Receiver<Entry>) {
        let mut unwritten = 0;
        while let Ok(entry) = entries.recv() {
            let missing = self.lost.swap(0, Ordering::Relaxed);
            if missing > 0 {
                let _ = writeln!(io::stderr(), "{missing} lines of the log were lost");
                self.add_to_file(&format!("{missing} lines were lost\n"), &mut unwritten);
            }
            match entry {
                // In one piece, so that nothing that is written beside it comes between.
                Entry::Terminal(line) => {
                    drop(io::stderr().write_all((line + "\n").as_bytes()));
                }
                Entry::File(line) => self.add_to_file(&(line + "\n"), &mut unwritten),
                Entry::Flush(done) => drop(done.send(())),
            }
        }
    }

    /// Adds a line to the file. That it cannot be is said when it begins and from time to time,
    /// and how many are missing as soon as one can be written again.
    fn add_to_file(&self, line: &str, unwritten: &mut u64) {
        let Some(mut file) = self.file.as_ref() else { return };
        let written = match *unwritten {
            0 => file.write_all(line.as_bytes()),
            lines => file.write_all(format!("{lines} lines are missing\n{line}").as_bytes()),
        };
        match written {
            Ok(()) => *unwritten = 0,
            Err(error) => {
                if unwritten.is_multiple_of(REMINDER) {
                    let _ = writeln!(
                        io::stderr(),
                        "cannot write the log {}: {error}; the controllers run all the same",
                        self.name
                    );
                }
                *unwritten += 1;
            }
        }
    }
}
