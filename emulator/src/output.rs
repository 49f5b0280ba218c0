//! Standard output, where what was asked for goes.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::process::ExitCode;

use crate::failure::Failure;

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

/// A new file for what is drawn, at a name that somebody has given.
pub(crate) fn create(path: &Path) -> Result<File, Failure> {
    opened(path, OpenOptions::new().truncate(true).create(true))
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

fn opened(path: &Path, how: &mut OpenOptions) -> Result<File, Failure> {
    if path == Path::new("-") {
        return Err(Failure::usage(
            "`-` is where the report goes, and this needs a file; name one, or `./-` for one of that name",
        ));
    }
    how.write(true).open(path).map_err(|error| unwritable(path, &error))
}

/// Why a file cannot be written.
pub(crate) fn unwritable(path: &Path, error: &io::Error) -> Failure {
    Failure::usage(format!(
        "cannot write {}: {error}; name a file in a folder that can be written to",
        path.display()
    ))
}

/// Help and version are requested output; any other message of the command-line parser is an error.
pub(crate) fn said(said: &clap::Error) -> ExitCode {
    let printed = said.print().and_then(|()| io::stdout().flush());
    if said.use_stderr() {
        return ExitCode::from(2);
    }
    written(printed).map_or_else(Failure::report, |()| ExitCode::SUCCESS)
}
