//! One thing that happened.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_device::{CommandNumber, Deed, Event, Time};

/// One thing that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Its number, from 1, which counts everything that was kept.
    pub number: u64,
    /// The model time.
    pub at: Time,
    /// The command that it belongs to: the command, its answer and all that comes of it have the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<CommandNumber>,
    /// A description of a command: `relative move X +5,000 steps at 900 Hz`; empty for anything
    /// else.
    #[serde(default, skip_serializing_if = "str::is_empty")]
    pub means: Arc<str>,
    /// What.
    #[serde(flatten)]
    pub what: What,
}

/// What an [`Entry`] tells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum What {
    /// Something happened in the controller or to its machine.
    Event(Event),
    /// Somebody did something that is not a command.
    Deed {
        /// Who.
        by: Arc<str>,
        /// What.
        deed: Deed,
    },
}

impl Entry {
    /// What happened in the controller, if it is that.
    #[must_use]
    pub fn event(&self) -> Option<&Event> {
        match &self.what {
            What::Event(event) => Some(event),
            What::Deed { .. } => None,
        }
    }
}
