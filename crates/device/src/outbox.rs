//! Where outputs wait until they are taken.

use std::collections::VecDeque;

use bytes::Bytes;

use crate::{Event, FlashChange, Kinds, Output, Stamp, Time};

/// The outputs of a device that have not been taken yet, in the order in which they happened, and
/// the kinds of events that are wanted.
///
/// It is drained after every input and is not part of a device's state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outbox {
    queue: VecDeque<Output>,
    wanted: Kinds,
}

impl Outbox {
    /// Whether events of all these kinds are watched. An event with any cost is made only then.
    #[must_use]
    pub fn wants(&self, kinds: Kinds) -> bool {
        self.wanted.contain(kinds)
    }

    /// Says which kinds of events are wanted, see [`Device::watch`](crate::Device::watch).
    pub fn watch(&mut self, kinds: Kinds) -> Kinds {
        std::mem::replace(&mut self.wanted, kinds)
    }

    /// Bytes leave on the line.
    pub fn send(&mut self, at: Time, bytes: Bytes) {
        self.queue.push_back(Output::Bytes(at, bytes));
    }

    /// The non-volatile memory changes.
    pub fn store(&mut self, at: Time, change: FlashChange) {
        self.queue.push_back(Output::Flash(at, change));
    }

    /// An event that is [wanted](Outbox::wants) happened.
    pub fn emit(&mut self, stamp: Stamp, event: Event) {
        self.queue.push_back(Output::Event(stamp, event));
    }

    /// Takes the first output, see [`Device::poll_output`](crate::Device::poll_output).
    pub fn poll(&mut self) -> Option<Output> {
        self.queue.pop_front()
    }

    /// Drops what has not been taken, because the device goes on from another state.
    pub fn clear(&mut self) {
        self.queue.clear();
    }
}
