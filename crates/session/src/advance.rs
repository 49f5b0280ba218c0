//! Time that advances to a destination.

use vimc4_device::{Condition, Device, Forecast, Foresight, MAX_CAUSES, Time};

use crate::Source;
use crate::request::{AdvanceRequest, Destination, Progress, RequestId};

/// How many causes are looked ahead in one unit of work.
const AHEAD: u32 = 1_000;

/// For how many causes, looked ahead or performed, inputs have to wait. Requests that are made one
/// after the other are carried out one after the other, however fast the computer is. But an
/// advance without an end does not make a controller deaf.
const UNDISTURBED: u32 = 100_000;

/// An advance that is under way.
#[derive(Debug)]
pub(crate) struct Advance<D> {
    pub(crate) id: RequestId,
    pub(crate) by: Source,
    pub(crate) began: Time,
    pub(crate) request: AdvanceRequest,
    /// The condition; `None` if the destination is a time.
    until: Option<Condition>,
    /// The search for the instant at which the condition holds.
    forecast: Option<Box<Forecast<D>>>,
    /// How many causes may still be looked ahead.
    causes: u32,
    /// The destination, if that is known.
    to: Option<Time>,
    /// The count of the device's inputs when the search began.
    inputs: u64,
    /// For how many causes inputs still have to wait.
    undisturbed: u32,
    pub(crate) is_paused: bool,
}

impl<D: Device> Advance<D> {
    pub(crate) fn begin(
        id: RequestId,
        by: Source,
        began: Time,
        destination: Destination,
    ) -> Advance<D> {
        let (until, to) = match destination {
            Destination::After(span) => (None, Some(began + span)),
            // A time comes, whatever happens before.
            Destination::Until(Condition::At(at)) if at >= began => (None, Some(at)),
            Destination::Until(condition) => (Some(condition), None),
        };
        Advance {
            id,
            by,
            began,
            request: AdvanceRequest::Go,
            until,
            forecast: None,
            causes: MAX_CAUSES,
            to,
            inputs: 0,
            undisturbed: UNDISTURBED,
            is_paused: false,
        }
    }

    /// Whether inputs have to wait.
    pub(crate) fn is_undisturbed(&self) -> bool {
        !self.is_paused && self.undisturbed > 0
    }

    /// A cause has been performed.
    pub(crate) fn count_cause(&mut self) {
        self.undisturbed = self.undisturbed.saturating_sub(1);
    }

    /// Looks ahead for one unit of work, while the destination is not known. `inputs` counts the
    /// device's inputs: another one since may change when a condition holds.
    pub(crate) fn look_ahead(&mut self, device: &D, inputs: u64) -> Foresight
    where
        D: Clone,
    {
        if self.until.is_some() && std::mem::replace(&mut self.inputs, inputs) != inputs {
            (self.forecast, self.to, self.causes) = (None, None, MAX_CAUSES);
        }
        let (None, Some(condition)) = (self.to, &self.until) else {
            return self.to.map_or(Foresight::Never, Foresight::At);
        };
        let forecast =
            self.forecast.get_or_insert_with(|| Box::new(Forecast::new(device, condition.clone())));
        let causes = self.causes.min(AHEAD);
        self.causes -= causes;
        self.undisturbed = self.undisturbed.saturating_sub(causes);
        let foresight = if causes > 0 { forecast.look(causes) } else { Foresight::Open };
        if let Foresight::At(at) = foresight {
            (self.forecast, self.to) = (None, Some(at));
        }
        foresight
    }

    /// The time up to which the search has found nothing, if it goes no further.
    pub(crate) fn searched_to(&self) -> Option<Time> {
        let forecast = self.forecast.as_ref().filter(|_| self.causes == 0)?;
        Some(forecast.now())
    }

    /// How far it has come.
    pub(crate) fn progress(&self, now: Time) -> Progress {
        Progress { now, to: self.to, paused: self.is_paused }
    }
}
