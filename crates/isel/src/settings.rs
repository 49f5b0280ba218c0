//! The values that the `I` commands set.

use serde::{Deserialize, Serialize};
use vimc4_isel_wire::{AxisSet, PortTest, Text32};
use vimc4_plant::Machine;

use crate::model::Model;

/// What the `I` commands set. Commands act on it at once; on the iMC-xx it can be kept in the
/// flash memory (12 4.2).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings {
    /// `ID`: axes whose direction is inverted.
    pub directions: AxisSet,
    /// `IR`: axes whose reference direction is inverted.
    pub references: AxisSet,
    /// `Id`: reference speeds in Hz.
    pub reference_speeds: [u32; 4],
    /// `IF`: steps that a reference run goes on after it has left the switch.
    pub free_steps: [i32; 4],
    /// `Ij`: start-stop frequency in Hz.
    pub start_stop: u32,
    /// `IJ`: acceleration in Hz/ms.
    pub acceleration: u32,
    /// `IO`: only the ports are used; kept, without effect.
    pub io_only: bool,
    /// `IE`: a nibble for each axis: switch 1 and 2 enabled, switch 1 and 2 low-active.
    pub limits: u16,
    /// `Ie`: axes whose switches are swapped.
    pub swapped: AxisSet,
    /// `IT`, and `IL` of the IMC4-M: axes declared rotary, without effect on motion.
    pub rotary: AxisSet,
    /// `IA`: the abort input.
    pub abort: PortTest,
    /// `Ia`: the error output.
    pub error_signal: PortTest,
    /// `IH`: the outer cover's input.
    pub cover: PortTest,
    /// `IN`: the outer emergency stop's input.
    pub emergency: PortTest,
    /// `IC`: 9600 baud after the next reset.
    pub baud_9600: bool,
    /// `IU`: the user's text.
    pub user_info: Text32,
}

/// A mask of 0 switches a watch or a signal off.
const OFF: PortTest = PortTest { port: 0, mask: 0, value: 0 };

impl Settings {
    /// The factory's values for a model on a machine: the limit switches have the levels of
    /// the machine they were delivered with.
    #[must_use]
    pub fn factory(model: &Model, machine: &Machine) -> Settings {
        Settings {
            directions: AxisSet::NONE,
            references: AxisSet::NONE,
            reference_speeds: model.defaults.reference_speed,
            free_steps: [0; 4],
            start_stop: model.defaults.start_stop,
            acceleration: model.defaults.acceleration,
            io_only: false,
            limits: if machine.switches_low_active { 0xFFFF } else { 0x3333 },
            swapped: AxisSet::NONE,
            rotary: AxisSet::NONE,
            abort: OFF,
            error_signal: OFF,
            cover: OFF,
            emergency: OFF,
            baud_9600: false,
            user_info: Text32::default(),
        }
    }

    /// Whether a limit switch (0 for switch 1, 1 for switch 2) is enabled.
    #[must_use]
    pub fn is_enabled(&self, axis: usize, switch: usize) -> bool {
        self.limits >> (axis * 4 + switch) & 1 == 1
    }

    /// Whether a limit switch is active at a low level.
    #[must_use]
    pub(crate) fn is_low_active(&self, axis: usize, switch: usize) -> bool {
        self.limits >> (axis * 4 + 2 + switch) & 1 == 1
    }
}
