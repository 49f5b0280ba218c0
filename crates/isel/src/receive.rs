//! The receive routine: what happens to a byte from the line.

use vimc4_device::{Event, Kinds, Warning};
use vimc4_isel_wire::{Control, ReceivedLine, control};

use crate::activity::{Activity, Wait};
use crate::firmware::Firmware;
use crate::outcome::Outcome;
use crate::why::By;

impl Firmware {
    /// Takes bytes as they arrive. 253, 254 and 255 act at once, wherever they appear, on what the
    /// bytes before them have begun; other bytes wait in the receive buffer for their turn (99
    /// 2.2.21).
    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        if !self.state.powered {
            return;
        }
        // The usual case: a command for a controller that waits for one.
        let size = self.state.model.line.receive_buffer;
        let room = size.saturating_sub(self.state.receiver.waiting.len());
        let plain = bytes.len() <= room && bytes.iter().all(|byte| control(*byte).is_none());
        if plain && self.state.is_at_rest() {
            return self.state.receiver.waiting.extend(bytes);
        }
        let mut lost = 0;
        for &byte in bytes {
            if let Some(control) = control(byte) {
                self.take_all_waiting();
                let outcome = match control {
                    Control::Stop => self.stop(By::Line),
                    Control::Break => self.break_off(),
                    Control::Reset => {
                        self.software_reset();
                        Outcome::Nothing
                    }
                };
                self.follow(outcome);
                continue;
            }
            if self.state.receiver.waiting.len() >= self.state.model.line.receive_buffer {
                self.take_all_waiting();
            }
            if self.state.receiver.waiting.len() < self.state.model.line.receive_buffer {
                self.state.receiver.waiting.push_back(byte);
                if matches!(self.state.activity, Activity::Waiting { what: Wait::Character, .. }) {
                    let outcome = self.character_arrived();
                    self.follow(outcome);
                }
            } else {
                lost += 1;
            }
        }
        if lost > 0 && self.wants(Kinds::WARNING) {
            let warning = Event::Warning(Warning::ReceiveOverflow { lost });
            self.for_no_command(|firmware| firmware.emit(warning));
        }
    }

    fn take_all_waiting(&mut self) {
        while self.state.has_waiting() {
            self.take_waiting();
        }
    }

    /// Takes what waits in the receive buffer, up to the end of a line, which is executed.
    pub(crate) fn take_waiting(&mut self) {
        if matches!(self.state.activity, Activity::Echo) {
            let waiting: Vec<u8> = self.state.receiver.waiting.drain(..).collect();
            return self.send(waiting.into());
        }
        while let Some(byte) = self.state.receiver.waiting.pop_front() {
            match self.state.receiver.line.push(byte) {
                None => continue,
                Some(ReceivedLine::Text(text)) => self.execute_line(&text),
                Some(ReceivedLine::TooLong(beginning)) => self.refuse_long_line(&beginning),
            }
            return self.state.command_ended();
        }
    }
}
