//! What only a page is asked: which controllers there are to be, and what a line means.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Value, json};
use vimc4_answers::problem::{Kind, Problem};
use vimc4_catalogue::bare;
use vimc4_device::{Device, Line, unescape};
use vimc4_session::Clock;

use crate::call::{Answer, Outcome};
use crate::live::Live;
use crate::profiles;
use crate::served::Served;

/// Which controller is wanted.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Setup {
    /// The name of a built-in model, or a profile.
    model: String,
    /// The name of a built-in machine, or a profile.
    #[serde(default = "bench")]
    machine: String,
    /// Where the profile of the model is to have other values.
    #[serde(default)]
    quirks: BTreeMap<String, Value>,
    #[serde(default = "real")]
    clock: String,
    /// What is in the memory that outlives the power.
    #[serde(default)]
    flash: String,
}

/// One controller, or several.
#[derive(Deserialize)]
#[serde(untagged)]
enum Setups {
    One(Setup),
    Several(Vec<Setup>),
}

fn bench() -> String {
    "bench".to_owned()
}

fn real() -> String {
    "real".to_owned()
}

/// So many controllers are there at most.
const MOST: usize = 16;

/// The controllers that are asked for.
pub(crate) fn controllers(content: &str) -> Result<Vec<Served>, Problem> {
    let setups = serde_json::from_str(content).map_err(|error| {
        Problem::new(
            Kind::WrongRequest,
            format!("the controllers are not understood: {error}"),
            "send an object such as {\"model\":\"imc4\",\"machine\":\"mill\",\"clock\":\"real\"}, or a \
             list of them; model and machine are names or profiles, and quirks and flash may be there",
        )
    })?;
    let setups = match setups {
        Setups::One(setup) => vec![setup],
        Setups::Several(setups) => setups,
    };
    if setups.is_empty() || setups.len() > MOST {
        let detail = format!("{} controllers are asked for", setups.len());
        return Err(Problem::new(Kind::WrongRequest, detail, format!("ask for 1 to {MOST}")));
    }
    setups.iter().map(made).collect()
}

fn made(setup: &Setup) -> Result<Served, Problem> {
    let model = profiles::model(&setup.model, &setup.quirks)?;
    let machine = profiles::machine(&setup.machine)?;
    let clock: Clock = setup.clock.parse()?;
    let controller = bare(&model, &machine, setup.flash.as_bytes())?;
    Ok(Served::new(Live::new(model, machine, Line::ideal(controller), clock)))
}

/// What a line would mean to a controller, as it is typed: `\r` and the like stand for what cannot be.
pub(crate) fn meaning(served: &Served, line: &str) -> Outcome {
    let bytes = unescape(line).unwrap_or_else(|_| line.as_bytes().to_vec());
    Answer::json(&json!({ "text": served.live.line().explain(bytes.trim_ascii()) }))
}
