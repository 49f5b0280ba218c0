//! What a simulation is, and what it sees.

use vimc4_device::{Device as _, Signal, SignalId, Time};

use crate::control::View;

use super::error::GroupError;
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

    /// That time has come. Afterwards it has to be due later, or not at all; one that acts a thousand times
    /// at an instant is an error.
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
    now: Time,
    members: &'g [Seat],
    set: Vec<(usize, SignalId, i32)>,
    failed: Option<GroupError>,
}

impl<'g> World<'g> {
    pub(super) fn new(now: Time, members: &'g [Seat]) -> World<'g> {
        World { now, members, set: Vec::new(), failed: None }
    }

    /// What was set.
    pub(super) fn end(self) -> Result<Vec<(usize, SignalId, i32)>, GroupError> {
        self.failed.map_or(Ok(self.set), Err)
    }
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

    /// What can be set at a controller.
    #[must_use]
    pub fn signals(&self, of: Member) -> Vec<Signal> {
        self.members[of.0].harness.device().signals()
    }

    /// Sets a signal of a controller when the simulation has done what it does. If there is none of this
    /// name, or it does not take this value, the simulation has [failed](World::fail).
    pub fn set(&mut self, of: Member, signal: &str, value: i32) {
        match self.members[of.0].setting(signal, value) {
            Ok(id) => self.set.push((of.0, id, value)),
            Err(error) => drop(self.failed.get_or_insert(error.into())),
        }
    }

    /// The simulation cannot go on. Nothing that it sets now is set, and time stands still: whoever lets it
    /// pass gets this as [`GroupError::Failed`].
    pub fn fail(&mut self, why: impl Into<String>) {
        self.failed.get_or_insert(GroupError::Failed { at: self.now, why: why.into() });
    }
}
