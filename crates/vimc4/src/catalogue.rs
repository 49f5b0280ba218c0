//! What is built in, and profiles from files.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vimc4_isel::Model;
use vimc4_plant::{Machine, ProfileError};

use crate::error::{Error, ProfileFileError};

/// No profile is as large as this.
const LARGEST: u64 = 1024 * 1024;

/// The names of the built-in models.
#[must_use]
pub fn models() -> Vec<&'static str> {
    Model::names()
}

/// The names of the built-in machines.
#[must_use]
pub fn machines() -> Vec<&'static str> {
    Machine::names()
}

/// The built-in model of that name, or the one whose profile is in that file.
///
/// # Errors
///
/// If there is no such model or file, or the file holds no profile.
pub fn model(name_or_file: &str) -> Result<Arc<Model>, Error> {
    find("model", name_or_file, &models(), Model::builtin, Model::from_toml)
}

/// The built-in machine of that name, or the one whose profile is in that file.
///
/// # Errors
///
/// If there is no such machine or file, or the file holds no profile.
pub fn machine(name_or_file: &str) -> Result<Arc<Machine>, Error> {
    find("machine", name_or_file, &machines(), Machine::builtin, Machine::from_toml)
}

/// The profile of a built-in model as TOML, to start one's own from.
///
/// # Errors
///
/// If there is no such model.
pub fn model_profile(name: &str) -> Result<&'static str, Error> {
    Model::builtin_toml(name).ok_or_else(|| unknown("model", name, &models()))
}

/// The profile of a built-in machine as TOML, to start one's own from.
///
/// # Errors
///
/// If there is no such machine.
pub fn machine_profile(name: &str) -> Result<&'static str, Error> {
    Machine::builtin_toml(name).ok_or_else(|| unknown("machine", name, &machines()))
}

fn find<T>(
    what: &'static str,
    name_or_file: &str,
    known: &[&str],
    builtin: impl Fn(&str) -> Option<Arc<T>>,
    parse: impl Fn(&str) -> Result<T, ProfileError>,
) -> Result<Arc<T>, Error> {
    if let Some(found) = builtin(name_or_file) {
        return Ok(found);
    }
    let path = Path::new(name_or_file);
    let means_a_file = path.components().count() > 1 || path.extension().is_some();
    if !means_a_file && !path.is_file() {
        return Err(unknown(what, name_or_file, known));
    }
    let text = read(path).map_err(|source| Error::File { what, path: path.to_owned(), source })?;
    parse(&text).map(Arc::new).map_err(|error| {
        Error::Profile(Box::new(ProfileFileError {
            what,
            path: PathBuf::from(path),
            line: line_of(&text, error.span.as_ref().map_or(0, |span| span.start)),
            text,
            error,
        }))
    })
}

/// Reads a file that is no larger than a profile can be; a device may have no end.
fn read(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    let read = File::open(path)?.take(LARGEST).read_to_string(&mut text)?;
    if u64::try_from(read).is_ok_and(|read| read == LARGEST) {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "it is too large for a profile"));
    }
    Ok(text)
}

fn unknown(what: &'static str, name: &str, known: &[&str]) -> Error {
    Error::Unknown { what, name: name.to_owned(), known: known.join(", ") }
}

/// The number, from 1, of the line that holds this byte.
fn line_of(text: &str, at: usize) -> usize {
    text.bytes().take(at).filter(|&byte| byte == b'\n').count() + 1
}
