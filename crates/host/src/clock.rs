//! A clock that ticks.

use std::time::Instant;

use vimc4_device::Time;

use crate::Rate;

/// A clock that runs by itself, started at some model time.
///
/// It reads the monotonic clock of the operating system, which on Linux and macOS does not
/// count the time for which the computer was suspended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ticking {
    rate: Rate,
    started: Instant,
    base: Time,
}

impl Ticking {
    /// Starts now, showing `base`.
    pub(crate) fn start(rate: Rate, base: Time) -> Ticking {
        Ticking { rate, started: Instant::now(), base }
    }

    /// The model time at this moment.
    pub(crate) fn now(&self) -> Time {
        self.base + self.rate.model(self.started.elapsed())
    }

    /// The moment at which it will show `at`; `None` if that is too far away to be named.
    pub(crate) fn moment_of(&self, at: Time) -> Option<Instant> {
        if at == Time::NEVER {
            return None;
        }
        self.started.checked_add(self.rate.wall(at - self.base))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_running_clock_knows_when_it_will_show_a_time() {
        let clock = Ticking::start(Rate::new(8, 1).unwrap(), Time::from_secs(10));
        let moment = clock.moment_of(Time::from_secs(18)).unwrap();
        assert_eq!(moment - clock.started, Duration::from_secs(1));
        assert_eq!(clock.moment_of(Time::NEVER), None);
        assert!(clock.now() >= Time::from_secs(10));
    }
}
