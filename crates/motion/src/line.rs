//! Straight lines: the longest axis makes a step with every clock step, the others follow.

use serde::{Deserialize, Serialize};

use crate::Point;

/// A straight line, possibly what is left of one.
///
/// At clock step `k` of `n` of the longest axis, an axis with `m` steps has made
/// `floor((2·k·m + n) / (2·n))` steps (Bresenham, rounding to nearest).
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Line {
    /// The whole line, signed steps per axis.
    delta: Point,
    /// How many clock steps of the whole line were already made before this path begins.
    done: u64,
}

impl Line {
    /// The line from the origin to `delta`. Magnitudes up to 2⁴⁰ are allowed; a line that long
    /// stands for "on and on" (a reference run whose switch is not connected).
    #[must_use]
    pub fn new(_delta: Point) -> Line {
        todo!()
    }
}
