//! The profiles of models and machines, as anybody may write them.

use std::sync::Arc;

use serde::Serialize;
use vimc4_device::AXES;
use vimc4_plant::{Machine, ProfileError};

use super::exercise::exercise;
use super::{isel, lpkf};

/// A profile is refused with an error that points into its text, or it is written and read as
/// the same, and a controller works with it.
///
/// After a first line `like NAME` come the lines that replace those with the same keys in the
/// built-in profile NAME, or are added to it; any other text is a whole profile.
pub fn profiles(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let text = filled(text);
    let isel = vimc4_isel::Model::from_toml(&text);
    let lpkf = vimc4_lpkf::Model::from_toml(&text);
    let machine = Machine::from_toml(&text);
    check(&text, &isel, vimc4_isel::Model::from_toml);
    check(&text, &lpkf, vimc4_lpkf::Model::from_toml);
    check(&text, &machine, Machine::from_toml);
    let bench = || Machine::builtin("bench").unwrap_or_else(|| unreachable!());
    match (isel, lpkf, machine) {
        (Ok(model), ..) => try_isel(Arc::new(model), bench()),
        (_, Ok(model), _) => try_lpkf(Arc::new(model), bench()),
        // Known: nothing refuses places so far away that the arithmetic of 64 bits ends.
        (.., Ok(machine)) if is_near(&machine) => {
            let machine = Arc::new(machine);
            if let Some(model) = vimc4_isel::Model::builtin("imc-s8") {
                try_isel(model, Arc::clone(&machine));
            }
            if let Some(model) = vimc4_lpkf::Model::builtin("motionsystem") {
                try_lpkf(model, machine);
            }
        }
        _ => {}
    }
}

fn try_isel(model: Arc<vimc4_isel::Model>, machine: Arc<Machine>) {
    if let Ok(mut controller) = vimc4_isel::Controller::new(model, machine, b"") {
        exercise(&mut controller, &isel::inputs());
    }
}

fn try_lpkf(model: Arc<vimc4_lpkf::Model>, machine: Arc<Machine>) {
    exercise(&mut vimc4_lpkf::Controller::new(model, machine), &lpkf::inputs());
}

/// Whether everything on a machine is within a trillion steps.
fn is_near(machine: &Machine) -> bool {
    (0..AXES).map(|axis| machine.axis(axis)).all(|axis| {
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
    let builtin = like.and_then(|name| {
        let model = vimc4_isel::Model::builtin_toml(name);
        model.or(vimc4_lpkf::Model::builtin_toml(name)).or(Machine::builtin_toml(name))
    });
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
