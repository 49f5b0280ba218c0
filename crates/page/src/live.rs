//! A controller that lives in the time that is passed in.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use vimc4_answers::feed::{Ear, Feed};
use vimc4_catalogue::{Controller, Machine, Model, State};
use vimc4_device::{
    Condition, Deed, Device, Event, Forecast, Foresight, Input, Kinds, Line, LineState, MAX_CAUSES,
    Names, OwnedInput, Time,
};
use vimc4_journal::Picture;
use vimc4_session::{
    Clock, ControlError, Effect, EventFilter, Report, ReportKind, Session, SessionOutput, Sink,
    Source, Step, Work,
};

use crate::kept::{Kept, bare, given, kept, meant};
use crate::recorder::Recorder;

/// How many things are done before the page has its turn again.
const BATCH: u32 = 20_000;

/// How many things are done, or looked ahead to, for a request for a time or a condition.
const FORESIGHT: u32 = 2_000_000;

/// How many pieces that were sent on the line wait at most to be taken.
const UNTAKEN: usize = 10_000;

/// The source of all that is done here.
pub(crate) fn page() -> Source {
    Source::Controls("the page".into())
}

/// An input that was typed in the debugger, which the controller has just carried out.
fn input_of_debugger(line: &mut Kept) -> Option<(OwnedInput, Source)> {
    given(line).map(|input| (input, page()))
}

/// A controller at its line, and the watchers of its session.
pub(crate) struct Live {
    pub(crate) model: Model,
    pub(crate) machine: Arc<Machine>,
    pub(crate) names: Names,
    pub(crate) session: Session<Kept>,
    pub(crate) feed: Arc<Feed>,
    /// The bytes that left on the line, and when.
    pub(crate) sent: VecDeque<(Time, Bytes)>,
    ear: Ear,
    recorder: Option<Recorder>,
    has_begun: bool,
}

impl Live {
    pub(crate) fn new(
        model: Model,
        machine: Arc<Machine>,
        line: Line<Controller>,
        clock: Clock,
    ) -> Live {
        let line = kept(line);
        let names = model.names(line.signals()).with_scales(machine.scales());
        let feed = Feed::new(Arc::new(|| {}));
        feed.begin(Picture::of(&line));
        let session = Session::new(line, clock).with_inputs_of_device(input_of_debugger);
        let (sent, ear) = (VecDeque::new(), feed.sink());
        let (recorder, has_begun) = (None, false);
        let mut live =
            Live { model, machine, names, session, feed, sent, ear, recorder, has_begun };
        live.watch();
        live.session.settle();
        live.flush();
        live
    }

    pub(crate) fn now(&self) -> Time {
        self.session.now()
    }

    pub(crate) fn line(&self) -> &Kept {
        self.session.device()
    }

    // --- the outputs of the session ---

    /// Does something with the session, at a moment of the page, after everything that is due by then.
    pub(crate) fn request<T>(
        &mut self,
        moment: u64,
        work: impl FnOnce(&mut Session<Kept>, Duration) -> T,
    ) -> T {
        self.catch_up(moment);
        let result = work(&mut self.session, Duration::from_nanos(moment));
        self.flush();
        result
    }

    /// Hands out the outputs of the session.
    pub(crate) fn flush(&mut self) {
        while let Some(output) = self.session.poll_output() {
            match output {
                SessionOutput::Report(at, what, meaning) => self.report(at, what, meaning),
                SessionOutput::Bytes(at, bytes) => self.send(at, bytes),
                SessionOutput::Store(_) | SessionOutput::Settled => {}
            }
        }
    }

    fn report(&mut self, at: Time, what: ReportKind, meaning: Option<String>) {
        let report = Report { controller: "1".into(), at, what };
        let Live { session, ear, recorder, .. } = self;
        let meaning = match &report.what {
            ReportKind::Event { command: Some(number), event: Event::Command { .. } } => {
                meant(session.device_mut(), *number).or(meaning)
            }
            _ => meaning,
        };
        let line = session.device();
        let explain = |command: &[u8]| meaning.clone().unwrap_or_else(|| line.explain(command));
        if matches!(report.what, ReportKind::Event { .. } | ReportKind::News(_)) {
            ear.report(&report, &explain);
        }
        if let Some(recorder) = recorder {
            recorder.report(&report);
        }
    }

    /// The bytes of one instant leave in one piece.
    fn send(&mut self, at: Time, bytes: Bytes) {
        self.report(at, ReportKind::Sent { bytes: bytes.clone() }, None);
        match self.sent.back_mut() {
            Some((last, piece)) if *last == at => *piece = [&piece[..], &bytes[..]].concat().into(),
            _ => self.sent.push_back((at, bytes)),
        }
        if self.sent.len() > UNTAKEN {
            self.sent.pop_front();
        }
    }

    fn watch(&mut self) {
        let inputs = self.recorder.is_some();
        self.session.set_wants(Some(EventFilter { kinds: Kinds::ALL, inputs, sent: false }));
    }

    /// Everything is recorded from now on.
    pub(crate) fn record(&mut self) {
        let recorder = Recorder::begin(&self.model, &self.machine, self.line(), self.names.clone());
        self.recorder = Some(recorder);
        self.watch();
        for what in self.session.beginning() {
            self.report(self.now(), what, None);
        }
    }

    /// The recording, if there is one.
    pub(crate) fn recorder(&self) -> Option<&Recorder> {
        self.recorder.as_ref()
    }

    /// Ends the recording. Returns whether there was one.
    pub(crate) fn end_recording(&mut self) -> bool {
        let was_there = self.recorder.take().is_some();
        self.watch();
        was_there
    }

    // --- time ---

    /// Time runs from this moment of the page on, if it has not begun before.
    pub(crate) fn begin(&mut self, moment: u64) {
        if !std::mem::replace(&mut self.has_begun, true) {
            self.session.start(Duration::from_nanos(moment));
            self.flush();
        }
    }

    /// Does what is due by a moment of the page, and gives way to the page after many things.
    pub(crate) fn catch_up(&mut self, moment: u64) -> bool {
        let wall = Duration::from_nanos(moment);
        for _ in 0..BATCH {
            let work = match self.session.clock() {
                Clock::Instant => self.session.jump(),
                _ => self.session.catch_up(wall),
            };
            self.flush();
            if work == Work::Idle || self.session.is_paused() {
                return false;
            }
        }
        // The page does not make up for what cannot be done in time.
        self.session.restart_clock(wall);
        true
    }

    pub(crate) fn pause(&mut self) {
        self.pause_by(page());
    }

    /// Pauses time, unless it is paused.
    pub(crate) fn pause_by(&mut self, by: Source) {
        if !self.session.is_paused() {
            self.session.pause_here(by);
            self.flush();
        }
    }

    pub(crate) fn act(&mut self, moment: u64, deed: Deed) -> Result<Effect, ControlError> {
        self.request(moment, |session, wall| session.act(wall, &page(), deed))
    }

    /// Lets time pass by a span, whatever the clock says.
    pub(crate) fn advance(&mut self, moment: u64, span: Duration) -> Result<Time, ControlError> {
        self.advance_to(moment, self.now() + span)
    }

    /// Lets time pass until a condition holds.
    pub(crate) fn run_until(
        &mut self,
        moment: u64,
        condition: Condition,
    ) -> Result<Time, ControlError> {
        if self.session.is_paused() {
            return Err(ControlError::Paused);
        }
        let at = match condition {
            Condition::At(at) if at >= self.now() => at,
            condition => {
                let mut ahead = Line::ideal(bare(self.line()).clone());
                ahead.restore(self.line().state());
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
        self.advance_to(moment, at)
    }

    fn advance_to(&mut self, moment: u64, to: Time) -> Result<Time, ControlError> {
        if self.session.is_paused() {
            return Err(ControlError::Paused);
        }
        let has_arrived = self.pass_to(to, FORESIGHT);
        let wall = Duration::from_nanos(moment);
        self.session.restart_clock(wall);
        let (now, is_paused) = (self.now(), self.session.is_paused());
        // Where it was paused on the way, something may be left to do at this instant.
        if !is_paused {
            self.session.give(wall, &page(), Input::Wake);
            self.flush();
        }
        match has_arrived || is_paused {
            true => Ok(now),
            false => Err(ControlError::Unforeseen { until: now }),
        }
    }

    /// Does what is due by a time, but only so many things. Returns whether it has arrived.
    fn pass_to(&mut self, to: Time, most: u32) -> bool {
        for _ in 0..most {
            let has_arrived = self.session.advance_towards(to);
            self.flush();
            if has_arrived || self.session.is_paused() {
                return has_arrived;
            }
        }
        false
    }

    // --- what the debugger or a recording has done before it ---

    /// Does the next thing by then. Returns whether there was one.
    pub(crate) fn follow(&mut self, to: Time) -> bool {
        let step = self.session.perform_by(to);
        self.flush();
        step != Step::Time || self.now() < to
    }

    /// It has come to where the debugger is.
    pub(crate) fn arrive(&mut self, at: Time) {
        self.session.arrive(at);
        self.flush();
    }

    /// Its state is another one than at this time.
    pub(crate) fn is_elsewhere(&mut self, at: Time, by: &Source) {
        self.session.state_changed(by, at);
        self.flush();
    }

    /// Goes on from another state, as a recorded controller did.
    pub(crate) fn replay_state(&mut self, by: &Source, state: LineState<State>) {
        let at = self.now();
        self.session.device_mut().restore(state);
        self.is_elsewhere(at, by);
    }

    /// Lets time pass up to a recorded time.
    pub(crate) fn replay_to(&mut self, at: Time) {
        while !self.pass_to(at, BATCH) && !self.session.is_paused() {}
    }

    /// Gives a recorded input at its time. Its consequences follow at once, unless the recorded
    /// controller was led cause by cause.
    pub(crate) fn replay(&mut self, at: Time, input: &OwnedInput, by: &Source, is_led: bool) {
        self.replay_to(at);
        if *input == OwnedInput::Wake {
            return;
        }
        match is_led {
            true => self.session.accept(at, by, input.as_input()),
            false => self.session.give(Duration::ZERO, by, input.as_input()),
        }
        self.flush();
    }

    /// Goes to where a recorded controller stood: everything due before this instant is done, and so
    /// many causes due at it, or all.
    pub(crate) fn replay_into(&mut self, at: Time, causes: Option<u32>) {
        let Some(causes) = causes else { return self.replay_to(at) };
        if let Some(before) = at.as_nanos().checked_sub(1).map(Time::from_nanos)
            && before > self.now()
        {
            self.replay_to(before);
        }
        for _ in 0..causes {
            self.follow(at);
        }
    }
}
