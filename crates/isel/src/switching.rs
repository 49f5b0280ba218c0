//! Switching outputs. Only the power stages and the spindle can be refused, and only when they are
//! switched *on*: switching off needs neither power nor a closed cover. A write that is refused
//! changes nothing, for values are taken over only where the answer is `0` (99 2.2.14).

use vimc4_isel_wire::{Bit, BitTest};

use crate::Controller;
use crate::ports::{Output, Wire};
use crate::why::{Opened, Why};

impl Controller {
    /// Writes a whole port.
    pub(crate) fn write_port(&mut self, port: u16, value: u8) {
        self.set_port(BitTest { port, bit: Bit::Byte, value });
    }

    /// Writes a bit of a port, or the whole of it.
    pub(crate) fn set_port(&mut self, write: BitTest) {
        let changes: Vec<(Output, bool)> = self.changes(write).collect();
        self.drive(|outputs| {
            for (output, on) in changes {
                outputs.set(output, on);
            }
        });
    }

    /// Writes `value` to the bits of `mask` of a port and leaves the others alone. Nobody waits
    /// for an answer, so what cannot be switched on stays off.
    pub(crate) fn write_port_bits(&mut self, port: u16, mask: u8, value: u8) {
        let wires = self.state.model.ports.writable(port).unwrap_or_default();
        let now = self.state.outputs.value_of(wires);
        let wanted = now & !mask | value & mask;
        let refused = (0..8).filter(|&bit| {
            let write = BitTest { port, bit: Bit::One(bit), value: wanted >> bit & 1 };
            (wanted ^ now) >> bit & 1 == 1 && self.check_switching(write).is_err()
        });
        let value = refused.fold(wanted, |value, bit| value ^ 1 << bit);
        self.write_port(port, value);
    }

    /// `9` or `H` for a write that asks for stages or a spindle which cannot be switched on now.
    /// The spindle needs stages that were on before the write, or that it switches on. A bit that
    /// is written by itself asks for what it says; a byte, for what was off before.
    pub(crate) fn check_switching(&self, write: BitTest) -> Result<(), Why> {
        let before = self.state.outputs;
        let single = matches!(self.wires(write), [_]);
        let asked = |output: Output| {
            let mut changes = self.changes(write);
            changes.any(|change| change == (output, true)) && (single || !before.get(output))
        };
        let (stages, spindle) = (asked(Output::STAGE), asked(Output::SPINDLE));
        if !stages && !spindle {
            return Ok(());
        }
        if !self.state.can_power_motors() {
            return Err(Why::Stages(self.why_off()));
        }
        if !stages && !before.get(Output::STAGE) {
            return Err(Why::Spindle);
        }
        if self.state.cover_forbids() {
            // The stages cannot be switched on with the cover open (99 4, code 9).
            return Err(match stages {
                true => Why::StagesBehindCover,
                false => Why::Cover(Opened::Already),
            });
        }
        Ok(())
    }

    /// The wires that a write is about.
    fn wires(&self, BitTest { port, bit, .. }: BitTest) -> &[Wire] {
        let wires = self.state.model.ports.writable(port).unwrap_or_default();
        match bit {
            // Of a logical port any bit number means its one bit.
            Bit::One(bit) if wires.len() > 1 => {
                let bit = usize::from(bit);
                wires.get(bit..=bit).unwrap_or_default()
            }
            _ => wires,
        }
    }

    /// What a write does to each output that it is about.
    fn changes(&self, write: BitTest) -> impl Iterator<Item = (Output, bool)> + '_ {
        let wires = self.wires(write).iter().enumerate();
        wires.filter_map(move |(bit, wire)| match wire {
            Wire::Output(output) => Some((*output, write.value >> bit & 1 == 1)),
            Wire::Inverted(output) => Some((*output, write.value >> bit & 1 == 0)),
            _ => None,
        })
    }
}
