//! What is built in, and profiles from files.

mod axes;
mod controller;
mod family;
mod model;

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vimc4_plant::{Machine, ProfileError};

pub use axes::axis;
pub use controller::{Controller, State};
pub use family::Family;
pub use model::Model;

use crate::error::{Error, MemoryError, ProfileFileError};

/// No profile is as large as this.
const LARGEST: u64 = 1024 * 1024;

/// The names of the built-in models.
#[must_use]
pub fn models() -> Vec<&'static str> {
    Family::ALL.into_iter().flat_map(Family::models).collect()
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
pub fn model(name_or_file: &str) -> Result<Model, Error> {
    find("model", name_or_file, &models(), Model::builtin, Model::from_toml)
}

/// The built-in machine of that name, or the one whose profile is in that file.
///
/// # Errors
///
/// If there is no such machine or file, or the file holds no profile.
pub fn machine(name_or_file: &str) -> Result<Arc<Machine>, Error> {
    let parse = |text: &str| Machine::from_toml(text).map(Arc::new);
    find("machine", name_or_file, &machines(), Machine::builtin, parse)
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

/// A controller that has just been switched on, without a thread, a clock or a port, with this
/// image in its flash memory.
///
/// # Errors
///
/// If the image is not one of this model.
pub fn bare(
    model: &Model,
    machine: &Arc<Machine>,
    flash: &[u8],
) -> Result<Controller, MemoryError> {
    Controller::new(model, Arc::clone(machine), flash)
}

/// The built-in models of the same kind: the one of that name, else all with the same commands.
#[must_use]
pub fn kin(model: &Model) -> Vec<&'static str> {
    let names = models().into_iter();
    if let Some(own) = names.clone().find(|name| *name == model.name()) {
        return vec![own];
    }
    let same = |name: &&str| Model::builtin(name).is_some_and(|other| other.has_commands_of(model));
    names.filter(same).collect()
}

/// Every value that each quirk of a model's profile can have, as TOML writes it.
#[must_use]
pub fn quirks(model: &Model) -> &'static [(&'static str, &'static [&'static str])] {
    model.quirks()
}

fn find<T>(
    what: &'static str,
    name_or_file: &str,
    known: &[&str],
    builtin: impl Fn(&str) -> Option<T>,
    parse: impl Fn(&str) -> Result<T, ProfileError>,
) -> Result<T, Error> {
    if let Some(found) = builtin(name_or_file) {
        return Ok(found);
    }
    let path = Path::new(name_or_file);
    let means_a_file = path.components().count() > 1 || path.extension().is_some();
    if !means_a_file && !path.is_file() {
        return Err(unknown(what, name_or_file, known));
    }
    let text = read(path).map_err(|source| Error::File { what, path: path.to_owned(), source })?;
    parse(&text).map_err(|error| {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The line of a profile that sets a quirk.
    fn line<'p>(profile: &'p str, quirk: &str) -> &'p str {
        profile.lines().find(|line| line.starts_with(&format!("{quirk} = "))).unwrap()
    }

    #[test]
    fn every_quirk_is_listed_with_every_value_it_can_have() {
        for name in models() {
            let profile = model_profile(name).unwrap();
            let own = model(name).unwrap();
            let (_, table) = profile.split_once("[quirks]\n").unwrap();
            let keys = table.lines().take_while(|line| !line.is_empty());
            let keys = keys.filter(|line| !line.starts_with('#'));
            let mut keys: Vec<&str> = keys.filter_map(|line| line.split(" = ").next()).collect();
            let mut listed: Vec<&str> = quirks(&own).iter().map(|(quirk, _)| *quirk).collect();
            keys.sort_unstable();
            listed.sort_unstable();
            assert_eq!(keys, listed, "{name}");
            for (quirk, values) in quirks(&own) {
                let with = |value: &str| {
                    let other = format!("{quirk} = {value}");
                    Model::from_toml(&profile.replace(line(profile, quirk), &other))
                };
                let differing = values.iter().filter(|value| with(value).unwrap() != own).count();
                assert_eq!(differing, values.len() - 1, "{quirk} of {name}");
                // A wrong value is answered with the right ones.
                let error = with("\"?\"").unwrap_err().message;
                let Some((_, right)) = error.split_once("expected ") else { continue };
                if right.contains('`') {
                    assert_eq!(right.matches('`').count(), 2 * values.len(), "{error}");
                    for value in *values {
                        assert!(right.contains(&value.replace('"', "`")), "{error}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_kin_of_a_model_are_those_with_its_commands() {
        let mine = |name: &str| {
            let profile = model_profile(name).unwrap();
            Model::from_toml(&profile.replace(line(profile, "name"), "name = \"mine\"")).unwrap()
        };
        assert_eq!(kin(&model("imc-m").unwrap()), ["imc-m"]);
        assert_eq!(kin(&mine("imc-m")), ["imc-m", "imc-mp", "imc-s8"]);
        assert_eq!(kin(&mine("smcu")), ["smcu"]);
    }
}
