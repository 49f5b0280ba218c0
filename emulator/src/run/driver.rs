//! A run of a device in virtual time: its events, and what ends it.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::time::Duration;

use vimc4_catalogue::{Controller, Model};
use vimc4_device::{
    Device, Event, FaultNews, Harness, Input, Kinds, Line, Motion, Output, RuleNews, Ruling,
    Scenario, ScenarioNumber, SignalId, Time, TimedInput, Warning,
};
use vimc4_wave::Pacing;

use super::meter::Meter;
use super::rounds::Rounds;
use super::tape::Tape;
use crate::coverage::Covering;
use crate::drawing::{Drawing, shifts};
use crate::endings::InOrder;
use crate::failure::Failure;
use crate::waves::{Sheets, Waves};

/// Runs a device from cause to cause and takes note of what it does.
pub(crate) struct Driver {
    harness: Harness<Line<Controller>>,
    /// Whether rules may do something that a program going round and round waits for.
    has_rules: bool,
    /// When to stop.
    end: Time,
    /// After how many rounds of a program to stop.
    most_rounds: Option<u64>,
    /// Whether a head goes down and up.
    has_head: bool,
    /// How many of the next bytes belong to answers that are known already.
    answered: usize,
    pub(crate) meter: Meter,
    pub(crate) rounds: Rounds,
    /// Whether somebody asks it to end, if it heeds that.
    ending: Option<InOrder>,
    tape: Option<Tape>,
    covering: Option<Covering>,
    /// Carriage minus counter of each axis when it was switched on.
    shifts: Vec<i64>,
    pub(crate) drawing: Option<Drawing>,
    waves: Option<Waves>,
    /// Events that have not been taken yet.
    pub(crate) news: VecDeque<(Time, News)>,
}

/// Something to be told.
#[derive(Debug)]
pub(crate) enum News {
    /// A command begins, which was sent like this.
    Begun(Vec<u8>),
    /// A line is left alone, and why.
    Ignored(Cow<'static, str>),
    /// A command was answered, and why, if that is an error.
    Answer(Vec<u8>, Option<Box<str>>),
    /// Something was sent that is not an answer.
    Sent(Vec<u8>),
    /// A line of the stored program is executed, counted from 0.
    Line(u32),
    /// Something was lost or assumed.
    Warning(Warning),
    /// A rule or a fault has done something, or a command or a program was cut short.
    Told(String),
}

/// Why nothing goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Halt {
    /// The time is over.
    Time,
    /// The rounds are made.
    Rounds,
    /// The device waits for something that will not happen.
    Waiting,
    /// The program goes round and round and does nothing.
    Idling,
    /// Somebody ends it.
    Interrupted,
}

/// The kinds of events that it takes note of.
const WANTED: Kinds = Kinds::COMMAND
    .and(Kinds::ANSWER)
    .and(Kinds::MOTION)
    .and(Kinds::PORT)
    .and(Kinds::FAULT)
    .and(Kinds::WARNING);

impl Driver {
    pub(crate) fn new(device: Controller, meter: Meter, most_rounds: Option<u64>) -> Driver {
        let shifts = shifts(&device, device.now());
        let mut driver = Driver {
            shifts,
            harness: Harness::new(Line::ideal(device)).watching(WANTED),
            has_rules: false,
            end: Time::NEVER,
            most_rounds,
            has_head: false,
            answered: 0,
            meter,
            rounds: Rounds::default(),
            ending: None,
            tape: None,
            covering: None,
            drawing: None,
            waves: None,
            news: VecDeque::new(),
        };
        driver.has_head = driver.head().is_some();
        driver
    }

    /// Ends when somebody asks for it.
    pub(super) fn heeding(self, ending: InOrder) -> Driver {
        Driver { ending: Some(ending), ..self }
    }

    /// Records everything from now on.
    pub(super) fn recording(mut self, tape: Option<Tape>) -> Driver {
        let Some(mut tape) = tape else { return self };
        tape.begin(self.harness.device());
        self.tape = Some(tape);
        self.harness = self.harness.keeping_given();
        self
    }

    /// Counts what is met from now on.
    pub(super) fn covering(mut self, covering: Option<Covering>) -> Driver {
        self.covering = covering;
        self.watching()
    }

    /// Draws what is done from now on.
    pub(super) fn drawing(mut self, drawing: Option<Drawing>) -> Driver {
        self.drawing = drawing;
        self.watching()
    }

    /// Draws everything from now on as a waveform.
    pub(super) fn waving(
        mut self,
        sheets: Option<Sheets>,
        model: &Model,
    ) -> Result<Driver, Failure> {
        let Some(sheets) = sheets else { return Ok(self) };
        self.waves = Some(sheets.begin(self.harness.device(), model, Pacing::Ideal)?);
        self.harness = self.harness.keeping_given();
        Ok(self.watching())
    }

    /// Watches what somebody wants to know.
    fn watching(mut self) -> Driver {
        let covering = self.covering.as_ref().map_or(Kinds::NONE, |_| Covering::KINDS);
        let drawing = self.drawing.as_ref().map_or(Kinds::NONE, |_| Drawing::KINDS);
        let waves = self.waves.as_ref().map_or(Kinds::NONE, |_| Waves::KINDS);
        self.harness = self.harness.watching(WANTED.and(covering).and(drawing).and(waves));
        self
    }

    /// Ends everything that is written, at this moment.
    ///
    /// # Errors
    ///
    /// If not everything could be written.
    pub(crate) fn close(&mut self) -> Result<(), Failure> {
        let now = self.now();
        self.meter.stop(now);
        self.meter.lost = self.lost(now);
        let why = self.heed().map_or("the run was interrupted", |()| "the run has ended");
        let device = self.harness.device();
        // Each of them, whatever becomes of the others.
        let taped = self.tape.take().map_or(Ok(()), |tape| tape.end(device, why));
        let kept = self.covering.take().map_or(Ok(()), Covering::keep);
        let drawing = self.drawing.take();
        let drawn = drawing.map_or(Ok(()), |drawing| drawing.finish(now, &device.position(now)));
        let waved = self.waves.take().map_or(Ok(()), |waves| waves.finish(now));
        let traced = self.meter.end_trace();
        taped.and(kept).and(drawn).and(waved).and(traced)
    }

    /// The axes, by number, whose counters do not tell where they are: they have lost steps, or the
    /// controller has begun to count anew.
    fn lost(&self, now: Time) -> Vec<usize> {
        let axes = self.device().view(now).axes;
        let lost = axes
            .iter()
            .zip(&self.shifts)
            .filter(|(axis, shift)| !axis.referenced && axis.carriage - axis.position != **shift);
        lost.map(|(axis, _)| usize::from(axis.index)).collect()
    }

    /// Everything is written and said. If somebody has asked for the end, that is the end of the program.
    pub(crate) fn done(self) {
        if let Some(ending) = self.ending {
            ending.done();
        }
    }

    pub(crate) fn device(&self) -> &Line<Controller> {
        self.harness.device()
    }

    pub(crate) fn now(&self) -> Time {
        self.harness.now()
    }

    /// Whether the head is down, if there is one.
    pub(crate) fn head(&self) -> Option<bool> {
        self.device().details().is_head_down()
    }

    /// Whether the device says when a command is completed.
    pub(crate) fn echoes(&self) -> bool {
        self.device().details().says_when_done()
    }

    /// Stops at a time.
    pub(crate) fn stop_at(&mut self, end: Time) {
        self.end = end;
    }

    /// Sets a signal at a time, after what else is set then.
    pub(crate) fn schedule(&mut self, at: Time, signal: SignalId, value: i32) {
        self.harness.plan(at, Input::Signal(signal, value));
    }

    /// Begins a scenario now, after what else is planned for now.
    pub(crate) fn begin(&mut self, scenario: &Scenario) {
        if !scenario.rules.is_empty() {
            self.has_rules = true;
            let ruling = Ruling::Begin(ScenarioNumber::NEXT, scenario.clone());
            self.harness.plan(self.now(), Input::Rule(&ruling));
        }
    }

    /// When the outside world does something next.
    pub(crate) fn next_signal(&self) -> Option<Time> {
        self.harness.planned()
    }

    /// Sends bytes now, after what else happens now.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        if self.next_signal().is_some_and(|at| at <= self.now()) {
            self.rounds.disturbed();
        }
        self.harness.send(bytes);
        self.take_outputs();
    }

    /// Lets happen what happens next: a signal, or what the device does by itself.
    pub(crate) fn advance(&mut self) -> Result<(), Halt> {
        self.heed()?;
        let next = self.harness.due().ok_or(Halt::Waiting)?;
        if next > self.end {
            self.run_to(self.end);
            return Err(Halt::Time);
        }
        if self.next_signal() == Some(next) {
            self.rounds.disturbed();
        }
        self.harness.step().ok_or(Halt::Waiting)?;
        self.take_outputs();
        if self.most_rounds.is_some_and(|most| self.rounds.made() >= most) {
            return Err(Halt::Rounds);
        }
        if self.rounds.is_idling() && self.next_signal().is_none() && !self.has_rules {
            return Err(Halt::Idling);
        }
        Ok(())
    }

    /// Lets this much time pass, with everything that happens in it.
    pub(crate) fn pass(&mut self, time: Duration) -> Result<(), Halt> {
        self.heed()?;
        let until = self.now() + time;
        while self.harness.due().is_some_and(|next| next <= until) {
            self.advance()?;
        }
        self.run_to(until.min(self.end));
        if until > self.end { Err(Halt::Time) } else { Ok(()) }
    }

    /// Whether somebody asks for the end.
    pub(crate) fn heed(&self) -> Result<(), Halt> {
        match self.ending.as_ref().is_some_and(InOrder::is_asked) {
            true => Err(Halt::Interrupted),
            false => Ok(()),
        }
    }

    fn run_to(&mut self, at: Time) {
        self.harness.run_to(at);
        self.take_outputs();
    }

    /// Takes note of what has come out.
    fn take_outputs(&mut self) {
        let given = self.harness.take_given();
        if let Some(waves) = &mut self.waves {
            for TimedInput { at, input } in &given {
                waves.given(*at, input.as_input());
            }
            waves.see(self.harness.device(), self.harness.outputs());
        }
        if let Some(tape) = &mut self.tape {
            tape.note(self.harness.device(), given, self.harness.outputs());
        }
        while let Some(output) = self.harness.take_output() {
            match output {
                Output::Event(stamp, event) => self.take(stamp.at, event),
                Output::Bytes(at, bytes) => {
                    let known = bytes.len().min(self.answered);
                    self.answered -= known;
                    if known < bytes.len() {
                        self.rounds.something_happened();
                        self.news.push_back((at, News::Sent(bytes[known..].to_vec())));
                    }
                }
                Output::Flash(..) => {}
            }
        }
    }

    fn take(&mut self, at: Time, event: Event) {
        if let Some(covering) = &mut self.covering {
            covering.see(&event);
        }
        if let Some(drawing) = &mut self.drawing {
            drawing.see(self.harness.device(), at, &event);
        }
        match event {
            Event::Command { bytes, .. } => {
                self.news.push_back((at, News::Begun(bytes.to_vec())));
            }
            Event::Ignored { why, .. } => self.news.push_back((at, News::Ignored(why))),
            Event::Answer { bytes, why, .. } => {
                self.answered += bytes.len();
                self.news.push_back((at, News::Answer(bytes.to_vec(), why)));
            }
            Event::Line { line, .. } => {
                self.rounds.line(line.saturating_sub(1));
                self.news.push_back((at, News::Line(line)));
            }
            Event::Motion(motion) => {
                self.rounds.something_happened();
                let down = self.has_head
                    && matches!(motion, Motion::Begins { .. })
                    && self.head() == Some(true);
                self.meter.watch(at, motion, down);
            }
            Event::CutShort { why, .. } => {
                self.news.push_back((at, News::Told(format!("cut short: {why}"))));
            }
            Event::Port { .. } => self.rounds.something_happened(),
            Event::Warning(warning) => self.news.push_back((at, News::Warning(warning))),
            Event::Rule { rule, news } if !matches!(news, RuleNews::Begins | RuleNews::Ends) => {
                self.rounds.disturbed();
                self.news.push_back((at, News::Told(format!("rule {rule} {news}"))));
            }
            Event::Fault { number, news: news @ FaultNews::Strikes(_) } => {
                self.news.push_back((at, News::Told(format!("fault {number} {news}"))));
            }
            _ => {}
        }
    }
}
