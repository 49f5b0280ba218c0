//! What the line brings: commands go into the buffer, direct commands past it.

use bytes::Bytes;
use vimc4_device::{Event, Kinds, Warning};

use crate::Controller;
use crate::language::{Command, Item, Reader, Status};
use crate::model::{AfterStatus, CommandSet, UnknownCommand};
use crate::state::{Buffer, Entry, Stop};
use crate::why::Why;

impl Controller {
    /// Bytes have arrived.
    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        if !self.state.powered {
            return;
        }
        let unread = Reader::new(self.state.model.grammar());
        let mut reader = std::mem::replace(&mut self.state.reader, unread);
        for &byte in bytes {
            let was_open = reader.channel_open();
            reader.read(byte, |item| {
                self.take(item);
                self.go_on();
            });
            if reader.take_stray() && self.wants(Kinds::WARNING) {
                let what = "numbers without a command mean nothing".into();
                self.emit(Event::Warning(Warning::NoEffect { what }));
            }
            // A `!OC` that is refused opens nothing.
            if !was_open && reader.channel_open() && self.refusal(None).is_some() {
                reader.close_channel();
            }
        }
        self.state.reader = reader;
    }

    /// How many bytes are taken before CTS tells the host to wait. While nothing is executed
    /// until the host says so, it may write into what is left beyond the high-water mark; and a
    /// single command may be longer than all that, as long as nothing else is to be done. After a
    /// status nothing is held back, whatever is lost by that: otherwise a host that has sent more
    /// than fits could tell the controller neither to go on nor to begin anew.
    pub(crate) fn room_before_high_water(&self) -> usize {
        if self.is_interrupted() {
            return usize::MAX;
        }
        let buffer = &self.state.model.buffer;
        let used = self.state.buffer.bytes + self.state.reader.pending().len();
        let waits = self.state.stopped.is_some() || self.state.ball.open.is_some();
        let mark = if waits { buffer.bytes } else { buffer.high_water };
        let alone = self.is_free() && self.state.buffer.waiting.is_empty();
        mark.saturating_sub(used).max(usize::from(alone))
    }

    fn take(&mut self, item: Item<&[u8]>) {
        match item {
            Item::Command { raw, command } => self.take_command(raw, command),
            Item::Through(byte) => self.take_through(byte),
            Item::TooLong => self.report(Why::TooLong),
        }
    }

    fn take_command(&mut self, raw: &[u8], command: Result<Command, Status>) {
        if command == Err(Status::UnknownCommand) && !self.answers_unknown() {
            return self.command_event(&command, raw);
        }
        if let Some(refusal) = self.refusal(command.as_ref().ok()) {
            self.command_event(&command, raw);
            return self.answer_failed(mnemonic(&command), refusal);
        }
        match command {
            Ok(direct) if direct.is_direct() => {
                let command = Ok(direct);
                self.command_event(&command, raw);
                if let Ok(direct) = command {
                    self.execute_directly(direct);
                }
            }
            // It is obeyed in every state: whatever was before it does not matter any more.
            Ok(Command::Initialize) if self.is_held_up() => {
                self.state.buffer = Buffer::default();
                self.carry_out(raw, command);
            }
            // A stopped controller carries these out at once; what waits goes on waiting.
            Ok(query) if self.is_interrupted() && is_query(&query) => {
                let command = Ok(query);
                self.command_event(&command, raw);
                if let Ok(query) = command {
                    self.answer_query(&query);
                }
            }
            // So it does with what goes on; and only this ends what an open interface does.
            Ok(Command::Continue | Command::GoBack | Command::RepeatBroken)
                if self.is_interrupted() =>
            {
                self.carry_out(raw, command);
            }
            Ok(Command::CloseInterface) if self.state.ball.open.is_some() => {
                self.carry_out(raw, command);
            }
            // Nothing is in the way of it.
            command if self.state.buffer.waiting.is_empty() && self.is_free() => {
                self.carry_out(raw, command);
            }
            command => {
                let raw = Bytes::copy_from_slice(raw);
                self.put(Entry::Command { raw, command });
            }
        }
    }

    /// Begins a command, or says why it is none.
    fn carry_out(&mut self, raw: &[u8], command: Result<Command, Status>) {
        self.command_event(&command, raw);
        match command {
            Ok(command) => self.execute(command),
            Err(status) => self.answer_refused("?", Why::Text(status), raw),
        }
    }

    fn take_through(&mut self, byte: u8) {
        // Bytes that follow each other stay together.
        if let Some(Entry::Through(bytes)) = self.state.buffer.waiting.back_mut()
            && self.state.buffer.bytes < self.state.model.buffer.bytes
        {
            bytes.push(byte);
            self.state.buffer.bytes += 1;
            return;
        }
        self.put(Entry::Through(vec![byte]));
    }

    /// Puts something into the buffer, behind what waits.
    fn put(&mut self, entry: Entry) {
        if self.take_room(entry.size()) {
            self.state.buffer.waiting.push_back(entry);
        }
    }

    /// Puts a command into the buffer once more, before what waits. It takes the room that it
    /// would take if it had been sent.
    pub(crate) fn put_again(&mut self, command: Command) {
        let mut raw = Vec::new();
        command.print(&mut raw);
        // The end belongs to no command.
        raw.pop();
        let entry = Entry::Command { raw: raw.into(), command: Ok(command) };
        if self.take_room(entry.size()) {
            self.state.buffer.waiting.push_front(entry);
        }
    }

    /// Takes room in the buffer. What does not fit is lost; that is said once for all that is
    /// lost together.
    fn take_room(&mut self, size: usize) -> bool {
        if self.state.buffer.bytes + size > self.state.model.buffer.bytes {
            if self.wants(Kinds::WARNING) {
                let lost = size as u64;
                self.emit(Event::Warning(Warning::ReceiveOverflow { lost }));
            }
            if !std::mem::replace(&mut self.state.buffer.overrun, true) {
                self.report(Why::BufferFull(size));
            }
            return false;
        }
        self.state.buffer.overrun = false;
        self.state.buffer.bytes += size;
        true
    }

    /// One of the commands that go on with what was broken off, and nothing moves yet.
    fn may_resume(&self, command: &Command) -> bool {
        let resumes =
            matches!(command, Command::Continue | Command::GoBack | Command::RepeatBroken);
        resumes && self.state.job.is_none()
    }

    fn answer_query(&mut self, query: &Command) {
        match self.apply(query) {
            Ok(()) => self.answer_done(query),
            Err(why) => self.answer_failed(query.form().mnemonic, why),
        }
    }

    fn answers_unknown(&self) -> bool {
        match self.state.model.quirks.unknown_command {
            UnknownCommand::Echo => self.state.settings.echo,
            UnknownCommand::Never => false,
            UnknownCommand::Always => true,
        }
    }

    /// Whether something has broken off what the controller did, so that it expects to be told
    /// how to go on.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.state.stopped.is_some_and(|stop| stop != Stop::Command)
    }

    /// Whether nothing executes, and nothing that waits may.
    fn is_held_up(&self) -> bool {
        self.state.job.is_none() && !self.is_free()
    }

    /// Why the controller does not take a command at all, if it does not.
    fn refusal(&self, command: Option<&Command>) -> Option<Why> {
        let is_smcu = self.state.model.command_set == CommandSet::Smcu;
        if is_smcu && command == Some(&Command::Initialize) {
            return None;
        }
        if self.state.ball.open.is_some() && !is_smcu {
            let closes = command == Some(&Command::CloseInterface);
            return (!closes).then_some(Why::InterfaceOpen);
        }
        let goes_on = command.is_some_and(|command| {
            let lifts = matches!(command, Command::GoOn | Command::ClearBuffer);
            lifts || is_query(command) || self.may_resume(command)
        });
        let refuses = self.state.model.quirks.after_status == AfterStatus::Refuse;
        match self.state.stopped? {
            _ if goes_on || !refuses => None,
            Stop::Command => None,
            stop => Some(Why::After(stop)),
        }
    }

    /// Begins whatever waits, one after the other, as long as nothing is in the way.
    pub(crate) fn go_on(&mut self) {
        loop {
            self.work();
            if self.follow_ball() {
                continue;
            }
            if self.state.job.is_none() && std::mem::take(&mut self.state.stop_requested) {
                self.state.stopped.get_or_insert(Stop::Command);
            }
            if !self.is_free() && !self.drop_before_reset() {
                return;
            }
            let Some(entry) = self.state.buffer.waiting.pop_front() else { return };
            self.state.buffer.bytes -= entry.size();
            match entry {
                Entry::Through(bytes) => self.pass_through(&bytes),
                Entry::Command { raw, command } => self.carry_out(&raw, command),
            }
        }
    }

    /// Whether the controller is held up and an `IN` waits: then what waits before it is dropped.
    fn drop_before_reset(&mut self) -> bool {
        if !self.is_held_up() || self.refusal(Some(&Command::Initialize)).is_some() {
            return false;
        }
        let is_reset = |entry: &Entry| {
            matches!(entry, Entry::Command { command: Ok(Command::Initialize), .. })
        };
        let buffer = &mut self.state.buffer;
        let Some(place) = buffer.waiting.iter().position(is_reset) else { return false };
        let dropped: usize = buffer.waiting.drain(..place).map(|entry| entry.size()).sum();
        buffer.bytes -= dropped;
        true
    }

    /// Whether the next command may begin.
    fn is_free(&self) -> bool {
        self.state.job.is_none() && self.state.stopped.is_none() && self.state.ball.open.is_none()
    }

    fn command_event(&mut self, command: &Result<Command, Status>, raw: &[u8]) {
        if self.wants(Kinds::COMMAND) {
            let bytes = Bytes::copy_from_slice(raw);
            self.emit(Event::Command { mnemonic: mnemonic(command).into(), bytes });
        }
    }
}

/// What a command is called in events.
fn mnemonic(command: &Result<Command, Status>) -> &'static str {
    command.as_ref().map_or("?", |command| command.form().mnemonic)
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
