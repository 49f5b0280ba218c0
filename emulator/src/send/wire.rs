//! A controller at a port, to which a job goes.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use vimc4::{Family, Handling};

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
/// A motion that takes so much longer than in rehearsal is worth a remark.
const LATE: Duration = Duration::from_secs(30);
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
    /// When each thing was done in rehearsal, in ms.
    times: Vec<u32>,
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
    Port(PortError),
}

impl From<PortError> for Broken {
    fn from(error: PortError) -> Broken {
        Broken::Port(error)
    }
}

impl Wire {
    /// The controller at a port.
    pub(super) fn new(port: Port, handling: Handling) -> Wire {
        let (moving, halt) = (Arc::default(), Arc::default());
        let times = Vec::new();
        Wire { port, handling, moving, halt, times, done: 0, answered: false, bar: None, line: 0 }
    }

    /// A job begins; `times` say when each thing was done in rehearsal, in ms.
    pub(super) fn begin(&mut self, times: Vec<u32>, bar: Option<ProgressBar>) {
        (self.times, self.bar, self.done, self.line) = (times, bar, 0, 0);
    }

    /// Whether what is behind the port is surely virtual.
    pub(super) fn is_virtual(&self) -> bool {
        self.port.is_virtual()
    }

    /// The port itself.
    pub(super) fn port(&self) -> &Port {
        &self.port
    }

    /// What is done with a line that somebody types: if it is empty and something is under way, it
    /// is the stop key. Says whether it was.
    pub(super) fn stop_key(&self) -> impl FnMut(&str) -> bool + Send + 'static {
        let mut halt = self.port.sideways();
        let (moving, wanted) = (Arc::clone(&self.moving), Arc::clone(&self.halt));
        let family = self.handling.model().family();
        move |typed| {
            let stops = typed.trim().is_empty() && moving.load(Ordering::Relaxed);
            match (&mut halt, family) {
                (Some(halt), Family::Isel) if stops => halt(&[253]),
                (_, Family::Lpkf) if stops => wanted.store(true, Ordering::Relaxed),
                _ => {}
            }
            stops
        }
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

    /// Brakes what moves. Says whether something did.
    pub(super) fn halt(&mut self) -> bool {
        let moved = self.moving.load(Ordering::Relaxed);
        let _ = self.port.send(self.handling.halt);
        let until = Instant::now() + HALTING;
        while moved && Instant::now() < until {
            match self.port.next(until) {
                Ok(Some(_)) | Err(PortError::Gone(_)) => break,
                Ok(None) | Err(PortError::Interrupted) => {}
            }
        }
        self.moving.store(false, Ordering::Relaxed);
        moved
    }

    /// Asks something while nothing moves: what comes until `is_whole`, or up to a pause where that
    /// is not known beforehand; nothing if nothing comes.
    pub(super) fn ask(
        &mut self,
        question: &str,
        is_whole: Option<fn(&[u8]) -> bool>,
    ) -> Result<Vec<u8>, PortError> {
        let end = if self.handling.model().family() == Family::Lpkf { ";" } else { "\r" };
        self.port.send(format!("{question}{end}").as_bytes())?;
        let mut answer = Vec::new();
        let last = Instant::now() + FIRST;
        let mut until = last;
        while let Some((_, bytes)) = self.port.next(until)? {
            answer.extend(bytes);
            self.answered = true;
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
        let family = self.handling.model().family();
        let length = answer_length(sent);
        let (begun, (_, takes)) = (Instant::now(), self.expected());
        let mut answer = Vec::new();
        let mut remarked = false;
        loop {
            if family == Family::Lpkf && self.handling.is_whole(sent, &answer) {
                return Ok(answer);
            }
            let until = match (answer.is_empty(), self.bar.is_some()) {
                (false, _) if family == Family::Isel => PAUSE,
                (false, _) => TICK,
                (true, true) => TICK,
                (true, false) if self.answered => LATE,
                (true, false) => FIRST,
            };
            match self.port.next(Instant::now() + until)? {
                Some((_, bytes)) => answer.extend(bytes),
                None if family == Family::Isel && !answer.is_empty() => return Ok(answer),
                None => {}
            }
            let complete = match answer.first() {
                _ if family == Family::Lpkf => false,
                // A stop may be confirmed by a 0 of its own.
                None | Some(b'F') => false,
                Some(b'0') => length.is_some_and(|length| answer.len() >= length),
                Some(_) => length.is_some(),
            };
            if complete {
                return Ok(answer);
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
}

impl Link for Wire {
    type Broken = Broken;

    fn command(&mut self, line: &[u8]) -> Result<Vec<u8>, Broken> {
        self.moving.store(true, Ordering::Relaxed);
        self.port.send(line)?;
        let answer = self.answer(line)?;
        self.answered = true;
        self.moving.store(false, Ordering::Relaxed);
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

    fn wait(&mut self, time: Duration) -> Result<(), Broken> {
        let begun = Instant::now();
        while let Some(left) = time.checked_sub(begun.elapsed()) {
            let step = if self.bar.is_some() { left.min(TICK) } else { left };
            self.port.next(Instant::now() + step)?;
            self.show(begun.elapsed());
        }
        Ok(())
    }

    fn rest(&mut self, longest: Duration) -> Result<Vec<u8>, Broken> {
        let heard = self.port.next(Instant::now() + longest)?;
        Ok(heard.map(|(_, bytes)| bytes).unwrap_or_default())
    }

    fn begins(&mut self, line: u32) {
        self.line = line;
        self.show(Duration::ZERO);
    }

    fn done(&mut self) {
        self.done += 1;
    }
}

/// How long the answer to a command is that is carried out; `None` where that is not known.
fn answer_length(line: &[u8]) -> Option<usize> {
    match line.iter().filter(|byte| **byte != b' ').nth(2)? {
        b'b' | b'D' => Some(3),
        b'P' | b'V' | b'H' | b'h' | b'U' | b'?' => None,
        _ => Some(1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_answers() {
        for (line, length) in [
            ("@0A5,900\r", Some(1)),
            ("@07\r", Some(1)),
            ("@0b0\r", Some(3)),
            ("@ 0 D S0\r", Some(3)),
            ("@0P\r", None),
            ("\r", None),
        ] {
            assert_eq!(answer_length(line.as_bytes()), length, "{line}");
        }
    }
}
