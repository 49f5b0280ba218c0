//! What is wrong with a line, in more detail than a reply can say.

use serde::{Deserialize, Serialize};

use crate::axes::AxisSet;
use crate::reply::Reply;

/// Why a line is not a command. [`Fault::reply`] is what is answered; the rest is for code that wants
/// to tell a person.
///
/// Fields are counted from 0; [`Frame::field`](crate::Frame::field) has their bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// It does not begin with `@` and the number of a controller: `5`.
    NoAddress,
    /// What follows the number of the controller is nothing, or nothing that begins a command: `5`.
    NoCommand,
    /// It does not begin with the code of a line that can be stored: `8`.
    NotStorable,
    /// It has too many or too few fields: `7`.
    Count {
        /// There should be this many, or …
        right: u8,
        /// … this many; mostly the same.
        or: u8,
    },
    /// How many fields there should be depends on the axes, and none are configured: `7`.
    CountWithoutAxes,
    /// A field is not a number, or not a permitted one: `1`.
    Number {
        /// Which.
        field: u8,
        /// What is wrong with it.
        wrong: WrongNumber,
    },
    /// The text of `IU` is too long, or no text: `1`.
    Text,
    /// A speed outside its limits: `D`.
    Speed {
        /// Its field.
        field: u8,
        /// The lowest that is right, Hz.
        low: u32,
        /// The highest, Hz.
        high: u32,
    },
    /// Not a permitted set of axes: `3`.
    Axes {
        /// Its field.
        field: u8,
        /// What is wrong with it.
        wrong: WrongAxes,
    },
}

/// Why a number is not permitted where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WrongNumber {
    /// It is none.
    Unreadable,
    /// It has a decimal point, see [`Fractions::Reject`](crate::Fractions::Reject).
    Fraction,
    /// It is out of its range.
    Outside {
        /// The smallest that is right.
        low: i64,
        /// The largest.
        high: i64,
    },
    /// It is neither −1 nor 1, nor 0 where `zero` says that this is right.
    NoSign {
        /// Whether 0 is right as well.
        zero: bool,
    },
    /// It is neither the number of a bit nor 128, the whole byte.
    NoBit,
    /// There is no such port to read.
    NotReadable,
    /// There is no such port to write, or it does not take this value.
    NotWritable,
    /// It leads to before the data field.
    BeforeProgram,
    /// A loop leads forward, or nowhere.
    LoopAhead,
    /// A helix has a way of its third axis and none in its plane.
    HelixWithoutArc,
}

/// Why a number is not a permitted set of axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WrongAxes {
    /// No set that can be configured has this number.
    NoConfiguration,
    /// It means no axes, or A together with others.
    NoSet,
    /// These of its axes are not configured.
    NotConfigured(AxisSet),
    /// It has more than one axis.
    NotSingle,
}

impl Fault {
    /// The reply.
    #[must_use]
    pub const fn reply(self) -> Reply {
        match self {
            Self::NoAddress | Self::NoCommand => Reply::Syntax,
            Self::NotStorable => Reply::NotStorable,
            Self::Count { .. } | Self::CountWithoutAxes => Reply::Count,
            Self::Number { .. } | Self::Text => Reply::Number,
            Self::Speed { .. } => Reply::Speed,
            Self::Axes { .. } => Reply::Axis,
        }
    }

    /// The field that is wrong, where it is one.
    #[must_use]
    pub const fn field(self) -> Option<usize> {
        match self {
            Self::Number { field, .. } | Self::Speed { field, .. } | Self::Axes { field, .. } => {
                Some(field as usize)
            }
            _ => None,
        }
    }

    /// A number that is not permitted in a field.
    pub(crate) const fn number(field: usize, wrong: WrongNumber) -> Self {
        Self::Number { field: field as u8, wrong }
    }
}

impl From<Fault> for Reply {
    fn from(fault: Fault) -> Self {
        fault.reply()
    }
}
