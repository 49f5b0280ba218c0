//! The command buffer.

use std::collections::VecDeque;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::CommandNumber;

use crate::language::{Command, Status};

/// Commands that wait, as they came.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Buffer {
    waiting: VecDeque<Entry>,
    /// Their size in bytes.
    pub(crate) bytes: usize,
    /// Commands are being lost, and that has been reported.
    pub(crate) overrun: bool,
}

/// One item that waits for its turn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Entry {
    /// A command, or why it is not one.
    Command {
        /// As it was written.
        raw: Bytes,
        /// What it means.
        command: Result<Command, Status>,
        /// The number that it, or the `!RP` that repeats it, has got.
        number: CommandNumber,
    },
    /// Bytes for the unit on the second channel.
    Through(Vec<u8>),
}

impl Entry {
    /// How many bytes of the buffer it takes.
    pub(crate) fn size(&self) -> usize {
        match self {
            Entry::Command { raw, .. } => raw.len(),
            Entry::Through(bytes) => bytes.len(),
        }
    }

    fn is_reset(&self) -> bool {
        matches!(self, Entry::Command { command: Ok(Command::Initialize), .. })
    }
}

impl Buffer {
    /// Whether nothing waits.
    pub(crate) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// The first command that waits.
    pub(crate) fn first_command(&self) -> Option<(&[u8], &Result<Command, Status>)> {
        self.waiting.iter().find_map(|entry| match entry {
            Entry::Command { raw, command, .. } => Some((&raw[..], command)),
            Entry::Through(_) => None,
        })
    }

    /// How many commands wait.
    pub(crate) fn commands(&self) -> usize {
        self.waiting.iter().filter(|entry| matches!(entry, Entry::Command { .. })).count()
    }

    /// Whether this many more bytes fit into a buffer of `size`. If they do, no command is being
    /// lost any more.
    pub(crate) fn has_room(&mut self, bytes: usize, size: usize) -> bool {
        let fits = self.bytes + bytes <= size;
        self.overrun &= !fits;
        fits
    }

    /// Appends an item.
    pub(crate) fn put(&mut self, entry: Entry) {
        self.bytes += entry.size();
        self.waiting.push_back(entry);
    }

    /// Appends a byte for the unit. Consecutive bytes stay together.
    pub(crate) fn put_through(&mut self, byte: u8) {
        match self.waiting.back_mut() {
            Some(Entry::Through(bytes)) => bytes.push(byte),
            _ => self.waiting.push_back(Entry::Through(vec![byte])),
        }
        self.bytes += 1;
    }

    /// Puts an item before all others.
    pub(crate) fn put_first(&mut self, entry: Entry) {
        self.bytes += entry.size();
        self.waiting.push_front(entry);
    }

    /// Takes out what comes next.
    pub(crate) fn take(&mut self) -> Option<Entry> {
        let entry = self.waiting.pop_front()?;
        self.bytes -= entry.size();
        Some(entry)
    }

    /// Whether an `IN` waits.
    pub(crate) fn has_reset(&self) -> bool {
        self.waiting.iter().any(Entry::is_reset)
    }

    /// Drops what waits before the first `IN`.
    pub(crate) fn drop_before_reset(&mut self) {
        let place = self.waiting.iter().position(Entry::is_reset).unwrap_or(0);
        let dropped: usize = self.waiting.drain(..place).map(|entry| entry.size()).sum();
        self.bytes -= dropped;
    }
}
