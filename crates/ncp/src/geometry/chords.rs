//! An arc or a helix as straight lines.
//!
//! The lines are chords: their ends are points beside the arc, rounded to steps. Each is computed
//! from its angle, so that no error adds up.
//!
//! # As few as possible
//!
//! Every chord begins and ends with a halt, so chords should be long. The tool may be two steps
//! off. The controller, which rounds a line to steps, uses half a step of that, and the third axis
//! of a helix uses its own rounding error. The rest is [`room`](Chords::room): how far a chord may
//! be outside the arc at its ends, and inside between them. The ends are put outside as far as
//! rounding allows, and because it is known where rounding has put them, each chord is as long as
//! its own two ends let it be: about twice as long as one whose ends are on the arc.
//!
//! No end is outside the space of the arc itself, because the machine may end at its limits.

use std::f64::consts::FRAC_PI_2;

use super::parameters::CurveParameters;
use super::{MOST_STEPS, ROOM, Steps};

/// How many steps of [`ROOM`] the rounding to steps uses, including the error of floating point.
const RASTER: f64 = 0.52;

/// How many steps the third axis of a helix may be off: its ends are rounded, and so are the places
/// between them, and the angle along a chord is not even.
const THIRD: f64 = 1.25;

/// How many of these the angle uses.
const UNEVEN: f64 = 0.2;

/// How far a chord is beside its arc at most, in steps of the finer axis, where its ends are on it.
const SAGITTA: f64 = 0.5;

/// The greatest angle of a chord, in radians, a quarter turn. Along a longer one the angle is too
/// uneven for the third axis of a helix.
const MOST_ANGLE: f64 = FRAC_PI_2;

/// Where a step of one axis is longer than this many of the other, chords have their ends on the
/// arc.
const MOST_UNLIKE: f64 = 1.6;

/// So have those of a circle with a radius of fewer steps.
const LEAST_RADIUS: f64 = 4.0;

/// The places that the chords lead to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chords {
    parameters: CurveParameters,
    /// How much of the angle is done, 0 to 1.
    done: f64,
    /// Where the chord begins, from the centre, in steps of the finer axis.
    at: [f64; 2],
    /// How far a chord may be off, and how far outside its ends are to be; `None` where they are
    /// to be on the arc.
    aim: Option<(f64, f64)>,
    /// The greatest angle of a chord.
    most: f64,
}

impl Chords {
    pub(super) fn new(parameters: CurveParameters) -> Chords {
        let circle = &parameters.circle;
        let (first, second) = circle.plane().axes();
        let steps = [first, second].map(|axis| parameters.scales[axis].step() / circle.step());
        let third = circle.plane().third();
        let rise = (parameters.to[third] - parameters.from[third]).unsigned_abs();
        let slope = rise as f64 / circle.sweep();
        let off = match (parameters.rise.is_some(), rise) {
            (false, _) => 0.0,
            (true, 0) => THIRD - UNEVEN - 0.5,
            (true, _) => THIRD,
        };
        let room = libm::sqrt(ROOM * ROOM - off * off) - RASTER;
        // Rounding moves an end by half a step of each axis.
        let rounding = 0.5 * libm::sqrt(steps[0] * steps[0] + steps[1] * steps[1]);
        let unlike = steps[0].max(steps[1]);
        let alike = unlike <= MOST_UNLIKE && circle.radius() >= LEAST_RADIUS * circle.step();
        // The angle is ahead of a chord's length by φ³ / (72·√3) at most.
        let even = libm::cbrt(UNEVEN * 124.0 / slope.max(f64::MIN_POSITIVE));
        // The most steps of one command.
        let longest = circle.sweep() * MOST_STEPS as f64 / (rise as f64).max(1.0);
        let mut chords = Chords {
            parameters,
            done: 0.0,
            at: [0.0; 2],
            aim: alike.then_some((room, (room - rounding).max(0.0))),
            most: MOST_ANGLE.min(even).min(longest),
        };
        chords.at = chords.seen_from_centre(&parameters.from);
        chords
    }

    /// About how many chords there are.
    pub(super) fn number(&self) -> f64 {
        let outside = self.aim.map_or(0.0, |(_, outside)| outside);
        libm::ceil(self.parameters.circle.sweep() / self.angle(outside)).max(1.0)
    }

    /// The radius, in steps of the finer axis.
    fn radius(&self) -> f64 {
        self.parameters.circle.radius() / self.parameters.circle.step()
    }

    /// A place as seen from the centre, in steps of the finer axis.
    fn seen_from_centre(&self, place: &Steps) -> [f64; 2] {
        let circle = &self.parameters.circle;
        let (first, second) = circle.plane().axes();
        let of = |axis: usize, centre: f64| {
            (place[axis] as f64 * self.parameters.scales[axis].step() - centre) / circle.step()
        };
        let centre = circle.centre().map(|value| value.in_thousandths() as f64);
        [of(first, centre[0]), of(second, centre[1])]
    }

    /// The angle of a chord that begins this far outside.
    fn angle(&self, outside: f64) -> f64 {
        let radius = self.radius();
        let angle = match self.aim {
            // The sagitta of the angle φ is R·(1 - cos φ/2), and that is 2·R·sin² φ/4.
            None => 4.0 * libm::asin(libm::sqrt(SAGITTA / (2.0 * radius)).min(1.0)),
            Some((room, aimed)) => {
                let outside = f64::midpoint(outside, aimed);
                let part = (room + outside) / (2.0 * (radius + outside));
                4.0 * libm::asin(libm::sqrt(part.max(0.0)).min(1.0))
            }
        };
        angle.min(self.most)
    }

    /// The place beside the arc at a part of it, rounded.
    fn place(&self, fraction: f64) -> Steps {
        let CurveParameters { circle, scales, .. } = &self.parameters;
        let mut place = self.parameters.place(fraction);
        if let Some((_, outside)) = self.aim {
            let (first, second) = circle.plane().axes();
            let further = 1.0 + outside * circle.step() / circle.radius();
            let centre = circle.centre().map(|value| value.in_thousandths() as f64);
            let extent = circle.extent();
            for (index, axis) in [first, second].into_iter().enumerate() {
                let there =
                    centre[index] + (circle.point(fraction)[index] - centre[index]) * further;
                let (low, high) = extent[index];
                let [low, high] = [low, high].map(|end| scales[axis].round_f64(end));
                place[axis] = scales[axis].round_f64(there).clamp(low, high);
            }
        }
        if let Some((low, high)) = self.parameters.rise {
            let (low, high) = (low.in_thousandths() as f64, high.in_thousandths() as f64);
            let third = circle.plane().third();
            place[third] = scales[third].round_f64(low + (high - low) * fraction);
        }
        place
    }

    /// Whether a chord to a place stays within the permitted distance of the arc.
    fn fits(&self, room: f64, to: [f64; 2]) -> bool {
        let radius = self.radius();
        let [way_x, way_y] = [to[0] - self.at[0], to[1] - self.at[1]];
        let square = way_x * way_x + way_y * way_y;
        // Where on the chord it is nearest to the centre.
        let along = -(self.at[0] * way_x + self.at[1] * way_y) / square.max(f64::MIN_POSITIVE);
        let along = along.clamp(0.0, 1.0);
        let nearest = [self.at[0] + along * way_x, self.at[1] + along * way_y];
        let distance = |[x, y]: [f64; 2]| libm::sqrt(x * x + y * y);
        distance(nearest) >= radius - room && distance(to) <= radius + room
    }
}

impl Iterator for Chords {
    type Item = Steps;

    fn next(&mut self) -> Option<Steps> {
        if self.done >= 1.0 {
            return None;
        }
        let sweep = self.parameters.circle.sweep();
        let [x, y] = self.at;
        let mut angle = self.angle(libm::sqrt(x * x + y * y) - self.radius());
        let least = 4.0 * libm::asin(libm::sqrt(SAGITTA / (2.0 * self.radius())).min(1.0));
        let least = least.min(self.most);
        loop {
            let done = self.done + angle.max(least) / sweep;
            // The rest would have no length.
            let done = if done > 1.0 - 1e-9 { 1.0 } else { done };
            let to = if done == 1.0 { self.parameters.landing() } else { self.place(done) };
            let there = self.seen_from_centre(&to);
            if angle <= least || self.aim.is_none_or(|(room, _)| self.fits(room, there)) {
                (self.done, self.at) = (done, there);
                return Some(to);
            }
            angle *= 0.93;
        }
    }
}
