//! Commands that are written down, and files that are written by commands.

use std::fs;
use std::io::{self, BufRead, IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use vimc4_debug::Completion;

use super::screen;
use super::session::{Outcome, Session, Wrong};
use crate::failure::Failure;
use crate::identity::none_twice;
use crate::job::file::bounded;
use crate::output;
use crate::text;

/// A console, here or elsewhere.
pub(crate) trait Console {
    /// Carries out a line as somebody types it; an empty one does the last one again.
    fn carry_out(&mut self, line: &str) -> Result<Outcome, Wrong>;

    /// The same, where an empty line does nothing.
    fn carry_out_once(&mut self, line: &str) -> Result<Outcome, Wrong>;

    /// How a line can go on.
    fn complete(&self, line: &str, cursor: usize) -> Completion;
}

impl Console for Session {
    fn carry_out(&mut self, line: &str) -> Result<Outcome, Wrong> {
        let outcome = Session::carry_out(self, line);
        drawn(self, outcome)
    }

    fn carry_out_once(&mut self, line: &str) -> Result<Outcome, Wrong> {
        let outcome = Session::carry_out_once(self, line);
        drawn(self, outcome)
    }

    fn complete(&self, line: &str, cursor: usize) -> Completion {
        Session::complete(self, line, cursor)
    }
}

/// Writes the screen into a file, if that is what was wanted.
fn drawn(session: &mut Session, outcome: Result<Outcome, Wrong>) -> Result<Outcome, Wrong> {
    let (file, size) = match outcome? {
        Outcome::Picture(file, size) => (file, size),
        other => return Ok(other),
    };
    let inputs = session.inputs.iter().map(PathBuf::as_path);
    none_twice(inputs, [Path::new(&file)]).map_err(|failure| Wrong::new(failure.text()))?;
    let svg = screen::as_svg(session, size);
    fs::write(&file, svg).map_err(|error| Wrong::new(format!("cannot write {file}: {error}")))?;
    Ok(Outcome::Said(format!("written to {file}")))
}

/// A file of commands.
pub(crate) struct Script {
    name: String,
    lines: String,
}

impl Script {
    /// Reads it. That may wait for who writes a pipe, and has its place before anything else is done.
    ///
    /// # Errors
    ///
    /// If it cannot be read, or is too long.
    pub(crate) fn read(file: &Path) -> Result<Script, Failure> {
        let name = text::name(file);
        match text_of(file) {
            Ok(lines) => Ok(Script { name, lines }),
            Err(error) => Err(Failure::usage(format!(
                "cannot read {name}: {error}; name a file of console commands"
            ))),
        }
    }
}

/// Carries out what a script or a pipe has. Nothing is returned if somebody is at the terminal.
pub(crate) fn written_down(
    console: &mut dyn Console,
    given: Option<&Script>,
) -> Result<Option<ExitCode>, Failure> {
    let Some(Script { name, lines }) = given else {
        return if io::stdin().is_terminal() { Ok(None) } else { piped(console).map(Some) };
    };
    script(console, name, lines, 0)?;
    Ok(Some(ExitCode::SUCCESS))
}

/// No file of commands has more bytes.
const LARGEST: u64 = 8 << 20;

/// The text of a file of commands; `-` is standard input. A device or a pipe may have no end.
fn text_of(file: &Path) -> io::Result<String> {
    let bytes = bounded(file, LARGEST)?;
    String::from_utf8(bytes)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.utf8_error()))
}

/// So many files may call each other.
const DEEPEST: u32 = 16;

/// Whether a script is to be gone on with.
#[derive(PartialEq, Eq)]
pub(crate) enum Flow {
    GoesOn,
    Ends,
}

/// Carries out the commands of a script. The first that fails ends it.
fn script(console: &mut dyn Console, name: &str, lines: &str, depth: u32) -> Result<Flow, Failure> {
    for (number, line) in (1_u32..).zip(lines.lines()) {
        let failed = |message: String| Failure::at_line(message, name, lines, number);
        if let Err(message) = readable(line.as_bytes()) {
            return Err(failed(format!("{name}, line {number}: {message}")));
        }
        match console.carry_out_once(line) {
            Ok(Outcome::Said(text)) => say(line, &text)?,
            Ok(Outcome::Picture(..)) => {}
            Ok(Outcome::Quit) => return Ok(Flow::Ends),
            Ok(Outcome::Screen) => {
                let why = "the full screen needs somebody at the terminal; `picture FILE` writes it \
                           into a file";
                return Err(failed(format!("{name}, line {number}: {why}")));
            }
            Ok(Outcome::Source(file)) => {
                if called(console, &file, depth)? == Flow::Ends {
                    return Ok(Flow::Ends);
                }
            }
            Err(Wrong(message)) => {
                return Err(failed(format!("{name}, line {number}: {message}")));
            }
        }
    }
    Ok(Flow::GoesOn)
}

/// Carries out the commands of a file that another one, or somebody, calls.
pub(crate) fn called(console: &mut dyn Console, file: &str, depth: u32) -> Result<Flow, Failure> {
    if depth >= DEEPEST {
        return Err(Failure::midway(format!("{file} calls itself; leave `source` out")));
    }
    let lines = text_of(Path::new(file))
        .map_err(|error| Failure::midway(format!("cannot read {file}: {error}")))?;
    script(console, file, &lines, depth + 1)
}

/// What a line of a script was answered, behind the line.
fn say(line: &str, text: &str) -> Result<(), Failure> {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return Ok(());
    }
    let end = if text.is_empty() { String::new() } else { format!("{text}\n") };
    output::print(&format!("> {}\n{end}", text::shown(line)))
}

/// No line of commands is longer, in bytes.
const LONGEST: u64 = 1 << 16;

/// Carries out what comes through a pipe, each line as it comes.
fn piped(console: &mut dyn Console) -> Result<ExitCode, Failure> {
    let name = "standard input";
    let mut input = io::stdin().lock();
    let mut before = String::new();
    for number in 1_u32.. {
        let mut bytes = Vec::new();
        let read = input.by_ref().take(LONGEST).read_until(b'\n', &mut bytes);
        read.map_err(|error| Failure::midway(format!("cannot read {name}: {error}")))?;
        if bytes.is_empty() {
            break;
        }
        let failed = |message: String, before: &str| {
            Failure::at_line(format!("{name}, line {number}: {message}"), name, before, number)
        };
        let line = match readable(&bytes) {
            Ok(line) => line,
            Err(message) => return Err(failed(message, &before)),
        };
        before.push_str(line);
        before.push('\n');
        match console.carry_out_once(line) {
            Ok(Outcome::Said(text)) => say(line, &text)?,
            Ok(Outcome::Picture(..)) => {}
            Ok(Outcome::Quit) => break,
            Ok(Outcome::Source(file)) => {
                if called(console, &file, 0)? == Flow::Ends {
                    break;
                }
            }
            Ok(Outcome::Screen) => {
                let why = "the full screen needs somebody at the terminal";
                return Err(failed(why.to_owned(), &before));
            }
            Err(Wrong(message)) => return Err(failed(message, &before)),
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// A line as it was read, without its end, if it is text.
fn readable(bytes: &[u8]) -> Result<&str, String> {
    if bytes.len() as u64 == LONGEST && !bytes.ends_with(b"\n") {
        return Err(format!("a line has {LONGEST} bytes at most"));
    }
    let line = str::from_utf8(bytes).map_err(|error| {
        let byte = bytes.get(error.valid_up_to()).copied().unwrap_or_default();
        format!(
            "this is not a text: the byte {byte:02X} cannot stand there; commands are lines of UTF-8"
        )
    })?;
    let line = line.strip_suffix('\n').unwrap_or(line);
    let line = line.strip_suffix('\r').unwrap_or(line);
    match line.chars().find(|c| c.is_control() && *c != '\t') {
        Some(control) => Err(format!(
            "this is not a text: it has the control character {:02X}; `send` takes it as \\x{:02X}",
            u32::from(control),
            u32::from(control)
        )),
        None => Ok(line),
    }
}
