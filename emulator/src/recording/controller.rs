//! The controllers into which recordings are played: the recorded one, and others.

use std::sync::Arc;

use serde_json::Value;
use vimc4::Clock;
use vimc4_catalogue::{Controller, Machine, Model, State, profile_text};
use vimc4_device::{Device, Line, LineState, Names, OwnedInput};
use vimc4_timeline::recording::{Given, Head, LineSort, Player, Recording, WALL, What, exchange};

use crate::completions;
use crate::failure::Failure;

/// A controller at its line.
pub(crate) type PlayedDevice = Line<Controller>;

/// Another controller than the recorded one.
#[derive(clap::Args)]
pub(super) struct Other {
    /// Play it into this model: a name from `vimc4 models`, or a profile file
    #[arg(long, value_name = "NAME|FILE", add = completions::models())]
    model: Option<String>,
    /// Play it on this machine: a name from `vimc4 machines`, or a profile file
    #[arg(long, value_name = "NAME|FILE", add = completions::machines())]
    machine: Option<String>,
    /// Play it with another value of a quirk of the model's profile, as in stop_reply=STOP; may be
    /// given several times
    #[arg(long, value_name = "NAME=VALUE", add = completions::quirks())]
    quirk: Vec<String>,
}

/// A controller that can be made again and again, with its profiles as they are written down.
#[derive(Clone)]
pub(crate) struct Site {
    pub(crate) model: Model,
    pub(crate) machine: Arc<Machine>,
    line: LineSort,
    profiles: [Value; 2],
    /// Those of the recording, with what its program did not know yet.
    recorded: [Value; 2],
    /// Those of the recording as they stand there.
    written: [Value; 2],
}

impl Site {
    /// The controller of a recording.
    ///
    /// # Errors
    ///
    /// What is wrong with its head, as a sentence.
    pub(crate) fn recorded(recording: &Recording) -> Result<Site, String> {
        let site = Site::of_head(&recording.head)?;
        site.knows_signals(recording)?;
        Ok(site)
    }

    /// The controller of a recording whose head was read.
    ///
    /// # Errors
    ///
    /// What is wrong with it, as a sentence.
    pub(super) fn of_head(head: &Head) -> Result<Site, String> {
        if head.clock != WALL && head.clock.parse::<Clock>().is_err() {
            return Err(format!(
                "line 1: `{}` is not a clock: it is real, instant, manual, {WALL} or a speed as 8x",
                head.clock
            ));
        }
        let written = [head.model.clone(), head.machine.clone()];
        let profiles = [completed_model(&head.model), completed_machine(&head.machine)];
        let model = model(&profiles[0])?;
        if model.family().name() != head.family {
            return Err(format!(
                "line 1: its family is {}, and its model is of {}",
                head.family,
                model.family().name()
            ));
        }
        let machine = machine(&profiles[1])?;
        let recorded = profiles.clone();
        Ok(Site { model, machine, line: head.line, written, recorded, profiles })
    }

    /// Whether everything that is given can be given to it.
    fn knows_signals(&self, recording: &Recording) -> Result<(), String> {
        let names = Names::of(&self.device(&self.model, &self.machine, b"")?);
        for entry in &recording.entries {
            if let What::Given { given, .. } = &entry.what {
                known(&names, given).map_err(|why| format!("line {}: {why}", entry.line))?;
            }
        }
        Ok(())
    }

    /// The same with other profiles.
    pub(super) fn other(&self, other: &Other) -> Result<Site, Failure> {
        let mut site = self.clone();
        if let Some(name) = &other.model {
            site.model = vimc4::model(name)?;
            site.profiles[0] = written(&site.model);
        }
        if let Some(name) = &other.machine {
            site.machine = vimc4::machine(name)?;
            site.profiles[1] = written(&*site.machine);
        }
        for quirk in &other.quirk {
            let (name, value) = quirk.split_once('=').ok_or_else(|| {
                Failure::usage(format!("`{quirk}` is not a quirk; write NAME=VALUE"))
            })?;
            site = site.with_quirk(name.trim(), value.trim()).map_err(Failure::usage)?;
        }
        Ok(site)
    }

    /// The same with another value of a quirk.
    pub(super) fn with_quirk(&self, name: &str, value: &str) -> Result<Site, String> {
        let mut site = self.clone();
        (site.model, site.profiles[0]) = with_quirk(&self.model, &self.profiles[0], name, value)?;
        Ok(site)
    }

    /// Whether it is the recorded one.
    pub(super) fn is_recorded(&self) -> bool {
        self.profiles == self.recorded
    }

    /// What stands for each other in their states.
    pub(super) fn aside(&self) -> Vec<(Value, Value)> {
        let pairs = self.recorded.iter().cloned().zip(self.profiles.iter().cloned());
        pairs.filter(|(one, other)| one != other).collect()
    }

    /// Whether two states are the same but for these.
    pub(super) fn is_same(one: &LineState<State>, other: &LineState<State>) -> bool {
        let Some(device) = other.device.with_profiles_of(&one.device) else { return false };
        let mut other = other.clone();
        other.device = device;
        *one == other
    }

    /// A controller at its line that has just been switched on.
    pub(crate) fn fresh(&self) -> Result<PlayedDevice, Failure> {
        self.device(&self.model, &self.machine, b"").map_err(Failure::midway)
    }

    /// A controller into which the recording is played.
    pub(super) fn player(&self) -> Result<Player<PlayedDevice>, Failure> {
        Ok(Player::new(self.device(&self.model, &self.machine, b"").map_err(Failure::midway)?))
    }

    fn device(
        &self,
        model: &Model,
        machine: &Arc<Machine>,
        flash: &[u8],
    ) -> Result<PlayedDevice, String> {
        let controller = Controller::new(model, Arc::clone(machine), flash);
        let controller = controller.map_err(|error| error.to_string())?;
        Ok(match self.line {
            LineSort::Ideal => Line::ideal(controller),
            LineSort::Paced => Line::paced(controller),
        })
    }

    /// A recorded state, as one of this controller: one that has just been switched on is just
    /// switched on here too, and has the profiles of this one else.
    pub(crate) fn read(&self, written: &Value) -> Result<LineState<State>, String> {
        if !self.written.iter().all(|profile| contains(written, profile)) {
            return Err("its model and machine are not those of the first line".to_owned());
        }
        let mut written = written.clone();
        for (old, new) in self.written.iter().zip(&self.recorded).filter(|(old, new)| old != new) {
            exchange(&mut written, old, new);
        }
        let state: LineState<State> =
            serde_json::from_value(written.clone()).map_err(|error| error.to_string())?;
        if self.is_recorded() {
            return Ok(state);
        }
        let [recorded_model, recorded_machine] = &self.recorded;
        let recorded = Site::of(recorded_model, recorded_machine, self.line)?;
        let mut device = recorded.device(&recorded.model, &recorded.machine, b"")?;
        device.restore(state.clone());
        let image = device.flash_image();
        let fresh = recorded.device(&recorded.model, &recorded.machine, &image);
        if fresh.is_ok_and(|fresh| fresh.state() == state) {
            let own = self.device(&self.model, &self.machine, &image);
            // Another family keeps nothing that this one could read.
            let own = own.or_else(|_| self.device(&self.model, &self.machine, b""))?;
            return Ok(own.state());
        }
        if self.model.family() != recorded.model.family() {
            return Err(format!(
                "it begins in the middle of things, which only a controller of {} can go on with",
                recorded.model.family()
            ));
        }
        for (old, new) in self.recorded.iter().zip(&self.profiles) {
            exchange(&mut written, old, new);
        }
        serde_json::from_value(written).map_err(|error| error.to_string())
    }

    fn of(model: &Value, machine: &Value, line: LineSort) -> Result<Site, String> {
        let profiles = [model.clone(), machine.clone()];
        Ok(Site {
            model: self::model(model)?,
            machine: self::machine(machine)?,
            line,
            written: profiles.clone(),
            recorded: profiles.clone(),
            profiles,
        })
    }
}

/// What is given to a controller with these names: every signal is one of its own, with a value that it
/// can have, and every fault one that it knows.
pub(crate) fn known(names: &Names, given: &Given) -> Result<OwnedInput, String> {
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
            let faulting = names.read_faulting(words);
            Ok(OwnedInput::Fault(faulting.map_err(|error| format!("fault {error}"))?))
        }
        Given::Rule(words) => {
            let ruling = names.read_ruling(words);
            Ok(OwnedInput::Rule(ruling.map_err(|error| format!("rule {error}"))?))
        }
        Given::Bytes(bytes) => Ok(OwnedInput::Bytes(bytes.clone())),
        Given::Power(on) => Ok(OwnedInput::Power(*on)),
        Given::Wait => Ok(OwnedInput::Wake),
    }
}

/// A model of a profile with another value of a quirk, and its profile.
fn with_quirk(
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
pub(crate) fn quirky(model: &Model, name: &str, value: &str) -> Result<Model, String> {
    Ok(with_quirk(model, &written(model), name, value)?.0)
}

fn model(profile: &Value) -> Result<Model, String> {
    let model = profile_text(&stated(profile)).and_then(|text| Model::from_toml(&text));
    model.map_err(|error| format!("line 1: the model: {error}"))
}

fn machine(profile: &Value) -> Result<Arc<Machine>, String> {
    let machine = profile_text(&stated(profile)).and_then(|text| Machine::from_toml(&text));
    machine.map(Arc::new).map_err(|error| format!("line 1: the machine: {error}"))
}

/// The profile of a recorded model with the values that are new since, as the built-in model of its
/// name has them, or else one of its commands.
fn completed_model(profile: &Value) -> Value {
    let models = vimc4_catalogue::models().into_iter();
    let models: Vec<Value> =
        models.filter_map(|name| vimc4::model(name).ok()).map(|model| written(&model)).collect();
    let like = |key: &str| models.iter().find(|own| own.get(key) == profile.get(key));
    let own = like("name").or_else(|| like("command_set"));
    own.map_or_else(|| profile.clone(), |own| completed(profile, own))
}

/// The same for a machine.
fn completed_machine(profile: &Value) -> Value {
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

fn written(profile: &impl serde::Serialize) -> Value {
    // Every profile can be written down.
    serde_json::to_value(profile).unwrap_or_default()
}

fn contains(value: &Value, part: &Value) -> bool {
    value == part
        || match value {
            Value::Object(fields) => fields.values().any(|field| contains(field, part)),
            Value::Array(items) => items.iter().any(|item| contains(item, part)),
            _ => false,
        }
}
