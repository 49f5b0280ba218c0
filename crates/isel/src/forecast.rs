//! When a condition will hold, computed from the running segment.

use vimc4_device::{Condition, Time};
use vimc4_motion::Running;

use crate::axes::{AXES, wrap};
use crate::firmware::Firmware;

impl Firmware {
    /// The first instant before the next cause at which a condition holds.
    pub(crate) fn forecast(&self, condition: &Condition) -> Option<Time> {
        let now = self.state.now;
        match *condition {
            Condition::Idle => self.state.is_idle().then_some(now),
            Condition::AxisAt { axis, position } => {
                let axis = usize::from(axis);
                let origin = *self.state.position.get(axis)?;
                self.first_time(
                    axis,
                    |counter| wrap(origin + counter) == wrap(position),
                    || {
                        // The counter's way to the position, either way round the 24 bits.
                        let way = wrap(position - origin);
                        vec![way, way - (1 << 24), way + (1 << 24)]
                    },
                )
            }
            Condition::Outside { low, high } => (0..AXES)
                .filter_map(|axis| {
                    let origin = self.state.position[axis];
                    let outside = |offset: i64| {
                        let at = wrap(origin + offset);
                        at < low[axis] || at > high[axis]
                    };
                    self.first_time(axis, outside, || {
                        vec![low[axis] - 1 - origin, high[axis] + 1 - origin]
                    })
                })
                .min(),
            Condition::PortBit { port, bit, level } => {
                let holds = |controller: &Firmware| {
                    controller.read_port(port) >> (bit & 7) & 1 == u8::from(level)
                };
                if holds(self) {
                    return Some(now);
                }
                // Between two causes only limit switches change by themselves.
                let Running { segment, began } = self.state.running()?;
                let mut times: Vec<Time> = (0..AXES)
                    .flat_map(|axis| self.edge_offsets(axis).map(move |offset| (axis, offset)))
                    .filter_map(|(axis, offset)| segment.time_at(axis, offset))
                    .map(|nanos| began.after_nanos(nanos))
                    .filter(|&at| at > now && self.state.wake().is_none_or(|wake| at < wake))
                    .collect();
                times.sort_unstable();
                times.into_iter().find(|&at| {
                    let mut later = self.clone();
                    later.state.now = at;
                    holds(&later)
                })
            }
        }
    }

    /// The offsets of the counters at which a switch of an axis changes.
    fn edge_offsets(&self, axis: usize) -> impl Iterator<Item = i64> {
        let standing = self.state.plant.carriage()[axis];
        let sign = self.state.carriage_sign(axis);
        self.state.plant.edges(axis).map(move |place| sign * (place - standing))
    }

    /// The first instant from now to before the next cause at which the offset of an axis from
    /// the start of the running segment fulfils a predicate, which can begin to hold at the
    /// `candidates` only.
    fn first_time(
        &self,
        axis: usize,
        holds: impl Fn(i64) -> bool,
        candidates: impl FnOnce() -> Vec<i64>,
    ) -> Option<Time> {
        let now = self.state.now;
        let Some(running) = self.state.running() else {
            return holds(0).then_some(now);
        };
        let first = running.first_time(axis, now, holds, candidates());
        first.filter(|&at| at == now || self.state.wake().is_none_or(|wake| at < wake))
    }
}
