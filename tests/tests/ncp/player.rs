//! A controller in its own time, and somebody who sends it lines.

use std::collections::VecDeque;

use vimc4::device::{Controller, Device, Input, Output, SignalId};
use vimc4_device::{Event, Kinds, Motion, Point, Segment, Time};
use vimc4_tests::jobs::Change;

/// Past this a job counts as one that never ends: a week.
const LONGEST: Time = Time::from_nanos(7 * 24 * 3600 * 1_000_000_000);

/// A controller, the clock, and what happens outside.
pub(crate) struct Player {
    device: Controller,
    now: Time,
    /// What is still to happen outside, in order.
    changes: VecDeque<(Time, SignalId, i32)>,
    received: Vec<u8>,
    /// Every warning of the device.
    pub(crate) warnings: Vec<String>,
    /// The motions since they were last taken, each with the counters at its start.
    motions: Vec<(Point, Box<Segment>)>,
}

impl Player {
    /// A controller that has just been switched on.
    pub(crate) fn new(mut device: Controller, changes: &[Change]) -> Result<Player, String> {
        device.watch(Kinds::MOTION.and(Kinds::WARNING));
        let changes = changes
            .iter()
            .map(|change| {
                let signal = signal(&device, &change.signal)?;
                Ok((Time::from_nanos(change.at), signal, change.value))
            })
            .collect::<Result<_, String>>()?;
        let mut player = Player {
            device,
            now: Time::ZERO,
            changes,
            received: Vec::new(),
            warnings: Vec::new(),
            motions: Vec::new(),
        };
        player.input(Input::Wake);
        Ok(player)
    }

    /// The time.
    pub(crate) fn now(&self) -> Time {
        self.now
    }

    /// The step counters.
    pub(crate) fn counters(&self) -> Vec<i64> {
        self.device.view(self.now).axes.iter().map(|axis| axis.position).collect()
    }

    /// The motions since this was last called.
    pub(crate) fn take_motions(&mut self) -> Vec<(Point, Box<Segment>)> {
        std::mem::take(&mut self.motions)
    }

    /// Sends a line and awaits the answer, which must be `0`.
    pub(crate) fn send(&mut self, line: &[u8]) -> Result<(), String> {
        match self.ask(line)?.as_slice() {
            b"0" => Ok(()),
            other => Err(format!(
                "{} is answered {}",
                String::from_utf8_lossy(line).trim_end(),
                String::from_utf8_lossy(other)
            )),
        }
    }

    /// The byte at an input port.
    pub(crate) fn read(&mut self, port: u16) -> Result<u8, String> {
        let answer = self.ask(format!("@0b{port}\r").as_bytes())?;
        let text = String::from_utf8_lossy(&answer);
        let byte = text.strip_prefix('0').and_then(|hex| u8::from_str_radix(hex, 16).ok());
        byte.ok_or_else(|| format!("@0b{port} is answered {text}"))
    }

    /// Lets so much time pass.
    pub(crate) fn pass(&mut self, nanos: u64) -> Result<(), String> {
        let until = self.now.after_nanos(nanos);
        while self.next().is_some_and(|next| next <= until) {
            self.advance()?;
        }
        self.now = until;
        self.input(Input::Wake);
        Ok(())
    }

    /// Lets time pass until something changes outside.
    pub(crate) fn pass_to_change(&mut self) -> Result<(), String> {
        let (at, ..) = self.changes.front().ok_or("waits for an input that never comes")?;
        self.pass(at.nanos_since(self.now))
    }

    /// Presses START and lets the program run to its end.
    pub(crate) fn run_program(&mut self) -> Result<(), String> {
        let start = signal(&self.device, "start")?;
        self.input(Input::Signal(start, 1));
        self.input(Input::Signal(start, 0));
        while self.next().is_some() {
            self.advance()?;
        }
        match self.device.is_idle() {
            true => Ok(()),
            false => Err(format!("the program rests in {}", self.device.view(self.now).activity)),
        }
    }

    fn ask(&mut self, line: &[u8]) -> Result<Vec<u8>, String> {
        self.input(Input::Bytes(line));
        while self.received.is_empty() {
            if self.next().is_none() {
                return Err(format!(
                    "{} is not answered",
                    String::from_utf8_lossy(line).trim_end()
                ));
            }
            self.advance()?;
        }
        Ok(std::mem::take(&mut self.received))
    }

    /// When something happens next.
    fn next(&self) -> Option<Time> {
        let change = self.changes.front().map(|(at, ..)| *at);
        self.device.wake().into_iter().chain(change).min()
    }

    /// Goes to where something happens next.
    fn advance(&mut self) -> Result<(), String> {
        let Some(next) = self.next().filter(|next| *next <= LONGEST) else {
            return Err("it goes on and on".to_owned());
        };
        self.now = self.now.max(next);
        self.input(Input::Wake);
        while let Some((at, signal, value)) = self.changes.front().copied()
            && at <= self.now
        {
            self.changes.pop_front();
            self.input(Input::Signal(signal, value));
        }
        Ok(())
    }

    fn input(&mut self, input: Input<'_>) {
        self.device.handle(input, self.now);
        loop {
            match self.device.poll_output() {
                Output::Bytes(_, bytes) => self.received.extend_from_slice(&bytes),
                Output::Event(_, Event::Motion(Motion::Begins { origin, segment })) => {
                    self.motions.push((origin, segment));
                }
                Output::Event(_, Event::Warning(warning)) => {
                    self.warnings.push(format!("{warning:?}"));
                }
                Output::Event(..) | Output::Flash(..) => {}
                Output::Wake(_) => return,
            }
        }
    }
}

/// The signal of a name, or behind a bit of an input port, as in `0.2`.
fn signal(device: &Controller, name: &str) -> Result<SignalId, String> {
    let bit = name
        .split_once('.')
        .and_then(|(port, bit)| device.input_signal(port.parse().ok()?, bit.parse().ok()?));
    let named = || device.signals().into_iter().find(|signal| signal.name == name);
    bit.or_else(|| named().map(|signal| signal.id)).ok_or_else(|| format!("no signal {name:?}"))
}
