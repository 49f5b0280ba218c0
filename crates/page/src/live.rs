//! A controller that lives in the time that is passed in.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use vimc4_answers::feed::{Ear, Feed};
use vimc4_catalogue::{Controller, Machine, Model, State};
use vimc4_device::{
    Condition, Deed, Device, Event, Fault, FaultNumber, Faulting, Forecast, Foresight, Input,
    Kinds, Line, LineState, MAX_CAUSES, Names, Output, OwnedInput, Ruling, Scenario,
    ScenarioNumber, Stamp, Time,
};
use vimc4_journal::Picture;
use vimc4_session::{
    BreakpointId, Breakpoints, Clock, ControlError, Effect, NO_MORE_FAULTS, NO_MORE_RULES, News,
    Pause, Report, Sink, Source, Step, What, why_without_effect,
};

use crate::kept::{Kept, bare, given, kept, meant};
use crate::pace::Pace;
use crate::recorder::{Recorder, written};

/// So many things are done before the page has its turn again.
const BATCH: u32 = 20_000;

/// What was sent on the line and nobody has taken yet: so many pieces at most.
const UNTAKEN: usize = 10_000;

/// Who does all this.
pub(crate) fn page() -> Source {
    Source::Controls("the page".into())
}

/// An input that waits, and its source.
struct Waits {
    input: OwnedInput,
    by: Source,
}

/// A controller at its line, with all that watches it.
pub(crate) struct Live {
    pub(crate) model: Model,
    pub(crate) machine: Arc<Machine>,
    pub(crate) names: Names,
    pub(crate) line: Kept,
    pub(crate) feed: Arc<Feed>,
    pub(crate) breakpoints: Breakpoints,
    /// What left on the line, and when.
    pub(crate) sent: VecDeque<(Time, Bytes)>,
    pub(crate) pace: Pace,
    ear: Ear,
    pub(crate) recorder: Option<Recorder>,
    pause: Option<Pause>,
    pending: VecDeque<Waits>,
    /// How often something was sent or stored.
    said: u64,
    /// How many bytes have come since the power was taken away; `None` while it is on.
    unheard: Option<u64>,
    /// How many causes have been performed at an instant, since an input or since that was told.
    performed: (Time, u32),
}

impl Live {
    pub(crate) fn new(
        model: Model,
        machine: Arc<Machine>,
        line: Line<Controller>,
        clock: Clock,
    ) -> Live {
        let mut line = kept(line);
        line.watch(Kinds::ALL);
        let names = model.names(line.signals()).with_scales(machine.scales());
        let feed = Feed::new(Arc::new(|| {}));
        feed.begin(Picture::of(&line));
        let (ear, pace) = (feed.sink(), Pace::new(clock, line.now()));
        let mut live = Live {
            model,
            machine,
            names,
            line,
            feed,
            breakpoints: Breakpoints::default(),
            sent: VecDeque::new(),
            pace,
            ear,
            recorder: None,
            pause: None,
            pending: VecDeque::new(),
            said: 0,
            unheard: None,
            performed: (Time::ZERO, 0),
        };
        live.look_for_power();
        live.pass_on();
        live
    }

    pub(crate) fn now(&self) -> Time {
        self.line.now()
    }

    pub(crate) fn controller(&self) -> &Controller {
        bare(&self.line)
    }

    // --- what is told ---

    fn tell(&mut self, at: Time, what: What) {
        let report = Report { controller: "1".into(), at, what };
        let Live { line, ear, recorder, .. } = self;
        let meaning = match &report.what {
            What::Event { command: Some(number), event: Event::Command { .. } } => {
                meant(line, *number)
            }
            _ => None,
        };
        let explain = |command: &[u8]| meaning.clone().unwrap_or_else(|| line.explain(command));
        if matches!(report.what, What::Event { .. } | What::News(_)) {
            ear.report(&report, &explain);
        }
        if let Some(recorder) = recorder {
            recorder.report(&report);
        }
    }

    pub(crate) fn tell_news(&mut self, at: Time, news: News) {
        self.tell(at, What::News(news));
    }

    /// Passes on what has come out. Returns the events among it.
    fn pass_on(&mut self) -> Vec<Event> {
        let outputs: Vec<Output> = std::iter::from_fn(|| self.line.poll_output()).collect();
        let events = outputs.iter().filter_map(Output::event).cloned().collect();
        for output in outputs {
            match output {
                Output::Bytes(at, bytes) => self.send(at, bytes),
                Output::Flash(..) => self.said += 1,
                Output::Event(Stamp { at, command }, event) => {
                    self.tell(at, What::Event { command, event });
                }
            }
        }
        events
    }

    /// What is sent at one instant leaves in one piece.
    fn send(&mut self, at: Time, bytes: Bytes) {
        self.said += 1;
        self.tell(at, What::Sent { bytes: bytes.clone() });
        match self.sent.back_mut() {
            Some((last, piece)) if *last == at => *piece = [&piece[..], &bytes[..]].concat().into(),
            _ => self.sent.push_back((at, bytes)),
        }
        if self.sent.len() > UNTAKEN {
            self.sent.pop_front();
        }
    }

    /// All that came of something has been told: where the controller is led cause by cause, how far it
    /// has come.
    fn settle(&mut self) {
        if self.recorder.is_none() || !self.is_led() {
            return;
        }
        let (now, left) = (self.now(), self.is_anything_due());
        let (at, causes) = std::mem::replace(&mut self.performed, (now, 0));
        let causes = left.then_some(if at == now { causes } else { 0 });
        self.tell(now, What::Stands { causes });
    }

    fn is_led(&self) -> bool {
        self.pause.is_some() || !self.breakpoints.is_empty()
    }

    /// Everything is recorded from now on.
    pub(crate) fn record(&mut self) {
        let Live { model, machine, line, names, .. } = self;
        self.recorder = Some(Recorder::begin(model, machine, line, names.clone()));
        let state = written(&self.line);
        self.tell(self.now(), What::State { by: None, state });
        self.performed = (self.now(), 0);
        self.settle();
    }

    // --- time ---

    /// The time that its clock shows at a moment of the page, or its own while it stands still.
    fn present(&self, moment: u64) -> Time {
        let now = self.now();
        match self.pause {
            Some(_) => now,
            None => self.pace.time_at(moment).map_or(now, |at| at.max(now)),
        }
    }

    /// The page shows what happens, from this moment on if it has not done so before: so long time has
    /// stood still.
    pub(crate) fn begin(&mut self, moment: u64) {
        self.pace.begin(moment, self.now());
    }

    /// Does what is due by a moment of the page. Returns whether there is more to be done at once.
    pub(crate) fn catch_up(&mut self, moment: u64) -> bool {
        if self.pause.is_some() {
            return false;
        }
        let to = if self.pace.jumps() { Time::NEVER } else { self.present(moment) };
        let is_there = self.run_to(to, BATCH);
        if self.performed.1 > 0 {
            self.settle();
        }
        if !is_there && self.pause.is_none() {
            // What cannot be done in time is not made up for.
            self.pace.restart(moment, self.now());
        }
        !is_there && self.pause.is_none()
    }

    /// Does what is due by then, but so many things at most. Returns whether it has arrived.
    fn run_to(&mut self, to: Time, most: u32) -> bool {
        for _ in 0..most {
            match self.next_moment() {
                Some(due) if due <= to => {
                    self.moment_at(due);
                }
                _ => {
                    if to != Time::NEVER && to > self.now() {
                        self.line.accept(Input::Wake, to);
                        self.pass_on();
                    }
                    return true;
                }
            };
            if self.pause.is_some() {
                return false;
            }
        }
        false
    }

    /// The next instant at which something happens, or the controller has to be looked at.
    fn next_moment(&self) -> Option<Time> {
        let now = self.now();
        let look = self.breakpoints.due().filter(|at| *at > now);
        self.line.wake().into_iter().chain(look).min().filter(|at| *at != Time::NEVER)
    }

    /// Does the next thing that is due by then, or lets time pass up to it. Returns which it was.
    fn moment_at(&mut self, due: Time) -> Step {
        let has_acted = self.line.perform(due);
        let step = match given(&mut self.line) {
            Some(input) => {
                self.tell_input(self.now(), input, &page());
                self.performed = (self.now(), 0);
                Step::Input
            }
            None if has_acted => {
                self.count_cause();
                Step::Cause
            }
            None => {
                self.line.accept(Input::Wake, due);
                Step::Time
            }
        };
        self.look();
        step
    }

    /// Does the next thing by then that the debugger has done before it. Returns whether there was one.
    pub(crate) fn follow(&mut self, to: Time) -> bool {
        let due = self.next_moment().map_or(to, |due| due.min(to));
        self.moment_at(due) != Step::Time || due < to
    }

    /// It has come to where the debugger is.
    pub(crate) fn arrive(&mut self, at: Time) {
        if at > self.now() {
            self.line.accept(Input::Wake, at);
        }
        self.pass_on();
        self.settle();
    }

    fn count_cause(&mut self) {
        let now = self.now();
        let (at, causes) = self.performed;
        self.performed = (now, if at == now { causes + 1 } else { 1 });
    }

    /// Passes on what has come out, and pauses time where a breakpoint is met.
    fn look(&mut self) {
        let events = self.pass_on();
        if self.breakpoints.is_empty() {
            return;
        }
        let met = self.breakpoints.look(&self.line, events.iter());
        if !met.is_empty() {
            let (by, breakpoints) = met.pause();
            self.begin_pause(by, breakpoints);
        }
    }

    /// Lets time pass by so much, whatever the clock says.
    pub(crate) fn advance(&mut self, moment: u64, span: Duration) -> Result<Time, ControlError> {
        self.journey_to(moment, self.now() + span)
    }

    /// Lets time pass until a condition holds.
    pub(crate) fn run_until(
        &mut self,
        moment: u64,
        condition: Condition,
    ) -> Result<Time, ControlError> {
        if self.pause.is_some() {
            return Err(ControlError::Paused);
        }
        let at = match condition {
            Condition::At(at) if at >= self.now() => at,
            condition => {
                let mut ahead = Line::ideal(self.controller().clone());
                ahead.restore(self.line.state());
                let mut forecast = Forecast::new(&ahead, condition);
                match forecast.look(MAX_CAUSES.min(FORESIGHT)) {
                    Foresight::At(at) => at,
                    Foresight::Never => return Err(ControlError::Never),
                    Foresight::Open => {
                        return Err(ControlError::Unforeseen { until: forecast.now() });
                    }
                }
            }
        };
        self.journey_to(moment, at)
    }

    fn journey_to(&mut self, moment: u64, to: Time) -> Result<Time, ControlError> {
        if self.pause.is_some() {
            return Err(ControlError::Paused);
        }
        let is_there = self.run_to(to, FORESIGHT);
        let now = self.now();
        self.pace.restart(moment, now);
        // Where it was paused on the way, something may be left to be done at this instant.
        if self.pause.is_none() {
            self.tell(now, What::Input { by: page(), input: OwnedInput::Wake });
        }
        self.settle();
        match is_there || self.pause.is_some() {
            true => Ok(now),
            false => Err(ControlError::Unforeseen { until: now }),
        }
    }

    /// From now on time runs as this clock says.
    pub(crate) fn set_clock(&mut self, moment: u64, clock: Clock) {
        self.catch_up(moment);
        self.pace.clock = clock;
        self.pace.restart(moment, self.now());
    }

    // --- a pause ---

    pub(crate) fn paused(&self) -> Option<&Pause> {
        self.pause.as_ref()
    }

    pub(crate) fn pause(&mut self, by: Source) -> Time {
        if self.pause.is_none() {
            self.begin_pause(Some(by), Vec::new());
            self.settle();
        }
        self.now()
    }

    fn begin_pause(&mut self, by: Option<Source>, breakpoints: Vec<BreakpointId>) {
        let at = self.now();
        self.tell_news(at, News::Paused { by: by.clone(), breakpoints: breakpoints.clone() });
        self.pause = Some(Pause { at, by, breakpoints });
    }

    /// Time goes on, beginning with what is left at this instant. That may pause it again.
    pub(crate) fn resume(&mut self, moment: u64, by: &Source) -> Result<Time, ControlError> {
        if self.pause.take().is_none() {
            return Err(ControlError::NotPaused);
        }
        let now = self.now();
        self.tell_news(now, News::Resumed { by: by.clone() });
        self.run_to(now, BATCH);
        self.give_pending();
        if !self.is_led() {
            self.tell(self.now(), What::Goes);
        }
        self.settle();
        self.pace.restart(moment, self.now());
        Ok(self.now())
    }

    /// Does one thing while time is paused: what is due now, or else an input that has waited behind it,
    /// or else the next thing.
    pub(crate) fn step(&mut self) -> Result<Step, ControlError> {
        if self.pause.is_none() {
            return Err(ControlError::NotPaused);
        }
        let step = if self.is_anything_due() {
            self.moment_at(self.now())
        } else if let Some(Waits { input, by }) = self.pending.pop_front() {
            self.accept(input, self.now(), &by);
            Step::Input
        } else if let Some(due) = self.next_moment() {
            self.moment_at(due)
        } else {
            Step::Rest
        };
        self.settle();
        Ok(step)
    }

    fn is_anything_due(&self) -> bool {
        self.line.wake().is_some_and(|due| due <= self.now())
    }

    pub(crate) fn break_when(&mut self, condition: Condition) -> BreakpointId {
        let id = self.breakpoints.add(&self.line, condition);
        self.settle();
        id
    }

    /// Returns whether it was there.
    pub(crate) fn remove_breakpoint(&mut self, id: BreakpointId) -> bool {
        let was_there = self.breakpoints.remove(id);
        if was_there && !self.is_led() {
            self.tell(self.now(), What::Goes);
        }
        was_there
    }

    // --- what is done to it ---

    fn input(&mut self, input: OwnedInput, at: Time, by: &Source) {
        if self.pause.is_some() {
            self.pending.push_back(Waits { input, by: by.clone() });
            return self.give_pending();
        }
        self.run_to(at, BATCH);
        if self.pause.is_some() {
            return self.pending.push_back(Waits { input, by: by.clone() });
        }
        self.accept(input, at, by);
        self.run_to(at, BATCH);
    }

    /// Gives what has waited, as long as nothing is due before it.
    fn give_pending(&mut self) {
        while !self.is_anything_due()
            && let Some(Waits { input, by }) = self.pending.pop_front()
        {
            self.accept(input, self.now(), &by);
        }
    }

    /// What was given to it and waits until what is due before it is done.
    pub(crate) fn waiting(&self) -> impl Iterator<Item = &OwnedInput> {
        self.pending.iter().map(|waits| &waits.input)
    }

    fn accept(&mut self, input: OwnedInput, at: Time, by: &Source) {
        self.tell_input(at, input.clone(), by);
        self.line.accept(input.as_input(), at);
        self.performed = (self.now(), 0);
        self.look();
    }

    fn tell_input(&mut self, at: Time, input: OwnedInput, by: &Source) {
        self.tell(at, What::Input { by: by.clone(), input: input.clone() });
        match (&input, &mut self.unheard) {
            (OwnedInput::Bytes(bytes), Some(unheard)) => *unheard += bytes.len() as u64,
            (OwnedInput::Power(true), Some(unheard)) => {
                let bytes = std::mem::take(unheard);
                self.unheard = None;
                if bytes > 0 {
                    self.tell_news(at, News::PowerWasOff { bytes });
                }
            }
            (OwnedInput::Power(false), None) => self.unheard = Some(0),
            _ => {}
        }
    }

    /// Sends bytes as the host does. Those that act at once are told of, and what comes of them.
    pub(crate) fn hear(&mut self, moment: u64, bytes: &[u8], by: &Source) {
        self.catch_up(moment);
        let at = self.present(moment);
        let mut rest = bytes;
        while let Some(place) = rest.iter().position(|byte| self.line.is_urgent(*byte)) {
            let (before, after) = rest.split_at(place);
            let (urgent, after) = after.split_at(1);
            if !before.is_empty() {
                self.input(OwnedInput::Bytes(Bytes::copy_from_slice(before)), at, by);
            }
            let deed = Deed::Byte(urgent.first().copied().unwrap_or_default());
            self.tell_news(at, News::Deed { by: by.clone(), deed: deed.clone() });
            let state = self.line.state();
            self.input(OwnedInput::Bytes(Bytes::copy_from_slice(urgent)), at, by);
            if self.line.state() == state && self.pause.is_none() {
                let why = match self.unheard {
                    Some(_) => "the power is off",
                    None => "there is nothing that it could end",
                };
                let by = by.clone();
                self.tell_news(at, News::NoEffect { by, deed, why: Some(why.into()) });
            }
            rest = after;
        }
        if !rest.is_empty() {
            self.input(OwnedInput::Bytes(Bytes::copy_from_slice(rest)), at, by);
        }
        self.settle();
    }

    /// Performs a deed, and says whether it has had any effect.
    pub(crate) fn act(
        &mut self,
        moment: u64,
        by: &Source,
        deed: Deed,
    ) -> Result<Effect, ControlError> {
        let inputs = deed.inputs(&self.line.signals())?;
        self.catch_up(moment);
        let at = self.present(moment);
        self.run_to(at, BATCH);
        self.tell_news(at, News::Deed { by: by.clone(), deed: deed.clone() });
        let effect = self.effect(inputs, at, by);
        if let Effect::Nothing { why } = effect {
            let by = by.clone();
            self.tell_news(at, News::NoEffect { by, deed, why: why.map(Cow::Borrowed) });
        }
        Ok(effect)
    }

    /// Gives inputs that are no deed: the device tells of their effect itself.
    pub(crate) fn do_to(&mut self, moment: u64, inputs: Vec<OwnedInput>, by: &Source) -> Effect {
        self.catch_up(moment);
        let at = self.present(moment);
        self.run_to(at, BATCH);
        self.effect(inputs, at, by)
    }

    fn effect(&mut self, inputs: Vec<OwnedInput>, at: Time, by: &Source) -> Effect {
        let (before, said) = (self.line.state(), self.said);
        for input in &inputs {
            self.input(input.clone(), at, by);
        }
        self.settle();
        let has_changed = self.said != said || self.line.state() != before;
        let inputs: Vec<Input<'_>> = inputs.iter().map(OwnedInput::as_input).collect();
        let in_vain = match &*inputs {
            [Input::Fault(Faulting::Begin(_, fault))] if has_changed => {
                self.line.why_in_vain(fault)
            }
            _ => None,
        };
        match has_changed {
            true if in_vain.is_some() => Effect::Nothing { why: in_vain },
            true => Effect::Something,
            false => Effect::Nothing { why: why_without_effect(&self.line, &inputs, at) },
        }
    }

    /// Something goes wrong from now on, with the number that comes back.
    pub(crate) fn fault(
        &mut self,
        moment: u64,
        by: &Source,
        fault: Fault,
    ) -> Result<FaultNumber, ControlError> {
        let faulting = Faulting::Begin(FaultNumber::NEXT, fault);
        let effect = self.act(moment, by, Deed::Fault(Box::new(faulting)))?;
        if effect == (Effect::Nothing { why: Some(NO_MORE_FAULTS) }) {
            return Err(ControlError::Unsupported(NO_MORE_FAULTS));
        }
        // It has the highest number, for it is the latest.
        let numbers = self.line.faults().into_iter().map(|view| view.number);
        let numbers = numbers.filter(|number| *number != FaultNumber::TERMINAL);
        Ok(numbers.max().unwrap_or_default())
    }

    /// Rules begin, with the number that comes back.
    pub(crate) fn scenario(
        &mut self,
        moment: u64,
        by: &Source,
        scenario: Scenario,
    ) -> Result<ScenarioNumber, ControlError> {
        if scenario.rules.is_empty() {
            return Ok(ScenarioNumber::NEXT);
        }
        let ruling = Ruling::Begin(ScenarioNumber::NEXT, scenario);
        let effect = self.do_to(moment, vec![OwnedInput::Rule(ruling)], by);
        if effect == (Effect::Nothing { why: Some(NO_MORE_RULES) }) {
            return Err(ControlError::Unsupported(NO_MORE_RULES));
        }
        let numbers = self.line.rules().into_iter().map(|view| view.id.scenario);
        Ok(numbers.max().unwrap_or_default())
    }

    /// Goes on from another state, whose time becomes the present. A pause stays one.
    pub(crate) fn restore(&mut self, moment: u64, by: &Source, state: LineState<State>) {
        let at = self.now();
        self.line.restore(state);
        self.is_elsewhere(at, by);
        self.pace.restart(moment, self.now());
    }

    /// Its state is another one than at this time.
    pub(crate) fn is_elsewhere(&mut self, at: Time, by: &Source) {
        self.tell_news(at, News::Deed { by: by.clone(), deed: Deed::Restore });
        let state = written(&self.line);
        self.tell(at, What::State { by: Some(by.clone()), state });
        self.breakpoints.begin(&self.line);
        self.pending.clear();
        self.performed = (self.now(), 0);
        self.look_for_power();
        self.settle();
    }

    /// Lets time pass up to what was recorded then.
    pub(crate) fn replay_to(&mut self, at: Time) {
        while !self.run_to(at, BATCH) && self.pause.is_none() {}
    }

    /// Gives what was recorded, at its time. What comes of it at once is done now, or, where the controller was
    /// led cause by cause, when it is recorded.
    pub(crate) fn replay(&mut self, at: Time, input: OwnedInput, by: &Source, is_led: bool) {
        self.replay_to(at);
        if input == OwnedInput::Wake {
            return;
        }
        match is_led {
            true => self.accept(input, at, by),
            false => self.input(input, at, by),
        }
    }

    /// Goes to where the recorded controller stood: all is done that is due before this instant, and so many
    /// more causes of those due at it, or all of them.
    pub(crate) fn replay_into(&mut self, at: Time, causes: Option<u32>) {
        let Some(causes) = causes else { return self.replay_to(at) };
        if let Some(before) = at.as_nanos().checked_sub(1).map(Time::from_nanos)
            && before > self.now()
        {
            self.replay_to(before);
        }
        for _ in 0..causes {
            self.moment_at(at);
        }
    }

    fn look_for_power(&mut self) {
        let is_on = self.line.view(self.now()).powered;
        self.unheard = (!is_on).then_some(0);
    }
}

/// So many things are done, or looked ahead to, for somebody who asks for a time or a condition.
const FORESIGHT: u32 = 2_000_000;
