//! Conditions that a device can be run until.
//!
//! There are two sorts. A *state* holds or does not hold at any instant; when it will hold is
//! computed from the running motion. A *happening* lasts only for the moment of one cause; it is
//! seen in the events of that cause. Both can be combined: all of them in one moment, or any of
//! them.

mod names;
mod seen;
mod vocabulary;

use serde::{Deserialize, Serialize};

use crate::{Point, SignalId, Time};

pub use names::{LengthUnit, Named, Names, Scale};
pub use vocabulary::{Vocabulary, is_mnemonic};

/// Something that can become true while a device runs. See [`Device::when`](crate::Device::when) and
/// [`Harness::run_until`](crate::Harness::run_until).
///
/// It has a text form for people to type: `z < -5000`, `answer error 2`, `x = 100 and port 2 bit 0
/// on`. [`Names`] writes it with a device's names for its axes and signals, and `vimc4-language` reads it.
///
/// # Moments
///
/// A condition is evaluated at moments: after every cause and every input, with the events of that
/// one cause or input, and at every instant between two causes, without events.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Condition {
    // --- states ---
    /// The counter of an axis (0 for X) is at a position, in steps.
    AxisAt {
        /// The axis.
        axis: u8,
        /// The position.
        position: i64,
    },
    /// The counter of an axis is below a position, in steps.
    AxisBelow {
        /// The axis.
        axis: u8,
        /// The position.
        position: i64,
    },
    /// The counter of an axis is above a position, in steps.
    AxisAbove {
        /// The axis.
        axis: u8,
        /// The position.
        position: i64,
    },
    /// Any axis is outside a box, in steps; the limits themselves are inside. [`i64::MIN`] and
    /// [`i64::MAX`] mean no limit.
    Outside {
        /// The lower limits.
        low: Point,
        /// The upper limits.
        high: Point,
    },
    /// A bit of a port, as the host would read it, has a level.
    PortBit {
        /// The port.
        port: u16,
        /// The bit, 0 to 7.
        bit: u8,
        /// The level.
        level: bool,
    },
    /// A limit switch, as the controller sees it, is active or not.
    Limit {
        /// The axis.
        axis: u8,
        /// Whether it is the switch at the positive end.
        positive: bool,
        /// Whether it is to be active.
        active: bool,
    },
    /// A signal of the outside world has a value.
    SignalIs {
        /// The signal.
        signal: SignalId,
        /// The value.
        value: i32,
    },
    /// The device does nothing by itself: no command, no program, nothing moves.
    Idle,
    /// A time has been reached.
    At(Time),

    // --- happenings ---
    /// The execution of a command begins.
    Command {
        /// Its mnemonic, or the beginning of its line; `None` for any command.
        like: Option<String>,
    },
    /// A command is answered.
    Answered {
        /// Its mnemonic; `None` for any command.
        like: Option<String>,
    },
    /// An answer is this text.
    Answer {
        /// The answer without the end of its line.
        text: String,
    },
    /// An answer is an error.
    Error {
        /// Its text without the end of its line, or the number that follows the letter in it, with
        /// or without zeros before it; `None` for any error.
        code: Option<String>,
    },
    /// The execution of a line of a stored program begins.
    Line {
        /// Its number, from 1; `None` for any line.
        line: Option<u32>,
    },
    /// A signal of the outside world takes another value.
    SignalChanges {
        /// The signal.
        signal: SignalId,
        /// The value that it takes; `None` for any value.
        to: Option<i32>,
    },

    // --- combined ---
    /// All of these hold in the same moment.
    All(Vec<Condition>),
    /// Any of these holds.
    Any(Vec<Condition>),
}

/// What a family of devices must be able to forecast: a state of one thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fact {
    /// The counter of an axis (0 for X) is within these limits, inclusive.
    Axis {
        /// The axis.
        axis: u8,
        /// The lower limit, steps; [`i64::MIN`] for none.
        low: i64,
        /// The upper limit, steps; [`i64::MAX`] for none.
        high: i64,
    },
    /// A bit of a port, as the host would read it, has a level.
    PortBit {
        /// The port.
        port: u16,
        /// The bit, 0 to 7.
        bit: u8,
        /// The level.
        level: bool,
    },
    /// A limit switch, as the controller sees it, is active or not.
    Limit {
        /// The axis.
        axis: u8,
        /// Whether it is the switch at the positive end.
        positive: bool,
        /// Whether it is to be active.
        active: bool,
    },
    /// A signal has a value.
    Signal {
        /// The signal.
        signal: SignalId,
        /// The value.
        value: i32,
    },
}

impl Condition {
    /// The latest time that it names.
    pub(crate) fn latest_time(&self) -> Option<Time> {
        match self {
            Condition::At(time) => Some(*time),
            Condition::All(parts) | Condition::Any(parts) => {
                parts.iter().filter_map(Condition::latest_time).max()
            }
            _ => None,
        }
    }
}
