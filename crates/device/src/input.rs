//! What goes into a device.

use serde::{Deserialize, Serialize};

/// Something that happens to a device from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input<'a> {
    /// Bytes arrive on the line. Splitting them over several calls at the same time changes
    /// nothing.
    Bytes(&'a [u8]),
    /// A button, key, switch or input of the outside world takes a value.
    Signal(SignalId, i32),
    /// The mains switch: `false` takes the power away, `true` gives it back.
    Power(bool),
    /// Nothing but time has passed: perform what is due. Always allowed, never needed before
    /// the wake-up time that the device asked for.
    Wake,
}

/// The number of a signal, valid for the device that listed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SignalId(pub u16);

/// What kind of thing a signal is, and with it which values it takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SignalKind {
    /// 1 while pressed.
    Button,
    /// A switch with two named positions, see [`Signal::positions`].
    Switch,
    /// A digital input, 0 or 1.
    Input,
    /// A value in the given range.
    Analogue {
        /// Smallest value.
        low: i32,
        /// Largest value.
        high: i32,
    },
}

/// A thing of the outside world that a test or a person can set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Signal {
    /// Its number.
    pub id: SignalId,
    /// Its name as people type it, lower case: `start`, `cover`, `input 0.3`.
    pub name: String,
    /// Button, switch, input or analogue.
    pub kind: SignalKind,
    /// For a switch, the names of the values 0 and 1, as in `["open", "closed"]`.
    pub positions: Option<[String; 2]>,
    /// What it does, in a few words.
    pub about: String,
}
