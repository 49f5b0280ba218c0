//! Kept states, so that reaching a moment need not start from the beginning.

use vimc4_device::Time;

use crate::{Moment, Stretch};

/// The states of a branch at some of its moments, sparser the older they are. The first always
/// stays. With each goes what is known of the stretch from it to the next.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Snapshots<S> {
    /// Never empty.
    first: Kept<S>,
    later: Vec<Kept<S>>,
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
        Snapshots { first, later: Vec::new() }
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

    /// Adds a state after all others. Where there are more than `most`, every second one of the
    /// older half goes: what was kept at even distances ends up at distances that grow with age.
    pub(crate) fn push(&mut self, kept: Kept<S>, most: usize) {
        self.later.push(kept);
        if self.len() > most.max(2) {
            let half = self.later.len().div_ceil(2);
            let mut thinned: Vec<Kept<S>> = Vec::with_capacity(self.later.len());
            for (place, kept) in self.later.drain(..).enumerate() {
                if place < half && place % 2 == 0 {
                    let before = thinned.last_mut().unwrap_or(&mut self.first);
                    before.stretch.join(&kept.stretch);
                } else {
                    thinned.push(kept);
                }
            }
            self.later = thinned;
        }
    }

    /// The first for 0, then the later ones.
    fn nth(&self, number: usize) -> &Kept<S> {
        number.checked_sub(1).and_then(|place| self.later.get(place)).unwrap_or(&self.first)
    }
}
