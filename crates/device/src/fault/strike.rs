//! What a fault has done.

use std::fmt;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use super::{MachineStrike, Way};
use crate::{escape, show_nanos};

/// What a fault has done, once.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Strike {
    /// Something on the line arrives differently from how it was sent.
    Line {
        /// Which way it went.
        way: Way,
        /// What was sent.
        sent: Bytes,
        /// What arrives.
        arrives: Bytes,
        /// How much later than without the fault, in nanoseconds.
        late: u64,
    },
    /// Something has changed in the machine.
    Machine(MachineStrike),
}

/// In a few words, for people: what follows "fault 3".
impl fmt::Display for Strike {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (way, sent, arrives, late) = match self {
            Strike::Line { way, sent, arrives, late } => (way, sent, arrives, late),
            Strike::Machine(strike) => return strike.fmt(f),
        };
        let whose = match way {
            Way::ToHost => "to the host",
            Way::ToController => "to the controller",
            Way::Both => "on the line",
        };
        match (sent.as_ref(), arrives.as_ref()) {
            ([], []) => write!(f, "struck {whose}")?,
            ([], arrives) => write!(f, "put {} in {whose}", escape(arrives))?,
            (sent, []) => write!(f, "lost {} {whose}", escape(sent))?,
            (sent, arrives) if sent == arrives => write!(f, "held {} up {whose}", escape(sent))?,
            (sent, arrives) => {
                write!(f, "made {} of {} {whose}", escape(arrives), escape(sent))?;
            }
        }
        match late {
            0 => Ok(()),
            late => write!(f, ", {} late", show_nanos(*late)),
        }
    }
}
