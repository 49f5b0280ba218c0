//! Kept states, so that reaching a moment need not start from the beginning.

use vimc4_device::Time;

use crate::{Moment, Stretch};

/// The states of a branch at some of its moments, evenly spaced. The first always stays. With each
/// goes what is known of the stretch from it to the next.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Snapshots<S> {
    /// Never empty.
    first: Kept<S>,
    later: Vec<Kept<S>>,
    /// How often every second one has gone.
    thinned: u32,
}

/// A state, the moment it belongs to, and the stretch from there to the next.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Kept<S> {
    pub(crate) moment: Moment,
    pub(crate) state: S,
    pub(crate) stretch: Stretch,
}

impl<S> Snapshots<S> {
    /// With the first state of a branch.
    pub(crate) fn new(first: Kept<S>) -> Snapshots<S> {
        Snapshots { first, later: Vec::new(), thinned: 0 }
    }

    pub(crate) fn len(&self) -> usize {
        1 + self.later.len()
    }

    /// All of them, in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Kept<S>> {
        std::iter::once(&self.first).chain(&self.later)
    }

    pub(crate) fn first(&self) -> &Kept<S> {
        &self.first
    }

    pub(crate) fn last(&self) -> &Kept<S> {
        self.later.last().unwrap_or(&self.first)
    }

    /// What is known of the stretch after the last of them.
    pub(crate) fn open_stretch(&mut self) -> &mut Stretch {
        &mut self.later.last_mut().unwrap_or(&mut self.first).stretch
    }

    /// The last of them that is not after a moment; the first if all are.
    pub(crate) fn not_after(&self, moment: Moment) -> &Kept<S> {
        self.nth(self.later.partition_point(|kept| kept.moment <= moment))
    }

    /// The first of them that is after a moment.
    pub(crate) fn after(&self, moment: Moment) -> Option<&Kept<S>> {
        self.later.get(self.later.partition_point(|kept| kept.moment <= moment))
    }

    /// The last of them that is before a moment; the first if none is.
    pub(crate) fn before(&self, moment: Moment) -> &Kept<S> {
        self.nth(self.later.partition_point(|kept| kept.moment < moment))
    }

    /// The last of them whose time is before a time; the first if none is.
    pub(crate) fn earlier(&self, at: Time) -> &Kept<S> {
        self.nth(self.later.partition_point(|kept| kept.moment.at < at))
    }

    /// The number of acts between two of them that were so far apart at first.
    pub(crate) fn spacing(&self, first: u64) -> u64 {
        first.max(1).saturating_mul(1_u64.checked_shl(self.thinned).unwrap_or(u64::MAX))
    }

    /// Adds a state after all others. Where there are as many as may be, every second one goes.
    pub(crate) fn push(&mut self, kept: Kept<S>, most: usize) {
        if self.len() >= most.max(2) {
            let mut thinned: Vec<Kept<S>> = Vec::with_capacity(self.later.len());
            for (place, kept) in self.later.drain(..).enumerate() {
                if place % 2 == 0 {
                    let before = thinned.last_mut().unwrap_or(&mut self.first);
                    before.stretch.join(&kept.stretch);
                } else {
                    thinned.push(kept);
                }
            }
            self.later = thinned;
            self.thinned += 1;
        }
        self.later.push(kept);
    }

    /// Leaves those out that are after a moment. What the stretch before them had is not known any more, so it
    /// may have had all that it had with them.
    pub(crate) fn truncate(&mut self, last: Moment) {
        self.later.truncate(self.later.partition_point(|kept| kept.moment <= last));
    }

    /// The first for 0, then the later ones.
    fn nth(&self, number: usize) -> &Kept<S> {
        number.checked_sub(1).and_then(|place| self.later.get(place)).unwrap_or(&self.first)
    }
}
