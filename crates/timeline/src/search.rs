//! What is looked for in a history.

use std::collections::VecDeque;
use std::ops::ControlFlow;

use vimc4_device::{Beginnings, Condition, Device, Output, Time};

use crate::{Act, Stretch};

/// Something that can be found in a history: an act, or an instant between two.
///
/// It is asked about the moments of one stretch after the other, each from its first moment to its
/// last.
pub trait Sought<D: Device> {
    /// Whether it can be in a stretch of which so much is known; if not, it is not asked about it.
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        let _ = stretch;
        true
    }

    /// It is asked from this moment on, which is not asked about itself. Nothing is known of what
    /// was before.
    fn begin(&mut self, device: &D) {
        let _ = device;
    }

    /// Nothing happens from the device's present on until the next act, or until it is asked no
    /// further. Whether it is at an instant after the present and before `until`: the first or the
    /// last one.
    fn between(&mut self, device: &D, until: Time, which: Which) -> Option<Time> {
        let _ = (device, until, which);
        None
    }

    /// Up to when the last question was looked into, if not as far as it was asked: a motion can have
    /// millions of instants to be looked at, and somebody may not want to wait for it. It is asked on from
    /// there.
    fn looked_until(&mut self) -> Option<Time> {
        None
    }

    /// Whether it is where the device has come to by an act, with what came out by it.
    fn after(&mut self, device: &D, act: Act, outputs: &VecDeque<Output>) -> bool;

    /// Whether it is at the beginning of everything, where no act leads.
    fn at_the_beginning(&mut self, device: &D) -> bool {
        let _ = device;
        false
    }
}

/// Which of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The first.
    First,
    /// The last.
    Last,
}

/// How a search has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// It is found, and the present is there.
    Here,
    /// It is not to be found.
    Nowhere,
    /// The search was given up.
    GivenUp,
}

/// Is asked every now and then, with the time that a search has come to, whether to go on.
pub type Progress<'p> = dyn FnMut(Time) -> ControlFlow<()> + 'p;

/// So many acts are between two questions whether to go on: far less than 50 ms, also where much is to
/// be looked at between any two of them.
pub(crate) const ACTS_BETWEEN: u64 = 16;

/// The instants at which a condition begins to hold, and the happenings in it.
#[derive(Clone, Debug)]
pub struct Begins<'c> {
    condition: &'c Condition,
    holds: bool,
}

impl<'c> Begins<'c> {
    /// Those of a condition. The kinds of its events are to be watched.
    #[must_use]
    pub fn new(condition: &'c Condition) -> Begins<'c> {
        Begins { condition, holds: false }
    }

    fn holds_by_itself<D: Device>(&self, device: &D) -> bool {
        device.crossing(self.condition) == Some(device.now())
    }
}

impl<D: Device> Sought<D> for Begins<'_> {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        stretch.can_meet(self.condition)
    }

    fn begin(&mut self, device: &D) {
        self.holds = self.holds_by_itself(device);
    }

    fn between(&mut self, device: &D, until: Time, which: Which) -> Option<Time> {
        let mut beginnings = Beginnings::new(device, self.condition, self.holds, until);
        let found = match which {
            Which::First => beginnings.next(),
            Which::Last => beginnings.by_ref().last(),
        };
        self.holds = beginnings.holds();
        found
    }

    fn after(&mut self, device: &D, _: Act, outputs: &VecDeque<Output>) -> bool {
        let before = self.holds;
        self.holds = self.holds_by_itself(device);
        let happened = || {
            let events = outputs.iter().filter_map(Output::event);
            self.condition.has_happenings() && device.holds(self.condition, events)
        };
        !before && (self.holds || happened())
    }
}

/// What a closure says of an act.
pub(crate) struct ByAct<F>(pub(crate) F);

impl<D: Device, F: FnMut(&D, Option<Act>, &VecDeque<Output>) -> bool> Sought<D> for ByAct<F> {
    fn after(&mut self, device: &D, act: Act, outputs: &VecDeque<Output>) -> bool {
        self.0(device, Some(act), outputs)
    }

    fn at_the_beginning(&mut self, device: &D) -> bool {
        self.0(device, None, &VecDeque::new())
    }
}
