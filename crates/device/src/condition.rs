//! Conditions that can be forecast.

use serde::{Deserialize, Serialize};

use crate::Point;

/// Something that can become true while a device runs by itself.
/// See [`Device::when`](crate::Device::when).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    /// The counter of an axis (0 for X) is at a position, in steps.
    AxisAt {
        /// The axis.
        axis: u8,
        /// The position.
        position: i64,
    },
    /// Any axis is outside a box, in steps; the limits themselves are inside.
    Outside {
        /// The lower limits.
        low: Point,
        /// The upper limits.
        high: Point,
    },
    /// A bit of a port, as the host would read it, has a level.
    PortBit {
        /// The port.
        port: u16,
        /// The bit, 0 to 7.
        bit: u8,
        /// The level.
        level: bool,
    },
    /// The device does nothing by itself: no command, no program, nothing moves.
    Idle,
}
