//! What a simulation is, and what it sees.

use vimc4_device::{Device as _, SignalId, Time};

use crate::control::View;

use super::member::{Member, Seat};

/// What the controllers of a [`Group`](super::Group) drive: a plant of the user's own, which takes part in
/// their time.
///
/// It says when it does something by itself, and hears of every output that changes. Between these it
/// stands still: what it is at an instant has to follow from what it was at the last, as a temperature
/// follows from when the heater was switched on. If it is a value that can be copied, the group can be
/// rolled back with it.
pub trait Simulation {
    /// When it does something next; `None` if it waits for an output. Asked after everything that
    /// happens.
    fn due(&self) -> Option<Time>;

    /// That time has come. Afterwards it has to be due later, or not at all.
    fn act(&mut self, world: &mut World<'_>);

    /// An output port of a controller has changed, now.
    fn output(&mut self, _of: Member, _port: u16, _value: u8, _world: &mut World<'_>) {}
}

/// Nothing is driven.
impl Simulation for () {
    fn due(&self) -> Option<Time> {
        None
    }

    fn act(&mut self, _world: &mut World<'_>) {}
}

/// The controllers as a simulation sees them.
#[derive(Debug)]
pub struct World<'g> {
    pub(super) now: Time,
    pub(super) members: &'g [Seat],
    pub(super) set: Vec<(usize, SignalId, i32)>,
}

impl World<'_> {
    /// The present.
    #[must_use]
    pub fn now(&self) -> Time {
        self.now
    }

    /// The controllers, in the order in which they have joined.
    pub fn members(&self) -> impl Iterator<Item = Member> {
        (0..self.members.len()).map(Member)
    }

    /// A picture of a controller.
    #[must_use]
    pub fn view(&self, of: Member) -> View {
        self.members[of.0].harness.device().view(self.now)
    }

    /// The step counters of a controller's axes, X first.
    #[must_use]
    pub fn position(&self, of: Member) -> Vec<i64> {
        let view = self.view(of);
        view.axes.iter().map(|axis| axis.position).collect()
    }

    /// What an output port shows; `None` if there is none of this number.
    #[must_use]
    pub fn output(&self, of: Member, port: u16) -> Option<u8> {
        let view = self.view(of);
        view.ports.iter().find(|found| !found.input && found.port == port).map(|port| port.value)
    }

    /// Sets a signal of a controller when the simulation has done what it does. Returns whether there is
    /// one of this name.
    pub fn set(&mut self, of: Member, signal: &str, value: i32) -> bool {
        let signals = self.members[of.0].harness.device().signals();
        let found = signals.iter().find(|found| found.name == signal).map(|found| found.id);
        self.set.extend(found.map(|id| (of.0, id, value)));
        found.is_some()
    }
}
