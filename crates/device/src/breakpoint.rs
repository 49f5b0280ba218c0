//! Conditions at which a device is held, again and again.

use std::iter;

use serde::{Deserialize, Serialize};

use crate::{Condition, Device, Event, Time};

/// A condition at which the code that drives a device holds it: whenever it *becomes* true.
///
/// A state that has become so is met once, and again when it has not been so in between; a happening
/// is met each time. Of [`Condition::Any`] each part is a breakpoint of its own, so that what stays
/// so does not hide the rest. What is so already when the breakpoint is set is not met by that.
///
/// The code that drives the device asks when it has to be looked at [next](Breakpoint::next), lets no
/// time pass beyond that, and [looks](Breakpoint::look) after every cause, every input and at that
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
    /// Of each part that is one of its own: whether it was not so when it was looked at last, so
    /// that it can become so.
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

    /// The device goes on from another state: what is so there is not met by that.
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

/// The conditions of which any is enough.
fn parts(condition: &Condition) -> impl Iterator<Item = &Condition> {
    match condition {
        Condition::Any(parts) => parts.iter(),
        one => std::slice::from_ref(one).iter(),
    }
}

/// Whether a condition holds by what is so, without anything that happens.
fn lasts<D: Device>(device: &D, condition: &Condition) -> bool {
    device.holds(condition, iter::empty())
}
