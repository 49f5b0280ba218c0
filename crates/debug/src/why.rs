//! What led to something: a chain from the effect back to a byte, a button or the power.

use std::collections::VecDeque;
use std::fmt;
use std::iter;

use serde_json::Value;
use vimc4_device::{
    CommandNumber, Condition, Device, Event, FaultNews, Input, Kinds, MachineStrike, Motion, Names,
    Output, OwnedInput, RuleId, RuleNews, Ruling, Stamp, Strike, Time, Warning, escape,
};
use vimc4_session::BreakpointId;
use vimc4_timeline::{Act, Begins, BranchId, Found, Moment, Place, Progress, Sought};

use crate::Wired;
use crate::breakpoint::{Breakpoint, Options, Trigger};
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
    /// The fault that has struck last.
    Fault,
    /// The rule that has done something last, or could not.
    Rule,
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
            "fault" => About::Fault,
            "rule" => About::Rule,
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
            About::Fault | About::Rule => Kinds::FAULT,
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
            About::Fault => matches!(event, Event::Fault { news: FaultNews::Strikes(_), .. }),
            About::Rule => matches!(event, Event::Rule { .. }) && is_of_its_own(event),
            About::Anything => true,
        }
    }

    /// Why there is nothing to explain.
    fn none(self) -> &'static str {
        match self {
            About::Switch => "no limit switch has been met until now",
            About::Fault => {
                "no fault has struck until now; `faults` lists those that there are, and `fault jam x` begins one"
            }
            About::Rule => {
                "no rule has acted until now; `rules` lists those that there are, and `when x > 1000: press stop` \
                 begins one"
            }
            _ => "nothing of that kind has happened until now",
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

impl Explanation {
    /// Whether it came from outside, or by itself: nothing else led to it.
    fn is_outside(&self) -> bool {
        match &self.kind {
            ExplanationKind::Input(_) => true,
            ExplanationKind::Event(event) => does_something(event),
            _ => false,
        }
    }
}

/// Whether it is what a rule or a fault does, and not that it begins or ends.
fn is_of_its_own(event: &Event) -> bool {
    match event {
        Event::Rule { news, .. } => !matches!(news, RuleNews::Begins | RuleNews::Ends),
        Event::Fault { news, .. } => !matches!(news, FaultNews::Begins(_) | FaultNews::Ends),
        _ => false,
    }
}

/// Whether a rule or a fault does something to the controller with this.
fn does_something(event: &Event) -> bool {
    match event {
        Event::Rule { news, .. } => matches!(news, RuleNews::Acts(..) | RuleNews::SetsBack),
        Event::Fault { news, .. } => {
            matches!(news, FaultNews::Armed | FaultNews::Strikes(Strike::Machine(_)))
        }
        _ => false,
    }
}

/// Whether a place comes after another on one way: a branch has a higher number than the one that it has
/// left.
fn is_later(place: Place, other: Place) -> bool {
    (place.branch.0, place.moment) > (other.branch.0, other.moment)
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
        if has_had_enough { Err(DebugError::cancelled()) } else { chain }
    }

    /// The same, wherever that leads. If it is given up the chain is incomplete.
    fn chain(&mut self, about: About, progress: &mut Progress<'_>) -> Result<Chain, DebugError> {
        if about == About::Switch {
            let chain = self.why_switch(progress);
            return chain.ok_or_else(|| DebugError::new(about.none()));
        }
        let mut last = Weighed::default();
        let is_it = |stamp: &Stamp, event: &Event| {
            about.is_about(event) && (about != About::Anything || last.matters(stamp.at, event))
        };
        let Some(told) = self.last_event(about.kinds(), progress, is_it) else {
            return Err(DebugError::new(about.none()));
        };
        let mut links = vec![self.link(&told)];
        self.causes(&told, &mut links, progress);
        Ok(Chain { links })
    }

    /// What led to the last limit switch that has become active.
    fn why_switch(&mut self, progress: &mut Progress<'_>) -> Option<Chain> {
        let (switch, by_act) = self.limit_met(progress)?;
        let end = match &switch.kind {
            ExplanationKind::State(Condition::Limit { axis, positive, .. }) => {
                Some((*axis, *positive))
            }
            _ => None,
        };
        let mut links = vec![switch];
        // By hand, by a rule or a fault, or by a motion.
        let place = self.place();
        let pressed = self.last_event(Kinds::SWITCH, progress, |_, event| match event {
            Event::Switch { axis, positive, active: true } => end == Some((*axis, *positive)),
            _ => false,
        });
        if let Some(pressed) = pressed.filter(|pressed| pressed.place == place) {
            let by = self.outside(&pressed, progress);
            self.history_mut().go_back_to(place);
            if !by.is_empty() {
                links.extend(by);
                return Some(Chain { links });
            }
        }
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
        // An immediate act of a person, a rule, a fault or a control code is its own cause.
        let outside = self.outside(told, progress);
        let is_explained = !outside.is_empty();
        links.extend(outside);
        if is_explained && told.stamp.command.is_none() {
            return;
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
        self.stalled(told, links, progress);
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
                match self.received(&command.event) {
                    Some(received) => links.push(received),
                    None => links.extend(self.distorted(&command, progress)),
                }
            }
            None => {
                let mut begun = Begun::default();
                let history = self.history_mut();
                if !links.iter().any(Explanation::is_outside)
                    && history.seek_last_or_here(&mut begun, progress) == Found::Here
                {
                    let place = self.place();
                    links.extend(self.input_at(place));
                }
            }
        }
    }

    /// Adds what let a motor stand whose carriage has not gone where its counter has.
    fn stalled(&mut self, told: &Told, links: &mut Vec<Explanation>, progress: &mut Progress<'_>) {
        let Event::Warning(Warning::StepsLost { axis, .. }) = told.event else { return };
        let stands = self.last_event(Kinds::FAULT, progress, |_, event| {
            let Event::Fault { news: FaultNews::Strikes(Strike::Machine(strike)), .. } = event
            else {
                return false;
            };
            matches!(strike, MachineStrike::Stands(own, _) if *own == axis)
        });
        let begins = self.last_event(Kinds::MOTION, progress, |_, event| {
            matches!(event, Event::Motion(Motion::Begins { .. }))
        });
        let is_of_motion =
            |stands: &Told| begins.is_none_or(|begins| !is_later(begins.place, stands.place));
        let Some(stands) = stands.filter(is_of_motion) else { return };
        let link = self.link(&stands);
        if !links.contains(&link) {
            links.push(link);
            links.extend(self.begun_by(&stands, progress));
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
            links.extend(self.outside(&braked, progress));
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
        if !links.iter().any(Explanation::is_outside)
            && let Some(signal) =
                self.last_event(Kinds::SIGNAL, progress, |stamp, _| stamp.at == at)
        {
            links.extend(self.outside(&signal, progress));
        }
    }

    /// Whether something can belong to a line of the stored program, because the program runs.
    fn is_of_program(&self, event: &Event) -> bool {
        let details = self.device().details();
        let has_run = details.program().is_some_and(|program| program.marker.is_some());
        has_run || matches!(event, Event::Warning(Warning::ProgramError { .. }))
    }

    /// What produced an event by an act of its own, if something did: a rule or a fault, and what began it;
    /// an input.
    fn outside(&mut self, told: &Told, progress: &mut Progress<'_>) -> Vec<Explanation> {
        let mut links = Vec::new();
        let mut did = told.before.iter().rev().filter(|(_, event)| does_something(event));
        let by = match told.event {
            // A fault presses it, whatever rules do at the same instant.
            Event::Switch { .. } => did
                .clone()
                .find(|(_, event)| matches!(event, Event::Fault { .. }))
                .or_else(|| did.next()),
            _ => did.next(),
        };
        if is_of_its_own(&told.event) {
            links.extend(self.begun_by(told, progress));
        } else if let Some((stamp, event)) = by.cloned() {
            let by = Told { stamp, event, before: Vec::new(), ..*told };
            links.push(self.link(&by));
            links.extend(self.begun_by(&by, progress));
        }
        let input = match told.act {
            Act::Input => self.input_at(told.place),
            Act::Byte(byte) if self.device().is_urgent(byte) => self.input_at(told.place),
            Act::Byte(_) => None,
            Act::Cause => self.arrived(told.place),
        };
        // What begins a rule or a fault may let it act at once, and has been said then.
        let is_said = |input: &Explanation| links.iter().any(|link| link.kind == input.kind);
        let input = input.filter(|input| !is_said(input));
        links.extend(input);
        links
    }

    /// The control code that reaches the controller at a moment, where it takes a cause to cross the line.
    fn arrived(&mut self, place: Place) -> Option<Explanation> {
        self.history_mut().go_back_to(place);
        let arriving = self.history_mut().back().then(|| self.line().arriving()).flatten();
        let before = self.place();
        let (byte, later) = arriving.filter(|(byte, _)| self.device().is_urgent(*byte))?;
        let (_, place, at) = self.sent_before(before).nth(later)?;
        let kind = ExplanationKind::Input(OwnedInput::from(Input::Bytes(&[byte])));
        let text = format!("the byte {} came over the line", escape(&[byte]));
        Some(Explanation { kind, at, place, text })
    }

    /// What led to something that a rule or a fault did: what began it, and with a fault that waited, when
    /// that was over.
    fn begun_by(&mut self, told: &Told, progress: &mut Progress<'_>) -> Vec<Explanation> {
        let mut links = Vec::new();
        self.history_mut().go_back_to(told.place);
        let begun = match &told.event {
            Event::Rule { rule, .. } => {
                let begun = self.last_event(Kinds::FAULT, progress, |_, event| {
                    let Event::Rule { rule: own, news: RuleNews::Begins } = event else {
                        return false;
                    };
                    own == rule
                });
                if begun.is_none() {
                    links.extend(self.was_there(rule));
                }
                begun
            }
            Event::Fault { number, .. } => {
                let is_armed = |event: &Event| match event {
                    Event::Fault { number: own, news: FaultNews::Armed } => own == number,
                    _ => false,
                };
                let is_begun = |event: &Event| match event {
                    Event::Fault { number: own, news: FaultNews::Begins(_) } => own == number,
                    _ => false,
                };
                if !is_armed(&told.event) {
                    let last = self.last_event(Kinds::FAULT, progress, |_, event| {
                        is_armed(event) || is_begun(event)
                    });
                    let armed = last.filter(|last| is_armed(&last.event));
                    links.extend(armed.map(|armed| self.link(&armed)));
                }
                self.last_event(Kinds::FAULT, progress, |_, event| is_begun(event))
            }
            _ => None,
        };
        let Some(begun) = begun else { return links };
        // A fault may be what a rule did.
        let acted = begun.before.iter().rev().find(|(_, event)| match (event, &begun.event) {
            (Event::Rule { news: RuleNews::Acts(_, faults), .. }, Event::Fault { number, .. }) => {
                faults.contains(number)
            }
            _ => false,
        });
        match acted.cloned() {
            Some((stamp, event)) => {
                let acted = Told { stamp, event, before: Vec::new(), ..begun };
                links.push(self.link(&acted));
                links.extend(self.begun_by(&acted, progress));
            }
            None if begun.act == Act::Input => {
                self.history_mut().go_back_to(begun.place);
                let what = match &begun.event {
                    Event::Rule { rule, .. } => self.rule_in_words(rule),
                    Event::Fault { number, news: FaultNews::Begins(fault) } => Some(format!(
                        "fault {number} was begun: {}",
                        self.names().write_fault(fault)
                    )),
                    _ => None,
                };
                let input = self.input_at(begun.place);
                links.extend(input.zip(what).map(|(input, text)| Explanation { text, ..input }));
            }
            None => {}
        }
        links
    }

    /// A rule that there is at the present, for people.
    fn rule_in_words(&self, id: &RuleId) -> Option<String> {
        let view = self.line().rules().into_iter().find(|view| view.id == *id)?;
        let rule = self.names().write_rule(&view.rule);
        Some(format!("rule {id} was begun: {}", rule.strip_prefix("rule ").unwrap_or(&rule)))
    }

    /// A rule that was begun before everything that is known.
    fn was_there(&self, id: &RuleId) -> Option<Explanation> {
        let view = self.line().rules().into_iter().find(|view| view.id == *id)?;
        let ruling = Ruling::Begin(id.scenario, view.rule.into());
        let first = self.history().branches().next().map(|branch| branch.first);
        let place = Place { branch: BranchId(0), moment: first.unwrap_or_default() };
        let text = self.rule_in_words(id)? + ", before all that is known";
        let kind = ExplanationKind::Input(OwnedInput::Rule(ruling));
        Some(Explanation { kind, at: place.moment.at, place, text })
    }

    /// What faults made of the bytes of a command whose text nobody has sent: from the last of them back.
    fn distorted(&mut self, command: &Told, progress: &mut Progress<'_>) -> Vec<Explanation> {
        /// So many strikes are told.
        const STRIKES: usize = 4;
        let mut links = Vec::new();
        self.history_mut().go_back_to(command.place);
        let before = self.last_event(Kinds::COMMAND, progress, |stamp, event| {
            stamp.command != command.stamp.command && matches!(event, Event::Command { .. })
        });
        let mut last = None;
        for _ in 0..STRIKES {
            let struck = self.last_event(Kinds::FAULT, progress, |_, event| {
                let Event::Fault { news: FaultNews::Strikes(strike), .. } = event else {
                    return false;
                };
                let Strike::Line { way, sent, arrives, .. } = strike else { return false };
                *way == vimc4_device::Way::ToController && sent != arrives
            });
            let is_of_it = |struck: &Told| {
                before.as_ref().is_none_or(|before| is_later(struck.place, before.place))
            };
            let Some(struck) = struck.filter(is_of_it) else { break };
            links.push(self.link(&struck));
            self.history_mut().go_back_to(struck.place);
            let has_more = self.history_mut().back();
            last = Some(struck);
            if !has_more {
                break;
            }
        }
        if let Some(last) = last {
            links.extend(self.begun_by(&last, progress));
        }
        links
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
                let ruling = Names::of(self.device()).write_ruling(ruling);
                match ruling.starts_with("rule ") {
                    true => ruling,
                    false => format!("rule {ruling}"),
                }
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
        let backwards: Vec<u8> = line.iter().rev().copied().collect();
        let waiting = self.device().view(self.now()).received.used + self.ends_waiting();
        let waiting = waiting + self.line().coming();
        if line.is_empty() {
            return None;
        }
        let mut end = None;
        // The bytes that came last, the last one first, as many as the text has.
        let mut come: VecDeque<(u8, Place, Time)> = VecDeque::new();
        for sent in self.sent_before(self.place()).take(FAR).skip(waiting) {
            come.push_back(sent);
            if come.len() > backwards.len() {
                end = come.pop_front();
            }
            if come.iter().map(|(byte, ..)| byte).eq(&backwards) {
                // The end of the line came after it.
                let (byte, place, at) = end.or_else(|| come.front().copied())?;
                let kind = ExplanationKind::Input(OwnedInput::from(Input::Bytes(&[byte])));
                let text = format!("{} came over the line", escape(line));
                return Some(Explanation { kind, at, place, text });
            }
        }
        None
    }

    /// The bytes that were sent by a moment, the last one first, each with the moment just after it.
    fn sent_before(&self, mut place: Place) -> impl Iterator<Item = (u8, Place, Time)> {
        let inputs = iter::from_fn(move || {
            loop {
                let Moment { inputs, bytes, .. } = place.moment;
                let (number, until) = match (bytes, inputs.checked_sub(1)) {
                    (1.., _) => (inputs, bytes as usize),
                    (0, Some(before)) => (before, usize::MAX),
                    (0, None) => {
                        place = self.branch_from(place.branch)?;
                        continue;
                    }
                };
                let given = self.history().inputs(place.branch, number).next()?;
                place.moment = Moment { inputs: number, bytes: 0, ..Moment::default() };
                if let OwnedInput::Bytes(all) = given.input {
                    return Some((place.branch, number, given.at, all, until));
                }
            }
        });
        inputs.flat_map(|(branch, number, at, all, until)| {
            let count = all.len();
            (0..count.min(until)).rev().filter_map(move |nth| {
                let is_last = nth + 1 == count;
                let moment = Moment {
                    inputs: number + u64::from(is_last),
                    bytes: if is_last { 0 } else { nth as u64 + 1 },
                    causes: 0,
                    at,
                };
                Some((*all.get(nth)?, Place { branch, moment }, at))
            })
        })
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

    /// A link in the words of the moment at which it was. The present stays.
    fn link(&mut self, told: &Told) -> Explanation {
        let begin = self.place();
        let is_worded = matches!(told.event, Event::Command { .. } | Event::Line { .. });
        if is_worded {
            self.history_mut().go_back_to(told.place);
        }
        let link = self.link_from_here(told);
        if is_worded {
            self.history_mut().go_back_to(begin);
        }
        link
    }

    fn link_from_here(&self, told: &Told) -> Explanation {
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
        let trigger = Trigger::Change(field.clone());
        let mut breakpoints =
            [Breakpoint::new(BreakpointId::INTERNAL, trigger, Options::default())];
        let mut walk = Walk::new(Way::Back).heeding(&mut breakpoints, None);
        match self.history_mut().seek_last_or_here(&mut walk, progress) {
            Found::Here => {}
            Found::Nowhere => return Ok(None),
            Found::GivenUp => return Err(DebugError::cancelled()),
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
