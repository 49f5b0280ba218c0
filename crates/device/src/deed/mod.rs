//! What is done to a device from outside, besides commands.

mod inputs;
mod words;

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::Faulting;

pub use inputs::{DeedError, is_like, settable};
pub use words::{faults_in_words, position_in_words, rules_in_words};

/// Something that is done to a device and is not a command: a byte that acts at once, the panel,
/// the power. It is enough to repeat the act.
///
/// ```
/// use vimc4_device::{Deed, OwnedInput, Signal, SignalId};
///
/// let stop = Signal::button(SignalId(1), "stop", "STOP button");
/// let inputs = Deed::Press("stop".to_owned()).inputs(std::slice::from_ref(&stop));
/// let pressed = |value| OwnedInput::Signal(stop.id, value);
/// assert_eq!(inputs, Ok(vec![pressed(1), pressed(0)]));
/// let wrong = Deed::Press("stpo".to_owned()).inputs(&[stop]).unwrap_err();
/// assert_eq!(wrong.to_string(), "there is no button `stpo`; did you mean stop?");
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Deed {
    /// A byte came that acts at once, see [`Device::is_urgent`](crate::Device::is_urgent).
    Byte(u8),
    /// A button was pressed, and released at the same instant unless it latches.
    Press(String),
    /// A button was pressed.
    Hold(String),
    /// A button was released.
    Release(String),
    /// A switch was put into a position.
    Turn(String, String),
    /// A bit of an input port was set.
    Input {
        /// The port.
        port: u16,
        /// The bit.
        bit: u8,
        /// The level.
        level: bool,
    },
    /// A signal was set.
    Set(String, i32),
    /// Several signals were set at the same instant, in this order.
    Several {
        /// What that is in one word, such as `erase`.
        what: String,
        /// The signals.
        signals: Vec<(String, i32)>,
    },
    /// The power was taken away or given back.
    Power(bool),
    /// A fault began or ended.
    Fault(Box<Faulting>),
    /// The device was put back into an earlier state.
    Restore,
}

/// As it is ordered.
impl fmt::Display for Deed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Deed::Byte(byte) => write!(f, "{byte}"),
            Deed::Press(button) => write!(f, "press {button}"),
            Deed::Hold(button) => write!(f, "hold {button}"),
            Deed::Release(button) => write!(f, "release {button}"),
            Deed::Turn(switch, position) => write!(f, "{switch} {position}"),
            Deed::Input { port, bit, level } => {
                write!(f, "input {port}.{bit} {}", u8::from(*level))
            }
            Deed::Set(signal, value) => write!(f, "set {signal} {value}"),
            Deed::Several { what, .. } => f.write_str(what),
            Deed::Power(true) => f.write_str("power on"),
            Deed::Power(false) => f.write_str("power off"),
            Deed::Fault(faulting) => write!(f, "fault {faulting}"),
            Deed::Restore => f.write_str("restore"),
        }
    }
}

impl Deed {
    /// The name of the signal that it is done to, if it is one by name.
    #[must_use]
    pub fn signal(&self) -> Option<&str> {
        match self {
            Deed::Press(name)
            | Deed::Hold(name)
            | Deed::Release(name)
            | Deed::Turn(name, _)
            | Deed::Set(name, _) => Some(name),
            _ => None,
        }
    }
}
