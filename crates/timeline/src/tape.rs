//! The inputs of a branch, packed.

use vimc4_device::{Faulting, Input, SignalId, Time};

/// The inputs of a branch with their times, in order. All bytes lie behind one another, so a
/// million commands take some 50 MB.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Tape {
    entries: Vec<(Time, What)>,
    bytes: Vec<u8>,
    faults: Vec<Faulting>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum What {
    /// These of the tape's bytes.
    Bytes {
        from: usize,
        to: usize,
    },
    Signal(SignalId, i32),
    Power(bool),
    /// This one of the tape's faults.
    Fault(usize),
    Wake,
}

impl Tape {
    pub(crate) fn len(&self) -> u64 {
        self.entries.len() as u64
    }

    /// Adds an input behind the others. Bytes that come at the same time as those before them are
    /// another input all the same.
    pub(crate) fn push(&mut self, at: Time, input: Input<'_>) {
        let what = match input {
            Input::Bytes(bytes) => {
                let from = self.bytes.len();
                self.bytes.extend_from_slice(bytes);
                What::Bytes { from, to: self.bytes.len() }
            }
            Input::Signal(id, value) => What::Signal(id, value),
            Input::Power(on) => What::Power(on),
            Input::Fault(faulting) => {
                self.faults.push(faulting.clone());
                What::Fault(self.faults.len() - 1)
            }
            Input::Wake => What::Wake,
        };
        self.entries.push((at, what));
    }

    /// The input of a number, counted from 0, and its time.
    pub(crate) fn get(&self, number: u64) -> Option<(Time, Input<'_>)> {
        let (at, what) = *self.entries.get(usize::try_from(number).ok()?)?;
        let input = match what {
            What::Bytes { from, to } => Input::Bytes(self.bytes.get(from..to)?),
            What::Signal(id, value) => Input::Signal(id, value),
            What::Power(on) => Input::Power(on),
            What::Fault(number) => Input::Fault(self.faults.get(number)?),
            What::Wake => Input::Wake,
        };
        Some((at, input))
    }

    /// What it takes of the memory, in bytes.
    pub(crate) fn size(&self) -> u64 {
        let entries = self.entries.capacity() * size_of::<(Time, What)>();
        let faults = self.faults.capacity() * size_of::<Faulting>();
        (entries + self.bytes.capacity() + faults) as u64
    }
}
