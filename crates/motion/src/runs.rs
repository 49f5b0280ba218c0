//! The way of one axis in runs: stretches in which it keeps its direction.
//!
//! What follows a motor with play, or comes to a stop, depends on every turn of its way and not only
//! on where that ends. Within a run all of it is monotone, so whoever goes along the runs needs no
//! single step. Of a circle there are four an around, and a circle may be gone round a million
//! times; but what follows it is as it was after a turn or two, and so the others are left out.

use std::ops::ControlFlow;

use crate::{Path, Point};

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

impl Path {
    /// Gives `visit` the runs of an axis up to clock step `k`, one after the other, until it breaks
    /// off, and with them the `state` that it has left. Turns of a circle that begin with the state
    /// with which the one before them began are left out: they would go like it.
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
}

/// What a point has for an axis.
pub(crate) fn place(point: &Point, axis: usize) -> i64 {
    point.get(axis).copied().unwrap_or(0)
}
