//! A controller at a port, to which a job goes.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use crate::job::perform::Link;
use crate::port::{Port, PortError};

/// How long the first answer may take: nothing moves then.
const FIRST: Duration = Duration::from_secs(3);
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
    /// Whether an answer is awaited.
    moving: Arc<AtomicBool>,
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
    /// The controller at a port; `times` say when each thing was done in rehearsal, in ms.
    pub(super) fn new(port: Port, times: Vec<u32>, bar: Option<ProgressBar>) -> Wire {
        let moving = Arc::new(AtomicBool::new(false));
        Wire { port, moving, times, done: 0, answered: false, bar, line: 0 }
    }

    /// What is done with a line that somebody types: if it is empty and something is under way, it
    /// is the stop key. Says whether it was.
    pub(super) fn stop_key(&self) -> impl FnMut(&str) -> bool + Send + 'static {
        let (woken, mut halt) = (self.port.waker(), self.port.sideways());
        let moving = Arc::clone(&self.moving);
        move |typed| {
            let stops = typed.trim().is_empty() && moving.load(Ordering::Relaxed);
            match &mut halt {
                Some(halt) if stops => halt(&[253]),
                _ => woken(),
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
        while self.port.next(Instant::now() + PAUSE)?.is_some() {}
        Ok(())
    }

    /// Brakes what moves. Says whether something did.
    pub(super) fn halt(&mut self) -> bool {
        let moved = self.moving.load(Ordering::Relaxed);
        let _ = self.port.send(&[253]);
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
    fn answer(&mut self, length: Option<usize>) -> Result<Vec<u8>, Broken> {
        let (begun, (_, takes)) = (Instant::now(), self.expected());
        let mut answer = Vec::new();
        let mut remarked = false;
        loop {
            let until = match (answer.is_empty(), self.bar.is_some()) {
                (false, _) => PAUSE,
                (true, true) => TICK,
                (true, false) if self.answered => LATE,
                (true, false) => FIRST,
            };
            match self.port.next(Instant::now() + until)? {
                Some((_, bytes)) => answer.extend(bytes),
                None if !answer.is_empty() => return Ok(answer),
                None => {}
            }
            let complete = match answer.first() {
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
        let answer = self.answer(answer_length(line))?;
        self.answered = true;
        self.moving.store(false, Ordering::Relaxed);
        Ok(answer)
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

    fn rest(&mut self, longest: Duration) -> Result<(), Broken> {
        self.port.next(Instant::now() + longest)?;
        Ok(())
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
