//! What goes into a device.

use std::ops::RangeInclusive;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::Time;

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

/// An [`Input`] that owns its bytes, so that it can be kept, written down and given again.
///
/// ```
/// use vimc4_device::{Input, OwnedInput};
///
/// let kept = OwnedInput::from(Input::Bytes(b"@0P\r"));
/// assert_eq!(kept.as_input(), Input::Bytes(b"@0P\r"));
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OwnedInput {
    /// See [`Input::Bytes`].
    Bytes(Bytes),
    /// See [`Input::Signal`].
    Signal(SignalId, i32),
    /// See [`Input::Power`].
    Power(bool),
    /// See [`Input::Wake`].
    Wake,
}

impl OwnedInput {
    /// The input, to be given to a device.
    #[must_use]
    pub fn as_input(&self) -> Input<'_> {
        match self {
            OwnedInput::Bytes(bytes) => Input::Bytes(bytes),
            OwnedInput::Signal(id, value) => Input::Signal(*id, *value),
            OwnedInput::Power(on) => Input::Power(*on),
            OwnedInput::Wake => Input::Wake,
        }
    }
}

impl From<Input<'_>> for OwnedInput {
    fn from(input: Input<'_>) -> OwnedInput {
        match input {
            Input::Bytes(bytes) => OwnedInput::Bytes(Bytes::copy_from_slice(bytes)),
            Input::Signal(id, value) => OwnedInput::Signal(id, value),
            Input::Power(on) => OwnedInput::Power(on),
            Input::Wake => OwnedInput::Wake,
        }
    }
}

/// An input and the time it is given at. Whoever gives equal devices the same of these, in the
/// same order, gets equal devices and equal outputs: they are all that a recording needs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimedInput {
    /// The model time.
    pub at: Time,
    /// The input.
    pub input: OwnedInput,
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

impl Signal {
    /// The values that it takes.
    #[must_use]
    pub fn values(&self) -> RangeInclusive<i32> {
        match self.kind {
            SignalKind::Analogue { low, high } => low..=high,
            SignalKind::Button | SignalKind::Switch | SignalKind::Input => 0..=1,
        }
    }

    /// The value of a switch in the position of that name.
    #[must_use]
    pub fn position(&self, name: &str) -> Option<i32> {
        let mut positions = (0..).zip(self.positions.iter().flatten());
        positions.find(|(_, position)| *position == name).map(|(value, _)| value)
    }

    /// The value that a word stands for: the name of a position, or a number that it takes.
    #[must_use]
    pub fn value_of(&self, word: &str) -> Option<i32> {
        let number = || word.parse().ok().filter(|value| self.values().contains(value));
        self.position(word).or_else(number)
    }
}
