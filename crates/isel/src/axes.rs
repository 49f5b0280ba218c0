//! The axes and their counters.

use vimc4_device::Point;
use vimc4_isel_wire::AxisSet;
use vimc4_motion::StraightLine;

/// How many axes these controllers have: X, Y, Z, A.
pub(crate) const AXES: usize = 4;
/// What they are called.
pub(crate) const AXIS_NAMES: [&str; AXES] = ["X", "Y", "Z", "A"];

/// A position as the 24-bit counters hold it.
pub(crate) fn wrap(position: i64) -> i64 {
    (position << 40) >> 40
}

/// A line of one axis.
pub(crate) fn along(axis: usize, steps: i64) -> StraightLine {
    let mut delta = Point::default();
    delta[axis] = steps;
    StraightLine::new(delta)
}

/// The axes with a way.
pub(crate) fn moving_axes(low: &Point, high: &Point) -> AxisSet {
    let bits =
        (0..4).fold(
            0,
            |bits, axis| {
                if low[axis] != 0 || high[axis] != 0 { bits | 1 << axis } else { bits }
            },
        );
    AxisSet::from_bits(bits).unwrap_or(AxisSet::NONE)
}
