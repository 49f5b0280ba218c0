//! The controllers into which recordings are played: the recorded one, and others.

use std::path::Path;
use std::sync::Arc;

use serde_json::Value;
use vimc4::Clock;
use vimc4_catalogue::{Controller, Machine, Model, State};
use vimc4_device::{Device, Line, LineState, Names};
use vimc4_timeline::recording::{Head, LineSort, Player, Recording, WALL, What, exchange};

use vimc4_answers::profiles::{
    completed_machine, completed_model, known, machine, model, with_quirk, written,
};

use crate::completions;
use crate::failure::Failure;
use crate::identity::profile_files;

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
    /// Play it with another value of a quirk of the model's profile, as in stop_reply=F0; may be
    /// given several times
    #[arg(long, value_name = "NAME=VALUE", add = completions::quirks())]
    quirk: Vec<String>,
}

impl Other {
    /// The profile files that are read.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        profile_files(self.model.as_deref(), self.machine.as_deref())
    }
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
        // Profiles of an earlier version lack fields. A part that was cut from its recording keeps its first
        // line, and has states of this version.
        let mut profiles = self.written.iter().zip(&self.recorded);
        if !profiles.all(|(old, new)| contains(written, old) || contains(written, new)) {
            return Err(self.mismatch(written));
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
        // A state of an earlier version lacks what the device adds here.
        device.restore(state.clone());
        let image = device.flash_image();
        let fresh = recorded.device(&recorded.model, &recorded.machine, &image);
        if fresh.is_ok_and(|fresh| fresh.state() == device.state()) {
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

    /// Why a state of another model or machine is refused.
    fn mismatch(&self, written: &Value) -> String {
        let name = |profile: &Value| profile["name"].as_str().unwrap_or("unnamed").to_owned();
        let [model, machine] = [&self.written[0], &self.written[1]].map(name);
        match serde_json::from_value::<LineState<State>>(written.clone()) {
            Ok(state) if state.device.profile_names() != (&*model, &*machine) => {
                let (other_model, other_machine) = state.device.profile_names();
                format!(
                    "a state of {other_model} on {other_machine}, and the first line names {model} on {machine}"
                )
            }
            _ => {
                format!("its profiles of {model} and {machine} differ from those of the first line")
            }
        }
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

fn contains(value: &Value, part: &Value) -> bool {
    value == part
        || match value {
            Value::Object(fields) => fields.values().any(|field| contains(field, part)),
            Value::Array(items) => items.iter().any(|item| contains(item, part)),
            _ => false,
        }
}
