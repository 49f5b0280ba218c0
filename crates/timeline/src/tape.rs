//! The inputs of a branch, packed.

use vimc4_device::{Faulting, Input, Ruling, SignalId, Time};

/// The inputs of a branch with their times, in order. Their contents are stored one after the
/// other, so a million commands take some 30 MB.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Tape {
    entries: Vec<Entry>,
    bytes: Vec<u8>,
    faults: Vec<Faulting>,
    rulings: Vec<Ruling>,
}

/// An input. Its bytes follow those of the input before it on the tape.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    at: Time,
    /// The end of its bytes on the tape; the uppermost bits say what the bytes are.
    end: u64,
}

impl Entry {
    const SORT: u32 = 61;
    const BYTES: u64 = 0;
    /// The number of a signal and its value.
    const SIGNAL: u64 = 1;
    const POWER: u64 = 2;
    /// The index of a fault on the tape.
    const FAULT: u64 = 3;
    const WAKE: u64 = 4;
    /// Which one of what is done about scenarios.
    const RULE: u64 = 5;

    fn end(self) -> usize {
        (self.end & ((1 << Entry::SORT) - 1)) as usize
    }
}

impl Tape {
    pub(crate) fn len(&self) -> u64 {
        self.entries.len() as u64
    }

    /// Adds an input after the others. Bytes that come at the same time as those before them are
    /// another input all the same.
    pub(crate) fn push(&mut self, at: Time, input: Input<'_>) {
        let sort = match input {
            Input::Bytes(bytes) => {
                self.bytes.extend_from_slice(bytes);
                Entry::BYTES
            }
            Input::Signal(SignalId(id), value) => {
                self.bytes.extend(id.to_le_bytes());
                self.bytes.extend(value.to_le_bytes());
                Entry::SIGNAL
            }
            Input::Power(on) => {
                self.bytes.push(on.into());
                Entry::POWER
            }
            Input::Fault(faulting) => {
                self.bytes.extend(self.faults.len().to_le_bytes());
                self.faults.push(faulting.clone());
                Entry::FAULT
            }
            Input::Rule(ruling) => {
                self.bytes.extend(self.rulings.len().to_le_bytes());
                self.rulings.push(ruling.clone());
                Entry::RULE
            }
            Input::Wake => Entry::WAKE,
        };
        self.entries.push(Entry { at, end: sort << Entry::SORT | self.bytes.len() as u64 });
    }

    /// Leaves out all inputs but the first so many.
    pub(crate) fn truncate(&mut self, inputs: u64) {
        let kept = usize::try_from(inputs).unwrap_or(usize::MAX);
        let gone = self.entries.get(kept..).unwrap_or_default();
        let count = |sort| gone.iter().filter(|entry| entry.end >> Entry::SORT == sort).count();
        let (faults, rulings) = (count(Entry::FAULT), count(Entry::RULE));
        self.faults.truncate(self.faults.len().saturating_sub(faults));
        self.rulings.truncate(self.rulings.len().saturating_sub(rulings));
        self.entries.truncate(kept);
        self.bytes.truncate(self.entries.last().map_or(0, |last| last.end()));
    }

    /// The input of a number, counted from 0, and its time.
    pub(crate) fn get(&self, number: u64) -> Option<(Time, Input<'_>)> {
        let place = usize::try_from(number).ok()?;
        let entry = *self.entries.get(place)?;
        let before = place.checked_sub(1).and_then(|before| self.entries.get(before));
        let own = self.bytes.get(before.map_or(0, |before| before.end())..entry.end())?;
        let input = match entry.end >> Entry::SORT {
            Entry::BYTES => Input::Bytes(own),
            Entry::SIGNAL => {
                let (id, value) = own.split_first_chunk()?;
                let value = i32::from_le_bytes(*value.first_chunk()?);
                Input::Signal(SignalId(u16::from_le_bytes(*id)), value)
            }
            Entry::POWER => Input::Power(own != [0]),
            Entry::FAULT => {
                Input::Fault(self.faults.get(usize::from_le_bytes(own.try_into().ok()?))?)
            }
            Entry::RULE => {
                Input::Rule(self.rulings.get(usize::from_le_bytes(own.try_into().ok()?))?)
            }
            _ => Input::Wake,
        };
        Some((entry.at, input))
    }

    /// What it takes of the memory, in bytes.
    pub(crate) fn size(&self) -> u64 {
        let entries = self.entries.capacity() * size_of::<Entry>();
        let faults = self.faults.capacity() * size_of::<Faulting>();
        let rulings = self.rulings.capacity() * size_of::<Ruling>();
        (entries + self.bytes.capacity() + faults + rulings) as u64
    }
}

#[cfg(test)]
mod tests {
    use vimc4_device::ScenarioNumber;

    use super::*;

    #[test]
    fn inputs_of_every_sort_come_back_by_their_numbers() {
        let (end, all) = (Ruling::End(ScenarioNumber(3)), Ruling::EndAll);
        let inputs = [
            Input::Rule(&end),
            Input::Rule(&all),
            Input::Fault(&Faulting::EndAll),
            Input::Wake,
            Input::Bytes(b"@07\r"),
            Input::Signal(SignalId(u16::MAX), i32::MIN),
            Input::Power(true),
            Input::Bytes(&[0xFD]),
            Input::Signal(SignalId(0), -1),
            Input::Power(false),
            Input::Wake,
        ];
        let mut tape = Tape::default();
        for (second, input) in (0..).zip(inputs) {
            tape.push(Time::from_secs(second), input);
        }
        for (number, input) in (0..).zip(inputs) {
            assert_eq!(tape.get(number), Some((Time::from_secs(number), input)));
        }
        assert_eq!((tape.get(11), tape.len()), (None, 11));
        // What is added where others were left out takes their place.
        for kept in (0..=11).rev() {
            let mut shorter = Tape::default();
            for (second, input) in (0..kept).zip(inputs) {
                shorter.push(Time::from_secs(second), input);
            }
            let mut left = tape.clone();
            left.truncate(kept);
            assert_eq!(left, shorter, "{kept}");
        }
    }
}
