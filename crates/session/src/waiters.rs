//! Callers that wait for a condition while time runs by itself.

use vimc4_device::{Condition, Device, Event, Foresight, Kinds, Time};

use crate::request::{AdvanceRequest, RequestId};

/// All waiting callers.
#[derive(Debug, Default)]
pub(crate) struct Waiters(Vec<Waiter>);

/// A waiting caller.
#[derive(Debug)]
struct Waiter {
    id: RequestId,
    condition: Condition,
    /// When the condition will hold, if that is before the device's next deadline.
    at: Option<Time>,
    /// The condition will come true without an input.
    is_foreseen: bool,
    request: AdvanceRequest,
}

/// How many causes are looked ahead for a caller that waits for nothing from outside.
const FORESIGHT: u32 = 10_000;

impl Waiters {
    pub(crate) fn add<D: Device>(&mut self, device: &D, condition: Condition, id: RequestId) {
        let at = device.crossing(&condition);
        let request = AdvanceRequest::Go;
        self.0.push(Waiter { id, condition, at, is_foreseen: false, request });
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The kinds of events that the conditions need.
    pub(crate) fn kinds(&self) -> Kinds {
        self.0.iter().fold(Kinds::NONE, |all, waiter| all.and(waiter.condition.kinds()))
    }

    /// The earliest time at which a condition holds.
    pub(crate) fn due(&self) -> Option<Time> {
        self.0.iter().filter_map(|waiter| waiter.at).min()
    }

    /// Whether a condition contains an event, which is over as soon as it has happened.
    pub(crate) fn have_happenings(&self) -> bool {
        self.0.iter().any(|waiter| waiter.condition.has_happenings())
    }

    /// The device has changed: computes anew when the conditions will hold.
    pub(crate) fn look_ahead<D: Device>(&mut self, device: &D) {
        for waiter in &mut self.0 {
            waiter.at = device.crossing(&waiter.condition);
        }
    }

    /// A caller wants its request to go on in another way.
    pub(crate) fn change(&mut self, id: RequestId, request: AdvanceRequest) {
        for waiter in self.0.iter_mut().filter(|waiter| waiter.id == id) {
            waiter.request = request;
        }
    }

    // Each of these removes waiters, and returns their requests.

    /// Removes the waiters whose condition holds by now.
    pub(crate) fn take_due(&mut self, now: Time) -> Vec<RequestId> {
        self.take(|waiter| waiter.at.is_some_and(|at| at <= now))
    }

    /// Removes the waiters whose condition holds by these events of the present moment.
    pub(crate) fn take_happened<'a, D: Device>(
        &mut self,
        device: &D,
        events: impl Iterator<Item = &'a Event> + Clone,
    ) -> Vec<RequestId> {
        self.take(|Waiter { condition, .. }| {
            condition.has_happenings() && device.holds(condition, events.clone())
        })
    }

    /// The device rests. Removes the waiters whose condition cannot come true any more.
    pub(crate) fn take_unreachable(&mut self) -> Vec<RequestId> {
        self.take(|waiter| {
            let from_outside = waiter.condition.has_happenings();
            waiter.at.is_none() && (!from_outside || waiter.request == AdvanceRequest::Unaided)
        })
    }

    /// Removes the waiters that want to wait no longer.
    pub(crate) fn take_cancelled<D: Device + Clone>(&mut self, device: &D) -> Vec<RequestId> {
        self.take(|waiter| match waiter.request {
            AdvanceRequest::Cancel => true,
            AdvanceRequest::Unaided if !waiter.is_foreseen => {
                let foresight = device.foresee(&waiter.condition, FORESIGHT);
                waiter.is_foreseen = matches!(foresight, Foresight::At(_));
                !waiter.is_foreseen
            }
            _ => false,
        })
    }

    fn take(&mut self, which: impl FnMut(&mut Waiter) -> bool) -> Vec<RequestId> {
        self.0.extract_if(.., which).map(|waiter| waiter.id).collect()
    }
}
