//! The state of a machine.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_device::{AXES, Point};

use crate::{End, Machine, PlantSignal};

/// The buttons, switches and sensors around a machine, as they are, not as a port shows them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Panel {
    /// START is pressed.
    pub start: bool,
    /// STOP is pressed.
    pub stop: bool,
    /// ON is pressed.
    pub on: bool,
    /// The cover button is pressed.
    pub cover_button: bool,
    /// The emergency stop is pressed or still latched.
    pub emergency_stop: bool,
    /// The key switch stands on automatic, not on test.
    pub automatic: bool,
    /// The cover is closed.
    pub cover_closed: bool,
    /// The power stages are too hot.
    pub overtemperature: bool,
    /// The motor supply voltage is good.
    pub power_ok: bool,
    /// The tool length probe is touched.
    pub probe: bool,
}

impl Default for Panel {
    /// Nothing pressed, key on automatic, cover closed, power good.
    fn default() -> Panel {
        Panel {
            start: false,
            stop: false,
            on: false,
            cover_button: false,
            emergency_stop: false,
            automatic: true,
            cover_closed: true,
            overtemperature: false,
            power_ok: true,
            probe: false,
        }
    }
}

/// A machine with its carriages somewhere and its panel in some state.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plant {
    machine: Arc<Machine>,
    carriage: Point,
    panel: Panel,
    /// User inputs, bit n for input n.
    inputs: u64,
    /// Limit switches held by hand, two bits an axis.
    held: u16,
}

impl Plant {
    /// The machine as it stands at first.
    #[must_use]
    pub fn new(machine: Arc<Machine>) -> Plant {
        let carriage = std::array::from_fn(|axis| machine.axis(axis).start);
        Plant { machine, carriage, panel: Panel::default(), inputs: 0, held: 0 }
    }

    /// Its profile.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Where the carriages are, steps of the machine.
    #[must_use]
    pub fn carriage(&self) -> Point {
        self.carriage
    }

    /// The panel.
    #[must_use]
    pub fn panel(&self) -> &Panel {
        &self.panel
    }

    /// A user input by number.
    #[must_use]
    pub fn input(&self, number: u8) -> bool {
        self.inputs >> (number & 63) & 1 == 1
    }

    /// What a signal is set to.
    #[must_use]
    pub fn level(&self, signal: PlantSignal) -> bool {
        match signal {
            PlantSignal::Start => self.panel.start,
            PlantSignal::Stop => self.panel.stop,
            PlantSignal::On => self.panel.on,
            PlantSignal::CoverButton => self.panel.cover_button,
            PlantSignal::EmergencyStop => self.panel.emergency_stop,
            PlantSignal::Key => self.panel.automatic,
            PlantSignal::Cover => self.panel.cover_closed,
            PlantSignal::Overtemperature => self.panel.overtemperature,
            PlantSignal::PowerOk => self.panel.power_ok,
            PlantSignal::Probe => self.panel.probe,
            PlantSignal::Limit(axis, end) => self.is_held(axis, end),
            PlantSignal::Input(number) => self.input(number),
        }
    }

    /// Sets a signal; says whether that changed anything.
    pub fn set(&mut self, signal: PlantSignal, level: bool) -> bool {
        let place = match signal {
            PlantSignal::Start => &mut self.panel.start,
            PlantSignal::Stop => &mut self.panel.stop,
            PlantSignal::On => &mut self.panel.on,
            PlantSignal::CoverButton => &mut self.panel.cover_button,
            PlantSignal::EmergencyStop => &mut self.panel.emergency_stop,
            PlantSignal::Key => &mut self.panel.automatic,
            PlantSignal::Cover => &mut self.panel.cover_closed,
            PlantSignal::Overtemperature => &mut self.panel.overtemperature,
            PlantSignal::PowerOk => &mut self.panel.power_ok,
            PlantSignal::Probe => &mut self.panel.probe,
            PlantSignal::Limit(axis, end) => {
                let bit = 1u16 << (axis * 2 + usize::from(end == End::Positive));
                let before = self.held;
                self.held = if level { before | bit } else { before & !bit };
                return self.held != before;
            }
            PlantSignal::Input(number) => {
                let bit = 1u64 << (number & 63);
                let before = self.inputs;
                self.inputs = if level { before | bit } else { before & !bit };
                return self.inputs != before;
            }
        };
        core::mem::replace(place, level) != level
    }

    /// Whether a limit switch is held active by hand.
    #[must_use]
    pub fn is_held(&self, axis: usize, end: End) -> bool {
        self.held >> (axis * 2 + usize::from(end == End::Positive)) & 1 == 1
    }

    /// Whether the limit switch of an end would be pressed with the carriage at `position`.
    #[must_use]
    pub fn pressed_at(&self, axis: usize, end: End, position: i64) -> bool {
        self.is_held(axis, end) || self.machine.axis(axis).presses(end, position)
    }

    /// The places of the carriage on either side of where a limit switch of an axis changes.
    pub fn edges(&self, axis: usize) -> impl Iterator<Item = i64> + use<> {
        let profile = self.machine.axis(axis);
        let below = profile.negative_switch.map(|at| [at, at + 1]);
        let above = profile.positive_switch.map(|at| [at - 1, at]);
        [below, above].into_iter().flatten().flatten()
    }

    /// The electrical level of a limit switch with the carriage at `position`: 1 is high.
    #[must_use]
    pub fn switch_level_at(&self, axis: usize, end: End, position: i64) -> bool {
        self.pressed_at(axis, end, position) != self.machine.switches_low_active
    }

    /// Moves the carriages as the counters went: by `offset`, having been as far as `low` and
    /// `high` on the way, each axis with the sign of its direction. Returns the steps lost, in
    /// the direction of the counters.
    pub fn follow(&mut self, signs: &Point, offset: &Point, low: &Point, high: &Point) -> Point {
        let signed = |point: &Point| -> Point { std::array::from_fn(|a| signs[a] * point[a]) };
        let (a, b) = (signed(low), signed(high));
        let low = std::array::from_fn(|axis| a[axis].min(b[axis]));
        let high = std::array::from_fn(|axis| a[axis].max(b[axis]));
        signed(&self.travel(&signed(offset), &low, &high))
    }

    /// Moves the carriages by `offset`, having been as far as the offsets `low` and `high` on
    /// the way, all in steps of the machine. Where that way leads beyond the mechanics, the
    /// carriage stays at its stop and the motor loses the steps. Returns the steps lost, per
    /// axis: how much further the carriage would have come.
    pub fn travel(&mut self, offset: &Point, low: &Point, high: &Point) -> Point {
        let mut lost = [0; AXES];
        for axis in 0..AXES {
            let profile = self.machine.axis(axis);
            let at = self.carriage[axis];
            let below = profile.lowest.map_or(0, |lowest| (lowest - (at + low[axis])).max(0));
            let above = profile.highest.map_or(0, |highest| (at + high[axis] - highest).max(0));
            self.carriage[axis] = at + offset[axis] + below - above;
            lost[axis] = above - below;
        }
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mill() -> Plant {
        Plant::new(Machine::builtin("mill").unwrap())
    }

    #[test]
    fn a_carriage_stays_at_its_stop_and_comes_back_from_there() {
        let mut plant = mill();
        let start = plant.carriage()[0];
        let lowest = plant.machine().axes.x.lowest.unwrap();
        let along_x =
            |way: i64| -> Point { std::array::from_fn(|axis| if axis == 0 { way } else { 0 }) };
        let down = along_x(-(start - lowest) - 100);
        assert_eq!(plant.travel(&down, &down, &along_x(0)), along_x(-100));
        assert_eq!(plant.carriage()[0], lowest);
        assert_eq!(plant.travel(&along_x(100), &along_x(0), &along_x(100)), along_x(0));
        assert_eq!(plant.carriage()[0], lowest + 100);
    }

    #[test]
    fn a_switch_is_pressed_by_the_carriage_or_by_hand() {
        let mut plant = mill();
        assert!(!plant.pressed_at(0, End::Negative, 0));
        assert!(plant.pressed_at(0, End::Negative, -1));
        assert!(plant.set(PlantSignal::Limit(0, End::Negative), true));
        assert!(plant.pressed_at(0, End::Negative, 0));
        assert!(!plant.set(PlantSignal::Limit(0, End::Negative), true));
    }
}
