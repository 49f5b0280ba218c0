//! When something will hold, computed from the running segment.

use vimc4_device::{Fact, SignalId, Time};
use vimc4_motion::Running;
use vimc4_plant::{End, PlantSignal, Slide};

use crate::axes::wrap;
use crate::firmware::Firmware;
use crate::wiring::Wire;

/// How far a counter goes before it wraps.
const COUNTER: i64 = 1 << 24;

impl Firmware {
    /// The first instant from `from` on at which a fact holds while nothing else happens.
    pub(crate) fn forecast(&self, fact: &Fact, from: Time) -> Option<Time> {
        match *fact {
            Fact::Axis { axis, low, high } => {
                let axis = usize::from(axis);
                let origin = *self.state.position.get(axis)?;
                // A single position is taken modulo the counter's range, however far beyond it is.
                let (low, high) = if low == high { (wrap(low), wrap(low)) } else { (low, high) };
                let within = |offset: i64| (low..=high).contains(&wrap(origin + offset));
                // It begins to hold at a limit, or where the counter wraps.
                let (least, most) = (-(COUNTER / 2), COUNTER / 2 - 1);
                let places = [low.max(least), high.min(most), least, most];
                let ways = places.map(|place| wrap(place - origin));
                // It may already have wrapped several times.
                let done = self.state.running().map_or(0, |running| running.offset(axis, from));
                let laps = done / COUNTER;
                let turns = [-2, -1, 0, 1, 2].map(|turn| (laps + turn) * COUNTER);
                let offsets = ways.into_iter().flat_map(|way| turns.map(|turn| way + turn));
                Running::first_time_of(self.state.running(), axis, from, within, offsets)
            }
            Fact::Limit { axis, positive, active } => {
                let axis = usize::from(axis);
                let end = if positive { End::Positive } else { End::Negative };
                self.first_limit(axis, end, active, from)
            }
            Fact::PortBit { port, bit, level } => self.first_level(port, bit, level, from),
            Fact::Signal { signal, value } => (self.signal_value(signal)? == value).then_some(from),
        }
    }

    /// When everything that depends on the running segment has taken all the values that it will
    /// take from `from` on.
    pub(crate) fn comes_round(&self, from: Time) -> Option<Time> {
        self.state.running().map_or(Some(from), |running| running.comes_round(from))
    }

    /// What a signal is set to; `None` for one that is not there.
    fn signal_value(&self, signal: SignalId) -> Option<i32> {
        Some(self.state.plant.level(PlantSignal::from_id(signal)?).into())
    }

    /// The first instant at which a bit of a port has a level. While nothing else happens only limit
    /// switches change.
    fn first_level(&self, port: u16, bit: u8, level: bool, from: Time) -> Option<Time> {
        let bit = bit & 7;
        let end = |number: u8| if number == 0 { End::Negative } else { End::Positive };
        let wires = self.state.model.ports.readable(port);
        match wires.and_then(|wires| wires.get(usize::from(bit))) {
            Some(Wire::SwitchLevel(axis, number)) => {
                let axis = usize::from(*axis);
                let plant = &self.state.plant;
                let is_so = |slide: &Slide| plant.switch_level(axis, end(*number), slide) == level;
                self.first_slide(axis, from, is_so)
            }
            Some(Wire::Limit(axis, number)) => {
                self.first_limit(usize::from(*axis), end(*number), level, from)
            }
            _ => (self.read_port(port) >> bit & 1 == u8::from(level)).then_some(from),
        }
    }

    /// The first instant at which a limit switch, as the controller sees it, is active or not.
    fn first_limit(&self, axis: usize, end: End, active: bool, from: Time) -> Option<Time> {
        self.first_slide(axis, from, |slide| self.limit_active_at(axis, end, slide) == active)
    }

    /// The first instant at which something holds for an axis that depends on its limit switches only.
    fn first_slide(&self, axis: usize, from: Time, is_so: impl Fn(&Slide) -> bool) -> Option<Time> {
        let (state, signs) = (&self.state, self.state.carriage_signs());
        state.plant.when_first(axis, state.running(), &signs, from, is_so)
    }
}
