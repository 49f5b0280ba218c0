//! Step pulses of a running motion.

use vimc4_device::{AXES, Point, Segment, Time};
use vimc4_motion::{SegmentSteps, Step};

use crate::pens::Pens;
use crate::scene::{AxisPlaces, Value};

/// How long a step pulse is high, in nanoseconds; half the time to the next step where that is less.
pub(crate) const PULSE: u64 = 1_000;

/// The pulses of all axes.
#[derive(Debug)]
pub(crate) struct Pulses {
    moving: Option<Moving>,
    /// When the pulses that are high end; [`Time::NEVER`] if none is.
    fall: Time,
    /// The axes whose pulse is high, a bit for each place in the list of axes.
    high: u32,
    /// The counters as they are drawn.
    counters: Point,
    /// The levels of the direction lines: whether the counter of the axis went up last.
    up: [bool; AXES],
}

#[derive(Debug)]
struct Moving {
    began: Time,
    origin: Point,
    segment: Box<Segment>,
    steps: SegmentSteps,
    /// The step that comes next.
    next: Option<Step>,
    made: u64,
}

impl Default for Pulses {
    fn default() -> Pulses {
        let (counters, up) = ([0; AXES], [true; AXES]);
        Pulses { moving: None, fall: Time::NEVER, high: 0, counters, up }
    }
}

impl Moving {
    /// When the next step is due.
    fn due(&self) -> Time {
        self.next.map_or(Time::NEVER, |step| self.began.after_nanos(step.nanos))
    }

    /// Looks at the steps from the one after those made on.
    fn look(&mut self, made: u64) {
        self.steps = self.segment.steps();
        self.made = made;
        let past = usize::try_from(made).unwrap_or(usize::MAX);
        self.next = self.steps.nth(past);
    }
}

impl Pulses {
    pub(crate) fn counters(&self) -> &Point {
        &self.counters
    }

    pub(crate) fn is_moving(&self) -> bool {
        self.moving.is_some()
    }

    /// The counters are there without having moved.
    pub(crate) fn put(&mut self, counters: Point) {
        self.counters = counters;
    }

    /// A motion that began then and there has made so many steps.
    pub(crate) fn begin(&mut self, began: Time, origin: Point, segment: Box<Segment>, made: u64) {
        self.counters = added(&origin, &segment.path.at(made));
        let steps = segment.steps();
        let mut moving = Moving { began, origin, segment, steps, next: None, made };
        moving.look(made);
        self.moving = Some(moving);
    }

    /// The motion goes on with other times.
    pub(crate) fn change(&mut self, segment: Box<Segment>) {
        if let Some(moving) = &mut self.moving {
            moving.segment = segment;
            moving.look(moving.made);
        }
    }

    /// The motion ends then, after so many steps. Says when it had begun, and along what.
    pub(crate) fn end(
        &mut self,
        at: Time,
        steps: u64,
        axes: &[AxisPlaces],
        pens: &mut Pens,
    ) -> Option<(Time, Box<Segment>)> {
        self.run(at.after_nanos(1), steps, axes, pens);
        self.moving.take().map(|moving| (moving.began, moving.segment))
    }

    /// The motion is gone, whatever was left of it.
    pub(crate) fn forget(&mut self) {
        self.moving = None;
    }

    /// When something happens next.
    pub(crate) fn due(&self) -> Time {
        self.moving.as_ref().map_or(Time::NEVER, Moving::due).min(self.fall)
    }

    /// Ends the pulses that are high.
    fn drop_pulses(&mut self, axes: &[AxisPlaces], pens: &mut Pens) {
        for (place, axis) in axes.iter().enumerate() {
            if self.high >> place & 1 == 1 {
                pens.set(self.fall, axis.step, Value::Bit(false));
            }
        }
        (self.fall, self.high) = (Time::NEVER, 0);
    }

    /// Draws everything before a time, up to so many steps of the motion.
    pub(crate) fn run(&mut self, before: Time, most: u64, axes: &[AxisPlaces], pens: &mut Pens) {
        loop {
            let due = match &self.moving {
                Some(moving) if moving.made < most => moving.due(),
                _ => Time::NEVER,
            };
            if self.fall <= due {
                if self.fall >= before {
                    return;
                }
                self.drop_pulses(axes, pens);
                continue;
            }
            let Some(moving) = self.moving.as_mut().filter(|_| due < before) else { return };
            let Some(step) = moving.next else { return };
            moving.made += 1;
            moving.next = moving.steps.next();
            let now = added(&moving.origin, &step.offset);
            for (place, axis) in axes.iter().enumerate() {
                let (Some(before), Some(now)) =
                    (self.counters.get_mut(axis.axis), now.get(axis.axis))
                else {
                    continue;
                };
                if before == now {
                    continue;
                }
                let goes_up = now > before;
                if let Some(up) = self.up.get_mut(axis.axis).filter(|up| **up != goes_up) {
                    *up = goes_up;
                    pens.set(due, axis.direction, Value::Bit(goes_up));
                }
                *before = *now;
                self.high |= 1 << place;
                pens.set(due, axis.step, Value::Bit(true));
                pens.set(due, axis.position, Value::Number(*now));
            }
            let gap = moving.due().nanos_since(due);
            self.fall = due.after_nanos(PULSE.min(gap / 2));
        }
    }
}

fn added(origin: &Point, offset: &Point) -> Point {
    std::array::from_fn(|axis| origin[axis] + offset[axis])
}
