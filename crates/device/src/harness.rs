//! A device in virtual time.

use std::collections::{VecDeque, vec_deque};
use std::error::Error;
use std::fmt;
use std::time::Duration;

use crate::{
    Condition, Device, Event, Input, Kinds, MAX_CAUSES, Output, OwnedInput, Time, TimedInput,
};

/// A device in virtual time: what is due happens, and then what is due next, as fast as the
/// computer goes and the same on every computer.
///
/// A harness performs what it is told, keeps what comes out until somebody takes it, and lets no
/// time pass by itself.
///
/// ```
/// # mod cart { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cart/mod.rs")); }
/// # use cart::Cart;
/// use vimc4_device::{Condition, Harness, Output, Time};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
///
/// // A cart that makes a step each millisecond, as in `m5`, and says where it is when asked `p`.
/// let mut cart = Harness::new(Cart::default());
/// assert_eq!(cart.ask(b"m5\r")?, b"0");
/// assert_eq!(cart.now(), Time::from_millis(5));
///
/// // Or piece by piece: it begins, is looked at, and comes to its end.
/// cart.send(b"m100\r");
/// cart.run_until(&Condition::AxisAt { axis: 0, position: 40 });
/// assert_eq!(cart.now(), Time::from_millis(40));
/// cart.run_to_rest()?;
/// assert_eq!(*cart.outputs(), [Output::Bytes(Time::from_millis(105), "0".into())]);
/// # Ok(())
/// # }
/// ```
///
/// What will happen outside can be planned. It comes before what the device is told to do at the
/// same time, and after what the device does by itself:
///
/// ```
/// # mod cart { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cart/mod.rs")); }
/// # use cart::Cart;
/// use vimc4_device::{Harness, Input, Time};
/// # fn main() -> Result<(), vimc4_device::Endless> {
///
/// let mut cart = Harness::new(Cart::default());
/// cart.plan(Time::from_millis(30), Input::Signal(Cart::STOP, 1));
/// assert_eq!(cart.ask(b"m100\r")?, b"stopped");
/// assert_eq!(cart.now(), Time::from_millis(30));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Harness<D> {
    device: D,
    /// What will happen outside, in order of time.
    plan: VecDeque<TimedInput>,
    outputs: VecDeque<Output>,
    /// What has gone in, if somebody wants to know.
    given: Option<Vec<TimedInput>>,
}

/// The device goes on and on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Endless {
    /// How far its time has come.
    pub at: Time,
}

impl fmt::Display for Endless {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the device goes on and on: it has come to {} and is not at rest; run it to a time \
             or to a condition instead",
            self.at
        )
    }
}

impl Error for Endless {}

impl<D: Device> Harness<D> {
    /// Drives a device, from the time it has come to. It is watched as it was before.
    pub fn new(device: D) -> Harness<D> {
        let (plan, outputs) = (VecDeque::new(), VecDeque::new());
        let mut harness = Harness { device, plan, outputs, given: None };
        harness.collect();
        harness
    }

    /// Watches the device: these kinds of events are among its outputs from now on.
    #[must_use]
    pub fn watching(mut self, kinds: Kinds) -> Harness<D> {
        self.device.watch(kinds);
        self
    }

    /// Keeps what goes in from now on, for a recording. Somebody has to
    /// [take](Harness::take_given) it.
    #[must_use]
    pub fn keeping_given(mut self) -> Harness<D> {
        self.given = Some(Vec::new());
        self
    }

    /// The device, to be looked at.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// The device, to be driven by somebody else.
    pub fn into_device(self) -> D {
        self.device
    }

    /// The present.
    pub fn now(&self) -> Time {
        self.device.now()
    }

    /// When something happens next if nobody does anything: what is planned, or what the device
    /// does by itself. `None` if it waits for an input.
    pub fn due(&self) -> Option<Time> {
        self.device.wake().into_iter().chain(self.planned()).min()
    }

    /// When the next of what is planned will happen.
    pub fn planned(&self) -> Option<Time> {
        self.plan.front().map(|planned| planned.at)
    }

    // --- what goes in ---

    /// Plans an input for a time, behind what is planned for the same. What is planned for the
    /// past happens next, in the present.
    pub fn plan(&mut self, at: Time, input: Input<'_>) {
        let input = OwnedInput::from(input);
        let place = self.plan.partition_point(|other| other.at <= at);
        self.plan.insert(place, TimedInput { at, input });
    }

    /// Bytes arrive on the line, now.
    pub fn send(&mut self, bytes: &[u8]) {
        self.input(Input::Bytes(bytes));
    }

    /// Something happens outside, now.
    pub fn input(&mut self, input: Input<'_>) {
        let now = self.now();
        while self.planned().is_some_and(|at| at <= now) {
            self.step();
        }
        self.handle(input, now);
    }

    /// Something happens outside, now, after what is due now; what it leads to at this instant is left to
    /// [steps](Harness::step), or happens as time passes on.
    pub fn accept(&mut self, input: Input<'_>) {
        self.run_to(self.now());
        self.device.accept(input, self.now());
        self.collect();
    }

    /// Gives an input that was kept: lets time pass up to when it was given, and gives it. One
    /// after the other, the inputs of another device make an equal device do the same again.
    pub fn play(&mut self, TimedInput { at, input }: &TimedInput) {
        self.run_to(*at);
        self.input(input.as_input());
    }

    /// Sends bytes, lets everything happen that follows from them, and takes the bytes that have
    /// come out; those that came earlier and were not taken come first.
    ///
    /// # Errors
    ///
    /// If the device does not come to rest, as in an endless program. Nothing is taken then.
    pub fn ask(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Endless> {
        self.send(bytes);
        self.run_to_rest()?;
        Ok(self.take_bytes())
    }

    /// Continues from a state taken earlier. What is planned and what has come out stay.
    pub fn restore(&mut self, state: D::State) {
        self.device.restore(state);
    }

    // --- how time passes ---

    /// Lets happen the one thing that happens next, and says when that was: a single cause of what
    /// the device does by itself, or else the next of what is planned. `None` if nothing does, or
    /// [never](Time::NEVER).
    pub fn step(&mut self) -> Option<Time> {
        let due = self.due().filter(|due| *due != Time::NEVER)?.max(self.now());
        if !self.device.perform(due)
            && self.planned().is_some_and(|at| at <= due)
            && let Some(TimedInput { at, input }) = self.plan.pop_front()
        {
            self.device.accept(input.as_input(), at);
            self.keep(input.as_input());
        }
        self.collect();
        Some(self.now())
    }

    /// Lets so much time pass, with everything that happens in it.
    pub fn advance(&mut self, span: Duration) {
        self.run_to(self.now() + span);
    }

    /// Lets time pass up to `at`, with everything that happens until then and just then. A time
    /// that is over changes nothing.
    pub fn run_to(&mut self, at: Time) {
        while self.due().is_some_and(|due| due <= at) && self.step().is_some() {}
        if self.now() < at {
            self.handle(Input::Wake, at);
        }
    }

    /// Lets time pass up to `at`, with everything that happens before and no more than so many of the
    /// causes that are due just then.
    pub fn run_into(&mut self, at: Time, causes: u32) {
        while self.due().is_some_and(|due| due < at) && self.step().is_some() {}
        for _ in 0..causes {
            self.device.perform(at);
        }
        if self.now() < at {
            self.device.accept(Input::Wake, at);
        }
        self.collect();
    }

    /// Lets everything happen that is planned and that the device does by itself, until it waits
    /// for an input.
    ///
    /// # Errors
    ///
    /// If that is not so after [`MAX_CAUSES`] causes, or will never be.
    pub fn run_to_rest(&mut self) -> Result<(), Endless> {
        for _ in 0..MAX_CAUSES {
            if self.step().is_none() {
                break;
            }
        }
        if self.due().is_none() { Ok(()) } else { Err(Endless { at: self.now() }) }
    }

    /// Lets time pass up to the first instant, from now on, at which the condition holds, and says
    /// when that is. It is computed from cause to cause, not searched for. `None` if everything
    /// comes to rest before, or after [`MAX_CAUSES`] causes; the present is then wherever that was.
    ///
    /// What happens is seen in the moment in which it happens: what else is due at that instant is
    /// still to come. What is so at an instant is looked at when what is planned for that instant
    /// has happened. The events that are needed are watched meanwhile, and are among the outputs
    /// only if they were watched before.
    pub fn run_until(&mut self, condition: &Condition) -> Option<Time> {
        let watched = self.device.watch(Kinds::NONE);
        self.device.watch(watched.and(condition.kinds()));
        let reached = self.run_watched_until(condition, watched);
        self.device.watch(watched);
        reached
    }

    fn run_watched_until(&mut self, condition: &Condition, watched: Kinds) -> Option<Time> {
        for _ in 0..MAX_CAUSES {
            let crossing = self.device.crossing(condition);
            if let Some(at) = crossing.filter(|at| self.planned().is_none_or(|next| *at < next)) {
                // Nothing is due before. What is due now, behind what was looked for, stays due.
                if at > self.now() {
                    self.device.accept(Input::Wake, at);
                    self.collect();
                }
                return Some(at);
            }
            let before = self.outputs.len();
            self.step()?;
            if condition.has_happenings() {
                let events = self.outputs.range(before..).filter_map(Output::event);
                let happened = self.device.holds(condition, events);
                let news = self.outputs.split_off(before);
                let is_wanted = |event: &Event| watched.contain(event.kind());
                self.outputs
                    .extend(news.into_iter().filter(|output| output.event().is_none_or(is_wanted)));
                if happened {
                    return Some(self.now());
                }
            }
        }
        None
    }

    // --- what comes out ---

    /// What has come out and was not taken, in the order in which it happened.
    pub fn outputs(&self) -> &VecDeque<Output> {
        &self.outputs
    }

    /// Takes the first of what has come out.
    pub fn take_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// Takes everything that has come out, in the order in which it happened.
    pub fn drain(&mut self) -> vec_deque::Drain<'_, Output> {
        self.outputs.drain(..)
    }

    /// Takes the bytes that have come out, and leaves the rest of the outputs.
    pub fn take_bytes(&mut self) -> Vec<u8> {
        let mut taken = Vec::new();
        self.outputs.retain(|output| match output {
            Output::Bytes(_, bytes) => {
                taken.extend_from_slice(bytes);
                false
            }
            Output::Flash(..) | Output::Event(..) => true,
        });
        taken
    }

    /// Takes what has gone in and is kept, in order. That time passes does not count.
    pub fn take_given(&mut self) -> Vec<TimedInput> {
        self.given.as_mut().map(std::mem::take).unwrap_or_default()
    }

    fn keep(&mut self, input: Input<'_>) {
        let at = self.device.now();
        if let Some(given) = &mut self.given
            && input != Input::Wake
        {
            given.push(TimedInput { at, input: input.into() });
        }
    }

    fn handle(&mut self, input: Input<'_>, at: Time) {
        self.device.handle(input, at);
        self.keep(input);
        self.collect();
    }

    fn collect(&mut self) {
        while let Some(output) = self.device.poll_output() {
            self.outputs.push_back(output);
        }
    }
}
