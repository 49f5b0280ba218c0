//! The trait every simulated device implements.

use std::error::Error;
use std::fmt::{self, Debug};

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::facts::{Facts, first, lapse};
use crate::{
    AXES, Activity, Condition, Event, Fact, Fault, FaultView, Input, Kinds, ModemLine, Output,
    Point, RuleView, Running, Signal, SignalId, Time, View,
};

/// How many causes a forecast follows before it gives up, so that it ends even for something that
/// an endless program never does.
pub const MAX_CAUSES: u32 = 1_000_000;

/// A state is of another model or machine than the device that was to continue from it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OtherController {
    /// The model and the machine of the state.
    pub found: String,
    /// Those of the device.
    pub own: String,
}

impl fmt::Display for OtherController {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let OtherController { found, own } = self;
        write!(f, "this is a state of {found}, and this controller is {own}; restore it on {found}")
    }
}

impl Error for OtherController {}

/// A simulated device, driven from outside.
///
/// # The contract
///
/// What a device does by itself happens in *causes*: a motion ends, a wait is over, a line that has
/// arrived is executed. Each is due at an instant and takes no time.
///
/// * [`handle`](Device::handle) performs every cause that is due up to and including `at`, then the
///   input, then what the input leads to at this instant. `at` never goes backwards; an earlier
///   one counts as the latest.
/// * Causes are performed in order of time. At equal times, what the previous cause released comes
///   first (a line that waited for the end of a motion is executed before anything else ends at
///   that instant), and then the device's own fixed order.
/// * After every `handle`, [`poll_output`](Device::poll_output) is called until nothing more comes
///   out. [`wake`](Device::wake) then says when the device wants to be woken.
/// * Outputs carry model time. A host that wakes the device late gets the same bytes with the
///   same times, only later.
/// * A wake-up before the deadline changes nothing, and neither does watching.
/// * [`perform`](Device::perform) is a single cause and [`accept`](Device::accept) the input alone.
///   `handle` consists of just these. Calling them one by one gives the same result and allows a
///   look between two things that happen at one instant.
///
/// This is the whole loop that runs one:
///
/// ```
/// use vimc4_device::{Device, Input, Output, Time};
///
/// /// Sends `line` at `at` and lets the device run until it waits for an input.
/// fn converse<D: Device>(device: &mut D, line: &[u8], at: Time) -> Vec<u8> {
///     let mut answer = Vec::new();
///     device.handle(Input::Bytes(line), at);
///     loop {
///         while let Some(output) = device.poll_output() {
///             if let Output::Bytes(_, bytes) = output {
///                 answer.extend_from_slice(&bytes);
///             }
///         }
///         let Some(due) = device.wake() else { return answer };
///         device.handle(Input::Wake, due);
///     }
/// }
/// ```
///
/// In virtual time a [`Harness`](crate::Harness) does it and keeps the output.
pub trait Device {
    /// Everything that decides what the device will do. Two devices with equal states that get
    /// the same inputs at the same times do the same.
    type State: Clone + PartialEq + Debug + Serialize + DeserializeOwned;

    /// What is visible only on devices of its family.
    type Details: Clone + PartialEq + Debug + Send + Serialize + DeserializeOwned + 'static;

    /// Performs a single cause, the first that is due up to and including `at`, and says whether
    /// there was one. The instant at which it was due becomes the present.
    fn perform(&mut self, at: Time) -> bool;

    /// Takes an input at `at`, which becomes the present, and leaves its consequences as causes
    /// that are due then; [`Input::Wake`] has none. Everything due up to `at` must have been
    /// performed.
    fn accept(&mut self, input: Input<'_>, at: Time);

    /// Performs what is due up to `at`, then the input, then what is due because of it.
    fn handle(&mut self, input: Input<'_>, at: Time) {
        while self.perform(at) {}
        self.accept(input, at);
        // Time alone causes nothing more.
        if input != Input::Wake {
            while self.perform(at) {}
        }
    }

    /// The next output, in the order in which things happened.
    fn poll_output(&mut self) -> Option<Output>;

    /// Sets which kinds of events are watched from now on, and returns those that were watched
    /// before. It is not part of the state.
    fn watch(&mut self, kinds: Kinds) -> Kinds;

    /// A copy of the state. Take it after the outputs are drained.
    fn state(&self) -> Self::State;

    /// Continues from a state taken earlier, of the same kind of device.
    fn restore(&mut self, state: Self::State);

    /// The time up to which the device has run.
    fn now(&self) -> Time;

    /// When the next cause is due: when the device wants to be woken if nothing else happens
    /// before. `None` if it waits for an input.
    fn wake(&self) -> Option<Time>;

    /// A picture of the device at `at`, which is not before [`now`](Device::now) and not after
    /// the wake-up time.
    fn view(&self, at: Time) -> View<Self::Details>;

    /// What it is doing, as in its [`view`](Device::view), without the rest of the picture.
    fn activity(&self) -> Activity;

    /// What only devices of its family have, as in its [`view`](Device::view), without the rest
    /// of the picture.
    fn details(&self) -> Self::Details;

    /// The counters of all axes at `at`, as in its [`view`](Device::view), without the rest of the
    /// picture; 0 for axes that are not there.
    fn position(&self, at: Time) -> Point {
        let mut position = Point::default();
        for axis in self.view(at).axes {
            if let Some(place) = position.get_mut(usize::from(axis.index)) {
                *place = axis.position;
            }
        }
        position
    }

    /// Limits that belong to the range in which the counters of all axes stay from
    /// [`now`](Device::now) up to and including the wake-up time, if no input comes: the lower ones
    /// and the upper ones.
    fn reach(&self) -> (Point, Point) {
        ([i64::MIN; AXES], [i64::MAX; AXES])
    }

    /// The segment that is running.
    fn running(&self) -> Option<Running<'_>> {
        None
    }

    /// The things of the outside world that can be set with [`Input::Signal`]. The list is made
    /// on request; a device does not carry its own description with it.
    fn signals(&self) -> Vec<Signal>;

    /// Bits per second of its serial line.
    fn baud(&self) -> u32;

    /// How many bytes it takes now. A sender that obeys the `handshake` lines is asked to wait
    /// before the receive buffer is full; bytes that another sender sends beyond it are lost, and
    /// the device reports that. Without a handshake there is always room.
    fn room(&self, handshake: bool) -> usize {
        let _ = handshake;
        usize::MAX
    }

    /// A modem line on which it shows something of its own, and whether that line is on. If it is CTS,
    /// CTS no longer says whether the device takes more.
    fn modem_line(&self) -> Option<(ModemLine, bool)> {
        None
    }

    /// The image of its non-volatile memory.
    fn flash_image(&self) -> Vec<u8>;

    /// A command in words: `relative move X +5,000 steps at 900 Hz`.
    fn explain(&self, command: &[u8]) -> String;

    /// Whether a byte acts as soon as it arrives, ahead of everything before it on the line, as
    /// control codes do. [`explain`](Device::explain) says what it does.
    fn is_urgent(&self, byte: u8) -> bool {
        let _ = byte;
        false
    }

    /// Why setting a signal to a value has just changed nothing, for people, if the reason is not
    /// merely that it already had the value.
    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        let _ = (signal, value);
        None
    }

    /// Why a fault cannot make a difference here, for people, if it cannot.
    fn why_in_vain(&self, fault: &Fault) -> Option<&'static str> {
        let _ = fault;
        None
    }

    /// The faults that it has, in the order of their numbers.
    fn faults(&self) -> Vec<FaultView> {
        Vec::new()
    }

    /// The rules of scenarios that it has, in the order of their numbers.
    fn rules(&self) -> Vec<RuleView> {
        Vec::new()
    }

    /// Whether the device does nothing by itself at its present time.
    fn is_idle(&self) -> bool;

    /// The first instant from `from` on at which a fact holds, if no input comes and as long as
    /// nothing is due: the question concerns the span between [`now`](Device::now) and the wake-up
    /// time, and instants beyond it are ignored. In this span one motion at most is running, so the
    /// answer is computed, not searched for.
    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time>;

    /// The instant in the same span by which the facts have taken every combination of values that
    /// they will take from `from` on: the end of the first of many turns around a circle. `None` if
    /// that is not before the wake-up. A search for several facts at once needs to go no further.
    fn comes_round(&self, from: Time) -> Option<Time> {
        let _ = from;
        None
    }

    /// The first instant at which the condition holds by states alone, if no input comes:
    /// [`now`](Device::now), or between it and the wake-up time, which is not included.
    fn crossing(&self, condition: &Condition) -> Option<Time> {
        first(&Of(self), condition, self.now())
    }

    /// The first instant at which the condition does not hold by states alone, if no input comes:
    /// [`now`](Device::now), or between it and the wake-up time, which is not included. A happening
    /// holds at no lasting instant.
    fn leaving(&self, condition: &Condition) -> Option<Time> {
        lapse(&Of(self), condition, self.now())
    }

    /// Whether the condition holds at [`now`](Device::now), right after a cause or an input with
    /// these events.
    fn holds<'a>(
        &self,
        condition: &Condition,
        events: impl Iterator<Item = &'a Event> + Clone,
    ) -> bool {
        match condition {
            Condition::All(parts) => parts.iter().all(|part| self.holds(part, events.clone())),
            Condition::Any(parts) => parts.iter().any(|part| self.holds(part, events.clone())),
            happening if happening.has_happenings() => {
                let mut events = events;
                events.any(|event| happening.is_seen_in(event))
            }
            state => self.crossing(state) == Some(self.now()),
        }
    }

    /// The first instant from [`now`](Device::now) on at which the condition holds if no input
    /// comes, by following a copy from cause to cause, never from step to step. `None` if the
    /// device comes to rest before, or after [`MAX_CAUSES`] causes.
    fn when(&self, condition: &Condition) -> Option<Time>
    where
        Self: Clone,
    {
        match self.foresee(condition, MAX_CAUSES) {
            Foresight::At(at) => Some(at),
            Foresight::Never | Foresight::Open => None,
        }
    }

    /// The same, following the copy for at most this many causes.
    fn foresee(&self, condition: &Condition, causes: u32) -> Foresight
    where
        Self: Clone,
    {
        Forecast::new(self, condition.clone()).look(causes)
    }
}

/// A look into the future that can be interrupted: it follows a copy of a device from cause to cause
/// until a condition holds.
#[derive(Clone, Debug)]
pub struct Forecast<D> {
    future: D,
    condition: Condition,
}

impl<D: Device> Forecast<D> {
    /// When the condition will hold, from the device's present on, if no input comes.
    pub fn new(device: &D, condition: Condition) -> Forecast<D>
    where
        D: Clone,
    {
        let mut future = device.clone();
        future.watch(condition.kinds());
        while future.poll_output().is_some() {}
        Forecast { future, condition }
    }

    /// How far it has looked: everything before this instant is settled.
    #[must_use]
    pub fn now(&self) -> Time {
        self.future.now()
    }

    /// Follows the copy for at most this many further causes.
    pub fn look(&mut self, causes: u32) -> Foresight {
        let Forecast { future, condition } = self;
        let mut events = Vec::new();
        for _ in 0..causes {
            if let Some(at) = future.crossing(condition) {
                return Foresight::At(at);
            }
            let Some(due) = future.wake().filter(|at| *at != Time::NEVER) else {
                return Foresight::Never;
            };
            future.perform(due);
            events.clear();
            while let Some(output) = future.poll_output() {
                if let Output::Event(_, event) = output {
                    events.push(event);
                }
            }
            if condition.has_happenings() && future.holds(condition, events.iter()) {
                return Foresight::At(future.now());
            }
        }
        Foresight::Open
    }
}

/// The instants at which a condition begins to hold by states alone, from a device's present on, if
/// no input comes and as long as nothing is due.
#[derive(Clone, Copy, Debug)]
pub struct Beginnings<'a, D> {
    device: &'a D,
    condition: &'a Condition,
    /// Before this instant.
    until: Time,
    at: Time,
    holds: bool,
}

impl<'a, D: Device> Beginnings<'a, D> {
    /// The instants before `until`, for a condition that holds at the present or does not.
    pub fn new(device: &'a D, condition: &'a Condition, holds: bool, until: Time) -> Self {
        Beginnings { device, condition, until, at: device.now(), holds }
    }

    /// Whether the condition holds after the instants seen so far: at the end of the span, if there
    /// are no more.
    pub fn holds(&self) -> bool {
        self.holds
    }
}

impl<D: Device> Iterator for Beginnings<'_, D> {
    type Item = Time;

    fn next(&mut self) -> Option<Time> {
        let within = |at: &Time| *at < self.until;
        if self.holds {
            self.at = lapse(&Of(self.device), self.condition, self.at).filter(within)?;
            self.holds = false;
        }
        self.at = first(&Of(self.device), self.condition, self.at).filter(within)?;
        self.holds = true;
        Some(self.at)
    }
}

/// When a condition will hold, as far as that can be foreseen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foresight {
    /// First at this instant.
    At(Time),
    /// The device comes to rest before.
    Never,
    /// Neither had happened within the forecast.
    Open,
}

/// The forecast of a device about itself.
struct Of<'a, D: ?Sized>(&'a D);

impl<D: Device + ?Sized> Facts for Of<'_, D> {
    fn now(&self) -> Time {
        self.0.now()
    }

    fn wake(&self) -> Option<Time> {
        self.0.wake()
    }

    fn is_idle(&self) -> bool {
        self.0.is_idle()
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        self.0.first_time(fact, from)
    }

    fn comes_round(&self, from: Time) -> Option<Time> {
        self.0.comes_round(from)
    }
}
