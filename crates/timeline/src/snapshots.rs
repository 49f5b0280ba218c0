//! States that have been kept, so that nobody has to begin at the beginning.

use vimc4_device::Time;

use crate::Moment;

/// The states of a branch at some of its moments, the older the sparser. The first stays.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Snapshots<S> {
    first: (Moment, S),
    later: Vec<(Moment, S)>,
}

impl<S> Snapshots<S> {
    /// With the first state of a branch.
    pub(crate) fn new(moment: Moment, state: S) -> Snapshots<S> {
        Snapshots { first: (moment, state), later: Vec::new() }
    }

    pub(crate) fn len(&self) -> usize {
        1 + self.later.len()
    }

    pub(crate) fn first(&self) -> &(Moment, S) {
        &self.first
    }

    pub(crate) fn last(&self) -> &(Moment, S) {
        self.later.last().unwrap_or(&self.first)
    }

    /// The last of them that is not after a moment; the first if all are.
    pub(crate) fn not_after(&self, moment: Moment) -> &(Moment, S) {
        self.nth(self.later.partition_point(|(kept, _)| *kept <= moment))
    }

    /// The last of them that is before a moment; the first if none is.
    pub(crate) fn before(&self, moment: Moment) -> &(Moment, S) {
        self.nth(self.later.partition_point(|(kept, _)| *kept < moment))
    }

    /// The last of them whose time is before a time; the first if none is.
    pub(crate) fn earlier(&self, at: Time) -> &(Moment, S) {
        self.nth(self.later.partition_point(|(kept, _)| kept.at < at))
    }

    /// Keeps a state behind all others. Where there are more than `most`, every second one of the
    /// older half goes: what was kept at even distances ends up at distances that grow with age.
    pub(crate) fn push(&mut self, moment: Moment, state: S, most: usize) {
        self.later.push((moment, state));
        if self.len() > most.max(2) {
            let half = self.later.len().div_ceil(2);
            let mut place = 0;
            self.later.retain(|_| {
                place += 1;
                place > half || place % 2 == 0
            });
        }
    }

    /// The first for 0, then the later ones.
    fn nth(&self, number: usize) -> &(Moment, S) {
        number.checked_sub(1).and_then(|place| self.later.get(place)).unwrap_or(&self.first)
    }
}
