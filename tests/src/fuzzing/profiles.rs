//! The profiles of models and machines, as anybody may write them.

use serde::Serialize;
use vimc4_isel::{Controller, Model};
use vimc4_plant::{Machine, ProfileError};

use super::exercise;

/// A profile is refused with an error that points into its text, or it is written and read as
/// the same, and a controller works with it.
///
/// After a first line `like NAME` come the lines that replace those with the same keys in the
/// built-in profile NAME, or are added to it; any other text is a whole profile.
pub fn profiles(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let text = filled(text);
    let model = Model::from_toml(&text);
    let machine = Machine::from_toml(&text);
    check(&text, &model, Model::from_toml);
    check(&text, &machine, Machine::from_toml);
    let (model, machine) = match (model, machine) {
        (Ok(model), _) => (Some(model.into()), Machine::builtin("bench")),
        // Known: nothing refuses places so far away that the arithmetic of 64 bits ends.
        (_, Ok(machine)) if !is_near(&machine) => return,
        (_, Ok(machine)) => (Model::builtin("imc-s8"), Some(machine.into())),
        (Err(_), Err(_)) => return,
    };
    if let (Some(model), Some(machine)) = (model, machine)
        && let Ok(mut controller) = Controller::new(model, machine, b"")
    {
        exercise(&mut controller);
    }
}

/// Whether everything on a machine is within a trillion steps.
fn is_near(machine: &Machine) -> bool {
    machine.axes().into_iter().all(|axis| {
        let ends = [axis.negative_switch, axis.positive_switch, axis.lowest, axis.highest];
        let mut places = ends.into_iter().flatten().chain([axis.start]);
        places.all(|place| place.unsigned_abs() < 1 << 40)
    })
}

fn check<T: Serialize + PartialEq>(
    text: &str,
    profile: &Result<T, ProfileError>,
    read: fn(&str) -> Result<T, ProfileError>,
) {
    match profile {
        Ok(profile) => {
            let written = toml::to_string(profile).unwrap_or_default();
            assert!(read(&written).as_ref() == Ok(profile), "not the same again: {written}");
        }
        Err(error) => {
            assert!(!error.message.is_empty() && !error.help.is_empty());
            let inside = error.span.clone().is_none_or(|span| text.get(span).is_some());
            assert!(inside, "points beside the text: {error:?}");
        }
    }
}

/// The whole profile that a text stands for.
fn filled(text: &str) -> String {
    let (first, lines) = text.split_once('\n').unwrap_or((text, ""));
    let like = first.strip_prefix("like ").map(str::trim);
    let builtin = like.and_then(|name| Model::builtin_toml(name).or(Machine::builtin_toml(name)));
    let Some(builtin) = builtin else { return text.to_owned() };
    let key = |line: &str| line.split('=').next().unwrap_or_default().trim().to_owned();
    let there = |line: &&str| builtin.lines().any(|known| key(known) == key(line));
    let mut filled = String::new();
    for line in builtin.lines() {
        let other = lines.lines().find(|other| other.contains('=') && key(other) == key(line));
        filled.push_str(other.unwrap_or(line));
        filled.push('\n');
    }
    // Keys that are not there yet are added at the end.
    for line in lines.lines().filter(|line| !there(line)) {
        filled.push_str(line);
        filled.push('\n');
    }
    filled
}
