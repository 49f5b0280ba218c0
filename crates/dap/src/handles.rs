//! Numbers by which a client speaks of things, for as long as a controller stays where it is.

use std::collections::BTreeMap;

/// The most things of a kind that have numbers at once.
const MOST: usize = 100_000;

/// The numbers of things of controllers.
#[derive(Clone, Debug)]
pub(crate) struct Handles<T> {
    last: i64,
    things: BTreeMap<i64, (usize, T)>,
    numbers: BTreeMap<(usize, T), i64>,
}

impl<T> Default for Handles<T> {
    fn default() -> Handles<T> {
        Handles { last: 0, things: BTreeMap::new(), numbers: BTreeMap::new() }
    }
}

impl<T: Ord + Clone> Handles<T> {
    /// The number of a thing of a controller, always the same. 0, which means none, where there are
    /// too many.
    pub(crate) fn number(&mut self, of: usize, thing: T) -> i64 {
        let thing = (of, thing);
        if let Some(number) = self.numbers.get(&thing) {
            return *number;
        }
        // Protocol and clients take numbers below 2^31.
        if self.things.len() >= MOST || self.last >= i64::from(i32::MAX) {
            return 0;
        }
        self.last += 1;
        self.things.insert(self.last, thing.clone());
        self.numbers.insert(thing, self.last);
        self.last
    }

    /// The thing of a number, and the controller it is of.
    pub(crate) fn get(&self, number: i64) -> Option<&(usize, T)> {
        self.things.get(&number)
    }

    /// A controller has moved: the numbers of its things end.
    pub(crate) fn forget(&mut self, of: usize) {
        self.things.retain(|_, (own, _)| *own != of);
        self.numbers.retain(|(own, _), _| *own != of);
    }
}
