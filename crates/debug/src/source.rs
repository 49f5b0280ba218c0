//! The text that the commands come from.

use vimc4_device::CommandNumber;

/// A job file, a list of commands or a plot whose commands a history is of, and which line each of
/// them comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// What it is called: the path of the file.
    pub name: String,
    /// Its lines.
    pub lines: Vec<String>,
    /// The line (from 1) of each command, in the order of the commands, from that of the number
    /// `first` on. 0 for a command that comes from no line.
    pub of_command: Vec<u32>,
    /// The number of the first of these commands; the first of all, if none is said.
    pub first: Option<CommandNumber>,
}

impl Source {
    /// One whose every line is one command, except for lines that are empty.
    #[must_use]
    pub fn of_lines(name: impl Into<String>, text: &str) -> Source {
        let lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let full = (1..).zip(&lines).filter(|(_, line)| !line.trim().is_empty());
        let of_command = full.map(|(number, _)| number).collect();
        Source { name: name.into(), of_command, lines, first: None }
    }

    /// The line, from 1, that a command comes from.
    #[must_use]
    pub fn line_of(&self, command: CommandNumber) -> Option<u32> {
        let first = self.first.unwrap_or(CommandNumber::FIRST);
        let place = command.0.get().checked_sub(first.0.get())?;
        let line = *self.of_command.get(usize::try_from(place).ok()?)?;
        (line > 0).then_some(line)
    }

    /// Whether a line is begun with a command: the one before it is of another.
    #[must_use]
    pub fn begins_line(&self, command: CommandNumber) -> Option<u32> {
        let line = self.line_of(command)?;
        let before = command.0.get().checked_sub(1).and_then(std::num::NonZeroU64::new);
        let before = before.and_then(|number| self.line_of(CommandNumber(number)));
        (before != Some(line)).then_some(line)
    }

    /// The first command that comes from a line, or from the first after it that has one.
    #[must_use]
    pub fn command_at(&self, line: u32) -> Option<(CommandNumber, u32)> {
        let found = self.of_command.iter().enumerate().filter(|(_, of)| **of >= line && **of > 0);
        let (place, of) = found.min_by_key(|(place, of)| (**of, *place))?;
        let first = self.first.unwrap_or(CommandNumber::FIRST);
        let number = first.0.checked_add(place as u64)?;
        Some((CommandNumber(number), *of))
    }
}
