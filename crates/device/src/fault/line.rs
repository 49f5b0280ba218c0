//! What can go wrong on a serial line.

use std::fmt;
use std::time::Duration;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use super::When;

/// Something that goes wrong on the line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LineFault {
    /// What is done to what is on the line.
    pub damage: Damage,
    /// Which way that goes.
    pub way: Way,
    /// So many bytes in a row are one strike, at least 1.
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

    /// The same for so many bytes in a row.
    #[must_use]
    pub fn bytes(self, run: u32) -> LineFault {
        LineFault { run, ..self }
    }
}

/// The ways of a line.
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
    /// Whether what goes that way, [to the host](Way::ToHost) or [to the
    /// controller](Way::ToController), goes this way, too.
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

/// What is done to what is on the line.
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
    /// A byte arrives so much later, and no byte overtakes it.
    Delay(Duration),
    /// These bytes arrive before a byte; or by themselves, where the fault strikes once and waits for
    /// no byte in particular.
    Insert(Bytes),
    /// A byte arrives no sooner than so long after the one before it.
    Split(Duration),
    /// A byte, and whatever follows it within this time, arrives when the time is over, all at once.
    Merge(Duration),
    /// A bit of a byte is turned over on the way, which whoever reads it learns from its parity bit.
    Parity(BadByte),
    /// A spike before a byte is taken for its start bit, one to eight bits too early: what is read are
    /// other bits, and often more bytes than one.
    Framing(BadByte),
    /// The cable is cut: nothing arrives.
    Cut,
    /// The line is held low for so long: what is sent meanwhile is lost, and a zero arrives.
    Break(Duration),
    /// The host has its line at this speed, in bits a second, whatever that of the controller is:
    /// what arrives is what a receiver reads that samples the bits of the other in its own time.
    Speed(u32),
}

impl Damage {
    /// Whether it is a state of the line rather than something that happens to bytes: there is
    /// nothing to choose, and it lasts until it is ended.
    #[must_use]
    pub fn lasts(&self) -> bool {
        matches!(self, Damage::Cut | Damage::Speed(_))
    }
}

/// How a byte becomes another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Garbling {
    /// One of its bits is turned over, by chance any of them.
    Bit,
    /// These of its bits are turned over.
    Flip(u8),
    /// It becomes this byte.
    Into(u8),
}

/// What whoever reads does with a byte that its receiver calls bad. A host decides that by the settings
/// of its terminal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BadByte {
    /// It takes it as it is: nobody looks.
    #[default]
    AsIs,
    /// It drops it, as a terminal does with `IGNPAR`.
    Dropped,
    /// It takes a zero for it, as a terminal does with `INPCK`.
    Zero,
    /// It takes it with 255 and 0 before it, as a terminal does with `INPCK` and `PARMRK`.
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

    pub(super) const ALL: [(BadByte, &'static str); 4] = [
        (BadByte::AsIs, "as-is"),
        (BadByte::Dropped, "dropped"),
        (BadByte::Zero, "zero"),
        (BadByte::Marked, "marked"),
    ];
}
