//! What happened, for those who ask afterwards.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::Bytes;
use vimc4_device::{Event, Kinds, Time};
use vimc4_host::{Report, Sink, Wants};

/// How many events, and how many commands, are remembered; the oldest are forgotten first.
const MEMORY: usize = 100_000;

/// A command that the host sent.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Command {
    /// When its execution began.
    pub at: Time,
    /// The stable mnemonic, such as `@A` or `0`; `?` for a line that no command matches.
    pub mnemonic: &'static str,
    /// The line as it was received, without its end.
    pub bytes: Bytes,
    /// What people call it: `relative move X +5,000 steps at 900 Hz`.
    pub text: String,
}

/// A memory of commands and events that is shared with the sink that fills it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Record(Arc<Mutex<Memory>>);

#[derive(Debug, Default)]
pub(crate) struct Memory {
    pub(crate) commands: VecDeque<Command>,
    pub(crate) events: VecDeque<(Time, Event)>,
}

impl Record {
    /// Every entry is whole at any time, so a panic elsewhere is no reason to stop.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Memory> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sink for Record {
    fn wants(&self) -> Wants {
        Wants { kinds: Kinds::ALL, bytes: false }
    }

    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String) {
        let Report::Event(at, event) = report else { return };
        let mut memory = self.lock();
        if let Event::Command { mnemonic, bytes } = event {
            // Explained at once: what `@0A100,900` means depends on the axes set at the time.
            let text = explain(bytes);
            remember(
                &mut memory.commands,
                Command { at: *at, mnemonic, bytes: bytes.clone(), text },
            );
        }
        remember(&mut memory.events, (*at, event.clone()));
    }
}

fn remember<T>(memory: &mut VecDeque<T>, entry: T) {
    if memory.len() == MEMORY {
        memory.pop_front();
    }
    memory.push_back(entry);
}
