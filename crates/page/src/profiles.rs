//! Models and machines: those that are built in, and one's own.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::{Value, json};
use vimc4_answers::fields::no_such;
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::profiles::{quirky, written};
use vimc4_catalogue::{Machine, Model, ProfileError, Unknown};

use crate::call::{Answer, Outcome};

pub(crate) use vimc4_catalogue::{machines, models};

fn unknown(error: Unknown) -> Problem {
    let (detail, known) = (error.to_string(), error.known.join(", "));
    let detail = detail.split_once(';').map_or(&*detail, |(detail, _)| detail);
    Problem::new(Kind::NoSuchThing, detail, format!("there are {known}"))
}

fn wrong(error: ProfileError) -> Problem {
    Problem::new(Kind::NotUnderstood, error.message, error.help)
}

/// A name has one line.
fn is_profile(text: &str) -> bool {
    text.contains('\n')
}

/// The model of that name, or of that profile, where some quirks have other values.
pub(crate) fn model(text: &str, quirks: &BTreeMap<String, Value>) -> Result<Model, Problem> {
    let mut model = match is_profile(text) {
        true => Model::from_toml(text).map_err(wrong)?,
        false => vimc4_catalogue::model(text).map_err(unknown)?,
    };
    for (name, value) in quirks {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        model = quirky(&model, name, &value)
            .map_err(|why| Problem::said(Kind::NotUnderstood, &why, ""))?;
    }
    Ok(model)
}

/// The machine of that name, or of that profile.
pub(crate) fn machine(text: &str) -> Result<Arc<Machine>, Problem> {
    match is_profile(text) {
        true => Machine::from_toml(text).map(Arc::new).map_err(wrong),
        false => vimc4_catalogue::machine(text).map_err(unknown),
    }
}

/// The text of a built-in profile.
pub(crate) fn model_profile(name: &str) -> Outcome {
    let text = vimc4_catalogue::model_profile(name).map_err(|_| no_such("model", name))?;
    Ok(Answer::Text(text.to_owned()))
}

/// The same of a machine.
pub(crate) fn machine_profile(name: &str) -> Outcome {
    let text = vimc4_catalogue::machine_profile(name).map_err(|_| no_such("machine", name))?;
    Ok(Answer::Text(text.to_owned()))
}

pub(crate) fn model_written(model: &Model) -> Outcome {
    Answer::json(&written(model))
}

pub(crate) fn machine_written(machine: &Machine) -> Outcome {
    Answer::json(&written(machine))
}

/// Every value that each quirk of a model can have, as TOML writes it.
pub(crate) fn quirks(model: &Model) -> Outcome {
    Answer::json(&json!(vimc4_catalogue::quirks(model)))
}
