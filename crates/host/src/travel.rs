//! Time that is on its way, as the controller sees it.

use std::time::{Duration, Instant};

use vimc4_device::{Condition, Device, Forecast, Foresight, MAX_CAUSES, Time};

use crate::journey::{Progress, Ticket};
use crate::report::Source;

/// How many causes are looked ahead at once.
const AHEAD: u32 = 1_000;

/// How long may be looked ahead before the line is looked at again.
const AHEAD_TIME: Duration = Duration::from_millis(5);

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
            Destination::Until(condition) => (Some(condition), None),
        };
        let (forecast, causes, paused) = (None, MAX_CAUSES, false);
        Travel { by, ticket, began, until, forecast, causes, to, paused }
    }

    /// Time stands still; what happens in the meantime may change when a condition will hold.
    pub(crate) fn pause(&mut self) {
        self.paused = true;
        if self.until.is_some() {
            (self.forecast, self.to, self.causes) = (None, None, MAX_CAUSES);
        }
    }

    /// Looks ahead for a few milliseconds at most, where it is not known yet where it goes.
    pub(crate) fn foresee(&mut self, device: &D) -> Foresight {
        let (None, Some(condition)) = (self.to, &self.until) else {
            return self.to.map_or(Foresight::Never, Foresight::At);
        };
        let forecast =
            self.forecast.get_or_insert_with(|| Box::new(Forecast::new(device, condition.clone())));
        let began = Instant::now();
        while self.causes > 0 && began.elapsed() < AHEAD_TIME {
            let causes = self.causes.min(AHEAD);
            self.causes -= causes;
            match forecast.look(causes) {
                Foresight::Open => {}
                Foresight::Never => return Foresight::Never,
                Foresight::At(at) => {
                    (self.forecast, self.to) = (None, Some(at));
                    return Foresight::At(at);
                }
            }
        }
        if self.causes == 0 { Foresight::Never } else { Foresight::Open }
    }

    /// Tells whoever has sent it how far it has come.
    pub(crate) fn tell(&self, now: Time) {
        self.ticket.tell(Progress { now, to: self.to, paused: self.paused });
    }
}
