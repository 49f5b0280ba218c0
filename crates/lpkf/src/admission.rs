//! Admission of commands: whether a received command is carried out at once, waits for its turn or
//! is refused.

use crate::buffer::Entry;
use crate::language::{Command, Status};
use crate::model::{AfterStatus, UnknownCommand};
use crate::state::State;
use crate::why::{Stop, Why};

/// How a command is treated.
pub(crate) enum Admission {
    /// It is unknown, and that is not reported.
    Ignored,
    /// It is refused, as any command would be.
    Refused(Why),
    /// It bypasses the buffer.
    Directly,
    /// It bypasses the waiting commands and discards them.
    Afresh,
    /// It is a query, answered during the executing command.
    Aside,
    /// It is carried out at once, ahead of waiting commands.
    AtOnce,
    /// It waits for its turn.
    Waits,
}

impl State {
    /// How a command, or something that is not one, is treated.
    pub(crate) fn admit(&self, command: &Result<Command, Status>) -> Admission {
        if *command == Err(Status::UnknownCommand) && !self.answers_unknown() {
            return Admission::Ignored;
        }
        if let Some(why) = self.refusal(command.as_ref().ok()) {
            return Admission::Refused(why);
        }
        match command {
            Ok(command) if command.is_direct() => Admission::Directly,
            // It is obeyed in every state: what was before no longer matters.
            Ok(Command::Initialize) if self.is_held_up() => Admission::Afresh,
            // A stopped controller carries these out at once; waiting commands keep waiting.
            Ok(query) if self.is_interrupted() && is_query(query) => Admission::Aside,
            // The same holds for commands that continue, unless it is on its way back; and only
            // this ends the effect of an open interface.
            Ok(command) if self.is_interrupted() && self.may_resume(command) => Admission::AtOnce,
            Ok(Command::CloseInterface) if self.ball.open.is_some() => Admission::AtOnce,
            // Nothing prevents it.
            _ if self.buffer.is_empty() && self.is_free() => Admission::AtOnce,
            _ => Admission::Waits,
        }
    }

    /// Why the controller does not take a command at all, if it does not.
    pub(crate) fn refusal(&self, command: Option<&Command>) -> Option<Why> {
        if self.is_smcu() && command == Some(&Command::Initialize) {
            return None;
        }
        if self.ball.open.is_some() && !self.is_smcu() {
            let closes = command == Some(&Command::CloseInterface);
            return (!closes).then_some(Why::InterfaceOpen);
        }
        let goes_on = command.is_some_and(|command| {
            let lifts = matches!(command, Command::GoOn | Command::ClearBuffer);
            lifts || is_query(command) || self.may_resume(command)
        });
        let refuses = self.model.quirks.after_status == AfterStatus::Refuse;
        match self.stopped? {
            _ if goes_on || !refuses => None,
            Stop::Command => None,
            stop => Some(Why::After(stop)),
        }
    }

    /// Whether something waits that may begin.
    pub(crate) fn entry_turn(&self) -> bool {
        !self.buffer.is_empty() && (self.is_free() || self.reset_turn())
    }

    /// Takes out the next command. While the controller is held up that is an `IN`, and commands
    /// waiting before it are dropped.
    pub(crate) fn next_entry(&mut self) -> Option<Entry> {
        if !self.is_free() {
            self.buffer.drop_before_reset();
        }
        self.buffer.take()
    }

    /// `!ST` takes effect: nothing more begins.
    pub(crate) fn stop_here(&mut self) {
        self.stop_requested = false;
        self.stopped.get_or_insert(Stop::Command);
    }

    /// Whether the controller is held up and an `IN` waits that it obeys.
    fn reset_turn(&self) -> bool {
        self.is_held_up()
            && self.refusal(Some(&Command::Initialize)).is_none()
            && self.buffer.has_reset()
    }

    /// How many bytes are taken before CTS tells the host to wait. While execution waits for the
    /// host, the host may also fill the room beyond the high-water mark. With nothing else to do
    /// a command is carried out as soon as it is whole: what has come of it takes no room, however
    /// long it is. After a status nothing is held back, even at the risk of loss: otherwise a host
    /// that has sent more than fits could tell the controller neither to go on nor to begin anew.
    pub(crate) fn room_before_high_water(&self) -> usize {
        if self.is_interrupted() {
            return usize::MAX;
        }
        let buffer = &self.model.buffer;
        if self.is_free() && self.buffer.is_empty() {
            return buffer.high_water;
        }
        let used = self.buffer.bytes + self.reader.pending().len();
        let waits = self.stopped.is_some() || self.ball.open.is_some();
        let mark = if waits { buffer.bytes } else { buffer.high_water };
        mark.saturating_sub(used)
    }

    /// Whether it is a command that continues an aborted one, and nothing moves yet.
    fn may_resume(&self, command: &Command) -> bool {
        command.resumes() && self.job.is_none()
    }

    fn answers_unknown(&self) -> bool {
        match self.model.quirks.unknown_command {
            UnknownCommand::Echo => self.settings.echo,
            UnknownCommand::Never => false,
            UnknownCommand::Always => true,
        }
    }

    /// Whether something has aborted the controller's command, so that it expects to be told how to
    /// go on.
    fn is_interrupted(&self) -> bool {
        self.stopped.is_some_and(|stop| stop != Stop::Command)
    }

    /// Whether nothing executes, and nothing that waits may.
    fn is_held_up(&self) -> bool {
        self.job.is_none() && !self.is_free()
    }

    /// Whether the next command may begin.
    fn is_free(&self) -> bool {
        self.job.is_none() && self.stopped.is_none() && self.ball.open.is_none()
    }
}

/// Whether a command only asks.
fn is_query(command: &Command) -> bool {
    matches!(
        command,
        Command::OutputStatus
            | Command::NominalPosition(_)
            | Command::ActualPosition { .. }
            | Command::ReadPort(_)
    )
}
