//! Where the conversation is written: standard error and a file.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use vimc4::{Traffic, Verbosity};

/// How many lines wait for a slow terminal or disk before new ones are left out.
const WAITING: usize = 1_000;

/// Writes lines in a thread of its own, so that a terminal that stands still does not hold up
/// a controller.
#[derive(Clone)]
pub(crate) struct Log {
    lines: SyncSender<Entry>,
    lost: Arc<AtomicU64>,
}

enum Entry {
    Terminal(String),
    File(String),
    Flush(SyncSender<()>),
}

impl Log {
    /// Begins to write, to the file too if there is one.
    pub(crate) fn start(file: Option<&Path>) -> io::Result<Log> {
        let file =
            file.map(|path| OpenOptions::new().create(true).append(true).open(path)).transpose()?;
        let (lines, entries) = sync_channel(WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        let log = Log { lines, lost: Arc::clone(&lost) };
        thread::Builder::new()
            .name("log".to_owned())
            .spawn(move || write(&entries, file, &lost))?;
        Ok(log)
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
        if self.lines.try_send(entry).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Waits a moment for what is still to be written.
    pub(crate) fn flush(&self) {
        let (done, flushed) = sync_channel(1);
        if self.lines.try_send(Entry::Flush(done)).is_ok() {
            let _ = flushed.recv_timeout(Duration::from_millis(10));
        }
    }
}

fn write(entries: &Receiver<Entry>, mut file: Option<File>, lost: &AtomicU64) {
    // Whatever cannot be written cannot be reported either.
    while let Ok(entry) = entries.recv() {
        let missing = lost.swap(0, Ordering::Relaxed);
        if missing > 0 {
            let _ = writeln!(io::stderr(), "{missing} lines of the log were lost");
            if let Some(file) = &mut file {
                let _ = writeln!(file, "{missing} lines were lost");
            }
        }
        match (entry, &mut file) {
            (Entry::Terminal(line), _) => drop(writeln!(io::stderr(), "{line}")),
            (Entry::File(line), Some(file)) => drop(file.write_all((line + "\n").as_bytes())),
            (Entry::File(_), None) => {}
            (Entry::Flush(done), _) => drop(done.send(())),
        }
    }
}
