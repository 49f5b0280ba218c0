//! A controller at a port, to which a job goes.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use vimc4_catalogue::Handling;
use vimc4_device::{Heard, Identity, Question, Travel, Until};

use crate::job::perform::Channel;
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
/// A wait longer than that is told of.
const REMARK: Duration = Duration::from_secs(1);
/// What takes so much longer than in rehearsal is worth a remark: a motion whose time is foreseen, a
/// reference run, whose way may be longer than there, and anything else.
const LATE_MOTION: Duration = Duration::from_secs(5);
const LATE_REFERENCE: Duration = Duration::from_secs(15);
const LATE: Duration = Duration::from_secs(30);
/// No answer that goes up to a pause is longer, or takes longer: 512 bytes at 1,200 baud.
const LONGEST: usize = 4_096;
const TALK: Duration = Duration::from_secs(6);
/// A motion that ends so much earlier than in rehearsal, and in less than half the time, was none.
const EARLY: Duration = Duration::from_millis(500);
/// A run to switches from known places that ends so much earlier, and by a twentieth, was stopped.
const EARLY_REFERENCE: Duration = Duration::from_millis(250);
/// Motions that take so long in rehearsal show whether a virtual controller keeps real time, once they
/// are so long together.
const MEASURE: Duration = Duration::from_millis(500);
const MEASURED: Duration = Duration::from_secs(1);
/// In a wait so long somebody may switch the controller off and on.
const LONG_WAIT: Duration = Duration::from_secs(1);
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
    /// Whether a motion was stopped, which START at the panel may let go on.
    paused: bool,
    /// Where the axes were before the first motion.
    began: Option<Vec<i64>>,
    /// Where they rest, if that was asked for since something was sent that may change it.
    rested: Option<Vec<i64>>,
    /// Whether it was asked for.
    noted: bool,
    /// Whether something has moved.
    moved: bool,
    /// Whether what is under way is a reference run, of which a stop would stand in for the switch.
    referencing: Arc<AtomicBool>,
    /// Whether such a run was stopped here.
    false_reference: Arc<AtomicBool>,
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
    /// Whether the controller says of itself that it is virtual, so that its time may be faster.
    pub(super) says_virtual: bool,
    /// How long motions took in rehearsal whose time is known, and how long here.
    measured: (Duration, Duration),
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
        /// It was a reference run.
        is_reference: bool,
    },
    /// Nothing tells whether a motion rests.
    Restless,
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
            paused: false,
            began: None,
            rested: None,
            noted: false,
            moved: false,
            referencing: Arc::default(),
            false_reference: Arc::default(),
            known: 0,
            times: Vec::new(),
            rehearsed: Vec::new(),
            as_rehearsed: false,
            referenced: false,
            any_time: false,
            says_virtual: false,
            measured: (Duration::ZERO, Duration::ZERO),
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

    /// What is done when somebody types a line and nothing is asked: nobody types then without wanting
    /// something, so it is the stop key. It holds what comes next too, for what moves may be about to
    /// end, or to begin.
    pub(super) fn stop_key(&self) -> impl FnMut() + Send + 'static {
        let mut halt = self.port.sideways();
        let (moving, wanted) = (Arc::clone(&self.moving), Arc::clone(&self.halt));
        let referencing = Arc::clone(&self.referencing);
        let false_reference = Arc::clone(&self.false_reference);
        let stop = self.handling.stop;
        move || {
            wanted.store(true, Ordering::SeqCst);
            let (Some(halt), Some(stop)) = (&mut halt, stop) else { return };
            if !moving.load(Ordering::SeqCst) {
                return;
            }
            match referencing.load(Ordering::SeqCst) {
                true => {
                    false_reference.store(true, Ordering::SeqCst);
                    halt(stop.reference);
                }
                false => halt(stop.motion),
            }
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
        if self.paused {
            return self.halt_paused();
        }
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
                Ok(Some((_, bytes))) if self.is_code(&bytes) => return Halted::Rests,
                Err(PortError::Gone(_)) => break,
                Ok(_) | Err(PortError::Interrupted) => {}
            }
            if begun.elapsed() >= REMARK && !std::mem::replace(&mut remarked, true) {
                self.tell("interrupted: waiting until it rests; Ctrl-C again does not wait");
            }
        }
        Halted::NoAnswer
    }

    /// Whether that is all that a motion answers when it ends or is stopped.
    fn is_code(&self, said: &[u8]) -> bool {
        self.handling.stop.is_some() && self.handling.hear(b"", said) == Heard::Whole
    }

    /// Brakes what START at the panel may have let go on, and awaits that it rests.
    fn halt_paused(&mut self) -> Halted {
        loop {
            match self.settled() {
                Ok(said) if said.is_empty() => return Halted::NothingMoved,
                Ok(said) if self.is_code(&said) => return Halted::Rests,
                Err(Broken::Port(PortError::Interrupted)) => {}
                Ok(_) | Err(_) => return Halted::NoAnswer,
            }
        }
    }

    /// Brakes, and asks where the axes are, which is answered at rest only: what was answered before
    /// that.
    fn settled(&mut self) -> Result<Vec<u8>, Broken> {
        self.port.send(self.handling.halt)?;
        self.port.send(format!("{}\r", self.handling.position).as_bytes())?;
        let begun = Instant::now();
        let mut said = Vec::new();
        let mut remarked = false;
        let mut silent = begun + PAUSE;
        loop {
            match self.port.next(silent)? {
                Some((_, bytes)) => {
                    said.extend(bytes);
                    silent = Instant::now() + PAUSE;
                }
                // Somebody has typed something, which has time.
                None if Instant::now() < silent => {}
                None => {
                    silent = Instant::now() + PAUSE;
                    if let (before, Some(places)) = self.without_places(&said) {
                        let before = before.to_vec();
                        (self.rested, self.noted) = (Some(places), true);
                        return Ok(before);
                    }
                }
            }
            if begun.elapsed() > HALTING || said.len() > LONGEST {
                return Err(Broken::Restless);
            }
            if begun.elapsed() >= REMARK && !std::mem::replace(&mut remarked, true) {
                self.tell("stopped: waiting until it rests");
            }
        }
    }

    /// What was said before the answers that tell where the axes are, and the last of these.
    fn without_places<'a>(&self, said: &'a [u8]) -> (&'a [u8], Option<Vec<i64>>) {
        if self.is_code(said) {
            return (said, None);
        }
        let mut splits = (0..said.len()).filter_map(|at| {
            let (before, told) = said.split_at(at);
            let places = self.handling.read_position(told)?;
            let (before, _) = self.without_places(before);
            (before.is_empty() || self.is_code(before)).then_some((before, Some(places)))
        });
        splits.next().unwrap_or((said, None))
    }

    /// Where the axes are, if the controller tells, and whether that is where they were when they came
    /// to rest: a controller that has lost its power, or met an emergency stop, counts anew, and tells
    /// of fewer axes.
    pub(super) fn places(&mut self) -> Option<(Vec<i64>, bool)> {
        let answer = self.position().unwrap_or_default();
        let places = self.handling.read_position(&answer)?;
        let stayed = self.rested.as_ref().is_none_or(|rested| *rested == places);
        let told = self.began.as_ref().is_none_or(|began| places.len() >= began.len());
        Some((places, stayed && told))
    }

    /// Where the axes were before the first motion, if the controller has told.
    pub(super) fn began(&self) -> Option<&[i64]> {
        self.began.as_deref()
    }

    /// Whether an answer says that the controller has forgotten what it was told.
    pub(super) fn has_forgotten(&self, answer: &[u8]) -> bool {
        let family = self.handling.model().family();
        family.resets_counters(answer) || self.moved && family.has_forgotten(answer)
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
        loop {
            match self.port.next(until)? {
                Some((_, bytes)) => answer.extend(bytes),
                None if Instant::now() >= until => break,
                // Somebody has typed something, which has time.
                None => continue,
            }
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
        let is_foreseen = self.rehearsed.get(self.done).is_some_and(|then| then == sent);
        let late = match self.travel_of(sent) {
            Travel::Reference(_) if is_foreseen => takes + LATE_REFERENCE,
            Travel::Relative | Travel::Absolute if is_foreseen => takes + takes / 4 + LATE_MOTION,
            _ => takes * 2 + LATE,
        };
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
                Heard::Waits if self.answered && remarked => LATE,
                Heard::Waits if self.answered => late.saturating_sub(begun.elapsed()).max(TICK),
                Heard::Waits => FIRST,
            };
            let until = Instant::now() + until;
            match (self.port.next(until)?, heard) {
                (Some((_, bytes)), _) => {
                    first.get_or_insert_with(Instant::now);
                    answer.extend(bytes);
                }
                // Somebody has typed something.
                (None, _) if Instant::now() < until => continue,
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
            if answer.is_empty() && waited > late && !remarked {
                remarked = true;
                let foreseen = match is_foreseen {
                    true => format!(", and {:.1} s were foreseen", takes.as_secs_f64()),
                    false => String::new(),
                };
                self.tell(&format!(
                    "line {}: no answer for {} s{foreseen}: the controller may have lost its power, \
                     or its line; Ctrl-C ends the job",
                    self.line,
                    waited.as_secs()
                ));
            }
            self.show(waited);
        }
    }

    /// Stops what moves, as what is typed does.
    fn stop(&mut self) -> Result<(), PortError> {
        let Some(stop) = self.handling.stop else { return Ok(()) };
        match self.is_referencing() {
            true => {
                self.false_reference.store(true, Ordering::SeqCst);
                self.port.send(stop.reference)
            }
            false => self.port.send(stop.motion),
        }
    }

    /// What a command and its answer tell of the axes.
    fn takes_note(&mut self, travel: Travel, answer: &[u8]) {
        if travel == Travel::Question || self.handling.stop.is_none() {
            return;
        }
        self.paused = answer.starts_with(b"F");
        // What is refused has changed nothing, unless an axis has met its limit switch.
        if matches!(answer.first(), Some(b'0' | b'F' | b'2')) {
            (self.rested, self.noted) = (None, false);
            self.moved |= travel != Travel::None;
        }
    }

    /// Refuses to believe that a motion is done long before it can be.
    fn believe(&mut self, sent: &[u8], answer: &[u8], took: Duration) -> Result<(), Broken> {
        let (_, takes) = self.expected();
        let travel = self.travel_of(sent);
        // Looking on changes nothing, and what was stopped and goes on ends as in rehearsal.
        let goes_on = self.handling.stop.is_some_and(|stop| {
            sent.strip_suffix(b"\r").is_some_and(|sent| sent == stop.resume.as_bytes())
        });
        if travel == Travel::Question || goes_on {
            return Ok(());
        }
        self.as_rehearsed &= self.rehearsed.get(self.done).is_some_and(|then| then == sent);
        let (known, axes) = match travel {
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
        let is_reference = matches!(travel, Travel::Reference(_));
        if !self.as_rehearsed || !known || answer != self.handling.done {
            return Ok(());
        }
        let early = match is_reference {
            true => took + EARLY_REFERENCE + takes / 20 < takes,
            false => took + EARLY < takes && took * 2 < takes,
        };
        let is_believed = match self.says_virtual {
            _ if self.any_time => true,
            // It hurts nothing, but a job for a real one may be tried on it.
            true => !is_reference || !self.keeps_real_time(),
            false => false,
        };
        if !is_reference && takes >= MEASURE {
            self.measured.0 += takes;
            self.measured.1 += took;
        }
        match early && !is_believed {
            true => Err(Broken::Early { sent: sent.to_vec(), took, takes, is_reference }),
            false => Ok(()),
        }
    }

    /// Whether the motions up to now have taken the time that they take.
    fn keeps_real_time(&self) -> bool {
        let (takes, took) = self.measured;
        takes >= MEASURED && took * 10 >= takes * 9
    }
}

impl Channel for Wire {
    type Broken = Broken;

    fn command(&mut self, line: &[u8]) -> Result<Vec<u8>, Broken> {
        if !self.handling.volunteers
            && let Some((_, said)) = self.port.next(Instant::now())?
        {
            // More than one answer to the one before.
            return Err(Broken::Strange { sent: Vec::new(), said });
        }
        let travel = self.travel_of(line);
        let moves = !matches!(travel, Travel::Question | Travel::None);
        if moves && self.began.is_none() && self.handling.stop.is_some() {
            let answer = self.position()?;
            self.began = Some(self.handling.read_position(&answer).unwrap_or_default());
        }
        self.referencing.store(matches!(travel, Travel::Reference(_)), Ordering::SeqCst);
        self.moving.store(travel != Travel::Question, Ordering::SeqCst);
        let begun = Instant::now();
        self.port.send(line)?;
        // Who typed before it was known here that something moves is heard all the same.
        if self.moving.load(Ordering::SeqCst) && self.halt.load(Ordering::SeqCst) {
            self.stop()?;
        }
        let answer = self.answer(line)?;
        self.answered = true;
        self.moving.store(false, Ordering::SeqCst);
        self.referencing.store(false, Ordering::SeqCst);
        self.takes_note(travel, &answer);
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
        self.halt.swap(false, Ordering::SeqCst)
    }

    fn reference_is_false(&mut self) -> bool {
        self.false_reference.swap(false, Ordering::Relaxed)
    }

    fn wait(&mut self, time: Duration) -> Result<(), Broken> {
        let begun = Instant::now();
        if time >= LONG_WAIT {
            self.rests()?;
        }
        let mut told = false;
        while let Some(left) = time.checked_sub(begun.elapsed()) {
            let step = if self.bar.is_some() { left.min(TICK) } else { left };
            self.port.next(Instant::now() + step)?;
            self.show(begun.elapsed());
            if self.halt.load(Ordering::SeqCst) && !std::mem::replace(&mut told, true) {
                self.tell("nothing moves now, and nothing will when this wait is over");
            }
        }
        Ok(())
    }

    fn rest(&mut self, longest: Duration) -> Result<Vec<u8>, Broken> {
        let heard = self.port.next(Instant::now() + longest)?;
        let said = heard.map(|(_, bytes)| bytes).unwrap_or_default();
        if self.handling.stop.is_none() || said.is_empty() {
            return Ok(said);
        }
        // Whoever asks where the axes are at the moment of START is answered when they rest again.
        let (said, _) = self.without_places(&said);
        if !said.is_empty() && !self.is_code(said) {
            return Err(Broken::Strange { sent: Vec::new(), said: said.to_vec() });
        }
        let said = said.to_vec();
        if !said.is_empty() {
            self.takes_note(Travel::Unknown, &said);
        }
        Ok(said)
    }

    fn want_halt(&mut self) {
        self.halt.store(true, Ordering::SeqCst);
    }

    fn settle(&mut self) -> Result<Vec<u8>, Broken> {
        if self.handling.stop.is_none() {
            return Ok(Vec::new());
        }
        let said = self.settled()?;
        if said.is_empty() {
            return Ok(said);
        }
        if !self.is_code(&said) {
            return Err(Broken::Strange { sent: Vec::new(), said });
        }
        self.paused = said.starts_with(b"F");
        if self.paused {
            self.tell("START at the panel had let it go on; it was stopped again");
        }
        Ok(said)
    }

    fn rests(&mut self) -> Result<bool, Broken> {
        if self.handling.stop.is_none() || std::mem::replace(&mut self.noted, true) {
            return Ok(false);
        }
        let answer = self.position()?;
        self.rested = self.handling.read_position(&answer);
        Ok(true)
    }

    fn begins(&mut self, line: u32) {
        self.line = line;
        self.show(Duration::ZERO);
    }

    fn done(&mut self) {
        self.done += 1;
    }
}
