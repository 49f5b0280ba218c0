//! What led to something: a chain from the effect back to a byte, a button or the power.

use std::collections::VecDeque;
use std::fmt;

use serde_json::Value;
use vimc4_device::{
    CommandNumber, Condition, Device, Event, Input, Kinds, Motion, Names, Output, OwnedInput,
    Stamp, Time, Warning, escape,
};
use vimc4_timeline::{Act, Begins, BranchId, Found, Moment, Place, Progress, Sought};

use crate::Wired;
use crate::breakpoint::{Breakpoint, BreakpointId, Hits, Trigger};
use crate::debugger::Debugger;
use crate::stop::{Executing, Said, time};
use crate::story::Told;
use crate::walk::Walk;
use crate::{DebugError, Field, Way};

/// What a question is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// The last answer.
    Answer,
    /// The last error: an error answer, or a program that has ended with one.
    Error,
    /// What last stopped or cut short something.
    Stop,
    /// The last limit switch that has changed.
    Switch,
    /// The last signal that has changed.
    Signal,
    /// The last output port that has changed.
    Port,
    /// The motion that was begun last.
    Motion,
    /// The last event of any kind.
    Anything,
}

impl About {
    /// The one of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<About> {
        Some(match name {
            "" => About::Anything,
            "answer" => About::Answer,
            "error" => About::Error,
            "stop" => About::Stop,
            "switch" => About::Switch,
            "signal" => About::Signal,
            "port" => About::Port,
            "motion" => About::Motion,
            _ => return None,
        })
    }

    /// The kinds of events that it is among.
    fn kinds(self) -> Kinds {
        match self {
            About::Answer => Kinds::ANSWER,
            About::Error => Kinds::ANSWER.and(Kinds::WARNING),
            About::Stop => Kinds::ANSWER.and(Kinds::MOTION).and(Kinds::WARNING),
            About::Switch => Kinds::SWITCH,
            About::Signal => Kinds::SIGNAL,
            About::Port => Kinds::PORT,
            About::Motion => Kinds::MOTION,
            About::Anything => Kinds::ALL,
        }
    }

    fn is_about(self, event: &Event) -> bool {
        let is_error = matches!(
            event,
            Event::Answer { why: Some(_), .. } | Event::Warning(Warning::ProgramError { .. })
        );
        match self {
            About::Answer => matches!(event, Event::Answer { .. }),
            About::Error => is_error,
            About::Stop => {
                let stops =
                    matches!(event, Event::CutShort { .. } | Event::Motion(Motion::Changes { .. }));
                is_error || stops
            }
            About::Switch => matches!(event, Event::Switch { .. }),
            About::Signal => matches!(event, Event::Signal { .. }),
            About::Port => matches!(event, Event::Port { .. }),
            About::Motion => matches!(event, Event::Motion(Motion::Begins { .. })),
            About::Anything => true,
        }
    }
}

/// Which event of one instant matters most: an error rather than the output that went off with it,
/// the effect of a button rather than its release.
#[derive(Default)]
struct Weighed {
    at: Time,
    weight: u8,
}

impl Weighed {
    /// Whether its command has no event that matters more.
    fn matters(&mut self, at: Time, event: &Event) -> bool {
        let is_new = match event {
            Event::Signal { value, .. } => *value != 0,
            Event::Command { .. } | Event::Line { .. } => true,
            _ => false,
        };
        let weight = match event {
            Event::Answer { why: Some(_), .. }
            | Event::CutShort { .. }
            | Event::Warning(Warning::ProgramError { .. }) => 3,
            Event::Motion(Motion::Changes { .. }) | Event::Warning(_) => 2,
            Event::Signal { .. } | Event::Port { .. } => 0,
            _ => 1,
        };
        let matters = is_new || at != self.at || weight >= self.weight;
        if matters {
            *self = Weighed { at, weight };
        }
        matters
    }
}

/// What led to something, link by link: the first is what was asked about, and each of the others
/// led to the one before it. The last came from outside, if it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// The links.
    pub links: Vec<Explanation>,
}

/// A link of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// What it is.
    pub kind: ExplanationKind,
    /// When it was.
    pub at: Time,
    /// The moment just after it.
    pub place: Place,
    /// Its description for people, in one line.
    pub text: String,
}

/// What a link of a chain is.
#[derive(Clone, Debug, PartialEq)]
pub enum ExplanationKind {
    /// An event in the controller.
    Event(Event),
    /// A condition that became true.
    State(Condition),
    /// A line of the stored program that began.
    Line(u32),
    /// A command that began.
    Command(CommandNumber),
    /// Something that came from outside.
    Input(OwnedInput),
}

impl fmt::Display for Chain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, link) in self.links.iter().enumerate() {
            let because = if place == 0 { "" } else { "\n  because of  " };
            write!(f, "{because}{}  {}", time(link.at), link.text)?;
        }
        Ok(())
    }
}

/// Where a field was changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The field.
    pub field: String,
    /// The first moment with the other value.
    pub place: Place,
    /// When that was.
    pub at: Time,
    /// Its value before.
    pub before: Value,
    /// Its value after.
    pub after: Value,
    /// The act by which it changed; `None` if it changed by itself, in a motion.
    pub act: Option<Act>,
    /// The command that was executed.
    pub command: Option<Executing>,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |value: &Value| {
            let path = String::new();
            crate::Variable { name: String::new(), path, value: value.clone() }.text()
        };
        let (before, after) = (shown(&self.before), shown(&self.after));
        write!(f, "{}  {} was {before} and became {after}", time(self.at), self.field)?;
        match self.act {
            None => f.write_str(", in a motion")?,
            Some(Act::Byte(byte)) => write!(f, ", as the byte `{}` came", escape(&[byte]))?,
            Some(Act::Input) => f.write_str(", by something from outside")?,
            Some(Act::Cause) => {}
        }
        self.command.as_ref().map_or(Ok(()), |command| write!(f, "\n    {command}"))
    }
}

/// Looks for the last input that woke the controller from rest.
#[derive(Default)]
pub(crate) struct Begun {
    was_idle: bool,
}

impl Sought<Wired> for Begun {
    fn begin(&mut self, device: &Wired) {
        self.was_idle = device.is_idle();
    }

    fn after(&mut self, device: &Wired, act: Act, _: &VecDeque<Output>) -> bool {
        let was_idle = std::mem::replace(&mut self.was_idle, device.is_idle());
        let is_outside = match act {
            Act::Input => true,
            Act::Byte(byte) => device.is_urgent(byte),
            Act::Cause => false,
        };
        is_outside && was_idle && !device.is_idle()
    }
}

impl Debugger {
    /// What led to the last of what is asked about, at the present or before. The present stays.
    ///
    /// # Errors
    ///
    /// If there is no such thing.
    pub fn why(&mut self, about: About, progress: &mut Progress<'_>) -> Result<Chain, DebugError> {
        let begin = self.place();
        let mut has_had_enough = false;
        let chain = self.chain(about, &mut |at| {
            let goes_on = progress(at);
            has_had_enough |= goes_on.is_break();
            goes_on
        });
        self.history_mut().go_back_to(begin);
        self.history_mut().drain();
        if has_had_enough { Err(DebugError::new("cancelled")) } else { chain }
    }

    /// The same, wherever that leads. If it is given up the chain is incomplete.
    fn chain(&mut self, about: About, progress: &mut Progress<'_>) -> Result<Chain, DebugError> {
        if about == About::Switch {
            let chain = self.why_switch(progress);
            return chain.ok_or_else(|| DebugError::new("no limit switch has been met until now"));
        }
        let mut last = Weighed::default();
        let is_it = |stamp: &Stamp, event: &Event| {
            about.is_about(event) && (about != About::Anything || last.matters(stamp.at, event))
        };
        let Some(told) = self.last_event(about.kinds(), progress, is_it) else {
            return Err(DebugError::new("nothing of that kind has happened until now"));
        };
        let mut links = vec![self.link(&told)];
        self.causes(&told, &mut links, progress);
        Ok(Chain { links })
    }

    /// What led to the last limit switch that has become active.
    fn why_switch(&mut self, progress: &mut Progress<'_>) -> Option<Chain> {
        let (switch, by_act) = self.limit_met(progress)?;
        let mut links = vec![switch];
        // By hand, or by a motion.
        let place = self.place();
        if by_act
            && let Some(input) = self.input_at(place).filter(|input| input.at == place.moment.at)
            && matches!(input.kind, ExplanationKind::Input(OwnedInput::Signal(..)))
        {
            links.push(input);
            return Some(Chain { links });
        }
        let begins =
            |_: &Stamp, event: &Event| matches!(event, Event::Motion(Motion::Begins { .. }));
        let motion = self.last_event(Kinds::MOTION, progress, begins)?;
        links.push(self.link(&motion));
        self.causes(&motion, &mut links, progress);
        Some(Chain { links })
    }

    /// Goes to where a limit switch has become active last, and says which, and whether that was by an
    /// act.
    fn limit_met(&mut self, progress: &mut Progress<'_>) -> Option<(Explanation, bool)> {
        let axes = self.device().view(self.now()).axes;
        let ends = axes.iter().flat_map(|axis| [(axis, false), (axis, true)]);
        let limits: Vec<(Condition, String)> = ends
            .map(|(axis, positive)| {
                let limit = Condition::Limit { axis: axis.index, positive, active: true };
                (limit, format!("{}{}", axis.name, if positive { '+' } else { '-' }))
            })
            .collect();
        // Each by itself, because another one may be active all the time.
        let begin = self.place();
        let mut last: Option<(Place, &(Condition, String))> = None;
        for limit in &limits {
            self.history_mut().go_back_to(begin);
            let mut begins = Begins::new(&limit.0);
            let found = self.history_mut().seek_last_or_here(&mut begins, progress);
            let place = self.place();
            let is_later = last.is_none_or(|(last, _)| last.moment.at < place.moment.at);
            if found == Found::Here && is_later {
                last = Some((place, limit));
            }
        }
        let (place, (condition, name)) = last?;
        self.history_mut().go_back_to(place);
        let by_act = self.history().acted() == place.moment.at;
        let text = format!("the limit switch {name} became active");
        let kind = ExplanationKind::State(condition.clone());
        Some((Explanation { kind, at: place.moment.at, place, text }, by_act))
    }

    /// Adds what led to an event.
    fn causes(&mut self, told: &Told, links: &mut Vec<Explanation>, progress: &mut Progress<'_>) {
        // An immediate act of a person or a control code is its own cause.
        if let Some(input) = self.outside(told) {
            links.push(input);
            if told.stamp.command.is_none() {
                return;
            }
        }
        self.history_mut().go_back_to(told.place);
        let is_ended = matches!(
            told.event,
            Event::Answer { why: Some(_), .. }
                | Event::CutShort { .. }
                | Event::Motion(Motion::Changes { .. } | Motion::Ends { .. })
                | Event::Warning(_)
        );
        let of = told.stamp.command;
        if is_ended {
            self.ending(told, links, progress);
        }
        self.history_mut().go_back_to(told.place);
        let line = self.last_event(Kinds::COMMAND, progress, |stamp, event| {
            stamp.command == of && matches!(event, Event::Line { .. })
        });
        if let Some(line) = line
            && self.is_of_program(&told.event)
            && !matches!(told.event, Event::Line { .. })
        {
            links.push(self.link(&line));
        }
        match of {
            Some(number) => {
                let begins = |stamp: &Stamp, event: &Event| {
                    stamp.command == Some(number) && matches!(event, Event::Command { .. })
                };
                let Some(command) = self.last_event(Kinds::COMMAND, progress, begins) else {
                    return;
                };
                if command.event != told.event {
                    links.push(self.link(&command));
                }
                self.history_mut().go_back_to(command.place);
                links.extend(self.received(&command.event));
            }
            None => {
                let mut begun = Begun::default();
                let is_outside =
                    |link: &Explanation| matches!(link.kind, ExplanationKind::Input(_));
                let history = self.history_mut();
                if !links.iter().any(is_outside)
                    && history.seek_last_or_here(&mut begun, progress) == Found::Here
                {
                    let place = self.place();
                    links.extend(self.input_at(place));
                }
            }
        }
    }

    /// Adds what ended a motion early: a switch or a person, and where it began to brake.
    fn ending(&mut self, told: &Told, links: &mut Vec<Explanation>, progress: &mut Progress<'_>) {
        let of = told.stamp.command;
        let braked = self.last_event(Kinds::MOTION, progress, |stamp, event| {
            let is_of = stamp.command == of && of.is_some();
            is_of && matches!(event, Event::Motion(Motion::Begins { .. } | Motion::Changes { .. }))
        });
        let braked =
            braked.filter(|told| matches!(told.event, Event::Motion(Motion::Changes { .. })));
        let mut at = told.stamp.at;
        if let Some(braked) = braked.filter(|braked| braked.event != told.event) {
            at = braked.stamp.at;
            links.push(self.link(&braked));
            links.extend(self.outside(&braked));
            self.history_mut().go_back_to(braked.place);
        }
        let switch = self.last_event(Kinds::SWITCH, progress, |stamp, event| {
            stamp.at == at && matches!(event, Event::Switch { active: true, .. })
        });
        match switch {
            Some(switch) => links.push(self.link(&switch)),
            None => {
                let met = self.limit_met(progress).filter(|(link, _)| link.at == at);
                links.extend(met.map(|(link, _)| link));
                self.history_mut().go_back_to(told.place);
            }
        }
        let is_outside = |link: &Explanation| matches!(link.kind, ExplanationKind::Input(_));
        if !links.iter().any(is_outside)
            && let Some(signal) =
                self.last_event(Kinds::SIGNAL, progress, |stamp, _| stamp.at == at)
        {
            links.extend(self.outside(&signal));
        }
    }

    /// Whether something can belong to a line of the stored program, because the program runs.
    fn is_of_program(&self, event: &Event) -> bool {
        let details = self.device().details();
        let has_run = details.program().is_some_and(|program| program.marker.is_some());
        has_run || matches!(event, Event::Warning(Warning::ProgramError { .. }))
    }

    /// The input whose own act produced an event, if one did.
    fn outside(&mut self, told: &Told) -> Option<Explanation> {
        match told.act {
            Act::Cause => None,
            Act::Byte(byte) if !self.device().is_urgent(byte) => None,
            Act::Byte(_) | Act::Input => self.input_at(told.place),
        }
    }

    /// The input that leads to a moment.
    fn input_at(&self, place: Place) -> Option<Explanation> {
        let Moment { inputs, bytes, .. } = place.moment;
        let number = if bytes > 0 { inputs } else { inputs.checked_sub(1)? };
        let given = self.history().inputs(place.branch, number).next()?;
        let (kind, text) = match &given.input {
            OwnedInput::Bytes(all) => {
                let last = if bytes > 0 { bytes as usize } else { all.len() };
                let byte = *all.get(last.checked_sub(1)?)?;
                let one = OwnedInput::from(Input::Bytes(&[byte]));
                (one, format!("the byte {} came over the line", escape(&[byte])))
            }
            input => (input.clone(), self.describe_input(input)),
        };
        Some(Explanation { kind: ExplanationKind::Input(kind), at: given.at, place, text })
    }

    /// An input for people.
    pub(crate) fn describe_input(&self, input: &OwnedInput) -> String {
        match input {
            OwnedInput::Bytes(bytes) => format!("{} came over the line", escape(bytes)),
            OwnedInput::Signal(id, value) => {
                let listed = self.device().signals();
                let signal = listed.iter().find(|signal| signal.id == *id);
                let name = signal.map_or_else(|| id.0.to_string(), |signal| signal.name.clone());
                let place = usize::try_from(*value).ok();
                let positions = signal.and_then(|signal| signal.positions.as_ref());
                let position = positions.and_then(|positions| positions.get(place?));
                match (position, value) {
                    (Some(position), _) => format!("{name} was put to {position}"),
                    (None, 0) => format!("{name} was released or set to 0"),
                    (None, 1) => format!("{name} was pressed or set to 1"),
                    (None, value) => format!("{name} was set to {value}"),
                }
            }
            OwnedInput::Power(true) => "the power was switched on".to_owned(),
            OwnedInput::Power(false) => "the power was switched off".to_owned(),
            OwnedInput::Fault(faulting) => {
                format!("fault {}", Names::of(self.device()).write_faulting(faulting))
            }
            OwnedInput::Rule(ruling) => {
                format!("rule {}", Names::of(self.device()).write_ruling(ruling))
            }
            OwnedInput::Wake => "time passed".to_owned(),
        }
    }

    /// Where the text of a command that begins at the present came over the line.
    fn received(&self, event: &Event) -> Option<Explanation> {
        /// How many bytes the search goes back.
        const FAR: usize = 1 << 16;
        let Event::Command { bytes: line, .. } = event else { return None };
        let line = line.strip_suffix(b"...").unwrap_or(line);
        let mut place = self.place();
        // The bytes that had come, the last one first, each with the moment just after it.
        let mut come: Vec<(u8, Place, Time)> = Vec::new();
        let waiting = self.device().view(self.now()).received.used + self.ends_waiting();
        let backwards: Vec<u8> = line.iter().rev().copied().collect();
        // Up to here nothing was found.
        let mut looked = waiting;
        while come.len() < FAR {
            let Moment { inputs, bytes, .. } = place.moment;
            let (number, until) = match (bytes, inputs.checked_sub(1)) {
                (1.., _) => (inputs, bytes as usize),
                (0, Some(before)) => (before, usize::MAX),
                (0, None) => {
                    let branch = self.branch_from(place.branch)?;
                    place = branch;
                    continue;
                }
            };
            let given = self.history().inputs(place.branch, number).next()?;
            if let OwnedInput::Bytes(all) = &given.input {
                for (at, byte) in all.iter().enumerate().take(until).rev() {
                    let is_last = at + 1 == all.len();
                    let moment = Moment {
                        inputs: number + u64::from(is_last),
                        bytes: if is_last { 0 } else { at as u64 + 1 },
                        causes: 0,
                        at: given.at,
                    };
                    come.push((*byte, Place { branch: place.branch, moment }, given.at));
                }
            }
            place.moment = Moment { inputs: number, bytes: 0, ..Moment::default() };
            let come_last = come.get(looked..).unwrap_or_default();
            let found = come_last
                .windows(backwards.len().max(1))
                .position(|window| window.iter().map(|(byte, ..)| byte).eq(&backwards));
            if found.is_none() {
                looked = looked.max(come.len().saturating_sub(backwards.len()));
            }
            if let Some(found) = found {
                // The end of the line came after it.
                let end = (looked + found).saturating_sub(1).max(waiting);
                let (byte, place, at) = *come.get(end)?;
                let kind = ExplanationKind::Input(OwnedInput::from(Input::Bytes(&[byte])));
                let text = format!("{} came over the line", escape(line));
                return Some(Explanation { kind, at, place, text });
            }
        }
        None
    }

    /// How many waiting line ends are not among the bytes reported as waiting.
    fn ends_waiting(&self) -> usize {
        #[cfg(feature = "lpkf")]
        if let Some(details) = self.device().details().lpkf() {
            return details.commands_waiting;
        }
        0
    }

    /// Where a branch has left another one.
    fn branch_from(&self, branch: BranchId) -> Option<Place> {
        self.history().branches().find(|other| other.id == branch)?.parted
    }

    /// Something that came out, in one line, with the names of signals and axes.
    pub(crate) fn say(&self, output: &Output) -> String {
        match output.event() {
            Some(Event::Signal { signal, value }) => {
                self.describe_input(&OwnedInput::Signal(*signal, *value))
            }
            Some(Event::Switch { axis, positive, active }) => {
                let axes = self.device().view(self.now()).axes;
                let name = axes.iter().find(|other| other.index == *axis);
                let name = name.map_or_else(|| axis.to_string(), |axis| axis.name.clone());
                let end = if *positive { '+' } else { '-' };
                let what = if *active { "became active" } else { "is no longer active" };
                format!("the limit switch {name}{end} {what}")
            }
            _ => Said(output).to_string(),
        }
    }

    fn link(&self, told: &Told) -> Explanation {
        let Told { stamp, event, place, .. } = told;
        let (kind, text) = match event {
            Event::Command { bytes, .. } => {
                let meaning = self.device().explain(bytes);
                let number = stamp.command;
                let text = match number {
                    Some(number) => format!("command #{number} {}: {meaning}", escape(bytes)),
                    None => format!("command {}: {meaning}", escape(bytes)),
                };
                let kind =
                    number.map_or(ExplanationKind::Event(event.clone()), ExplanationKind::Command);
                (kind, text)
            }
            Event::Line { line, .. } => {
                let details = self.device().details();
                let lines = details.program().map(|program| program.lines.as_slice());
                let place = (*line as usize).checked_sub(1);
                let text = lines.zip(place).and_then(|(lines, place)| lines.get(place));
                let text = text.map_or(String::new(), |text| {
                    format!(" {text}: {}", self.device().explain(text.as_bytes()))
                });
                (ExplanationKind::Line(*line), format!("line {line} of the program{text}"))
            }
            event => {
                let output = Output::Event(*stamp, event.clone());
                (ExplanationKind::Event(event.clone()), self.say(&output))
            }
        };
        Explanation { kind, at: stamp.at, place: *place, text }
    }

    /// Goes to where a field was changed last, at the present or before; `None` if it never was, and
    /// the present stays.
    pub fn who_changed(
        &mut self,
        field: &Field,
        progress: &mut Progress<'_>,
    ) -> Result<Option<Change>, DebugError> {
        let mut breakpoints = [Breakpoint {
            id: BreakpointId(0),
            trigger: Trigger::Change(field.clone()),
            condition: None,
            hits: Hits::All,
            log: None,
            is_enabled: true,
            count: 0,
            counted: None,
        }];
        let mut walk = Walk::new(Way::Back).heeding(&mut breakpoints, None);
        match self.history_mut().seek_last_or_here(&mut walk, progress) {
            Found::Here => {}
            Found::Nowhere => return Ok(None),
            Found::GivenUp => return Err(DebugError::new("cancelled")),
        }
        let (place, at) = (self.place(), self.now());
        let after = field.value(self.device(), at);
        let command = self.executing();
        self.history_mut().back();
        let just_before = Time::from_nanos(at.as_nanos().saturating_sub(1)).max(self.now());
        let before = field.value(self.device(), just_before);
        let is_act = self.history_mut().step().filter(|_| self.place() == place);
        self.history_mut().go_back_to(place);
        Ok(Some(Change {
            field: field.to_string(),
            place,
            at,
            before,
            after,
            act: is_act,
            command,
        }))
    }
}
