//! How an input to begin with is put together.

use super::operations::{Operation, Setup};

/// An input to begin with.
#[derive(Clone, Debug)]
pub struct Seed {
    /// The target it is for.
    pub target: &'static str,
    /// What it is about; the name of its file.
    pub name: String,
    /// The input.
    pub data: Vec<u8>,
}

/// Puts the operations of an input together.
pub(super) struct Script(Vec<u8>);

impl Script {
    pub(super) fn new(setup: Setup) -> Script {
        Script(setup.encode())
    }

    /// The input.
    pub(super) fn data(self) -> Vec<u8> {
        self.0
    }

    pub(super) fn then(mut self, operation: Operation<'_>) -> Script {
        operation.encode(&mut self.0);
        self
    }

    /// Sends bytes and goes on at once.
    pub(super) fn send(self, bytes: impl AsRef<[u8]>) -> Script {
        self.then(Operation::Send(bytes.as_ref()))
    }

    /// Sends lines and waits until nothing is due.
    pub(super) fn ask(self, text: impl AsRef<[u8]>) -> Script {
        self.send(text).then(Operation::Rest)
    }

    /// Waits so long that what was sent has begun and is not done.
    pub(super) fn wait(self) -> Script {
        self.then(Operation::Wait(60_000_000))
    }
}
