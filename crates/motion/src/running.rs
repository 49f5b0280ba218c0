//! A segment that runs: where it is, how fast, and when something about it will hold.

use crate::{Segment, Time};

/// A segment and the time at which it began.
#[derive(Clone, Copy, Debug)]
pub struct Running<'a> {
    /// Path and times.
    pub segment: &'a Segment,
    /// When it began.
    pub began: Time,
}

impl Running<'_> {
    /// How many clock steps have been made at a time.
    #[must_use]
    pub fn steps_at(&self, at: Time) -> u64 {
        self.segment.profile.steps_at(at.nanos_since(self.began))
    }

    /// The offset of an axis from the start, steps.
    #[must_use]
    pub fn offset(&self, axis: usize, at: Time) -> i64 {
        self.segment.offset_at(at.nanos_since(self.began))[axis]
    }

    /// An axis's share of the step frequency, µHz with the sign of its direction: the way it
    /// makes around this moment, over a hundred steps of the clock.
    #[must_use]
    pub fn speed(&self, axis: usize, at: Time) -> i64 {
        let nanos = at.nanos_since(self.began);
        let Segment { path, profile } = self.segment;
        let frequency = profile.speed_at(nanos);
        if frequency == 0 {
            return 0;
        }
        let step = profile.steps_at(nanos);
        let (from, to) = (step.saturating_sub(50), (step + 50).min(path.length()));
        let way = path.at(to)[axis] - path.at(from)[axis];
        let span = i128::from((to - from).max(1));
        i64::try_from(i128::from(frequency) * i128::from(way) / span).unwrap_or(0)
    }

    /// When it has been at every place that it will visit from `now` on; `None` if that is at its
    /// end.
    #[must_use]
    pub fn comes_round(&self, now: Time) -> Option<Time> {
        let Segment { path, profile } = self.segment;
        let step = self.steps_at(now);
        let last = step + path.after(step).new_places();
        (last < profile.steps()).then(|| self.began.after_nanos(profile.time_of(last)))
    }

    /// [`first_time`](Running::first_time) of what may be at rest, where every offset is 0.
    #[must_use]
    pub fn first_time_of(
        running: Option<Running<'_>>,
        axis: usize,
        now: Time,
        holds: impl Fn(i64) -> bool,
        candidates: impl IntoIterator<Item = i64>,
    ) -> Option<Time> {
        match running {
            Some(running) => running.first_time(axis, now, holds, candidates),
            None => holds(0).then_some(now),
        }
    }

    /// The first instant from `now` on at which the offset of an axis fulfils a predicate that
    /// can begin to hold at the `candidates` only; `None` if the segment ends before.
    #[must_use]
    pub fn first_time(
        &self,
        axis: usize,
        now: Time,
        holds: impl Fn(i64) -> bool,
        candidates: impl IntoIterator<Item = i64>,
    ) -> Option<Time> {
        let Segment { path, profile } = self.segment;
        let step = self.steps_at(now);
        let done = path.at(step)[axis];
        if holds(done) {
            return Some(now);
        }
        let rest = path.after(step);
        candidates
            .into_iter()
            .filter(|&offset| holds(offset))
            .filter_map(|offset| rest.first_at(axis, offset - done))
            .map(|k| step + k)
            .filter(|&k| k <= profile.steps())
            .map(|k| self.began.after_nanos(profile.time_of(k)))
            .min()
    }
}
