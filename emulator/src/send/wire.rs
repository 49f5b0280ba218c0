//! A controller at a port, to which a job goes.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use vimc4_catalogue::Handling;
use vimc4_device::{Heard, Identity, Question, Travel, Until};

use crate::job::operator::is_stop;
use crate::job::perform::Link;
use crate::job::unit::{RUN_UP, UNIT, passed, passes_later};
use crate::port::{Port, PortError};

/// How long an answer may take while nothing moves, and before anything has.
const FIRST: Duration = Duration::from_secs(3);
/// How long a line is waited for to fall silent.
const NOISE: Duration = Duration::from_secs(3);
/// How long a line must be silent before an answer of unknown length is over.
const PAUSE: Duration = Duration::from_millis(100);
/// How long a controller may take to come to rest.
const HALTING: Duration = Duration::from_secs(10);
/// Who waits longer for that is told so.
const REMARK: Duration = Duration::from_secs(1);
/// A motion that takes so much longer than in rehearsal is worth a remark.
const LATE: Duration = Duration::from_secs(30);
/// No answer that goes up to a pause is longer, or takes longer: 512 bytes at 1,200 baud.
const LONGEST: usize = 4_096;
const TALK: Duration = Duration::from_secs(6);
/// A motion that ends so much earlier than in rehearsal, and in less than half the time, was none.
const EARLY: Duration = Duration::from_millis(500);
/// How often the bar moves.
const TICK: Duration = Duration::from_millis(200);

/// A controller at a port.
pub(super) struct Wire {
    port: Port,
    handling: Handling,
    /// Whether an answer is awaited.
    moving: Arc<AtomicBool>,
    /// Whether somebody wants a halt that nothing on the line can bring about.
    halt: Arc<AtomicBool>,
    /// Whether that answer ends a motion.
    travelling: Arc<AtomicBool>,
    /// Whether time passes in which nothing moves and nothing is asked.
    dwelling: Arc<AtomicBool>,
    /// Whether what is under way is a reference run of axes with switches, which a stop would stand
    /// in for.
    referencing: Arc<AtomicBool>,
    /// Whether such a run was stopped here.
    false_reference: Arc<AtomicBool>,
    /// The axes that have a reference switch, X in bit 0.
    pub(super) with_switch: u8,
    /// The axes that have made reference runs since it began.
    known: u8,
    /// When each thing was done in rehearsal, in ms.
    times: Vec<u32>,
    /// What was sent for each of them there.
    rehearsed: Vec<Vec<u8>>,
    /// Whether everything was sent as it was in rehearsal up to now; what somebody enters on the
    /// way makes all that follows another job.
    as_rehearsed: bool,
    /// Whether reference runs have told the controller where its axes are.
    referenced: bool,
    /// Whether motions may end sooner than machines can move.
    pub(super) any_time: bool,
    /// How many things were done.
    done: usize,
    /// Whether it has ever answered.
    answered: bool,
    bar: Option<ProgressBar>,
    /// The line that is under way.
    line: u32,
}

/// Why a controller does not answer any more.
pub(super) enum Broken {
    Silent,
    /// What it says is no answer to what was sent.
    Strange {
        sent: Vec<u8>,
        said: Vec<u8>,
    },
    /// It says that a motion is done that takes longer.
    Early {
        sent: Vec<u8>,
        took: Duration,
        takes: Duration,
    },
    Port(PortError),
}

/// What came of braking.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Halted {
    /// Nothing was under way.
    NothingMoved,
    /// What was under way has ended.
    Rests,
    /// Nobody knows.
    NoAnswer,
}

impl From<PortError> for Broken {
    fn from(error: PortError) -> Broken {
        Broken::Port(error)
    }
}

impl Wire {
    /// The controller at a port.
    pub(super) fn new(port: Port, handling: Handling) -> Wire {
        Wire {
            port,
            handling,
            moving: Arc::default(),
            halt: Arc::default(),
            travelling: Arc::default(),
            dwelling: Arc::default(),
            referencing: Arc::default(),
            false_reference: Arc::default(),
            with_switch: 0,
            known: 0,
            times: Vec::new(),
            rehearsed: Vec::new(),
            as_rehearsed: false,
            referenced: false,
            any_time: false,
            done: 0,
            answered: false,
            bar: None,
            line: 0,
        }
    }

    /// A job begins; `times` say when each thing was done in rehearsal, in ms, and `rehearsed` what
    /// was sent for it.
    pub(super) fn begin(
        &mut self,
        times: Vec<u32>,
        rehearsed: Vec<Vec<u8>>,
        bar: Option<ProgressBar>,
    ) {
        (self.times, self.bar, self.done, self.line) = (times, bar, 0, 0);
        (self.rehearsed, self.as_rehearsed) = (rehearsed, true);
    }

    /// Whether what is behind the port is surely virtual.
    pub(super) fn is_virtual(&self) -> bool {
        self.port.is_virtual()
    }

    /// The port itself.
    pub(super) fn port(&self) -> &Port {
        &self.port
    }

    /// What is done with a line that somebody types: while something moves, any line is the stop key,
    /// for nobody types then without wanting something. While nothing moves and nothing is asked,
    /// Enter and what asks for the end hold what comes next. Says whether it was so.
    pub(super) fn stop_key(&self) -> impl FnMut(&str) -> bool + Send + 'static {
        let mut halt = self.port.sideways();
        let (moving, wanted) = (Arc::clone(&self.moving), Arc::clone(&self.halt));
        let (dwelling, referencing) = (Arc::clone(&self.dwelling), Arc::clone(&self.referencing));
        let false_reference = Arc::clone(&self.false_reference);
        let travelling = Arc::clone(&self.travelling);
        let stop = self.handling.stop;
        move |typed| {
            let stops = moving.load(Ordering::Relaxed)
                && (is_stop(typed) || travelling.load(Ordering::Relaxed));
            let holds = !stops && dwelling.load(Ordering::Relaxed) && is_stop(typed);
            match (&mut halt, stop) {
                (Some(halt), Some(stop)) if stops => match referencing.load(Ordering::Relaxed) {
                    true => {
                        false_reference.store(true, Ordering::Relaxed);
                        halt(stop.reference);
                    }
                    false => halt(stop.motion),
                },
                (_, None) if stops => wanted.store(true, Ordering::Relaxed),
                _ if holds => wanted.store(true, Ordering::Relaxed),
                _ => {}
            }
            stops || holds
        }
    }

    /// Whether a reference run was under way when it was interrupted.
    pub(super) fn is_referencing(&self) -> bool {
        self.referencing.load(Ordering::Relaxed)
    }

    /// What a command does that lasts.
    fn travel_of(&self, sent: &[u8]) -> Travel {
        self.handling.model().family().travel_of(sent)
    }

    /// The name of the port.
    pub(super) fn name(&self) -> &str {
        self.port.name()
    }

    /// The line that is under way.
    pub(super) fn line(&self) -> u32 {
        self.line
    }

    /// What shows how far it is.
    pub(super) fn bar(&self) -> Option<&ProgressBar> {
        self.bar.as_ref()
    }

    /// Lets everything pass that was sent before.
    pub(super) fn quiet(&mut self) -> Result<(), PortError> {
        let end = Instant::now() + NOISE;
        while self.port.next(Instant::now() + PAUSE)?.is_some() {
            if Instant::now() > end {
                let why = "it never falls silent, so no answer could be told from the rest";
                return Err(PortError::Gone(why.to_owned()));
            }
        }
        Ok(())
    }

    /// Asks the controller who it is.
    pub(super) fn identify(&mut self) -> Result<Identity, PortError> {
        let handling = self.handling.clone();
        handling.identify(|question| self.ask(question))
    }

    /// Asks the controller where its axes are.
    pub(super) fn position(&mut self) -> Result<Vec<u8>, PortError> {
        self.port.send(format!("{}\r", self.handling.position).as_bytes())?;
        self.answer_to(None)
    }

    /// Brakes what moves, and awaits the answer to what was under way.
    pub(super) fn halt(&mut self) -> Halted {
        let moved = self.moving.swap(false, Ordering::Relaxed);
        let sent = match self.handling.stop {
            Some(stop) if self.is_referencing() => self.port.send(stop.reference),
            _ => self.port.send(self.handling.halt),
        };
        if !moved {
            return Halted::NothingMoved;
        }
        let begun = Instant::now();
        let mut remarked = false;
        while sent.is_ok() && begun.elapsed() < HALTING {
            match self.port.next(Instant::now() + REMARK) {
                Ok(Some((_, bytes))) if self.rests(&bytes) => return Halted::Rests,
                Err(PortError::Gone(_)) => break,
                Ok(_) | Err(PortError::Interrupted) => {}
            }
            if begun.elapsed() >= REMARK && !std::mem::replace(&mut remarked, true) {
                self.tell("interrupted: waiting until it rests; Ctrl-C again does not wait");
            }
        }
        Halted::NoAnswer
    }

    /// Whether it is at rest that says this when it is to stop.
    fn rests(&self, said: &[u8]) -> bool {
        self.handling.stop.is_some() && self.handling.hear(b"", said) == Heard::Whole
    }

    /// Says something beside the bar.
    fn tell(&self, what: &str) {
        let say = || writeln!(io::stderr(), "{what}");
        let _ = self.bar.as_ref().map_or_else(say, |bar| bar.suspend(say));
    }

    /// Brakes what moves without believing any answer.
    pub(super) fn brake(&mut self) {
        self.moving.store(false, Ordering::Relaxed);
        let _ = self.port.send(self.handling.halt);
    }

    /// Asks something while nothing moves; nothing if nothing comes.
    fn ask(&mut self, question: Question) -> Result<Vec<u8>, PortError> {
        self.port.send(question.send)?;
        match question.until {
            Until::Pause => self.answer_to(None),
            Until::Whole(is_whole) => self.answer_to(Some(is_whole)),
            Until::Silence => self.quiet().map(|()| Vec::new()),
        }
    }

    /// What comes until `is_whole`, or up to a pause where that is not known beforehand.
    fn answer_to(&mut self, is_whole: Option<fn(&[u8]) -> bool>) -> Result<Vec<u8>, PortError> {
        let mut answer = Vec::new();
        let last = Instant::now() + FIRST;
        let end = last + TALK;
        let mut until = last;
        while let Some((_, bytes)) = self.port.next(until)? {
            answer.extend(bytes);
            self.answered = true;
            if answer.len() > LONGEST || Instant::now() > end {
                let why = "it says more than any answer, and no end of it is in sight";
                return Err(PortError::Gone(why.to_owned()));
            }
            let waits = is_whole.is_some_and(|is_whole| !is_whole(&answer));
            until = if waits { last } else { Instant::now() + PAUSE };
        }
        Ok(answer)
    }

    /// How long the next thing took in rehearsal, and when it began there.
    fn expected(&self) -> (Duration, Duration) {
        let at = |place: usize| {
            let millis = self.times.get(place).or(self.times.last()).copied().unwrap_or_default();
            Duration::from_millis(millis.into())
        };
        let began = self.done.checked_sub(1).map_or(Duration::ZERO, at);
        (began, at(self.done).saturating_sub(began))
    }

    /// Moves the bar to where it was in rehearsal after so much of the next thing.
    fn show(&self, within: Duration) {
        let Some(bar) = &self.bar else { return };
        let (began, takes) = self.expected();
        let now = (began + within.min(takes)).as_millis() as u64;
        let left = bar.length().unwrap_or_default().saturating_sub(now) / 1_000;
        bar.set_position(now);
        bar.set_message(format!(
            "{}:{:02}:{:02} left, line {}",
            left / 3_600,
            left / 60 % 60,
            left % 60,
            self.line
        ));
    }

    /// Awaits an answer to a line.
    fn answer(&mut self, sent: &[u8]) -> Result<Vec<u8>, Broken> {
        let (begun, (_, takes)) = (Instant::now(), self.expected());
        let mut answer = Vec::new();
        let mut first = None;
        let mut remarked = false;
        loop {
            let strange = |said| Broken::Strange { sent: sent.to_vec(), said };
            let heard = self.handling.hear(sent, &answer);
            let until = match heard {
                Heard::Whole => return Ok(answer),
                Heard::Strange => return Err(strange(answer)),
                Heard::Part | Heard::Perhaps => PAUSE,
                Heard::Waits if !answer.is_empty() || self.bar.is_some() => TICK,
                Heard::Waits if self.answered => LATE,
                Heard::Waits => FIRST,
            };
            match (self.port.next(Instant::now() + until)?, heard) {
                (Some((_, bytes)), _) => {
                    first.get_or_insert_with(Instant::now);
                    answer.extend(bytes);
                }
                (None, Heard::Perhaps) => return Ok(answer),
                (None, Heard::Part) => return Err(strange(answer)),
                (None, _) => {}
            }
            // Answers that come in one piece are short.
            let is_one = matches!(heard, Heard::Part | Heard::Perhaps);
            let talks = first.is_some_and(|first: Instant| first.elapsed() > TALK);
            if is_one && talks || answer.len() > LONGEST {
                return Err(strange(answer));
            }
            let waited = begun.elapsed();
            if answer.is_empty() && !self.answered && waited >= FIRST {
                return Err(Broken::Silent);
            }
            if answer.is_empty() && waited > takes * 2 + LATE && !remarked {
                remarked = true;
                let _ = writeln!(
                    io::stderr(),
                    "line {}: no answer for {} s; Ctrl-C ends the job",
                    self.line,
                    waited.as_secs()
                );
            }
            self.show(waited);
        }
    }

    /// Refuses to believe that a motion is done long before it can be.
    fn believe(&mut self, sent: &[u8], answer: &[u8], took: Duration) -> Result<(), Broken> {
        let (_, takes) = self.expected();
        self.as_rehearsed &= self.rehearsed.get(self.done).is_some_and(|then| then == sent);
        let (known, axes) = match self.travel_of(sent) {
            // How long these take is known from their numbers alone.
            Travel::Relative => (true, 0),
            // And these also depend on where the axes were.
            Travel::Absolute => (self.referenced, 0),
            // A run to a switch takes as long as the way to it, if that is known.
            Travel::Reference(axes) => (self.referenced && axes & !self.known == 0, axes),
            Travel::Question | Travel::None | Travel::Unknown => (false, 0),
        };
        self.referenced |= axes != 0;
        self.known |= axes;
        let early = took + EARLY < takes && took * 2 < takes;
        let checks = self.as_rehearsed && !self.any_time && known && answer == self.handling.done;
        match checks && early {
            true => Err(Broken::Early { sent: sent.to_vec(), took, takes }),
            false => Ok(()),
        }
    }
}

impl Link for Wire {
    type Broken = Broken;

    fn command(&mut self, line: &[u8]) -> Result<Vec<u8>, Broken> {
        if !self.handling.volunteers
            && let Some((_, said)) = self.port.next(Instant::now())?
        {
            // More than one answer to the one before.
            return Err(Broken::Strange { sent: Vec::new(), said });
        }
        let travel = self.travel_of(line);
        let has_switches =
            matches!(travel, Travel::Reference(axes @ 1..) if axes & !self.with_switch == 0);
        self.referencing.store(has_switches, Ordering::Relaxed);
        let travels = !matches!(travel, Travel::Question | Travel::None);
        self.travelling.store(travels, Ordering::Relaxed);
        // While an input is only looked at, what is typed answers a question.
        self.moving.store(travel != Travel::Question, Ordering::Relaxed);
        let begun = Instant::now();
        self.port.send(line)?;
        let answer = self.answer(line)?;
        self.answered = true;
        self.moving.store(false, Ordering::Relaxed);
        self.referencing.store(false, Ordering::Relaxed);
        if !self.false_reference.load(Ordering::Relaxed) {
            self.believe(line, &answer, begun.elapsed())?;
        }
        Ok(answer)
    }

    fn pass(&mut self, line: &[u8]) -> Result<Vec<u8>, Broken> {
        self.port.send(line)?;
        let begun = Instant::now();
        let mut said = Vec::new();
        loop {
            match self.port.next(Instant::now() + UNIT)? {
                Some((_, bytes)) => said.extend(bytes),
                None if !passes_later(line) || passed(&said) => return Ok(said),
                None if begun.elapsed() > RUN_UP => return Ok(said),
                None => self.show(begun.elapsed()),
            }
        }
    }

    fn handling(&self) -> &Handling {
        &self.handling
    }

    fn wants_halt(&mut self) -> bool {
        self.halt.swap(false, Ordering::Relaxed)
    }

    fn reference_is_false(&mut self) -> bool {
        self.false_reference.swap(false, Ordering::Relaxed)
    }

    fn wait(&mut self, time: Duration) -> Result<(), Broken> {
        let begun = Instant::now();
        self.dwelling.store(true, Ordering::Relaxed);
        let mut told = false;
        while let Some(left) = time.checked_sub(begun.elapsed()) {
            let step = if self.bar.is_some() { left.min(TICK) } else { left };
            self.port.next(Instant::now() + step)?;
            self.show(begun.elapsed());
            if self.halt.load(Ordering::Relaxed) && !std::mem::replace(&mut told, true) {
                self.tell("nothing moves now, and nothing will when this wait is over");
            }
        }
        self.dwelling.store(false, Ordering::Relaxed);
        Ok(())
    }

    fn rest(&mut self, longest: Duration) -> Result<Vec<u8>, Broken> {
        let heard = self.port.next(Instant::now() + longest)?;
        let said = heard.map(|(_, bytes)| bytes).unwrap_or_default();
        match !said.is_empty() && self.handling.hear(b"", &said) == Heard::Strange {
            true => Err(Broken::Strange { sent: Vec::new(), said }),
            false => Ok(said),
        }
    }

    fn begins(&mut self, line: u32) {
        self.line = line;
        self.show(Duration::ZERO);
    }

    fn done(&mut self) {
        self.done += 1;
    }
}
