//! What is built in, by name.

use std::sync::Arc;

use thiserror::Error;
use vimc4_plant::Machine;

use crate::{Controller, Family, MemoryError, Model};

/// Nothing built in has this name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("there is no {what} `{name}`; built in are {}", .known.join(", "))]
pub struct Unknown {
    /// `model` or `machine`.
    pub what: &'static str,
    /// The name.
    pub name: String,
    /// The names that would be right.
    pub known: Vec<&'static str>,
}

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

/// The built-in model of that name.
///
/// # Errors
///
/// If there is no such model.
pub fn model(name: &str) -> Result<Model, Unknown> {
    Model::builtin(name).ok_or_else(|| unknown("model", name, models()))
}

/// The built-in machine of that name.
///
/// # Errors
///
/// If there is no such machine.
pub fn machine(name: &str) -> Result<Arc<Machine>, Unknown> {
    Machine::builtin(name).ok_or_else(|| unknown("machine", name, machines()))
}

/// The profile of a built-in model as TOML, to start one's own from.
///
/// # Errors
///
/// If there is no such model.
pub fn model_profile(name: &str) -> Result<&'static str, Unknown> {
    Model::builtin_toml(name).ok_or_else(|| unknown("model", name, models()))
}

/// The profile of a built-in machine as TOML, to start one's own from.
///
/// # Errors
///
/// If there is no such machine.
pub fn machine_profile(name: &str) -> Result<&'static str, Unknown> {
    Machine::builtin_toml(name).ok_or_else(|| unknown("machine", name, machines()))
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
pub fn models_like(model: &Model) -> Vec<&'static str> {
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
    model.family().quirks()
}

fn unknown(what: &'static str, name: &str, known: Vec<&'static str>) -> Unknown {
    Unknown { what, name: name.to_owned(), known }
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
                // For a wrong value the error lists the right ones.
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
    fn models_like_one_of_ones_own_have_its_commands() {
        let mine = |name: &str| {
            let profile = model_profile(name).unwrap();
            Model::from_toml(&profile.replace(line(profile, "name"), "name = \"mine\"")).unwrap()
        };
        assert_eq!(models_like(&model("imc-m").unwrap()), ["imc-m"]);
        assert_eq!(models_like(&mine("imc-m")), ["imc-m", "imc-mp", "imc-s8"]);
        assert_eq!(models_like(&mine("smcu")), ["smcu"]);
    }
}
