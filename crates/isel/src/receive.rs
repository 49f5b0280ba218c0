//! The receive routine: what happens to a byte from the line.

use vimc4_device::{Event, Kinds, Warning};
use vimc4_isel_wire::{Control, Line, control};

use crate::Controller;
use crate::state::{Activity, Wait};
use crate::why::By;

impl Controller {
    /// Takes bytes as they arrive. 253, 254 and 255 act at once, wherever they appear; the
    /// others wait their turn (99 2.2.21).
    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        if !self.state.powered {
            return;
        }
        let mut lost = 0;
        for &byte in bytes {
            if let Some(control) = control(byte) {
                match control {
                    Control::Stop => self.stop(By::Line),
                    Control::Reset => self.software_reset(),
                    Control::Break => self.break_off(),
                }
                self.take_waiting_lines();
                continue;
            }
            if matches!(self.state.activity, Activity::Echo) {
                self.send(bytes::Bytes::copy_from_slice(&[byte]));
                continue;
            }
            if self.is_listening() && self.state.receiver.waiting.is_empty() {
                self.take(byte);
            } else if self.state.receiver.waiting.len() < self.state.model.line.receive_buffer {
                self.state.receiver.waiting.push_back(byte);
                if matches!(self.state.activity, Activity::Waiting { what: Wait::Character, .. }) {
                    self.character_arrived();
                }
            } else {
                lost += 1;
            }
        }
        if lost > 0 && self.wants(Kinds::WARNING) {
            self.emit(Event::Warning(Warning::ReceiveOverflow { lost }));
        }
    }

    /// Executes what waits in the receive buffer, as far as the controller listens.
    pub(crate) fn take_waiting_lines(&mut self) {
        while self.is_listening() {
            let Some(byte) = self.state.receiver.waiting.pop_front() else { break };
            self.take(byte);
        }
        if matches!(self.state.activity, Activity::Echo) {
            let waiting: Vec<u8> = self.state.receiver.waiting.drain(..).collect();
            if !waiting.is_empty() {
                self.send(waiting.into());
            }
        }
    }

    /// Whether bytes are read as commands: nothing executes and no program runs.
    fn is_listening(&self) -> bool {
        matches!(self.state.activity, Activity::Idle) && !self.state.is_running()
    }

    /// Adds a byte to the line and executes the line when it is whole.
    fn take(&mut self, byte: u8) {
        match self.state.receiver.line.push(byte) {
            None => {}
            Some(Line::Text(text)) => self.execute_line(&text),
            Some(Line::TooLong) => self.refuse_long_line(),
        }
    }
}
