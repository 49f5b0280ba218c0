//! Faults: what goes wrong around a device, as plain data.
//!
//! A fault says what goes wrong and [when](When). It begins and ends as an
//! [input](crate::Input::Fault) with a time like any other, so recordings carry faults, histories
//! replay them, and a state has those that are there in it. Each has a number, by which it is ended.
//!
//! [`Line`](crate::Line) handles faults of the line. It also keeps the times of all others: a
//! device is given a fault at the instant from which it may strike, and is told when it ends.

mod line;
mod machine;
mod strike;
mod text;
mod when;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use line::{BadByte, Damage, Garbling, LineFault, Way};
pub use machine::{MachineFault, MachineStrike, Mishap, SwitchSays};
pub use strike::Strike;
pub use when::{Awaited, Chance, When};

/// Something that goes wrong.
///
/// It has a text form, which people type: `drop to-host once`, `garble to-controller 2 bytes after
/// command @A`, `cut both for 200ms`. [`Names`](crate::Names) writes it with the names that a
/// device has for its axes and signals, and `vimc4-language` reads it.
///
/// ```
/// use vimc4_device::{Damage, Fault, LineFault, Way, When};
///
/// let when = When { first: 10, every: 10, ..When::times(3) };
/// let fault = Fault::from(LineFault::new(Damage::Drop, Way::ToHost, when));
/// assert_eq!(fault.to_string(), "drop to-host 3 times every 10th");
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Fault {
    /// Of the serial line.
    Line(LineFault),
    /// Of the machine.
    Machine(MachineFault),
}

impl Fault {
    /// When it strikes.
    #[must_use]
    pub fn when(&self) -> &When {
        match self {
            Fault::Line(fault) => &fault.when,
            Fault::Machine(fault) => &fault.when,
        }
    }

    /// What it is, if it is one of the line.
    #[must_use]
    pub fn of_line(&self) -> Option<&LineFault> {
        match self {
            Fault::Line(fault) => Some(fault),
            Fault::Machine(_) => None,
        }
    }
}

impl From<LineFault> for Fault {
    fn from(fault: LineFault) -> Fault {
        Fault::Line(fault)
    }
}

impl From<MachineFault> for Fault {
    fn from(fault: MachineFault) -> Fault {
        Fault::Machine(fault)
    }
}

/// The number of a fault, by which it is ended.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct FaultNumber(pub u32);

impl FaultNumber {
    /// Stands for the number that is next: one more than the highest that a fault ever had.
    pub const NEXT: FaultNumber = FaultNumber(0);

    /// The number of the speed that the client of a pseudo-terminal has set, where that counts.
    pub const TERMINAL: FaultNumber = FaultNumber(u32::MAX);

    pub(crate) fn is_next(&self) -> bool {
        *self == FaultNumber::NEXT
    }
}

impl fmt::Display for FaultNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            FaultNumber::TERMINAL => f.write_str("terminal"),
            FaultNumber(number) => number.fmt(f),
        }
    }
}

/// The most faults that there are at once. One more takes the place of the oldest that is over; while
/// none is, there can be no other, and beginning one does nothing.
pub const MOST_FAULTS: usize = 1_000;

/// An order about faults.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Faulting {
    /// A fault begins, with this number, unless there are [as many](MOST_FAULTS) as there can be. One
    /// that has the number already ends.
    Begin(FaultNumber, Fault),
    /// The fault of this number ends, if there is one.
    End(FaultNumber),
    /// All faults end.
    EndAll,
}

/// A fault that a device has.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultView {
    /// Its number.
    pub number: FaultNumber,
    /// What it is.
    pub fault: Fault,
    /// How far it has come.
    pub stage: FaultStage,
    /// How often it has struck.
    pub struck: u64,
}

/// How far a fault has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultStage {
    /// It waits for its prerequisites.
    Waits,
    /// It strikes when there is something to strike.
    Strikes,
    /// It has struck as often as it was to, or its time is over.
    Over,
}

impl fmt::Display for FaultStage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            FaultStage::Waits => "waits",
            FaultStage::Strikes => "strikes",
            FaultStage::Over => "is over",
        })
    }
}

/// News of a fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FaultNews {
    /// It was begun.
    Begins(Box<Fault>),
    /// Its prerequisites have come: it strikes from now on.
    Armed,
    /// It has struck.
    Strikes(Strike),
    /// It was ended.
    Ends,
}

/// In a few words, for people: what follows "fault 3".
impl fmt::Display for FaultNews {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FaultNews::Begins(fault) => write!(f, "begins: {fault}"),
            FaultNews::Armed => f.write_str("strikes from now on"),
            FaultNews::Strikes(strike) => strike.fmt(f),
            FaultNews::Ends => f.write_str("ends"),
        }
    }
}
