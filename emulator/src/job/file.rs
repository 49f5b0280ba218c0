//! Files: their bytes, their text, and what they are.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use vimc4_ncp::language;

use crate::failure::Failure;
use crate::text;

/// The largest job, in bytes: ten million lines fit.
const LARGEST: u64 = 256 << 20;

/// What is said where standard input can be read as well.
pub(crate) const OR_INPUT: &str = ", or `-` for standard input";

/// The bytes of a file that must not have more than so many; `-` is standard input.
pub(crate) fn bounded(path: &Path, largest: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if path == Path::new("-") {
        io::stdin().lock().take(largest + 1).read_to_end(&mut bytes)?;
    } else {
        let file = File::open(path)?;
        // A device or a pipe has no known length, and may have no end.
        if file.metadata()?.len() > largest {
            return Err(too_large(largest));
        }
        file.take(largest + 1).read_to_end(&mut bytes)?;
    }
    if bytes.len() as u64 > largest {
        return Err(too_large(largest));
    }
    Ok(bytes)
}

/// As much of a file as shows what it is, where it is compressed, too: zstd has blocks of 128 KiB.
const BEGINNING: u64 = 160 << 10;

/// The first bytes of a file, as far as it can be read: to see what it is before all of it is read.
pub(crate) fn beginning(path: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Reading all of it later reports the error.
    let _ = File::open(path).and_then(|file| file.take(BEGINNING).read_to_end(&mut bytes));
    bytes
}

/// Whether what a name leads to is a file, and no pipe, device or terminal: those may have no end, give
/// nothing for hours, or be what somebody else reads. What is not there is told of when it is opened.
///
/// # Errors
///
/// What it is instead.
pub(crate) fn is_regular(path: &Path) -> Result<(), &'static str> {
    let Ok(about) = std::fs::metadata(path) else { return Ok(()) };
    let kind = about.file_type();
    match kind.is_file() || kind.is_dir() {
        true => Ok(()),
        false => Err("it is a pipe or a device, which may have no end or be read by others"),
    }
}

fn too_large(largest: u64) -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, format!("it is larger than {} MiB", largest >> 20))
}

/// The bytes of a file; `-` is standard input. `what` says what it should be.
pub(crate) fn read(path: &Path, what: &str) -> Result<Vec<u8>, Failure> {
    let name = text::name(path);
    let bytes = bounded(path, LARGEST).map_err(|error| {
        Failure::usage(format!("cannot read {name}: {error}; name {what}{OR_INPUT}"))
    })?;
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") || is_wide(&bytes) {
        return Err(Failure::usage(format!(
            "{name} is text in UTF-16, which no controller reads; save it as plain text or UTF-8"
        )));
    }
    Ok(bytes)
}

/// Whether it is plain text with a 0 beside every character.
fn is_wide(bytes: &[u8]) -> bool {
    let beginning = &bytes[..bytes.len().min(64) & !1];
    let is_text = |byte: u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    beginning.len() >= 4
        && (beginning.chunks(2).all(|pair| is_text(pair[0]) && pair[1] == 0)
            || beginning.chunks(2).all(|pair| pair[0] == 0 && is_text(pair[1])))
}

/// The text in the bytes of a job file.
pub(crate) fn decoded(bytes: &[u8]) -> String {
    language::decode(bytes).into_owned()
}

/// Refuses a file of G-code.
pub(crate) fn no_g_code(name: &str, bytes: &[u8]) -> Result<(), Failure> {
    let text = decoded(bytes);
    let Some(line) = language::g_code(&text) else { return Ok(()) };
    let problem = language::Problem::GCode;
    let help = problem.help().unwrap_or_default();
    Err(Failure::at_line(format!("{name}: {problem}; {help}"), name, &text, line.number))
}
