//! Straight lines: the longest axis makes a step with every clock step, the others follow.

use serde::{Deserialize, Serialize};

use crate::bresenham::{Spread, clock_of, made};
use crate::{AXES, Point};

/// The longest way of one axis, steps.
const LONGEST: i64 = 1 << 40;

/// A straight line, possibly what is left of one.
///
/// At clock step `k` of `n` of the longest axis, an axis with `m` steps has made
/// `floor((2·k·m + n) / (2·n))` steps (Bresenham, rounding to nearest).
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct StraightLine {
    /// The whole line, signed steps per axis.
    delta: Point,
    /// How many clock steps of the whole line were already made before this path begins.
    done: u64,
}

impl StraightLine {
    /// The line from the origin to `delta`. Magnitudes up to 2⁴⁰ are allowed; a line that long
    /// stands for "on and on" (a reference run whose switch is not connected). Larger ones are
    /// cut to it.
    #[must_use]
    pub fn new(delta: Point) -> StraightLine {
        StraightLine { delta: delta.map(|steps| steps.clamp(-LONGEST, LONGEST)), done: 0 }
    }

    /// Clock steps of the whole line: the way of its longest axis.
    fn whole(&self) -> u64 {
        self.delta.iter().fold(0, |longest, steps| longest.max(steps.unsigned_abs()))
    }

    /// The offset from the start of the whole line after `k` of its clock steps.
    fn whole_at(&self, k: u64) -> Point {
        let n = self.whole();
        self.delta.map(|steps| steps.signum() * made(k, steps.unsigned_abs(), n) as i64)
    }

    pub(crate) fn length(&self) -> u64 {
        self.whole() - self.done
    }

    pub(crate) fn at(&self, k: u64) -> Point {
        let (there, here) = (self.whole_at(self.done + k), self.whole_at(self.done));
        std::array::from_fn(|axis| there[axis] - here[axis])
    }

    pub(crate) fn first_at(&self, axis: usize, offset: i64) -> Option<u64> {
        let way = *self.delta.get(axis)?;
        if offset.signum() != way.signum() {
            return None;
        }
        let (m, n) = (way.unsigned_abs(), self.whole());
        let j = made(self.done, m, n) + offset.unsigned_abs();
        (j <= m).then(|| clock_of(j, m, n) - self.done)
    }

    /// Every axis runs in one direction only, so the ends are the extent.
    pub(crate) fn extent(&self, k: u64) -> (Point, Point) {
        let there = self.at(k);
        (there.map(|steps| steps.min(0)), there.map(|steps| steps.max(0)))
    }

    /// How many of the clock steps an axis makes, out of how many.
    pub(crate) fn share(&self, axis: usize) -> (u64, u64) {
        (self.delta.get(axis).map_or(0, |way| way.unsigned_abs()), self.whole())
    }

    /// The whole line goes on: its rounding must not begin anew.
    pub(crate) fn after(&self, k: u64) -> StraightLine {
        StraightLine { delta: self.delta, done: self.done + k }
    }

    pub(crate) fn walk(&self) -> LineWalk {
        let n = self.whole();
        LineWalk {
            spreads: self.delta.map(|steps| Spread::new(self.done, steps.unsigned_abs(), n)),
            directions: self.delta.map(i64::signum),
        }
    }
}

/// A line as a step interrupt makes it: one accumulator an axis.
#[derive(Clone, Debug)]
pub(crate) struct LineWalk {
    spreads: [Spread; AXES],
    directions: Point,
}

impl LineWalk {
    /// From the point before to the point after it, by value: reading a whole point from where
    /// its parts have just been written would make the processor wait for each step.
    #[inline]
    pub(crate) fn tick(&mut self, [x, y, z, a, b, c]: Point) -> Point {
        let [sx, sy, sz, sa, sb, sc] = &mut self.spreads;
        let [dx, dy, dz, da, db, dc] = self.directions;
        [
            x + (dx & sx.tick()),
            y + (dy & sy.tick()),
            z + (dz & sz.tick()),
            a + (da & sa.tick()),
            b + (db & sb.tick()),
            c + (dc & sc.tick()),
        ]
    }
}
