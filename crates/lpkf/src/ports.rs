//! Ports, the spindle, the head and the motor currents.

use std::collections::BTreeMap;

use vimc4_device::{Event, Kinds, Warning};

use crate::Controller;
use crate::model::CommandSet;
use crate::why::Why;

/// The number under which what the controller switches by commands of their own is seen: bit 0
/// the spindle, bit 1 the lowered head, bit 2 the halved current.
pub(crate) const MACHINE_PORT: u16 = 256;

impl Controller {
    /// The value of every output port.
    pub(crate) fn outputs(&self) -> BTreeMap<u16, u8> {
        let state = &self.state;
        let machine = u8::from(state.spindle)
            | u8::from(state.head_down) << 1
            | u8::from(state.half_current) << 2;
        let written = |port: &u8| state.ports.get(port).copied().unwrap_or(0);
        let modules = state.model.io.write.iter().map(|port| (u16::from(*port), written(port)));
        modules.chain([(MACHINE_PORT, machine)]).collect()
    }

    /// Tells which outputs are no longer what they were.
    pub(crate) fn outputs_changed(&mut self, before: &BTreeMap<u16, u8>) {
        if !self.wants(Kinds::PORT) {
            return;
        }
        for (port, value) in self.outputs() {
            if before.get(&port) != Some(&value) {
                self.emit(Event::Port { port, value });
            }
        }
    }

    fn switch(&mut self, change: impl FnOnce(&mut crate::State)) {
        if !self.wants(Kinds::PORT) {
            return change(&mut self.state);
        }
        let before = self.outputs();
        change(&mut self.state);
        self.outputs_changed(&before);
    }

    /// `!EM`.
    pub(crate) fn switch_spindle(&mut self, on: bool) {
        self.switch(|state| state.spindle = on);
    }

    /// `!HP`, `!FP`.
    pub(crate) fn halve_current(&mut self, half: bool) {
        self.switch(|state| state.half_current = half);
    }

    /// The head goes down or up.
    pub(crate) fn move_head(&mut self, down: bool) {
        self.switch(|state| state.head_down = down);
    }

    /// `!WR`. A port has eight bits.
    pub(crate) fn write_port(&mut self, port: u8, data: u16) -> Result<(), Why> {
        if !self.state.model.io.write.contains(&port) {
            return self.no_such_module(port, true);
        }
        self.switch(|state| {
            state.ports.insert(port, data as u8);
        });
        Ok(())
    }

    /// `!RD`. What is not there reads 0 where there is no status for it.
    pub(crate) fn read_module(&mut self, port: u8) -> Result<u8, Why> {
        if !self.state.model.io.read.contains(&port) {
            self.no_such_module(port, false)?;
        }
        Ok(self.read_port(u16::from(port)))
    }

    /// An SMCU has no status for a module that is not there.
    fn no_such_module(&mut self, port: u8, write: bool) -> Result<(), Why> {
        if self.state.model.command_set == CommandSet::MotionSystem {
            return Err(Why::NoPort { port, write });
        }
        if self.wants(Kinds::WARNING) {
            let what = format!("port {port}: no such module").into();
            self.emit(Event::Warning(Warning::NoEffect { what }));
        }
        Ok(())
    }

    /// The value of an input port; 0 where there is none.
    pub(crate) fn read_port(&self, port: u16) -> u8 {
        let mut value = 0;
        for bit in 0..8 {
            if let Some(number) = self.input_number(port, bit) {
                value |= u8::from(self.state.plant.input(number)) << bit;
            }
        }
        value
    }

    /// The number of the user input behind a bit of a port.
    pub(crate) fn input_number(&self, port: u16, bit: u8) -> Option<u8> {
        let place = self.state.model.io.read.iter().position(|p| u16::from(*p) == port)?;
        u8::try_from(place).ok().filter(|_| bit < 8).map(|place| place * 8 + bit)
    }
}
