//! A device in virtual time.

use std::collections::{VecDeque, vec_deque};
use std::error::Error;
use std::fmt;
use std::time::Duration;

use crate::{
    Condition, Device, Event, Input, Kinds, MAX_CAUSES, Output, OwnedInput, Time, TimedInput,
};

/// A device in virtual time: causes happen one after the other as fast as the computer can go, and
/// the same on every computer.
///
/// A harness does what it is told, keeps the output until it is taken, and lets no time pass by
/// itself.
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
/// Events outside can be planned. A planned event comes before direct inputs at the same time, and
/// after what the device does by itself:
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
    /// The inputs so far, if they are kept.
    given: Option<Vec<TimedInput>>,
}

/// The device does not come to rest.
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

    /// Keeps the inputs from now on, for a recording; [take](Harness::take_given) them from time to
    /// time.
    #[must_use]
    pub fn keeping_given(mut self) -> Harness<D> {
        self.given = Some(Vec::new());
        self
    }

    /// The device, to be looked at.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// The device, to be driven by other code.
    pub fn into_device(self) -> D {
        self.device
    }

    /// The present.
    pub fn now(&self) -> Time {
        self.device.now()
    }

    /// When something happens next without further input: a planned event, or something that the
    /// device does by itself. `None` if it waits for an input.
    pub fn due(&self) -> Option<Time> {
        self.device.wake().into_iter().chain(self.planned()).min()
    }

    /// When the next of what is planned will happen.
    pub fn planned(&self) -> Option<Time> {
        self.plan.front().map(|planned| planned.at)
    }

    // --- what goes in ---

    /// Plans an input for a time, after those already planned for the same time. An input planned
    /// for the past happens next, in the present.
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

    /// Something happens outside, now, after what is due now. Its consequences at this instant are
    /// left to [steps](Harness::step), or happen as time goes on.
    pub fn accept(&mut self, input: Input<'_>) {
        self.run_to(self.now());
        self.device.accept(input, self.now());
        self.collect();
    }

    /// Repeats a kept input: lets time pass up to its time, and gives it. Repeating all inputs of
    /// one device makes an equal device do the same again.
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

    /// Performs the next single thing, and says when that was: one cause of the device, or else the
    /// next planned event. `None` if there is none, or [never](Time::NEVER).
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

    /// Lets this much time pass, with everything that happens in it.
    pub fn advance(&mut self, span: Duration) {
        self.run_to(self.now() + span);
    }

    /// Lets time pass up to and including `at`, with everything that happens. A time in the past
    /// changes nothing.
    pub fn run_to(&mut self, at: Time) {
        while self.due().is_some_and(|due| due <= at) && self.step().is_some() {}
        if self.now() < at {
            self.handle(Input::Wake, at);
        }
    }

    /// Lets time pass up to `at`, with everything that happens before it and at most this many of
    /// the causes due at `at` itself.
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
    /// If it has not come to rest after [`MAX_CAUSES`] causes, or never will.
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
    /// comes to rest before, or after [`MAX_CAUSES`] causes; the present stays there.
    ///
    /// A happening is seen at its own moment: other things due at that instant are still to come. A
    /// state is evaluated after the events planned for that instant. The necessary events are
    /// watched meanwhile; they are among the outputs only if they were watched before.
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
                // Nothing is due before. What is due now, after the moment sought, stays due.
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

    /// The outputs that were not taken, in the order in which they happened.
    pub fn outputs(&self) -> &VecDeque<Output> {
        &self.outputs
    }

    /// Takes the first output.
    pub fn take_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// Takes all outputs, in the order in which they happened.
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

    /// Takes the kept inputs, in order. The passing of time is not among them.
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
