//! Model time as a function of wall time.

use std::time::Duration;

use vimc4_device::Time;

use crate::Clock;

/// The longest lag behind a running clock before the clock gives way.
const LAG_LIMIT: Duration = Duration::from_millis(250);

/// A clock, its present reading, and whether the device keeps up with it.
///
/// Wall time is passed in: the time since an origin that the caller chooses.
#[derive(Debug)]
pub(crate) struct Pace {
    clock: Clock,
    /// The wall time and the model time at which the clock began to run. `None` if it does not run
    /// by itself, or has not begun.
    started: Option<(Duration, Time)>,
    has_begun: bool,
    /// The wall time since which the device has been behind without a break.
    behind_since: Option<Duration>,
}

impl Pace {
    /// A clock that has not begun to run.
    pub(crate) fn new(clock: Clock) -> Pace {
        Pace { clock, started: None, has_begun: false, behind_since: None }
    }

    /// The clock.
    pub(crate) fn clock(&self) -> Clock {
        self.clock
    }

    /// Begins to run: the clock shows `at` at this wall time.
    pub(crate) fn begin(&mut self, wall: Duration, at: Time) {
        self.has_begun = true;
        self.restart(wall, at);
    }

    /// The clock shows `at` at this wall time, if it has begun to run.
    pub(crate) fn restart(&mut self, wall: Duration, at: Time) {
        let runs = self.has_begun && self.runs();
        self.started = runs.then_some((wall, at));
    }

    /// Replaces the clock, which shows `at` at this wall time.
    pub(crate) fn replace(&mut self, clock: Clock, wall: Duration, at: Time) {
        (self.clock, self.behind_since) = (clock, None);
        self.restart(wall, at);
    }

    /// Whether time jumps to the next deadline.
    pub(crate) fn jumps(&self) -> bool {
        self.clock == Clock::Instant
    }

    /// Whether time runs by itself.
    pub(crate) fn runs(&self) -> bool {
        self.clock.rate().is_some()
    }

    /// The model time at a wall time, if the clock runs by itself.
    pub(crate) fn time_at(&self, wall: Duration) -> Option<Time> {
        let ((started, base), rate) = (self.started?, self.clock.rate()?);
        Some(base + rate.model(wall.saturating_sub(started)))
    }

    /// The wall time at which the clock will show `at`; `None` if it never will.
    pub(crate) fn wall_of(&self, at: Time) -> Option<Duration> {
        if at == Time::NEVER {
            return None;
        }
        let ((started, base), rate) = (self.started?, self.clock.rate()?);
        started.checked_add(rate.wall(at - base))
    }

    /// Whether the device is behind.
    pub(crate) fn is_behind(&self) -> bool {
        self.behind_since.is_some()
    }

    /// The device has caught up.
    pub(crate) fn caught_up(&mut self) {
        self.behind_since = None;
    }

    /// The device has only come to `at`. If the computer is too slow for this clock, the clock gives
    /// way, because a line that nobody reads would be worse.
    pub(crate) fn fell_behind(&mut self, wall: Duration, at: Time) {
        let since = *self.behind_since.get_or_insert(wall);
        if wall.saturating_sub(since) > LAG_LIMIT {
            self.restart(wall, at);
            self.behind_since = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rate;

    #[test]
    fn a_running_clock_knows_the_wall_time_of_a_model_time() {
        let mut pace = Pace::new(Clock::Scaled(Rate::new(8, 1).unwrap()));
        assert_eq!(pace.time_at(Duration::from_secs(5)), None);
        pace.begin(Duration::from_secs(5), Time::from_secs(10));
        assert_eq!(pace.wall_of(Time::from_secs(18)), Some(Duration::from_secs(6)));
        assert_eq!(pace.time_at(Duration::from_secs(6)), Some(Time::from_secs(18)));
        assert_eq!(pace.wall_of(Time::NEVER), None);
    }

    #[test]
    fn a_clock_gives_way_when_the_device_stays_behind() {
        let mut pace = Pace::new(Clock::Real);
        pace.begin(Duration::ZERO, Time::ZERO);
        pace.fell_behind(Duration::from_millis(100), Time::from_secs(0));
        assert!(pace.is_behind());
        pace.fell_behind(Duration::from_millis(400), Time::from_nanos(7));
        assert!(!pace.is_behind());
        assert_eq!(pace.time_at(Duration::from_millis(400)), Some(Time::from_nanos(7)));
    }
}
