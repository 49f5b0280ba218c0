//! What operators do to a device, and the bytes that act at once.

use std::borrow::Cow;

use vimc4_device::{Deed, Device, Input, Kinds, Time};

use crate::engine::Engine;
use crate::{Effect, LineEvent, Source};

impl<D: Device> Engine<D> {
    /// Performs an operator action, and reports it, and whether it had no effect.
    pub(crate) fn act(
        &mut self,
        by: &Source,
        deed: Deed,
        inputs: &[Input<'_>],
        at: Time,
    ) -> Effect {
        self.pass_time(at);
        let is_reported = self.is_wanted(Kinds::COMMAND);
        if is_reported {
            self.report_action(at, by, deed.clone());
        }
        let effect = self.effect(by, inputs, at);
        if is_reported && let Effect::Nothing { why } = effect {
            let by = by.clone();
            self.report_news(at, LineEvent::NoEffect { by, deed, why: why.map(Cow::Borrowed) });
        }
        effect
    }

    /// Gives the device inputs whose effect it reports itself.
    pub(crate) fn give_all(&mut self, by: &Source, inputs: &[Input<'_>], at: Time) -> Effect {
        self.pass_time(at);
        self.effect(by, inputs, at)
    }

    fn effect(&mut self, by: &Source, inputs: &[Input<'_>], at: Time) -> Effect {
        let has_changed = self.has_changed_by(by, inputs, at);
        self.fail_unreachable_waiters();
        Effect::of(&self.device, inputs, at, has_changed)
    }

    /// Gives the device inputs. Returns whether its state has changed, or it has sent or stored
    /// something.
    fn has_changed_by(&mut self, by: &Source, inputs: &[Input<'_>], at: Time) -> bool {
        let (before, said) = (self.device.state(), self.said);
        let was_paused = self.is_paused();
        for input in inputs {
            if self.is_paused() && !was_paused {
                self.hold_back(*input, Some(by));
            } else {
                self.input(*input, at, Some(by));
            }
        }
        self.said != said || self.device.state() != before
    }

    /// Gives the device bytes from the line. Bytes that act at once are reported with their sender.
    pub(crate) fn send_bytes(&mut self, bytes: &[u8], at: Time, source: impl FnOnce() -> Source) {
        let is_urgent =
            self.is_wanted(Kinds::COMMAND) && bytes.iter().any(|byte| self.device.is_urgent(*byte));
        // To find out the sender takes some time.
        let by = (self.are_inputs_wanted() || is_urgent).then(source);
        if self.is_paused() {
            return self.give(Input::Bytes(bytes), by.as_ref());
        }
        match by.as_ref().filter(|_| is_urgent) {
            Some(by) => self.send_urgent_bytes(bytes, at, by),
            None => self.input(Input::Bytes(bytes), at, by.as_ref()),
        }
    }

    fn send_urgent_bytes(&mut self, bytes: &[u8], at: Time, by: &Source) {
        let mut rest = bytes;
        while let Some(place) = rest.iter().position(|byte| self.device.is_urgent(*byte)) {
            let (before, after) = rest.split_at(place);
            if !before.is_empty() {
                self.input(Input::Bytes(before), at, Some(by));
            }
            if self.is_paused() {
                return self.hold_back(Input::Bytes(after), Some(by));
            }
            let (first, after) = after.split_at(1);
            self.send_urgent_byte(first, at, by);
            rest = after;
        }
        if self.is_paused() {
            self.hold_back(Input::Bytes(rest), Some(by));
        } else if !rest.is_empty() {
            self.input(Input::Bytes(rest), at, Some(by));
        }
    }

    fn send_urgent_byte(&mut self, byte: &[u8], at: Time, by: &Source) {
        let deed = Deed::Byte(byte.first().copied().unwrap_or_default());
        self.pass_time(at);
        self.report_action(at, by, deed.clone());
        // A device may reply to such a byte although it has no effect.
        let before = self.device.state();
        self.input(Input::Bytes(byte), at, Some(by));
        if self.device.state() == before {
            let why = if self.is_off() {
                "the power is off"
            } else {
                "there is nothing that it could end"
            };
            let by = by.clone();
            self.report_news(at, LineEvent::NoEffect { by, deed, why: Some(why.into()) });
        }
    }
}
