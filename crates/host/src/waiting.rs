//! Callers that wait for a condition while time runs by itself.

use vimc4_device::{Condition, Device, Event, Foresight, Kinds, Time};

use crate::ControlError;
use crate::journey::{Ticket, Wish};

/// All waiting callers.
#[derive(Default)]
pub(crate) struct Waiters(Vec<Waiter>);

/// A waiting caller.
struct Waiter {
    condition: Condition,
    /// When it will hold, if it does before the device's next deadline.
    at: Option<Time>,
    /// It will hold by itself, if nothing else happens.
    foreseen: bool,
    ticket: Ticket,
}

/// How many causes are looked ahead for a caller that does not want to wait for anything from
/// outside.
const FORESIGHT: u32 = 10_000;

impl Waiters {
    pub(crate) fn add<D: Device>(&mut self, device: &D, condition: Condition, ticket: Ticket) {
        let at = device.crossing(&condition);
        self.0.push(Waiter { condition, at, foreseen: false, ticket });
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Which events they need to see.
    pub(crate) fn kinds(&self) -> Kinds {
        self.0.iter().fold(Kinds::NONE, |all, waiter| all.and(waiter.condition.kinds()))
    }

    /// The first time at which one of them is to be answered.
    pub(crate) fn due(&self) -> Option<Time> {
        self.0.iter().filter_map(|waiter| waiter.at).min()
    }

    /// Whether any waits for something that is seen in one moment and gone after it.
    pub(crate) fn have_happenings(&self) -> bool {
        self.0.iter().any(|waiter| waiter.condition.has_happenings())
    }

    /// Something has happened to the device: when their conditions will hold may be another time.
    pub(crate) fn look_ahead<D: Device>(&mut self, device: &D) {
        for waiter in &mut self.0 {
            waiter.at = device.crossing(&waiter.condition);
        }
    }

    // Each of these lets some of them go, and returns whether there were any: what they needed to see
    // is not needed any more.

    /// The time has come that they have waited for.
    pub(crate) fn answer_due(&mut self, now: Time) -> bool {
        self.dismiss(|waiter| waiter.at.is_some_and(|at| at <= now), || Ok(now))
    }

    /// These events have happened in one moment.
    pub(crate) fn answer_happened<'a, D: Device>(
        &mut self,
        device: &D,
        events: impl Iterator<Item = &'a Event> + Clone,
    ) -> bool {
        let met = |Waiter { condition, .. }: &mut Waiter| {
            condition.has_happenings() && device.holds(condition, events.clone())
        };
        let now = device.now();
        self.dismiss(met, || Ok(now))
    }

    /// The device rests: what has not come yet cannot come any more unless something happens outside.
    pub(crate) fn disappoint(&mut self) -> bool {
        let hopeless = |waiter: &mut Waiter| {
            let from_outside = waiter.condition.has_happenings();
            waiter.at.is_none() && (!from_outside || waiter.ticket.wish() == Wish::Unaided)
        };
        self.dismiss(hopeless, || Err(ControlError::Never))
    }

    /// Some do not want to wait any longer.
    pub(crate) fn give_up<D: Device + Clone>(&mut self, device: &D) -> bool {
        let given_up = |waiter: &mut Waiter| match waiter.ticket.wish() {
            Wish::Cancel => true,
            Wish::Unaided if !waiter.foreseen => {
                let foresight = device.foresee(&waiter.condition, FORESIGHT);
                waiter.foreseen = matches!(foresight, Foresight::At(_));
                !waiter.foreseen
            }
            _ => false,
        };
        let now = device.now();
        self.dismiss(given_up, || Err(ControlError::Cancelled { at: now }))
    }

    fn dismiss(
        &mut self,
        which: impl FnMut(&mut Waiter) -> bool,
        end: impl Fn() -> Result<Time, ControlError>,
    ) -> bool {
        let before = self.0.len();
        for waiter in self.0.extract_if(.., which) {
            waiter.ticket.end(end());
        }
        self.0.len() < before
    }
}
