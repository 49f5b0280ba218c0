//! Parameters: their units, and the values they can have.

use serde::{Deserialize, Serialize};
use vimc4_plant::Unit;

/// A parameter of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Its name in the manual: `x`, `td1`.
    pub name: &'static str,
    /// What kind of value it is.
    pub kind: Kind,
}

/// What kind of value a parameter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A position or a way, in steps.
    Coordinate,
    /// An angle in degrees, with decimals.
    Angle,
    /// A speed.
    Speed,
    /// An acceleration.
    Acceleration,
    /// The way of one step.
    Resolution,
    /// A time in ms. Assumed: one below 0 is 0.
    Time,
    /// An axis, 0 to 5 for X to Z3.
    Axis,
    /// An axis, 1 to 6 for X to Z3, or 0 for all.
    Nominal,
    /// The same after a trigger; 100 more without one.
    Actual,
    /// 0 for off, 1 for on. Assumed: every other number is on, too.
    Switch,
    /// 0 for drilling, 1 for milling. Assumed: every other number is milling, too.
    Mode,
    /// The address of a port, 0 to 255: bank in the upper four bits, port in the lower.
    Port,
    /// What a port shows. Assumed: 16 bits, and of a longer number the lower ones.
    Word,
    /// What the trackball does, 1 to 3.
    Interface,
    /// A data channel. The manual does not say which there are.
    Channel,
}

impl Kind {
    /// The unit on an axis of this kind; empty for plain numbers.
    #[must_use]
    pub const fn unit(self, axis: Unit) -> &'static str {
        match (self, axis) {
            (Self::Coordinate, _) => "steps",
            (Self::Angle, _) => "°",
            (Self::Speed, Unit::Linear) => "µm/s",
            (Self::Speed, Unit::Rotary) => "0.1°/s",
            (Self::Acceleration, Unit::Linear) => "mm/s²",
            (Self::Acceleration, Unit::Rotary) => "mrad/s²",
            (Self::Resolution, Unit::Linear) => "nm",
            (Self::Resolution, Unit::Rotary) => "0.001″",
            (Self::Time, _) => "ms",
            _ => "",
        }
    }

    /// The lowest and the highest value on an axis of this kind, in [`Kind::unit`], where the
    /// manual's table of limits (Grenzwerte von Eingabeparametern) has one. It has no highest
    /// speed, which depends on the machine.
    #[must_use]
    pub const fn limits(self, axis: Unit) -> (Option<i32>, Option<i32>) {
        match (self, axis) {
            (Self::Resolution, Unit::Linear) => (Some(100), Some(1_000_000)),
            (Self::Resolution, Unit::Rotary) => (Some(100), Some(3_600_000)),
            (Self::Speed, Unit::Linear) => (Some(10), None),
            (Self::Speed, Unit::Rotary) => (Some(1), None),
            (Self::Acceleration, Unit::Linear) => (Some(10), Some(20_000)),
            (Self::Acceleration, Unit::Rotary) => (Some(1), Some(800_000)),
            _ => (None, None),
        }
    }
}
