//! The module that answers first, and what it leaves to the whole one.
//!
//! A page shows its controllers as soon as it has this much: the controllers of isel, lines, signals, clocks
//! and what happens. It knows what the buttons of a panel order, and no other words for orders, conditions, faults
//! and rules, no debugger, no history, no recordings, no files, and no profiles but the built-in ones. What it answers is what the whole module
//! answers, to the byte; the rest it refuses with `"later": true`. Whoever asks then fetches the whole module,
//! does there what was done here, and asks again: since nothing here knows a clock or chance, the
//! controllers are the same.

use vimc4_answers::problem::{Kind, Problem};

fn later() -> Problem {
    let detail = "this part of the page is still being fetched";
    Problem::new(Kind::NotNow, detail, "ask again when it is there").with("later", true.into())
}

/// Routes that are left to the whole module.
macro_rules! leaves {
    ($($route:ident)+) => {
        $(pub(crate) fn $route(_: &mut Desk, _: &Call) -> Outcome {
            Err(super::later())
        })+
    };
}
use leaves;

/// A controller remembers nothing.
pub(crate) mod kept {
    use vimc4_catalogue::Controller;
    use vimc4_device::{CommandNumber, Line, OwnedInput};

    pub(crate) type Kept = Line<Controller>;

    pub(crate) fn kept(line: Kept) -> Kept {
        line
    }

    /// Commands are told of one by one, so that each means what it means now.
    pub(crate) fn meant(_: &mut Kept, _: CommandNumber) -> Option<String> {
        None
    }

    /// There is no debugger that could give it anything.
    pub(crate) fn given(_: &mut Kept) -> Option<OwnedInput> {
        None
    }

    pub(crate) fn bare(kept: &Kept) -> &Controller {
        kept.device()
    }
}

pub(crate) mod deeds {
    use crate::call::Outcome;
    use crate::served::Served;

    pub(crate) fn deeds(_: &mut Served) -> Outcome {
        Err(super::later())
    }
}

pub(crate) mod opened {
    use serde_json::Value;
    use vimc4_answers::problem::Problem;

    use crate::served::Served;

    pub(crate) fn recorded(_: &str) -> Result<(Served, Value), Problem> {
        Err(super::later())
    }
}

pub(crate) mod work {
    use crate::call::Outcome;
    use crate::served::Served;

    pub(crate) fn pieces(_: &Served, _: &str) -> Outcome {
        Err(super::later())
    }

    pub(crate) fn rest(_: &Served) -> Outcome {
        Err(super::later())
    }
}

/// There is a recording, but nothing is in it.
pub(crate) mod recorder {
    use vimc4_catalogue::{Machine, Model};
    use vimc4_device::Names;
    use vimc4_session::Report;

    use crate::kept::Kept;

    #[derive(Debug)]
    pub(crate) struct Recorder;

    impl Recorder {
        pub(crate) fn begin(_: &Model, _: &Machine, _: &Kept, _: Names) -> Recorder {
            Recorder
        }

        pub(crate) fn report(&mut self, _: &Report) {}
    }
}

/// What the past is asked, as long as nothing has been put back into another state.
pub(crate) mod past {
    use serde_json::json;
    use vimc4_device::Time;

    use crate::call::{Answer, Call, Outcome};
    use crate::desk::Desk;

    pub(crate) fn history(desk: &mut Desk, call: &Call) -> Outcome {
        let now = desk.present(call)?.live.now();
        Answer::json(&json!({
            "open": false,
            "possible": true,
            "first": Time::ZERO,
            "at": now,
            "branch": 0,
            "now": { "branch": 0, "at": now },
            "branches": [],
        }))
    }

    super::leaves! {
        cancel_debugger close_debugger debug debugger_view do_there end_recording go history_entries
        hold_debugger recording restore_snapshot set_flash take
    }
}

/// Of what is said in words only the orders of buttons are understood, so that nothing else is there.
pub(crate) mod words {
    use serde_json::json;
    use vimc4_device::Deed;
    use vimc4_session::order::said;

    use crate::call::{Answer, Call, Outcome};
    use crate::desk::Desk;

    pub(crate) fn order(desk: &mut Desk, call: &Call) -> Outcome {
        let live = &mut desk.present(call)?.live;
        let deed = match call.text("order").split_once(' ') {
            Some(("press", button)) => Deed::Press(button.to_owned()),
            Some(("hold", button)) => Deed::Hold(button.to_owned()),
            Some(("release", button)) => Deed::Release(button.to_owned()),
            Some(("power", "on")) => Deed::Power(true),
            Some(("power", "off")) => Deed::Power(false),
            _ => return Err(super::later()),
        };
        // What is wrong is said by the whole module.
        let effect = live.act(call.moment, deed).map_err(|_| super::later())?;
        Answer::json(&json!({ "text": said(&effect) }))
    }

    pub(crate) fn none(desk: &mut Desk, call: &Call) -> Outcome {
        desk.present(call)?;
        Answer::json(&json!([]))
    }

    pub(crate) use none as breakpoints;
    pub(crate) use none as faults;
    pub(crate) use none as rules;

    super::leaves! {
        add_breakpoint begin_fault begin_rules completions end_fault end_faults end_scenario end_scenarios
        quit remove_breakpoint reset run_until verbs
    }
}

/// The built-in profiles, as JSON, which the page reads anyway.
pub(crate) mod profiles {
    use std::collections::BTreeMap;
    use std::sync::Arc;

    use serde::Deserialize;
    use serde_json::Value;
    use vimc4_answers::problem::Problem;
    use vimc4_catalogue::{Machine, Model};

    use super::later;
    use crate::call::{Answer, Outcome};

    /// Those of [`vimc4_catalogue`], in its order, as each is written down.
    #[derive(Deserialize)]
    struct Builtins {
        models: Vec<Value>,
        machines: Vec<Value>,
    }

    fn builtins() -> Builtins {
        // A test holds it to what the catalogue has.
        let none = |_| Builtins { models: Vec::new(), machines: Vec::new() };
        serde_json::from_str(include_str!("../profiles.json")).unwrap_or_else(none)
    }

    fn name(profile: &Value) -> &str {
        profile["name"].as_str().unwrap_or_default()
    }

    fn names(profiles: &[Value]) -> Vec<String> {
        profiles.iter().map(|profile| name(profile).to_owned()).collect()
    }

    fn named(profiles: Vec<Value>, wanted: &str) -> Result<Value, Problem> {
        profiles.into_iter().find(|profile| name(profile) == wanted).ok_or_else(later)
    }

    pub(crate) fn models() -> Vec<String> {
        names(&builtins().models)
    }

    pub(crate) fn machines() -> Vec<String> {
        names(&builtins().machines)
    }

    pub(crate) fn model_profile(_: &str) -> Outcome {
        Err(later())
    }

    pub(crate) fn machine_profile(_: &str) -> Outcome {
        Err(later())
    }

    pub(crate) fn model(name: &str, quirks: &BTreeMap<String, Value>) -> Result<Model, Problem> {
        if !quirks.is_empty() {
            return Err(later());
        }
        let profile = named(builtins().models, name)?;
        let set = profile["command_set"].as_str().unwrap_or_default().to_owned();
        Model::written(&set, profile).map_err(|_| later())
    }

    pub(crate) fn machine(name: &str) -> Result<Arc<Machine>, Problem> {
        let profile = named(builtins().machines, name)?;
        serde_json::from_value(profile).map(Arc::new).map_err(|_| later())
    }

    pub(crate) fn model_written(model: &Model) -> Outcome {
        Answer::json(&named(builtins().models, model.name())?)
    }

    pub(crate) fn machine_written(machine: &Machine) -> Outcome {
        Answer::json(&named(builtins().machines, &machine.name)?)
    }

    pub(crate) fn quirks(_: &Model) -> Outcome {
        Err(later())
    }
}
