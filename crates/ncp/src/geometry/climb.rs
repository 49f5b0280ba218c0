//! The third axis of a helix, beside the circle engine.
//!
//! A controller spreads the steps of the third axis evenly over those of the circle engine. But the
//! engine makes one step for a step of the way where it crosses an axis of coordinates, and √2
//! halfway to the next. The third axis, which should be even in the angle, is alternately ahead and
//! behind, by up to [`SWAY`] radians of its way. So a helix that climbs steeply is divided. The
//! third axis may be off by what the plane leaves of two steps, but at most by half a step.

use super::engine::{Trace, Wanted};
use super::{MOST_STEPS, ROOM};

/// How many steps the third axis may be off because the engine's steps are not even in the angle.
const UNEVEN: f64 = 0.5;

/// How many steps rounding puts the third axis off: the ends of a piece by half a step, and the
/// places between them by as much again.
pub(super) const ROUNDING: f64 = 1.0;

/// By how many radians the engine is ahead or behind at most between two axes of coordinates, on
/// which it is neither, rounded up: the extremes of `θ - (1 - cos θ + sin θ)·π/4`.
const SWAY: f64 = 0.033_2;

/// By how many radians a piece that ends on an axis of coordinates is off at most, rounded up. If it
/// begins elsewhere, it begins ahead or behind.
const SWAY_OF_A_PART: f64 = 0.042;

/// The third axis of a helix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Climb {
    /// Where it begins and where it ends, in steps.
    ends: (f64, f64),
    /// How many steps it makes in a radian.
    slope: f64,
    /// Where the arc begins, as [`Trace::angle`] counts, in radians.
    start: f64,
}

impl Climb {
    /// The third axis between these ends, beside the engine.
    pub(super) fn new(ends: (f64, f64), trace: &Trace, wanted: &Wanted) -> Climb {
        Climb { ends, slope: (ends.1 - ends.0) / wanted.sweep, start: trace.beginning(wanted) }
    }

    /// How many steps it is off because the engine does not begin and end at the very angles of the
    /// arc, but the third axis does.
    pub(super) fn off_at_its_ends(&self, trace: &Trace, wanted: &Wanted) -> f64 {
        let beginning = (trace.angle(0) - self.start).abs();
        let end = (trace.angle(trace.steps) - self.start - wanted.sweep).abs();
        self.slope.abs() * beginning.max(end)
    }

    /// Where the third axis should be after some steps of the engine.
    pub(super) fn place(&self, trace: &Trace, steps: u64) -> f64 {
        let (from, to) = self.ends;
        let place = from + self.slope * (trace.angle(steps) - self.start);
        place.clamp(from.min(to), from.max(to))
    }

    /// How many steps of the engine the first piece and the others have; `None` if the third axis
    /// would be too far off in any.
    pub(super) fn lengths(&self, trace: &Trace, wanted: &Wanted) -> Option<(u64, u64)> {
        let slope = self.slope.abs();
        let beside = if slope > wanted.radius {
            // The third axis sets the clock, and the steps of the engine are rounded to its own.
            trace.off + ROUNDING / 2.0
        } else {
            trace.off
        };
        let left = libm::sqrt((ROOM * ROOM - beside * beside).max(0.0));
        let room = UNEVEN.min(left - ROUNDING - self.off_at_its_ends(trace, wanted));
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
    pub(super) fn counter(&self, trace: &Trace, steps: u64) -> i64 {
        libm::round(self.place(trace, steps)) as i64
    }
}

/// How many steps of an engine of radius r can count as even in the angle, if it may be off by this
/// many radians.
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
