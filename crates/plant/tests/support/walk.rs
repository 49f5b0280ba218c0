//! The controller computes where motions end; here every step is walked instead.

use std::sync::Arc;

use vimc4_device::{AXES, Event, Motion, Output, Point, Segment, Stamp, Time};
use vimc4_motion::Pull;
use vimc4_plant::{Axis, Machine};

/// What a walk knows.
pub(crate) struct Walk {
    pub(crate) machine: Arc<Machine>,
    pub(crate) counter: Point,
    mechanics: [Mechanics; AXES],
    running: Option<(Segment, Time)>,
    /// The changes of limit switches on the way.
    changes: Vec<Change>,
}

/// A change of a limit switch: when, the axis, whether it is the positive one and is active now.
type Change = (Time, u8, bool, bool);

/// An axis, step by step.
#[derive(Clone, Copy, Default)]
struct Mechanics {
    motor: i64,
    /// Where the nut is, which the motor takes with it at either end of its play.
    nut: i64,
    /// How far the carriage is behind the nut since it stood at an end.
    behind: i64,
    pressed: [bool; 2],
}

impl Mechanics {
    fn carriage(&self) -> i64 {
        self.nut - self.behind
    }

    fn step(&mut self, axis: &Axis, by: i64) {
        self.motor += by;
        let before = self.nut;
        // The play is above the nut at first, as the profile's places are given.
        self.nut = self.nut.min(self.motor).max(self.motor - i64::from(axis.backlash));
        let by = self.nut - before;
        let to = self.carriage();
        let beyond = axis.highest.is_some_and(|end| to > end && by > 0)
            || axis.lowest.is_some_and(|end| to < end && by < 0);
        self.behind += if beyond { by } else { 0 };
        for (end, switch) in [axis.negative_switch, axis.positive_switch].into_iter().enumerate() {
            let Some(at) = switch else { continue };
            let into = if end == 0 { at - self.carriage() } else { self.carriage() - at };
            if into >= 0 {
                self.pressed[end] = true;
            } else if into < -i64::from(axis.hysteresis) {
                self.pressed[end] = false;
            }
        }
    }
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
        let mechanics = [Mechanics::default(); AXES];
        let mut walk =
            Walk { machine, counter: zero, mechanics, running: None, changes: Vec::new() };
        let mut told: Vec<Change> = Vec::new();
        for output in outputs {
            let Output::Event(Stamp { at: when, .. }, event) = output else { continue };
            if let Event::Switch { axis, positive, active } = *event {
                told.push((*when, axis, positive, active));
            }
            let Event::Motion(motion) = event else { continue };
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
        assert_eq!(told, walk.changes, "limit switches");
        walk
    }

    fn sign(&self, axis: usize) -> i64 {
        if self.machine.axis(axis).inverted { -1 } else { 1 }
    }

    /// Where the carriages are.
    pub(crate) fn carriages(&self) -> Point {
        self.mechanics.map(|axis| axis.carriage())
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
        let stands: [Option<u64>; AXES] = std::array::from_fn(|axis| {
            let motor = self.machine.axis(axis).motor.as_ref()?;
            let pull = Pull { curve: &motor.pull, start: motor.start, load: motor.load };
            segment.exceeds(axis, 0, &pull)
        });
        for step in segment.steps() {
            let when = began.after_nanos(step.nanos);
            if walked == steps {
                assert!(on_switch || (cut_off && when > at), "a step at {when} is missing");
                break;
            }
            assert!(!on_switch, "step {walked} runs onto a switch, but the motion goes on");
            walked = step.number;
            let before = self.mechanics;
            let by: Point =
                std::array::from_fn(|axis| self.sign(axis) * (step.offset[axis] - offset[axis]));
            for (axis, mechanics) in self.mechanics.iter_mut().enumerate() {
                if stands[axis].is_some_and(|stands| step.number > stands) {
                    continue;
                }
                mechanics.step(self.machine.axis(axis), by[axis]);
            }
            offset = step.offset;
            let is_on = |axis: &Mechanics| axis.pressed != [false; 2];
            let mut axes = before.iter().zip(&self.mechanics);
            on_switch = axes.any(|(before, after)| is_on(after) && !is_on(before));
            for (axis, (before, after)) in before.iter().zip(&self.mechanics).enumerate() {
                for (end, active) in after.pressed.into_iter().enumerate() {
                    if active != before.pressed[end] {
                        self.changes.push((when, axis as u8, end == 1, active));
                    }
                }
            }
            last = when;
        }
        assert_eq!(walked, steps, "the segment has {total} steps");
        assert!(last <= at, "the last step was at {last}");
        self.counter = std::array::from_fn(|axis| self.counter[axis] + offset[axis]);
    }
}
