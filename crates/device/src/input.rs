//! What goes into a device.

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::{Faulting, Ruling, SignalId, Time};

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
    /// A [fault](crate::Fault) begins or ends. A device that knows no such fault does nothing.
    Fault(&'a Faulting),
    /// A [scenario](crate::Scenario) begins or ends. Only a [`Line`](crate::Line) acts on it.
    Rule(&'a Ruling),
    /// Only time has passed: perform what is due. Always allowed, never needed before the wake-up
    /// time that the device asked for.
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
    /// See [`Input::Fault`].
    Fault(Faulting),
    /// See [`Input::Rule`].
    Rule(Ruling),
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
            OwnedInput::Fault(faulting) => Input::Fault(faulting),
            OwnedInput::Rule(ruling) => Input::Rule(ruling),
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
            Input::Fault(faulting) => OwnedInput::Fault(faulting.clone()),
            Input::Rule(ruling) => OwnedInput::Rule(ruling.clone()),
            Input::Wake => OwnedInput::Wake,
        }
    }
}

/// An input and the time it is given at. Equal devices that get the same of these in the same order
/// stay equal and give equal outputs, so a recording needs nothing else.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimedInput {
    /// The model time.
    pub at: Time,
    /// The input.
    pub input: OwnedInput,
}
