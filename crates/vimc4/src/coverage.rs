//! Protocol coverage: what the host of an emulator has met, and the file that keeps it over many runs.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
#[cfg(not(unix))]
use std::io::{Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use thiserror::Error;
use vimc4_catalogue::Model;
use vimc4_coverage::{Collector, Coverage, CoverageError};
use vimc4_host::{EventFilter, Report, ReportKind, Sink, is_at};

/// What was met, shared with the [`Counter`] that fills it.
#[derive(Clone, Debug)]
pub(crate) struct Tally(Arc<Mutex<Collector>>);

impl Tally {
    pub(crate) fn new(model: &Model) -> Tally {
        Tally(Arc::new(Mutex::new(Collector::new(model))))
    }

    pub(crate) fn coverage(&self) -> Coverage {
        self.lock().coverage().clone()
    }

    /// The sink that fills it.
    pub(crate) fn counter(&self) -> Counter {
        Counter(self.clone())
    }

    /// Every count is whole at any time, so a panic elsewhere is no reason to stop.
    fn lock(&self) -> MutexGuard<'_, Collector> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Counts what is met.
#[derive(Debug)]
pub(crate) struct Counter(Tally);

impl Sink for Counter {
    fn wants(&self) -> EventFilter {
        EventFilter { kinds: Collector::KINDS, ..EventFilter::default() }
    }

    fn report(&mut self, report: &Report, _: &dyn Fn(&[u8]) -> String) {
        if let ReportKind::Event { event, .. } = &report.what {
            self.0.lock().see(event);
        }
    }
}

/// Why a file of coverage cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CoverageFileError {
    /// It cannot be read.
    #[error(
        "cannot read the coverage file {path}: {source}; `--coverage FILE` of serve and run writes one",
        path = .path.display()
    )]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// Nothing can be added to it.
    #[error(
        "cannot use the coverage file {path}: {source}; name a file in a folder that can be written to",
        path = .path.display()
    )]
    File {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// What is in it does not go with what is to be added, or is no coverage.
    #[error("coverage file {path}: {source}", path = .path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Why.
        source: CoverageError,
    },
}

/// Reads a file of coverage.
///
/// # Errors
///
/// If it cannot be read, or holds something else.
pub fn read_coverage(path: impl AsRef<Path>) -> Result<Coverage, CoverageFileError> {
    let path = path.as_ref();
    let text = File::open(path)
        .and_then(bounded)
        .map_err(|source| CoverageFileError::Read { path: path.to_owned(), source })?;
    parse(path, &text)
}

/// Adds what was met to a file of coverage, which is created if it does not exist, and returns what is in
/// it then. Several processes may do so at the same time: none of them loses what another has met, and a
/// reader finds the file whole at any time.
///
/// ```
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// use std::io::{Read, Write};
/// use vimc4::{Clock, Emulator, add_coverage};
///
/// # let folder = tempfile::tempdir()?;
/// # let file = folder.path().join("coverage.json");
/// let emu = Emulator::builder().time(Clock::Instant).coverage(true).start()?;
/// let mut port = emu.connect()?;
/// port.write_all(b"@01\r@0A400,900\r")?;
/// port.read_exact(&mut [0; 2])?;
///
/// let all = add_coverage(&file, &emu.coverage()?)?;
/// println!("{}{}", all.table(), all.missing().join("\n"));
/// assert_eq!(all.command("@A").map(|command| command.times()), Some(1));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
///
/// If the file cannot be used, or is another model's. It is left as it is then.
pub fn add_coverage(path: impl AsRef<Path>, met: &Coverage) -> Result<Coverage, CoverageFileError> {
    let path = path.as_ref();
    let failed = |source| failed(path, source);
    let file = locked(path).map_err(failed)?;
    let text = bounded(&file).map_err(failed)?;
    let mut whole = met.clone();
    // It has just been created, or whoever did so was killed.
    if !text.trim().is_empty() {
        let before = parse(path, &text)?;
        let wrong = |source| CoverageFileError::Content { path: path.to_owned(), source };
        whole.merge(&before).map_err(wrong)?;
    }
    replace(&file, path, &whole.to_json()).map_err(failed)?;
    // Only now may others have it.
    drop(file);
    Ok(whole)
}

/// Longer than any file of coverage.
const LONGEST: u64 = 64 << 20;

/// What is in a file, which may be a pipe that never ends.
fn bounded(file: impl Read) -> io::Result<String> {
    let mut text = String::new();
    file.take(LONGEST + 1).read_to_string(&mut text)?;
    match text.len() as u64 > LONGEST {
        true => Err(io::Error::other(format!(
            "it is longer than {} MiB, so it is no coverage",
            LONGEST >> 20
        ))),
        false => Ok(text),
    }
}

fn parse(path: &Path, text: &str) -> Result<Coverage, CoverageFileError> {
    let wrong = |source| CoverageFileError::Content { path: path.to_owned(), source };
    Coverage::from_json(text).map_err(wrong)
}

fn failed(path: &Path, source: io::Error) -> CoverageFileError {
    CoverageFileError::File { path: path.to_owned(), source }
}

/// The file, opened and kept from others that would add to it.
fn locked(path: &Path) -> io::Result<File> {
    loop {
        // Devices and pipes cannot be replaced, and some never end.
        if fs::metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
            return Err(io::Error::other("it is not a regular file"));
        }
        let file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        match file.lock() {
            // Some file systems have no locks.
            Err(error) if error.kind() == io::ErrorKind::Unsupported => {}
            locked => locked?,
        }
        // Whoever had it before has put another file in its place.
        if is_at(&file, path)? {
            return Ok(file);
        }
    }
}

/// Writes over the file that is locked, which keeps readers out: another file cannot take the place of one
/// that is open.
#[cfg(not(unix))]
fn replace(mut file: &File, _: &Path, text: &str) -> io::Result<()> {
    file.seek(SeekFrom::Start(0))?;
    file.write_all(text.as_bytes())?;
    file.set_len(text.len() as u64)?;
    file.sync_all()
}

/// Puts a new file in the place of the one that is locked.
#[cfg(unix)]
fn replace(_: &File, path: &Path, text: &str) -> io::Result<()> {
    // A link leads to the same file as before.
    let path = fs::canonicalize(path)?;
    let mut name = path.file_name().unwrap_or_default().to_owned();
    // Always the same name: what a killed process left behind is taken over.
    name.push(".vimc4-new");
    let fresh = path.with_file_name(name);
    let written = write(&fresh, text).and_then(|()| fs::rename(&fresh, &path));
    if written.is_err() {
        let _ = fs::remove_file(&fresh);
    }
    written
}

#[cfg(unix)]
fn write(path: &Path, text: &str) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()
}
