//! What only a page is asked: which controllers there are to be, what a line means, and a recording to look
//! at.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Value, json};
use vimc4_answers::past::Lived;
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::profiles::{self, completed_machine, completed_model, known, quirky};
use vimc4_catalogue::{Machine, Model, State, bare};
use vimc4_control::{Clock, Source};
use vimc4_device::{Device, LineState, Names, OwnedInput, unescape};
use vimc4_timeline::recording::{LineSort, Recording, What};

use crate::call::{Answer, Outcome};
use crate::live::Live;
use crate::served::Served;
use crate::snapshots::Snapshots;

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
    let unknown = |error: vimc4_catalogue::Unknown| {
        let (detail, known) = (error.to_string(), error.known.join(", "));
        let detail = detail.split_once(';').map_or(&*detail, |(detail, _)| detail);
        Problem::new(Kind::NoSuchThing, detail, format!("there are {known}"))
    };
    let wrong = |error: vimc4_catalogue::ProfileError| {
        Problem::new(Kind::NotUnderstood, error.message, error.help)
    };
    // A name has one line.
    let is_profile = |text: &str| text.contains('\n');
    let model = match is_profile(&setup.model) {
        true => Model::from_toml(&setup.model).map_err(wrong)?,
        false => vimc4_catalogue::model(&setup.model).map_err(unknown)?,
    };
    let model = with_quirks(model, &setup.quirks)?;
    let machine = match is_profile(&setup.machine) {
        true => Machine::from_toml(&setup.machine).map(Arc::new).map_err(wrong)?,
        false => vimc4_catalogue::machine(&setup.machine).map_err(unknown)?,
    };
    let clock: Clock = setup.clock.parse()?;
    let controller = bare(&model, &machine, setup.flash.as_bytes())?;
    Ok(served(Live::new(model, machine, controller, clock)))
}

fn served(live: Live) -> Served {
    Served { live, snapshots: Snapshots::default(), looks: None, lived: Lived::default() }
}

/// A model where some quirks have other values.
fn with_quirks(mut model: Model, quirks: &BTreeMap<String, Value>) -> Result<Model, Problem> {
    for (name, value) in quirks {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        model = quirky(&model, name, &value)
            .map_err(|why| Problem::said(Kind::NotUnderstood, &why, ""))?;
    }
    Ok(model)
}

/// What a line would mean to a controller, as it is typed: `\r` and the like stand for what cannot be.
pub(crate) fn meaning(served: &Served, line: &str) -> Outcome {
    let bytes = unescape(line).unwrap_or_else(|_| line.as_bytes().to_vec());
    Answer::json(&json!({ "text": served.live.line.explain(bytes.trim_ascii()) }))
}

/// Every value that each quirk of the model can have, as TOML writes it.
pub(crate) fn quirks(served: &Served) -> Outcome {
    Answer::json(&json!(vimc4_catalogue::quirks(&served.live.model)))
}

// --- recordings ---

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    text: String,
}

/// The controller of a recording, with all that happened to it, at its end: its time stands still.
pub(crate) fn recorded(content: &str) -> Result<Served, Problem> {
    let Text { text } = serde_json::from_str(content).map_err(|error| {
        let detail = format!("the recording is not there: {error}");
        Problem::new(Kind::WrongRequest, detail, "send an object such as {\"text\":\"…\"}")
    })?;
    let wrong = |why: String| {
        Problem::new(
            Kind::NotUnderstood,
            why,
            "open what `vimc4 serve --record` or a test has recorded, unpacked",
        )
    };
    let recording = Recording::read(text.as_bytes()).map_err(|error| wrong(error.to_string()))?;
    let head = &recording.head;
    if head.line == LineSort::Paced {
        return Err(wrong(
            "it was recorded with --line-pacing, where bytes are on their way for a while"
                .to_owned(),
        ));
    }
    let at_line = |line: u32, why: String| wrong(format!("line {line}: {why}"));
    let model = profiles::model(&completed_model(&head.model)).map_err(wrong)?;
    let machine = profiles::machine(&completed_machine(&head.machine)).map_err(wrong)?;
    let mut controller = bare(&model, &machine, &[])?;
    let state_of = |line: u32, written: &Value| {
        let state = serde_json::from_value::<LineState<State>>(written.clone());
        state.map_err(|error| at_line(line, error.to_string()))
    };
    let mut entries = recording.entries.iter().peekable();
    // It begins with a state; without one, as a controller that was just switched on.
    while let Some(entry) = entries.next_if(|entry| !matches!(entry.what, What::Given { .. })) {
        if let What::State { state, .. } = &entry.what {
            controller.restore(state_of(entry.line, state)?.device);
            break;
        }
    }
    let clock = head.clock.parse().unwrap_or_default();
    let mut served = served(Live::new(model, machine, controller, clock));
    let live = &mut served.live;
    let names = Names::of(&live.line);
    for entry in entries {
        match &entry.what {
            What::Given { by, given } => {
                let input = known(&names, given).map_err(|why| at_line(entry.line, why))?;
                live.replay(entry.at, input, &Source::Controls(by.clone()));
            }
            What::State { by: Some(by), state } => {
                let state = state_of(entry.line, state)?;
                live.restore(0, &Source::Controls(by.clone()), state);
            }
            What::Mark(name) => {
                live.line.device_mut().debugger.mark(name.as_str());
            }
            What::Sent(_) | What::End(_) if entry.at > live.now() => {
                live.replay(entry.at, OwnedInput::Wake, &Source::Controls("".into()));
            }
            _ => {}
        }
    }
    live.pause(Source::Controls("the end of the recording".into()));
    Ok(served)
}
