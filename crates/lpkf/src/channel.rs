//! The second channel, and the spindle unit that is connected to it.

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::Time;

/// The longest command that the unit reads; longer ones are ignored.
const LONGEST: usize = 64;

/// A small spindle unit. Its output goes out on the line unchanged.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Unit {
    /// What it has received of a command.
    line: Vec<u8>,
    /// The speed it has been told to turn at; 0 to stand.
    told: i64,
    /// When it reaches that speed, if it has not yet.
    pub(crate) due: Option<Time>,
    /// 1 or 2: it never reaches its speed, and says so with this number.
    pub(crate) fault: u8,
}

impl Unit {
    /// Begins anew. Its fault remains.
    pub(crate) fn reset(&mut self) {
        *self = Unit { fault: self.fault, ..Unit::default() };
    }

    /// Takes a byte and returns the immediate answer; its spindle takes `start_ms` to change its
    /// speed.
    pub(crate) fn take_byte(&mut self, byte: u8, now: Time, start_ms: u64) -> Vec<Bytes> {
        match byte {
            b';' | b'\r' => {
                let line = std::mem::take(&mut self.line);
                self.obey(line.trim_ascii(), now, start_ms)
            }
            0 | b'\n' => Vec::new(),
            _ => {
                if self.line.len() < LONGEST {
                    self.line.push(byte);
                }
                Vec::new()
            }
        }
    }

    fn obey(&mut self, line: &[u8], now: Time, start_ms: u64) -> Vec<Bytes> {
        match line.split_at_checked(3) {
            Some((b"!SV" | b"!SM", _)) => vec![digit(b'0')],
            Some((b"!RM", speed)) => {
                let speed =
                    std::str::from_utf8(speed).ok().and_then(|text| text.trim().parse().ok());
                let reached = self.turn_spindle(speed.unwrap_or(0), now, start_ms);
                [digit(b'0')].into_iter().chain(reached).collect()
            }
            _ => Vec::new(),
        }
    }

    fn turn_spindle(&mut self, speed: i64, now: Time, start_ms: u64) -> Option<Bytes> {
        if self.told == speed && self.due.is_none() {
            return Some(self.speed_reached());
        }
        self.told = speed;
        if start_ms == 0 {
            return Some(self.speed_reached());
        }
        self.due = Some(now.after_nanos(start_ms.saturating_mul(1_000_000)));
        None
    }

    /// The spindle has reached its speed, or has failed to. This is reported even after the channel
    /// has been closed.
    pub(crate) fn speed_reached(&mut self) -> Bytes {
        self.due = None;
        digit(match (self.fault, self.told) {
            (fault @ 1..=2, _) => b'0' + fault,
            (_, 0) => b'9',
            _ => b'8',
        })
    }
}

fn digit(digit: u8) -> Bytes {
    Bytes::copy_from_slice(&[digit, b'\r'])
}
