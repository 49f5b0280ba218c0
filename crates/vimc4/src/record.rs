//! What happened, for those who ask afterwards.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::Bytes;
use tokio::sync::oneshot;
use vimc4_device::{CommandNumber, Event, Kinds, Stamp, Time};
use vimc4_host::{ControlError, Report, Sink, Wants, What};

/// How many events, and how many commands, are remembered; the oldest are forgotten first.
const MEMORY: usize = 100_000;

/// A command that the host sent.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct HostCommand {
    /// When its execution began.
    pub at: Time,
    /// Its number, which its answer and all that comes of it carry too.
    pub number: Option<CommandNumber>,
    /// The stable mnemonic, such as `@A` or `0`; `?` for a line that no command matches.
    pub mnemonic: Cow<'static, str>,
    /// The line as it was received, without its end.
    pub bytes: Bytes,
    /// What people call it: `relative move X +5,000 steps at 900 Hz`.
    pub text: String,
}

/// A memory of commands and events that is shared with the [`Recorder`] that fills it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Record(Arc<Mutex<Memory>>);

#[derive(Debug, Default)]
pub(crate) struct Memory {
    commands: VecDeque<HostCommand>,
    pub(crate) events: VecDeque<(Stamp, Event)>,
    /// How many of the commands at the front nobody will wait for any more.
    passed: usize,
    awaited: Vec<Awaited>,
    /// Nothing will come any more.
    over: bool,
}

/// Somebody who waits for a command, and its mnemonic.
#[derive(Debug)]
struct Awaited(String, oneshot::Sender<Result<HostCommand, ControlError>>);

impl Record {
    /// Every entry is whole at any time, so a panic elsewhere is no reason to stop.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Memory> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The sink that fills it.
    pub(crate) fn recorder(&self) -> Recorder {
        Recorder(self.clone())
    }
}

impl Memory {
    pub(crate) fn commands(&self) -> Vec<HostCommand> {
        self.commands.iter().cloned().collect()
    }

    pub(crate) fn forget(&mut self) {
        self.commands.clear();
        self.events.clear();
        self.passed = 0;
    }

    /// Answers with the first command of this name after the one that was waited for last.
    pub(crate) fn await_command(
        &mut self,
        mnemonic: String,
        answer: oneshot::Sender<Result<HostCommand, ControlError>>,
    ) {
        let mut coming = self.commands.iter().enumerate().skip(self.passed);
        match coming.find(|(_, command)| command.mnemonic == mnemonic) {
            Some((at, command)) => {
                self.passed = at + 1;
                // Who asked may have stopped waiting.
                let _ = answer.send(Ok(command.clone()));
            }
            // A waiting caller learns from the answer that is dropped that there will be none.
            None if self.over => {}
            None => {
                self.passed = self.commands.len();
                self.awaited.retain(|Awaited(_, answer)| !answer.is_closed());
                self.awaited.push(Awaited(mnemonic, answer));
            }
        }
    }

    fn add(&mut self, command: HostCommand) {
        if self.commands.len() == MEMORY {
            self.commands.pop_front();
            self.passed = self.passed.saturating_sub(1);
        }
        let waits = |Awaited(name, _): &Awaited| *name == command.mnemonic;
        for Awaited(_, answer) in self.awaited.extract_if(.., |awaited| waits(awaited)) {
            self.passed = self.commands.len() + 1;
            let _ = answer.send(Ok(command.clone()));
        }
        self.commands.push_back(command);
    }
}

/// Fills a memory.
#[derive(Debug)]
pub(crate) struct Recorder(Record);

impl Drop for Recorder {
    fn drop(&mut self) {
        let mut memory = self.0.lock();
        memory.over = true;
        memory.awaited.clear();
    }
}

impl Sink for Recorder {
    fn wants(&self) -> Wants {
        Wants { kinds: Kinds::ALL, ..Wants::default() }
    }

    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String) {
        let What::Event { command, event } = &report.what else { return };
        let stamp = Stamp { at: report.at, command: *command };
        let mut memory = self.0.lock();
        if let Event::Command { mnemonic, bytes } = event {
            // Explained at once: what `@0A100,900` means depends on the axes set at the time.
            let (mnemonic, text) = (mnemonic.clone(), explain(bytes));
            memory.add(HostCommand {
                at: stamp.at,
                number: stamp.command,
                mnemonic,
                bytes: bytes.clone(),
                text,
            });
        }
        if memory.events.len() == MEMORY {
            memory.events.pop_front();
        }
        memory.events.push_back((stamp, event.clone()));
    }
}
