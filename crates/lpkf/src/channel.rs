//! The second channel, and the spindle unit that is connected to it.

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::Time;

use crate::Controller;

/// The longest command that the unit reads; what is longer is none.
const LONGEST: usize = 64;

/// A small spindle unit.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Unit {
    /// What it has received of a command.
    pub(crate) line: Vec<u8>,
    /// The speed it has been told to turn at; 0 to stand.
    pub(crate) told: i64,
    /// When it reaches that speed, if it has not yet.
    pub(crate) due: Option<Time>,
    /// 1 or 2: it never reaches its speed, and says so with this number.
    pub(crate) fault: u8,
}

impl Controller {
    /// Bytes for the unit.
    pub(crate) fn pass_through(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            match byte {
                b';' | b'\r' => {
                    let line = std::mem::take(&mut self.state.unit.line);
                    self.unit_command(&line);
                }
                0 | b'\n' => {}
                _ if self.state.unit.line.len() < LONGEST => self.state.unit.line.push(byte),
                _ => {}
            }
        }
    }

    fn unit_command(&mut self, line: &[u8]) {
        let line = line.trim_ascii();
        let Some((name, rest)) = line.split_at_checked(3) else { return };
        match name {
            b"!SV" | b"!SM" => self.unit_says(b'0'),
            b"!RM" => {
                self.unit_says(b'0');
                let number =
                    std::str::from_utf8(rest).ok().and_then(|text| text.trim().parse().ok());
                self.turn_spindle(number.unwrap_or(0));
            }
            _ => {}
        }
    }

    fn turn_spindle(&mut self, speed: i64) {
        let unit = &mut self.state.unit;
        if unit.told == speed && unit.due.is_none() {
            return self.speed_reached();
        }
        unit.told = speed;
        match self.state.model.spindle_unit.start_ms {
            0 => self.speed_reached(),
            ms => unit.due = Some(self.state.now.after_nanos(ms.saturating_mul(1_000_000))),
        }
    }

    /// The spindle turns as it was told, or has failed to. This is said also when the channel
    /// has been closed.
    pub(crate) fn speed_reached(&mut self) {
        let unit = &mut self.state.unit;
        unit.due = None;
        let says = match (unit.fault, unit.told) {
            (fault @ 1..=2, _) => b'0' + fault,
            (_, 0) => b'9',
            _ => b'8',
        };
        self.unit_says(says);
    }

    fn unit_says(&mut self, digit: u8) {
        self.send(Bytes::copy_from_slice(&[digit, b'\r']));
    }
}
