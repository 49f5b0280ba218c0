//! When a condition will hold, computed from the running segment.

use vimc4_device::{Condition, Time};

use crate::language::Axis;
use crate::state::State;

impl State {
    /// The first instant before the next cause at which a condition holds.
    pub(crate) fn forecast(&self, condition: &Condition) -> Option<Time> {
        let now = self.now;
        match *condition {
            Condition::Idle => self.rests().then_some(now),
            Condition::AxisAt { axis, position } => {
                let index = usize::from(axis);
                let axis = Axis::from_index(index).filter(|axis| self.is_fitted(*axis))?;
                let way = position - self.position[axis.index()];
                self.first_time(index, |offset| offset == way, [way])
            }
            Condition::Outside { low, high } => self
                .fitted()
                .filter_map(|axis| {
                    let axis = axis.index();
                    let here = self.position[axis];
                    let (low, high) = (low[axis] - here, high[axis] - here);
                    self.first_time(axis, |way| way < low || way > high, [low - 1, high + 1])
                })
                .min(),
            // Nothing that moves by itself changes an input.
            Condition::PortBit { port, bit, level } => {
                let holds =
                    self.model.io.read_port(&self.plant, port) >> (bit & 7) & 1 == u8::from(level);
                holds.then_some(now)
            }
        }
    }

    /// The first instant from now to before the next cause at which the offset of an axis from
    /// the start of the running segment fulfils a predicate, which can begin to hold at the
    /// `candidates` only.
    fn first_time<const N: usize>(
        &self,
        axis: usize,
        holds: impl Fn(i64) -> bool,
        candidates: [i64; N],
    ) -> Option<Time> {
        let now = self.now;
        let Some(running) = self.running() else {
            return holds(0).then_some(now);
        };
        let first = running.first_time(axis, now, holds, candidates);
        first.filter(|&at| at == now || self.next_cause().is_none_or(|(wake, _)| at < wake))
    }
}
