//! The target of a job: a controller and its machine.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use vimc4_isel_wire::{AxisSet, Dialect};
use vimc4_motion::Ramp;
use vimc4_plant::{JobSetup, Machine, Unit};

use super::zero::{Register, Zero};
use crate::geometry::{Scale, Speeds, Steps};
use crate::language::Value;

/// The properties of a controller that matter to jobs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Controller {
    /// Its command set.
    pub dialect: Dialect,
    /// The speeds it accepts, in Hz.
    pub speeds: RangeInclusive<u32>,
    /// Its ramps, before a job changes them.
    pub ramp: Ramp,
    /// The ports that can be read.
    pub inputs: BTreeMap<u16, InputPort>,
    /// The ports that can be written.
    pub outputs: BTreeMap<u16, OutputPort>,
    /// Bytes for a stored program.
    pub memory: u32,
    /// Bytes that a stored command takes.
    pub command_bytes: u32,
    /// Bytes that each of its parameters takes.
    pub parameter_bytes: u32,
    /// Whether the offset of a conditional branch counts from the line after it, not from its own.
    pub branch_from_next: bool,
}

/// Which way a port leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Direction {
    /// The controller reads it.
    Input,
    /// The controller writes it.
    Output,
}

/// The bits of a port that can be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputPort {
    /// The bits with a wire; the others read 0.
    pub wired: u8,
    /// The bits that can change without an operator: inputs, switches, outputs that are read back.
    pub free: u8,
    /// What the other bits read while nobody touches the panel.
    pub rest: u8,
}

/// The bits of a port that can be written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputPort {
    /// The bits with a wire.
    pub wired: u8,
    /// The port is a single bit, and the controller refuses other values than 0 and 1.
    pub is_single: bool,
}

/// A controller on a machine, as a job sees them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// The controller.
    pub controller: Controller,
    /// Speeds, ports, spindle and coolant.
    pub setup: JobSetup,
    /// The existing axes.
    pub axes: AxisSet,
    /// Those that have a reference point.
    pub referable: AxisSet,
    /// The rotary axes.
    pub rotary: AxisSet,
    /// The scale of each axis.
    pub scales: [Scale; 4],
    /// The lowest and the highest counter of each axis.
    pub travel: [(Option<i64>, Option<i64>); 4],
    /// Where the work-piece zero is before the job says anything; at the machine's zero on axes
    /// that it does not name.
    pub zero: Zero,
    /// What is in the registers for work-piece zeros, 1 to 8, before the job fills them.
    pub registers: [Zero; 8],
}

/// The sets of axes where A goes alone: X, Y and Z together, and A.
pub(super) fn a_apart(axes: AxisSet) -> impl Iterator<Item = AxisSet> {
    let of = move |part: u8| AxisSet::from_bits(axes.bits() & part).unwrap_or(AxisSet::NONE);
    [of(0b0111), of(0b1000)].into_iter().filter(|axes| !axes.is_empty())
}

/// Thousandths of an arc second in a turn.
const TURN: i64 = 1_296_000_000;

impl Target {
    /// A controller on a machine.
    #[must_use]
    pub fn new(controller: Controller, machine: &Machine) -> Target {
        let set = |is: &dyn Fn(usize) -> bool| {
            let bits = (0..4).filter(|&axis| machine.fits(axis) && is(axis));
            AxisSet::from_bits(bits.map(|axis| 1 << axis).sum()).unwrap_or(AxisSet::NONE)
        };
        Target {
            controller,
            setup: machine.job.clone(),
            axes: set(&|_| true),
            referable: set(&|axis| machine.has_reference(axis)),
            rotary: set(&|axis| machine.axis(axis).unit == Unit::Rotary),
            scales: std::array::from_fn(|axis| {
                let axis = machine.axis(axis);
                let per = axis.lead_um.map_or(TURN, |lead| i64::from(lead) * 1_000);
                Scale { steps: i64::from(axis.steps_per_turn), per }
            }),
            travel: std::array::from_fn(|axis| machine.axis(axis).travel()),
            zero: Zero::of(&machine.job.zero),
            registers: machine.job.registers.each().map(Zero::of),
        }
    }

    /// Moves the work-piece zero that a job begins with, on the axes that are named.
    pub fn set_zero(&mut self, zero: Zero) {
        self.zero = zero.or(self.zero);
    }

    /// Fills a register for work-piece zeros, on the axes that are named.
    pub fn fill(&mut self, Register { number, zero }: Register) {
        let place = usize::from(number).checked_sub(1);
        if let Some(held) = place.and_then(|place| self.registers.get_mut(place)) {
            *held = zero.or(*held);
        }
    }

    /// The speeds the controller accepts.
    #[must_use]
    pub fn speeds(&self) -> Speeds {
        let (lowest, highest) = self.controller.speeds.clone().into_inner();
        Speeds { lowest, highest, ramp: self.controller.ramp }
    }

    /// The counters at places.
    #[must_use]
    pub fn round(&self, place: &[Value; 4]) -> Steps {
        std::array::from_fn(|axis| self.scales[axis].round(place[axis]))
    }
}
