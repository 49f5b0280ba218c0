//! Reports for consumers that take their time.

use std::collections::VecDeque;
use std::future::poll_fn;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use crate::pending::block_on;
use crate::{EventFilter, Report, ReportKind, Sink};

/// The reports of one or several controllers, taken whenever there is time for them.
///
/// A controller never waits for its watchers. At most so many reports are kept; reports that find
/// no room are counted, and no more are kept until all earlier ones have been taken. A
/// [`ReportKind::Missed`] then takes their place. When this is dropped, the controllers detach its sink.
///
/// ```
/// use vimc4_host::{EventFilter, Reports};
///
/// // As many controllers as wanted get a copy of the tap, as a sink.
/// let (tap, mut reports) = Reports::new(EventFilter::ALL, 10_000);
/// assert!(reports.take().is_none());
/// // No controller has it any more: nothing will come.
/// drop(tap);
/// assert!(reports.wait().is_none());
/// ```
#[derive(Debug)]
pub struct Reports(Arc<Shared>);

/// Where reports are put in: the sink that belongs to [`Reports`]. Copies put them into the same.
#[derive(Debug)]
pub struct Tap {
    wants: EventFilter,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    /// How many reports may wait.
    room: usize,
    waiting: Mutex<Waiting>,
}

#[derive(Debug, Default)]
struct Waiting {
    reports: VecDeque<Report>,
    /// What could not be kept behind them: the first of it, without what it was, and how many.
    missed: Option<Report>,
    taps: usize,
    /// The reader is gone.
    over: bool,
    waker: Option<Waker>,
}

impl Shared {
    /// What waits is whole at any time, so a panic elsewhere is no reason to stop.
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Waiting {
    fn take(&mut self) -> Option<Report> {
        self.reports.pop_front().or_else(|| self.missed.take())
    }

    fn wake(&mut self) {
        if let Some(waker) = self.waker.take() {
            waker.wake();
        }
    }
}

impl Reports {
    /// So many reports of what is wanted may wait, and where they are put in.
    #[must_use]
    pub fn new(wants: EventFilter, room: usize) -> (Tap, Reports) {
        let waiting = Waiting { taps: 1, ..Waiting::default() };
        let shared = Arc::new(Shared { room, waiting: Mutex::new(waiting) });
        (Tap { wants, shared: Arc::clone(&shared) }, Reports(shared))
    }

    /// The next report, if one is waiting.
    pub fn take(&mut self) -> Option<Report> {
        self.0.waiting().take()
    }

    /// The next report, when it comes; `None` when nothing will come any more.
    pub async fn next(&mut self) -> Option<Report> {
        poll_fn(|cx| self.poll_next(cx)).await
    }

    /// Blocks this thread until the next report is there; `None` when nothing will come any more.
    pub fn wait(&mut self) -> Option<Report> {
        block_on(pin!(self.next()))
    }

    /// The next report, for executors.
    pub fn poll_next(&mut self, cx: &mut Context<'_>) -> Poll<Option<Report>> {
        let mut waiting = self.0.waiting();
        match waiting.take() {
            None if waiting.taps > 0 => {
                waiting.waker = Some(cx.waker().clone());
                Poll::Pending
            }
            report => Poll::Ready(report),
        }
    }
}

impl Drop for Reports {
    fn drop(&mut self) {
        let mut waiting = self.0.waiting();
        waiting.over = true;
        waiting.reports = VecDeque::new();
    }
}

impl Clone for Tap {
    fn clone(&self) -> Tap {
        self.shared.waiting().taps += 1;
        Tap { wants: self.wants, shared: Arc::clone(&self.shared) }
    }
}

impl Drop for Tap {
    fn drop(&mut self) {
        let mut waiting = self.shared.waiting();
        waiting.taps -= 1;
        waiting.wake();
    }
}

impl Sink for Tap {
    fn wants(&self) -> EventFilter {
        self.wants
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        let mut waiting = self.shared.waiting();
        if waiting.over {
            return;
        }
        if let Some(Report { what: ReportKind::Missed { reports }, .. }) = &mut waiting.missed {
            *reports += 1;
        } else if waiting.reports.len() < self.shared.room {
            waiting.reports.push_back(report.clone());
        } else {
            let controller = Arc::clone(&report.controller);
            let what = ReportKind::Missed { reports: 1 };
            waiting.missed = Some(Report { controller, at: report.at, what });
        }
        waiting.wake();
    }

    fn has_enough(&self) -> bool {
        self.shared.waiting().over
    }
}

#[cfg(test)]
mod tests {
    use vimc4_device::Time;

    use super::*;
    use crate::LineEvent;

    fn report(controller: &str, second: u64) -> Report {
        let what = ReportKind::News(LineEvent::Back { transport: Arc::from("serial") });
        Report { controller: Arc::from(controller), at: Time::from_secs(second), what }
    }

    #[test]
    fn what_finds_no_room_is_counted_in_its_place() {
        let (mut tap, mut reports) = Reports::new(EventFilter::ALL, 3);
        let mut tell = |second| tap.report(&report("1", second), &|_| String::new());
        (0..5).for_each(&mut tell);
        assert_eq!(reports.take(), Some(report("1", 0)));
        // There is room again, but not yet a place at which to say what is missing.
        tell(5);
        assert_eq!(reports.take(), Some(report("1", 1)));
        assert_eq!(reports.take(), Some(report("1", 2)));
        let missed = Report { what: ReportKind::Missed { reports: 3 }, ..report("1", 3) };
        assert_eq!(reports.take(), Some(missed));
        assert_eq!(reports.take(), None);
        tell(6);
        assert_eq!(reports.take(), Some(report("1", 6)));
    }

    #[test]
    fn what_waits_comes_before_the_end() {
        let (tap, mut reports) = Reports::new(EventFilter::INPUTS, 10);
        let mut taps = [tap.clone(), tap];
        for (second, tap) in (0..).zip(&mut taps) {
            assert_eq!(tap.wants(), EventFilter::INPUTS);
            tap.report(&report("1", second), &|_| String::new());
        }
        let waits = std::thread::spawn(move || {
            std::iter::from_fn(|| reports.wait()).map(|report| report.at).collect::<Vec<_>>()
        });
        drop(taps);
        assert_eq!(waits.join().unwrap(), [Time::ZERO, Time::from_secs(1)]);
    }

    #[test]
    fn who_is_gone_has_seen_enough() {
        let (mut tap, reports) = Reports::new(EventFilter::ALL, 10);
        assert!(!tap.has_enough());
        drop(reports);
        assert!(tap.has_enough());
        tap.report(&report("1", 0), &|_| String::new());
        assert_eq!(tap.shared.waiting().reports.len(), 0);
    }
}
