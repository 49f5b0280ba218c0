//! An arc or a helix as straight lines.
//!
//! The lines are chords: their ends are points of the arc, rounded to steps. Each is computed from
//! its angle, so that no error adds up.

use std::f64::consts::FRAC_PI_2;

use super::parameters::CurveParameters;
use super::{MOST_STEPS, Steps};

/// How far a chord is beside its arc at most, in steps of the finer axis.
const SAGITTA: f64 = 0.5;

/// The greatest angle of a chord, in radians, a quarter turn. Along a longer one the angle is too
/// uneven for the third axis of a helix.
const MOST_ANGLE: f64 = FRAC_PI_2;

/// The places that the chords lead to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chords {
    parameters: CurveParameters,
    number: u64,
    made: u64,
}

impl Chords {
    pub(super) fn new(parameters: CurveParameters) -> Chords {
        let circle = &parameters.circle;
        let step = circle.step();
        // The sagitta of the angle φ is R·(1 - cos φ/2), and that is 2·R·sin² φ/4.
        let sine = libm::sqrt(SAGITTA * step / (2.0 * circle.radius()));
        let angle = (4.0 * libm::asin(sine.min(1.0))).min(MOST_ANGLE);
        let needed = libm::ceil(circle.sweep() / angle) as u64;
        let third = circle.plane().third();
        let rise = (parameters.to[third] - parameters.from[third]).unsigned_abs();
        let number = needed.max(rise.div_ceil(MOST_STEPS.unsigned_abs())).max(1);
        Chords { parameters, number, made: 0 }
    }

    /// How many chords there are.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// The point at a part of the arc, rounded.
    fn place(&self, fraction: f64) -> Steps {
        let mut place = self.parameters.place(fraction);
        if let Some((low, high)) = self.parameters.rise {
            let (low, high) = (low.in_thousandths() as f64, high.in_thousandths() as f64);
            let third = self.parameters.circle.plane().third();
            place[third] = self.parameters.scales[third].round_f64(low + (high - low) * fraction);
        }
        place
    }
}

impl Iterator for Chords {
    type Item = Steps;

    fn next(&mut self) -> Option<Steps> {
        if self.made == self.number {
            return None;
        }
        self.made += 1;
        Some(if self.made == self.number {
            self.parameters.landing()
        } else {
            self.place(self.made as f64 / self.number as f64)
        })
    }
}
