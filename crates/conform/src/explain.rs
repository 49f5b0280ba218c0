//! What would explain a difference: the same session, played with other values of the profile,
//! as another model, or with something set differently at the machine.

use std::collections::BTreeSet;

use serde::Serialize;
use toml::Table;
use vimc4_catalogue::Model;
use vimc4_device::{Device, Harness, Input, SignalKind};

use crate::choice::{leaf, leaves};
use crate::format::merge;
use crate::player::{Miss, PortStep, Timing};
use crate::rehearsal::{Delays, rehearse};
use crate::workshop::{self, Workshop};

/// Something that may differ from the profile and the machine.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// What, for people and programs.
    pub cause: Cause,
    workshop: Workshop,
    signal: Option<(String, i32)>,
}

/// What explains a difference.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Cause {
    /// Another value in the model's profile.
    Profile {
        /// Its name, as in `quirks.stop_reply`.
        key: String,
        /// As TOML writes it.
        value: String,
    },
    /// Another model.
    Model {
        /// Its name.
        name: String,
    },
    /// A signal of the machine.
    Signal {
        /// Its name, as in `cover`.
        name: String,
        /// Its value, by its name where it has one.
        value: String,
    },
}

impl std::fmt::Display for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Cause::Profile { key, value } => match key.strip_prefix("quirks.") {
                Some(quirk) => write!(f, "quirk {quirk} = {value}"),
                None => write!(f, "{key} = {value} in the profile"),
            },
            Cause::Model { name } => write!(f, "the model {name}"),
            Cause::Signal { name, value } => write!(f, "{name} = {value} at the machine"),
        }
    }
}

/// Everything that is tried, the likeliest first: quirks, profile values of other built-in models,
/// those models, and what can be set at the machine.
///
/// # Errors
///
/// If no controller can be made of the profile.
pub fn candidates(model: &Model) -> Result<Vec<Candidate>, String> {
    let profile = workshop::profile(model)?;
    let mut candidates = Vec::new();
    let mut values = Vec::new();
    for (quirk, texts) in vimc4_catalogue::quirks(model) {
        values.extend(texts.iter().map(|text| (format!("quirks.{quirk}"), (*text).to_owned())));
    }
    // Another family's behaviour is no explanation.
    let kindred = model.family().models();
    let mut others = BTreeSet::new();
    for name in &kindred {
        let other = vimc4_catalogue::model(name).map_err(|error| error.to_string())?;
        for (key, value) in leaves(&workshop::profile(&other)?) {
            let simple = !value.is_array() && key.contains('.') && !key.starts_with("quirks.");
            if simple && leaf(&profile, &key).is_some() {
                others.insert((key, value.to_string()));
            }
        }
    }
    values.extend(others);
    for (key, value) in values {
        if leaf(&profile, &key).is_some_and(|own| own.to_string() == value) {
            continue;
        }
        let mut differs = profile.clone();
        merge(
            &mut differs,
            toml::from_str::<Table>(&format!("{key} = {value}")).unwrap_or_default(),
        );
        // A value that no controller can have explains nothing.
        let Ok(model) = workshop::model(&differs) else { continue };
        let workshop = Workshop::bench(&model)?;
        candidates.push(Candidate { cause: Cause::Profile { key, value }, workshop, signal: None });
    }
    for name in kindred.into_iter().filter(|name| *name != model.name()) {
        let other = vimc4_catalogue::model(name).map_err(|error| error.to_string())?;
        let workshop = Workshop::bench(&other)?;
        let cause = Cause::Model { name: name.to_owned() };
        candidates.push(Candidate { cause, workshop, signal: None });
    }
    let workshop = Workshop::bench(model)?;
    for signal in workshop.build(&[])?.signals() {
        if matches!(signal.kind, SignalKind::Analogue { .. }) {
            continue;
        }
        for level in [0, 1] {
            let name = signal.name.clone();
            let place = usize::from(level == 1);
            let value = match &signal.positions {
                Some(positions) => positions[place].clone(),
                None => level.to_string(),
            };
            let cause = Cause::Signal { name: name.clone(), value };
            let signal = Some((name, level));
            candidates.push(Candidate { cause, workshop: workshop.clone(), signal });
        }
    }
    Ok(candidates)
}

/// The candidates that make a controller send exactly what came; only those of the likeliest kind.
#[must_use]
pub fn explain(
    candidates: &[Candidate],
    steps: &[PortStep],
    timing: Timing,
    miss: &Miss,
) -> Vec<Cause> {
    let mut causes: Vec<Cause> = Vec::new();
    for candidate in candidates {
        if causes.last().is_some_and(|cause| rank(cause) != rank(&candidate.cause)) {
            break;
        }
        if candidate.play(steps, timing).is_some_and(|seen| same(&seen, miss, timing)) {
            causes.push(candidate.cause.clone());
        }
    }
    causes
}

/// How likely a cause is, the likeliest lowest.
fn rank(cause: &Cause) -> u8 {
    match cause {
        Cause::Profile { key, .. } if key.starts_with("quirks.") => 0,
        Cause::Profile { .. } => 1,
        Cause::Model { .. } => 2,
        Cause::Signal { .. } => 3,
    }
}

/// Whether two differences are the same, as far as a port can tell.
fn same(one: &Miss, other: &Miss, timing: Timing) -> bool {
    let in_time = match (one.late, other.late) {
        (None, None) => true,
        (Some(one), Some(other)) => one.abs_diff(other) <= timing.around(other),
        _ => false,
    };
    one.step == other.step && one.bytes == other.bytes && in_time
}

impl Candidate {
    /// What a port would see instead of what must come.
    fn play(&self, steps: &[PortStep], timing: Timing) -> Option<Miss> {
        let mut harness = Harness::new(self.workshop.build(&[]).ok()?);
        if let Some((name, value)) = &self.signal {
            let signals = harness.device().signals();
            let id = signals.iter().find(|signal| signal.name == *name)?.id;
            harness.input(Input::Signal(id, *value));
        }
        rehearse(harness.into_device(), steps, timing, Delays::default()).err()
    }
}
