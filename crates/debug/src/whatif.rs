//! What would have happened after a change.

use std::fmt;
use std::sync::Arc;

use serde_json::Value;
use vimc4_catalogue::{Machine, Model, State};
use vimc4_device::{
    CommandNumber, Device, Event, Kinds, LineState, Output, OwnedInput, Stamp, Time, TimedInput,
    escape,
};
use vimc4_timeline::{BranchId, Found, History, Place, Progress};

use crate::DebugError;
use crate::Wired;
use crate::debugger::Debugger;
use crate::field::differences;
use crate::stop::time;
use crate::walk::Walk;
use crate::why::Begun;

/// What is changed.
#[derive(Clone, Debug, PartialEq)]
pub enum WhatIf {
    /// A quirk of the model, by its name and a value as TOML writes it.
    Quirk(String, String),
    /// The model.
    Model(Model),
    /// The machine.
    Machine(Arc<Machine>),
    /// Inputs from outside at this moment, in this order.
    Inputs(Vec<OwnedInput>),
}

/// How two futures part.
#[derive(Clone, Debug, PartialEq)]
pub struct Parting {
    /// The change, in words.
    pub what: String,
    /// The branch on which it is.
    pub branch: BranchId,
    /// Where they part first; `None` if they do not, as far as they go.
    pub at: Option<Apart>,
    /// How far they were compared.
    pub until: Time,
    /// The fields that differ then all the same, if they do not part: the path, as it was, as it would
    /// be.
    pub left: Vec<Differing>,
}

/// A field of two states: its path, and its value in the one and in the other.
pub type Differing = (String, Value, Value);

/// The first difference of two futures.
#[derive(Clone, Debug, PartialEq)]
pub struct Apart {
    /// When.
    pub at: Time,
    /// The command that was executed then, as it was.
    pub command: Option<(CommandNumber, Vec<u8>)>,
    /// The first differing output, as it was: bytes and their time.
    pub ours: Option<(Time, Vec<u8>)>,
    /// The same, as it would be.
    pub theirs: Option<(Time, Vec<u8>)>,
    /// The fields that differ then: the path, as it was, as it would be.
    pub fields: Vec<Differing>,
}

impl fmt::Display for Parting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(apart) = &self.at else {
            let until = time(self.until);
            if self.left.is_empty() {
                return write!(f, "{}: nothing else comes of it until {until}", self.what);
            }
            write!(f, "{}: nothing else is said, and the counters are the same, ", self.what)?;
            write!(f, "until {until}; then")?;
            return write_fields(f, &self.left);
        };
        write!(f, "{}: the futures part at {}", self.what, time(apart.at))?;
        if let Some((number, line)) = &apart.command {
            write!(f, ", command #{number} {}", escape(line))?;
        }
        let said = |said: &Option<(Time, Vec<u8>)>| match said {
            Some((at, bytes)) => format!("{} at {}", escape(bytes), time(*at)),
            None => "nothing".to_owned(),
        };
        if apart.ours != apart.theirs {
            let (ours, theirs) = (said(&apart.ours), said(&apart.theirs));
            write!(f, "\n    says  {theirs}\n    said  {ours}")?;
        }
        write_fields(f, &apart.fields)
    }
}

/// Fields that differ, one line each.
fn write_fields(f: &mut fmt::Formatter<'_>, fields: &[Differing]) -> fmt::Result {
    /// The most that are shown.
    const FIELDS: usize = 8;
    let shown = |value: &Value| match value {
        // One of several kinds of things, with its own parts.
        Value::Object(parts) if parts.len() == 1 => {
            parts.keys().next().cloned().unwrap_or_default()
        }
        Value::Object(_) | Value::Array(_) => "a group of values".to_owned(),
        value => {
            let path = String::new();
            crate::Variable { name: String::new(), path, value: value.clone() }.text()
        }
    };
    for (path, ours, theirs) in fields.iter().take(FIELDS) {
        write!(f, "\n    {path}  is {}, was {}", shown(theirs), shown(ours))?;
    }
    let more = fields.len().saturating_sub(FIELDS);
    if more > 0 { write!(f, "\n    and {more} more fields") } else { Ok(()) }
}

/// The most causes that are followed after the last input.
const CAUSES_MAX: u32 = 1_000_000;

impl Debugger {
    /// Begins a branch here with a change, and gives it all later inputs of the present way. With
    /// another model or machine the branch begins before the command that is executed. Compares
    /// both futures in bytes, their times, and the counters at each, and goes to where they part.
    /// If they do not part, the present stays.
    ///
    /// # Errors
    ///
    /// If the change is not possible.
    pub fn what_if(
        &mut self,
        what: &WhatIf,
        progress: &mut Progress<'_>,
    ) -> Result<Parting, DebugError> {
        if self.goes_on_reading() {
            self.read_until(|_| false, progress)?;
        }
        let begin = self.place();
        if !matches!(what, WhatIf::Inputs(_)) {
            self.before_what_is_under_way(progress);
        }
        let parting = self.what_if_from_here(what, begin, progress);
        if parting.is_err() {
            self.history_mut().go_back_to(begin);
        }
        parting
    }

    fn what_if_from_here(
        &mut self,
        what: &WhatIf,
        begin: Place,
        progress: &mut Progress<'_>,
    ) -> Result<Parting, DebugError> {
        let name = self.describe(what);
        let heading = self.history().heading();
        let inputs = self.inputs_ahead();
        let end = self.end_ahead();
        let ours = self.line().clone();
        let given: &[OwnedInput] = match what {
            WhatIf::Inputs(inputs) => inputs,
            _ => &[],
        };
        let state = match what {
            WhatIf::Inputs(_) => None,
            what => Some(otherwise(&ours.state(), ours.clone(), what)?),
        };
        let ours_state = ours.state();
        let mut theirs = ours.clone();
        if let Some(state) = &state {
            theirs.restore(state.clone());
        }
        // Both futures, first as far as they are known, and then as long as something happens.
        let found = first_difference(ours, theirs, given, &inputs, end, progress);
        let Some((until, found)) = found else { return Err(DebugError::cancelled()) };
        let (at, left) = match found {
            Ok(apart) => (Some(apart), Vec::new()),
            Err(left) => (None, left),
        };
        let (history, feed) = (&mut self.history, &mut self.feed);
        // Even at the end of the recording: what would come is never part of what came.
        history.fork(name.clone(), state.unwrap_or(ours_state));
        given.iter().for_each(|input| history.give(input.as_input()));
        let branch = history.present().branch;
        for TimedInput { at, input } in &inputs {
            run_to(history, *at, progress)?;
            history.give(input.as_input());
            if let Some(feed) = feed {
                feed.copy(history, heading, *at);
            }
            run_to(history, *at, progress)?;
        }
        run_to(history, end, progress)?;
        match &at {
            Some(apart) => {
                history.run_to(apart.at.max(end));
                history.go_to_time(apart.at);
            }
            None => {
                // The original, on its own way.
                history.go_to_end(heading);
                history.go_back_to(begin);
            }
        }
        history.drain();
        Ok(Parting { what: name, branch, at, until, left })
    }

    /// Goes back to before the command that is executed: what comes of it is known where it begins.
    fn before_what_is_under_way(&mut self, progress: &mut Progress<'_>) {
        if self.device().is_idle() {
            return;
        }
        let here = self.place();
        let is_command = |_: &Stamp, event: &Event| matches!(event, Event::Command { .. });
        let command =
            self.last_event(Kinds::COMMAND, progress, is_command).map(|command| command.place);
        // A button may have begun it.
        let begun = self.history_mut().seek_last_or_here(&mut Begun::default(), progress);
        let begun = (begun == Found::Here).then_some(self.place());
        let later = command.into_iter().chain(begun).max_by_key(|place| place.moment.at);
        self.history_mut().go_back_to(later.unwrap_or(here));
        if later.is_some() {
            self.history_mut().back();
        }
    }

    fn describe(&self, what: &WhatIf) -> String {
        match what {
            WhatIf::Quirk(name, value) => format!("if {name} = {value}"),
            WhatIf::Model(model) => format!("if {}", model.name()),
            WhatIf::Machine(machine) => format!("if on {}", machine.name),
            WhatIf::Inputs(inputs) => {
                let texts: Vec<String> =
                    inputs.iter().map(|input| self.describe_input(input)).collect();
                format!("if {}", texts.join(", "))
            }
        }
    }

    /// The inputs after the present, on its way.
    fn inputs_ahead(&self) -> Vec<TimedInput> {
        let history = self.history();
        let branches: Vec<_> = history.branches().collect();
        // The way from the present's branch to the one on which it continues.
        let mut way = vec![(history.heading(), u64::MAX)];
        while let Some((branch, _)) = way.last().copied()
            && branch != history.present().branch
        {
            let found = branches.iter().find(|other| other.id == branch);
            let Some(Place { branch, moment }) = found.and_then(|branch| branch.parted) else {
                break;
            };
            way.push((branch, moment.inputs));
        }
        let moment = history.present().moment;
        let mut ahead = Vec::new();
        for (branch, until) in way.into_iter().rev() {
            let is_here = branch == history.present().branch;
            let from = if is_here { moment.inputs } else { 0 };
            let count = usize::try_from(until.saturating_sub(from)).unwrap_or(usize::MAX);
            for (place, mut timed) in history.inputs(branch, from).take(count).enumerate() {
                if is_here && place == 0 && moment.bytes > 0 {
                    let OwnedInput::Bytes(bytes) = &timed.input else { continue };
                    let rest = bytes.get(moment.bytes as usize..).unwrap_or_default();
                    timed.input = OwnedInput::from(vimc4_device::Input::Bytes(rest));
                }
                ahead.push(timed);
            }
        }
        ahead
    }

    /// How far the way of the present goes.
    fn end_ahead(&self) -> Time {
        let heading = self.history().heading();
        let branch = self.history().branches().find(|branch| branch.id == heading);
        branch.map_or(self.now(), |branch| branch.end.at)
    }
}

/// Lets time pass up to `at`, unless that is given up.
fn run_to(
    history: &mut History<Wired>,
    at: Time,
    progress: &mut Progress<'_>,
) -> Result<(), DebugError> {
    let found = history.seek_next(at, &mut Walk::new(crate::Way::Forward), progress);
    if found == Found::GivenUp {
        return Err(DebugError::cancelled());
    }
    history.run_to(at);
    history.drain();
    Ok(())
}

/// The state with the change.
fn otherwise(
    whole: &LineState<State>,
    mut line: Wired,
    what: &WhatIf,
) -> Result<LineState<State>, DebugError> {
    let state = &whole.device;
    let wrong = |error: serde_json::Error| {
        DebugError::new(format!("this controller cannot be so: {error}"))
    };
    let mut tree = serde_json::to_value(state).map_err(wrong)?;
    let family = state.family().name();
    let inner = &mut tree[family];
    match what {
        WhatIf::Model(model) => {
            if model.family() != state.family() {
                return Err(DebugError::new(format!(
                    "{} is of another family: it does not know what this one has stored",
                    model.name()
                )));
            }
            inner["model"] = serde_json::to_value(model).map_err(wrong)?;
        }
        WhatIf::Machine(machine) => {
            inner["plant"]["machine"] = serde_json::to_value(machine).map_err(wrong)?;
        }
        WhatIf::Quirk(name, value) => {
            let known = state.family().models().first().and_then(|name| {
                Some(vimc4_catalogue::quirks(&vimc4_catalogue::model(name).ok()?))
            });
            let known = known.unwrap_or_default();
            let Some((_, values)) = known.iter().find(|(known, _)| known == name) else {
                let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
                return Err(DebugError::new(format!(
                    "there is no quirk `{name}`; there are {}",
                    names.join(", ")
                )));
            };
            let value = value.trim().trim_matches('"');
            if !values.iter().any(|known| known.trim_matches('"') == value) {
                return Err(DebugError::new(format!(
                    "{name} cannot be `{value}`; it can be {}",
                    values.join(", ").replace('"', "")
                )));
            }
            let value = match value {
                "true" => Value::Bool(true),
                "false" => Value::Bool(false),
                number => number.parse::<i64>().map_or_else(|_| number.into(), Value::from),
            };
            inner["model"]["quirks"][name.as_str()] = value;
        }
        WhatIf::Inputs(_) => {}
    }
    let mut state = whole.clone();
    state.device = serde_json::from_value(tree).map_err(wrong)?;
    line.restore(state.clone());
    Ok(state)
}

/// The output of a future, piece by piece.
struct Future<'i> {
    history: History<Wired>,
    inputs: std::slice::Iter<'i, TimedInput>,
    next: Option<&'i TimedInput>,
    command: Option<(CommandNumber, Vec<u8>)>,
    causes: u32,
}

impl<'i> Future<'i> {
    fn new(device: Wired, given: &[OwnedInput], inputs: &'i [TimedInput]) -> Future<'i> {
        let mut history = History::new(device);
        history.watch(Kinds::COMMAND);
        for input in given {
            history.give(input.as_input());
        }
        let mut inputs = inputs.iter();
        Future { next: inputs.next(), history, inputs, command: None, causes: 0 }
    }

    /// The next piece of output by `until`, with its time; `Ok(None)` if there is no more; an error
    /// if it was given up.
    fn piece(
        &mut self,
        until: Time,
        progress: &mut Progress<'_>,
    ) -> Result<Option<Piece>, Cancelled> {
        /// So many acts are between two questions whether to go on.
        const ACTS_MAX: u32 = 100;
        loop {
            if progress(self.history.now()).is_break() {
                return Err(Cancelled);
            }
            let limit = self.next.as_ref().map_or(until, |next| next.at.min(until));
            let mut said: Option<Piece> = None;
            let mut acts = 0;
            let command = &mut self.command;
            let found = self.history.find_next(limit, |_, _, outputs| {
                for output in outputs {
                    match output {
                        Output::Bytes(at, bytes) => {
                            let (_, all) = said.get_or_insert_with(|| (*at, Vec::new()));
                            all.extend_from_slice(bytes);
                        }
                        Output::Event(stamp, Event::Command { bytes, .. }) => {
                            *command = stamp.command.map(|number| (number, bytes.to_vec()));
                        }
                        _ => {}
                    }
                }
                acts += 1;
                said.is_some() || acts == ACTS_MAX
            });
            self.causes = self.causes.saturating_add(acts);
            if said.is_some() {
                return Ok(said);
            }
            if found && self.causes < CAUSES_MAX {
                continue;
            }
            let Some(next) = self.next.take_if(|next| next.at <= until) else { return Ok(None) };
            self.history.run_to(next.at);
            self.history.give(next.input.as_input());
            self.next = self.inputs.next();
        }
    }
}

/// What comes out at once, and when.
type Piece = (Time, Vec<u8>);

/// The search was given up.
struct Cancelled;

/// How far two futures were looked at, and where they part, or else the fields that differ in the end
/// all the same; `None` if it was cancelled.
fn first_difference(
    ours: Wired,
    theirs: Wired,
    given: &[OwnedInput],
    inputs: &[TimedInput],
    end: Time,
    progress: &mut Progress<'_>,
) -> Option<(Time, Result<Apart, Vec<Differing>>)> {
    let mut ours = Future::new(ours, &[], inputs);
    let mut theirs = Future::new(theirs, given, inputs);
    // First what is known, and then what follows from it.
    for until in [end, Time::NEVER] {
        loop {
            let pieces = (ours.piece(until, progress), theirs.piece(until, progress));
            let (Ok(one), Ok(other)) = pieces else { return None };
            if one != other {
                let times = [&one, &other].into_iter().flatten().map(|(at, _)| *at);
                let at = times.min().unwrap_or(until);
                return Some((at, Ok(apart(at, ours, theirs, one, other))));
            }
            if one.is_none() {
                break;
            }
        }
        let differ = |ours: &History<Wired>, theirs: &History<Wired>| {
            let now = ours.now().max(theirs.now());
            ours.device().position(ours.now()) != theirs.device().position(theirs.now())
                && now >= end
        };
        if until != Time::NEVER {
            ours.history.run_to(until);
            theirs.history.run_to(until);
        }
        if differ(&ours.history, &theirs.history) {
            let at = ours.history.now().min(theirs.history.now());
            return Some((at, Ok(apart(at, ours, theirs, None, None))));
        }
    }
    let until = ours.history.now().max(theirs.history.now());
    ours.history.run_to(until);
    theirs.history.run_to(until);
    Some((until, Err(fields_apart(&ours.history, &theirs.history))))
}

/// What is different at a time.
fn apart(
    at: Time,
    mut ours: Future<'_>,
    mut theirs: Future<'_>,
    one: Option<(Time, Vec<u8>)>,
    other: Option<(Time, Vec<u8>)>,
) -> Apart {
    for future in [&mut ours.history, &mut theirs.history] {
        future.go_to_time(at);
        if future.now() < at {
            future.run_to(at);
        }
    }
    let fields = fields_apart(&ours.history, &theirs.history);
    Apart { at, command: ours.command, ours: one, theirs: other, fields }
}

/// The fields in which two states differ, except for the model and the machine, which are what was
/// changed.
fn fields_apart(ours: &History<Wired>, theirs: &History<Wired>) -> Vec<Differing> {
    let mut fields =
        differences(&ours.device().device().state(), &theirs.device().device().state());
    fields.retain(|(path, ..)| {
        !path.starts_with("state.model") && !path.starts_with("state.plant.machine")
    });
    fields
}
