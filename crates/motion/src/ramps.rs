//! Ramps: a step frequency that rises from a start-stop frequency and falls back to it.
//!
//! # The units of the derivation
//!
//! Frequencies are in µHz, times in ns; an acceleration of a Hz/ms is then a µHz/ns, an integer.
//! Ways are measured in µHz²: a frequency that changes from f to g at the acceleration a makes
//! the way |g² - f²|, and one step is the way 2·10¹⁵·a. This makes ramps plain: with f0 the
//! start-stop frequency, the frequency after the way s of a rising ramp is √(f0² + s), and the
//! time it takes is (√(f0² + s) - f0)/a.
//!
//! # The motion
//!
//! Let S be the whole way. If nothing limits it the speed rises over one half of S to the
//! middle frequency p, p² = f0² + S/2, and falls over the other. With the speed v given, the top
//! frequency is V = min(v, p).
//!
//! - Rising: the frequency at t is f0 + a·t; the way s is done at t = (√(f0² + s) - f0)/a.
//! - At the top: both ramps are V² - f0² long, and s is done at t = (s + (V - f0)²)/(2·a·V).
//! - Falling: the frequency at t is A - a·t, where A = V - f0 + p²/V follows from the total time,
//!   and s is done when it is down to √(f0² + S - s).
//!
//! A braked motion is the same with a smaller S. If braking begins at the frequency w of the
//! rising ramp, the way is that of a triangle with its top at w, S = 2·(w² - f0²); if it begins
//! at the top at t, the way so far and one ramp make S = 2·a·V·t + 2·V·f0 - 2·f0². S is not a
//! whole number of steps then, and the motion halts on the last whole step within it. A motion
//! that braking would make longer has begun to fall already, and is left alone.
//!
//! At speeds up to the start-stop frequency f0 is taken to be v: ramps of length 0.
//!
//! # Exactness
//!
//! A time is the least integer t that a sum of rationals and square roots does not exceed. Where
//! one root is involved the comparison is with the integer part of the root, since everything
//! else can be made an integer. Only the falling side of a triangle has two, √(4p²) - √r; see
//! [`ceil_difference`]. All values fit 128 bits for the documented ranges, to which everything
//! that comes in is cut.

use serde::{Deserialize, Serialize};

use crate::phase::{Phase, Trend};
use crate::wide;
use crate::wide::saturated;

/// The largest number of steps.
const MOST_STEPS: u64 = 1 << 40;
/// The largest speed and start-stop frequency, Hz.
const FASTEST: u32 = 1_000_000;
/// The largest acceleration, Hz/ms.
const STEEPEST: u32 = 100_000;
/// µHz in a Hz.
const MICRO: u128 = 1_000_000;
/// One step is this many times the acceleration in µHz².
const STEP: u128 = 2_000_000_000_000_000;

/// The two values every ramp is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Ramp {
    /// Start-stop frequency in Hz, 1 to 1,000,000: up to here motors start and stop without a
    /// ramp.
    pub start_stop: u32,
    /// Acceleration in Hz/ms, 1 to 100,000.
    pub acceleration: u32,
}

/// A motion with ramps, see [`Profile::new`](crate::Profile::new).
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(crate) struct Ramped {
    /// The number of steps if the motion runs its course.
    pub(crate) steps: u64,
    /// Hz.
    pub(crate) speed: u32,
    pub(crate) ramp: Ramp,
    /// When braking began, nanoseconds after the start; `None` while the motion runs its course.
    pub(crate) braked_at: Option<u64>,
}

impl Ramped {
    pub(crate) fn steps(&self) -> u64 {
        match self.braked_at {
            None => self.steps.min(MOST_STEPS),
            Some(_) => self.curve().steps(),
        }
    }

    pub(crate) fn steps_at(&self, nanos: u64) -> u64 {
        self.curve().steps_at(nanos)
    }

    pub(crate) fn time_of(&self, k: u64) -> u64 {
        let curve = self.curve();
        curve.time_of(k.min(curve.steps()))
    }

    pub(crate) fn speed_at(&self, nanos: u64) -> u64 {
        let curve = self.curve();
        if curve.steps_at(nanos) == curve.steps() { 0 } else { curve.speed_at(nanos) }
    }

    pub(crate) fn brake(&self, nanos: u64) -> Option<Ramped> {
        if self.braked_at.is_some() {
            return None;
        }
        let braked = Ramped { braked_at: Some(nanos), ..self.clone() };
        (braked.steps() < self.steps()).then_some(braked)
    }

    /// See [`Profile::phases`](crate::Profile).
    pub(crate) fn phases(&self) -> Vec<Phase> {
        let curve = self.curve();
        let ramp = curve.middle_squared().min(curve.top().pow(2)) - curve.base.pow(2);
        let acceleration = 1_000 * curve.acceleration;
        let phase = |way: u128, acceleration, trend| Phase {
            to: saturated(way / curve.step).min(curve.steps()),
            acceleration,
            trend,
        };
        vec![
            phase(ramp, acceleration, Trend::Rises),
            phase(curve.way.saturating_sub(ramp), 0, Trend::Stays),
            Phase { to: curve.steps(), acceleration, trend: Trend::Falls },
        ]
    }

    pub(crate) fn clock(&self) -> RampClock {
        let curve = self.curve();
        let braking = self.braked_at.map(|at| Braking {
            at: u128::from(at),
            way: curve.undisturbed_way(at),
            frequency: curve.undisturbed_frequency(at),
        });
        RampClock { curve, braking }
    }

    /// The motion in the units of the derivation.
    fn curve(&self) -> Curve {
        let hertz = |f: u32| u128::from(f.clamp(1, FASTEST));
        let speed = hertz(self.speed);
        let acceleration = u128::from(self.ramp.acceleration.clamp(1, STEEPEST));
        let step = STEP * acceleration;
        let mut curve = Curve {
            base: hertz(self.ramp.start_stop).min(speed) * MICRO,
            speed,
            acceleration,
            step,
            way: u128::from(self.steps.min(MOST_STEPS)) * step,
        };
        if let Some(at) = self.braked_at {
            // The way to the brakes, and the way that braking takes.
            let frequency = curve.undisturbed_frequency(at);
            curve.way = curve.undisturbed_way(at) + (frequency.pow(2) - curve.base.pow(2));
        }
        curve
    }
}

/// A motion in the units of the derivation, see there.
#[derive(Clone, Debug)]
struct Curve {
    /// f0, µHz.
    base: u128,
    /// v, Hz: what the µHz would add to the size of some products, they can do without.
    speed: u128,
    /// a, µHz/ns.
    acceleration: u128,
    /// The way of one step, µHz².
    step: u128,
    /// S, µHz².
    way: u128,
}

/// Which shape a motion has, with what its falling side needs.
enum Shape {
    /// The speed is reached. Contains v·A, so that it is an integer; µHz·Hz.
    Trapezoid(u128),
    /// It is not. Contains (2p)², µHz²; here A is 2p - f0.
    Triangle(u128),
}

impl Curve {
    /// v, µHz.
    fn top(&self) -> u128 {
        self.speed * MICRO
    }

    /// p², µHz².
    fn middle_squared(&self) -> u128 {
        self.base.pow(2) + self.way / 2
    }

    fn shape(&self) -> Shape {
        let (top, middle_squared) = (self.top(), self.middle_squared());
        if top.pow(2) <= middle_squared {
            Shape::Trapezoid(self.speed * (top - self.base) + middle_squared / MICRO)
        } else {
            Shape::Triangle(4 * middle_squared)
        }
    }

    /// The frequency at `nanos` of a motion that never falls, µHz.
    fn undisturbed_frequency(&self, nanos: u64) -> u128 {
        self.top().min(self.base + self.acceleration * u128::from(nanos))
    }

    /// The way made until `nanos` by a motion that never falls, µHz².
    fn undisturbed_way(&self, nanos: u64) -> u128 {
        let (top, rise) = (self.top(), self.acceleration * u128::from(nanos));
        if self.base + rise <= top {
            (2 * self.base + rise) * rise
        } else {
            2 * top * rise - (top - self.base).pow(2)
        }
    }

    fn steps(&self) -> u64 {
        saturated(self.way / self.step)
    }

    /// When step `k`, 0 to `steps()`, happens.
    fn time_of(&self, k: u64) -> u64 {
        let (base, a, top) = (self.base, self.acceleration, self.top());
        let way = u128::from(k) * self.step;
        let ramp = self.middle_squared().min(top.pow(2)) - base.pow(2);
        saturated(if way <= ramp {
            (ceil_sqrt(base.pow(2) + way) - base).div_ceil(a)
        } else if way <= self.way - ramp {
            (way + (top - base).pow(2)).div_ceil(2 * a * top)
        } else {
            let target_squared = base.pow(2) + self.way - way;
            match self.shape() {
                Shape::Trapezoid(intercept) => {
                    let target = (self.speed.pow(2) * target_squared).isqrt();
                    (intercept - target).div_ceil(self.speed * a)
                }
                Shape::Triangle(twice_middle_squared) => {
                    (ceil_difference(twice_middle_squared, target_squared) - base).div_ceil(a)
                }
            }
        })
    }

    /// How many steps are made at `nanos`.
    fn steps_at(&self, nanos: u64) -> u64 {
        let (base, top) = (self.base, self.top());
        let rising = base + self.acceleration * u128::from(nanos);
        if rising <= top && rising.pow(2) <= self.middle_squared() {
            return saturated((rising.pow(2) - base.pow(2)) / self.step);
        }
        match self.shape() {
            Shape::Trapezoid(intercept) => {
                let falling = self.falling(intercept, nanos);
                let way = if falling >= self.speed * top {
                    self.undisturbed_way(nanos)
                } else {
                    let frequency_squared = falling.pow(2).div_ceil(self.speed.pow(2));
                    self.way - frequency_squared.saturating_sub(base.pow(2))
                };
                saturated(way / self.step)
            }
            Shape::Triangle(twice_middle_squared) => {
                // The frequency is A - a·t = √(4p²) - rising, its square 4p² + rising²
                // - 2·rising·√(4p²), and what is left of the way is that square less f0².
                let root = twice_middle_squared.isqrt();
                if rising + base > root {
                    return self.steps();
                }
                let low = self.way + base.pow(2) + 2 * rising * root
                    - (twice_middle_squared + rising.pow(2));
                let high = self.way.min(low + 2 * rising);
                // The fraction of the root that was dropped is worth less than 1/500 of a step.
                let (low, high) = (saturated(low / self.step), saturated(high / self.step));
                if low < high && nanos < self.time_of(high) { low } else { high }
            }
        }
    }

    /// The frequency at `nanos`, before the last step, µHz, rounded down.
    fn speed_at(&self, nanos: u64) -> u64 {
        let undisturbed = self.undisturbed_frequency(nanos);
        saturated(match self.shape() {
            Shape::Trapezoid(intercept) => {
                undisturbed.min(self.falling(intercept, nanos) / self.speed)
            }
            Shape::Triangle(twice_middle_squared) => {
                let rising = self.base + self.acceleration * u128::from(nanos);
                undisturbed.min(twice_middle_squared.isqrt().saturating_sub(rising))
            }
        })
    }

    /// v times the frequency of the falling side of a trapezoid at `nanos`, µHz·Hz: more than v
    /// times the top before it, 0 long after it.
    fn falling(&self, intercept: u128, nanos: u64) -> u128 {
        intercept.saturating_sub(self.speed * self.acceleration * u128::from(nanos))
    }
}

/// The square root rounded up.
fn ceil_sqrt(square: u128) -> u128 {
    let root = square.isqrt();
    root + u128::from(root * root < square)
}

/// The least integer not below √h - √m, for h ≥ m, both below 2⁸³.
///
/// With the integer parts H and M of the roots and the rests eh = h - H², em = m - M², it is
/// H - M =: c, or one more. It is c if √m + c ≥ √h; squared, 2·c·(√m - M) ≥ eh - em; and
/// squared again 4·c²·em ≥ y² + 4·c·M·y with y = eh - em, unless y ≤ 0.
fn ceil_difference(h: u128, m: u128) -> u128 {
    let (h_root, m_root) = (h.isqrt(), m.isqrt());
    let (h_rest, m_rest) = (h - h_root.pow(2), m - m_root.pow(2));
    let c = h_root - m_root;
    let y = h_rest.saturating_sub(m_rest);
    c + u128::from(y > 0 && 4 * c * c * m_rest < y * y + 4 * c * m_root * y)
}

/// Whether a step is made, by the definition: the integral of the frequency, and the mirror.
#[derive(Clone, Debug)]
pub(crate) struct RampClock {
    curve: Curve,
    braking: Option<Braking>,
}

/// Where and how fast the motion was when it began to brake.
#[derive(Clone, Debug)]
struct Braking {
    at: u128,
    way: u128,
    frequency: u128,
}

impl RampClock {
    /// Whether the integral of the frequency up to `nanos` has reached step `k`.
    #[inline]
    pub(crate) fn reached(&self, k: u64, nanos: u64) -> bool {
        let Curve { base, speed, acceleration: a, step, .. } = self.curve;
        let way = u128::from(k) * step;
        if let Some(braking) = &self.braking
            && u128::from(nanos) > braking.at
        {
            // Along the braking ramp the frequency falls from what it was by a·t.
            let fall = a * (u128::from(nanos) - braking.at);
            return fall >= braking.frequency - base
                || braking.way + (2 * braking.frequency - fall) * fall >= way;
        }
        let remaining = self.curve.way.saturating_sub(way);
        let top = self.curve.top();
        // By its symmetry the motion runs undisturbed as long as the way left is longer than
        // what was done, or than the ramp.
        if self.braking.is_some() || remaining >= way.min(top.pow(2) - base.pow(2)) {
            return self.curve.undisturbed_way(nanos) >= way;
        }
        // In the mirror: the frequency A - a·t is down to the square root of `target`.
        let target = base.pow(2) + remaining;
        match self.curve.shape() {
            Shape::Trapezoid(intercept) => {
                self.curve.falling(intercept, nanos).pow(2) <= speed.pow(2) * target
            }
            Shape::Triangle(twice_middle_squared) => {
                // √h - c ≤ √m, squared: h - c² - m ≤ 2·c·√m.
                let c = base + a * u128::from(nanos);
                let left = if c > 2 * top {
                    0
                } else {
                    twice_middle_squared.saturating_sub(c.pow(2) + target)
                };
                left == 0 || wide::square(left) <= wide::product((2 * c).pow(2), target)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_of_roots_are_rounded_up_exactly() {
        for h in 0..900u128 {
            for m in 0..=h {
                // c + √m ≥ √h, squared: 2·c·√m ≥ h - m - c².
                let enough = |c: u128| {
                    let rest = (h - m).saturating_sub(c * c);
                    rest * rest <= 4 * c * c * m
                };
                let c = ceil_difference(h, m);
                assert!(enough(c) && (c == 0 || !enough(c - 1)), "√{h} - √{m} gave {c}");
            }
        }
    }
}
