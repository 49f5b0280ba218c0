//! Arcs and helices as a controller makes them.
//!
//! An arc is one `y` and, if the circle engine does not come to the end, a line to it. Where the
//! engine would be too far from the arc, or cannot make it, it is chords. A helix is `w` where the
//! controller has it.
//!
//! # The third axis
//!
//! A controller spreads the steps of the third axis evenly over those of the circle engine. But
//! where the engine crosses an axis of coordinates it makes one step for a step of the way, and √2
//! halfway to the next. The third axis, which should be even in the angle, is ahead and behind by
//! turns, by up to [`SWAY`] radians of its way. So a helix that climbs steeply is divided. The third
//! axis may be off by what the plane leaves of two steps, and by half a step at most.

use std::f64::consts::SQRT_2;

use vimc4_isel_wire::Plane;

use super::chords::Chords;
use super::engine::{Trace, Wanted};
use super::parameters::CurveParameters;
use super::{Fitted, MOST_STEPS, Motion, Speeds, Steps};

/// How many steps a path is beside the true one at most.
const ROOM: f64 = 2.0;

/// How many steps the third axis may be off because the engine's steps are not even in the angle.
const UNEVEN: f64 = 0.5;

/// How many steps rounding puts the third axis off: the ends of a piece by half a step, and the
/// places between them by as much again.
const ROUNDING: f64 = 1.0;

/// By how many radians the engine is ahead or behind at most between two axes of coordinates, on
/// which it is neither, rounded up: the extremes of `θ - (1 - cos θ + sin θ)·π/4`.
const SWAY: f64 = 0.033_2;

/// By how many radians a piece that ends on an axis of coordinates is off at most, rounded up. If it
/// begins elsewhere, it begins ahead or behind.
const SWAY_OF_A_PART: f64 = 0.042;

/// The motions that make up an arc or a helix.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    parameters: CurveParameters,
    /// Where the motions so far lead to.
    at: Steps,
    course: Course,
}

/// How it is made.
#[derive(Clone, Debug, PartialEq)]
enum Course {
    Engine(Pieces),
    Chords(Chords),
}

/// What the circle engine makes, in one piece or several.
#[derive(Clone, Debug, PartialEq)]
struct Pieces {
    trace: Trace,
    done: u64,
    /// The length of the first piece, in steps of the engine.
    first: u64,
    /// The length of the others.
    stride: u64,
    /// Steps of the engine a second.
    frequency: f64,
    climb: Option<Climb>,
}

/// The third axis of a helix.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Climb {
    /// Where it begins and where it ends, in steps.
    ends: (f64, f64),
    /// How many steps it makes in a radian.
    slope: f64,
    /// Where the arc begins, as [`Trace::angle`] counts, in radians.
    start: f64,
}

impl Climb {
    /// How many steps of the engine the first piece and the others have; `None` if the third axis
    /// would be too far off in any.
    fn lengths(&self, trace: &Trace, wanted: &Wanted) -> Option<(u64, u64)> {
        let slope = self.slope.abs();
        let beside = if slope > wanted.radius {
            // It sets the clock, and the steps of the engine are rounded to its own.
            trace.off + ROUNDING / 2.0
        } else {
            trace.off
        };
        // The engine does not begin and end at the very angles of the arc, but the third axis does.
        let beginning = (trace.angle(0) - self.start).abs();
        let end = (trace.angle(trace.steps) - self.start - wanted.sweep).abs();
        let left = libm::sqrt((ROOM * ROOM - beside * beside).max(0.0));
        let room = UNEVEN.min(left - ROUNDING - slope * beginning.max(end));
        if room <= 0.0 || trace.steps == 0 {
            return None;
        }
        let radians = room / slope;
        let even = longest(radians, trace.crossing());
        let (first, stride) = if trace.steps <= even || 2.0 * SWAY <= radians {
            (trace.steps, trace.steps)
        } else if SWAY_OF_A_PART <= radians {
            (trace.first_quadrant(), trace.quadrant())
        } else {
            (even, even)
        };
        Some((first.min(MOST_STEPS as u64), stride.min(MOST_STEPS as u64)))
    }

    /// The counter of the third axis after some steps of the engine.
    fn counter(&self, trace: &Trace, steps: u64) -> i64 {
        let (from, to) = self.ends;
        let place = from + self.slope * (trace.angle(steps) - self.start);
        libm::round(place.clamp(from.min(to), from.max(to))) as i64
    }
}

/// How many steps of an engine of the radius r can be taken as even in the angle, if it may be off
/// by so many radians.
///
/// The angle bends most on an axis of coordinates, by 1 radian for the square of r steps. So over
/// h·r steps it is off by no more than h² / 8, and by less the longer they are, because it bends
/// less and less: for h up to 1, as far as this is asked for, by no more than h² / (8 + 15.2·h).
/// This is solved for h.
fn longest(radians: f64, r: i64) -> u64 {
    let part = 7.6 * radians;
    let h = part + libm::sqrt(part * part + 8.0 * radians);
    (r as f64 * h.min(1.0)).max(1.0) as u64
}

impl Pieces {
    /// What the circle engine is to make; `None` if it cannot, or if chords do it in fewer pieces.
    fn of(parameters: &CurveParameters) -> Option<Pieces> {
        let wanted = parameters.wanted()?;
        // The counter of a third axis that rests, or has come to its end, is rounded.
        let rounding = if parameters.rise.is_some() { ROUNDING / 2.0 } else { 0.0 };
        let room = libm::sqrt(ROOM * ROOM - rounding * rounding);
        let Some(ends) = parameters.climb() else {
            let trace = wanted.trace(room)?;
            return Some(Pieces::divided(
                parameters,
                trace,
                (MOST_STEPS as u64, MOST_STEPS as u64),
                None,
            ));
        };
        let third = parameters.circle.plane().third();
        let rise = parameters.to[third] - parameters.from[third];
        if !parameters.has_helix || rise.abs() > MOST_STEPS {
            return None;
        }
        let trace = wanted.trace(room)?;
        let start = trace.beginning(&wanted);
        let climb = Climb { ends, slope: (ends.1 - ends.0) / wanted.sweep, start };
        let lengths = climb.lengths(&trace, &wanted)?;
        let pieces = Pieces::divided(parameters, trace, lengths, Some(climb));
        (pieces.number() <= Chords::new(*parameters).number()).then_some(pieces)
    }

    /// The trace in pieces of these lengths.
    fn divided(
        parameters: &CurveParameters,
        trace: Trace,
        (first, stride): (u64, u64),
        climb: Option<Climb>,
    ) -> Pieces {
        let frequency = trace.steps as f64 * parameters.velocity / parameters.length();
        // Rounding can make an arc that is shorter than a step one of a step. That takes as long as
        // a step does; on a slope of 45 degrees the engine makes √2 of them for the way of one.
        let most = SQRT_2 * parameters.velocity / parameters.circle.step();
        let frequency = frequency.min(most);
        Pieces { trace, done: 0, first, stride, frequency, climb }
    }

    /// How many pieces there are.
    fn number(&self) -> u64 {
        1 + self.trace.steps.saturating_sub(self.first).div_ceil(self.stride)
    }

    /// The next piece; `third` is where the third axis is and where it must end.
    fn next(
        &mut self,
        plane: Plane,
        third: (i64, i64),
        speeds: Speeds,
    ) -> Option<(Motion, Fitted)> {
        let wanted = if self.done == 0 { self.first } else { self.stride };
        let steps = wanted.min(self.trace.steps - self.done);
        if steps == 0 {
            return None;
        }
        let done = self.done;
        self.done += steps;
        let Some(climb) = self.climb else {
            let (speed, fitted) = speeds.fit(self.frequency);
            let args = self.trace.parameters(done, steps, speed);
            return Some((Motion::Arc(plane, args), fitted));
        };
        let (at, to) = third;
        let is_last = self.done == self.trace.steps;
        let rise = if is_last { to } else { climb.counter(&self.trace, self.done) } - at;
        // Where the third axis has more steps, it is its steps that the frequency counts.
        let clock = rise.unsigned_abs().max(steps) as f64 / steps as f64;
        let (speed, fitted) = speeds.fit(self.frequency * clock);
        let args = self.trace.parameters(done, steps, speed);
        Some((Motion::Helix(plane, args, rise as i32), fitted))
    }
}

impl Curve {
    /// The arc or helix with these parameters.
    #[must_use]
    pub fn new(parameters: CurveParameters) -> Curve {
        let course = match Pieces::of(&parameters) {
            Some(pieces) => Course::Engine(pieces),
            None => Course::Chords(Chords::new(parameters)),
        };
        Curve { parameters, at: parameters.from, course }
    }

    /// What had to be done to the speed: the greatest change of any part. It takes as long as
    /// making all motions does.
    #[must_use]
    pub fn fitted(&self) -> Fitted {
        let mut rest = self.clone();
        std::iter::from_fn(|| rest.part()).map(|(_, fitted)| fitted).max().unwrap_or_default()
    }

    /// The next motion of the arc or helix itself.
    fn part(&mut self) -> Option<(Motion, Fitted)> {
        let CurveParameters { circle, to, speeds, .. } = self.parameters;
        let third = circle.plane().third();
        let (motion, fitted) = match &mut self.course {
            Course::Engine(pieces) => {
                pieces.next(circle.plane(), (self.at[third], to[third]), speeds)?
            }
            Course::Chords(chords) => {
                let at = self.at;
                let target = chords.find(|target| *target != at)?;
                self.line_to(target)
            }
        };
        let path = motion.path();
        let by = path.at(path.length());
        for (at, by) in self.at.iter_mut().zip(by) {
            *at += by;
        }
        Some((motion, fitted))
    }

    /// The straight line to a place.
    fn line_to(&self, target: Steps) -> (Motion, Fitted) {
        let by: Steps = std::array::from_fn(|axis| target[axis] - self.at[axis]);
        let longest = by.iter().fold(0, |longest, steps| steps.abs().max(longest));
        let square = by.iter().zip(self.parameters.scales).fold(0.0, |sum, (steps, scale)| {
            let way = *steps as f64 * scale.step();
            sum + way * way
        });
        let frequency = self.parameters.velocity * longest as f64 / libm::sqrt(square);
        let (speed, fitted) = self.parameters.speeds.fit(frequency);
        (Motion::Line { by, speed }, fitted)
    }
}

impl Iterator for Curve {
    type Item = Motion;

    fn next(&mut self) -> Option<Motion> {
        if let Some((motion, _)) = self.part() {
            return Some(motion);
        }
        let to = self.parameters.to;
        if self.at == to {
            return None;
        }
        let (correction, _) = self.line_to(to);
        self.at = to;
        Some(correction)
    }
}
