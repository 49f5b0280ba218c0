//! Profiles from files.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vimc4_catalogue::{Machine, Model, ProfileError, Unknown};

use vimc4_device::{Names, Scenario};

use crate::error::{Error, ProfileFileError};

/// No profile is as large as this.
const LARGEST: u64 = 1024 * 1024;

/// The built-in model of that name, or the one whose profile is in that file.
///
/// # Errors
///
/// If there is no such model or file, or the file holds no profile.
pub fn model(name_or_file: &str) -> Result<Model, Error> {
    vimc4_catalogue::model(name_or_file).or_else(|unknown| read_as(unknown, Model::from_toml))
}

/// The built-in machine of that name, or the one whose profile is in that file.
///
/// # Errors
///
/// If there is no such machine or file, or the file holds no profile.
pub fn machine(name_or_file: &str) -> Result<Arc<Machine>, Error> {
    let parse = |text: &str| Machine::from_toml(text).map(Arc::new);
    vimc4_catalogue::machine(name_or_file).or_else(|unknown| read_as(unknown, parse))
}

/// The profile of a built-in model as TOML, to start one's own from.
///
/// # Errors
///
/// If there is no such model.
pub fn model_profile(name: &str) -> Result<&'static str, Error> {
    Ok(vimc4_catalogue::model_profile(name)?)
}

/// The profile of a built-in machine as TOML, to start one's own from.
///
/// # Errors
///
/// If there is no such machine.
pub fn machine_profile(name: &str) -> Result<&'static str, Error> {
    Ok(vimc4_catalogue::machine_profile(name)?)
}

/// The scenario in a file, for a controller with these names: TOML, a table for each rule.
///
/// ```toml
/// [[rule]]
/// name = "slips"          # what other rules call it, if any do
/// when = "x > 1000"       # or `at`, `every`, `while`
/// times = 1               # no more often than this
/// do = "fault jam x for 20ms; press stop"
/// ```
///
/// # Errors
///
/// If the file cannot be read, or something in it is no rule.
pub fn scenario_file(path: impl AsRef<Path>, names: &Names) -> Result<Scenario, Error> {
    let path = path.as_ref();
    let text = read(path);
    let text = text.map_err(|source| Error::ScenarioFile { path: path.to_owned(), source })?;
    parse_file("scenario", path, text, |text| vimc4_catalogue::scenario(text, names))
}

/// What has no name that is built in may be the name of a file.
fn read_as<T>(
    unknown: Unknown,
    parse: impl Fn(&str) -> Result<T, ProfileError>,
) -> Result<T, Error> {
    let what = unknown.what;
    let path = Path::new(&unknown.name);
    let means_a_file = path.components().count() > 1 || path.extension().is_some();
    if !means_a_file && !path.is_file() {
        return Err(unknown.into());
    }
    let text = read(path).map_err(|source| Error::File { what, path: path.to_owned(), source })?;
    parse_file(what, path, text, parse)
}

fn parse_file<T>(
    what: &'static str,
    path: &Path,
    bytes: Vec<u8>,
    parse: impl Fn(&str) -> Result<T, ProfileError>,
) -> Result<T, Error> {
    let (text, parsed) = match String::from_utf8(bytes) {
        Ok(text) => {
            let parsed = parse(&text);
            (text, parsed)
        }
        Err(error) => {
            // Up to there the text is the same.
            let at = error.utf8_error().valid_up_to();
            let byte = error.as_bytes().get(at).copied().unwrap_or_default();
            let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
            let error = ProfileError {
                message: format!("byte {} of the file, {byte:#04x}, is not UTF-8", at + 1),
                help: "save the file as text in UTF-8".to_owned(),
                span: Some(at..at + '\u{fffd}'.len_utf8()),
            };
            (text, Err(error))
        }
    };
    parsed.map_err(|error| {
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
fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut text = Vec::new();
    let read = File::open(path)?.take(LARGEST).read_to_end(&mut text)?;
    if u64::try_from(read).is_ok_and(|read| read == LARGEST) {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "it is too large for a profile"));
    }
    Ok(text)
}

/// The number, from 1, of the line that holds this byte.
fn line_of(text: &str, at: usize) -> usize {
    text.bytes().take(at).filter(|&byte| byte == b'\n').count() + 1
}
