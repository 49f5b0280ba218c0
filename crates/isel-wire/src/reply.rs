//! The answer of a controller: one byte, with no CR or LF after it.

use std::fmt;

use serde::{Deserialize, Serialize};

/// An answer of a controller, as the error chapters of the manuals list them
/// (99 §4, 05 §4, 12 §5).
///
/// Every line a controller hears is answered by exactly one of these bytes. Queries put their
/// data next to it; that is the controller's business, not the reply's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Reply {
    /// `0`: done, the next command may come.
    Done,
    /// `1`: a number that cannot be read or is out of its range.
    Number,
    /// `2`: a limit switch was hit, or an axis is not referenced (imc4, imc4-m).
    LimitSwitch,
    /// `3`: an axis that is not configured, or no combination of axes that is allowed.
    Axis,
    /// `4`: no axes are configured yet.
    NoAxes,
    /// `5`: no such command, or one that is malformed.
    Syntax,
    /// `6`: the memory for the stored program is full.
    MemoryFull,
    /// `7`: too many or too few parameters.
    Count,
    /// `8`: not a command that can be stored.
    NotStorable,
    /// `9`: the plant is not ready: no power, emergency stop, overtemperature.
    Plant,
    /// `D`: a speed outside its limits.
    Speed,
    /// `F`: the user stopped the motion.
    Stopped,
    /// `G`: a stored program or a remainder of a motion is (not) there.
    DataField,
    /// `H`: the cover is open.
    Cover,
    /// `R`: an axis must be referenced first (iMC-xx).
    Reference,
}

impl Reply {
    /// Every reply, in the order of the manuals.
    pub const ALL: [Self; 15] = [
        Self::Done,
        Self::Number,
        Self::LimitSwitch,
        Self::Axis,
        Self::NoAxes,
        Self::Syntax,
        Self::MemoryFull,
        Self::Count,
        Self::NotStorable,
        Self::Plant,
        Self::Speed,
        Self::Stopped,
        Self::DataField,
        Self::Cover,
        Self::Reference,
    ];

    /// The byte that goes over the line.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Done => b'0',
            Self::Number => b'1',
            Self::LimitSwitch => b'2',
            Self::Axis => b'3',
            Self::NoAxes => b'4',
            Self::Syntax => b'5',
            Self::MemoryFull => b'6',
            Self::Count => b'7',
            Self::NotStorable => b'8',
            Self::Plant => b'9',
            Self::Speed => b'D',
            Self::Stopped => b'F',
            Self::DataField => b'G',
            Self::Cover => b'H',
            Self::Reference => b'R',
        }
    }

    /// The reply a byte stands for, if it is one.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|reply| reply.code() == code)
    }

    /// What it says, for people: a lower-case fragment.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Number => "a number that is unreadable or out of range",
            Self::LimitSwitch => "limit switch",
            Self::Axis => "an axis that is not configured, or not possible",
            Self::NoAxes => "no axes configured",
            Self::Syntax => "unknown or malformed command",
            Self::MemoryFull => "program memory full",
            Self::Count => "wrong number of parameters",
            Self::NotStorable => "not a command that can be stored",
            Self::Plant => "the plant is not ready",
            Self::Speed => "a speed out of range",
            Self::Stopped => "stopped by the user",
            Self::DataField => "invalid data field",
            Self::Cover => "the cover is open",
            Self::Reference => "a reference run is needed",
        }
    }
}

impl fmt::Display for Reply {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", char::from(self.code()), self.meaning())
    }
}
