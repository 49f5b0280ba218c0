//! The way of one axis in runs: stretches in which it keeps its direction.
//!
//! What follows a motor with play, or comes to a stop, depends on every turn of its way and not
//! only on where that ends. Within a run all of it is monotone, so code that goes along the runs
//! needs no single step. A turn of a circle has four runs, and there may be a million turns. But
//! after a turn or two everything that follows the motor repeats, so the other turns are left out.

use crate::Point;

/// A stretch of a path in which an axis never changes its direction. It may rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// After how many clock steps of the path it begins.
    pub from: u64,
    /// After how many it ends.
    pub to: u64,
    /// The steps that the axis makes in it, with the sign of their direction.
    pub way: i64,
}

/// What a point has for an axis.
pub(crate) fn place(point: &Point, axis: usize) -> i64 {
    point.get(axis).copied().unwrap_or(0)
}
