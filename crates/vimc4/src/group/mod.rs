//! Several controllers in one time.
//!
//! Nothing here knows a clock, a thread or a file.

mod error;
mod member;
mod world;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use vimc4_catalogue::{Controller, Machine, Model, State};
use vimc4_device::{
    Condition, Device as _, Event, Harness, Input, Kinds, MAX_CAUSES, Output, SignalId, Time,
};

use crate::control::View;

pub use error::GroupError;
pub use member::Member;
pub use world::{Simulation, World};

use member::Seat;

/// Several controllers, and a simulation of what they drive, in one time.
///
/// Time passes only when it is told to, and for all together: the earliest of all that will happen
/// happens next, and at the same instant whoever joined first; the simulation comes last. Outputs can be
/// [wired](Group::wire) to inputs, and what a controller puts out arrives at the same instant. A group
/// can be copied; its [state](Group::state) can be taken and restored, so that a simulation can try a step
/// and roll it back.
///
/// ```
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// use vimc4::Group;
///
/// let (model, machine) = (vimc4::model("imc-s8")?, vimc4::machine("bench")?);
/// let mut group = Group::new();
/// let feeder = group.join(&model, &machine)?;
/// let mill = group.join(&model, &machine)?;
/// // Output 1 of the feeder is input 1 of the mill.
/// group.wire((feeder, 0, 0), (mill, "input 0.0"))?;
///
/// group.send(feeder, b"@01\r@0A400,400\r@0B0,1\r")?;
/// group.run_until_idle()?;
/// group.send(mill, b"@0b0\r")?;
/// assert_eq!(group.take_bytes(mill), b"001");
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Group<S = ()> {
    now: Time,
    members: Vec<Seat>,
    profiles: Vec<(Model, Arc<Machine>)>,
    wires: Vec<Wire>,
    simulation: S,
    /// How often the simulation has acted at an instant.
    acts: (Time, u32),
}

/// So often a simulation acts at one instant. One that is always due would never let time go on.
const MOST_AT_ONCE: u32 = 1_000;

/// An output bit that drives a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Wire {
    from: usize,
    port: u16,
    bit: u8,
    to: usize,
    signal: SignalId,
}

/// Everything that decides what a group will do.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupState<S = ()> {
    profiles: Vec<(Model, Arc<Machine>)>,
    now: Time,
    members: Vec<State>,
    simulation: S,
}

impl<S> GroupState<S> {
    /// The instant at which it was taken.
    #[must_use]
    pub fn now(&self) -> Time {
        self.now
    }
}

/// Who does something next.
#[derive(Clone, Copy)]
enum Who {
    Member(usize),
    Simulation,
}

impl Group {
    /// Nobody yet.
    #[must_use]
    pub fn new() -> Group {
        Group::with(())
    }
}

impl Default for Group {
    fn default() -> Group {
        Group::new()
    }
}

impl<S: Simulation> Group<S> {
    /// Nobody yet, around a simulation.
    #[must_use]
    pub fn with(simulation: S) -> Group<S> {
        Group {
            now: Time::ZERO,
            members: Vec::new(),
            profiles: Vec::new(),
            wires: Vec::new(),
            simulation,
            acts: (Time::ZERO, 0),
        }
    }

    /// A controller joins, which has just been switched on. It is as if it had been switched on at the
    /// beginning of the group's time.
    ///
    /// # Errors
    ///
    /// If the simulation fails when it hears of its outputs. It has not joined then.
    pub fn join(&mut self, model: &Model, machine: &Arc<Machine>) -> Result<Member, GroupError> {
        self.join_watched(model, machine, Kinds::NONE)
    }

    /// The same for one whose events of these kinds are kept, for
    /// [`take_outputs`](Group::take_outputs).
    ///
    /// # Errors
    ///
    /// If the simulation fails when it hears of its outputs. It has not joined then.
    pub fn join_watched(
        &mut self,
        model: &Model,
        machine: &Arc<Machine>,
        kept: Kinds,
    ) -> Result<Member, GroupError> {
        let controller = Controller::new(model, Arc::clone(machine), &[])?;
        let mut harness = Harness::new(controller).watching(kept.and(Kinds::PORT));
        harness.run_to(self.now);
        let place = self.members.len();
        self.members.push(Seat { harness, kept, outputs: VecDeque::new() });
        self.profiles.push((model.clone(), Arc::clone(machine)));
        self.exchange().inspect_err(|_| {
            self.members.truncate(place);
            self.profiles.truncate(place);
        })?;
        Ok(Member(place))
    }

    /// Leads an output of one controller, a port and its bit, to a signal of the same or another one. The
    /// signal has the value of the bit from now on.
    ///
    /// # Errors
    ///
    /// If there is no such output or signal.
    pub fn wire(
        &mut self,
        (from, port, bit): (Member, u16, u8),
        (to, signal): (Member, &str),
    ) -> Result<(), GroupError> {
        let view = self.view(from);
        let outputs = || view.ports.iter().filter(|port| !port.input);
        let Some(output) = outputs().find(|output| output.port == port).filter(|_| bit < 8) else {
            let known: Vec<String> = outputs().map(|port| port.port.to_string()).collect();
            let (model, known) = (view.model.clone(), known.join(", "));
            return Err(GroupError::NoOutput { model, port, bit, known });
        };
        let level = i32::from(output.value >> bit & 1);
        let signal = self.members[to.0].setting(signal, level)?;
        self.wires.push(Wire { from: from.0, port, bit, to: to.0, signal });
        self.give(to.0, Input::Signal(signal, level));
        self.exchange()?;
        self.run_to(self.now)
    }

    // --- what goes in ---

    /// Bytes arrive at a controller's line, now.
    ///
    /// # Errors
    ///
    /// If what follows at this instant does not end.
    pub fn send(&mut self, member: Member, bytes: &[u8]) -> Result<(), GroupError> {
        self.input(member, Input::Bytes(bytes))
    }

    /// A signal of a controller takes a value, now.
    ///
    /// # Errors
    ///
    /// If there is no such signal, or it does not take this value, or what follows at this instant does not
    /// end.
    pub fn set(&mut self, member: Member, signal: &str, value: i32) -> Result<(), GroupError> {
        let signal = self.members[member.0].setting(signal, value)?;
        self.input(member, Input::Signal(signal, value))
    }

    /// Something happens to a controller, now, after everything that is due now; what it leads to at this
    /// instant happens with it.
    ///
    /// # Errors
    ///
    /// If that does not end.
    pub fn input(&mut self, member: Member, input: Input<'_>) -> Result<(), GroupError> {
        self.run_to(self.now)?;
        self.acts.1 = 0;
        self.give(member.0, input);
        self.exchange()?;
        self.run_to(self.now)
    }

    // --- how time passes ---

    /// The present.
    pub fn now(&self) -> Time {
        self.now
    }

    /// When something happens next by itself; `None` if everybody waits for an input.
    pub fn due(&self) -> Option<Time> {
        self.next().map(|(due, _)| due)
    }

    /// Lets happen the one thing that happens next, with what it leads to over the wires, and says when
    /// that was. `None` if there is none.
    ///
    /// # Errors
    ///
    /// If what follows at this instant does not end.
    pub fn step(&mut self) -> Result<Option<Time>, GroupError> {
        let next = self.next();
        next.map(|(due, who)| self.happen(due, who).map(|()| due)).transpose()
    }

    /// Lets time pass up to and including an instant, with everything that happens. One in the past
    /// changes nothing.
    ///
    /// # Errors
    ///
    /// If more happens at one instant than ever ends.
    pub fn run_to(&mut self, at: Time) -> Result<(), GroupError> {
        let (mut instant, mut causes) = (self.now, 0);
        while let Some((due, who)) = self.next().filter(|(due, _)| *due <= at) {
            self.happen(due, who)?;
            causes = if due > instant { 0 } else { causes + 1 };
            instant = due;
            if causes >= MAX_CAUSES {
                return Err(GroupError::Endless { at: self.now });
            }
        }
        self.now = self.now.max(at);
        self.keep_up();
        Ok(())
    }

    /// Lets so much time pass, with everything that happens in it.
    ///
    /// # Errors
    ///
    /// If more happens at one instant than ever ends.
    pub fn advance(&mut self, span: Duration) -> Result<Time, GroupError> {
        self.run_to(self.now + span)?;
        Ok(self.now)
    }

    /// Lets time pass up to the next thing that happens, or for a span if that is sooner; with everything
    /// that happens at that instant.
    ///
    /// # Errors
    ///
    /// If that does not end.
    pub fn advance_to_next(&mut self, most: Duration) -> Result<Time, GroupError> {
        let end = self.now + most;
        self.run_to(self.due().map_or(end, |due| due.min(end)))?;
        Ok(self.now)
    }

    /// Lets time pass until everybody waits for an input.
    ///
    /// # Errors
    ///
    /// If that is not so after a million causes, or will never be.
    pub fn run_until_idle(&mut self) -> Result<Time, GroupError> {
        for _ in 0..MAX_CAUSES {
            if self.step()?.is_none() {
                self.keep_up();
                return Ok(self.now);
            }
        }
        Err(GroupError::Restless { at: self.now })
    }

    /// Lets time pass up to the first instant at which a condition holds of a controller, with everything
    /// that happens at that instant, and says when that was. It is computed, and not looked for step by
    /// step. `None` if everything comes to rest before; what only happens, such as an answer, holds at no
    /// instant.
    ///
    /// # Errors
    ///
    /// If that is not so after a million causes.
    pub fn run_until(
        &mut self,
        member: Member,
        condition: &Condition,
    ) -> Result<Option<Time>, GroupError> {
        for _ in 0..MAX_CAUSES {
            self.run_to(self.now)?;
            let mut ahead = self.members[member.0].harness.clone();
            let due = self.due();
            // What others do may change what this one does, so no further than to that.
            let until = due.map(|due| Condition::Any(vec![condition.clone(), Condition::At(due)]));
            let holds = ahead.run_until(until.as_ref().unwrap_or(condition));
            if let Some(at) = holds.filter(|at| due.is_none_or(|due| *at < due)) {
                self.run_to(at)?;
                return Ok(Some(at));
            }
            let Some(due) = due else { return Ok(None) };
            self.run_to(due)?;
        }
        Err(GroupError::Restless { at: self.now })
    }

    // --- what comes out, and what is so ---

    /// Takes the bytes that a controller has sent.
    pub fn take_bytes(&mut self, member: Member) -> Vec<u8> {
        let mut taken = Vec::new();
        self.members[member.0].outputs.retain(|output| match output {
            Output::Bytes(_, bytes) => {
                taken.extend_from_slice(bytes);
                false
            }
            _ => true,
        });
        taken
    }

    /// Takes everything that has come out of a controller, bytes and the events that are kept, in the order in which it happened.
    pub fn take_outputs(&mut self, member: Member) -> Vec<Output> {
        self.members[member.0].outputs.drain(..).collect()
    }

    /// A picture of a controller.
    pub fn view(&self, member: Member) -> View {
        self.members[member.0].harness.device().view(self.now)
    }

    /// The step counters of a controller's axes, X first.
    pub fn position(&self, member: Member) -> Vec<i64> {
        self.view(member).axes.iter().map(|axis| axis.position).collect()
    }

    /// The simulation.
    pub fn simulation(&self) -> &S {
        &self.simulation
    }

    /// Everything that decides what the group will do. Taking it is cheap.
    pub fn state(&self) -> GroupState<S>
    where
        S: Clone,
    {
        let members = self.members.iter().map(|seat| seat.harness.device().state());
        GroupState {
            profiles: self.profiles.clone(),
            now: self.now,
            members: members.collect(),
            simulation: self.simulation.clone(),
        }
    }

    /// Goes back to a state of this group, or of a copy of it. What has come out and was not taken is
    /// dropped.
    ///
    /// # Errors
    ///
    /// If it is a state of other models, machines, or as many controllers as there are not here.
    pub fn restore(&mut self, state: &GroupState<S>) -> Result<(), GroupError>
    where
        S: Clone,
    {
        if state.profiles != self.profiles {
            let (found, own) = (in_words(&state.profiles), in_words(&self.profiles));
            return Err(GroupError::OtherGroup { found, own });
        }
        for (seat, state) in self.members.iter_mut().zip(&state.members) {
            seat.harness.restore(state.clone());
            seat.outputs.clear();
        }
        self.now = state.now;
        self.simulation = state.simulation.clone();
        self.acts = (self.now, 0);
        Ok(())
    }

    // --- how it works ---

    /// What happens next, and when: the earliest, and at equal times whoever joined first.
    fn next(&self) -> Option<(Time, Who)> {
        let members = self.members.iter().enumerate();
        let members =
            members.filter_map(|(place, seat)| Some((seat.harness.due()?, Who::Member(place))));
        let simulation = self.simulation.due().map(|due| (due, Who::Simulation));
        let all = members.chain(simulation).filter(|(due, _)| *due != Time::NEVER);
        let (due, who) = all.min_by_key(|(due, _)| *due)?;
        Some((due.max(self.now), who))
    }

    /// Lets the next thing happen, with what it leads to over the wires.
    fn happen(&mut self, due: Time, who: Who) -> Result<(), GroupError> {
        self.now = due;
        match who {
            Who::Member(place) => drop(self.members[place].harness.step()),
            Who::Simulation => {
                let (instant, before) = self.acts;
                let times = if instant == due { before + 1 } else { 1 };
                if times > MOST_AT_ONCE {
                    return Err(GroupError::Insistent { at: due });
                }
                self.acts = (due, times);
                self.simulate(|simulation, world| simulation.act(world))?;
            }
        }
        self.exchange()
    }

    /// Gives an input to a controller, now, after what is due now.
    fn give(&mut self, place: usize, input: Input<'_>) {
        let harness = &mut self.members[place].harness;
        harness.run_to(self.now);
        harness.accept(input);
    }

    /// Lets the simulation do something, and passes on what it sets, unless it fails.
    fn simulate(&mut self, act: impl FnOnce(&mut S, &mut World<'_>)) -> Result<(), GroupError> {
        let mut world = World::new(self.now, &self.members);
        act(&mut self.simulation, &mut world);
        for (place, signal, value) in world.end()? {
            self.give(place, Input::Signal(signal, value));
        }
        Ok(())
    }

    /// Takes what has come out, and carries outputs over the wires and to the simulation until nothing
    /// changes any more. A simulation that has failed hears of nothing more, but the wires carry all.
    fn exchange(&mut self) -> Result<(), GroupError> {
        let mut done = Ok(());
        for _ in 0..MAX_CAUSES {
            let mut changes = Vec::new();
            for (place, seat) in self.members.iter_mut().enumerate() {
                let Seat { harness, kept, outputs } = seat;
                for output in harness.drain() {
                    if let Some(Event::Port { port, value }) = output.event() {
                        changes.push((place, *port, *value));
                    }
                    if output.event().is_none_or(|event| kept.contain(event.kind())) {
                        outputs.push_back(output);
                    }
                }
            }
            if changes.is_empty() {
                return done;
            }
            for (place, port, value) in changes {
                for wire in 0..self.wires.len() {
                    let Wire { from, port: of, bit, to, signal } = self.wires[wire];
                    if (from, of) == (place, port) {
                        self.give(to, Input::Signal(signal, i32::from(value >> bit & 1)));
                    }
                }
                if done.is_ok() {
                    done = self.simulate(|simulation, world| {
                        simulation.output(Member(place), port, value, world);
                    });
                }
            }
        }
        Err(GroupError::Endless { at: self.now })
    }

    /// Nothing is due any more: all have come to the present.
    fn keep_up(&mut self) {
        for seat in &mut self.members {
            seat.harness.run_to(self.now);
        }
    }
}

/// What the controllers of a group are.
fn in_words(profiles: &[(Model, Arc<Machine>)]) -> String {
    let each =
        profiles.iter().map(|(model, machine)| format!("{} ({})", model.name(), machine.name));
    match profiles.len() {
        0 => "a group of nobody".to_owned(),
        _ => format!("a group of {}", each.collect::<Vec<_>>().join(", ")),
    }
}
