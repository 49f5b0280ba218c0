//! An arc with a third axis that follows.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::arc::{ArcWalk, axis_index};
use crate::bresenham::{Spread, clock_of, made};
use crate::runs::Run;
use crate::{Arc, ArcState, Point};

/// The longest way of the third axis, steps.
const LONGEST: i64 = 1 << 40;

/// An arc of B steps with |S3| steps of a third axis spread over it, or, where |S3| is larger,
/// a line of |S3| steps over which the arc is spread; by the same Bresenham as a line.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Helix {
    /// The whole arc.
    arc: Arc,
    /// Index of the third axis.
    axis: u8,
    /// The whole way of the third axis, signed.
    steps: i64,
    /// How many clock steps of the whole helix were already made before this path begins.
    done: u64,
}

impl Helix {
    /// `arc` with `steps` (signed, magnitudes up to 2⁴⁰, larger ones are cut to it) steps of
    /// `axis` (less than [`AXES`](crate::AXES), not one of the arc's) spread over it.
    #[must_use]
    pub fn new(arc: Arc, axis: usize, steps: i64) -> Helix {
        Helix { arc, axis: axis_index(axis), steps: steps.clamp(-LONGEST, LONGEST), done: 0 }
    }

    /// Clock steps of the whole helix: the longer of the two ways.
    fn whole(&self) -> u64 {
        self.arc.length().max(self.steps.unsigned_abs())
    }

    /// How many steps of the arc are made after `k` clock steps of the whole helix.
    fn arc_made(&self, k: u64) -> u64 {
        made(k, self.arc.length(), self.whole())
    }

    /// How many steps, signed, the third axis has made after `k` clock steps of the whole helix.
    fn third_made(&self, k: u64) -> i64 {
        self.steps.signum() * made(k, self.steps.unsigned_abs(), self.whole()) as i64
    }

    /// See [`Path::circle_at`](crate::Path::circle_at).
    pub(crate) fn circle_at(&self, k: u64) -> ((usize, usize), ArcState) {
        (self.arc.plane(), self.arc.state_at(self.arc_made(self.done + k)))
    }

    /// What is left of the arc.
    fn arc_left(&self) -> Arc {
        self.arc.after(self.arc_made(self.done))
    }

    /// `point` with the third axis set.
    fn with_third(&self, mut point: Point, value: i64) -> Point {
        if let Some(slot) = point.get_mut(usize::from(self.axis)) {
            *slot = value;
        }
        point
    }

    pub(crate) fn length(&self) -> u64 {
        self.whole() - self.done
    }

    pub(crate) fn at(&self, k: u64) -> Point {
        let there = self.done + k;
        let arc = self.arc_left().at(self.arc_made(there) - self.arc_made(self.done));
        self.with_third(arc, self.third_made(there) - self.third_made(self.done))
    }

    pub(crate) fn first_at(&self, axis: usize, offset: i64) -> Option<u64> {
        let n = self.whole();
        let (j, m) = if axis_index(axis) == self.axis {
            if offset.signum() != self.steps.signum() {
                return None;
            }
            let reached = self.third_made(self.done) + offset;
            (reached.unsigned_abs(), self.steps.unsigned_abs())
        } else {
            let k = self.arc_left().first_at(axis, offset)?;
            (self.arc_made(self.done) + k, self.arc.length())
        };
        (j <= m).then(|| clock_of(j, m, n) - self.done)
    }

    pub(crate) fn extent(&self, k: u64) -> (Point, Point) {
        let there = self.done + k;
        let (low, high) = self.arc_left().extent(self.arc_made(there) - self.arc_made(self.done));
        let third = self.third_made(there) - self.third_made(self.done);
        (self.with_third(low, third.min(0)), self.with_third(high, third.max(0)))
    }

    /// How many of the clock steps an axis makes at the most, out of how many.
    pub(crate) fn share(&self, axis: usize) -> (u64, u64) {
        let steps = match axis_index(axis) == self.axis {
            true => self.steps.unsigned_abs(),
            false if self.arc.moves(axis) => self.arc.length(),
            false => 0,
        };
        (steps, self.whole())
    }

    /// See [`Path::runs`](crate::Path::runs). The circle is gone at another pace, but the same way.
    pub(crate) fn runs<S: Clone + PartialEq, B>(
        &self,
        axis: usize,
        k: u64,
        state: &mut S,
        visit: &mut impl FnMut(&mut S, Run) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        if axis_index(axis) == self.axis {
            let way = self.third_made(self.done + k) - self.third_made(self.done);
            return visit(state, Run { from: 0, to: k, way });
        }
        let (before, n) = (self.arc_made(self.done), self.whole());
        let made = self.arc_made(self.done + k) - before;
        if made == 0 {
            return visit(state, Run { from: 0, to: k, way: 0 });
        }
        let clock = |j: u64| match j {
            0 => 0,
            j if j == made => k,
            j => clock_of(before + j, self.arc.length(), n) - self.done,
        };
        self.arc_left().runs(axis, made, state, &mut |state, Run { from, to, way }| {
            visit(state, Run { from: clock(from), to: clock(to), way })
        })
    }

    pub(crate) fn travel(&self, k: u64) -> Point {
        let there = self.done + k;
        let arc = self.arc_left().travel(self.arc_made(there) - self.arc_made(self.done));
        self.with_third(arc, (self.third_made(there) - self.third_made(self.done)).abs())
    }

    /// The whole helix goes on: its rounding must not begin anew.
    pub(crate) fn after(&self, k: u64) -> Helix {
        Helix { done: self.done + k, ..self.clone() }
    }

    pub(crate) fn walk(&self) -> HelixWalk {
        let n = self.whole();
        HelixWalk {
            arc: self.arc_left().walk(),
            arc_spread: Spread::new(self.done, self.arc.length(), n),
            axis: usize::from(self.axis),
            direction: self.steps.signum(),
            spread: Spread::new(self.done, self.steps.unsigned_abs(), n),
        }
    }
}

/// A helix as a step interrupt makes it.
#[derive(Clone, Debug)]
pub(crate) struct HelixWalk {
    arc: ArcWalk,
    arc_spread: Spread,
    axis: usize,
    direction: i64,
    spread: Spread,
}

impl HelixWalk {
    pub(crate) fn tick(&mut self, point: &mut Point) {
        if self.arc_spread.tick() != 0 {
            self.arc.tick(point);
        }
        if let Some(slot) = point.get_mut(self.axis) {
            *slot += self.direction & self.spread.tick();
        }
    }
}
