//! When something will hold, computed from the running segment.

use vimc4_device::{Fact, Time};
use vimc4_motion::Running;
use vimc4_plant::{End, Slide};

use crate::language::Axis;
use crate::state::State;

impl State {
    /// The first instant from `from` on at which a fact holds while nothing else happens.
    pub(crate) fn forecast(&self, fact: &Fact, from: Time) -> Option<Time> {
        match *fact {
            Fact::Axis { axis, low, high } => {
                let axis = self.fitted_index(axis)?;
                let here = self.position[axis];
                let within = |way: i64| (low..=high).contains(&(here + way));
                // No counter gets further than this.
                let (least, most) = (i64::from(i32::MIN), i64::from(i32::MAX));
                let ways = [low, high].map(|place| place.clamp(least, most) - here);
                Running::first_time_of(self.running(), axis, from, within, ways)
            }
            Fact::Limit { axis, positive, active } => {
                let axis = self.fitted_index(axis)?;
                let end = if positive { End::Positive } else { End::Negative };
                let (plant, signs) = (&self.plant, self.carriage_signs());
                let is_so = |slide: &Slide| plant.pressed(axis, end, slide) == active;
                plant.when_first(axis, self.running(), &signs, from, is_so)
            }
            // No motion changes an input.
            Fact::PortBit { port, bit, level } => {
                let value = self.model.io.read_port(&self.plant, port);
                (value >> (bit & 7) & 1 == u8::from(level)).then_some(from)
            }
            Fact::Signal { signal, value } => (self.signal_value(signal)? == value).then_some(from),
        }
    }

    /// The index of an axis, if the machine has it.
    fn fitted_index(&self, axis: u8) -> Option<usize> {
        let axis = Axis::from_index(usize::from(axis));
        axis.filter(|axis| self.is_fitted(*axis)).map(Axis::index)
    }
}
