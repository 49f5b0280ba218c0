//! Searches in a history.

use std::collections::VecDeque;
use std::ops::ControlFlow;

use vimc4_device::{Beginnings, Condition, Device, Output, Time};

use crate::{Act, Stretch};

/// Something that can be found in a history: an act, or an instant between two.
///
/// It is asked about one stretch after the other, and within each about the moments from first to
/// last.
pub trait Sought<D: Device> {
    /// Whether the stretch can contain it, by what is known of the stretch; if not, the stretch is
    /// skipped.
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        let _ = stretch;
        true
    }

    /// The questions begin after this moment. Nothing is known of what was before it.
    fn begin(&mut self, device: &D) {
        let _ = device;
    }

    /// Looks for the first or the last instant after the device's present and before `until`. No
    /// act happens in between.
    fn between(&mut self, device: &D, until: Time, which: Which) -> Option<Time> {
        let _ = (device, until, which);
        None
    }

    /// How far the last question was answered, if not to its end: a motion can have millions of
    /// instants to look at, and the user may not want to wait. The next question begins there.
    fn looked_until(&mut self) -> Option<Time> {
        None
    }

    /// Whether it is at the moment just after an act, given what came out by that act.
    fn after(&mut self, device: &D, act: Act, outputs: &VecDeque<Output>) -> bool;

    /// Whether it is at the very beginning, where there was no act.
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
    /// It was found, and the present is there.
    Here,
    /// There is none.
    Nowhere,
    /// The search was given up.
    GivenUp,
}

/// Asked now and then, with the time that a search has reached, whether to go on.
pub type Progress<'p> = dyn FnMut(Time) -> ControlFlow<()> + 'p;

/// The number of acts between two questions whether to go on: far less than 50 ms, even where there
/// is much to look at between two acts.
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

/// A search by a closure over acts.
pub(crate) struct ByAct<F>(pub(crate) F);

impl<D: Device, F: FnMut(&D, Option<Act>, &VecDeque<Output>) -> bool> Sought<D> for ByAct<F> {
    fn after(&mut self, device: &D, act: Act, outputs: &VecDeque<Output>) -> bool {
        self.0(device, Some(act), outputs)
    }

    fn at_the_beginning(&mut self, device: &D) -> bool {
        self.0(device, None, &VecDeque::new())
    }
}
