//! Several paths one after the other.

use std::sync::Arc as Shared;

use serde::{Deserialize, Serialize};

use crate::{AXES, Path, PathSteps, Point};

/// Paths made one after the other as one: each link begins where the one before it ends.
///
/// The links are shared: a clone costs nothing.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "Vec<Path>", into = "Vec<Path>")]
pub struct Chain {
    links: Shared<[Link]>,
}

/// A path and where in the chain it is.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Link {
    path: Path,
    /// Clock steps of the chain before it.
    before: u64,
    /// Where it begins, from the start of the chain.
    start: Point,
}

impl Link {
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
            let link = Link { path, before, start: here };
            before += length;
            link
        });
        Chain { links: placed.collect() }
    }

    /// The link in which clock step `k + 1` is made, or the last; `None` in an empty chain.
    fn link_at(&self, k: u64) -> Option<&Link> {
        let next = self.links.partition_point(|link| link.before <= k);
        self.links.get(next.saturating_sub(1))
    }

    pub(crate) fn length(&self) -> u64 {
        self.links.last().map_or(0, Link::end)
    }

    pub(crate) fn at(&self, k: u64) -> Point {
        self.link_at(k).map_or([0; AXES], |link| moved(link.start, link.path.at(k - link.before)))
    }

    /// A link in which the offset is reached at its start was not the first.
    pub(crate) fn first_at(&self, axis: usize, offset: i64) -> Option<u64> {
        self.links.iter().find_map(|link| {
            let ahead = offset.checked_sub(*link.start.get(axis)?)?;
            Some(link.before + link.path.first_at(axis, ahead)?)
        })
    }

    pub(crate) fn extent(&self, k: u64) -> (Point, Point) {
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

    pub(crate) fn travel(&self, k: u64) -> Point {
        let walked = self.links.iter().take_while(|link| link.before < k);
        walked.fold([0; AXES], |sum, link| moved(sum, link.path.travel(k - link.before)))
    }

    pub(crate) fn after(&self, k: u64) -> Chain {
        let ahead = self.links.iter().filter(|link| link.end() > k);
        Chain::new(ahead.map(|link| link.path.after(k.saturating_sub(link.before))))
    }

    pub(crate) fn walk(&self) -> ChainWalk {
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
pub(crate) struct ChainWalk {
    links: Shared<[Link]>,
    /// The index of the next link.
    next: usize,
    /// Where the link that is being walked begins.
    start: Point,
    /// What is left of it.
    steps: Option<PathSteps>,
}

impl ChainWalk {
    /// The place after the next clock step, `None` at the end.
    pub(crate) fn tick(&mut self) -> Option<Point> {
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
