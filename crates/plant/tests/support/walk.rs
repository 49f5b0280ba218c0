//! The controller computes where motions end; here every step is walked instead.

use std::sync::Arc;

use vimc4_device::{AXES, Event, Motion, Output, Point, Segment, Stamp, Time};
use vimc4_plant::{End, Machine};

/// What a walk knows.
pub(crate) struct Walk {
    pub(crate) machine: Arc<Machine>,
    pub(crate) counter: Point,
    carriage: Point,
    running: Option<(Segment, Time)>,
}

impl Walk {
    /// Walks every motion among these outputs, from carriages at 0. `cut_off` says that the
    /// power was lost, which ends a motion at any time.
    pub(crate) fn all<'a>(
        machine: Arc<Machine>,
        outputs: impl IntoIterator<Item = &'a Output>,
        cut_off: bool,
    ) -> Walk {
        let zero = Point::default();
        let mut walk = Walk { machine, counter: zero, carriage: zero, running: None };
        for output in outputs {
            let Output::Event(Stamp { at: when, .. }, Event::Motion(motion)) = output else {
                continue;
            };
            match motion {
                Motion::Begins { origin, segment } => {
                    assert_eq!(*origin, walk.counter);
                    walk.running = Some(((**segment).clone(), *when));
                }
                Motion::Changes { segment } => {
                    let (old, began) = walk.running.take().expect("a segment that began");
                    let made = old.profile.steps_at(when.nanos_since(began));
                    let same =
                        |segment: &Segment| segment.steps().take(made as usize).collect::<Vec<_>>();
                    assert_eq!(same(&old), same(segment), "braking changed the past");
                    walk.running = Some(((**segment).clone(), began));
                }
                Motion::Ends { steps } => walk.ends(*when, *steps, cut_off),
            }
        }
        assert!(walk.running.is_none(), "a segment never ended");
        walk
    }

    fn sign(&self, axis: usize) -> i64 {
        if self.machine.axis(axis).inverted { -1 } else { 1 }
    }

    fn carriage_after(&self, offset: &Point) -> Point {
        std::array::from_fn(|axis| self.carriage[axis] + self.sign(axis) * offset[axis])
    }

    fn presses(&self, axis: usize, carriage: i64) -> bool {
        let axis = self.machine.axis(axis);
        axis.presses(End::Negative, carriage) || axis.presses(End::Positive, carriage)
    }

    /// Walks the segment that ends at `at` after `steps` steps, and checks that it had to end
    /// there: no switch before, and the end of the profile, a switch, or the time itself.
    fn ends(&mut self, at: Time, steps: u64, cut_off: bool) {
        let (segment, began) = self.running.take().expect("a segment that began");
        let mut offset = Point::default();
        let mut last = Time::ZERO;
        let mut on_switch = false;
        let mut walked = 0;
        let total = segment.profile.steps();
        for step in segment.steps() {
            let when = began.after_nanos(step.nanos);
            if walked == steps {
                assert!(on_switch || (cut_off && when > at), "a step at {when} is missing");
                break;
            }
            assert!(!on_switch, "step {walked} runs onto a switch, but the motion goes on");
            walked = step.number;
            let (before, after) = (self.carriage_after(&offset), self.carriage_after(&step.offset));
            offset = step.offset;
            on_switch = (0..AXES).any(|axis| {
                before[axis] != after[axis]
                    && self.presses(axis, after[axis])
                    && !self.presses(axis, before[axis])
            });
            last = when;
        }
        assert_eq!(walked, steps, "the segment has {total} steps");
        assert!(last <= at, "the last step was at {last}");
        self.carriage = self.carriage_after(&offset);
        self.counter = std::array::from_fn(|axis| self.counter[axis] + offset[axis]);
    }
}
