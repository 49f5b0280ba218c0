//! Where the machine is after `k` steps, on one path or on several one after the other.

use std::ops::ControlFlow;
use std::sync::Arc as Shared;

use serde::{Deserialize, Serialize};

use crate::arc::ArcWalk;
use crate::helix::HelixWalk;
use crate::line::LineWalk;
use crate::phase::Share;
use crate::runs::{Run, place};
use crate::{AXES, Arc, ArcState, Helix, Point, StraightLine};

/// A path in space, measured in steps of the step clock from its own start.
///
/// All points are offsets from the start of the path, so `at(0)` is always zero.
/// With every clock step each axis moves by at most one step.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Path {
    /// A straight line on any number of axes.
    Line(StraightLine),
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

    /// After how many clock steps at the latest it has been at every place that it visits: of an
    /// arc that is longer than its circle those of the first turn.
    #[must_use]
    pub fn new_places(&self) -> u64 {
        match self {
            Path::Arc(arc) => arc.new_places(),
            other => other.length(),
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

    /// Gives `visit` the runs of an axis up to clock step `k`, one after the other, until it
    /// breaks, and with them the `state` that it has left. Turns of a circle that begin with the
    /// state with which the one before them began are left out: they would go like it.
    pub fn runs<S: Clone + PartialEq, B>(
        &self,
        axis: usize,
        k: u64,
        state: &mut S,
        visit: &mut impl FnMut(&mut S, Run) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let k = k.min(self.length());
        match self {
            Path::Line(line) => {
                let way = place(&line.at(k), axis);
                visit(state, Run { from: 0, to: k, way })
            }
            Path::Arc(arc) => arc.runs(axis, k, state, visit),
            Path::Helix(helix) => helix.runs(axis, k, state, visit),
            Path::Chain(chain) => chain.runs(axis, k, state, visit),
        }
    }

    /// The parts in which the share of an axis stays the same. On a circle it does not; there an axis
    /// has places at which it makes every step, and that counts.
    pub(crate) fn shares(&self, axis: usize) -> Vec<Share> {
        let to = self.length();
        let whole = |(steps, of)| vec![Share { to, steps, of }];
        match self {
            Path::Line(line) => whole(line.share(axis)),
            Path::Arc(arc) => whole((u64::from(arc.moves(axis)), 1)),
            Path::Helix(helix) => whole(helix.share(axis)),
            Path::Chain(chain) => chain.shares(axis),
        }
    }

    /// The path in which clock step `k + 1` is made, and the clock steps made in it before: of a chain a
    /// link, else the path itself.
    #[must_use]
    pub fn link_at(&self, k: u64) -> (&Path, u64) {
        match self {
            Path::Chain(chain) => match chain.link_at(k) {
                Some(link) => (&link.path, k - link.before),
                None => (self, k),
            },
            _ => (self, k),
        }
    }

    /// Of an arc and a helix: the axes of the plane, and the registers of the circle engine after `k`
    /// clock steps. `None` of lines and chains.
    #[must_use]
    pub fn circle_at(&self, k: u64) -> Option<((usize, usize), ArcState)> {
        match self {
            Path::Arc(arc) => Some((arc.plane(), arc.state_at(k))),
            Path::Helix(helix) => Some(helix.circle_at(k.min(helix.length()))),
            Path::Line(_) | Path::Chain(_) => None,
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

/// Paths made one after the other as one: each link begins where the one before it ends.
///
/// The links are shared: a clone costs nothing.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "Vec<Path>", into = "Vec<Path>")]
pub struct Chain {
    links: Shared<[ChainLink]>,
}

/// A path and where in the chain it is.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct ChainLink {
    path: Path,
    /// Clock steps of the chain before it.
    before: u64,
    /// Where it begins, from the start of the chain.
    start: Point,
}

impl ChainLink {
    /// Clock steps of the chain up to its end.
    fn end(&self) -> u64 {
        self.before + self.path.length()
    }
}

impl Chain {
    /// The chain of `links`. Those without a step are left out, and for a chain its links are
    /// taken, so that chains that move alike link by link are equal. There may be as many as
    /// memory holds; together they are to have less than 2⁶³ steps.
    #[must_use]
    pub fn new(links: impl IntoIterator<Item = Path>) -> Chain {
        let (mut before, mut start) = (0, [0; AXES]);
        let placed = links.into_iter().flat_map(flattened).map(|path| {
            let (length, here) = (path.length(), start);
            start = moved(start, path.at(length));
            let link = ChainLink { path, before, start: here };
            before += length;
            link
        });
        Chain { links: placed.collect() }
    }

    /// Its links, each with the number of clock steps before it.
    pub fn links(&self) -> impl ExactSizeIterator<Item = (u64, &Path)> {
        self.links.iter().map(|link| (link.before, &link.path))
    }

    /// The link in which clock step `k + 1` is made, or the last; `None` in an empty chain.
    fn link_at(&self, k: u64) -> Option<&ChainLink> {
        let next = self.links.partition_point(|link| link.before <= k);
        self.links.get(next.saturating_sub(1))
    }

    pub(crate) fn length(&self) -> u64 {
        self.links.last().map_or(0, ChainLink::end)
    }

    pub(crate) fn at(&self, k: u64) -> Point {
        self.link_at(k).map_or([0; AXES], |link| moved(link.start, link.path.at(k - link.before)))
    }

    /// A link in which the offset is reached at its start was not the first.
    fn first_at(&self, axis: usize, offset: i64) -> Option<u64> {
        self.links.iter().find_map(|link| {
            let ahead = offset.checked_sub(*link.start.get(axis)?)?;
            Some(link.before + link.path.first_at(axis, ahead)?)
        })
    }

    fn extent(&self, k: u64) -> (Point, Point) {
        let walked = self.links.iter().take_while(|link| link.before < k);
        walked.fold(([0; AXES], [0; AXES]), |(low, high), link| {
            let (link_low, link_high) = link.path.extent(k - link.before);
            let (link_low, link_high) = (moved(link.start, link_low), moved(link.start, link_high));
            (
                std::array::from_fn(|axis| low[axis].min(link_low[axis])),
                std::array::from_fn(|axis| high[axis].max(link_high[axis])),
            )
        })
    }

    fn travel(&self, k: u64) -> Point {
        let walked = self.links.iter().take_while(|link| link.before < k);
        walked.fold([0; AXES], |sum, link| moved(sum, link.path.travel(k - link.before)))
    }

    /// See [`Path::runs`].
    pub(crate) fn runs<S: Clone + PartialEq, B>(
        &self,
        axis: usize,
        k: u64,
        state: &mut S,
        visit: &mut impl FnMut(&mut S, Run) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        for link in self.links.iter().take_while(|link| link.before < k) {
            let later = |Run { from, to, way }: Run| Run {
                from: link.before + from,
                to: link.before + to,
                way,
            };
            let mut visit = |state: &mut S, run: Run| visit(state, later(run));
            // A chain has no chains for links.
            match &link.path {
                Path::Line(line) => {
                    let to = (k - link.before).min(line.length());
                    visit(state, Run { from: 0, to, way: place(&line.at(to), axis) })?;
                }
                Path::Arc(arc) => arc.runs(axis, k - link.before, state, &mut visit)?,
                Path::Helix(helix) => {
                    let k = (k - link.before).min(helix.length());
                    helix.runs(axis, k, state, &mut visit)?;
                }
                Path::Chain(_) => {}
            }
        }
        ControlFlow::Continue(())
    }

    /// See [`Path::shares`].
    pub(crate) fn shares(&self, axis: usize) -> Vec<Share> {
        let within = |link: &ChainLink| {
            let before = link.before;
            let shares = link.path.shares(axis).into_iter();
            shares.map(move |share| Share { to: before + share.to, ..share })
        };
        self.links.iter().flat_map(within).collect()
    }

    fn after(&self, k: u64) -> Chain {
        let ahead = self.links.iter().filter(|link| link.end() > k);
        Chain::new(ahead.map(|link| link.path.after(k.saturating_sub(link.before))))
    }

    fn walk(&self) -> ChainWalk {
        let links = Shared::clone(&self.links);
        ChainWalk { links, next: 0, start: [0; AXES], steps: None }
    }
}

impl From<Vec<Path>> for Chain {
    fn from(links: Vec<Path>) -> Chain {
        Chain::new(links)
    }
}

impl From<Chain> for Vec<Path> {
    fn from(chain: Chain) -> Vec<Path> {
        chain.links.iter().map(|link| link.path.clone()).collect()
    }
}

/// A path as links: none if it has no steps, its own if it is a chain.
fn flattened(path: Path) -> Vec<Path> {
    match path {
        Path::Chain(chain) => chain.into(),
        path if path.length() == 0 => Vec::new(),
        path => vec![path],
    }
}

fn moved(start: Point, by: Point) -> Point {
    std::array::from_fn(|axis| start[axis] + by[axis])
}

/// A chain as a step interrupt makes it: link by link.
#[derive(Clone, Debug)]
struct ChainWalk {
    links: Shared<[ChainLink]>,
    /// The index of the next link.
    next: usize,
    /// Where the link that is being walked begins.
    start: Point,
    /// What is left of it.
    steps: Option<PathSteps>,
}

impl ChainWalk {
    /// The place after the next clock step, `None` at the end.
    fn tick(&mut self) -> Option<Point> {
        loop {
            if let Some(place) = self.steps.as_mut().and_then(PathSteps::next) {
                return Some(moved(self.start, place));
            }
            let link = self.links.get(self.next)?;
            self.next += 1;
            self.start = link.start;
            self.steps = Some(link.path.steps());
        }
    }
}
