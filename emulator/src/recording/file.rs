//! Recordings in files.

use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind, Read};
use std::path::Path;

use vimc4_timeline::recording::{ReadError, Reader, Recording};

use crate::failure::Failure;
use crate::output;
use crate::text;

/// No recording that is read as a whole has more bytes when it is unpacked.
const LARGEST: u64 = 1 << 30;

/// So much of a line is shown on either side of where it is wrong.
const AROUND: usize = 60;

/// The place of a line further down is only said.
const SHOWN: u32 = 1_000_000;

/// Reads a recording; `-` is standard input.
pub(crate) fn read(path: &Path) -> Result<Recording, Failure> {
    let name = text::name(path);
    let failed = |error: io::Error| {
        let text =
            format!("cannot read {name}: {error}; name a recording, or `-` for standard input");
        match error.kind() {
            ErrorKind::InvalidData | ErrorKind::UnexpectedEof => Failure::midway(text),
            _ => Failure::usage(text),
        }
    };
    let source: Box<dyn Read> = match path == Path::new("-") {
        true => Box::new(io::stdin().lock()),
        false => Box::new(File::open(path).map_err(failed)?),
    };
    let text = vimc4::unpacking(source).map_err(failed)?;
    let mut text = BufReader::new(text.take(LARGEST + 1));
    let mut line = Vec::new();
    let mut torn = next(&mut text, &mut line).map_err(failed)?;
    if torn {
        let broken = "it is compressed and broken off in its first line";
        return Err(failed(io::Error::new(ErrorKind::UnexpectedEof, broken)));
    }
    let mut reader = Reader::begin(&line).map_err(|error| wrong(&name, &line, &error))?;
    let mut read = line.len() as u64;
    while !torn {
        torn = next(&mut text, &mut line).map_err(failed)?;
        if line.is_empty() {
            break;
        }
        read += line.len() as u64;
        if read > LARGEST {
            let size = LARGEST >> 30;
            return Err(Failure::usage(format!(
                "{name} is larger than {size} GiB; record with --record-size, and play the parts"
            )));
        }
        reader.line(&line).map_err(|error| wrong(&name, &line, &error))?;
    }
    Ok(reader.finish())
}

/// Reads the next line with its end, and no more of it than a line can have. Says whether it was torn
/// off in a file that is compressed: what could be unpacked of it is there.
fn next(text: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<bool> {
    line.clear();
    let longest = Reader::LONGEST_LINE as u64 + 1;
    match text.by_ref().take(longest).read_until(b'\n', line) {
        Ok(_) => Ok(false),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(true),
        Err(error) => Err(error),
    }
}

/// What is wrong with a line of a recording, with the place in it.
fn wrong(name: &str, line: &[u8], error: &ReadError) -> Failure {
    at_place(&format!("{name}, {error}"), name, line, error.line, error.column)
}

/// Something in a recording that was read that cannot be played, at one of its lines, with which the
/// error begins.
pub(super) fn unplayable(
    path: &Path,
    recording: &Recording,
    error: impl std::fmt::Display,
) -> Failure {
    let (name, error) = (text::name(path), error.to_string());
    let message = format!("{name}, {error}; take the recording as it was written, by this version");
    let number = error.strip_prefix("line ").and_then(|rest| rest.split_once(':'));
    let Some(line) = number.and_then(|(number, _)| number.parse().ok()) else {
        return Failure::midway(message);
    };
    let mut written = Vec::new();
    match line {
        1 => recording.head.put(&mut written),
        _ => {
            if let Some(entry) = recording.entries.iter().find(|entry| entry.line == line) {
                entry.put(&mut written);
            }
        }
    }
    at_place(&message, &name, &written, line, 0)
}

/// A message with the part of the line that it is about.
fn at_place(message: &str, name: &str, line: &[u8], number: u32, column: u32) -> Failure {
    if number > SHOWN {
        return Failure::midway(message);
    }
    let place = number.saturating_sub(1) as usize;
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    // A state takes thousands of characters.
    let column = (column as usize).min(line.len());
    let from = column.saturating_sub(AROUND);
    let to = line.len().min(column + AROUND);
    let part = String::from_utf8_lossy(&line[from..to]);
    let dots = |more: bool| if more { "…" } else { "" };
    let part = format!("{}{part}{}", dots(from > 0), dots(to < line.len()));
    Failure::at_line(message, name, &("\n".repeat(place) + &part), number)
}

/// Writes a recording into a file that is not there yet, or to standard output.
pub(super) fn write(recording: &Recording, path: Option<&Path>) -> Result<(), Failure> {
    let bytes = recording.write();
    let Some(path) = path else {
        // Recordings are ASCII.
        return output::print(&String::from_utf8_lossy(&bytes));
    };
    vimc4::pack(path, &bytes).map_err(Failure::usage)
}
