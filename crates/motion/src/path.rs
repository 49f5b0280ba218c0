//! Where the machine is after `k` steps.

use serde::{Deserialize, Serialize};

use crate::{Arc, Helix, Line};

/// How many axes a path can move: X, Y, Z, A in this order.
pub const AXES: usize = 4;

/// One number of steps per axis, X, Y, Z, A.
pub type Point = [i64; AXES];

/// A path in space, measured in steps of the step clock from its own start.
///
/// All points are offsets from the start of the path, so `at(0)` is always `[0; 4]`.
/// With every clock step each axis moves by at most one step.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Path {
    /// A straight line on any number of axes.
    Line(Line),
    /// A circular arc in a plane of two axes.
    Arc(Arc),
    /// A circular arc with a third axis that follows.
    Helix(Helix),
}

impl Path {
    /// The number of clock steps from start to end.
    #[must_use]
    pub fn length(&self) -> u64 {
        todo!()
    }

    /// The offset from the start after `k` clock steps; `k` beyond the end is the end.
    #[must_use]
    pub fn at(&self, _k: u64) -> Point {
        todo!()
    }

    /// The first clock step after which the offset of `axis` is `offset`, `None` if the path
    /// never gets there. 0 if `offset` is 0.
    #[must_use]
    pub fn first_at(&self, _axis: usize, _offset: i64) -> Option<u64> {
        todo!()
    }

    /// The smallest and the largest offset of every axis over the clock steps 0 to `k`.
    #[must_use]
    pub fn extent(&self, _k: u64) -> (Point, Point) {
        todo!()
    }

    /// What is left of this path after `k` clock steps, measured from there: for all `j`,
    /// `path.after(k).at(j) == path.at(k + j) - path.at(k)`.
    #[must_use]
    pub fn after(&self, _k: u64) -> Path {
        todo!()
    }

    /// Walks the path stepwise: yields the offset after clock steps 1, 2, 3 … up to the end.
    /// This is the definition that the closed forms are held against.
    #[must_use]
    pub fn steps(&self) -> PathSteps {
        todo!()
    }
}

/// Iterator over a path, one item a clock step. See [`Path::steps`].
#[derive(Clone, Debug)]
pub struct PathSteps {}

impl Iterator for PathSteps {
    type Item = Point;

    fn next(&mut self) -> Option<Point> {
        todo!()
    }
}
