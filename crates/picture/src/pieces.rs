//! Motions as lines and arcs that other programs know.

use vimc4_motion::{AXES, Path, Point};

use crate::frame::{Frame, added, distance, scaled};
use crate::leg::{Course, Leg};

/// A part of a motion in the units of the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Piece {
    /// A straight line.
    Line,
    /// A part of a circle of half a turn at the most, with a third axis that follows evenly.
    Arc {
        /// The axes of its plane, the lower one first.
        plane: (usize, usize),
        /// The centre, on these.
        centre: (f64, f64),
        /// Whether it goes from the first axis to the second.
        counterclockwise: bool,
    },
}

/// A part of a motion and where it leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    pub(crate) piece: Piece,
    pub(crate) to: [f64; AXES],
}

/// Something that is shorter is a line.
const SHORT: u64 = 3;

/// How far a step may be beside an arc that stands for it, in steps.
const BESIDE: f64 = 1.6;

/// Half a turn, and what a calculator rounds.
const HALF_TURN: f64 = std::f64::consts::PI * 1.000_1;

/// At so many places of an arc that is looked at the most: on a steep helix the third axis makes several
/// steps while the others make none.
const LOOKS: u64 = 48;

/// The parts of a motion, whose places count from `origin`.
pub(crate) fn parts(leg: &Leg, frame: &Frame, origin: &Point) -> Vec<Part> {
    let scales = frame.scales();
    let from: Point = std::array::from_fn(|axis| leg.from[axis] - origin[axis]);
    let mut parts = Vec::new();
    match &leg.course {
        Course::Together(way) => {
            parts.push(Part { piece: Piece::Line, to: scaled(&added(&from, way), &scales) });
        }
        Course::Made(segment) => {
            let mut put = |piece, to: &Point| {
                parts.push(Part { piece, to: scaled(&added(&from, to), &scales) });
            };
            let (mut before, mut start) = (0, [0; AXES]);
            while before < leg.made {
                let (link, _) = segment.path.link_at(before);
                let steps = link.length().min(leg.made - before).max(1);
                let whole = Whole { link, start, from: &from, scales: &scales };
                whole.split(0, steps, &mut put);
                start = added(&start, &link.at(steps));
                before += steps;
            }
        }
    }
    parts
}

/// A path that is one line or one arc, and where it begins.
struct Whole<'p> {
    link: &'p Path,
    /// From the beginning of the motion, steps.
    start: Point,
    /// Where the motion begins, steps.
    from: &'p Point,
    scales: &'p [f64; AXES],
}

impl Whole<'_> {
    /// From one clock step to another: as one piece if one is near enough to the steps, else in halves.
    fn split(&self, first: u64, last: u64, put: &mut impl FnMut(Piece, &Point)) {
        let to = added(&self.start, &self.link.at(last));
        if last - first <= SHORT || matches!(self.link, Path::Line(_)) {
            return put(Piece::Line, &to);
        }
        match self.arc(first, last) {
            Some(arc) => put(arc, &to),
            None => {
                let middle = first + (last - first) / 2;
                self.split(first, middle, put);
                self.split(middle, last, put);
            }
        }
    }

    /// The place after a clock step, in the units of the axes.
    fn place(&self, step: u64) -> [f64; AXES] {
        scaled(&added(self.from, &added(&self.start, &self.link.at(step))), self.scales)
    }

    /// The arc from one clock step to another, if it is one: the axes of the plane have the same scale,
    /// it is no more than half a turn, and the steps are near.
    fn arc(&self, first: u64, last: u64) -> Option<Piece> {
        let ((one, other), begin) = self.link.circle_at(first)?;
        let (_, end) = self.link.circle_at(last)?;
        let scale = *self.scales.get(one)?;
        if one.max(other) > 2 || scale <= 0.0 || self.scales.get(other) != Some(&scale) {
            return None;
        }
        // What a half turn at the most has: a coordinate that runs in one direction only.
        let (near, far) = (self.link.travel(first), self.link.travel(last));
        let (from, to) = (self.place(first), self.place(last));
        let runs = |axis: usize, way: i64| far[axis] - near[axis] == way.abs();
        if !runs(one, end.x - begin.x) && !runs(other, end.y - begin.y) {
            return None;
        }
        let flat = |place: &[f64; AXES]| (place[one], place[other]);
        let (from_flat, to_flat) = (flat(&from), flat(&to));
        // Both ends are as far from the centre as each other, to the last digit.
        let chord = (to_flat.0 - from_flat.0, to_flat.1 - from_flat.1);
        let square = chord.0 * chord.0 + chord.1 * chord.1;
        if square <= 0.0 {
            return None;
        }
        let centre = (from_flat.0 - begin.x as f64 * scale, from_flat.1 - begin.y as f64 * scale);
        let middle = ((from_flat.0 + to_flat.0) / 2.0, (from_flat.1 + to_flat.1) / 2.0);
        let off = ((middle.0 - centre.0) * chord.0 + (middle.1 - centre.1) * chord.1) / square;
        let centre = (centre.0 + off * chord.0, centre.1 + off * chord.1);
        let radius = distance(&[centre.0, centre.1], &[from_flat.0, from_flat.1]);
        let half = first + (last - first) / 2;
        let arm = (from_flat.0 - centre.0, from_flat.1 - centre.1);
        let seen = flat(&self.place(half));
        let seen = (seen.0 - centre.0, seen.1 - centre.1);
        let cross = arm.0 * seen.1 - arm.1 * seen.0;
        let third = 3 - one - other;
        let whole = turned_to(arm, to_flat, centre, cross > 0.0);
        // The centre was moved, which a small circle notices.
        if whole > HALF_TURN {
            return None;
        }
        let looks = (last - first).min(LOOKS);
        for look in 1..looks {
            let step =
                first + (u128::from(last - first) * u128::from(look) / u128::from(looks)) as u64;
            let place = self.place(step);
            let at = flat(&place);
            let away = distance(&[centre.0, centre.1], &[at.0, at.1]);
            // The third axis follows the angle, and here it follows the steps.
            let turned = turned(arm, (at.0 - centre.0, at.1 - centre.1), cross > 0.0);
            let rise = from[third] + (to[third] - from[third]) * turned / whole.max(1e-12);
            let step = self.scales[third].max(scale);
            if (away - radius).abs() > BESIDE * scale || (rise - place[third]).abs() > BESIDE * step
            {
                return None;
            }
        }
        let plane = (one.min(other), one.max(other));
        let swapped = one > other;
        let centre = if swapped { (centre.1, centre.0) } else { centre };
        (cross != 0.0).then_some(Piece::Arc {
            plane,
            centre,
            counterclockwise: (cross > 0.0) != swapped,
        })
    }
}

fn turned_to(arm: (f64, f64), to: (f64, f64), centre: (f64, f64), left: bool) -> f64 {
    turned(arm, (to.0 - centre.0, to.1 - centre.1), left)
}

/// The angle from one arm to another, in that sense, from 0 to a turn.
fn turned(from: (f64, f64), to: (f64, f64), left: bool) -> f64 {
    let cross = from.0 * to.1 - from.1 * to.0;
    let dot = from.0 * to.0 + from.1 * to.1;
    let angle = libm::atan2(if left { cross } else { -cross }, dot);
    if angle < -1e-9 { angle + std::f64::consts::TAU } else { angle }
}
