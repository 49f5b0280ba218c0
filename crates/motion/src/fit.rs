//! Registers for a circle: what a host must compute before the circle engine can run.
//!
//! The engine (see [`ArcState`]) is given a place, two directions and a difference register, and
//! goes on for a number of steps. This module finds them for a circle about the origin, from
//! integers only. Where a start or an end is an angle, round it to steps first.
//!
//! # The directions
//!
//! In every quadrant one coordinate runs towards its zero and the other away from it. A place on
//! an axis of coordinates belongs to the quadrant that comes next in the sense of rotation.
//!
//! # The difference register
//!
//! With `E = x² + y² - R²`, how far the place is outside the circle,
//!
//! ```text
//! 2·D =  E - |x| + |y|    while x runs towards zero
//! 2·D = -E - |x| + |y|    while y runs towards zero
//! ```
//!
//! The formulas of the manual of 1999 (appendix A), one for each sense of rotation and with a sum
//! for each coordinate, are these. D > 0 makes a step in x, so in the first case the engine comes
//! back to a circle that it is outside of, in the second it leaves one that it is inside of. Only
//! R² is needed, which may be an integer where R is none.
//!
//! A half is rounded away from zero, as the manual does. The engine keeps `-|x| < D ≤ |y|` for
//! ever once it holds, and it does for a place whose coordinates were rounded to the nearest step,
//! but for a hair: where rounding would leave that range, D is its nearest end.
//!
//! Where the engine crosses an axis of coordinates `E` changes its sign, for x no longer runs
//! towards zero or y begins to. The circle is thus as wide in the next quadrant as it was narrow
//! in this one, by how much the crossing is not at R. With R in whole steps it is at R, and the
//! engine is never as far as a step beside the circle; otherwise it can be nearly two.
//!
//! # The number of steps
//!
//! The engine crosses the axes of coordinates at one distance from the centre, its radius r, and a
//! quadrant takes 2·r steps: as many as the coordinates change together. So the *progress* of a
//! place in its quadrant is `r - |inward| + |outward|`, and the difference of two progresses is the
//! number of steps from one to the other. A wanted end is seldom a place the engine comes to; the
//! one nearest to it is a few steps before or after that number.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::{Arc, ArcState, Path};

/// Largest magnitude of a coordinate: twice what a 24-bit counter holds.
const LARGEST: i64 = 1 << 24;

/// More steps than any turn takes.
const A_TURN: u64 = 1 << 28;

/// The engine's places are within two steps of the circle, and a rounded end is within one, so the
/// nearest place is no further along the circle than this.
const NEAR: i64 = 8;

/// The sense of rotation, seen with the first axis of the plane to the right and the second up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Turn {
    /// From the first axis to the negative end of the second.
    Clockwise,
    /// From the first axis to the second.
    Counterclockwise,
}

impl Turn {
    /// +1 counterclockwise, -1 clockwise.
    #[must_use]
    pub const fn sign(self) -> i64 {
        match self {
            Turn::Clockwise => -1,
            Turn::Counterclockwise => 1,
        }
    }

    /// The directions in which a circle goes on from a place, +1 or -1 for each axis; `None` from
    /// its centre. They depend on the quadrant only: the signs of the coordinates do for the place.
    #[must_use]
    pub const fn directions(self, x: i64, y: i64) -> Option<(i8, i8)> {
        let (turn, sx, sy) = (self.sign() as i8, x.signum() as i8, y.signum() as i8);
        match (sx, sy) {
            (0, 0) => None,
            // On an axis one coordinate leaves zero, across the circle, and the other comes in.
            (_, 0) => Some((-sx, sx * turn)),
            (0, _) => Some((-sy * turn, -sy)),
            _ => Some((-sy * turn, sx * turn)),
        }
    }
}

/// A circle about the origin, begun at a place on it, as the circle engine traces it.
///
/// ```
/// use vimc4_motion::{CircleFit, Turn};
///
/// // A quarter of the circle of radius 200, from 135 to 225 degrees.
/// let fit = CircleFit::new(-141, 141, 200 * 200, Turn::Counterclockwise).expect("on the circle");
/// let start = fit.start();
/// assert_eq!((start.d, start.rx, start.ry), (119, -1, -1));
/// assert_eq!(fit.steps_to((-141, -141), 0), 400);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CircleFit {
    start: ArcState,
    turn: Turn,
    /// Where the engine crosses the axes of coordinates.
    radius: i64,
}

impl CircleFit {
    /// The circle of the squared radius `square`, begun at (`x`, `y`).
    ///
    /// `None` if the place is not on the circle, that is, not one that rounding the coordinates of
    /// a point of the circle gives; if it is the centre; and beyond a magnitude of 2²⁴ steps.
    #[must_use]
    pub fn new(x: i64, y: i64, square: i64, turn: Turn) -> Option<CircleFit> {
        let possible = -LARGEST..=LARGEST;
        if !possible.contains(&x) || !possible.contains(&y) || !(0..1 << 49).contains(&square) {
            return None;
        }
        let outside = x * x + y * y - square;
        if outside.abs() > x.abs() + y.abs() + 1 {
            return None;
        }
        let (rx, ry) = turn.directions(x, y)?;
        let twice = if x * i64::from(rx) < 0 { outside } else { -outside } - x.abs() + y.abs();
        let rounded = (twice + twice.signum()) / 2;
        let d = rounded.clamp(1 - x.abs(), y.abs());
        let start = ArcState { x, y, d, rx, ry };
        let (_, high) = Path::Arc(Arc::new(0, 1, A_TURN, start)).extent(A_TURN);
        Some(CircleFit { start, turn, radius: x + high[0] })
    }

    /// The registers to begin with.
    #[must_use]
    pub fn start(&self) -> ArcState {
        self.start
    }

    /// How many steps a whole turn takes; after it all registers are as they were.
    #[must_use]
    pub fn steps_per_turn(&self) -> u64 {
        8 * self.radius as u64
    }

    /// The number of steps after which the engine is nearest to `end`, the least if there are
    /// several: `turns` whole turns, and on to `end` in less than another.
    ///
    /// An end in the direction of the start is no step away. So the whole circle is one turn and
    /// an end at the start.
    #[must_use]
    pub fn steps_to(&self, end: (i64, i64), turns: u32) -> u64 {
        let (x, y) = (i128::from(end.0), i128::from(end.1));
        let square_distance = |steps: &u64| {
            let place = self.after(*steps);
            (i128::from(place.x) - x).pow(2) + (i128::from(place.y) - y).pow(2)
        };
        self.steps_near(end, turns).min_by_key(square_distance).unwrap_or(0)
    }

    /// The registers after a number of steps.
    #[must_use]
    pub fn after(&self, steps: u64) -> ArcState {
        Arc::new(0, 1, A_TURN, self.start).state_at(steps % self.steps_per_turn())
    }

    /// The numbers of steps among which that of [`steps_to`](CircleFit::steps_to) is. For an end
    /// on the circle they are few, never more than half a turn, and an end that is known better
    /// than to a whole step can be compared with the places they lead to.
    #[must_use]
    pub fn steps_near(&self, end: (i64, i64), turns: u32) -> RangeInclusive<u64> {
        let (x, y) = (end.0.clamp(-LARGEST, LARGEST), end.1.clamp(-LARGEST, LARGEST));
        let distance = (x * x + y * y).isqrt().max(1);
        let beside = (distance - self.radius).abs();
        let on_circle = (x * self.radius / distance, y * self.radius / distance);
        let start = (self.start.x, self.start.y);
        let whole = 8 * self.radius;
        let mut ahead = (self.progress(on_circle) - self.progress(start)).rem_euclid(whole);
        // Rounding can make an end next to the start seem to lie on its other side.
        let along = start.0 * x + start.1 * y;
        let across = (start.0 * y - start.1 * x) * self.turn.sign();
        if along > 0 && across >= 0 && ahead > whole / 2 {
            ahead -= whole;
        } else if along > 0 && across < 0 && ahead < whole / 2 {
            ahead += whole;
        }
        let near = (NEAR + 2 * beside).min(2 * self.radius);
        let steps = ahead + i64::from(turns) * whole;
        (steps - near).max(0) as u64..=(steps + near).max(0) as u64
    }

    /// How many steps lead to a place from where its turn begins, on the positive first axis.
    fn progress(&self, (x, y): (i64, i64)) -> i64 {
        let y = y * self.turn.sign();
        let (quadrant, inward, outward) = match (x, y) {
            (1.., 0..) => (0, x, y),
            (..=0, 1..) => (1, y, -x),
            (..=-1, ..=0) => (2, -x, -y),
            _ => (3, -y, x),
        };
        2 * self.radius * quadrant + self.radius - inward + outward
    }
}
