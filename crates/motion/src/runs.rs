//! The way of one axis in runs: stretches in which it keeps its direction.
//!
//! What follows a motor with play, or comes to a stop, depends on every turn of its way and not only
//! on where that ends. Within a run all of it is monotone, so code that goes along the runs needs no
//! single step. Of a circle there are four an around, and a circle may be gone round a million
//! times; but what follows it is as it was after a turn or two, and so the others are left out.

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
