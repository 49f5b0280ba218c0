//! Ports, the spindle, the head and the motor currents.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use vimc4_plant::Plant;

use crate::model::Io;

/// The port number that shows what the controller switches by special commands: bit 0 the spindle,
/// bit 1 the lowered head, bit 2 the halved current.
const MACHINE_PORT: u16 = 256;

/// Everything that the controller switches. The default is what holds after power-on.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Outputs {
    pub(crate) spindle: bool,
    pub(crate) head_down: bool,
    pub(crate) half_current: bool,
    /// What was written to each port.
    pub(crate) written: BTreeMap<u8, u8>,
}

impl Outputs {
    /// The value of every output port.
    pub(crate) fn values(&self, io: &Io) -> BTreeMap<u16, u8> {
        let machine = u8::from(self.spindle)
            | u8::from(self.head_down) << 1
            | u8::from(self.half_current) << 2;
        let written = |port: &u8| self.written.get(port).copied().unwrap_or(0);
        let modules = io.write.iter().map(|port| (u16::from(*port), written(port)));
        modules.chain([(MACHINE_PORT, machine)]).collect()
    }
}

impl Io {
    /// The value of an input port; 0 where there is none.
    pub(crate) fn read_port(&self, plant: &Plant, port: u16) -> u8 {
        (0..8).fold(0, |value, bit| {
            let input = self.input_number(port, bit);
            value | u8::from(input.is_some_and(|number| plant.input(number))) << bit
        })
    }

    /// The number of the user input behind a bit of a port.
    pub(crate) fn input_number(&self, port: u16, bit: u8) -> Option<u8> {
        let place = self.read.iter().position(|p| u16::from(*p) == port)?;
        u8::try_from(place).ok().filter(|_| bit < 8).map(|place| place * 8 + bit)
    }
}
