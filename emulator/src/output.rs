//! Standard output, where what was asked for goes.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Seek as _, Write};
use std::path::Path;
use std::process::ExitCode;

use crate::failure::Failure;

/// Prints what was asked for.
///
/// # Errors
///
/// If it cannot be written. A reader that has closed the pipe is not an error.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    print_bytes(text.as_bytes())
}

fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    written(out.write_all(bytes).and_then(|()| out.flush()))
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

/// A new file for what is drawn, at a name that somebody has given. What is drawn to standard output or
/// standard error is added to what stands there.
pub(crate) fn create(path: &Path) -> Result<File, Failure> {
    match standard(path) {
        Some(file) => file.map_err(|error| unwritable(path, &error)),
        None => opened(path, OpenOptions::new().truncate(true).create(true)),
    }
}

/// Sees to it that what is drawn to a file can be gone back in, before anything is drawn.
pub(crate) fn must_go_back(path: &Path, file: &mut File) -> Result<(), Failure> {
    if is_standard(path) || file.stream_position().is_err() {
        return Err(Failure::usage(format!(
            "cannot write {}: the beginning of this format is written last, which needs a file of its own; \
             name one",
            path.display()
        )));
    }
    Ok(())
}

/// Sees to it before anything is done that a file can be written at the end. What stands there stays until
/// then, and nothing is left where nothing stood.
pub(crate) fn claim(path: &Path) -> Result<(), Failure> {
    match fs::metadata(path) {
        // Whoever reads a pipe would take this for its end.
        Ok(there) if !there.is_file() && !there.is_dir() => Ok(()),
        Ok(_) => opened(path, &mut OpenOptions::new()).map(drop),
        Err(_) => {
            create(path)?;
            // A link may lead to it, and stays.
            let made = fs::canonicalize(path).and_then(fs::remove_file);
            made.map_err(|error| unwritable(path, &error))
        }
    }
}

/// Writes a file at a name that somebody has given, so that it is there as a whole, or as it was, or not at
/// all. What is no file, such as a pipe, is written to as it is.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let written = match fs::metadata(path) {
        _ if is_standard_output(path) => return print_bytes(bytes),
        _ if is_standard_error(path) => io::stderr().write_all(bytes),
        // Somebody has it open, and goes on writing there.
        Ok(_) if path.starts_with("/dev") || path.starts_with("/proc") => fs::write(path, bytes),
        Ok(there) if there.is_file() => replace(path, &there, bytes),
        Ok(_) => fs::write(path, bytes),
        Err(_) => fs::write(path, bytes).inspect_err(|_| {
            // A link may lead to it, and stays.
            let _ = fs::canonicalize(path).and_then(fs::remove_file);
        }),
    };
    written.map_err(|error| unwritable(path, &error))
}

/// Standard output or standard error, if that is what a path means, so that what else is written there
/// comes before or after.
#[cfg(unix)]
fn standard(path: &Path) -> Option<io::Result<File>> {
    use std::os::fd::AsFd as _;
    let file = if is_standard_output(path) {
        io::stdout().flush().and_then(|()| io::stdout().as_fd().try_clone_to_owned())
    } else if is_standard_error(path) {
        io::stderr().as_fd().try_clone_to_owned()
    } else {
        return None;
    };
    Some(file.map(File::from))
}

#[cfg(not(unix))]
fn standard(_: &Path) -> Option<io::Result<File>> {
    None
}

/// Whether a path means standard output or standard error, where what else is written is to stay.
pub(crate) fn is_standard(path: &Path) -> bool {
    is_standard_output(path) || is_standard_error(path)
}

fn is_standard_output(path: &Path) -> bool {
    is_named(path, 1, "out")
}

fn is_standard_error(path: &Path) -> bool {
    is_named(path, 2, "err")
}

/// Whether a path is one of those by which a system names a stream.
fn is_named(path: &Path, number: u32, name: &str) -> bool {
    let names =
        [format!("/dev/std{name}"), format!("/dev/fd/{number}"), format!("/proc/self/fd/{number}")];
    names.iter().any(|known| path == Path::new(known))
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
    use ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    let right = match error.kind() {
        FileTooLarge | QuotaExceeded | StorageFull => {
            "make room where it leads to, and begin again"
        }
        _ => "name a file in a folder that can be written to",
    };
    Failure::usage(format!("cannot write {}: {error}; {right}", path.display()))
}

/// Help and version are requested output; any other message of the command-line parser is an error.
pub(crate) fn said(said: &clap::Error) -> ExitCode {
    let printed = said.print().and_then(|()| io::stdout().flush());
    if said.use_stderr() {
        return ExitCode::from(2);
    }
    written(printed).map_or_else(Failure::report, |()| ExitCode::SUCCESS)
}
