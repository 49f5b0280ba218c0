//! A helix of a controller that has none: its circle engine and its third axis in turn.
//!
//! The engine goes on until the third axis is a step behind, or a little more if the engine leaves
//! that much of two steps; then the third axis makes twice as many steps and is ahead. So a helix
//! that climbs by few steps is made in few pieces, however wide it is.

use vimc4_isel_wire::Plane;

use super::climb::Climb;
use super::engine::Trace;
use super::parameters::CurveParameters;
use super::{COMMAND, Fitted, MOST_STEPS, Motion, ROOM, Speeds};

/// How many steps off the third axis must be allowed to be, its ends included.
const THIRD: f64 = 1.25;

/// How many of these its ends take, where the engine is not at the very angles of the arc.
const ENDS: f64 = 0.25;

/// The engine and the third axis in turn.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stairs {
    trace: Trace,
    climb: Climb,
    /// How many steps the third axis may be behind and ahead.
    reach: f64,
    /// Steps that the engine has made.
    done: u64,
    /// Steps of the engine and of the third axis a second.
    frequency: f64,
    third_frequency: f64,
}

impl Stairs {
    /// The stairs of a helix; `None` if they would be too far off.
    pub(super) fn of(parameters: &CurveParameters) -> Option<Stairs> {
        let ends = parameters.climb()?;
        let wanted = parameters.wanted()?;
        let trace = wanted.trace(libm::sqrt(ROOM * ROOM - THIRD * THIRD))?;
        let climb = Climb::new(ends, &trace, &wanted);
        let fits = climb.off_at_its_ends(&trace, &wanted) <= ENDS && trace.steps > 0;
        let third = parameters.circle.plane().third();
        fits.then(|| Stairs {
            trace,
            climb,
            reach: libm::sqrt(ROOM * ROOM - trace.off * trace.off) - ENDS,
            done: 0,
            frequency: trace.steps as f64 * parameters.velocity / parameters.length(),
            third_frequency: parameters.velocity / parameters.scales[third].step(),
        })
    }

    /// About how long they take, in seconds, if the third axis makes this many steps.
    pub(super) fn seconds(&self, rise: u64, speeds: Speeds) -> f64 {
        let risers = libm::ceil(rise as f64 / (2.0 * self.reach));
        let steps = self.trace.steps as f64 / (risers + 1.0);
        let most = f64::from(speeds.highest);
        (risers + 1.0) * speeds.seconds(steps.max(1.0), self.frequency.min(most))
            + (2.0 * risers + 1.0) * COMMAND
            + risers * speeds.seconds(2.0 * self.reach, self.third_frequency.min(most))
    }

    /// The next piece; `third` is where the third axis is and where it must end.
    pub(super) fn next(
        &mut self,
        plane: Plane,
        third: (i64, i64),
        speeds: Speeds,
    ) -> Option<(Motion, Fitted)> {
        let (at, to) = third;
        let up = (to - at).signum();
        let halt = if up == 0 { self.trace.steps } else { self.halt(at, up) };
        let steps = (halt - self.done).min(MOST_STEPS as u64);
        if steps > 0 {
            let (speed, fitted) = speeds.fit(self.frequency);
            let args = self.trace.parameters(self.done, steps, speed);
            self.done += steps;
            return Some((Motion::Arc(plane, args), fitted));
        }
        if up == 0 {
            return None;
        }
        let ahead = self.climb.place(&self.trace, self.done) * up as f64 + self.reach;
        let over = self.done == self.trace.steps;
        let next = if over { to * up } else { (libm::floor(ahead) as i64).min(to * up) };
        let rise = (next - at * up).clamp(1, MOST_STEPS) * up;
        let (speed, fitted) = speeds.fit(self.third_frequency);
        let mut by = [0; 4];
        by[plane.third()] = rise;
        Some((Motion::Line { by, speed }, fitted))
    }

    /// After how many steps of the engine the third axis is as far behind as it may be.
    fn halt(&self, at: i64, up: i64) -> u64 {
        let behind = |steps: u64| {
            (self.climb.place(&self.trace, steps) - at as f64) * up as f64 > self.reach
        };
        let (mut low, mut high) = (self.done, self.trace.steps);
        while low < high {
            let middle = low + (high - low).div_ceil(2);
            if behind(middle) { high = middle - 1 } else { low = middle }
        }
        low
    }
}
