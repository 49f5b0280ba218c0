//! The commands that a log has shown, so that their answers can be shown with them.

use std::collections::VecDeque;
use std::time::Duration;

use bytes::Bytes;
use vimc4_device::{CommandNumber, Time};

/// Those that have begun last.
#[derive(Debug, Default)]
pub(crate) struct Begun(VecDeque<OpenCommand>);

/// A command that has begun.
#[derive(Debug)]
struct OpenCommand {
    number: CommandNumber,
    bytes: Bytes,
    /// When it began; `None` once it has been answered. Only the first answer tells how long it
    /// took.
    at: Option<Time>,
}

/// What is shown with an answer.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Answered<'a> {
    /// The command that is answered, if it is not the last one shown.
    pub(crate) to: Option<&'a Bytes>,
    /// How long the command took; `None` if it has had an answer before.
    pub(crate) took: Option<Duration>,
}

impl Begun {
    /// How many are kept. More are hardly open at a time; answered ones are dropped first.
    const MOST: usize = 64;

    /// A command has begun.
    pub(crate) fn begin(&mut self, number: CommandNumber, bytes: &Bytes, at: Time) {
        let commands = &mut self.0;
        if commands.len() == Self::MOST {
            let place = commands.iter().position(|command| command.at.is_none());
            commands.remove(place.unwrap_or_default());
        }
        commands.push_back(OpenCommand { number, bytes: bytes.clone(), at: Some(at) });
    }

    /// One has been answered.
    pub(crate) fn answer(&mut self, number: CommandNumber, at: Time) -> Answered<'_> {
        let commands = &mut self.0;
        let Some(place) = commands.iter().rposition(|command| command.number == number) else {
            return Answered::default();
        };
        let last = place + 1 == commands.len();
        let Some(command) = commands.get_mut(place) else { return Answered::default() };
        let took = command.at.take().map(|began| at - began);
        Answered { to: (!last).then_some(&command.bytes), took }
    }
}
