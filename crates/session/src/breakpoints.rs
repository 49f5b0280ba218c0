//! The breakpoints of a running controller.

use vimc4_device::{Breakpoint, Condition, Device, Event, Kinds, Time};

use crate::{BreakpointId, Source};

/// A breakpoint of a running controller, as it stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BreakpointView {
    /// Its number.
    pub id: BreakpointId,
    /// The condition at which time is paused, whenever it becomes true.
    pub condition: Condition,
    /// How often that has been.
    pub met: u64,
}

/// What has been met in a moment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Met {
    /// The breakpoints.
    pub breakpoints: Vec<BreakpointId>,
    /// Whose [stop](Breakpoints::add_stop), if there was one.
    pub stop: Option<Source>,
}

impl Met {
    /// Whether nothing has been met.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.breakpoints.is_empty() && self.stop.is_none()
    }

    /// The source of the pause, and the breakpoints: a stop counts where no breakpoint was met.
    #[must_use]
    pub fn pause(self) -> (Option<Source>, Vec<BreakpointId>) {
        let Met { breakpoints, stop } = self;
        (stop.filter(|_| breakpoints.is_empty()), breakpoints)
    }
}

/// All breakpoints.
#[derive(Clone, Debug, Default)]
pub struct Breakpoints {
    placed: Vec<Placed>,
    /// The last number that one was given.
    last: u64,
    /// How many stops there have been.
    stops: u64,
}

#[derive(Clone, Debug)]
struct Placed {
    id: BreakpointId,
    breakpoint: Breakpoint,
    /// Whose stop it is, if it is no breakpoint that people know by its number.
    by: Option<Source>,
    /// When the device has to be looked at for it, if not before.
    at: Option<Time>,
}

impl Breakpoints {
    /// Adds one.
    pub fn add<D: Device>(&mut self, device: &D, condition: Condition) -> BreakpointId {
        self.last += 1;
        self.place(device, BreakpointId(self.last), condition, None)
    }

    /// Adds a stop on behalf of somebody who has breakpoints of their own, such as a debugger: it pauses
    /// time like a breakpoint, in the name of `by`, but it is not one of those that are listed, and
    /// takes none of their numbers.
    pub fn add_stop<D: Device>(
        &mut self,
        device: &D,
        condition: Condition,
        by: Source,
    ) -> BreakpointId {
        self.stops += 1;
        self.place(device, BreakpointId(u64::MAX - self.stops), condition, Some(by))
    }

    fn place<D: Device>(
        &mut self,
        device: &D,
        id: BreakpointId,
        condition: Condition,
        by: Option<Source>,
    ) -> BreakpointId {
        let breakpoint = Breakpoint::new(device, condition);
        let at = breakpoint.next(device);
        self.placed.push(Placed { id, breakpoint, by, at });
        id
    }

    /// Takes one away, and says whether it was there.
    pub fn remove(&mut self, id: BreakpointId) -> bool {
        let before = self.placed.len();
        self.placed.retain(|placed| placed.id != id);
        self.placed.len() < before
    }

    /// Takes all away.
    pub fn clear(&mut self) {
        self.placed.clear();
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// All of them, as they stand.
    #[must_use]
    pub fn views(&self) -> Vec<BreakpointView> {
        let view = |Placed { id, breakpoint, .. }: &Placed| BreakpointView {
            id: *id,
            condition: breakpoint.condition().clone(),
            met: breakpoint.met(),
        };
        self.placed.iter().filter(|placed| placed.by.is_none()).map(view).collect()
    }

    /// Which events they need to see.
    #[must_use]
    pub fn kinds(&self) -> Kinds {
        let kinds = self.placed.iter().map(|placed| placed.breakpoint.condition().kinds());
        kinds.fold(Kinds::NONE, Kinds::and)
    }

    /// When the device has to be looked at next.
    #[must_use]
    pub fn due(&self) -> Option<Time> {
        self.placed.iter().filter_map(|placed| placed.at).min()
    }

    /// Looks at the device in a moment with these events, and says which are met.
    pub fn look<'a, D: Device>(
        &mut self,
        device: &D,
        events: impl Iterator<Item = &'a Event> + Clone,
    ) -> Met {
        let mut met = Met::default();
        for Placed { id, breakpoint, by, at } in &mut self.placed {
            if breakpoint.look(device, events.clone()) {
                match by {
                    Some(by) => met.stop = met.stop.take().or_else(|| Some(by.clone())),
                    None => met.breakpoints.push(*id),
                }
            }
            *at = breakpoint.next(device);
        }
        met
    }

    /// The device goes on from another state.
    pub fn begin<D: Device>(&mut self, device: &D) {
        for Placed { breakpoint, at, .. } in &mut self.placed {
            breakpoint.begin(device);
            *at = breakpoint.next(device);
        }
    }
}
