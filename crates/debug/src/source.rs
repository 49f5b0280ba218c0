//! The text that the commands come from.

use vimc4_device::CommandNumber;

/// The job file, list of commands or plot that the commands of a history come from, and which line
/// each of them comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// What it is called: the path of the file.
    pub name: String,
    /// Its lines.
    pub lines: Vec<String>,
    /// The line (from 1) of each command, in their order, beginning with command number `first`. 0
    /// for a command that comes from no line.
    pub of_command: Vec<u32>,
    /// The number of the first of these commands; by default the first of all.
    pub first: Option<CommandNumber>,
    /// The numbers of commands that came by hand on the way of the present, in order: they come from no
    /// line, and those of the lines behind them are higher.
    pub by_hand: Vec<CommandNumber>,
}

impl Source {
    /// A text in which every line that is not empty is one command.
    #[must_use]
    pub fn of_lines(name: impl Into<String>, text: &str) -> Source {
        let lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let full = (1..).zip(&lines).filter(|(_, line)| !line.trim().is_empty());
        let of_command = full.map(|(number, _)| number).collect();
        Source { name: name.into(), of_command, lines, ..Source::default() }
    }

    /// The line, from 1, that a command comes from.
    #[must_use]
    pub fn line_of(&self, command: CommandNumber) -> Option<u32> {
        let first = self.first.unwrap_or(CommandNumber::FIRST);
        let before = self.by_hand.partition_point(|own| *own < command);
        if self.by_hand.get(before) == Some(&command) {
            return None;
        }
        let place = command.0.get().checked_sub(first.0.get())?.checked_sub(before as u64)?;
        let line = *self.of_command.get(usize::try_from(place).ok()?)?;
        (line > 0).then_some(line)
    }

    /// Whether a command is the first of its line.
    #[must_use]
    pub(crate) fn begins_line(&self, command: CommandNumber) -> Option<u32> {
        let line = self.line_of(command)?;
        let mut before = command.0.get();
        let before = loop {
            before = before.saturating_sub(1);
            match std::num::NonZeroU64::new(before).map(CommandNumber) {
                Some(number) if self.by_hand.binary_search(&number).is_ok() => {}
                number => break number.and_then(|number| self.line_of(number)),
            }
        };
        (before != Some(line)).then_some(line)
    }

    /// The first command of a line, or of the first line after it that has one.
    #[must_use]
    pub fn command_at(&self, line: u32) -> Option<(CommandNumber, u32)> {
        let found = self.of_command.iter().enumerate().filter(|(_, of)| **of >= line && **of > 0);
        let (place, of) = found.min_by_key(|(place, of)| (**of, *place))?;
        let first = self.first.unwrap_or(CommandNumber::FIRST);
        let mut number = first.0.checked_add(place as u64)?;
        for own in &self.by_hand {
            if own.0 <= number {
                number = number.checked_add(1)?;
            }
        }
        Some((CommandNumber(number), *of))
    }
}
