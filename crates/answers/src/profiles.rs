//! Profiles as recordings have them, and with other values of quirks.

use std::sync::Arc;

use serde::Serialize;
use serde_json::Value;
use vimc4_catalogue::{Machine, Model, profile_text};
use vimc4_device::{Names, OwnedInput};
use vimc4_language::{read_faulting, read_ruling};
use vimc4_timeline::recording::Given;

/// What is given to a controller with these names: every signal is one of its own, with a value that it
/// can have, and every fault one that it knows.
///
/// # Errors
///
/// What there is instead.
pub fn known(names: &Names, given: &Given) -> Result<OwnedInput, String> {
    match given {
        Given::Signal { name, value } => {
            let signals = names.signals();
            let Some(signal) = signals.iter().find(|signal| signal.name == *name) else {
                let known: Vec<&str> = signals.iter().map(|signal| &*signal.name).collect();
                return Err(format!("there is no signal `{name}`, there are {}", known.join(", ")));
            };
            let values = signal.values();
            if !values.contains(value) {
                let (least, most) = (values.start(), values.end());
                return Err(format!("{name} cannot be {value}, it is from {least} to {most}"));
            }
            Ok(OwnedInput::Signal(signal.id, *value))
        }
        Given::Fault(words) => {
            let faulting = read_faulting(words, names);
            Ok(OwnedInput::Fault(faulting.map_err(|error| format!("fault {error}"))?))
        }
        Given::Rule(words) => {
            let ruling = read_ruling(words, names);
            Ok(OwnedInput::Rule(ruling.map_err(|error| format!("rule {error}"))?))
        }
        Given::Bytes(bytes) => Ok(OwnedInput::Bytes(bytes.clone())),
        Given::Power(on) => Ok(OwnedInput::Power(*on)),
        Given::Wait => Ok(OwnedInput::Wake),
    }
}

/// A model of a profile with another value of a quirk, and its profile.
///
/// # Errors
///
/// If it has no such quirk, or that cannot be so.
pub fn with_quirk(
    model: &Model,
    profile: &Value,
    name: &str,
    value: &str,
) -> Result<(Model, Value), String> {
    let quirks = vimc4_catalogue::quirks(model);
    let Some((_, values)) = quirks.iter().find(|(known, _)| *known == name) else {
        let known: Vec<&str> = quirks.iter().map(|(name, _)| *name).collect();
        return Err(format!("{} has no quirk {name}; it has {}", model.name(), known.join(", ")));
    };
    let plain = |text: &str| text.trim_matches('"').to_owned();
    let Some(text) = values.iter().find(|known| plain(known) == plain(value)) else {
        let values: Vec<String> = values.iter().map(|value| plain(value)).collect();
        return Err(format!("{name} cannot be {value}; it is {}", values.join(" or ")));
    };
    // What a quirk can be is written as in TOML, which is as in JSON for these.
    let value: Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
    let mut profile = profile.clone();
    if let Some(place) = profile.pointer_mut(&format!("/quirks/{name}")) {
        *place = value;
    }
    Ok((self::model(&profile)?, profile))
}

/// A model with another value of a quirk.
///
/// # Errors
///
/// If it has no such quirk, or that cannot be so.
pub fn quirky(model: &Model, name: &str, value: &str) -> Result<Model, String> {
    Ok(with_quirk(model, &written(model), name, value)?.0)
}

/// A model as it was recorded.
///
/// # Errors
///
/// What is wrong with its profile.
pub fn model(profile: &Value) -> Result<Model, String> {
    let model = profile_text(&stated(profile)).and_then(|text| Model::from_toml(&text));
    model.map_err(|error| format!("line 1: the model: {error}"))
}

/// A machine as it was recorded.
///
/// # Errors
///
/// What is wrong with its profile.
pub fn machine(profile: &Value) -> Result<Arc<Machine>, String> {
    let machine = profile_text(&stated(profile)).and_then(|text| Machine::from_toml(&text));
    machine.map(Arc::new).map_err(|error| format!("line 1: the machine: {error}"))
}

/// The profile of a recorded model with the values that are new since, as the built-in model of its
/// name has them, or else one of its commands.
#[must_use]
pub fn completed_model(profile: &Value) -> Value {
    let models = vimc4_catalogue::models().into_iter();
    let models: Vec<Value> = models
        .filter_map(|name| vimc4_catalogue::model(name).ok())
        .map(|model| written(&model))
        .collect();
    let like = |key: &str| models.iter().find(|own| own.get(key) == profile.get(key));
    let own = like("name").or_else(|| like("command_set"));
    own.map_or_else(|| profile.clone(), |own| completed(profile, own))
}

/// The same for a machine.
#[must_use]
pub fn completed_machine(profile: &Value) -> Value {
    let name = profile.get("name").and_then(Value::as_str).unwrap_or_default();
    let own = vimc4_catalogue::machine(name).or_else(|_| vimc4_catalogue::machine("bench"));
    own.map_or_else(|_| profile.clone(), |own| completed(profile, &written(&*own)))
}

/// The tables of a profile whose keys every profile has. What others list is their own.
const TABLES: [&str; 7] =
    ["quirks", "timing", "limits", "defaults", "language", "line", "reference"];

/// A profile with what only the other one has.
fn completed(profile: &Value, other: &Value) -> Value {
    let (Value::Object(profile), Value::Object(other)) = (profile, other) else {
        return profile.clone();
    };
    let mut whole = profile.clone();
    for (key, value) in other {
        match whole.get_mut(key) {
            Some(own) if TABLES.contains(&key.as_str()) => *own = completed(own, value),
            Some(_) => {}
            None => drop(whole.insert(key.clone(), value.clone())),
        }
    }
    Value::Object(whole)
}

/// What a profile states: TOML has no word for what is not there.
fn stated(profile: &Value) -> Value {
    match profile {
        Value::Object(fields) => {
            let stated = fields.iter().filter(|(_, value)| !value.is_null());
            stated.map(|(key, value)| (key.clone(), self::stated(value))).collect()
        }
        Value::Array(items) => items.iter().map(stated).collect(),
        other => other.clone(),
    }
}

/// A profile as it is written down.
#[must_use]
pub fn written(profile: &impl Serialize) -> Value {
    // Every profile can be written down.
    serde_json::to_value(profile).unwrap_or_default()
}
