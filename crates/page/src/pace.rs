//! How the controller's time goes with that of the page.

use std::time::Duration;

use vimc4_device::Time;
use vimc4_session::Clock;

/// A clock that reads the moments that are passed in: nanoseconds of the page, from any beginning.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    pub(crate) clock: Clock,
    /// The moment at which it showed `base`; `None` before anybody has heard what happens.
    since: Option<u64>,
    base: Time,
}

impl Pace {
    pub(crate) fn new(clock: Clock, base: Time) -> Pace {
        Pace { clock, since: None, base }
    }

    /// It runs from this moment, if it has not run before.
    pub(crate) fn begin(&mut self, moment: u64, now: Time) {
        if self.since.is_none() {
            (self.since, self.base) = (Some(moment), now);
        }
    }

    /// It shows this time now, if it runs.
    pub(crate) fn restart(&mut self, moment: u64, now: Time) {
        if self.since.is_some() {
            (self.since, self.base) = (Some(moment), now);
        }
    }

    /// Whether time jumps from one thing to the next.
    pub(crate) fn jumps(&self) -> bool {
        self.clock == Clock::Instant
    }

    /// What it shows; `None` if it does not run by itself.
    pub(crate) fn time_at(&self, moment: u64) -> Option<Time> {
        let rate = self.clock.rate()?;
        let passed = moment.saturating_sub(self.since?);
        Some(self.base + rate.model(Duration::from_nanos(passed)))
    }
}
