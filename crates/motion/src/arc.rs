//! The circle engine: a difference register decides, step by step, which of two axes moves.
//!
//! # The definition
//!
//! With `x`, `y` the place relative to the centre, each step is ([`ArcState::step`])
//!
//! ```text
//! if D > 0:  x += Rx;  D -= |x|;  if x == 0: Ry = -Ry
//! else:      y += Ry;  D += |y|;  if y == 0: Rx = -Rx
//! ```
//!
//! # The closed form
//!
//! **Pieces.** Between two arrivals on an axis of coordinates neither direction changes. Call
//! such a stretch a piece and measure along the directions: `u = Rx·x`, `w = Ry·y`. A step
//! raises `u` or `w` by 1, and a coordinate is run towards its zero while it is negative. The
//! piece ends when a negative one becomes 0.
//!
//! **D is a function of the place.** Let `G(z)` be the sum with `G(0) = 0` and
//! `G(z) - G(z-1) = |z|`, that is `z(z+1)/2` from -1 upwards and `-z(z+1)/2` up to 0. Then
//! `D = C - G(u) + G(w)` throughout a piece, with `C` fixed by where it begins, whichever way
//! led to (u, w). D falls with `u` and rises with `w`.
//!
//! **The split.** After `n` steps of a piece `u + w = s` is known; what is to be found is `u`. It
//! is the least `u`, from where the piece began, with `D(u, w-1) ≤ 0`, and if there is none all
//! steps were made in `u`. For let U(n) be that least value. Since D falls with `u` and rises with
//! `w`, U(n-1) ≤ U(n) ≤ U(n-1) + 1. From the place with U(n-1) the engine steps in `w` if D ≤ 0
//! there, in which case U(n) = U(n-1), and in `u` otherwise, in which case U(n) = U(n-1) + 1: it
//! goes from U(n-1) to U(n). The condition reads `G(u) - G(w-1) ≥ C`; with `w = s - u` it is linear
//! in `u` when both coordinates have the same sign and quadratic, a circle cut by a line, when they
//! have not: one integer square root. Nothing was said about D at the beginning, so the long runs
//! in one direction at the beginning, for wild values of D, are no special case.
//!
//! **When a coordinate gets to a value.** It gets to `u` from `u-1` at the first `w` with
//! `D(u-1, w) > 0`, and to `w` from `w-1` at the first `u` with `D(u, w-1) ≤ 0`. Both are an
//! inverse of `G`, again a square root. The end of a piece is the case `u = 0` or `w = 0`. If
//! both coordinates run to zero, the first to arrive is `u` if `D(-1, -1) = C > 0`, else `w`.
//!
//! **Turns.** Once `-|x| < D ≤ |y|` holds it holds for ever: a step in x leaves `D - |x| > -|x|`
//! for the new x and D only falls, a step in y likewise. If it holds on an axis, at distance R
//! from the centre and running towards it, then by the previous paragraph the next arrival is at
//! distance R on the next axis, 2R steps later. In (0, R] D begins a quadrant from x = 0 and is
//! lowered by R in it, in (-R, 0] it begins one from y = 0 and is raised by R: after four
//! quadrants, 8R steps, all registers are as they were. Before that there are at most two pieces,
//! since a run in one direction that makes the condition true passes zero at most once. If both
//! coordinates run outwards there is no further piece at all.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::runs::Run;
use crate::{AXES, Point};

/// Every different place of an arc lies in its first pieces: two until it is on its circle, and
/// one turn.
const PIECES: usize = 6;

/// Largest magnitude of a coordinate and of the number of steps; squares fit 64 bits easily.
const LARGEST: i64 = 1 << 28;

/// Largest magnitude of the difference register.
const LARGEST_D: i64 = 1 << 56;

/// The registers of the circle engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ArcState {
    /// Position on the first axis relative to the centre, steps.
    pub x: i64,
    /// Position on the second axis relative to the centre, steps.
    pub y: i64,
    /// The difference register.
    pub d: i64,
    /// Direction of the first axis, +1 or -1.
    pub rx: i8,
    /// Direction of the second axis, +1 or -1.
    pub ry: i8,
}

impl ArcState {
    /// One step of the engine: its definition.
    pub fn step(&mut self) {
        if self.d > 0 {
            self.x += i64::from(self.rx);
            self.d -= self.x.abs();
            if self.x == 0 {
                self.ry = -self.ry;
            }
        } else {
            self.y += i64::from(self.ry);
            self.d += self.y.abs();
            if self.y == 0 {
                self.rx = -self.rx;
            }
        }
    }

    /// The steps of each axis in `n` steps. Within a piece both coordinates are monotone.
    fn travel(self, n: i64) -> (i64, i64) {
        let (mut state, mut left, mut sums) = (self, n, (0, 0));
        while left > 0 {
            let piece = Piece::from(state);
            let steps = piece.length().map_or(left, |length| length.min(left));
            let end = piece.after(steps);
            sums = (sums.0 + (end.x - state.x).abs(), sums.1 + (end.y - state.y).abs());
            (state, left) = (end, left - steps);
        }
        sums
    }

    /// The radius, if the state is on an axis of coordinates and its D is one of a circle.
    fn radius_on_axis(&self) -> Option<i64> {
        let settled = -self.x.abs() < self.d && self.d <= self.y.abs();
        (settled && (self.x == 0 || self.y == 0)).then(|| self.x.abs() + self.y.abs())
    }
}

/// `G` of the module documentation.
fn sum(z: i64) -> i64 {
    if z < 0 { -(z * (z + 1) / 2) } else { z * (z + 1) / 2 }
}

/// The least `z` with `sum(z) >= least`.
fn first_sum(least: i64) -> i64 {
    if least > 0 {
        // z(z+1) ≥ 2·least, that is (2z+1)² ≥ 8·least + 1.
        ceil_sqrt(8 * least + 1) / 2
    } else {
        // z = -p with the largest p that has p(p-1) ≤ -2·least, (2p-1)² ≤ 1 - 8·least.
        -i64::midpoint(floor_sqrt(1 - 8 * least), 1)
    }
}

/// The square root rounded down; `square` is not negative and less than 2⁶².
///
/// The floating-point root is rounded exactly on every platform, and is faster. It can be off by
/// one, because the square is rounded too.
fn floor_sqrt(square: i64) -> i64 {
    let root = (square as f64).sqrt() as i64;
    if root * root > square {
        root - 1
    } else {
        root + i64::from((root + 1) * (root + 1) <= square)
    }
}

/// The square root rounded up, likewise.
fn ceil_sqrt(square: i64) -> i64 {
    let root = floor_sqrt(square);
    root + i64::from(root * root < square)
}

/// The quotient rounded up; `divisor` is positive.
fn ceil_div(dividend: i64, divisor: i64) -> i64 {
    -(-dividend).div_euclid(divisor)
}

/// The way ahead of a state until a direction changes.
struct Piece {
    /// The registers at its beginning.
    start: ArcState,
    /// The coordinates at its beginning, measured along the directions.
    u: i64,
    w: i64,
    /// `D + G(u) - G(w)`, the same everywhere in the piece.
    c: i64,
}

impl Piece {
    fn from(start: ArcState) -> Piece {
        let (u, w) = (start.x * i64::from(start.rx), start.y * i64::from(start.ry));
        Piece { start, u, w, c: start.d + sum(u) - sum(w) }
    }

    /// The number of steps until the first coordinate is `u`, which lies ahead. Right if that is
    /// no more than the length of the piece; more than the length if it is not reached.
    fn until_u(&self, u: i64) -> i64 {
        let w = self.w.max(first_sum(sum(u - 1) - self.c + 1));
        (u - self.u) + (w - self.w)
    }

    /// The number of steps until the second coordinate is `w`, likewise.
    fn until_w(&self, w: i64) -> i64 {
        let u = self.u.max(first_sum(self.c + sum(w - 1)));
        (u - self.u) + (w - self.w)
    }

    /// The number of steps to the end of the piece, `None` if it has none.
    fn length(&self) -> Option<i64> {
        match (self.u < 0, self.w < 0) {
            (false, false) => None,
            (true, false) => Some(self.until_u(0)),
            (false, true) => Some(self.until_w(0)),
            (true, true) => Some(if self.c > 0 { self.until_u(0) } else { self.until_w(0) }),
        }
    }

    /// The registers after `n` steps, no more than the length of the piece.
    fn after(&self, n: i64) -> ArcState {
        if n == 0 {
            return self.start;
        }
        let (s, c) = (self.u + self.w + n, self.c);
        // The least u with G(u) - G(s-u-1) ≥ c, which is multiplied out for each pair of signs.
        let least = match (self.u < 0, self.w < 0) {
            (false, false) => ceil_div(2 * c + s * s - s, 2 * s),
            (true, true) => ceil_div(2 * c - s * s + s, -2 * s),
            (true, false) => match 1 - s * s - 4 * c {
                square @ 0.. => ceil_div(s - 1 - floor_sqrt(square), 2),
                _ => i64::MAX,
            },
            (false, true) => match 1 - s * s + 4 * c {
                square @ 0.. => ceil_div(s - 1 + ceil_sqrt(square), 2),
                _ => i64::MIN,
            },
        };
        let u = least.clamp(self.u, self.u + n);
        let w = s - u;
        let ArcState { rx, ry, .. } = self.start;
        ArcState {
            x: u * i64::from(rx),
            y: w * i64::from(ry),
            d: c - sum(u) + sum(w),
            rx: if self.w < 0 && w == 0 { -rx } else { rx },
            ry: if self.u < 0 && u == 0 { -ry } else { ry },
        }
    }
}

/// A circular arc of a number of single-axis steps.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Arc {
    /// Index of the first and of the second axis of the plane.
    plane: (u8, u8),
    /// Number of clock steps.
    steps: u64,
    /// The registers at the start.
    start: ArcState,
}

impl Arc {
    /// An arc of `steps` steps in the plane of axis `first` and axis `second` (less than [`AXES`],
    /// different) that begins with the registers `start`. Any register values are allowed, even
    /// ones that no circle has; `x`, `y` and `steps` are cut to a magnitude of 2²⁸, `d` to 2⁵⁶, and
    /// a direction is its sign, 0 counting as +1.
    #[must_use]
    pub fn new(first: usize, second: usize, steps: u64, start: ArcState) -> Arc {
        let direction = |r: i8| if r < 0 { -1 } else { 1 };
        Arc {
            plane: (axis_index(first), axis_index(second)),
            steps: steps.min(LARGEST as u64),
            start: ArcState {
                x: start.x.clamp(-LARGEST, LARGEST),
                y: start.y.clamp(-LARGEST, LARGEST),
                d: start.d.clamp(-LARGEST_D, LARGEST_D),
                rx: direction(start.rx),
                ry: direction(start.ry),
            },
        }
    }

    /// The registers after `k` steps, in closed form; `k` beyond the end is the end.
    #[must_use]
    pub fn state_at(&self, k: u64) -> ArcState {
        let mut piece = Piece::from(self.start);
        let mut left = k.min(self.steps) as i64;
        while let Some(length) = piece.length() {
            if let Some(radius) = piece.start.radius_on_axis() {
                left %= 8 * radius;
            }
            if left <= length {
                break;
            }
            left -= length;
            piece = Piece::from(piece.after(length));
        }
        piece.after(left)
    }

    /// The first pieces, each with the number of steps before it.
    fn pieces(&self) -> impl Iterator<Item = (i64, Piece)> {
        std::iter::successors(Some((0, Piece::from(self.start))), |(before, piece)| {
            let length = piece.length()?;
            Some((before + length, Piece::from(piece.after(length))))
        })
        .take(PIECES)
    }

    pub(crate) fn length(&self) -> u64 {
        self.steps
    }

    pub(crate) fn plane(&self) -> (usize, usize) {
        (usize::from(self.plane.0), usize::from(self.plane.1))
    }

    /// Up to the end of the first pieces.
    pub(crate) fn new_places(&self) -> u64 {
        let last = self.pieces().last().and_then(|(before, piece)| Some(before + piece.length()?));
        last.map_or(self.steps, |last| self.steps.min(last as u64))
    }

    /// Whether an axis is one of its plane.
    pub(crate) fn moves(&self, axis: usize) -> bool {
        let axis = axis_index(axis);
        axis == self.plane.0 || axis == self.plane.1
    }

    /// `x` and `y` as an offset from the start.
    fn offset(&self, x: i64, y: i64) -> Point {
        let mut point = [0; AXES];
        self.put(&mut point, x - self.start.x, y - self.start.y);
        point
    }

    /// Writes a value for each axis of the plane.
    fn put(&self, point: &mut Point, first: i64, second: i64) {
        for (axis, value) in [(self.plane.0, first), (self.plane.1, second)] {
            if let Some(slot) = point.get_mut(usize::from(axis)) {
                *slot = value;
            }
        }
    }

    pub(crate) fn at(&self, k: u64) -> Point {
        let state = self.state_at(k);
        self.offset(state.x, state.y)
    }

    /// Within a piece a coordinate passes each value at most once, and the pieces are few.
    pub(crate) fn first_at(&self, axis: usize, offset: i64) -> Option<u64> {
        if offset.abs_diff(0) > 2 * LARGEST as u64 {
            return None;
        }
        let axis = axis_index(axis);
        self.pieces()
            .filter_map(|(before, piece)| {
                let ArcState { rx, ry, .. } = piece.start;
                let n = if axis == self.plane.0 {
                    let u = (self.start.x + offset) * i64::from(rx);
                    (u > piece.u).then(|| piece.until_u(u))
                } else if axis == self.plane.1 {
                    let w = (self.start.y + offset) * i64::from(ry);
                    (w > piece.w).then(|| piece.until_w(w))
                } else {
                    None
                }?;
                piece.length().is_none_or(|length| n <= length).then_some((before + n) as u64)
            })
            .find(|&k| k <= self.steps)
    }

    /// Within a piece both coordinates are monotone: its ends are its extent.
    pub(crate) fn extent(&self, k: u64) -> (Point, Point) {
        let last = self.state_at(k);
        let (mut low, mut high) = ((last.x, last.y), (last.x, last.y));
        for (_, Piece { start, .. }) in self.pieces().take_while(|(before, _)| *before as u64 <= k)
        {
            low = (low.0.min(start.x), low.1.min(start.y));
            high = (high.0.max(start.x), high.1.max(start.y));
        }
        (self.offset(low.0, low.1), self.offset(high.0, high.1))
    }

    /// The steps of each axis. A whole turn is like any other.
    pub(crate) fn travel(&self, k: u64) -> Point {
        let mut piece = Piece::from(self.start);
        let mut left = k.min(self.steps) as i64;
        let mut sums = (0, 0);
        while let Some(length) = piece.length().filter(|length| *length < left) {
            if let Some(radius) = piece.start.radius_on_axis()
                && left >= 8 * radius
            {
                let turn = piece.start.travel(8 * radius);
                let turns = left / (8 * radius);
                sums = (sums.0 + turns * turn.0, sums.1 + turns * turn.1);
                left %= 8 * radius;
                continue;
            }
            let way = piece.start.travel(length);
            sums = (sums.0 + way.0, sums.1 + way.1);
            left -= length;
            piece = Piece::from(piece.after(length));
        }
        let way = piece.start.travel(left);
        let mut travel = [0; AXES];
        self.put(&mut travel, sums.0 + way.0, sums.1 + way.1);
        travel
    }

    /// See [`Path::runs`](crate::Path::runs). Within a piece both coordinates are monotone.
    pub(crate) fn runs<S: Clone + PartialEq, B>(
        &self,
        axis: usize,
        k: u64,
        state: &mut S,
        visit: &mut impl FnMut(&mut S, Run) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let axis = axis_index(axis);
        let coordinate = |at: &ArcState| match axis {
            _ if axis == self.plane.0 => at.x,
            _ if axis == self.plane.1 => at.y,
            _ => 0,
        };
        let mut piece = Piece::from(self.start);
        let (mut made, mut left) = (0, k.min(self.steps) as i64);
        // The state with which the turn has begun, and how many of its quadrants are behind us.
        let mut turn: Option<(S, u8)> = None;
        while left > 0 {
            if let Some(radius) = piece.start.radius_on_axis() {
                turn = match turn.take() {
                    Some((begun, 4)) => {
                        if begun == *state {
                            let turns = left / (8 * radius) * 8 * radius;
                            (made, left) = (made + turns as u64, left - turns);
                        }
                        Some((state.clone(), 1))
                    }
                    Some((begun, quadrants)) => Some((begun, quadrants + 1)),
                    None => Some((state.clone(), 1)),
                };
            }
            let steps = piece.length().map_or(left, |length| length.min(left));
            let end = piece.after(steps);
            let to = made + steps as u64;
            let way = coordinate(&end) - coordinate(&piece.start);
            visit(state, Run { from: made, to, way })?;
            (made, left) = (to, left - steps);
            piece = Piece::from(end);
        }
        ControlFlow::Continue(())
    }

    pub(crate) fn after(&self, k: u64) -> Arc {
        Arc { plane: self.plane, steps: self.steps - k, start: self.state_at(k) }
    }

    pub(crate) fn walk(&self) -> ArcWalk {
        ArcWalk { arc: self.clone(), state: self.start }
    }
}

/// An axis as it is stored; what is not an axis becomes a number that no point has a place for.
pub(crate) fn axis_index(axis: usize) -> u8 {
    u8::try_from(axis).unwrap_or(u8::MAX)
}

/// An arc as a step interrupt makes it.
#[derive(Clone, Debug)]
pub(crate) struct ArcWalk {
    arc: Arc,
    state: ArcState,
}

impl ArcWalk {
    pub(crate) fn tick(&mut self, point: &mut Point) {
        self.state.step();
        let ArcState { x, y, .. } = self.state;
        self.arc.put(point, x - self.arc.start.x, y - self.arc.start.y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_exact() {
        let near = |root: i64| [root * root - 1, root * root, root * root + 1];
        let bits = (1..31).flat_map(|bit| [(1 << bit) - 1, 1 << bit, (1 << bit) + 1]);
        let odd = [94_906_265, 94_906_267, 1_518_500_249, (1 << 31) - 1];
        for square in bits.chain(odd).flat_map(near) {
            assert_eq!(floor_sqrt(square), square.isqrt(), "{square}");
            assert_eq!(
                ceil_sqrt(square),
                square.isqrt() + i64::from(square.isqrt().pow(2) < square)
            );
        }
        assert_eq!((floor_sqrt(0), ceil_sqrt(0), floor_sqrt(3), ceil_sqrt(3)), (0, 0, 1, 2));
    }
}
