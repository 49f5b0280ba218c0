//! How the model's time follows the time on the wall.

use std::time::{Duration, Instant};

use vimc4_device::Time;

use crate::Clock;
use crate::clock::Ticking;

/// How long the computer may be behind a clock that runs by itself before the clock gives way.
const LAG_LIMIT: Duration = Duration::from_millis(250);

/// A clock, where it stands, and whether the device keeps up with it.
#[derive(Debug)]
pub(crate) struct Pace {
    clock: Clock,
    /// `None` if time does not run by itself, or has not begun.
    ticking: Option<Ticking>,
    /// Since when the device has been behind its clock without a pause.
    behind: Option<Instant>,
}

impl Pace {
    pub(crate) fn new(clock: Clock) -> Pace {
        Pace { clock, ticking: None, behind: None }
    }

    /// Whose time it is.
    pub(crate) fn clock(&self) -> Clock {
        self.clock
    }

    /// Time goes on from here.
    pub(crate) fn start(&mut self, at: Time) {
        self.ticking = self.clock.rate().map(|rate| Ticking::start(rate, at));
    }

    /// Whether time jumps to the next deadline.
    pub(crate) fn jumps(&self) -> bool {
        self.clock == Clock::Instant
    }

    /// Whether time runs by itself.
    pub(crate) fn runs(&self) -> bool {
        self.clock.rate().is_some()
    }

    /// What the clock shows, if it runs by itself.
    pub(crate) fn now(&self) -> Option<Time> {
        self.ticking.as_ref().map(Ticking::now)
    }

    /// The moment at which it will show `at`.
    pub(crate) fn moment_of(&self, at: Time) -> Option<Instant> {
        self.ticking.and_then(|ticking| ticking.moment_of(at))
    }

    /// Whether the device is behind.
    pub(crate) fn is_behind(&self) -> bool {
        self.behind.is_some()
    }

    /// The device has caught up.
    pub(crate) fn caught_up(&mut self) {
        self.behind = None;
    }

    /// The device is at `at` only. If the computer is too slow for it at this speed, the clock gives
    /// way, because a line that nobody reads would be worse.
    pub(crate) fn fell_behind(&mut self, at: Time) {
        if self.behind.get_or_insert_with(Instant::now).elapsed() > LAG_LIMIT {
            self.start(at);
            self.behind = None;
        }
    }
}
