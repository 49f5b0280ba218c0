//! What a walk through a history stops at: the end of a step, and breakpoints.

use std::collections::VecDeque;

use serde_json::Value;
use vimc4_catalogue::{Controller, isel::LoopView};
use vimc4_device::{Beginnings, Condition, Device, Event, Kinds, Output, Time};
use vimc4_session::BreakpointId;
use vimc4_timeline::{Act, Sought, Stretch, Which};

use crate::Wired;
use crate::breakpoint::{Breakpoint, Hits, Note, Trigger};
use crate::expression::filled;
use crate::recurrence::is_timeless;
use crate::steps::{Axes, first_step, last_step};
use crate::{Depth, Source, Unit, Way};

/// The most errors and warnings on the way that are reported.
pub(crate) const PROBLEMS_MAX: usize = 20;

/// The number of instants between two acts that are looked at before asking whether to go on.
const INSTANTS_MAX: u32 = 256;

/// The most notes kept of one walk.
const NOTES_MAX: usize = 10_000;

/// Looks for the first of several goals.
pub(crate) struct Walk<'w> {
    way: Way,
    step: Option<Stepping<'w>>,
    waiting: Vec<Waiting<'w>>,
    /// The conditions of these.
    conditions: Vec<Option<Condition>>,
    /// The breakpoints at which the walk has stopped, and when.
    pub(crate) met: Vec<(BreakpointId, Time)>,
    pub(crate) notes: Vec<Note>,
    /// How many of them are of the last act, or of before.
    sure: usize,
    /// The number of notes beyond the limit.
    pub(crate) left_out: u64,
    /// Whether the step ends where the walk has stopped.
    pub(crate) is_step: bool,
    /// How far the search between two acts got, if it was interrupted.
    looked_until: Option<Time>,
    /// What went wrong on the way, if that is wanted.
    pub(crate) problems: Option<Problems>,
}

/// The last error answers and warnings.
#[derive(Clone, Debug, Default)]
pub(crate) struct Problems {
    pub(crate) last: VecDeque<Output>,
}

impl Problems {
    fn can_be_in(stretch: &Stretch) -> bool {
        stretch.can_meet(&Condition::Error { code: None }) || stretch.can_have(Kinds::WARNING)
    }

    pub(crate) fn saw(&mut self, outputs: &VecDeque<Output>) {
        let is_problem = |output: &&Output| {
            let event = output.event();
            event.is_some_and(|event| {
                matches!(event, Event::Answer { why: Some(_), .. } | Event::Warning(_))
            })
        };
        self.last.extend(outputs.iter().filter(is_problem).cloned());
        self.last.drain(..self.last.len().saturating_sub(PROBLEMS_MAX));
    }
}

/// Looks for something, and keeps what goes wrong on the way to it.
pub(crate) struct Telling<'s, S> {
    pub(crate) sought: &'s mut S,
    pub(crate) problems: &'s mut Problems,
}

impl<S: Sought<Wired>> Sought<Wired> for Telling<'_, S> {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        self.sought.can_be_in(stretch) || Problems::can_be_in(stretch)
    }

    fn begin(&mut self, device: &Wired) {
        self.sought.begin(device);
    }

    fn between(&mut self, device: &Wired, until: Time, which: Which) -> Option<Time> {
        self.sought.between(device, until, which)
    }

    fn looked_until(&mut self) -> Option<Time> {
        self.sought.looked_until()
    }

    fn after(&mut self, device: &Wired, act: Act, outputs: &VecDeque<Output>) -> bool {
        self.problems.saw(outputs);
        self.sought.after(device, act, outputs)
    }
}

/// The end of a step.
struct Stepping<'w> {
    unit: Unit,
    depth: Depth,
    /// How many loops were open where the step began.
    open: usize,
    source: Option<&'w Source>,
    /// The state before the next act.
    before: Before,
}

#[derive(Default)]
struct Before {
    loops: Vec<LoopView>,
    position: vimc4_device::Point,
}

/// A breakpoint, and the values before.
struct Waiting<'w> {
    breakpoint: &'w mut Breakpoint,
    source: Option<&'w Source>,
    /// Whether it held.
    holds: bool,
    /// The value of the field.
    value: Value,
    /// How often it was hit up to the last act.
    sure: u64,
}

impl<'w> Walk<'w> {
    pub(crate) fn new(way: Way) -> Walk<'w> {
        let (met, notes) = (Vec::new(), Vec::new());
        let (waiting, conditions) = (Vec::new(), Vec::new());
        Walk {
            way,
            step: None,
            waiting,
            conditions,
            met,
            notes,
            sure: 0,
            left_out: 0,
            is_step: false,
            looked_until: None,
            problems: None,
        }
    }

    /// Keeps what goes wrong on the way.
    pub(crate) fn telling(mut self) -> Walk<'w> {
        self.problems = (self.way == Way::Forward).then(Problems::default);
        self
    }

    /// Stops where a step ends that began where so many loops were open.
    pub(crate) fn step(
        mut self,
        unit: Unit,
        depth: Depth,
        open: usize,
        source: Option<&'w Source>,
    ) -> Walk<'w> {
        self.step = Some(Stepping { unit, depth, open, source, before: Before::default() });
        self
    }

    /// Stops at those of these breakpoints that are enabled.
    pub(crate) fn heeding(
        mut self,
        breakpoints: &'w mut [Breakpoint],
        source: Option<&'w Source>,
    ) -> Walk<'w> {
        let heeded = breakpoints.iter_mut().filter(|breakpoint| breakpoint.is_enabled);
        self.waiting.extend(heeded.map(|breakpoint| Waiting {
            breakpoint,
            source,
            holds: false,
            value: Value::Null,
            sure: 0,
        }));
        let conditions = self.waiting.iter().map(|waiting| match &waiting.breakpoint.trigger {
            Trigger::Condition(condition) => Some(condition.clone()),
            _ => None,
        });
        self.conditions = conditions.collect();
        self
    }

    /// Whether it depends on the state of the controller and on events only: where those repeat themselves,
    /// nothing new is met.
    pub(crate) fn is_timeless(&self) -> bool {
        self.waiting.iter().all(|waiting| {
            let Breakpoint { trigger, condition, hits, log, .. } = &*waiting.breakpoint;
            let is_plain = condition.is_none() && *hits == Hits::All && log.is_none();
            is_plain
                && match trigger {
                    Trigger::Condition(condition) => is_timeless(condition),
                    Trigger::SourceLine(_) => true,
                    Trigger::Change(field) => field.axis().is_some() || field.signal().is_some(),
                    Trigger::Expression(_) => false,
                }
        })
    }

    /// The present is where the walk has come to: what was met by now was met on the way there.
    fn is_sure(&mut self) {
        self.sure = self.notes.len();
        for waiting in &mut self.waiting {
            waiting.sure = waiting.breakpoint.count;
        }
    }

    /// The walk has found nothing, and the present is where something happened last. What was met after
    /// that is not on the way there: it is not counted, and what it would note is returned.
    pub(crate) fn take_back(&mut self) -> Vec<Note> {
        for waiting in &mut self.waiting {
            waiting.breakpoint.count = waiting.sure;
        }
        self.notes.split_off(self.sure.min(self.notes.len()))
    }

    /// Whether the walk ends because a breakpoint is met at `at`.
    fn meets(&mut self, number: usize, device: &Controller, at: Time) -> bool {
        let Some(waiting) = self.waiting.get_mut(number) else { return false };
        let breakpoint = &mut *waiting.breakpoint;
        if breakpoint.condition.as_ref().is_some_and(|condition| !condition.is_so(device, at)) {
            return false;
        }
        let is_forward = self.way == Way::Forward;
        if is_forward {
            breakpoint.count += 1;
            if !breakpoint.hits.allow(breakpoint.count) {
                return false;
            }
        }
        if let Some(log) = &breakpoint.log {
            if is_forward && self.notes.len() < NOTES_MAX {
                let text = filled(log, device, at);
                let by = breakpoint.id;
                self.notes.push(Note { by, at, text });
            } else {
                self.left_out += u64::from(is_forward);
            }
            return false;
        }
        self.met.push((breakpoint.id, at));
        true
    }
}

/// The open loops of the stored program.
pub(crate) fn loops(device: &Controller) -> Vec<LoopView> {
    let details = device.details();
    details.program().map_or_else(Vec::new, |program| program.loops.clone())
}

/// Whether the stored program runs.
pub(crate) fn is_in_program(device: &Controller) -> bool {
    use vimc4_catalogue::isel::ProgramStatus;
    let details = device.details();
    let status = details.program().map(|program| program.status);
    matches!(status, Some(ProgramStatus::Running | ProgramStatus::Paused))
}

fn events(outputs: &VecDeque<Output>) -> impl Iterator<Item = &Event> + Clone {
    outputs.iter().filter_map(Output::event)
}

/// The line of the file that the output shows to have begun, if any.
fn line_of_source(source: Option<&Source>, outputs: &VecDeque<Output>) -> Option<u32> {
    let source = source?;
    outputs.iter().find_map(|output| match output {
        Output::Event(stamp, Event::Command { .. }) => source.begins_line(stamp.command?),
        _ => None,
    })
}

impl Stepping<'_> {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        match self.unit {
            Unit::Command => stretch.can_have(Kinds::COMMAND),
            Unit::Line | Unit::Loop => stretch.can_have(Kinds::COMMAND),
            Unit::Segment => stretch.can_have(Kinds::MOTION),
            _ => true,
        }
    }

    fn begin(&mut self, device: &Controller) {
        match self.unit {
            Unit::Loop => self.before.loops = loops(device),
            Unit::Step => self.before.position = device.position(device.now()),
            _ => {}
        }
    }

    fn between(&mut self, device: &Controller, until: Time, which: Which) -> Option<Time> {
        if self.unit != Unit::Step {
            return None;
        }
        let found = match which {
            Which::First => first_step(device, Axes::ALL, device.now(), until),
            Which::Last => last_step(device, Axes::ALL, until),
        };
        if found.is_some() {
            let end = Time::from_nanos(until.as_nanos().saturating_sub(1));
            self.before.position = device.position(end);
        }
        found
    }

    fn after(&mut self, device: &Controller, act: Act, outputs: &VecDeque<Output>) -> bool {
        let has_line = || events(outputs).any(|event| matches!(event, Event::Line { .. }));
        match self.unit {
            Unit::Cause | Unit::Time(_) => true,
            Unit::Byte => matches!(act, Act::Byte(_)),
            Unit::Event => events(outputs).next().is_some(),
            Unit::Command => events(outputs).any(|event| matches!(event, Event::Command { .. })),
            Unit::Segment => events(outputs).any(|event| {
                use vimc4_device::Motion;
                matches!(event, Event::Motion(Motion::Begins { .. } | Motion::Ends { .. }))
            }),
            Unit::Line => match self.depth {
                Depth::Into => has_line() || line_of_source(self.source, outputs).is_some(),
                Depth::Over => {
                    line_of_source(self.source, outputs).is_some()
                        || (has_line() && loops(device).len() <= self.open)
                }
                Depth::Out if self.open > 0 => has_line() && loops(device).len() < self.open,
                Depth::Out => !is_in_program(device),
            },
            Unit::Loop => {
                let now = if events(outputs).next().is_some() {
                    loops(device)
                } else {
                    self.before.loops.clone()
                };
                let before = std::mem::replace(&mut self.before.loops, now);
                before != self.before.loops
            }
            Unit::Step => {
                let now = device.position(device.now());
                let before = std::mem::replace(&mut self.before.position, now);
                Axes::ALL.differ(&before, &now)
            }
        }
    }
}

impl Waiting<'_> {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        match &self.breakpoint.trigger {
            Trigger::Condition(condition) => stretch.can_meet(condition),
            Trigger::SourceLine(_) => stretch.can_have(Kinds::COMMAND),
            // A signal that is set is an event, and so is what a fault does to one.
            Trigger::Change(field) => field.signal().is_none_or(|signal| {
                stretch.can_meet(&Condition::SignalChanges { signal, to: None })
                    || stretch.can_have(Kinds::FAULT)
            }),
            Trigger::Expression(_) => true,
        }
    }

    fn begin(&mut self, device: &Controller) {
        match &self.breakpoint.trigger {
            Trigger::Condition(condition) => {
                self.holds = device.crossing(condition) == Some(device.now());
            }
            Trigger::Change(field) => self.value = field.value(device, device.now()),
            Trigger::Expression(expression) => {
                self.holds = expression.is_so(device, device.now());
            }
            Trigger::SourceLine(_) => {}
        }
    }

    /// The instants after `from` and before `until` at which it is met: the first of them, if there
    /// is one.
    fn next(&mut self, device: &Controller, from: Time, until: Time) -> Option<Time> {
        match &self.breakpoint.trigger {
            Trigger::Condition(_) | Trigger::SourceLine(_) | Trigger::Expression(_) => None,
            Trigger::Change(field) => {
                let axis = field.axis()?;
                let at = first_step(device, Axes::only(axis), from, until)?;
                self.value = device.position(at)[axis].into();
                Some(at)
            }
        }
    }

    fn after(&mut self, device: &Controller, act: Act, outputs: &VecDeque<Output>) -> bool {
        let now = device.now();
        match &self.breakpoint.trigger {
            Trigger::Condition(condition) => {
                let before = self.holds;
                self.holds = device.crossing(condition) == Some(now);
                let happened =
                    || condition.has_happenings() && device.holds(condition, events(outputs));
                !before && (self.holds || happened())
            }
            Trigger::SourceLine(line) => line_of_source(self.source, outputs) == Some(*line),
            Trigger::Change(field) => {
                // A byte that is only received changes nothing outside the controller.
                let is_received = matches!(act, Act::Byte(byte) if !device.is_urgent(byte));
                if is_received && field.is_outside() {
                    return false;
                }
                let value = field.value(device, now);
                let before = std::mem::replace(&mut self.value, value);
                before != self.value
            }
            Trigger::Expression(expression) => {
                let before = self.holds;
                self.holds = expression.is_so(device, now);
                !before && self.holds
            }
        }
    }
}

/// Where a breakpoint is met next while time passes.
enum Coming<'c> {
    Condition(Beginnings<'c, Controller>),
    Steps(Time),
    /// An expression is evaluated in the next of the parts into which the time is divided.
    Parts(u64),
}

impl Walk<'_> {
    /// Goes through the instants between two acts at which breakpoints are met, in order.
    fn met_between(&mut self, device: &Controller, until: Time, which: Which) -> Option<Time> {
        let conditions = std::mem::take(&mut self.conditions);
        let mut coming: Vec<Coming<'_>> = self
            .waiting
            .iter()
            .zip(&conditions)
            .map(|(waiting, condition)| match (condition, &waiting.breakpoint.trigger) {
                (Some(condition), _) => {
                    Coming::Condition(Beginnings::new(device, condition, waiting.holds, until))
                }
                (None, Trigger::Expression(_)) => Coming::Parts(0),
                (None, _) => Coming::Steps(device.now()),
            })
            .collect();
        let mut next: Vec<Option<Time>> = Vec::with_capacity(coming.len());
        for (number, coming) in coming.iter_mut().enumerate() {
            next.push(self.advance(number, coming, device, until));
        }
        let mut found = None;
        let mut instants = 0;
        let mut last = None;
        loop {
            let times = next.iter().enumerate();
            let first = times.filter_map(|(number, at)| Some((at.as_ref()?, number))).min();
            let Some((at, number)) = first.map(|(at, number)| (*at, number)) else { break };
            // Breakpoints met at one instant are handled together.
            if instants >= INSTANTS_MAX && last.is_some_and(|last| last < at) {
                self.looked_until = last;
                break;
            }
            instants += 1;
            last = Some(at);
            if self.meets(number, device, at) {
                // All breakpoints met at the same instant are reported.
                if which == Which::First && found.is_some_and(|before| before < at) {
                    break;
                }
                self.met.retain(|(_, met)| *met == at);
                found = Some(at);
            }
            next[number] = self.advance(number, &mut coming[number], device, until);
            let is_over = next.iter().flatten().all(|next| found.is_some_and(|at| *next > at));
            if which == Which::First && found.is_some() && is_over {
                break;
            }
        }
        for (waiting, coming) in self.waiting.iter_mut().zip(&coming) {
            if let Coming::Condition(beginnings) = coming {
                waiting.holds = beginnings.holds();
            }
        }
        self.conditions = conditions;
        found
    }

    fn advance(
        &mut self,
        number: usize,
        coming: &mut Coming<'_>,
        device: &Controller,
        until: Time,
    ) -> Option<Time> {
        match coming {
            Coming::Condition(beginnings) => beginnings.next(),
            Coming::Parts(part) => self.waiting.get_mut(number)?.next_part(device, part, until),
            Coming::Steps(from) => {
                let waiting = self.waiting.get_mut(number)?;
                if self.way == Way::Back && waiting.breakpoint.condition.is_none() {
                    return waiting.last(device, from, until);
                }
                let at = waiting.next(device, *from, until)?;
                *from = at;
                Some(at)
            }
        }
    }
}

impl Waiting<'_> {
    /// The next instant before `until` at which an expression becomes true, provided that it is
    /// still true at the end of one of the parts of a motion: what begins and ends within a part is
    /// not seen. While nothing moves, no expression changes.
    fn next_part(&mut self, device: &Controller, part: &mut u64, until: Time) -> Option<Time> {
        /// The number of parts that are looked at.
        const PARTS: u64 = 32;
        let Trigger::Expression(expression) = &self.breakpoint.trigger else { return None };
        device.running()?;
        let from = device.now();
        let last = until.as_nanos().checked_sub(1).filter(|last| *last > from.as_nanos())?;
        let nanos = u128::from(last - from.as_nanos());
        // A part of a span is not longer than it.
        let end_of = |part: u64| {
            let nanos = nanos * u128::from(part) / u128::from(PARTS);
            from.after_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
        };
        while *part < PARTS {
            let (mut low, mut high) = (end_of(*part), end_of(*part + 1));
            *part += 1;
            let before = std::mem::replace(&mut self.holds, expression.is_so(device, high));
            if before || !self.holds || high == low {
                continue;
            }
            while high.nanos_since(low) > 1 {
                let middle = low.after_nanos(high.nanos_since(low) / 2);
                if expression.is_so(device, middle) {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            return Some(high);
        }
        None
    }

    /// The last step of the counter is enough: going back, earlier ones do not matter.
    fn last(&mut self, device: &Controller, from: &mut Time, until: Time) -> Option<Time> {
        let Trigger::Change(field) = &self.breakpoint.trigger else { return None };
        let axis = field.axis()?;
        if *from == until {
            return None;
        }
        *from = until;
        let at = last_step(device, Axes::only(axis), until)?;
        self.value = device.position(at)[axis].into();
        Some(at)
    }
}

impl Sought<Wired> for Walk<'_> {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        self.step.as_ref().is_some_and(|step| step.can_be_in(stretch))
            || self.waiting.iter().any(|waiting| waiting.can_be_in(stretch))
            || (self.problems.is_some() && Problems::can_be_in(stretch))
    }

    fn begin(&mut self, device: &Wired) {
        let device = device.device();
        if let Some(step) = &mut self.step {
            step.begin(device);
        }
        for waiting in &mut self.waiting {
            waiting.begin(device);
        }
        self.is_sure();
    }

    fn between(&mut self, device: &Wired, until: Time, which: Which) -> Option<Time> {
        self.looked_until = None;
        let device = device.device();
        let stepped = self.step.as_mut().and_then(|step| step.between(device, until, which));
        if self.waiting.is_empty() {
            self.is_step |= stepped.is_some();
            return stepped;
        }
        let met = self.met_between(device, until, which);
        let stepped = stepped.filter(|at| self.looked_until.is_none_or(|until| *at <= until));
        let instants = stepped.into_iter().chain(met);
        let found = match which {
            Which::First => instants.min(),
            Which::Last => instants.max(),
        };
        if found.is_some() {
            self.is_step = found == stepped;
        }
        found
    }

    fn looked_until(&mut self) -> Option<Time> {
        self.looked_until.take()
    }

    fn after(&mut self, device: &Wired, act: Act, outputs: &VecDeque<Output>) -> bool {
        if let Some(problems) = &mut self.problems {
            problems.saw(outputs);
        }
        let device = device.device();
        let is_step = self.step.as_mut().is_some_and(|step| step.after(device, act, outputs));
        let mut found = is_step;
        for number in 0..self.waiting.len() {
            if self.waiting[number].after(device, act, outputs)
                && self.meets(number, device, device.now())
            {
                if !found {
                    self.met.retain(|(_, at)| *at == device.now());
                }
                found = true;
            }
        }
        if found {
            self.is_step = is_step;
        }
        self.is_sure();
        found
    }

    fn at_the_beginning(&mut self, _: &Wired) -> bool {
        // Stepping back reaches the beginning, but nothing happens there.
        self.is_step |= self.step.is_some();
        self.step.is_some()
    }
}
