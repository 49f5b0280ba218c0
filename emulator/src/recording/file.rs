//! Recordings in files.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind, Read};
use std::path::Path;
use std::rc::Rc;

use vimc4_timeline::recording::{Entry, ReadError, Reader, Recording};

use crate::failure::Failure;
use crate::job::file::OR_INPUT;
use crate::output;
use crate::text;

/// No recording that is read as a whole has more bytes when it is unpacked.
const LARGEST: u64 = 1 << 30;

/// How much is read at once.
const BUFFER: usize = 1 << 16;

/// How much of a line is shown on either side of the mistake.
const AROUND: usize = 60;

/// The place of a line further down is only said.
const SHOWN: u32 = 1_000_000;

/// A recording in a file, read line by line: no more of it is kept than the line that is read.
pub(crate) struct Lines {
    name: String,
    text: BufReader<io::Take<Box<dyn Read>>>,
    reader: Reader,
    /// The line that was read last.
    line: Vec<u8>,
    /// How many bytes were read, unpacked.
    read: u64,
    share: Share,
    is_over: bool,
}

/// What is said of a line that was torn off.
pub(crate) fn torn_off(line: u32) -> String {
    format!("Line {line} was torn off when it was written, and is left out.")
}

/// How much of a file has been read, while somebody reads it.
#[derive(Clone, Debug)]
pub(crate) struct Share {
    /// How many bytes were read, as they are in the file.
    taken: Rc<Cell<u64>>,
    /// How many it has, if that can be known.
    size: Option<u64>,
    /// Whether its end has been read.
    is_whole: Rc<Cell<bool>>,
}

impl Share {
    /// Whether the line that ends a recording has been read.
    #[cfg(feature = "api")]
    pub(crate) fn is_whole(&self) -> bool {
        self.is_whole.get()
    }

    /// The share in thousandths.
    pub(crate) fn thousandths(&self) -> Option<u32> {
        let (taken, size) = (u128::from(self.taken.get()), u128::from(self.size?));
        u32::try_from((taken * 1_000).checked_div(size)?).ok().map(|share| share.min(1_000))
    }
}

impl Lines {
    /// Opens a recording and reads its head; `-` is standard input.
    pub(crate) fn open(path: &Path) -> Result<Lines, Failure> {
        let name = text::name(path);
        let failed = |error| unreadable(&name, error);
        let (source, size): (Box<dyn Read>, _) = match path == Path::new("-") {
            true => (Box::new(io::stdin()), None),
            false => {
                let file = File::open(path).map_err(failed)?;
                let size = file.metadata().ok().map(|about| about.len());
                (Box::new(file), size)
            }
        };
        let share = Share { taken: Rc::default(), size, is_whole: Rc::default() };
        let source = Counted { source, taken: Rc::clone(&share.taken) };
        let text = vimc4::unpacking(source).map_err(failed)?;
        let mut text = BufReader::with_capacity(BUFFER, text.take(LARGEST + 1));
        let mut line = Vec::new();
        if next(&mut text, &mut line).map_err(failed)? {
            let broken = "it is compressed and broken off in its first line";
            return Err(failed(io::Error::new(ErrorKind::UnexpectedEof, broken)));
        }
        let reader = Reader::begin(&line).map_err(|error| wrong(&name, &line, &error))?;
        let read = line.len() as u64;
        Ok(Lines { name, text, reader, line, read, share, is_over: false })
    }

    /// What is said of it so far.
    pub(crate) fn reader(&self) -> &Reader {
        &self.reader
    }

    /// How much of the file has been read.
    pub(crate) fn share(&self) -> &Share {
        &self.share
    }

    /// The next entry; `None` at the end.
    pub(crate) fn next(&mut self) -> Result<Option<Entry>, Failure> {
        while !self.is_over {
            let torn = next(&mut self.text, &mut self.line);
            let torn = torn.map_err(|error| unreadable(&self.name, error))?;
            self.is_over = torn || self.line.is_empty();
            if self.line.is_empty() {
                break;
            }
            self.read += self.line.len() as u64;
            if self.read > LARGEST {
                let size = LARGEST >> 30;
                return Err(Failure::usage(format!(
                    "{} is larger than {size} GiB; record with --record-size, and play the parts",
                    self.name
                )));
            }
            let entry = self.reader.line(&self.line);
            let entry = entry.map_err(|error| wrong(&self.name, &self.line, &error))?;
            self.share.is_whole.set(self.reader.has_ended());
            if entry.is_some() {
                return Ok(entry);
            }
        }
        Ok(None)
    }

    /// The line that was read last cannot be played, and why.
    pub(super) fn unplayable(&self, number: u32, error: impl std::fmt::Display) -> Failure {
        let message = unplayable_message(&self.name, &error);
        at_place(&message, &self.name, &self.line, number, 0)
    }
}

/// Reads a recording as a whole; `-` is standard input.
pub(crate) fn read(path: &Path) -> Result<Recording, Failure> {
    let mut lines = Lines::open(path)?;
    let mut entries = Vec::new();
    while let Some(entry) = lines.next()? {
        entries.push(entry);
    }
    let torn = lines.reader.torn();
    Ok(Recording { head: lines.reader.into_head(), entries, torn })
}

/// A source that counts what is taken from it.
struct Counted<R> {
    source: R,
    taken: Rc<Cell<u64>>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read(buffer)?;
        self.taken.set(self.taken.get() + read as u64);
        Ok(read)
    }
}

fn unreadable(name: &str, error: io::Error) -> Failure {
    let text = format!("cannot read {name}: {error}; name a recording{OR_INPUT}");
    match error.kind() {
        ErrorKind::InvalidData | ErrorKind::UnexpectedEof => Failure::midway(text),
        _ => Failure::usage(text),
    }
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
pub(crate) fn unplayable(
    path: &Path,
    recording: &Recording,
    error: impl std::fmt::Display,
) -> Failure {
    let (name, error) = (text::name(path), error.to_string());
    let message = unplayable_message(&name, &error);
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

fn unplayable_message(name: &str, error: &impl std::fmt::Display) -> String {
    format!("{name}, {error}; take the recording as it was written, by this version")
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

/// Writes a recording into a file that is not there yet, or to standard output, which is `-` as well.
pub(super) fn write(recording: &Recording, path: Option<&Path>) -> Result<(), Failure> {
    let bytes = recording.write();
    let Some(path) = path.filter(|path| *path != Path::new("-")) else {
        // Recordings are ASCII.
        return output::print(&String::from_utf8_lossy(&bytes));
    };
    vimc4::pack(path, &bytes).map_err(Failure::usage)
}
