//! The stored program.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_isel_wire::{Addressed, AxisSet, Command, Context, Fault, Mode, Op, parse};

use crate::model::{Model, StoredArcs};
use crate::why::Why;

/// The validity of a stored program.
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
    /// Its validity.
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

/// Reads a line to be stored: the command, and how much flash memory it takes.
pub(crate) fn parse_stored(
    text: &[u8],
    model: &Model,
    context: &Context<'_>,
) -> Result<(Command, u32), (Option<Op>, Why)> {
    let frame = match parse(text, model.command_set.dialect(), Mode::Stored, 0) {
        Ok(Addressed::Frame(frame)) => frame,
        Ok(Addressed::OtherDevice) => return Err((None, Fault::NotStorable.into())),
        Err(fault) => return Err((None, fault.into())),
    };
    let command = frame.decode(context).map_err(|fault| (Some(frame.op()), fault.into()))?;
    if model.quirks.stored_arcs == StoredArcs::Check && !has_plane(&command, context.axes) {
        return Err((Some(frame.op()), Why::NoPlane));
    }
    let parameters = u32::try_from(frame.field_count()).unwrap_or(u32::MAX);
    let parameters = model.flash.parameter_bytes.saturating_mul(parameters);
    let size = model.flash.command_bytes.saturating_add(parameters);
    Ok((command, size))
}

/// Whether some plane, which a line before this one may have chosen, has the axes that a circle or
/// a helix needs.
fn has_plane(command: &Command, axes: AxisSet) -> bool {
    let linear = (0..3).filter(|&axis| axes.has(axis)).count();
    match command {
        Command::Circle(_) => linear >= 2,
        Command::Helix(..) => linear == 3,
        _ => true,
    }
}

/// Reads a line of a program from a flash image.
pub(crate) fn read_stored(
    text: &[u8],
    program: &Program,
    model: &Model,
) -> Result<(Command, u32), String> {
    let context = model.context(program.axes, Some(program.len()));
    parse_stored(text, model, &context).map_err(|(_, why)| {
        let text = text.escape_ascii();
        format!("`{text}` cannot be stored on the model {}: {}", model.name, why.reply().meaning())
    })
}
