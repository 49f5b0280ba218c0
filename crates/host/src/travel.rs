//! Time that is on its way, as the controller sees it.

use std::time::{Duration, Instant};

use vimc4_device::{Condition, Device, Forecast, Foresight, MAX_CAUSES, Time};

use crate::Source;
use crate::journey::{Progress, Ticket};

/// How many causes are looked ahead at once.
const AHEAD: u32 = 1_000;

/// How long may be looked ahead before the line is looked at again.
const AHEAD_TIME: Duration = Duration::from_millis(5);

/// For how many causes, looked ahead or performed, what arrives has to wait. Orders that are given
/// one behind the other are carried out one after the other by that, and not by how fast the
/// computer is; but a way without an end does not make a controller deaf.
const UNDISTURBED: u32 = 100_000;

/// Where time is sent.
pub(crate) enum Destination {
    After(Duration),
    Until(Condition),
}

/// Time is on its way.
pub(crate) struct Travel<D> {
    pub(crate) by: Source,
    pub(crate) ticket: Ticket,
    pub(crate) began: Time,
    /// Until this holds; `None` if it goes to a time.
    until: Option<Condition>,
    /// When that will be, as far as it has been looked.
    forecast: Option<Box<Forecast<D>>>,
    /// How many causes may still be looked ahead.
    causes: u32,
    /// Where it goes, if that is known.
    to: Option<Time>,
    /// How much had gone into the device when that was looked for.
    inputs: u64,
    /// For how many causes what arrives still has to wait.
    undisturbed: u32,
    pub(crate) paused: bool,
}

impl<D: Device + Clone> Travel<D> {
    pub(crate) fn begin(
        by: Source,
        ticket: Ticket,
        began: Time,
        destination: Destination,
    ) -> Travel<D> {
        let (until, to) = match destination {
            Destination::After(span) => (None, Some(began + span)),
            // A time comes, whatever happens before.
            Destination::Until(Condition::At(at)) if at >= began => (None, Some(at)),
            Destination::Until(condition) => (Some(condition), None),
        };
        Travel {
            by,
            ticket,
            began,
            until,
            forecast: None,
            causes: MAX_CAUSES,
            to,
            inputs: 0,
            undisturbed: UNDISTURBED,
            paused: false,
        }
    }

    /// Whether what arrives has to wait.
    pub(crate) fn is_undisturbed(&self) -> bool {
        !self.paused && self.undisturbed > 0
    }

    /// How many causes may be performed before something else gets its turn.
    pub(crate) fn stage(&self, most: u32) -> u32 {
        if self.undisturbed > 0 { most.min(self.undisturbed) } else { most }
    }

    /// So many causes have been performed.
    pub(crate) fn came(&mut self, causes: u32) {
        self.undisturbed = self.undisturbed.saturating_sub(causes);
    }

    /// Looks ahead for a few milliseconds at most, where it is not known yet where it goes. What has
    /// gone in meanwhile, `inputs` since ever, may change when a condition will hold.
    pub(crate) fn foresee(&mut self, device: &D, inputs: u64) -> Foresight {
        if self.until.is_some() && std::mem::replace(&mut self.inputs, inputs) != inputs {
            (self.forecast, self.to, self.causes) = (None, None, MAX_CAUSES);
        }
        let (None, Some(condition)) = (self.to, &self.until) else {
            return self.to.map_or(Foresight::Never, Foresight::At);
        };
        let forecast =
            self.forecast.get_or_insert_with(|| Box::new(Forecast::new(device, condition.clone())));
        let began = Instant::now();
        while self.causes > 0 && began.elapsed() < AHEAD_TIME {
            let causes = self.causes.min(AHEAD);
            self.causes -= causes;
            self.undisturbed = self.undisturbed.saturating_sub(causes);
            match forecast.look(causes) {
                Foresight::Open => {}
                Foresight::Never => return Foresight::Never,
                Foresight::At(at) => {
                    (self.forecast, self.to) = (None, Some(at));
                    return Foresight::At(at);
                }
            }
        }
        Foresight::Open
    }

    /// Up to when it has been looked ahead in vain, if no more is looked.
    pub(crate) fn looked_to(&self) -> Option<Time> {
        let forecast = self.forecast.as_ref().filter(|_| self.causes == 0)?;
        Some(forecast.now())
    }

    /// Reports how far it has come to the thread that sent it.
    pub(crate) fn tell(&self, now: Time) {
        self.ticket.tell(Progress { now, to: self.to, paused: self.paused });
    }
}
