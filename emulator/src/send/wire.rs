//! A controller at a port, to which a job goes.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use vimc4_catalogue::Handling;
use vimc4_device::{Heard, Identity, Question, Travel, Until};

use crate::job::channel::Channel;
use crate::job::unit::{RUN_UP, UNIT, passed, passes_later};
use crate::job::virtual_time::Did;
use crate::port::{Port, PortError};

use super::progress::Progress;
use super::whereabouts::{Doubt, Seen, Whereabouts};

/// How long an answer may take while nothing moves, and before anything has.
const FIRST: Duration = Duration::from_secs(3);
/// How long a question may take that a controller at rest answers at once.
const AT_ONCE: Duration = Duration::from_secs(1);
/// How long a line is waited for to fall silent.
const NOISE: Duration = Duration::from_secs(3);
/// How long a line must be silent before an answer of unknown length is over.
const PAUSE: Duration = Duration::from_millis(100);
/// How long a controller may take to come to rest.
const HALTING: Duration = Duration::from_secs(10);
/// A longer wait is reported.
const REMARK: Duration = Duration::from_secs(1);
/// How much longer than in rehearsal something must take to be worth a remark: a motion of known
/// time, a reference run, which may have a longer way, and anything else.
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
/// In a wait of this length the controller may be switched off and on.
const LONG_WAIT: Duration = Duration::from_secs(1);
/// How often the bar moves.
const TICK: Duration = Duration::from_millis(200);

/// A controller at a port.
pub(super) struct Wire {
    port: Port,
    handling: Handling,
    /// Whether an answer is awaited.
    moving: Arc<AtomicBool>,
    /// Whether a halt is wanted that nothing on the line can bring about.
    halt: Arc<AtomicBool>,
    /// Whether a motion was stopped, which START at the panel may let go on.
    paused: bool,
    /// What is known of where the axes are.
    axes: Whereabouts,
    /// Whether the operator was awaited since something was sent that may move the axes.
    waited: bool,
    /// Whether they were looked at since.
    looked: bool,
    /// Whether a reference run is under way, where a stop would replace the switch.
    referencing: Arc<AtomicBool>,
    /// Whether such a run was stopped here.
    false_reference: Arc<AtomicBool>,
    /// The axes that have made reference runs since it began.
    known: u8,
    /// How far it is.
    progress: Progress,
    /// What was sent last.
    sent: Vec<u8>,
    /// Whether everything was sent as in rehearsal up to now; anything entered on the way makes the
    /// rest another job.
    as_rehearsed: bool,
    /// Whether reference runs have told the controller where its axes are.
    referenced: bool,
    /// Whether motions may end sooner than machines can move.
    pub(super) any_time: bool,
    /// Whether the controller says of itself that it is virtual, so that its time may be faster.
    pub(super) says_virtual: bool,
    /// How long motions of known time took in rehearsal, and how long here.
    measured: (Duration, Duration),
    /// Whether it has ever answered.
    answered: bool,
    bar: Option<ProgressBar>,
}

/// Why a controller does not answer any more.
pub(super) enum Broken {
    Silent,
    /// What it says is not an answer to what was sent.
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
    /// It no longer answers what it has answered at once before.
    Mute,
    /// It has forgotten where its axes are while the operator was awaited.
    Forgotten,
    Port(PortError),
}

/// What came of braking.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Halted {
    /// Nothing was under way.
    NothingMoved,
    /// What was under way has ended.
    Rests,
    /// It has ended with an error.
    Refused(Vec<u8>),
    /// It is unknown.
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
        let family = handling.model().family();
        Wire {
            port,
            handling,
            moving: Arc::default(),
            halt: Arc::default(),
            paused: false,
            axes: Whereabouts::of(family),
            waited: false,
            looked: false,
            referencing: Arc::default(),
            false_reference: Arc::default(),
            known: 0,
            progress: Progress::default(),
            sent: Vec::new(),
            as_rehearsed: false,
            referenced: false,
            any_time: false,
            says_virtual: false,
            measured: (Duration::ZERO, Duration::ZERO),
            answered: false,
            bar: None,
        }
    }

    /// A job begins that did this in rehearsal.
    pub(super) fn begin(&mut self, rehearsed: Vec<Did>, bar: Option<ProgressBar>) {
        (self.progress, self.bar, self.as_rehearsed) = (Progress::new(rehearsed), bar, true);
    }

    /// Whether what is behind the port is surely virtual.
    pub(super) fn is_virtual(&self) -> bool {
        self.port.is_virtual()
    }

    /// The port itself.
    pub(super) fn port(&self) -> &Port {
        &self.port
    }

    /// What happens when a line is typed and nothing is asked: such input always means something,
    /// so it is the stop key. It also holds the next motion, because the present one may be about
    /// to end, or the next to begin.
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
        self.progress.line()
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

    /// Identifies the controller.
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
        let was_moving = self.moving.swap(false, Ordering::Relaxed);
        if self.paused {
            return self.halt_paused();
        }
        let sent = match self.handling.stop {
            Some(stop) if self.is_referencing() => self.port.send(stop.reference),
            _ => self.port.send(self.handling.halt),
        };
        if !was_moving {
            return Halted::NothingMoved;
        }
        let begun = Instant::now();
        let mut remarked = false;
        while sent.is_ok() && begun.elapsed() < HALTING {
            match self.port.next(Instant::now() + REMARK) {
                Ok(Some((_, bytes))) if self.is_code(&bytes) => return self.halted(bytes),
                Err(PortError::Gone(_)) => break,
                Ok(_) | Err(PortError::Interrupted) => {}
            }
            if begun.elapsed() >= REMARK && !std::mem::replace(&mut remarked, true) {
                self.tell("interrupted: waiting until it rests; Ctrl-C again does not wait");
            }
        }
        Halted::NoAnswer
    }

    /// What came of braking, from what was under way has answered.
    fn halted(&mut self, answer: Vec<u8>) -> Halted {
        self.axes.hear(Travel::Unknown, &answer);
        match answer.first() {
            Some(b'0' | b'F') => Halted::Rests,
            // Each way of ending a reference run makes it one of none.
            _ if self.is_referencing() => Halted::Rests,
            _ => Halted::Refused(answer),
        }
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
                Ok(said) if self.is_code(&said) => return self.halted(said),
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
                // Something was typed, which is not urgent.
                None if Instant::now() < silent => {}
                None => {
                    silent = Instant::now() + PAUSE;
                    if let (before, Some(places)) = self.without_places(&said) {
                        let before = before.to_vec();
                        if !before.is_empty() {
                            self.axes.go();
                            self.axes.hear(Travel::Unknown, &before);
                        }
                        self.see(&places)?;
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

    /// Where the axes are, if the controller tells and is believed.
    pub(super) fn places(&mut self) -> Option<Vec<i64>> {
        let places = self.look().ok().flatten();
        if places.is_none() && self.handling.stop.is_some() {
            self.axes.hear_nothing();
        }
        places.filter(|_| self.axes.doubt().is_none())
    }

    /// Asks where the axes are, and makes of it what can be known. It is answered at rest only.
    fn look(&mut self) -> Result<Option<Vec<i64>>, PortError> {
        let said = self.position()?;
        let places = self.handling.read_position(&said).or_else(|| self.without_places(&said).1);
        if let Some(places) = &places {
            self.see(places)?;
        }
        Ok(places)
    }

    /// The axes rest at these places. One that counts as it would if it were just switched on is asked
    /// whether it knows its axes.
    fn see(&mut self, places: &[i64]) -> Result<(), PortError> {
        (self.waited, self.looked) = (true, true);
        if self.axes.see(places) == Seen::LikeNew
            && let Some(answer) = self.ask_for_axes()?
        {
            self.axes.hear(Travel::Question, &answer);
        }
        Ok(())
    }

    /// Sends a line that a controller without configured axes refuses in a particular way.
    fn ask_for_axes(&mut self) -> Result<Option<Vec<u8>>, PortError> {
        let Some(line) = self.handling.needs_axes else { return Ok(None) };
        self.port.send(format!("{line}\r").as_bytes())?;
        self.answer_to(None).map(Some)
    }

    /// Whether the controller says that it has no configured axes.
    pub(super) fn knows_no_axes(&mut self) -> Result<bool, PortError> {
        let answer = self.ask_for_axes()?;
        Ok(answer.is_some_and(|answer| self.handling.model().family().has_forgotten(&answer)))
    }

    /// What is known of where the axes are.
    pub(super) fn axes(&mut self) -> &mut Whereabouts {
        &mut self.axes
    }

    /// What was sent last.
    pub(super) fn sent(&self) -> &[u8] {
        &self.sent
    }

    /// Makes sure, before anything goes on, that the controller has not forgotten where its axes
    /// are while the operator was awaited.
    fn confirm(&mut self) -> Result<(), Broken> {
        if !self.looked && self.look()?.is_none() {
            self.axes.hear_nothing();
            return Err(Broken::Mute);
        }
        match self.axes.doubt() {
            Some(Doubt::Reset) => Err(Broken::Forgotten),
            _ => Ok(()),
        }
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
                // Something was typed, which is not urgent.
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

    /// Moves the bar to where it was in rehearsal after so much of the next thing.
    fn show(&self, within: Duration) {
        let Some(bar) = &self.bar else { return };
        let (began, takes) = self.progress.expected();
        let now = (began + within.min(takes)).as_millis() as u64;
        let left = bar.length().unwrap_or_default().saturating_sub(now) / 1_000;
        bar.set_position(now);
        bar.set_message(format!(
            "{}:{:02}:{:02} left, line {}",
            left / 3_600,
            left / 60 % 60,
            left % 60,
            self.progress.line()
        ));
    }

    /// Awaits an answer to a line.
    fn answer(&mut self, sent: &[u8]) -> Result<Vec<u8>, Broken> {
        let (begun, (_, takes)) = (Instant::now(), self.progress.expected());
        let is_foreseen = self.progress.is_foreseen(sent);
        let travel = self.travel_of(sent);
        let is_question = travel == Travel::Question && self.answered;
        let late = match travel {
            _ if is_question => AT_ONCE,
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
                // Something was typed.
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
            if answer.is_empty() && is_question && waited >= AT_ONCE {
                return Err(Broken::Mute);
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
                    self.progress.line(),
                    waited.as_secs()
                ));
            }
            if !is_question {
                self.show(waited);
            }
        }
    }

    /// What a question is answered, after which nothing moves. One that was lost is asked again, if the
    /// controller still knows where its axes are.
    fn answer_to_question(&mut self, question: &[u8]) -> Result<Vec<u8>, Broken> {
        let answer = self.answer(question);
        if !matches!(answer, Err(Broken::Mute)) || self.handling.stop.is_none() {
            return answer;
        }
        let said = self.position()?;
        // An answer that is only late comes first.
        let split = (0..said.len()).find_map(|at| {
            let (late, told) = said.split_at(at);
            let is_one = late.is_empty()
                || matches!(self.handling.hear(question, late), Heard::Whole | Heard::Perhaps);
            self.handling.read_position(told).filter(|_| is_one).map(|places| (late, places))
        });
        let Some((late, places)) = split else {
            self.axes.hear_nothing();
            return Err(Broken::Mute);
        };
        self.see(&places)?;
        self.confirm()?;
        if !late.is_empty() {
            return Ok(late.to_vec());
        }
        self.port.send(question)?;
        self.answer(question)
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
        if self.handling.stop.is_none() {
            return;
        }
        self.axes.hear(travel, answer);
        if !matches!(travel, Travel::Question | Travel::None) {
            self.paused = answer.starts_with(b"F");
        }
    }

    /// From here on the axes may go elsewhere.
    fn goes(&mut self) {
        self.axes.go();
        (self.waited, self.looked) = (false, false);
    }

    /// Refuses to believe that a motion is done long before it can be.
    fn believe(&mut self, sent: &[u8], answer: &[u8], took: Duration) -> Result<(), Broken> {
        let (_, takes) = self.progress.expected();
        let travel = self.travel_of(sent);
        // Observing changes nothing, and a motion that was stopped and continued ends as in
        // rehearsal, with the spindle that was switched on again before.
        let goes_on = self.handling.stop.is_some_and(|stop| {
            sent.strip_suffix(b"\r").is_some_and(|sent| sent == stop.resume.as_bytes())
        }) || self.handling.spindle_after(sent).is_some();
        if travel == Travel::Question || goes_on {
            return Ok(());
        }
        self.as_rehearsed &= self.progress.is_foreseen(sent);
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
        let is_question = travel == Travel::Question;
        if !is_question && self.waited {
            self.confirm()?;
        }
        if !matches!(travel, Travel::Question | Travel::None)
            && self.axes.began().is_none()
            && self.handling.stop.is_some()
        {
            let answer = self.position()?;
            self.axes.begin(self.handling.read_position(&answer).unwrap_or_default());
        }
        if !is_question {
            self.goes();
        }
        self.referencing.store(matches!(travel, Travel::Reference(_)), Ordering::SeqCst);
        self.moving.store(!is_question, Ordering::SeqCst);
        let begun = Instant::now();
        self.sent = line.to_vec();
        self.port.send(line)?;
        // Input typed before the motion was known here still counts.
        if self.moving.load(Ordering::SeqCst) && self.halt.load(Ordering::SeqCst) {
            self.stop()?;
        }
        let answer = match is_question {
            true => self.answer_to_question(line)?,
            false => self.answer(line)?,
        };
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
        // A question for the position at the moment of START is answered when the axes rest again.
        let (said, _) = self.without_places(&said);
        if !said.is_empty() && !self.is_code(said) {
            return Err(Broken::Strange { sent: Vec::new(), said: said.to_vec() });
        }
        let said = said.to_vec();
        if !said.is_empty() {
            self.goes();
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
        if self.handling.stop.is_none() {
            return Ok(false);
        }
        let is_new = !std::mem::replace(&mut self.waited, true);
        if is_new {
            self.look()?;
        }
        // The present state may change by the time the operator has decided.
        self.looked = false;
        Ok(is_new)
    }

    fn begins(&mut self, line: u32, _is_rapid: bool) {
        self.progress.begins(line);
        self.show(Duration::ZERO);
    }

    fn done(&mut self) {
        self.progress.done();
    }
}
