//! Arcs as a job file means them.

use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};

use vimc4_isel_wire::Plane;
use vimc4_motion::Turn;

use super::Scale;
use crate::language::Value;

/// How many steps the radii of start and end may differ by.
const MOST_APART: f64 = 2.0;

/// How many steps the radius is at least.
const LEAST_RADIUS: f64 = 0.5;

/// An arc in a plane, of less than a turn or a whole one. Lengths are in thousandths of a µm.
///
/// It begins at the given start and has the same distance from the centre everywhere. Where the
/// given end is, by rounding, nearer to the centre or further from it, the arc ends in its
/// direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    plane: Plane,
    turn: Turn,
    centre: [Value; 2],
    start: [Value; 2],
    end: [Value; 2],
    radius: f64,
    end_radius: f64,
    sweep: f64,
    /// A step of the finer axis.
    step: f64,
}

/// Why there is no such arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoCircle {
    /// Start and centre are the same to half a step.
    #[error("the arc begins at its centre")]
    NoRadius,
    /// The distances of start and end from the centre are more than two steps apart.
    #[error("the start is {start} from the centre, but the end is {end} from it")]
    Apart {
        /// The radius of the start.
        start: Value,
        /// The radius of the end.
        end: Value,
    },
}

/// A way in the plane, exactly.
type Vector = [i128; 2];

/// The way from one point to another.
fn between(from: [Value; 2], to: [Value; 2]) -> Vector {
    let way = |axis: usize| {
        let way = to[axis].in_thousandths().saturating_sub(from[axis].in_thousandths());
        // Limited so that the sum of two products fits.
        i128::from(way.max(-i64::MAX))
    };
    [way(0), way(1)]
}

/// Positive if `b` is to the left of `a`.
fn cross(a: Vector, b: Vector) -> i128 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: Vector, b: Vector) -> i128 {
    a[0] * b[0] + a[1] * b[1]
}

fn length(a: Vector) -> f64 {
    libm::sqrt(dot(a, a) as f64)
}

impl Circle {
    /// The arc from `start` around `centre` to `end`, or the whole circle if there is no end or
    /// it is the start. An end in exactly the direction of the start is reached after a turn.
    /// `unit` is what the coordinates are rounded to, 0 if that is less than a step.
    ///
    /// # Errors
    ///
    /// If start and end are not on one circle to two steps of the finer axis, or to two units if
    /// these are more; or if that circle has a radius of less than half a step.
    pub fn new(
        unit: Value,
        plane: Plane,
        turn: Turn,
        centre: [Value; 2],
        start: [Value; 2],
        end: Option<[Value; 2]>,
        scales: [Scale; 2],
    ) -> Result<Circle, NoCircle> {
        let step = scales[0].step().min(scales[1].step());
        let end = end.unwrap_or(start);
        let (from, to) = (between(centre, start), between(centre, end));
        let (radius, end_radius) = (length(from), length(to));
        if radius < LEAST_RADIUS * step {
            return Err(NoCircle::NoRadius);
        }
        let room = step.max(unit.in_thousandths() as f64);
        if (radius - end_radius).abs() > MOST_APART * room {
            let value = |length: f64| Value::thousandths(libm::round(length) as i64);
            return Err(NoCircle::Apart { start: value(radius), end: value(end_radius) });
        }
        let sweep = sweep(turn, from, to);
        Ok(Circle { plane, turn, centre, start, end, radius, end_radius, sweep, step })
    }

    /// The whole circle, from the same start.
    #[must_use]
    pub fn whole(&self) -> Circle {
        Circle { end: self.start, end_radius: self.radius, sweep: TAU, ..*self }
    }

    /// Whether it is almost a turn, because its end is given and less than a step before its start.
    #[must_use]
    pub fn is_nearly_whole(&self) -> bool {
        self.end != self.start
            && self.sweep > PI
            && length(between(self.start, self.end)) < self.step
    }

    /// Its plane.
    #[must_use]
    pub fn plane(&self) -> Plane {
        self.plane
    }

    /// Its sense of rotation, seen with the first axis of the plane to the right and the second
    /// up.
    #[must_use]
    pub fn turn(&self) -> Turn {
        self.turn
    }

    /// Its centre.
    #[must_use]
    pub fn centre(&self) -> [Value; 2] {
        self.centre
    }

    /// Its start.
    #[must_use]
    pub fn start(&self) -> [Value; 2] {
        self.start
    }

    /// The end that was given for it.
    #[must_use]
    pub fn end(&self) -> [Value; 2] {
        self.end
    }

    /// The distance of the start from the centre, in thousandths of a µm.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// How far it goes around the centre, in radians: more than 0, at most a turn.
    #[must_use]
    pub fn sweep(&self) -> f64 {
        self.sweep
    }

    /// How long it is, in thousandths of a µm.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.radius * self.sweep
    }

    /// How far the given end is beside the arc, in steps of the finer axis.
    pub(super) fn end_beside(&self) -> f64 {
        (self.radius - self.end_radius).abs() / self.step
    }

    /// A step of the finer axis, in thousandths of a µm.
    pub(super) fn step(&self) -> f64 {
        self.step
    }

    /// The lowest and the highest coordinate on both axes of the plane, in thousandths of a µm,
    /// of the arc and the end that was given for it.
    #[must_use]
    pub fn extent(&self) -> [(f64, f64); 2] {
        let arc_end = self.point(1.0);
        std::array::from_fn(|axis| {
            let centre = self.centre[axis].in_thousandths() as f64;
            let end = self.end[axis].in_thousandths() as f64;
            let ends = [self.start[axis].in_thousandths() as f64, end, arc_end[axis]];
            let low = ends.into_iter().fold(f64::INFINITY, f64::min);
            let high = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let mut up = [0, 0];
            up[axis] = 1;
            let lowest =
                if self.passes(up.map(|way: i128| -way)) { centre - self.radius } else { low };
            let highest = if self.passes(up) { centre + self.radius } else { high };
            (lowest.min(low), highest.max(high))
        })
    }

    /// The point at a part of its length, 0 the start and 1 the end of the arc, in thousandths of
    /// a µm.
    #[must_use]
    pub fn point(&self, fraction: f64) -> [f64; 2] {
        let [x, y] = between(self.centre, self.start).map(|way| way as f64);
        let (sine, cosine) = libm::sincos(self.turn.sign() as f64 * self.sweep * fraction);
        let [centre_x, centre_y] = self.centre.map(|value| value.in_thousandths() as f64);
        [centre_x + (x * cosine - y * sine), centre_y + (x * sine + y * cosine)]
    }

    /// Whether the arc passes the direction from the centre.
    fn passes(&self, direction: Vector) -> bool {
        let [from, to] = [self.start, self.end].map(|place| between(self.centre, place));
        compare(self.turn, from, direction, to) != Ordering::Greater
    }
}

/// How far it is from one direction on to another, in radians, more than 0 and at most a turn.
///
/// Which half of the turn it is in is decided exactly, because an end beside the start is hardly
/// any way or nearly a turn away.
fn sweep(turn: Turn, from: Vector, to: Vector) -> f64 {
    let across = i128::from(turn.sign()) * cross(from, to);
    let along = dot(from, to);
    match across.cmp(&0) {
        Ordering::Greater => libm::atan2(across as f64, along as f64).max(f64::MIN_POSITIVE),
        Ordering::Less => TAU + libm::atan2(across as f64, along as f64),
        Ordering::Equal if along < 0 => PI,
        Ordering::Equal => TAU,
    }
}

/// Which of the directions `a` and `b` comes first, going around from `from`. Its own direction
/// comes last.
fn compare(turn: Turn, from: Vector, a: Vector, b: Vector) -> Ordering {
    let sign = i128::from(turn.sign());
    // 0 in the first half of the turn, 1 right behind, 2 in the second, 3 at its end.
    let part = |direction| match (sign * cross(from, direction)).cmp(&0) {
        Ordering::Greater => 0,
        Ordering::Equal if dot(from, direction) < 0 => 1,
        Ordering::Less => 2,
        Ordering::Equal => 3,
    };
    // Within a half, `b` is ahead of `a` if it is on the side that the arc turns to.
    part(a).cmp(&part(b)).then_with(|| 0.cmp(&(sign * cross(a, b))))
}
