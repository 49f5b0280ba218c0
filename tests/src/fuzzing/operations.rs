//! What a host, a person and the time do to a controller, as bytes.
//!
//! Three bytes say which controller ([`Setup`]); then every sequence of bytes is a list of
//! operations ([`Operations`]). Bytes stand for themselves and go over the line; those below a
//! blank, apart from CR and LF, begin another operation and are followed by what it needs. So
//! a file of the corpus reads as what was sent, and inserting, removing or changing any byte of
//! it makes another list that mostly means the same.

use std::sync::Arc;

use vimc4_plant::Machine;

/// Which controller of a family an input is for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Setup {
    model: u8,
    machine: u8,
    quirks: u8,
}

impl Setup {
    /// A built-in model on a built-in machine, both counted from 0, without quirks.
    #[must_use]
    pub fn new(model: usize, machine: usize) -> Setup {
        Setup { model: model as u8, machine: machine as u8, quirks: 0 }
    }

    /// The same with the model's quirks turned over, a bit for each; the highest makes memories so
    /// small that they fill up.
    #[must_use]
    pub fn with_quirks(self, quirks: u8) -> Setup {
        Setup { quirks, ..self }
    }

    /// The controller that some data is for, and the rest of the data.
    #[must_use]
    pub fn decode(data: &[u8]) -> (Setup, &[u8]) {
        let digit = |at: usize| data.get(at).map_or(0, |byte| byte.wrapping_sub(b'0'));
        let quirks = data.get(2).map_or(0, |byte| byte.wrapping_sub(b'0'));
        let setup = Setup { model: digit(0), machine: digit(1), quirks };
        (setup, data.get(3..).unwrap_or_default())
    }

    /// The bytes that [`Setup::decode`] takes for this controller.
    #[must_use]
    pub fn encode(self) -> Vec<u8> {
        [self.model, self.machine, self.quirks].map(|value| value.wrapping_add(b'0')).into()
    }

    /// One of some names, as the digit of the model says.
    pub(super) fn model_of(self, names: &[&'static str]) -> &'static str {
        names[usize::from(self.model) % names.len()]
    }

    /// Whether the model is as it is built in.
    pub(super) fn is_plain(self) -> bool {
        self.quirks == 0
    }

    /// Whether a bit of the quirks is set.
    pub(super) fn quirk(self, number: u8) -> bool {
        self.quirks >> number & 1 == 1
    }

    /// Its machine.
    ///
    /// # Panics
    ///
    /// If there is no built-in machine.
    #[must_use]
    pub fn machine(self) -> Arc<Machine> {
        let names = Machine::names();
        let name = names[usize::from(self.machine) % names.len()];
        Machine::builtin(name).unwrap_or_else(|| unreachable!())
    }
}

/// One thing that is done to a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation<'a> {
    /// Bytes come over the line.
    Send(&'a [u8]),
    /// The bytes sent last come again, so many times.
    Again(u8),
    /// So many nanoseconds pass.
    Wait(u64),
    /// Time passes until nothing is due any more, within limits.
    Rest,
    /// Time passes until the next thing that is due, however long that is.
    Next,
    /// Time passes until so many nanoseconds before that.
    Before(u8),
    /// A signal, counted in the order in which they are listed, takes a value.
    Signal(u8, i8),
    /// The mains switch.
    Power(bool),
    /// The state is kept, and the controller goes on from what was kept.
    Snapshot,
    /// The controller goes back to what was kept last.
    Restore,
    /// Another process begins with the image of the flash memory.
    Restart,
    /// Somebody asks when an axis will be so far from where it is, and looks at everything.
    Look(u8, i16),
}

const RAW: u8 = 0x00;
const REST: u8 = 0x01;
const WAIT: u8 = 0x02;
const SIGNAL: u8 = 0x03;
const POWER: u8 = 0x04;
const SNAPSHOT: u8 = 0x05;
const RESTORE: u8 = 0x06;
const RESTART: u8 = 0x07;
const AGAIN: u8 = 0x08;
const LOOK: u8 = 0x0B;
const BEFORE: u8 = 0x0C;

/// The operations that some bytes stand for, one after the other.
#[derive(Clone, Debug)]
pub struct Operations<'a> {
    rest: &'a [u8],
}

impl<'a> Operations<'a> {
    /// The operations in some bytes, the [`Setup`] taken off.
    #[must_use]
    pub fn new(data: &'a [u8]) -> Operations<'a> {
        Operations { rest: data }
    }

    fn byte(&mut self) -> u8 {
        let (first, rest) = self.rest.split_first().unwrap_or((&0, &[]));
        self.rest = rest;
        *first
    }
}

/// Whether a byte goes over the line as it stands.
fn is_sent(byte: u8) -> bool {
    byte >= b' ' || byte == b'\r' || byte == b'\n'
}

impl<'a> Iterator for Operations<'a> {
    type Item = Operation<'a>;

    fn next(&mut self) -> Option<Operation<'a>> {
        let rest = self.rest;
        let first = *rest.first()?;
        if is_sent(first) {
            let end = rest.iter().position(|&byte| !is_sent(byte)).unwrap_or(rest.len());
            let (sent, rest) = rest.split_at(end);
            self.rest = rest;
            return Some(Operation::Send(sent));
        }
        self.byte();
        Some(match first {
            RAW => {
                let sent = rest.get(1..2).unwrap_or_default();
                self.byte();
                Operation::Send(sent)
            }
            REST => Operation::Rest,
            WAIT => {
                // Two bytes span everything from a nanosecond to two minutes.
                let (value, scale) = (u64::from(self.byte()), self.byte() & 31);
                Operation::Wait((value + 1) << scale.min(29))
            }
            SIGNAL => Operation::Signal(self.byte(), self.byte() as i8),
            POWER => Operation::Power(self.byte() & 1 == 1),
            SNAPSHOT => Operation::Snapshot,
            RESTORE => Operation::Restore,
            RESTART => Operation::Restart,
            AGAIN => Operation::Again(self.byte()),
            LOOK => {
                let axis = self.byte();
                Operation::Look(axis, i16::from_le_bytes([self.byte(), self.byte()]))
            }
            BEFORE => Operation::Before(self.byte()),
            _ => Operation::Next,
        })
    }
}

impl Operation<'_> {
    /// Appends the bytes that stand for this operation.
    pub fn encode(self, out: &mut Vec<u8>) {
        match self {
            Operation::Send(bytes) => {
                for &byte in bytes {
                    if !is_sent(byte) {
                        out.push(RAW);
                    }
                    out.push(byte);
                }
            }
            Operation::Again(count) => out.extend([AGAIN, count]),
            Operation::Wait(nanos) => {
                let scale = (64 - nanos.leading_zeros()).saturating_sub(8).min(29);
                let value = (nanos >> scale).saturating_sub(1).min(255);
                out.extend([WAIT, value as u8, scale as u8]);
            }
            Operation::Rest => out.push(REST),
            Operation::Next => out.push(0x0E),
            Operation::Before(nanos) => out.extend([BEFORE, nanos]),
            Operation::Signal(place, value) => out.extend([SIGNAL, place, value as u8]),
            Operation::Power(on) => out.extend([POWER, u8::from(on)]),
            Operation::Snapshot => out.push(SNAPSHOT),
            Operation::Restore => out.push(RESTORE),
            Operation::Restart => out.push(RESTART),
            Operation::Look(axis, way) => {
                let [low, high] = way.to_le_bytes();
                out.extend([LOOK, axis, low, high]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_read_back_as_they_were_written() {
        let all = [
            Operation::Send(b"@0P\r\n"),
            Operation::Rest,
            Operation::Again(3),
            Operation::Wait(1 << 20),
            Operation::Next,
            Operation::Before(1),
            Operation::Signal(9, -1),
            Operation::Power(true),
            Operation::Snapshot,
            Operation::Restore,
            Operation::Restart,
            Operation::Look(2, -300),
            Operation::Send(&[253, b'x']),
        ];
        let mut bytes = Vec::new();
        for operation in all {
            operation.encode(&mut bytes);
        }
        assert_eq!(Operations::new(&bytes).collect::<Vec<_>>(), all);
    }

    #[test]
    fn every_byte_can_be_sent() {
        for byte in 0..=u8::MAX {
            let (sent, mut bytes) = ([byte], Vec::new());
            Operation::Send(&sent).encode(&mut bytes);
            assert_eq!(Operations::new(&bytes).collect::<Vec<_>>(), [Operation::Send(&sent)]);
        }
    }
}
