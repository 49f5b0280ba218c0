//! From ways in the world to motions of a controller.
//!
//! A job file speaks of straight lines, arcs and helices in µm and arc seconds. A controller makes
//! straight lines in steps, where the fourth axis does not keep time with the others, and circles
//! with whole-number parameters. [`Straight`] and [`Curve`] are iterators over the [`Motion`]s that
//! come nearest, and each ends exactly where it must.

mod chords;
mod circle;
mod climb;
mod curve;
mod engine;
mod parameters;
mod stairs;
mod straight;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};
use vimc4_isel_wire::{ArcArgs, Plane};
use vimc4_motion::{Arc, ArcState, Helix, Path, Ramp, StraightLine};

pub use circle::{Circle, NoCircle};
pub use curve::{Curve, Reason};
pub use parameters::CurveParameters;
pub use straight::{Straight, StraightParameters};

use crate::language::Value;

/// Steps of the axes X, Y, Z, A.
pub type Steps = [i64; 4];

/// The greatest magnitude of a counter or a parameter of a controller: 24 bits with their sign.
pub const MOST_STEPS: i64 = (1 << 23) - 1;

/// How many steps a path is beside the true one at most.
const ROOM: f64 = 2.0;

/// The time of a command and its answer on a line of 19,200 baud, in seconds.
const COMMAND: f64 = 0.015;

/// One motion that a controller makes by one command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Motion {
    /// A straight move in 3D interpolation by this many steps. The speed is that of the axis with
    /// the longest way, in Hz.
    Line {
        /// The way of each axis.
        by: Steps,
        /// Hz.
        speed: u32,
    },
    /// A circle or a part of one, `y`.
    Arc(Plane, ArcArgs),
    /// The same while the third axis makes this many steps, `w`.
    Helix(Plane, ArcArgs, i32),
}

impl Motion {
    /// Where it leads, step by step, from where it begins.
    ///
    /// [`Straight`] and [`Curve`] never move A together with another axis, so it does not matter
    /// here that a controller lets A follow the others.
    #[must_use]
    pub fn path(&self) -> Path {
        match self {
            Motion::Line { by: [x, y, z, a], .. } => {
                Path::Line(StraightLine::new([*x, *y, *z, *a, 0, 0]))
            }
            Motion::Arc(plane, args) => Path::Arc(arc(*plane, args)),
            Motion::Helix(plane, args, third) => {
                Path::Helix(Helix::new(arc(*plane, args), plane.third(), i64::from(*third)))
            }
        }
    }

    /// The frequency of the step clock, in Hz.
    #[must_use]
    pub fn speed(&self) -> u32 {
        match self {
            Motion::Line { speed, .. } => *speed,
            Motion::Arc(_, args) | Motion::Helix(_, args, _) => args.speed,
        }
    }
}

/// The arc that a controller traces with these parameters.
fn arc(plane: Plane, args: &ArcArgs) -> Arc {
    let (first, second) = plane.axes();
    let start = ArcState {
        x: i64::from(args.x),
        y: i64::from(args.y),
        d: i64::from(args.d),
        rx: args.rx,
        ry: args.ry,
    };
    Arc::new(first, second, u64::from(args.steps), start)
}

/// How many steps of an axis a way in the world is: `steps` for every `per` thousandths of a µm
/// or of an arc second.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Scale {
    /// Steps, more than 0.
    pub steps: i64,
    /// In this many thousandths, more than 0.
    pub per: i64,
}

impl Scale {
    /// The counter at a place: the nearest, a half away from zero.
    #[must_use]
    pub fn round(self, place: Value) -> i64 {
        let twice = 2 * i128::from(place.in_thousandths()) * i128::from(self.steps);
        let per = i128::from(self.per);
        let magnitude = (twice.abs() + per) / (2 * per);
        // A value is at most 10¹² thousandths, and a step is at least one.
        i64::try_from(twice.signum() * magnitude).unwrap_or(i64::MAX)
    }

    /// The same of a place between the thousandths.
    fn round_f64(self, thousandths: f64) -> i64 {
        libm::round(thousandths * self.steps as f64 / self.per as f64) as i64
    }

    /// The counter at a place, not rounded.
    #[must_use]
    pub fn exact(self, place: Value) -> f64 {
        place.in_thousandths() as f64 * self.steps as f64 / self.per as f64
    }

    /// Whether a step is as long.
    #[must_use]
    pub fn equals(self, other: Scale) -> bool {
        i128::from(self.steps) * i128::from(other.per)
            == i128::from(other.steps) * i128::from(self.per)
    }

    /// How many thousandths a step is.
    #[must_use]
    pub fn step(self) -> f64 {
        self.per as f64 / self.steps as f64
    }
}

/// The speeds that a controller accepts, in Hz.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Speeds {
    /// The lowest.
    pub lowest: u32,
    /// The highest.
    pub highest: u32,
    /// How it accelerates to them.
    pub ramp: Ramp,
}

/// How a speed had to be changed. Of several changes the greatest is reported.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub enum Fitted {
    /// Nothing.
    #[default]
    AsAsked,
    /// It was below the lowest.
    Raised,
    /// It was above the highest.
    Capped,
}

/// The cost of making a movement in pieces, each followed by a halt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Delay {
    /// How many pieces there are.
    pub pieces: u64,
    /// How long they take, in seconds.
    pub takes: f64,
    /// How long one motion of as many steps would take at the speed that is asked for, in seconds.
    pub could_take: f64,
}

impl Delay {
    /// By how much longer it takes, as a share of what it could.
    #[must_use]
    pub fn share(&self) -> f64 {
        if self.could_take > 0.0 { self.takes / self.could_take - 1.0 } else { 0.0 }
    }
}

impl Speeds {
    /// How long a motion of this many steps takes at a speed in Hz, in seconds.
    #[must_use]
    pub fn seconds(self, steps: f64, speed: f64) -> f64 {
        let first = f64::from(self.ramp.start_stop);
        if speed <= first {
            return steps / speed;
        }
        let acceleration = f64::from(self.ramp.acceleration) * 1_000.0;
        // The speed that is reached before braking must begin.
        let top = speed.min(libm::sqrt(first * first + acceleration * steps));
        let ramps = (top * top - first * first) / acceleration;
        2.0 * (top - first) / acceleration + (steps - ramps).max(0.0) / top
    }

    /// The speed that a controller is given for one in Hz, which need not be whole.
    #[must_use]
    pub fn fit(self, speed: f64) -> (u32, Fitted) {
        let rounded = libm::round(speed);
        if rounded > f64::from(self.highest) {
            (self.highest, Fitted::Capped)
        } else if rounded < f64::from(self.lowest) {
            (self.lowest, Fitted::Raised)
        } else {
            (rounded as u32, Fitted::AsAsked)
        }
    }
}
