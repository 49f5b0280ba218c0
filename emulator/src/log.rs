//! Where the conversation is written: standard error and a file.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use vimc4::{SuppressedWarnings, Traffic, Verbosity};

use crate::failure::Failure;
use crate::text::shown_in_line;

/// After how many lost lines a problem with the file is reported again.
const REMINDER: u64 = 100_000;

/// How many bytes wait for a slow terminal or disk before new lines are left out.
const WAITING: usize = 4 << 20;

/// How many bytes are written to the file at once, as long as more wait.
const PIECE: usize = 64 << 10;

/// How long to wait at the end for pending output: a terminal may be paused.
const FAREWELL: Duration = Duration::from_millis(500);

/// Writes lines in a thread of its own, so that a paused terminal does not delay a controller. The
/// thread begins with the first line.
#[derive(Clone)]
pub(crate) struct Log(Arc<Shared>);

struct Shared {
    /// `None` if no thread could be started.
    lines: OnceLock<Option<Sender<Entry>>>,
    file: Option<File>,
    /// What the file is called.
    name: String,
    /// How many lines have not been written.
    lost: AtomicU64,
    /// How many bytes wait.
    waiting: AtomicUsize,
    /// The warnings that were left out, and how a line about them becomes an entry.
    suppressed: Mutex<Vec<(SuppressedWarnings, ToEntry)>>,
    /// Why a recording is not complete.
    recording_failure: OnceLock<String>,
}

type ToEntry = Box<dyn Fn(String) -> Entry + Send>;

enum Entry {
    Terminal(String),
    File(String),
    Flush(SyncSender<()>),
}

impl Entry {
    fn line(&self) -> &str {
        match self {
            Entry::Terminal(line) | Entry::File(line) => line,
            Entry::Flush(_) => "",
        }
    }
}

impl Log {
    /// Opens the file, if there is to be one.
    pub(crate) fn open(file: Option<&Path>) -> io::Result<Log> {
        let name = file.map(|path| shown_in_line(&path.display().to_string())).unwrap_or_default();
        let file =
            file.map(|path| OpenOptions::new().create(true).append(true).open(path)).transpose()?;
        Ok(Log(Arc::new(Shared {
            lines: OnceLock::new(),
            file,
            name,
            lost: AtomicU64::new(0),
            waiting: AtomicUsize::new(0),
            suppressed: Mutex::default(),
            recording_failure: OnceLock::new(),
        })))
    }

    /// Where lines are sent to; the first one starts the thread.
    fn lines(&self) -> Option<&Sender<Entry>> {
        let start = || {
            let (lines, entries) = channel();
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
        self.traffic(verbosity, move |line| Entry::Terminal(format!("{prefix}{line}")))
    }

    /// A sink for the file.
    pub(crate) fn file(&self, prefix: String) -> Traffic<impl FnMut(String) + Send + use<>> {
        self.traffic(Verbosity::Conversation, move |line| Entry::File(format!("{prefix}{line}")))
    }

    fn traffic<E: Fn(String) -> Entry + Clone + Send + 'static>(
        &self,
        verbosity: Verbosity,
        entry: E,
    ) -> Traffic<impl FnMut(String) + Send + use<E>> {
        let (log, to_entry) = (self.clone(), Box::new(entry.clone()));
        let traffic = Traffic::new(verbosity, move |line| log.add(entry(line)));
        self.0.suppressed().push((traffic.suppressed(), to_entry));
        traffic
    }

    /// A recording can no longer be written.
    pub(crate) fn recording_failed(&self, why: &str) {
        self.say(why);
        let _ = self.0.recording_failure.set(why.to_owned());
    }

    /// Whether all recordings are complete.
    ///
    /// # Errors
    ///
    /// If one is not.
    pub(crate) fn recorded(&self) -> Result<(), Failure> {
        self.0.recording_failure.get().map_or(Ok(()), |why| Err(Failure::midway(why)))
    }

    /// Prints on standard error, after earlier output.
    pub(crate) fn say(&self, text: &str) {
        self.add(Entry::Terminal(shown_in_line(text)));
    }

    fn add(&self, entry: Entry) {
        self.0.add(entry, self.lines());
    }

    /// Waits a moment for what is still to be written.
    pub(crate) fn flush(&self) {
        let Some(Some(lines)) = self.0.lines.get() else { return };
        let (done, flushed) = sync_channel(1);
        if lines.send(Entry::Flush(done)).is_ok() {
            let _ = flushed.recv_timeout(FAREWELL);
        }
    }
}

impl Shared {
    fn suppressed(&self) -> MutexGuard<'_, Vec<(SuppressedWarnings, ToEntry)>> {
        self.suppressed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn add(&self, entry: Entry, lines: Option<&Sender<Entry>>) {
        let size = entry.line().len();
        let room = self.waiting.fetch_add(size, Ordering::Relaxed) + size <= WAITING;
        if !room || lines.is_none_or(|lines| lines.send(entry).is_err()) {
            self.waiting.fetch_sub(size, Ordering::Relaxed);
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Says how many warnings were left out that no other one followed. Returns when to look again.
    fn tell_suppressed(&self) -> Option<Instant> {
        let mut next = None;
        for (suppressed, to_entry) in &*self.suppressed() {
            let (lines, due) = suppressed.overdue();
            let sender = self.lines.get().and_then(Option::as_ref);
            lines.into_iter().for_each(|line| self.add(to_entry(line), sender));
            next = [next, due].into_iter().flatten().min();
        }
        next
    }

    /// The next entry. While it waits it says how many warnings were left out.
    fn next(&self, entries: &Receiver<Entry>, due: &mut Option<Instant>) -> Option<Entry> {
        let entry = loop {
            match *due {
                None => break entries.recv().ok(),
                Some(at) if at <= Instant::now() => *due = self.tell_suppressed(),
                Some(at) => match entries.recv_timeout(at - Instant::now()) {
                    Err(RecvTimeoutError::Timeout) => {}
                    entry => break entry.ok(),
                },
            }
        };
        // It may be a warning, the first of many.
        due.get_or_insert_with(|| Instant::now() + SuppressedWarnings::DELAY);
        entry
    }

    /// The thread. What cannot be written to the terminal cannot be reported either.
    fn write(&self, entries: &Receiver<Entry>) {
        let (mut unwritten, mut piece, mut lines) = (0, String::new(), 0);
        let mut due = None;
        while let Some(entry) = self.next(entries, &mut due) {
            let mut next = Some(entry);
            while let Some(entry) = next {
                self.waiting.fetch_sub(entry.line().len(), Ordering::Relaxed);
                let missing = self.lost.swap(0, Ordering::Relaxed);
                if missing > 0 {
                    // The time is that of the line behind the notice.
                    let time = entry.line().split_once(" s  ").map_or("", |(time, _)| time);
                    let _ =
                        writeln!(io::stderr(), "{time} s  {missing} lines of the log were lost");
                    piece += &format!("{time} s  {missing} lines were lost\n");
                    lines += 1;
                }
                match entry {
                    // In one piece, so that no other output comes between.
                    Entry::Terminal(line) => {
                        drop(io::stderr().write_all((line + "\n").as_bytes()));
                    }
                    Entry::File(line) => {
                        piece += &line;
                        piece.push('\n');
                        lines += 1;
                    }
                    Entry::Flush(done) => {
                        self.add_to_file(&std::mem::take(&mut piece), lines, &mut unwritten);
                        lines = 0;
                        let _ = done.send(());
                    }
                }
                next = entries.try_recv().ok();
                if next.is_none() || piece.len() >= PIECE {
                    self.add_to_file(&piece, lines, &mut unwritten);
                    piece.clear();
                    lines = 0;
                }
            }
        }
    }

    /// Adds this many lines to the file. A failure is reported when it begins and from time to
    /// time, and the number of missing lines as soon as one can be written again.
    fn add_to_file(&self, text: &str, lines: u64, unwritten: &mut u64) {
        let Some(mut file) = self.file.as_ref().filter(|_| lines > 0) else { return };
        let written = match *unwritten {
            0 => file.write_all(text.as_bytes()),
            missing => file.write_all(format!("{missing} lines are missing\n{text}").as_bytes()),
        };
        match written {
            Ok(()) => *unwritten = 0,
            Err(error) => {
                if *unwritten / REMINDER != (*unwritten + lines) / REMINDER || *unwritten == 0 {
                    let _ = writeln!(
                        io::stderr(),
                        "cannot write the log {}: {error}; the controllers run all the same",
                        self.name
                    );
                }
                *unwritten += lines;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_is_kept_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let log = Log::open(Some(&path)).unwrap();
        for number in 0..20_000 {
            log.add(Entry::File(format!("{number:>6}.000000 s  a line of the conversation")));
        }
        let lines = || std::fs::read_to_string(&path).unwrap().lines().count();
        // It takes only a moment unless lines are missing.
        let mut rounds = 1..5_000;
        while lines() < 20_000 && rounds.next().is_some() {
            log.flush();
        }
        assert_eq!(lines(), 20_000);
        assert_eq!(log.0.lost.load(Ordering::Relaxed), 0);
        assert_eq!(log.0.waiting.load(Ordering::Relaxed), 0);
    }
}
