//! Where the machine is after `k` steps.

use serde::{Deserialize, Serialize};

use crate::arc::ArcWalk;
use crate::chain::ChainWalk;
use crate::helix::HelixWalk;
use crate::line::LineWalk;
use crate::{Arc, Chain, Helix, Line};

/// How many axes a path can move. Isel's are X, Y, Z, A, LPKF's X, Y, Z0 to Z3, in this order.
pub const AXES: usize = 6;

/// One number of steps per axis.
pub type Point = [i64; AXES];

/// A path in space, measured in steps of the step clock from its own start.
///
/// All points are offsets from the start of the path, so `at(0)` is always zero.
/// With every clock step each axis moves by at most one step.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Path {
    /// A straight line on any number of axes.
    Line(Line),
    /// A circular arc in a plane of two axes.
    Arc(Arc),
    /// A circular arc with a third axis that follows.
    Helix(Helix),
    /// Paths of any kind, one after the other.
    Chain(Chain),
}

impl Path {
    /// The number of clock steps from start to end.
    #[must_use]
    pub fn length(&self) -> u64 {
        match self {
            Path::Line(line) => line.length(),
            Path::Arc(arc) => arc.length(),
            Path::Helix(helix) => helix.length(),
            Path::Chain(chain) => chain.length(),
        }
    }

    /// The offset from the start after `k` clock steps; `k` beyond the end is the end.
    #[must_use]
    pub fn at(&self, k: u64) -> Point {
        let k = k.min(self.length());
        match self {
            Path::Line(line) => line.at(k),
            Path::Arc(arc) => arc.at(k),
            Path::Helix(helix) => helix.at(k),
            Path::Chain(chain) => chain.at(k),
        }
    }

    /// The first clock step after which the offset of `axis` is `offset`, `None` if the path
    /// never gets there. 0 if `offset` is 0.
    #[must_use]
    pub fn first_at(&self, axis: usize, offset: i64) -> Option<u64> {
        if offset == 0 {
            return Some(0);
        }
        match self {
            Path::Line(line) => line.first_at(axis, offset),
            Path::Arc(arc) => arc.first_at(axis, offset),
            Path::Helix(helix) => helix.first_at(axis, offset),
            Path::Chain(chain) => chain.first_at(axis, offset),
        }
    }

    /// The smallest and the largest offset of every axis over the clock steps 0 to `k`.
    #[must_use]
    pub fn extent(&self, k: u64) -> (Point, Point) {
        let k = k.min(self.length());
        match self {
            Path::Line(line) => line.extent(k),
            Path::Arc(arc) => arc.extent(k),
            Path::Helix(helix) => helix.extent(k),
            Path::Chain(chain) => chain.extent(k),
        }
    }

    /// The number of steps each axis makes in the clock steps 0 to `k`, forth and back alike.
    #[must_use]
    pub fn travel(&self, k: u64) -> Point {
        let k = k.min(self.length());
        match self {
            Path::Line(line) => line.at(k).map(i64::abs),
            Path::Arc(arc) => arc.travel(k),
            Path::Helix(helix) => helix.travel(k),
            Path::Chain(chain) => chain.travel(k),
        }
    }

    /// What is left of this path after `k` clock steps, measured from there: for all `j`,
    /// `path.after(k).at(j) == path.at(k + j) - path.at(k)`.
    #[must_use]
    pub fn after(&self, k: u64) -> Path {
        let k = k.min(self.length());
        match self {
            Path::Line(line) => Path::Line(line.after(k)),
            Path::Arc(arc) => Path::Arc(arc.after(k)),
            Path::Helix(helix) => Path::Helix(helix.after(k)),
            Path::Chain(chain) => Path::Chain(chain.after(k)),
        }
    }

    /// Walks the path stepwise: yields the offset after clock steps 1, 2, 3 … up to the end.
    /// This is the definition that the closed forms are held against.
    #[must_use]
    pub fn steps(&self) -> PathSteps {
        let walk = match self {
            Path::Line(line) => Walk::Line(line.walk()),
            Path::Arc(arc) => Walk::Arc(arc.walk()),
            Path::Helix(helix) => Walk::Helix(helix.walk()),
            Path::Chain(chain) => Walk::Chain(Box::new(chain.walk())),
        };
        PathSteps { left: self.length(), point: [0; AXES], walk }
    }
}

/// Iterator over a path, one item a clock step. See [`Path::steps`].
#[derive(Clone, Debug)]
pub struct PathSteps {
    left: u64,
    point: Point,
    walk: Walk,
}

/// What a step interrupt keeps between two steps.
#[derive(Clone, Debug)]
enum Walk {
    Line(LineWalk),
    Arc(ArcWalk),
    Helix(HelixWalk),
    /// In a box, because a chain contains a walk in turn.
    Chain(Box<ChainWalk>),
}

impl Iterator for PathSteps {
    type Item = Point;

    // In the loop of the caller the walk stays in registers, which makes it twice as fast.
    #[inline(always)]
    fn next(&mut self) -> Option<Point> {
        self.left = self.left.checked_sub(1)?;
        let point = match &mut self.walk {
            Walk::Line(line) => line.tick(self.point),
            Walk::Arc(arc) => {
                arc.tick(&mut self.point);
                self.point
            }
            Walk::Helix(helix) => {
                helix.tick(&mut self.point);
                self.point
            }
            Walk::Chain(chain) => chain.tick()?,
        };
        self.point = point;
        Some(point)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        usize::try_from(self.left).map_or((usize::MAX, None), |left| (left, Some(left)))
    }
}
