//! The receive routine: what happens to a byte before there is a command.
//!
//! A controller looks at 253, 254 and 255 the moment they arrive, wherever that is; [`control`]
//! tells them apart. Everything else is collected by a [`LineBuffer`] until CR. The two are
//! separate because a control byte acts at once while the rest waits in the receive buffer for
//! the command before it to end.

use std::mem;

use serde::{Deserialize, Serialize};

/// The longest line a controller takes, in bytes without its CR.
///
/// Assumed: no manual says. LF is never part of a line, blanks are.
pub const LINE_MAX: usize = 255;

/// How much is kept of a line that is too long.
const LINE_SHOWN: usize = 40;

/// Lines are rarely longer than this, in bytes, so one allocation for each line is enough.
const LINE_USUAL: usize = 64;

/// A control byte: acted upon in the receive routine, at once, never part of a command
/// (99 §2.2.21, 05 §2.2.21, 12 §2.2.31).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum Control {
    /// Brake along the ramp, keep the remainder of the motion.
    Stop = 253,
    /// Everything as after power-on.
    Reset = 254,
    /// Brake along the ramp, forget the remainder.
    Break = 255,
}

impl Control {
    /// All of them.
    pub const ALL: [Control; 3] = [Control::Stop, Control::Reset, Control::Break];

    /// The byte that goes over the line.
    #[must_use]
    pub const fn byte(self) -> u8 {
        self as u8
    }

    /// What it does, for people.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Control::Stop => "stop: what moves brakes, and can be resumed",
            Control::Reset => "reset: everything as after power-on",
            Control::Break => "break: what moves brakes, and the rest of it is forgotten",
        }
    }
}

/// The control byte this is, if it is one.
#[must_use]
pub fn control(byte: u8) -> Option<Control> {
    Control::ALL.into_iter().find(|control| control.byte() == byte)
}

/// One line, complete.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReceivedLine {
    /// Its bytes, without CR and LF. At least one is not a blank.
    Text(Vec<u8>),
    /// It had more than [`LINE_MAX`] bytes, of which these are the first; the others are gone.
    TooLong(Vec<u8>),
}

/// Collects the bytes of one line.
///
/// Give it every byte that [`control`] does not claim.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LineBuffer {
    bytes: Vec<u8>,
    /// The line already has more than [`LINE_MAX`] bytes. Then `bytes` has only as many of them as
    /// people are shown.
    too_long: bool,
}

impl LineBuffer {
    /// Takes one byte; at CR it hands out the line, unless that is empty or all blanks.
    pub fn push(&mut self, byte: u8) -> Option<ReceivedLine> {
        match byte {
            b'\r' => self.finish(),
            b'\n' => None,
            _ if self.too_long => None,
            _ if self.bytes.len() >= LINE_MAX => {
                self.bytes.truncate(LINE_SHOWN);
                self.too_long = true;
                None
            }
            _ => {
                if self.bytes.is_empty() {
                    self.bytes.reserve(LINE_USUAL);
                }
                self.bytes.push(byte);
                None
            }
        }
    }

    /// Forgets what has been collected.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.too_long = false;
    }

    /// The part of a line that has arrived; if it is too long, its beginning.
    #[must_use]
    pub fn begun(&self) -> &[u8] {
        &self.bytes
    }

    /// Whether nothing of a line has arrived yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    fn finish(&mut self) -> Option<ReceivedLine> {
        if mem::take(&mut self.too_long) {
            return Some(ReceivedLine::TooLong(mem::take(&mut self.bytes)));
        }
        if self.bytes.iter().all(|&byte| byte == b' ') {
            self.bytes.clear();
            return None;
        }
        Some(ReceivedLine::Text(mem::take(&mut self.bytes)))
    }
}
