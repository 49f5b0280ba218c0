//! What comes out of a device.

use std::fmt;
use std::num::NonZeroU64;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::{Event, Time};

/// The outputs of a device, in the order in which they happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Output {
    /// Bytes leave on the line at this time. A late wake-up by the host changes nothing: the time
    /// is the model's.
    Bytes(Time, Bytes),
    /// The non-volatile memory changes. It comes out before the answer that confirms it. So a host
    /// that writes it to disk before passing on what follows never confirms what it could lose.
    Flash(Time, FlashChange),
    /// A watched event happened.
    Event(Stamp, Event),
}

impl Output {
    /// What happened, if it is an event.
    #[must_use]
    pub fn event(&self) -> Option<&Event> {
        match self {
            Output::Event(_, event) => Some(event),
            Output::Bytes(..) | Output::Flash(..) => None,
        }
    }
}

/// When something happened, and because of which command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    /// The model time.
    pub at: Time,
    /// The command that it belongs to: the beginning of a command, its answer and all its
    /// consequences have the same number. `None` for what no command has caused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<CommandNumber>,
}

/// An event that no command has caused.
impl From<Time> for Stamp {
    fn from(at: Time) -> Stamp {
        Stamp { at, command: None }
    }
}

/// The number of a command: a device counts, from 1, the commands that it takes from its line. The
/// count is part of its state, so it is the same whether anything watches or not, and goes on after a restart of
/// the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct CommandNumber(pub NonZeroU64);

impl CommandNumber {
    /// The number of the first command.
    pub const FIRST: CommandNumber = CommandNumber(NonZeroU64::MIN);

    /// The number of the command after this one.
    #[must_use]
    pub const fn next(self) -> CommandNumber {
        CommandNumber(self.0.saturating_add(1))
    }
}

impl fmt::Display for CommandNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A change of the non-volatile memory's image. The format of the image is the device's own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FlashChange {
    /// These bytes are added at the end of the image.
    Append(Bytes),
    /// The whole image is replaced by these bytes.
    Replace(Bytes),
}
