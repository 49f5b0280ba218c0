//! Playing a recording into a device.

use std::collections::VecDeque;

use serde_json::Value;
use thiserror::Error;
use vimc4_device::{
    CommandNumber, Device, Event, Harness, Kinds, Names, Output, OwnedInput, Time, TimedInput,
};

use super::entry::{Entry, Given, What};

/// How many events are kept to explain what led to something.
const REMEMBERED: usize = 12;

/// What looks at every event, and at the device that it comes from.
type Look<'l, D> = &'l mut dyn FnMut(&D, Time, &Event);

/// The kinds of events that are told.
const TOLD: Kinds = Kinds::COMMAND.and(Kinds::ANSWER).and(Kinds::SIGNAL).and(Kinds::WARNING);

/// A device into which a recording is played, line by line.
#[derive(Debug)]
pub struct Player<D: Device> {
    harness: Harness<D>,
    /// Whether it has been put into the state in which the recording begins.
    begun: bool,
    /// The device is led: it does nothing but what the recording says.
    led: bool,
    said: VecDeque<(Time, u8)>,
    told: VecDeque<Told>,
    remembered: usize,
    /// Whether commands are remembered with what they mean.
    explains: bool,
    /// Signals and faults that the device does not have.
    unknown: Vec<String>,
}

/// Something that happened inside the device, and what it means.
#[derive(Clone, Debug, PartialEq)]
pub struct Told {
    /// When.
    pub at: Time,
    /// The command that it belongs to.
    pub command: Option<CommandNumber>,
    /// What.
    pub event: Event,
    /// What people call a command; empty for anything else.
    pub means: String,
}

/// What looks on: at the device after each single thing that it has done, and at what came out by it.
pub type Seen<'a, D> = dyn FnMut(&D, &VecDeque<Output>) + 'a;

/// A recorded state that does not fit the device.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: it is not a state of this controller: {why}")]
pub struct StateError {
    /// The line, from 1.
    pub line: u32,
    /// Why not.
    pub why: String,
}

impl<D: Device> Player<D> {
    /// Plays into a device.
    pub fn new(device: D) -> Player<D> {
        let harness = Harness::new(device).watching(TOLD);
        let (said, told, unknown) = (VecDeque::new(), VecDeque::new(), Vec::new());
        let (remembered, explains) = (REMEMBERED, true);
        Player { harness, begun: false, led: false, said, told, remembered, explains, unknown }
    }

    /// Remembers commands without what they mean, which takes less time.
    #[must_use]
    pub fn without_meanings(self) -> Player<D> {
        Player { explains: false, ..self }
    }

    /// Sets how many of the last events are remembered; a dozen otherwise.
    #[must_use]
    pub fn remembering(self, remembered: usize) -> Player<D> {
        Player { remembered, ..self }
    }

    /// Also watches these kinds of events, for those who look on.
    #[must_use]
    pub fn watching(self, kinds: Kinds) -> Player<D> {
        Player { harness: self.harness.watching(TOLD.and(kinds)), ..self }
    }

    /// The device, to be looked at.
    pub fn device(&self) -> &D {
        self.harness.device()
    }

    /// Whether it has been put into the state in which the recording begins.
    pub fn has_begun(&self) -> bool {
        self.begun
    }

    /// Whether the recorded controller was led cause by cause. Then the complete output of an
    /// instant is known only later, and a state may have been taken in the middle of an instant.
    pub fn is_led(&self) -> bool {
        self.led
    }

    /// Puts the device into a state.
    pub fn restore(&mut self, state: D::State) {
        self.begun = true;
        self.harness.restore(state);
        self.take();
    }

    /// Does what a line records, at its time. The first state is where playing begins. Lines of
    /// output, and states to compare, only let time pass up to then.
    ///
    /// # Errors
    ///
    /// If `state` cannot read the first state or one that was put into the controller.
    pub fn play(
        &mut self,
        entry: &Entry,
        state: &dyn Fn(&Value) -> Result<D::State, String>,
    ) -> Result<(), StateError> {
        self.play_seen(entry, state, &mut |_, _| {})
    }

    /// The same, cause by cause: when `look` is told of an event, the device is as it has left it.
    ///
    /// # Errors
    ///
    /// Those of [`play`](Player::play).
    pub fn play_seeing(
        &mut self,
        entry: &Entry,
        state: &dyn Fn(&Value) -> Result<D::State, String>,
        look: Look<'_, D>,
    ) -> Result<(), StateError> {
        self.play_seen(entry, state, &mut |device, outputs| {
            for output in outputs {
                if let Output::Event(stamp, event) = output {
                    look(device, stamp.at, event);
                }
            }
        })
    }

    /// The same while something looks on.
    ///
    /// # Errors
    ///
    /// Those of [`play`](Player::play).
    pub fn play_seen(
        &mut self,
        entry: &Entry,
        state: &dyn Fn(&Value) -> Result<D::State, String>,
        seen: &mut Seen<'_, D>,
    ) -> Result<(), StateError> {
        let first = !self.begun && matches!(entry.what, What::State { .. });
        let lets_time_pass = match entry.what {
            // Lines about clients have the time of the clock, which the device may not have reached
            // yet.
            What::News(_) | What::Mark(_) | What::Stands(Some(_)) => false,
            What::Given { .. } | What::Stands(None) | What::Goes => true,
            What::Sent(_) | What::State { .. } | What::End(_) => !first && !self.led,
        };
        if lets_time_pass {
            self.run_to_seen(entry.at, seen);
        }
        match &entry.what {
            What::Given { given, .. } => match self.input(given) {
                Some(input) if self.led => self.harness.accept(input.as_input()),
                Some(input) => self.harness.play(&TimedInput { at: entry.at, input }),
                None => {}
            },
            What::Stands(causes) => {
                self.led = true;
                self.run_before(entry.at, seen);
                self.harness.run_into(entry.at, causes.unwrap_or_default());
            }
            What::Goes => self.led = false,
            What::State { by, state: written } if first || by.is_some() => {
                let state = state(written).map_err(|why| StateError { line: entry.line, why })?;
                self.restore(state);
            }
            _ => {}
        }
        seen(self.harness.device(), self.harness.outputs());
        self.take();
        Ok(())
    }

    /// Lets time pass, with everything that happens.
    pub fn run_to(&mut self, at: Time) {
        self.harness.run_to(at);
        self.take();
    }

    /// The same while something looks on.
    pub fn run_to_seen(&mut self, at: Time, seen: &mut Seen<'_, D>) {
        self.run_before(at.after_nanos(1), seen);
        self.run_to(at);
        seen(self.harness.device(), self.harness.outputs());
    }

    /// Lets everything happen that is due before a time.
    fn run_before(&mut self, at: Time, seen: &mut Seen<'_, D>) {
        while self.harness.due().is_some_and(|due| due < at) && self.harness.step().is_some() {
            seen(self.harness.device(), self.harness.outputs());
            self.take();
        }
    }

    /// What has come out, byte by byte, and has not been taken.
    pub fn said(&mut self) -> &mut VecDeque<(Time, u8)> {
        &mut self.said
    }

    /// What happened last, oldest first.
    pub fn told(&self) -> impl Iterator<Item = &Told> {
        self.told.iter()
    }

    /// The recorded signals and faults that the device does not have.
    pub fn unknown(&self) -> &[String] {
        &self.unknown
    }

    fn input(&mut self, given: &Given) -> Option<OwnedInput> {
        let input = given.input(|| Names::of(self.harness.device()));
        input
            .map_err(|unknown| {
                if !self.unknown.contains(&unknown) {
                    self.unknown.push(unknown);
                }
            })
            .ok()
    }

    fn take(&mut self) {
        while let Some(output) = self.harness.take_output() {
            match output {
                Output::Bytes(at, bytes) => self.said.extend(bytes.iter().map(|byte| (at, *byte))),
                Output::Flash(..) => {}
                Output::Event(stamp, event) => {
                    let means = match &event {
                        Event::Command { bytes, .. } if self.explains => {
                            self.harness.device().explain(bytes)
                        }
                        _ => String::new(),
                    };
                    if self.told.len() >= self.remembered {
                        self.told.pop_front();
                    }
                    let (at, command) = (stamp.at, stamp.command);
                    self.told.push_back(Told { at, command, event, means });
                }
            }
        }
    }
}

/// Replaces `old` by `new` everywhere in a serialised state, so that a recorded controller goes on
/// as another one. Its complete model and machine are part of its state.
pub fn exchange(state: &mut Value, old: &Value, new: &Value) {
    if state == old {
        state.clone_from(new);
        return;
    }
    match state {
        Value::Object(fields) => fields.values_mut().for_each(|field| exchange(field, old, new)),
        Value::Array(items) => items.iter_mut().for_each(|item| exchange(item, old, new)),
        _ => {}
    }
}
