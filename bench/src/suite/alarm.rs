//! How late this machine's timers are by themselves.

use std::io;
use std::thread;
use std::time::{Duration, Instant};

use rustix::time::{
    ClockId, Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, clock_gettime,
    timerfd_create, timerfd_settime,
};

use super::cores::Core;
use super::failure::{Doing, Failure, Outcome};
use super::stats::Sample;

/// How late a timerfd is that a thread waits for on a core while something else is done,
/// nanoseconds. It is set anew for every alarm, which rings after `span`.
pub(crate) fn beside(
    core: Core,
    span: Duration,
    until: Instant,
    work: impl FnOnce() -> Outcome<()>,
) -> Outcome<Sample> {
    thread::scope(|scope| {
        let alarms =
            scope.spawn(move || core.run(|| alarms(span, until).doing("wait for a timer")));
        work()?;
        alarms
            .join()
            .unwrap_or_else(|_| Err(Failure::new("the thread that waits for a timer failed")))
    })
}

fn alarms(span: Duration, until: Instant) -> io::Result<Sample> {
    let mut late = Sample::default();
    let timer = timerfd_create(TimerfdClockId::Monotonic, TimerfdFlags::CLOEXEC)?;
    while Instant::now() < until {
        let due = now() + span.as_nanos() as i64;
        let alarm = Itimerspec {
            it_interval: Timespec { tv_sec: 0, tv_nsec: 0 },
            it_value: Timespec { tv_sec: due / 1_000_000_000, tv_nsec: due % 1_000_000_000 },
        };
        timerfd_settime(&timer, TimerfdTimerFlags::ABSTIME, &alarm)?;
        rustix::io::read(&timer, &mut [0; 8])?;
        late.add((now() - due) as f64);
    }
    Ok(late)
}

/// The time of the monotonic clock, nanoseconds.
fn now() -> i64 {
    let time = clock_gettime(ClockId::Monotonic);
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}
