//! States on the ways that were gone last, so that the next step there is short.

use std::collections::{BTreeMap, VecDeque};

use vimc4_device::Time;

use crate::{BranchId, Moment, Place};

/// States at moments that were passed lately, on any branch. Snapshots bound how far any moment is
/// from a known state; who goes step by step through one stretch would replay it each time, and here
/// finds a state nearby from the second step on. The oldest give way, so the number is bounded.
#[derive(Clone, Debug)]
pub(crate) struct Waypoints<S> {
    states: BTreeMap<(BranchId, Moment), Waypoint<S>>,
    /// The moments in the order in which they were passed.
    passed: VecDeque<(BranchId, Moment)>,
}

/// A state, and how many acts lie between it and the last snapshot before it.
#[derive(Clone, Debug)]
pub(crate) struct Waypoint<S> {
    pub(crate) state: S,
    pub(crate) since: u64,
}

impl<S> Waypoints<S> {
    pub(crate) fn new() -> Waypoints<S> {
        Waypoints { states: BTreeMap::new(), passed: VecDeque::new() }
    }

    pub(crate) fn len(&self) -> usize {
        self.states.len()
    }

    pub(crate) fn get(&self, place: Place) -> Option<&Waypoint<S>> {
        self.states.get(&(place.branch, place.moment))
    }

    /// Adds the state at a place, unless it is known. There are no more than `most`.
    pub(crate) fn pass(
        &mut self,
        place: Place,
        most: usize,
        waypoint: impl FnOnce() -> Waypoint<S>,
    ) {
        let key = (place.branch, place.moment);
        if most == 0 || self.states.contains_key(&key) {
            return;
        }
        while self.passed.len() >= most
            && let Some(oldest) = self.passed.pop_front()
        {
            self.states.remove(&oldest);
        }
        self.passed.push_back(key);
        self.states.insert(key, waypoint());
    }

    /// Leaves those out that are after a place on its branch.
    pub(crate) fn forget_beyond(&mut self, Place { branch, moment }: Place) {
        let is_kept = |own: &(BranchId, Moment)| own.0 != branch || own.1 <= moment;
        self.states.retain(|own, _| is_kept(own));
        self.passed.retain(is_kept);
    }

    /// The last of them from a moment on that is not after another of the same branch.
    pub(crate) fn not_after(&self, branch: BranchId, from: Moment, last: Moment) -> Option<Moment> {
        self.states.range((branch, from)..=(branch, last)).next_back().map(|((_, at), _)| *at)
    }

    /// The last of them from a moment on that is before another.
    pub(crate) fn before(&self, branch: BranchId, from: Moment, end: Moment) -> Option<Moment> {
        self.states.range((branch, from)..(branch, end)).next_back().map(|((_, at), _)| *at)
    }

    /// The last of them from a moment on whose time is before a time.
    pub(crate) fn earlier(&self, branch: BranchId, from: Moment, at: Time) -> Option<Moment> {
        let ahead = self.states.range((branch, from)..).map(|((branch, at), _)| (*branch, *at));
        ahead.take_while(|(own, moment)| *own == branch && moment.at < at).last().map(|(_, at)| at)
    }
}
