//! What can go wrong with a machine.

use std::fmt;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::When;
use crate::SignalId;

/// Something that goes wrong with the machine. It strikes when it begins, and its change lasts
/// until it ends; the probability in [`When`] does not apply.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MachineFault {
    /// What goes wrong.
    pub mishap: Mishap,
    /// When it strikes.
    pub when: When,
}

impl MachineFault {
    /// A fault that begins at once and lasts until it is ended.
    #[must_use]
    pub fn new(mishap: Mishap) -> MachineFault {
        MachineFault { mishap, when: When::ALWAYS }
    }
}

/// What goes wrong with a machine. Axes are numbers, 0 for X.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Mishap {
    /// A limit switch reports a wrong state.
    Switch {
        /// The axis.
        axis: u8,
        /// Whether it is the switch at the positive end.
        positive: bool,
        /// What it reports instead.
        says: SwitchSays,
    },
    /// The two limit switches of an axis are plugged in the wrong way round.
    Swapped(u8),
    /// An axis has this many more steps of play.
    Backlash {
        /// The axis.
        axis: u8,
        /// Steps.
        steps: u32,
    },
    /// An axis has this much more load.
    Load {
        /// The axis.
        axis: u8,
        /// The acceleration in Hz/ms that would load it as much.
        pull: u32,
    },
    /// The motor of an axis cannot turn.
    Jam(u8),
    /// The carriage of an axis is pushed by this many steps, once, without the controller knowing.
    Push {
        /// The axis.
        axis: u8,
        /// Steps of the machine.
        steps: i64,
    },
    /// A signal is held at a value, regardless of what it is set to. When the fault ends it has the
    /// value that was set last.
    Hold {
        /// The signal.
        signal: SignalId,
        /// The value.
        value: i32,
    },
    /// A contact bounces when it opens or closes: it opens and closes again this many times.
    Bounce {
        /// The signal, a limit switch or an input.
        signal: SignalId,
        /// How many times it goes back to what it was.
        times: u8,
        /// The time between two changes, 1 ns at least.
        period: Duration,
    },
    /// The mains are off.
    Power,
}

impl Mishap {
    /// Whether the fault has an effect as soon as it begins. A jam, a load or a bouncing contact has
    /// one only when an axis moves or the contact changes.
    #[must_use]
    pub fn strikes_at_once(&self) -> bool {
        !matches!(self, Mishap::Jam(_) | Mishap::Load { .. } | Mishap::Bounce { .. })
    }
}

/// What a faulty limit switch reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SwitchSays {
    /// It is stuck, as if it were always pressed.
    Pressed,
    /// It is stuck, as if it were never pressed.
    Released,
    /// It is not plugged in: the controller sees no switch.
    Nothing,
    /// It releases this many steps further back than it should.
    Late(u32),
}

/// What a fault of the machine has done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum MachineStrike {
    /// What it changes has changed.
    Changed,
    /// The motor of an axis stands: the axis, and what the controller calls it.
    Stands(u8, String),
    /// A contact has opened or closed, and bounces.
    Bounces,
}

/// In a few words, for people: what follows "fault 3".
impl fmt::Display for MachineStrike {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MachineStrike::Changed => f.write_str("has struck"),
            MachineStrike::Stands(_, name) => write!(f, "makes the motor of {name} stand"),
            MachineStrike::Bounces => f.write_str("makes a contact bounce"),
        }
    }
}
