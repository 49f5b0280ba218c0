//! Draws waveforms of a controller while it runs.
//!
//! A thread does again what the controller does, and draws that. The controller tells it every input and
//! how far time has come. The thread is never far behind: clients wait while much is still to be drawn,
//! and so does time that jumps.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::thread;
use std::time::{Duration, Instant};

use tokio::sync::oneshot;
use tokio::task::JoinSet;
use tokio::time::timeout;
use vimc4::{Clock, EventFilter, LineEvent, Report, ReportKind, Sink};
use vimc4_catalogue::{Machine, Model};
use vimc4_device::{Event, Input, Kinds, Motion, OwnedInput, Time};
use vimc4_timeline::recording::{Entry, Head, LineSort, What};

use super::controller::Site;
use super::drawn::Drawing;
use crate::failure::Failure;
use crate::log::Log;
use crate::waves::Sheets;

/// How many bytes of inputs may wait to be drawn before clients wait. One input more is taken.
const ROOM: usize = 32 << 10;

/// What an input takes besides its bytes.
const OVERHEAD: usize = 64;

/// How often a moving controller says how far time has come.
const TICK: Duration = Duration::from_millis(100);

/// For how many ticks it goes on to say so after anything has happened: characters are drawn for a while.
const TICKS_AFTERWARDS: u64 = 100;

/// How many ticks the thread may be behind before clients and time wait.
const TICKS_BEHIND: u64 = 20;

/// How old what was drawn may be before it is in the files.
const FLUSH: Duration = Duration::from_millis(500);

/// How long to wait at the end for a file that takes nothing: a pipe may have a reader that stands still.
const STANDSTILL: Duration = Duration::from_millis(700);

/// A controller that is drawn while it runs.
pub(crate) struct ServedDrawing {
    feed: Arc<DrawingQueue>,
    done: oneshot::Receiver<Result<(), Failure>>,
    writes: Arc<AtomicU64>,
    names: Vec<String>,
}

impl ServedDrawing {
    /// Begins to draw a controller whose time passes like this; its sink has to watch from the first
    /// moment. Errors while it is written go to the log.
    ///
    /// # Errors
    ///
    /// If no thread can be started.
    pub(crate) fn new(
        model: &Model,
        machine: &Machine,
        clock: Clock,
        sort: LineSort,
        sheets: Sheets,
        log: &Log,
    ) -> Result<(ServedDrawing, Watcher), Failure> {
        let head = Head {
            line: sort,
            ..vimc4::recording_head(model, machine, &clock.to_string(), "serve")
        };
        let site = Site::of_head(&head).map_err(Failure::midway)?;
        let tick = clock.rate().map_or(TICK, |rate| rate.model(TICK).max(TICK));
        let watcher = Watcher::new(u64::try_from(tick.as_nanos()).unwrap_or(u64::MAX));
        let feed = Arc::clone(&watcher.feed);
        let (writes, names, log) = (sheets.writes(), sheets.names(), log.clone());
        let (tell, done) = oneshot::channel();
        let queue = Arc::clone(&feed);
        let draw = move || {
            let end = QueueRelease(&queue);
            let drawing = Drawing::new(site, sort, Some(sheets));
            let outcome =
                drawing.and_then(|drawing| follow(drawing, &queue, &mut |text| log.say(text)));
            drop(end);
            // The receiver may have stopped waiting.
            let _ = tell.send(outcome);
        };
        thread::Builder::new()
            .name("waveform".to_owned())
            .spawn(draw)
            .map_err(|error| Failure::usage(format!("cannot start a thread: {error}")))?;
        Ok((ServedDrawing { feed, done, writes, names }, watcher))
    }

    /// The files of all of them, as the end of a message.
    pub(crate) fn names(all: &[ServedDrawing]) -> String {
        let names: Vec<&str> =
            all.iter().flat_map(|live| &live.names).map(String::as_str).collect();
        if names.is_empty() {
            return String::new();
        }
        format!(": {} may lack the last moments", names.join(", "))
    }

    /// Draws the rest of each of them, whatever becomes of the others.
    ///
    /// # Errors
    ///
    /// If not everything could be written.
    pub(crate) async fn finish_all(all: Vec<ServedDrawing>) -> Result<(), Failure> {
        let mut ends: JoinSet<_> = all.into_iter().map(ServedDrawing::finish).collect();
        let mut outcome = Ok(());
        while let Some(end) = ends.join_next().await {
            outcome = outcome.and(end.unwrap_or(Ok(())));
        }
        outcome.map_err(Failure::at_the_end)
    }

    async fn finish(mut self) -> Result<(), Failure> {
        self.feed.end();
        loop {
            let before = self.writes.load(Ordering::Relaxed);
            match timeout(STANDSTILL, &mut self.done).await {
                // A thread that has panicked has said so.
                Ok(outcome) => return outcome.unwrap_or(Ok(())),
                Err(_) if self.writes.load(Ordering::Relaxed) == before => {
                    return Err(Failure::midway(format!(
                        "cannot finish {}: its reader or its disk takes nothing; it lacks the last moments",
                        self.names.join(", ")
                    )));
                }
                Err(_) => {}
            }
        }
    }
}

/// Messages from the controller to the thread, and how far the thread has come.
#[derive(Default)]
struct DrawingQueue {
    waiting: Mutex<QueueState>,
    more: Condvar,
    /// How far it may be drawn behind the controller, in nanoseconds of model time.
    behind: u64,
}

#[derive(Default)]
struct QueueState {
    messages: VecDeque<(Message, usize)>,
    /// How many bytes wait, with those that are being drawn.
    size: usize,
    /// The present time of the controller, and whether the thread has yet to learn it.
    now: Time,
    has_passed: bool,
    /// How far it is drawn.
    drawn: Time,
    /// The controller has ended.
    ended: bool,
    /// The thread has ended.
    is_over: bool,
    /// The thread waits for more.
    sleeps: bool,
    /// Wakes the controller when there is room.
    waker: Option<Waker>,
}

enum Message {
    Entry(Time, What),
    Input(Time, OwnedInput),
}

/// What the thread does next.
enum Task {
    Take(Message, usize),
    Pass(Time),
    Flush,
    Finish(Time),
}

impl DrawingQueue {
    fn lock(&self) -> MutexGuard<'_, QueueState> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut QueueState)) {
        let mut waiting = self.lock();
        change(&mut waiting);
        if waiting.sleeps {
            self.more.notify_one();
        }
    }

    fn tell(&self, message: Message, size: usize) {
        self.change(|waiting| {
            // A thread that can no longer write has ended.
            if !waiting.is_over {
                waiting.size += size;
                waiting.messages.push_back((message, size));
            }
        });
    }

    fn pass(&self, at: Time) {
        self.change(|waiting| {
            if !waiting.ended {
                (waiting.now, waiting.has_passed) = (at, true);
            }
        });
    }

    fn end(&self) {
        self.change(|waiting| waiting.ended = true);
    }

    /// Waits for the next thing to do, until it is time to write what has been drawn.
    fn next(&self, until: Option<Instant>) -> Task {
        let mut waiting = self.lock();
        loop {
            if let Some((message, size)) = waiting.messages.pop_front() {
                return Task::Take(message, size);
            }
            if waiting.ended {
                return Task::Finish(waiting.now);
            }
            if std::mem::take(&mut waiting.has_passed) {
                return Task::Pass(waiting.now);
            }
            let left = until.map(|until| until.saturating_duration_since(Instant::now()));
            if left.is_some_and(|left| left.is_zero()) {
                return Task::Flush;
            }
            waiting.sleeps = true;
            waiting = match left {
                Some(left) => {
                    let slept = self.more.wait_timeout(waiting, left);
                    slept.unwrap_or_else(PoisonError::into_inner).0
                }
                None => self.more.wait(waiting).unwrap_or_else(PoisonError::into_inner),
            };
            waiting.sleeps = false;
        }
    }

    /// So many bytes are drawn, up to then.
    fn has_drawn(&self, size: usize, to: Time) {
        let mut waiting = self.lock();
        waiting.size -= size;
        waiting.drawn = to;
        if waiting.has_room(ROOM / 2, self.behind / 2)
            && let Some(waker) = waiting.waker.take()
        {
            drop(waiting);
            waker.wake();
        }
    }
}

impl QueueState {
    fn has_room(&self, room: usize, behind: u64) -> bool {
        self.is_over || self.size <= room && self.now.nanos_since(self.drawn) <= behind
    }
}

/// Lets the controller go on without the thread, however that ends.
struct QueueRelease<'a>(&'a DrawingQueue);

impl Drop for QueueRelease<'_> {
    fn drop(&mut self) {
        let mut waiting = self.0.lock();
        waiting.is_over = true;
        waiting.messages.clear();
        if let Some(waker) = waiting.waker.take() {
            drop(waiting);
            waker.wake();
        }
    }
}

/// Draws the messages of a queue to the end, or until nothing can be written any more.
fn follow(
    mut drawing: Drawing<'_>,
    feed: &DrawingQueue,
    say: &mut dyn FnMut(&str),
) -> Result<(), Failure> {
    let mut drawn_since: Option<Instant> = None;
    loop {
        let (mut size, mut to) = (0, None);
        match feed.next(drawn_since.map(|since| since + FLUSH)) {
            Task::Take(message, bytes) => {
                let entry = match message {
                    Message::Entry(at, what) => Entry::new(at, what),
                    Message::Input(at, input) => drawing.given(at, &input),
                };
                drawing.take(&entry, &|error| Failure::usage(error))?;
                size = bytes;
            }
            Task::Pass(at) => {
                drawing.pass(at);
                to = Some(at);
            }
            Task::Flush => {}
            Task::Finish(at) => return drawing.finish(at),
        }
        feed.has_drawn(size, to.unwrap_or(drawing.now()));
        let since = *drawn_since.get_or_insert_with(Instant::now);
        if since.elapsed() >= FLUSH {
            drawn_since = None;
            if drawing.flush(say) {
                let now = drawing.now();
                return drawing.finish(now);
            }
        }
    }
}

/// The sink that tells the thread.
pub(crate) struct Watcher {
    feed: Arc<DrawingQueue>,
    /// How much model time a tick takes, in nanoseconds.
    tick: u64,
    /// The last time that was passed on, and the time of the last report.
    passed: Time,
    active: Time,
    is_moving: bool,
}

impl Watcher {
    fn new(tick: u64) -> Watcher {
        let feed = Arc::new(DrawingQueue {
            behind: tick.saturating_mul(TICKS_BEHIND),
            ..DrawingQueue::default()
        });
        Watcher { feed, tick, passed: Time::ZERO, active: Time::ZERO, is_moving: false }
    }
}

impl Sink for Watcher {
    fn wants(&self) -> EventFilter {
        EventFilter { kinds: Kinds::MOTION, ..EventFilter::INPUTS }
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        let at = report.at;
        self.active = at;
        match &report.what {
            ReportKind::Input { input, .. } => {
                let bytes = match input.as_input() {
                    Input::Bytes(bytes) => bytes.len(),
                    _ => 0,
                };
                self.feed.tell(Message::Input(at, input.clone()), bytes + OVERHEAD);
            }
            ReportKind::State { by, state } => {
                let by = by.as_ref().map(|by| by.to_string().into());
                // Time goes on from that of the state, which may be an earlier one, in the middle of a
                // motion.
                self.feed.change(|waiting| (waiting.now, waiting.has_passed) = (Time::ZERO, false));
                (self.passed, self.is_moving) = (Time::ZERO, by.is_some());
                let what = What::State { by, state: state.clone() };
                self.feed.tell(Message::Entry(at, what), OVERHEAD);
            }
            ReportKind::Stands { causes } => {
                self.feed.tell(Message::Entry(at, What::Stands(*causes)), OVERHEAD);
            }
            ReportKind::Goes => self.feed.tell(Message::Entry(at, What::Goes), OVERHEAD),
            ReportKind::Event { event: Event::Motion(motion), .. } => {
                self.is_moving = !matches!(motion, Motion::Ends { .. });
            }
            ReportKind::News(LineEvent::Ends) => {
                self.feed.pass(at);
                self.feed.end();
            }
            _ => {}
        }
    }

    fn settled(&mut self, at: Time, _state: &dyn Fn() -> serde_json::Value) {
        self.feed.pass(at);
    }

    fn due(&self) -> Option<Time> {
        let ends = self.active.after_nanos(self.tick.saturating_mul(TICKS_AFTERWARDS));
        (self.is_moving || self.passed < ends).then(|| self.passed.after_nanos(self.tick))
    }

    fn passes(&mut self, at: Time) {
        self.passed = at;
        self.feed.pass(at);
    }

    fn poll_ready(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        let mut waiting = self.feed.lock();
        if waiting.has_room(ROOM, self.feed.behind) {
            return Poll::Ready(());
        }
        waiting.waker = Some(cx.waker().clone());
        Poll::Pending
    }

    fn has_enough(&self) -> bool {
        self.feed.lock().is_over
    }
}
