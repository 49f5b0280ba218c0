//! Conditions at which a device is held, again and again.

use std::iter;

use serde::{Deserialize, Serialize};

use crate::{Condition, Device, Event, Time};

/// A condition at which the code that drives a device holds it: whenever it *becomes* true.
///
/// A state is met once when it begins to hold, and again after it has not held in between; a
/// happening is met each time. Each part of [`Condition::Any`] is a breakpoint of its own, so that
/// a part that keeps holding does not hide the others. A state that already holds when the
/// breakpoint is set does not meet it.
///
/// The code that drives the device asks when to look [next](Breakpoint::next), lets no time pass
/// beyond that, and [looks](Breakpoint::look) after every cause, after every input and at that
/// instant. Nothing is sampled.
///
/// ```
/// # mod cart { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cart/mod.rs")); }
/// # use cart::Cart;
/// use vimc4_device::{Breakpoint, Condition, Device, Input, Time};
///
/// // A cart that makes a step each millisecond, and begins when it is told to.
/// let mut cart = Cart::default();
/// let mut breakpoint = Breakpoint::new(&cart, Condition::AxisAt { axis: 0, position: 2 });
/// cart.accept(Input::Bytes(b"m5\r"), Time::ZERO);
/// while cart.perform(Time::ZERO) {}
/// assert!(!breakpoint.look(&cart, [].iter()));
/// let at = breakpoint.next(&cart).unwrap();
/// assert_eq!(at, Time::from_millis(2));
/// cart.accept(Input::Wake, at);
/// assert!(breakpoint.look(&cart, [].iter()));
/// // It is not met again before the cart has been elsewhere.
/// assert!(!breakpoint.look(&cart, [].iter()));
/// assert_eq!(breakpoint.met(), 1);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Breakpoint {
    condition: Condition,
    /// For each separate part: whether it did not hold at the last look, so that it can begin to
    /// hold.
    open: Vec<bool>,
    met: u64,
}

impl Breakpoint {
    /// A breakpoint for a device as it is now.
    pub fn new<D: Device>(device: &D, condition: Condition) -> Breakpoint {
        let mut breakpoint = Breakpoint { condition, open: Vec::new(), met: 0 };
        breakpoint.begin(device);
        breakpoint
    }

    /// The condition.
    #[must_use]
    pub fn condition(&self) -> &Condition {
        &self.condition
    }

    /// How often it was met.
    #[must_use]
    pub fn met(&self) -> u64 {
        self.met
    }

    /// The device goes on from another state: what already holds there does not meet it.
    pub fn begin<D: Device>(&mut self, device: &D) {
        self.open = parts(&self.condition).map(|part| !lasts(device, part)).collect();
    }

    /// When it has to be looked at next, if no input comes and nothing is due before: after
    /// [`now`](Device::now) and before the wake-up time. `None` if not before that.
    pub fn next<D: Device>(&self, device: &D) -> Option<Time> {
        let next = |(part, open): (&Condition, &bool)| {
            if *open { device.crossing(part) } else { device.leaving(part) }
        };
        let now = device.now();
        parts(&self.condition).zip(&self.open).filter_map(next).filter(|at| *at > now).min()
    }

    /// Looks at the device right after a cause or an input with these events, or at an instant
    /// between two causes, without any. Says whether it is met, and counts that.
    pub fn look<'a, D: Device>(
        &mut self,
        device: &D,
        events: impl Iterator<Item = &'a Event> + Clone,
    ) -> bool {
        let mut met = false;
        for (part, open) in parts(&self.condition).zip(&mut self.open) {
            let is_so = device.holds(part, events.clone());
            met |= is_so && *open;
            // A happening is over with its moment.
            *open = !is_so || !lasts(device, part);
        }
        self.met += u64::from(met);
        met
    }
}

/// The parts of a condition, any of which is enough.
fn parts(condition: &Condition) -> impl Iterator<Item = &Condition> {
    match condition {
        Condition::Any(parts) => parts.iter(),
        one => std::slice::from_ref(one).iter(),
    }
}

/// Whether a condition holds by states alone, without a happening.
fn lasts<D: Device>(device: &D, condition: &Condition) -> bool {
    device.holds(condition, iter::empty())
}
