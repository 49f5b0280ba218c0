//! A controller in its own time, and somebody who sends it lines.

use vimc4::device::{Controller, Device, Harness, Input, Output, SignalId};
use vimc4_device::{Event, Kinds, Motion, Point, Segment, Time};
use vimc4_tests::jobs::Change;

/// Past this a job counts as one that never ends: a week.
const LONGEST: Time = Time::from_nanos(7 * 24 * 3600 * 1_000_000_000);

/// A controller, the clock, and what happens outside.
pub(crate) struct Player {
    harness: Harness<Controller>,
    received: Vec<u8>,
    /// Every warning of the device.
    pub(crate) warnings: Vec<String>,
    /// The motions since they were last taken, each with the counters at its start.
    motions: Vec<(Point, Box<Segment>)>,
}

impl Player {
    /// A controller that has just been switched on.
    pub(crate) fn new(device: Controller, changes: &[Change]) -> Result<Player, String> {
        let mut harness = Harness::new(device).watching(Kinds::MOTION.and(Kinds::WARNING));
        for change in changes {
            let signal = signal(harness.device(), &change.signal)?;
            harness.plan(Time::from_nanos(change.at), Input::Signal(signal, change.value));
        }
        harness.run_to(Time::ZERO);
        let (received, warnings, motions) = Default::default();
        let mut player = Player { harness, received, warnings, motions };
        player.take_outputs();
        Ok(player)
    }

    /// The time.
    pub(crate) fn now(&self) -> Time {
        self.harness.now()
    }

    /// The step counters.
    pub(crate) fn counters(&self) -> Vec<i64> {
        self.harness.device().view(self.now()).axes.iter().map(|axis| axis.position).collect()
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
        let until = self.now().after_nanos(nanos);
        while self.harness.due().is_some_and(|due| due <= until) {
            self.step()?;
        }
        self.harness.run_to(until);
        self.take_outputs();
        Ok(())
    }

    /// Lets time pass until something changes outside.
    pub(crate) fn pass_to_change(&mut self) -> Result<(), String> {
        let at = self.harness.planned().ok_or("waits for an input that never comes")?;
        self.pass(at.nanos_since(self.now()))
    }

    /// Presses START and lets the program run to its end.
    pub(crate) fn run_program(&mut self) -> Result<(), String> {
        let start = signal(self.harness.device(), "start")?;
        for value in [1, 0] {
            self.harness.input(Input::Signal(start, value));
        }
        while self.step()? {}
        let device = self.harness.device();
        match device.is_idle() {
            true => Ok(()),
            false => Err(format!("the program rests in {}", device.activity())),
        }
    }

    fn ask(&mut self, line: &[u8]) -> Result<Vec<u8>, String> {
        self.harness.send(line);
        self.take_outputs();
        while self.received.is_empty() {
            if !self.step()? {
                let line = String::from_utf8_lossy(line);
                return Err(format!("{} is not answered", line.trim_end()));
            }
        }
        Ok(std::mem::take(&mut self.received))
    }

    /// Goes to where something happens next, if something does.
    fn step(&mut self) -> Result<bool, String> {
        if self.harness.due().is_some_and(|due| due > LONGEST) {
            return Err("it goes on and on".to_owned());
        }
        let stepped = self.harness.step().is_some();
        self.take_outputs();
        Ok(stepped)
    }

    fn take_outputs(&mut self) {
        for output in self.harness.drain() {
            match output {
                Output::Bytes(_, bytes) => self.received.extend_from_slice(&bytes),
                Output::Event(_, Event::Motion(Motion::Begins { origin, segment })) => {
                    self.motions.push((origin, segment));
                }
                Output::Event(_, Event::Warning(warning)) => {
                    self.warnings.push(format!("{warning:?}"));
                }
                Output::Event(..) | Output::Flash(..) => {}
            }
        }
    }
}

/// The signal of a name, or behind a bit of an input port, as in `0.2`.
fn signal(device: &Controller, name: &str) -> Result<SignalId, String> {
    let bit = name.split_once('.');
    let bit = bit.and_then(|(port, bit)| Some((port.parse().ok()?, bit.parse().ok()?)));
    let mut signals = device.signals().into_iter();
    let found = signals
        .find(|signal| bit.is_some_and(|bit| signal.bits.contains(&bit)) || signal.name == name);
    found.map(|signal| signal.id).ok_or_else(|| format!("no signal {name:?}"))
}
