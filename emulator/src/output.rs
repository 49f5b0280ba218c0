//! Where what was asked for goes: standard output, and files.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue};
use vimc4_device::is_like;

use crate::failure::Failure;
use crate::streams::{self, is_file, is_standard};

/// Leaves out suggestions that have little in common with what was typed.
fn keep_like(error: &mut clap::Error) {
    for (typed, suggested) in [
        (ContextKind::InvalidSubcommand, ContextKind::SuggestedSubcommand),
        (ContextKind::InvalidArg, ContextKind::SuggestedArg),
        (ContextKind::InvalidValue, ContextKind::SuggestedValue),
    ] {
        let Some(ContextValue::String(typed)) = error.get(typed).cloned() else { continue };
        let is_meant =
            |name: &String| is_like(typed.trim_start_matches('-'), name.trim_start_matches('-'));
        match error.remove(suggested) {
            Some(ContextValue::String(name)) if is_meant(&name) => {
                error.insert(suggested, ContextValue::String(name));
            }
            Some(ContextValue::Strings(mut names)) => {
                names.retain(is_meant);
                if !names.is_empty() {
                    error.insert(suggested, ContextValue::Strings(names));
                }
            }
            _ => {}
        }
    }
}

/// Prints what was asked for.
///
/// # Errors
///
/// If it cannot be written. A reader that has closed the pipe is not an error.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    written(out.write_all(text.as_bytes()).and_then(|()| out.flush()))
}

/// What it means that something could, or could not, be written to standard output.
pub(crate) fn written(written: io::Result<()>) -> Result<(), Failure> {
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::usage(format!(
            "cannot write to standard output: {error}; make room where it leads to, and begin again"
        ))),
        _ => Ok(()),
    }
}

/// What it means that something could, or could not, be written where a path leads to.
///
/// # Errors
///
/// If it could not. A reader of standard output that has gone is not an error.
pub(crate) fn written_to(path: &Path, written: io::Result<()>) -> Result<(), Failure> {
    match written {
        Err(error) if has_no_reader(path, &error) => Ok(()),
        written => written.map_err(|error| unwritable(path, &error)),
    }
}

/// Whether an error only means that the reader of standard output has gone.
pub(crate) fn has_no_reader(path: &Path, error: &io::Error) -> bool {
    error.kind() == ErrorKind::BrokenPipe && is_standard(path)
}

/// A new file for what is drawn, at a name that somebody has given. What is drawn to a stream that is open
/// already is added to what stands there.
pub(crate) fn create(path: &Path) -> Result<File, Failure> {
    match streams::open(path) {
        Some(stream) => stream.map_err(|error| unwritable(path, &error)),
        None => opened(path, OpenOptions::new().truncate(true).create(true)),
    }
}

/// Sees to it, before anything is touched, that something goes to a file, which it needs for this reason.
pub(crate) fn must_be_file(path: &Path, why: &str) -> Result<(), Failure> {
    if is_file(path) {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "cannot write {}: {why}, which needs a file of its own; name one",
        path.display()
    )))
}

/// Where something is written at the end. What stands there stays until then.
pub(crate) struct Destination {
    path: PathBuf,
    /// What is no file, such as a pipe, is open from the beginning: its reader finds no end before, and
    /// whoever waits in vain for a reader does so before anything is done.
    stream: Option<File>,
}

impl Destination {
    /// Sees to it before anything is done that a destination can be written to at the end. Nothing is left where
    /// nothing stood.
    ///
    /// # Errors
    ///
    /// If it cannot.
    pub(crate) fn claim(path: &Path) -> Result<Destination, Failure> {
        let stream = match fs::metadata(path) {
            Ok(_) if !is_file(path) => Some(create(path)?),
            Ok(_) => {
                opened(path, &mut OpenOptions::new())?;
                None
            }
            Err(_) => {
                create(path)?;
                // A link may lead to it, and stays.
                let made = fs::canonicalize(path).and_then(fs::remove_file);
                made.map_err(|error| unwritable(path, &error))?;
                None
            }
        };
        Ok(Destination { path: path.to_owned(), stream })
    }

    /// Where that is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a file, so that it is there as a whole, or as it was, or not at all. What is no file is written
    /// to as it is.
    ///
    /// # Errors
    ///
    /// If it cannot be written.
    pub(crate) fn write(mut self, bytes: &[u8]) -> Result<(), Failure> {
        let path = &self.path;
        let written = match (&mut self.stream, fs::metadata(path)) {
            (Some(stream), _) => {
                // What was printed before stands before it. Whether that can be written is said by who
                // prints.
                let _ = io::stdout().flush();
                stream.write_all(bytes)
            }
            (None, Ok(there)) => replace(path, &there, bytes),
            (None, Err(_)) => fs::write(path, bytes).inspect_err(|_| {
                // A link may lead to it, and stays.
                let _ = fs::canonicalize(path).and_then(fs::remove_file);
            }),
        };
        written_to(path, written)
    }
}

/// Writes a file at a name that somebody has given, as [`Destination`] does.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    Destination::claim(path)?.write(bytes)
}

/// Puts a new file in the place of one that is there, where a link leads to it.
fn replace(path: &Path, there: &fs::Metadata, bytes: &[u8]) -> io::Result<()> {
    let path = fs::canonicalize(path)?;
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.new", std::process::id()));
    let new = path.with_file_name(name);
    let mut file = match OpenOptions::new().write(true).create_new(true).open(&new) {
        Ok(file) => file,
        // It can be written to, but nothing beside it.
        Err(error) if error.kind() == ErrorKind::PermissionDenied => {
            return fs::write(path, bytes);
        }
        Err(error) => return Err(error),
    };
    let written = file.write_all(bytes).and_then(|()| file.set_permissions(there.permissions()));
    drop(file);
    written.and_then(|()| fs::rename(&new, path)).inspect_err(|_| drop(fs::remove_file(&new)))
}

fn opened(path: &Path, how: &mut OpenOptions) -> Result<File, Failure> {
    if path == Path::new("-") {
        let instead = if cfg!(unix) { ", or /dev/stdout to have it before the report" } else { "" };
        return Err(Failure::usage(format!(
            "`-` is where the report goes, and this needs a file; name one, `./-` for one of that \
             name{instead}"
        )));
    }
    how.write(true).open(path).map_err(|error| unwritable(path, &error))
}

/// Why a file cannot be written.
pub(crate) fn unwritable(path: &Path, error: &io::Error) -> Failure {
    use ErrorKind::{BrokenPipe, FileTooLarge, QuotaExceeded, StorageFull};
    let right = match error.kind() {
        BrokenPipe => "what has read it has gone: let it read to the end, or name a file",
        FileTooLarge | QuotaExceeded | StorageFull => {
            "make room where it leads to, and begin again"
        }
        _ => "name a file in a folder that can be written to",
    };
    Failure::usage(format!("cannot write {}: {error}; {right}", path.display()))
}

/// Help and version are requested output; any other message of the command-line parser is an error.
pub(crate) fn said(mut said: clap::Error) -> ExitCode {
    keep_like(&mut said);
    let printed = said.print().and_then(|()| io::stdout().flush());
    if said.use_stderr() {
        return ExitCode::from(2);
    }
    written(printed).map_or_else(Failure::report, |()| ExitCode::SUCCESS)
}
