//! Standard output, where what was asked for goes.

use std::io::{self, ErrorKind, Write};
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

/// Help and version are requested output; any other message of the command-line parser is an error.
pub(crate) fn said(said: &clap::Error) -> ExitCode {
    let printed = said.print().and_then(|()| io::stdout().flush());
    if said.use_stderr() {
        return ExitCode::from(2);
    }
    written(printed).map_or_else(Failure::report, |()| ExitCode::SUCCESS)
}
