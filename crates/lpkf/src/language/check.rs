//! Checks that need knowledge of the machine.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};
use vimc4_plant::Unit;

use super::command::{Axis, Command};
use super::number::Number;
use super::parameter::Kind;
use super::status::Status;

/// The machine, as far as the parameters of a command depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limits {
    /// The axes in the order X to Z3; `None` where none is fitted.
    pub axes: [Option<AxisLimits>; 6],
    /// Whether a small `VS` is in m/s, see [`Number::speed`](super::Number::speed).
    pub metres: bool,
    /// Whether the resolution of a linear axis is in µm instead of nm.
    pub micrometres: bool,
}

/// The properties of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisLimits {
    /// How it moves.
    pub kind: Unit,
    /// The highest speed it can be given, in µm/s or 0.1°/s.
    pub max_speed: i32,
    /// The highest acceleration it can be given, in mm/s² or mrad/s².
    pub max_acceleration: i32,
}

/// Why a command does not suit a machine. [`Misfit::status`] is what is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Misfit {
    /// The machine does not have this axis.
    NotFitted(Axis),
    /// A value is below what an axis allows.
    TooLow(Value),
    /// A value is above what an axis allows.
    TooHigh(Value),
}

/// A value that an axis does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Value {
    /// The axis, one of those that it is for.
    pub axis: Axis,
    /// How the axis moves.
    pub of: Unit,
    /// What kind of value it is: a speed, an acceleration or a resolution.
    pub kind: Kind,
    /// The value, as it is compared.
    pub value: Number,
    /// The limit, in [`Kind::unit`] unless it is a resolution in µm.
    pub limit: i32,
}

impl Misfit {
    /// The status that is answered.
    #[must_use]
    pub const fn status(self) -> Status {
        match self {
            Self::NotFitted(_) => Status::NoSuchAxis,
            Self::TooLow(Value { kind: Kind::Acceleration, .. }) => Status::AccelerationTooLow,
            Self::TooLow(Value { kind: Kind::Resolution, .. }) => Status::ResolutionTooSmall,
            Self::TooLow(_) => Status::SpeedTooLow,
            Self::TooHigh(Value { kind: Kind::Acceleration, .. }) => Status::AccelerationTooHigh,
            Self::TooHigh(Value { kind: Kind::Resolution, .. }) => Status::ResolutionTooLarge,
            Self::TooHigh(_) => Status::SpeedTooHigh,
        }
    }
}

impl Command {
    /// Whether anything about it depends on the machine: [`check`](Self::check) accepts everything
    /// else.
    #[must_use]
    pub(crate) const fn depends_on_machine(&self) -> bool {
        matches!(
            self,
            Self::PenSpeed(_)
                | Self::TravelSpeed(_)
                | Self::ZSpeed(_)
                | Self::AxisSpeed { .. }
                | Self::Acceleration { .. }
                | Self::Resolution { .. }
                | Self::MoveZAbsolute(_)
                | Self::MoveZRelative(_)
                | Self::HardClipLimits(Some(_))
                | Self::NominalPosition(Some(_))
                | Self::ActualPosition { axis: Some(_), .. }
                | Self::Reference(Some(_))
                | Self::Range { .. }
                | Self::MoveAxisAbsolute { .. }
                | Self::MoveAxisRelative { .. }
                | Self::FollowVectors { .. }
        )
    }

    /// Whether the machine has the axes that are named and they allow the values.
    ///
    /// A value for all axes must be allowed by each that is fitted; a speed of the head by X and Y.
    /// How coordinates of axes that are not fitted are treated is not decided here.
    ///
    /// # Errors
    ///
    /// First an axis that is not fitted, in the order of writing, then a value too low or too
    /// high.
    pub fn check(&self, limits: &Limits) -> Result<(), Misfit> {
        match self {
            &Self::PenSpeed(speed) => limits.head(speed.speed(limits.metres)),
            &Self::TravelSpeed(speed) => limits.head(speed),
            &Self::ZSpeed(speed) => limits.value(Some(Axis::Z0), Kind::Speed, speed),
            &Self::AxisSpeed { axis, speed } => limits.value(Some(axis), Kind::Speed, speed),
            &Self::Acceleration { axis, acceleration } => {
                limits.value(axis, Kind::Acceleration, acceleration)
            }
            &Self::Resolution { axis, resolution } => limits.resolution(axis, resolution),
            Self::MoveZAbsolute(_) | Self::MoveZRelative(_) => limits.fitted(Axis::Z0).map(drop),
            Self::HardClipLimits(Some(axis))
            | Self::NominalPosition(Some(axis))
            | Self::ActualPosition { axis: Some(axis), .. }
            | Self::Reference(Some(axis))
            | Self::Range { axis, .. }
            | Self::MoveAxisAbsolute { axis, .. }
            | Self::MoveAxisRelative { axis, .. } => limits.fitted(*axis).map(drop),
            Self::FollowVectors { axes, .. } => {
                axes.iter().try_for_each(|&axis| limits.fitted(axis).map(drop))
            }
            _ => Ok(()),
        }
    }
}

/// The lowest and the highest resolution in µm, from machines of the family that take it so.
const MICROMETRES: (Option<i32>, Option<i32>) = (Some(1), Some(32_000));

impl Limits {
    fn fitted(&self, axis: Axis) -> Result<&AxisLimits, Misfit> {
        self.axes[axis.index()].as_ref().ok_or(Misfit::NotFitted(axis))
    }

    /// Checks something for one axis, or for all.
    fn each(
        &self,
        axis: Option<Axis>,
        allow: impl Fn(Axis, &AxisLimits) -> Result<(), Misfit>,
    ) -> Result<(), Misfit> {
        match axis {
            Some(axis) => allow(axis, self.fitted(axis)?),
            None => self.all(&Axis::ALL, allow),
        }
    }

    /// Checks something for those of some axes that are fitted.
    fn all(
        &self,
        axes: &[Axis],
        allow: impl Fn(Axis, &AxisLimits) -> Result<(), Misfit>,
    ) -> Result<(), Misfit> {
        let fitted = axes.iter().filter_map(|axis| Some((*axis, self.fitted(*axis).ok()?)));
        fitted.into_iter().try_for_each(|(axis, limits)| allow(axis, limits))
    }

    fn value(&self, axis: Option<Axis>, kind: Kind, value: i32) -> Result<(), Misfit> {
        self.each(axis, |axis, limits| limits.allow(axis, kind, value))
    }

    /// A resolution is compared with its decimals: 99.5 nm are too few.
    fn resolution(&self, axis: Option<Axis>, resolution: Number) -> Result<(), Misfit> {
        self.each(axis, |axis, limits| {
            let range = match (limits.kind, self.micrometres) {
                (Unit::Linear, true) => MICROMETRES,
                (kind, _) => Kind::Resolution.limits(kind),
            };
            limits.keep_within(axis, Kind::Resolution, resolution, range)
        })
    }

    /// Checks a speed of X and Y together.
    fn head(&self, speed: i32) -> Result<(), Misfit> {
        self.all(&[Axis::X, Axis::Y], |axis, limits| limits.allow(axis, Kind::Speed, speed))
    }
}

impl AxisLimits {
    fn allow(&self, axis: Axis, kind: Kind, value: i32) -> Result<(), Misfit> {
        let (low, _) = kind.limits(self.kind);
        let high = match kind {
            Kind::Acceleration => self.max_acceleration,
            _ => self.max_speed,
        };
        self.keep_within(axis, kind, value.into(), (low, Some(high)))
    }

    fn keep_within(
        &self,
        axis: Axis,
        kind: Kind,
        value: Number,
        (low, high): (Option<i32>, Option<i32>),
    ) -> Result<(), Misfit> {
        let beyond = |limit: Option<i32>, order| {
            let limit = limit.filter(|limit| value.cmp(&Number::from(*limit)) == order)?;
            Some(Value { axis, of: self.kind, kind, value, limit })
        };
        if let Some(value) = beyond(low, Ordering::Less) {
            Err(Misfit::TooLow(value))
        } else if let Some(value) = beyond(high, Ordering::Greater) {
            Err(Misfit::TooHigh(value))
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::{Dialect, parse};

    /// X and Y linear, Z0 rotary, nothing else.
    fn limits() -> Limits {
        let linear =
            Some(AxisLimits { kind: Unit::Linear, max_speed: 40_000, max_acceleration: 20_000 });
        let rotary =
            Some(AxisLimits { kind: Unit::Rotary, max_speed: 3_600, max_acceleration: 800_000 });
        let axes = [linear, linear, rotary, None, None, None];
        Limits { axes, metres: true, micrometres: false }
    }

    fn check(text: &str, model: Dialect) -> Result<(), Status> {
        parse(text.as_bytes(), model).expect(text).check(&limits()).map_err(Misfit::status)
    }

    #[test]
    fn every_limit_is_the_manuals() {
        // What the command sets, on the linear X and the rotary Z0: lowest, highest, and the
        // statuses.
        for (letters, linear, rotary, low, high) in [
            ("!VZ", 10..=40_000, 1..=3_600, Status::SpeedTooLow, Status::SpeedTooHigh),
            (
                "!AS",
                10..=20_000,
                1..=800_000,
                Status::AccelerationTooLow,
                Status::AccelerationTooHigh,
            ),
            (
                "!RS",
                100..=1_000_000,
                100..=3_600_000,
                Status::ResolutionTooSmall,
                Status::ResolutionTooLarge,
            ),
        ] {
            for (axis, range) in [(0, linear), (2, rotary)] {
                let set =
                    |value: i32| check(&format!("{letters} {value},{axis}"), Dialect::MotionSystem);
                assert_eq!(set(range.start() - 1), Err(low), "{letters}");
                assert_eq!(set(*range.start()), Ok(()), "{letters}");
                assert_eq!(set(*range.end()), Ok(()), "{letters}");
                assert_eq!(set(range.end() + 1), Err(high), "{letters}");
                assert_eq!(set(-1), Err(low), "{letters}");
            }
        }
    }

    #[test]
    fn what_is_for_all_must_suit_all() {
        // 5 suits the rotary axis only, 30,000 too; between 10 and 20,000 both.
        assert_eq!(check("!AS 5", Dialect::Smcu), Err(Status::AccelerationTooLow));
        assert_eq!(check("!AS 30000", Dialect::Smcu), Err(Status::AccelerationTooHigh));
        assert_eq!(check("!AS 10", Dialect::Smcu), Ok(()));
        assert_eq!(check("!RS 2000000", Dialect::Smcu), Err(Status::ResolutionTooLarge));
        assert_eq!(check("VS 9", Dialect::Smcu), Err(Status::SpeedTooLow));
        assert_eq!(check("!VU 40001", Dialect::Smcu), Err(Status::SpeedTooHigh));
        // Z has its own limits.
        assert_eq!(check("!VZ 9", Dialect::Smcu), Ok(()));
        assert_eq!(check("!VZ 3601", Dialect::Smcu), Err(Status::SpeedTooHigh));
    }

    #[test]
    fn a_small_speed_of_the_head_may_be_in_metres() {
        let slow = parse(b"VS0.005000", Dialect::Smcu).unwrap();
        assert_eq!(slow.check(&limits()), Ok(()));
        let literal = Limits { metres: false, ..limits() };
        assert_eq!(slow.check(&literal).map_err(Misfit::status), Err(Status::SpeedTooLow));
        assert_eq!(check("VS0.5", Dialect::Smcu), Err(Status::SpeedTooHigh));
    }

    #[test]
    fn axes_must_be_fitted() {
        for command in
            ["OH", "!IS", "!ZA 5,", "!ZR 5,", "!SR 0,5,", "!VZ 50,", "!AS 50,", "!RS 500,"]
        {
            assert_eq!(check(&format!("{command} 2"), Dialect::MotionSystem), Ok(()), "{command}");
            let missing = check(&format!("{command} 3"), Dialect::MotionSystem);
            assert_eq!(missing, Err(Status::NoSuchAxis), "{command}");
        }
        assert_eq!(check("!PH 0,2\rX1", Dialect::MotionSystem), Ok(()));
        assert_eq!(check("!PH 0,5\rX1", Dialect::MotionSystem), Err(Status::NoSuchAxis));
        // The axis is looked at before the value.
        assert_eq!(check("!VZ 0,3", Dialect::MotionSystem), Err(Status::NoSuchAxis));
        let mut plotter = limits();
        plotter.axes[2] = None;
        for command in ["!ZA 5", "!ZR 5", "!VZ 50"] {
            let command = parse(command.as_bytes(), Dialect::Smcu).unwrap();
            assert_eq!(command.check(&plotter), Err(Misfit::NotFitted(Axis::Z0)));
        }
    }
}
