//! The stored program.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_isel_wire::{AxisSet, Command};

/// What a stored program is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Validity {
    /// It is being stored, or storing was cut off.
    Incomplete,
    /// An error was made while it was stored.
    Invalid,
    /// It has its end and can run.
    Valid,
}

/// A line of a program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredLine {
    /// What it does.
    pub command: Command,
    /// The line as it was received.
    pub text: Vec<u8>,
}

/// A CNC data field.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    /// The lines, without the end mark. Copied only when a program grows while a snapshot of
    /// it exists.
    pub lines: Arc<Vec<StoredLine>>,
    /// What it is worth.
    pub validity: Validity,
    /// The axes that were configured when it was stored.
    pub axes: AxisSet,
    /// The reference speeds when its end was stored, Hz.
    pub speeds: [u32; 4],
    /// Bytes of flash memory it takes.
    pub size: u32,
}

impl Program {
    /// A program without lines, stored with `axes`.
    #[must_use]
    pub fn begin(axes: AxisSet, speeds: [u32; 4]) -> Program {
        Program { lines: Arc::default(), validity: Validity::Incomplete, axes, speeds, size: 0 }
    }

    /// Adds a line that takes `size` bytes.
    pub fn push(&mut self, line: StoredLine, size: u32) {
        Arc::make_mut(&mut self.lines).push(line);
        self.size = self.size.saturating_add(size);
    }

    /// The command of a line.
    #[must_use]
    pub fn command(&self, line: u32) -> Option<&Command> {
        self.lines.get(line as usize).map(|line| &line.command)
    }

    /// How many lines it has.
    #[must_use]
    pub fn len(&self) -> u32 {
        u32::try_from(self.lines.len()).unwrap_or(u32::MAX)
    }

    /// Whether it has no lines.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }
}
