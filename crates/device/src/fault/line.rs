//! What can go wrong on a serial line.

use std::fmt;
use std::time::Duration;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use super::When;

/// Something that goes wrong on the line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LineFault {
    /// What is done to the bytes on the line.
    pub damage: Damage,
    /// The direction that it affects.
    pub way: Way,
    /// How many bytes in a row are one strike, at least 1.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub run: u32,
    /// When it strikes.
    pub when: When,
}

fn one() -> u32 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_one(run: &u32) -> bool {
    *run == 1
}

impl LineFault {
    /// A fault that strikes single bytes.
    #[must_use]
    pub fn new(damage: Damage, way: Way, when: When) -> LineFault {
        LineFault { damage, way, run: 1, when }
    }

    /// The same for this many bytes in a row.
    #[must_use]
    pub fn bytes(self, run: u32) -> LineFault {
        LineFault { run, ..self }
    }
}

/// The directions of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// What the controller sends.
    ToHost,
    /// What the host sends.
    ToController,
    /// Both.
    Both,
}

impl Way {
    /// Whether this direction includes that one, which is [to the host](Way::ToHost) or [to the
    /// controller](Way::ToController).
    #[must_use]
    pub fn has(self, way: Way) -> bool {
        self == Way::Both || self == way
    }
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Way::ToHost => "to-host",
            Way::ToController => "to-controller",
            Way::Both => "both",
        })
    }
}

/// What is done to the bytes on the line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Damage {
    /// A byte does not arrive.
    Drop,
    /// Another byte arrives.
    Garble(Garbling),
    /// A byte arrives twice.
    Duplicate,
    /// A byte arrives this much later, and no byte overtakes it.
    Delay(Duration),
    /// These bytes arrive before a byte; or by themselves, where the fault strikes once and waits for
    /// no byte in particular.
    Insert(Bytes),
    /// A byte arrives no sooner than this long after the one before it.
    Split(Duration),
    /// A byte, and all bytes that follow it within this time, arrive together when the time is
    /// over.
    Merge(Duration),
    /// A bit of a byte is flipped on the way. The receiver detects that by the parity bit.
    Parity(BadByte),
    /// A spike before a byte is taken for its start bit, one to eight bits too early: the receiver
    /// reads other bits, and often more than one byte.
    Framing(BadByte),
    /// The cable is cut: nothing arrives.
    Cut,
    /// The line is held low for this long: what is sent meanwhile is lost, and a zero arrives.
    Break(Duration),
    /// The host's line has this speed, in bits a second, whatever the controller's is: each
    /// receiver samples the other side's bits at its own speed.
    Speed(u32),
}

impl Damage {
    /// Whether it is a state of the line rather than something that happens to bytes: it affects
    /// everything and lasts until it is ended.
    #[must_use]
    pub fn lasts(&self) -> bool {
        matches!(self, Damage::Cut | Damage::Speed(_))
    }
}

/// How a byte becomes another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Garbling {
    /// One of its bits is flipped, chosen at random.
    Bit,
    /// These bits are flipped.
    Flip(u8),
    /// It becomes this byte.
    Into(u8),
}

/// What the receiving side does with a bad byte. A host sets this with its terminal settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BadByte {
    /// It takes the byte as it is, unchecked.
    #[default]
    AsIs,
    /// It drops the byte, as a terminal does with `IGNPAR`.
    Dropped,
    /// It takes a zero instead, as a terminal does with `INPCK`.
    Zero,
    /// It takes the byte with 255 and 0 before it, as a terminal does with `INPCK` and `PARMRK`.
    Marked,
}

impl BadByte {
    /// What is read for a bad byte.
    #[must_use]
    pub fn read(self, byte: u8) -> Bytes {
        match self {
            BadByte::AsIs => Bytes::copy_from_slice(&[byte]),
            BadByte::Dropped => Bytes::new(),
            BadByte::Zero => Bytes::from_static(&[0]),
            BadByte::Marked => Bytes::copy_from_slice(&[0xFF, 0, byte]),
        }
    }

    /// All of them, each with its word.
    pub const ALL: [(BadByte, &'static str); 4] = [
        (BadByte::AsIs, "as-is"),
        (BadByte::Dropped, "dropped"),
        (BadByte::Zero, "zero"),
        (BadByte::Marked, "marked"),
    ];
}
