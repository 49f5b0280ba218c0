//! What is seen of a controller, as it is answered.

use serde::Serialize;
use serde_json::{Map, Value, json};
use vimc4_catalogue::{Details, Machine, Model};
use vimc4_device::{
    Activity, AxisView, FaultView, LengthUnit, Names, RuleView, Signal, Time, View,
};
use vimc4_language::{Sort, Verb, complete};
use vimc4_session::{BreakpointView, Clock, Effect, Pause, Source, Step};

/// Where the axes are.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Position {
    /// When.
    pub at: Time,
    /// What the controller does.
    pub activity: Activity,
    /// The step counters.
    pub positions: Vec<i64>,
    /// Where the carriages really are, in steps.
    pub carriage: Vec<i64>,
    /// µHz.
    pub speed: Vec<i64>,
}

impl Position {
    /// What a view says of it.
    #[must_use]
    pub fn of(view: &View<Details>) -> Position {
        let each = |what: fn(&AxisView) -> i64| view.axes.iter().map(what).collect();
        Position {
            at: view.at,
            activity: view.activity,
            positions: each(|axis| axis.position),
            carriage: each(|axis| axis.carriage),
            speed: each(|axis| axis.speed),
        }
    }

    /// Whether it is one on the way of a motion.
    #[must_use]
    pub fn moves(&self) -> bool {
        matches!(
            self.activity,
            Activity::Move
                | Activity::Arc
                | Activity::FollowingVectors
                | Activity::ProgramMove
                | Activity::FollowingTrackball
                | Activity::SelfTest
                | Activity::ReferenceTowardsSwitch
                | Activity::ReferenceOutOfSwitch
                | Activity::ReferenceFreeSteps
                | Activity::LeavingLimitSwitch
        )
    }

    /// Whether it differs in more than the time.
    #[must_use]
    pub fn differs(&self, other: &Position) -> bool {
        *self != Position { at: self.at, ..other.clone() }
    }
}

/// What a controller is, wherever it is.
#[must_use]
pub fn profile(number: usize, model: &Model, machine: &Machine, names: &Names) -> Value {
    let axes = (0_u8..).zip(model.axis_names()).map(|(axis, name)| {
        let scale = names.scale(axis).map(|scale| {
            let unit = match scale.unit {
                LengthUnit::Micrometre => "µm",
                LengthUnit::Degree => "°",
            };
            json!({ "steps": scale.steps, "units": scale.units, "unit": unit })
        });
        json!({ "index": axis, "name": name, "scale": scale })
    });
    json!({
        "number": number,
        "model": model.name(),
        "title": model.title(),
        "family": model.family().name(),
        "maker": model.family().maker(),
        "machine": machine.name,
        "axes": axes.collect::<Vec<_>>(),
    })
}

/// The step counters, and what the controller does.
#[must_use]
pub fn position(view: &View<Details>) -> Value {
    let axes = view.axes.iter().map(|axis| (axis.name.clone(), axis.position.into()));
    let axes: Map<String, Value> = axes.collect();
    json!({ "at": view.at, "activity": view.activity, "axes": axes })
}

/// What can be pressed, turned and set, with its present value.
#[must_use]
pub fn signals(signals: &[Signal], view: &View<Details>) -> Value {
    let rows = signals.iter().map(|signal| {
        let mut row = serde_json::to_value(signal).unwrap_or_default();
        row["value"] = view.signal(&signal.name).into();
        row
    });
    rows.collect()
}

/// The orders that there are.
#[must_use]
pub fn verbs() -> Value {
    let verbs = Verb::all().map(|verb| {
        let sort = match verb.sort() {
            Sort::Deed => "deed",
            Sort::Time => "time",
            Sort::Question => "question",
            Sort::Prompt => "prompt",
        };
        let forms = verb.forms().iter();
        let forms = forms.map(|form| json!({ "typed": verb.typed(form), "about": form.about }));
        json!({ "verb": verb.name(), "sort": sort, "forms": forms.collect::<Vec<_>>() })
    });
    verbs.collect()
}

/// What can follow an order that has been begun.
#[must_use]
pub fn completions(names: &Names, line: &str) -> Value {
    let ways = complete(line, names).into_iter();
    ways.map(|way| json!({ "line": way.line, "about": way.about })).collect()
}

/// The time, how it passes, and whether and why it stands still.
#[must_use]
pub fn clock(now: Time, clock: Clock, paused: Option<&Pause>, changes_to: &[&str]) -> Value {
    // It stands still where it is, although the controller may have been taken elsewhere since.
    let paused = paused.map(|paused| pause(&Pause { at: now, ..paused.clone() }));
    json!({ "now": now, "clock": clock.to_string(), "paused": paused, "changes_to": changes_to })
}

/// Since when time stands still, and why.
#[must_use]
pub fn pause(Pause { at, by, breakpoints }: &Pause) -> Value {
    let by = by.as_ref().map(Source::to_string);
    json!({ "at": at, "by": by, "breakpoints": breakpoints })
}

/// What a step has done.
#[must_use]
pub fn step(step: Step, now: Time) -> Value {
    let step = match step {
        Step::Cause => "cause",
        Step::Input => "input",
        Step::Time => "time",
        Step::Rest => "rest",
    };
    json!({ "step": step, "now": now })
}

/// The breakpoints.
#[must_use]
pub fn breakpoints(points: &[BreakpointView], names: &Names) -> Value {
    let points = points.iter().map(|point| {
        let condition = names.write(&point.condition).to_string();
        json!({ "id": point.id, "condition": condition, "met": point.met })
    });
    points.collect()
}

/// The faults.
#[must_use]
pub fn faults(faults: &[FaultView], names: &Names) -> Value {
    let list = faults.iter().map(|view| {
        let fault = names.write_fault(&view.fault);
        let (number, stage, struck) = (view.number, view.stage, view.struck);
        json!({ "number": number, "fault": fault, "stage": stage, "struck": struck })
    });
    list.collect()
}

/// The rules.
#[must_use]
pub fn rules(rules: &[RuleView], names: &Names) -> Value {
    let list = rules.iter().map(|view| {
        json!({
            "scenario": view.id.scenario,
            "place": view.id.place,
            "name": view.id.name,
            "rule": names.write_rule(&view.rule),
            "stage": view.stage,
            "acted": view.acted,
        })
    });
    list.collect()
}

/// What came of a deed.
#[must_use]
pub fn effect(effect: &Effect) -> Value {
    match effect {
        Effect::Something => json!({ "effect": "something" }),
        Effect::Nothing { why } => json!({ "effect": "nothing", "why": why }),
    }
}
