//! When step `k` happens.
//!
//! There are two kinds of profiles. In one the step frequency is what ramps are made of
//! ([`ramps`](crate::Ramp)): the motor is what counts. In the other it is the speed along the
//! real way ([`course`](crate::Stretch)): the tool is. Code that asks when a step happens need not
//! know which it is.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::Ramp;
use crate::course::{Course, CourseClock, Stretch};
use crate::phase::Phase;
use crate::ramps::{RampClock, Ramped};

/// The times of the steps of one motion, from its start to its halt.
///
/// Step `k` happens at the first nanosecond at which the integral of the step frequency has
/// reached `k`, or the integral of the speed has reached the place of the step.
///
/// Two profiles are equal if they were made by the same calls, which is more than that all
/// their times are equal.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Profile {
    kind: Kind,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Ramped(Ramped),
    Course(Course),
}

impl Profile {
    /// `steps` steps (up to 2⁴⁰) at `speed` Hz (1 to 1,000,000) with ramps. A value outside its
    /// range counts as the nearest within.
    ///
    /// Speeds up to the start-stop frequency run constantly. Above, the frequency rises from the
    /// start-stop frequency to the speed and falls again to it at the end; a short motion is a
    /// triangle.
    #[must_use]
    pub fn new(steps: u64, speed: u32, ramp: Ramp) -> Profile {
        Profile { kind: Kind::Ramped(Ramped { steps, speed, ramp, braked_at: None }) }
    }

    /// `steps` steps at exactly `speed` Hz from first to last, without ramps.
    #[must_use]
    pub fn constant(steps: u64, speed: u32) -> Profile {
        Profile::new(steps, speed, Ramp { start_stop: speed, acceleration: 1 })
    }

    /// The stretches one after the other, from standstill to standstill: with `acceleration`
    /// nm/s² (1 to 10¹⁵) up to `speed` nm/s (1 to 10¹⁰) along the way, and down again to end at
    /// its end; a short way is a triangle. A value outside its range counts as the nearest
    /// within.
    #[must_use]
    pub fn trapezoid(
        stretches: impl IntoIterator<Item = Stretch>,
        speed: u64,
        acceleration: u64,
    ) -> Profile {
        Profile { kind: Kind::Course(Course::trapezoid(stretches, speed, acceleration)) }
    }

    /// The stretches one after the other without a halt. The motion begins with the speed `from`,
    /// and changes with constant acceleration to that of `speeds` at the end of the same stretch,
    /// all in nm/s (0 to 10¹⁰). Where no speed is given the change goes on through the next
    /// stretch: they are one vector. Where [`brake`](Profile::brake) is asked for, the motion
    /// slows down by `braking` nm/s² (1 to 10¹⁵). A value outside its range counts as the nearest
    /// within.
    ///
    /// `None` if a vector begins and ends at speed 0, which does not move, if there are not as
    /// many speeds as stretches, or if the last is not given. A vector without steps is left out,
    /// with its speed.
    #[must_use]
    pub fn vectors(
        from: u64,
        stretches: &[Stretch],
        speeds: &[Option<u64>],
        braking: u64,
    ) -> Option<Profile> {
        let course = Course::vectors(from, stretches, speeds, braking)?;
        Some(Profile { kind: Kind::Course(course) })
    }

    /// How many steps are made until the motion has halted.
    #[must_use]
    pub fn steps(&self) -> u64 {
        match &self.kind {
            Kind::Ramped(ramped) => ramped.steps(),
            Kind::Course(course) => course.steps(),
        }
    }

    /// Nanoseconds from the start to the last step; 0 for no steps. Saturates at `u64::MAX`.
    #[must_use]
    pub fn duration(&self) -> u64 {
        self.time_of(u64::MAX)
    }

    /// How many steps have been made `nanos` nanoseconds after the start, that instant included.
    #[must_use]
    pub fn steps_at(&self, nanos: u64) -> u64 {
        match &self.kind {
            Kind::Ramped(ramped) => ramped.steps_at(nanos),
            Kind::Course(course) => course.steps_at(nanos),
        }
    }

    /// Nanoseconds from the start to step `k` (1 to `steps()`; beyond that, to the last); 0 for
    /// `k` = 0. Saturates at `u64::MAX`.
    #[must_use]
    pub fn time_of(&self, k: u64) -> u64 {
        match &self.kind {
            Kind::Ramped(ramped) => ramped.time_of(k),
            Kind::Course(course) => course.time_of(k),
        }
    }

    /// The step frequency in µHz `nanos` nanoseconds after the start, rounded down; 0 from the
    /// last step on.
    #[must_use]
    pub fn speed_at(&self, nanos: u64) -> u64 {
        match &self.kind {
            Kind::Ramped(ramped) => ramped.speed_at(nanos),
            Kind::Course(course) => course.speed_at(nanos),
        }
    }

    /// The step frequency in µHz that the speed at `nanos` nanoseconds after the start would be, if the clock
    /// steps of this range lay evenly along their way. Where they do not, as on an arc whose speed is that
    /// along the way, [`speed_at`](Profile::speed_at) goes up and down although nothing gets faster. 0 for no
    /// steps, and from the end of the motion on.
    #[must_use]
    pub fn even_speed_at(&self, nanos: u64, steps: Range<u64>) -> u64 {
        match &self.kind {
            Kind::Ramped(ramped) => ramped.speed_at(nanos),
            Kind::Course(course) => course.even_speed_at(nanos, steps),
        }
    }

    /// The same motion braked from `nanos` on: it halts on the last whole step within the way
    /// that braking takes, along the ramp from the present speed down to the start-stop
    /// frequency, or with the deceleration of the way down to standstill; without a speed to be
    /// rid of it halts where it is. The steps up to `nanos` keep their times.
    ///
    /// `None` if the motion ends by itself at least as early: no fewer steps remain than
    /// braking takes, so braking changes nothing. Likewise if it brakes already.
    #[must_use]
    pub fn brake(&self, nanos: u64) -> Option<Profile> {
        let kind = match &self.kind {
            Kind::Ramped(ramped) => Kind::Ramped(ramped.brake(nanos)?),
            Kind::Course(course) => Kind::Course(course.brake(nanos)?),
        };
        Some(Profile { kind })
    }

    /// The steps, in order, with which a part ends in which the step frequency only rises, only falls or
    /// stays: where ramps begin and end. The last is the last step.
    #[must_use]
    pub fn knees(&self) -> Vec<u64> {
        self.phases().into_iter().map(|phase| phase.to).collect()
    }

    /// The parts in which the step frequency only rises, only falls or stays, in order.
    pub(crate) fn phases(&self) -> Vec<Phase> {
        match &self.kind {
            Kind::Ramped(ramped) => ramped.phases(),
            Kind::Course(course) => course.phases(),
        }
    }

    /// The times of steps 1, 2, 3 … stepwise, straight from the definition.
    #[must_use]
    pub fn times(&self) -> ProfileTimes {
        let clock = match &self.kind {
            Kind::Ramped(ramped) => Clock::Ramps(ramped.clock()),
            Kind::Course(course) => Clock::Course(course.clock()),
        };
        ProfileTimes { clock, steps: self.steps(), made: 0, nanos: 0, gap: 1, change: 0 }
    }
}

/// Iterator over the times of a profile's steps. See [`Profile::times`].
///
/// From the time of one step it searches for the first nanosecond at which the motion has
/// reached the next. It knows how far the motion is at a time, but no formula for a time and no
/// square root.
#[derive(Clone, Debug)]
pub struct ProfileTimes {
    clock: Clock,
    /// The number of the last step.
    steps: u64,
    /// The number of the latest step.
    made: u64,
    /// Its time.
    nanos: u64,
    /// The time between the latest two steps.
    gap: u64,
    /// By how much that was longer than the one before.
    change: i64,
}

/// What tells whether a step has been made.
#[derive(Clone, Debug)]
enum Clock {
    Ramps(RampClock),
    Course(CourseClock),
}

impl Iterator for ProfileTimes {
    type Item = u64;

    #[inline]
    fn next(&mut self) -> Option<u64> {
        if self.made == self.steps {
            return None;
        }
        self.made += 1;
        let k = self.made;
        // The gap changes little from step to step, and its change still less.
        let guess = self.nanos.saturating_add(self.gap.saturating_add_signed(self.change));
        let nanos = match &self.clock {
            Clock::Ramps(clock) => first(self.nanos, guess, |nanos| clock.reached(k, nanos)),
            Clock::Course(clock) => {
                let place = clock.place(k);
                // Very short steps can fall in one nanosecond.
                if clock.reached(place, self.nanos) {
                    return Some(self.nanos);
                }
                first(self.nanos, guess, |nanos| clock.reached(place, nanos))
            }
        };
        let gap = (nanos - self.nanos).max(1);
        self.change = gap.wrapping_sub(self.gap).cast_signed();
        (self.gap, self.nanos) = (gap, nanos);
        Some(nanos)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.steps - self.made;
        usize::try_from(left).map_or((usize::MAX, None), |left| (left, Some(left)))
    }
}

/// The first nanosecond after `last` at which a step is reached. From a guess double the way back
/// or forth until the step is within, then halve the interval.
#[inline]
fn first(last: u64, guess: u64, reached: impl Fn(u64) -> bool) -> u64 {
    let (mut before, mut after, mut width) = (guess, guess, 1);
    if reached(guess) {
        loop {
            before = after.saturating_sub(width).max(last);
            if before == last || !reached(before) {
                break;
            }
            after = before;
            width = width.saturating_mul(2);
        }
    } else {
        loop {
            after = before.saturating_add(width);
            if after == u64::MAX || reached(after) {
                break;
            }
            before = after;
            width = width.saturating_mul(2);
        }
    }
    while after - before > 1 {
        let between = u64::midpoint(before, after);
        if reached(between) {
            after = between;
        } else {
            before = between;
        }
    }
    after
}
