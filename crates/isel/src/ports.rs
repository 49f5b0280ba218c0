//! Ports: reading them, and switching outputs.
//!
//! Only the power stages and the spindle can be refused, and only when they are switched *on*:
//! switching off needs neither power nor a closed cover. A refused write changes nothing, because
//! values are taken over only where the answer is `0` (99 2.2.14).

use vimc4_device::{Event, Kinds};
use vimc4_isel_wire::{Bit, BitTest, PortMap as _, PortTest};
use vimc4_plant::End;

use crate::activity::PortCondition;
use crate::firmware::Firmware;
use crate::why::{Opened, Why};
use crate::wiring::{Output, Outputs, Wire};

impl Firmware {
    // --- reading ---

    /// The value of a readable port.
    pub(crate) fn read_port(&self, port: u16) -> u8 {
        self.state.model.ports.readable(port).map_or(0, |wires| self.value_of(wires))
    }

    /// The value of a port as its outputs drive it.
    pub(crate) fn driven_value(&self, port: u16) -> u8 {
        let wires = self.state.model.ports.writable(port);
        wires.map_or(0, |wires| self.state.driven().value_of(wires))
    }

    /// The byte that wires show, from bit 0 up.
    pub(crate) fn value_of(&self, wires: &[Wire]) -> u8 {
        let bits = wires.iter().enumerate();
        bits.fold(0, |value, (bit, wire)| value | u8::from(self.level(*wire)) << bit)
    }

    /// The level of a wire: 1 if what it is named for is true.
    pub(crate) fn level(&self, wire: Wire) -> bool {
        let state = &self.state;
        let panel = state.plant.panel();
        let end = |number: u8| if number == 0 { End::Negative } else { End::Positive };
        match wire {
            Wire::Reserved => false,
            Wire::Stop => panel.stop,
            Wire::Start => panel.start,
            Wire::On => panel.on,
            Wire::EmergencyStop => panel.emergency_stop,
            Wire::EmergencyCircuit => !panel.emergency_stop,
            Wire::Cover => panel.cover_closed,
            Wire::CoverAutomatic => panel.cover_closed && panel.automatic,
            Wire::CoverSetup => panel.cover_closed || !panel.automatic,
            Wire::Key => panel.automatic,
            Wire::PowerOk => panel.power_ok,
            Wire::Overtemperature => panel.overtemperature,
            Wire::Probe => panel.probe,
            Wire::Motors => state.motors_on(),
            Wire::Input(number) => {
                state.plant.input(number) || panel.probe && state.model.ports.probe == Some(wire)
            }
            Wire::SwitchLevel(axis, number) => {
                let axis = usize::from(axis);
                state.plant.switch_level(axis, end(number), &state.slide_at(axis, state.now))
            }
            Wire::Limit(axis, number) => {
                let axis = usize::from(axis);
                self.limit_active_at(axis, end(number), &state.slide_at(axis, state.now))
            }
            Wire::Configured(axis) => state.axes.has(usize::from(axis)),
            Wire::Rotary(axis) => state.settings.rotary.has(usize::from(axis)),
            Wire::Output(output) => state.driven().get(output),
            Wire::Inverted(output) => !state.driven().get(output),
        }
    }

    /// Whether a condition on a port holds.
    pub(crate) fn is_met(&self, condition: PortCondition) -> bool {
        match condition {
            PortCondition::Mask(PortTest { port, mask, value }) => {
                self.read_port(port) & mask == value & mask
            }
            PortCondition::Bit(BitTest { port, bit, value }) => {
                let now = self.read_port(port);
                match bit {
                    Bit::One(bit) if !self.state.model.ports.is_logical(port) => {
                        now >> bit & 1 == value & 1
                    }
                    _ => now == value,
                }
            }
        }
    }

    // --- writing ---

    /// Changes outputs, and tells which ports that changed.
    pub(crate) fn drive(&mut self, change: impl FnOnce(&mut Outputs)) {
        let before = self.state.driven();
        change(&mut self.state.outputs);
        self.outputs_changed(before);
    }

    /// Tells which output ports differ from what was driven before.
    pub(crate) fn outputs_changed(&mut self, before: Outputs) {
        let after = self.state.driven();
        if before == after || !self.wants(Kinds::PORT) {
            return;
        }
        let model = std::sync::Arc::clone(&self.state.model);
        for (port, wires) in &model.ports.write {
            let value = after.value_of(wires);
            if value != before.value_of(wires) {
                self.emit(Event::Port { port: *port, value });
            }
        }
    }

    /// The safety relay opens: the power stages are off until ON.
    pub(crate) fn open_relay(&mut self) {
        let driven = self.state.driven();
        self.state.relay = false;
        self.state.outputs.set(Output::STAGE, false);
        self.outputs_changed(driven);
    }

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

    /// Writes `value` to the bits of `mask` of a port and leaves the others alone. There is no
    /// command to refuse, so what cannot be switched on stays off.
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
    /// The spindle needs stages that are on already or that the same write switches on. A single
    /// bit counts as a request to switch on whenever it is set; in a byte only outputs that were
    /// off before count.
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
            return Err(Why::Stages(self.state.why_off()));
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
            // On a logical port any bit number means its single bit.
            Bit::One(bit) if wires.len() > 1 => {
                let bit = usize::from(bit);
                wires.get(bit..=bit).unwrap_or_default()
            }
            _ => wires,
        }
    }

    /// What a write does to each output that it concerns.
    fn changes(&self, write: BitTest) -> impl Iterator<Item = (Output, bool)> + '_ {
        let wires = self.wires(write).iter().enumerate();
        wires.filter_map(move |(bit, wire)| match wire {
            Wire::Output(output) => Some((*output, write.value >> bit & 1 == 1)),
            Wire::Inverted(output) => Some((*output, write.value >> bit & 1 == 0)),
            _ => None,
        })
    }
}
