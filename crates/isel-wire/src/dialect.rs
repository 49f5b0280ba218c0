//! Which language a controller speaks.

use serde::{Deserialize, Serialize};

/// The three command sets of the isel controllers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Dialect {
    /// The IMC4 of 1999 (imc4-1999-en).
    Imc4,
    /// The IMC4-M of 2005 (imc4-m-2005-de): IMC4 plus `k`, `Z`, `h`, `IL` and more of `D`.
    Imc4M,
    /// The iMC-M, iMC-MP and iMC-S8 of 2012 (imc-xx-2012-de), one command set for all three.
    ImcXx,
}

impl Dialect {
    /// All of them, in the order of their years.
    pub const ALL: [Self; 3] = [Self::Imc4, Self::Imc4M, Self::ImcXx];
}

/// What a line is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// DNC: `@`, the device number, a letter, parameters; executed at once (99 §2).
    Direct,
    /// CNC: a code and parameters; a line of the data field, to be executed later (99 §3).
    Stored,
}

impl Mode {
    /// Both of them.
    pub const ALL: [Self; 2] = [Self::Direct, Self::Stored];
}

/// How a number with a decimal point is treated, such as `12.7`.
///
/// No manual says. Host software sends fractions to the iMC-xx, so these drop them; the older
/// cards are assumed to refuse them. It is a quirk of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fractions {
    /// The number cannot be read: reply `1`.
    Reject,
    /// What follows the point is dropped: `12.7` is 12, `-0.5` is 0.
    Truncate,
}
