//! Recordings in files.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

use vimc4_timeline::recording::{ReadError, Recording};

use crate::failure::Failure;
use crate::job::file::bounded;
use crate::output;
use crate::text;

/// No recording that is read as a whole has more bytes, compressed or not.
const LARGEST: u64 = 4 << 30;

/// So much of a line is shown on either side of where it is wrong.
const AROUND: usize = 60;

/// Reads a recording; `-` is standard input.
pub(crate) fn read(path: &Path) -> Result<Recording, Failure> {
    let name = text::name(path);
    let failed = |error: std::io::Error| {
        Failure::usage(format!(
            "cannot read {name}: {error}; name a recording, or `-` for standard input"
        ))
    };
    let bytes = bounded(path, LARGEST).and_then(vimc4::unpack).map_err(failed)?;
    Recording::read(&bytes).map_err(|error| wrong(&name, &bytes, &error))
}

/// What is wrong with a recording, with the line and the place in it.
pub(super) fn wrong(name: &str, bytes: &[u8], error: &ReadError) -> Failure {
    let message = format!("{name}, {error}");
    let place = error.line.saturating_sub(1) as usize;
    let line = bytes.split(|byte| *byte == b'\n').nth(place).unwrap_or_default();
    // A state takes thousands of characters.
    let column = (error.column as usize).min(line.len());
    let from = column.saturating_sub(AROUND);
    let to = line.len().min(column + AROUND);
    let part = String::from_utf8_lossy(&line[from..to]);
    let dots = |more: bool| if more { "…" } else { "" };
    let part = format!("{}{part}{}", dots(from > 0), dots(to < line.len()));
    Failure::at_line(message, name, &("\n".repeat(place) + &part), error.line)
}

/// Something in a recording that was read that cannot be played, at one of its lines.
pub(super) fn unplayable(path: &Path, error: impl std::fmt::Display) -> Failure {
    Failure::midway(format!(
        "{}, {error}; take the recording as it was written, by this version",
        text::name(path)
    ))
}

/// Writes a recording into a file that is not there yet, or to standard output.
pub(super) fn write(recording: &Recording, path: Option<&Path>) -> Result<(), Failure> {
    let bytes = recording.write();
    let Some(path) = path else {
        // Recordings are ASCII.
        return output::print(&String::from_utf8_lossy(&bytes));
    };
    let written = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(path)
        .and_then(|mut file| file.write_all(&bytes));
    written.map_err(|error| {
        Failure::usage(format!(
            "cannot write {}: {error}; name a file that is not there yet",
            text::name(path)
        ))
    })
}
