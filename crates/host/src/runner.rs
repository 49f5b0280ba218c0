//! The task that runs a controller.

use std::fmt;
use std::future::{Future, poll_fn};
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use thiserror::Error;
use tokio::sync::{mpsc, oneshot};
use tokio::task::yield_now;
use vimc4_device::{Device, Time};
use vimc4_session::{Completion, Destination, Progress, RequestId, Session, Work};

use crate::advance::AdvanceCompletion;
use crate::connections::Connections;
use crate::flash::{FlashFile, FlashFileError};
use crate::storage::Storage;
use crate::timer::Timer;
use crate::transport::{Received, Transport};
use crate::turn::reactor_turn;
use crate::wake_flag::WakeFlag;
use crate::wire;
use crate::{Clock, ControlError, LineEvent, Pause, Sink, SinkId, Source};

/// How many units of work are done before the line is looked at again.
const BATCH: u32 = 10_000;

/// How long that may take.
const BATCH_TIME: Duration = Duration::from_millis(5);

/// Owns a device and its transports and lets it live in the time of a [`Clock`]. It comes
/// with a [`Handle`](crate::Handle), see [there](crate::Handle::pair).
///
/// There is no channel and no other thread between a byte that is read and its answer: the task
/// reads, calls the device and writes. It sleeps in the kernel until a byte, a control or a
/// deadline of the device wakes it; an idle controller costs nothing.
///
/// ```no_run
/// # async fn example<D>(device: D) -> Result<(), Box<dyn std::error::Error>>
/// # where D: vimc4_device::Device + Clone + Send + 'static {
/// use vimc4_device::Line;
/// use vimc4_host::{Clients, Clock, Handle, Tcp};
///
/// let (mut runner, handle) = Handle::pair(Line::ideal(device), Clock::Real);
/// runner.attach(Box::new(Tcp::bind("127.0.0.1:4004".parse()?, Clients::Refuse)?));
/// runner.run().await?;
/// # drop(handle);
/// # Ok(())
/// # }
/// ```
pub struct Runner<D: Device> {
    session: Session<D>,
    connections: Connections,
    /// The moment at which the session's wall time begins.
    origin: Instant,
    /// The callers of advances that are under way.
    advances: Vec<(RequestId, AdvanceCompletion)>,
    /// The callers that wait for time to be paused.
    pause_waits: Vec<(RequestId, oneshot::Sender<Result<Pause, ControlError>>)>,
    jobs: mpsc::UnboundedReceiver<Deferred<D>>,
    /// Raised when there is a job.
    jobs_flag: WakeFlag,
    /// Whether the line was heard last, so that jobs have their turn.
    was_heard: bool,
    stop: oneshot::Receiver<Ending>,
    /// Raised when it is to stop, or an advance is to go on in another way.
    orders_flag: WakeFlag,
    /// Wakes the task when something is asked of an advance.
    nudges: mpsc::UnboundedReceiver<()>,
    /// A request to take in so many bytes of the line although time is paused, and to answer how
    /// many were taken.
    hears: Option<(usize, oneshot::Sender<Result<usize, ControlError>>)>,
    /// Everything that happened before there was a sink.
    early: Vec<LineEvent>,
}

/// Why a controller ended by itself.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunError {
    /// What it stores cannot be stored any more. Going on would confirm what is lost.
    #[error(transparent)]
    Flash(#[from] FlashFileError),
    /// The system has no timer for us.
    #[error("cannot make a timer: {0}; the limit of open files may be too low")]
    Timer(io::Error),
}

/// What a [`Handle`](crate::Handle) asks for.
pub(crate) type Deferred<D> = Box<dyn FnOnce(&mut Runner<D>) + Send>;

/// How a controller is told to end.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Ending {
    /// Its ports are closed afterwards.
    Closes,
    /// The program ends with it, and the system closes them all at once.
    Leaves,
}

/// Why the task looked up.
enum Woken<D: Device> {
    /// Something has arrived on the line, and was passed on.
    Line,
    Job(Deferred<D>),
    Stop(Ending),
    /// Something is asked of an advance.
    Nudge,
    /// Time has passed, or there is more to do.
    Time,
}

impl<D: Device + Clone + 'static> Runner<D> {
    pub(crate) fn new(
        device: D,
        clock: Clock,
        jobs: mpsc::UnboundedReceiver<Deferred<D>>,
        nudges: mpsc::UnboundedReceiver<()>,
        stop: oneshot::Receiver<Ending>,
    ) -> Runner<D> {
        Runner {
            connections: Connections::new(device.baud()),
            session: Session::new(device, clock),
            origin: Instant::now(),
            advances: Vec::new(),
            pause_waits: Vec::new(),
            jobs,
            jobs_flag: WakeFlag::default(),
            was_heard: false,
            stop,
            orders_flag: WakeFlag::default(),
            nudges,
            hears: None,
            early: Vec::new(),
        }
    }

    // --- how it is set up ---

    /// Keeps the device's flash memory in a file. `image` is what the file held when it was
    /// opened; where the device reads it differently (it drops a torn record, or begins a fresh
    /// memory), the file follows.
    pub fn with_flash(
        mut self,
        file: FlashFile,
        image: &[u8],
    ) -> Result<Runner<D>, FlashFileError> {
        let (storage, mended) = Storage::open(self.device(), file, image)?;
        self.session.set_keeps_flash(storage.is_kept());
        self.connections.storage = storage;
        self.early.extend(mended);
        Ok(self)
    }

    /// Gives it a name, which distinguishes its reports from those of other controllers of the
    /// process.
    #[must_use]
    pub fn named(mut self, name: &str) -> Runner<D> {
        self.connections.sinks.set_name(name);
        self
    }

    /// Bytes are read at the speeds that both ends of the line have: that to which a client has set its
    /// port, where that is known, and that of the device.
    #[must_use]
    pub fn with_line_physics(mut self, on: bool) -> Runner<D> {
        self.session.set_physics(on);
        self
    }

    /// Says what ends a line, so that a half line that a client has left can be reported when the
    /// next client comes. With `fresh` it is forgotten instead: the device gets whole lines only.
    #[must_use]
    pub fn with_lines(mut self, ends: &'static [u8], fresh: bool) -> Runner<D> {
        self.session.set_lines(ends, fresh);
        self
    }

    /// Says what ends a line, as bytes and in words, where LF does not: a client that ends its lines
    /// with LF alone waits for an answer that will never come, and is told so.
    #[must_use]
    pub fn with_line_feeds(mut self, ends: &'static [u8], right: &'static str) -> Runner<D> {
        self.session.set_line_feeds(ends, right);
        self
    }

    /// Opens a way to the line.
    pub fn attach(&mut self, transport: Box<dyn Transport>) {
        self.connections.wire.attach(transport);
    }

    /// Lets a sink watch from now on.
    pub fn watch(&mut self, sink: Box<dyn Sink>) -> SinkId {
        self.connections.watch(&mut self.session, sink)
    }

    /// Detaches a sink. Returns whether it was still attached.
    pub fn detach(&mut self, id: SinkId) -> bool {
        self.connections.detach(&mut self.session, id)
    }

    /// Pauses its time from the first moment, in this name: nothing that clients send is taken in
    /// before time [goes on](crate::Handle::resume).
    pub fn begin_paused(&mut self, who: &str) {
        self.session.pause_here(Source::Controls(who.into()));
        self.flush();
    }

    /// A sink wants to be told [at another time](Sink::due) that time has passed than it said last.
    pub fn look_again(&mut self) {
        self.connections.sinks.update_due();
        self.session.set_watch_due(self.connections.sinks.due());
    }

    /// The device.
    pub fn device(&self) -> &D {
        self.session.device()
    }

    /// How its time passes.
    pub fn clock(&self) -> Clock {
        self.session.clock()
    }

    // --- what a handle asks for ---

    /// Does something with the session, after everything that is due by now.
    pub(crate) fn request<T>(&mut self, work: impl FnOnce(&mut Session<D>, Duration) -> T) -> T {
        let wall = self.wall();
        self.perform_due(wall);
        let result = work(&mut self.session, wall);
        self.flush();
        result
    }

    pub(crate) fn session(&self) -> &Session<D> {
        &self.session
    }

    pub(crate) fn pause(&mut self, by: Source) -> Time {
        self.request(|session, wall| session.pause(wall, by))
    }

    /// Sends time to a destination.
    pub(crate) fn advance(
        &mut self,
        by: Source,
        destination: Destination,
        caller: AdvanceCompletion,
    ) {
        caller.report(Progress { now: self.session.now(), ..Progress::default() });
        let id = self.session.advance(by, destination);
        let request = caller.request();
        self.advances.push((id, caller));
        // It may have been cancelled before it began.
        self.session.change_advance(id, request);
        self.flush();
    }

    pub(crate) fn hear(
        &mut self,
        bytes: usize,
        answer: oneshot::Sender<Result<usize, ControlError>>,
    ) {
        if self.session.is_paused() {
            self.hears = Some((bytes, answer));
        } else {
            let _ = answer.send(Err(ControlError::NotPaused));
        }
    }

    pub(crate) fn await_pause(&mut self, answer: oneshot::Sender<Result<Pause, ControlError>>) {
        let id = self.session.await_pause();
        self.pause_waits.push((id, answer));
        self.flush();
    }

    // --- the session ---

    /// The wall time. A clock that does not run by itself needs none.
    fn wall(&self) -> Duration {
        if self.session.runs_by_itself() { self.origin.elapsed() } else { Duration::ZERO }
    }

    /// Hands out what the session has for others.
    fn flush(&mut self) {
        self.connections.flush(&mut self.session);
        while let Some((id, completion)) = self.session.poll_completion() {
            // The caller may have stopped waiting for it.
            match completion {
                Completion::Advanced(end) => {
                    self.advances
                        .extract_if(.., |(of, _)| *of == id)
                        .for_each(|(_, it)| it.complete(end.clone()));
                }
                Completion::Paused(pause) => {
                    let waits = self.pause_waits.extract_if(.., |(of, _)| *of == id);
                    waits.for_each(|(_, answer)| _ = answer.send(Ok(pause.clone())));
                }
            }
        }
    }

    /// Does units of work, for a few milliseconds at most. Returns whether there is more to do.
    fn work(&mut self, unit: impl Fn(&mut Session<D>) -> Work) -> bool {
        let mut began = None;
        for _ in 0..BATCH {
            let work = unit(&mut self.session);
            self.flush();
            self.connections.pass_time(&mut self.session);
            if work == Work::Idle {
                return false;
            }
            let is_over = began.get_or_insert_with(Instant::now).elapsed() >= BATCH_TIME;
            let has_to_stop = self.session.is_paused() || self.connections.storage.has_failed();
            if work == Work::Yield || is_over || has_to_stop || self.is_held_up() {
                break;
            }
        }
        true
    }

    /// Performs what is due by a wall time.
    fn perform_due(&mut self, wall: Duration) {
        if self.session.is_due(wall) {
            self.catch_up(wall);
        }
    }

    /// Lets time pass up to a wall time, if it runs by itself.
    fn catch_up(&mut self, wall: Duration) {
        if self.work(|session| session.catch_up(wall)) {
            self.session.fall_behind(self.wall());
        }
    }

    /// Lets time pass as far as it can. Returns whether there is more to do at once.
    fn move_time(&mut self) -> bool {
        if self.is_held_up() && !self.session.is_paused() {
            return false;
        }
        // To read the clock costs more than to see that nothing will be due.
        if self.session.runs_by_itself() && !self.session.has_deadline() {
            return false;
        }
        let wall = self.wall();
        let is_busy = self.work(|session| session.handle_timeout(wall));
        if is_busy && self.session.runs_by_itself() {
            self.session.fall_behind(self.wall());
        }
        if let Some((id, progress)) = self.session.progress() {
            self.advances
                .iter()
                .filter(|(of, _)| *of == id)
                .for_each(|(_, it)| it.report(progress));
        }
        is_busy || self.session.can_jump()
    }

    /// Whether time that jumps has to wait for a sink.
    fn is_held_up(&mut self) -> bool {
        !self.session.runs_by_itself() && self.connections.sinks.are_full()
    }

    /// Tells the session how the callers want their advances to go on.
    fn update_advances(&mut self) {
        for (id, caller) in &self.advances {
            self.session.change_advance(*id, caller.request());
        }
        self.flush();
    }

    // --- the loop ---

    /// Runs until it is told to stop, until the last handle is dropped, or until the flash file
    /// fails.
    pub async fn run(mut self) -> Result<(), RunError> {
        let mut timer = Timer::new().map_err(RunError::Timer)?;
        for news in std::mem::take(&mut self.early) {
            self.session.report(self.session.now(), news);
        }
        self.session.start(self.wall());
        self.flush();
        loop {
            let busy = self.move_time();
            self.dismiss_listeners();
            if let Some(failure) = self.connections.storage.take_failure() {
                self.end(self.session.now());
                return Err(failure.into());
            }
            // In vain until there is a timer for it, but then the clock stands still anyway.
            let _ = timer.arm(self.next_moment());
            if busy {
                // The reactor gets its turn, so that looking at the line shows what is there.
                yield_now().await;
            }
            match self.look_up(&mut timer, busy).await {
                Woken::Line => {}
                Woken::Job(job) => {
                    self.settle().await;
                    self.catch_up(self.wall());
                    job(&mut self);
                    self.listen().await;
                }
                Woken::Stop(ending) => {
                    self.end(self.session.present(self.wall()));
                    if let Ending::Leaves = ending {
                        std::mem::forget(self);
                    }
                    return Ok(());
                }
                Woken::Nudge => self.update_advances(),
                Woken::Time => _ = self.work(Session::jump),
            }
        }
    }

    /// Waits for something to happen; with `busy` it only looks.
    async fn look_up(&mut self, timer: &mut Timer, busy: bool) -> Woken<D> {
        poll_fn(|cx| {
            let Runner { stop, nudges, orders_flag, .. } = &mut *self;
            let ordered = orders_flag.poll(cx, |cx| {
                if let Poll::Ready(ending) = Pin::new(stop).poll(cx) {
                    return Poll::Ready(Woken::Stop(ending.unwrap_or(Ending::Closes)));
                }
                match nudges.poll_recv(cx) {
                    Poll::Ready(Some(())) => Poll::Ready(Woken::Nudge),
                    // The handle that has the sender is gone; no request changes any more.
                    Poll::Ready(None) | Poll::Pending => Poll::Pending,
                }
            });
            if ordered.is_ready() {
                return ordered;
            }
            // Before anything is received: a client that never stops sending gets its answers too.
            self.connections.wire.poll_send(cx);
            let sinks = &mut self.connections.sinks;
            let were_full = sinks.were_full();
            let are_full = sinks.poll_ready(cx).is_pending();
            if were_full && !are_full {
                return Poll::Ready(Woken::Time);
            }
            if !are_full && !self.session.holds_up_inputs() {
                // A client that never stops sending does not keep jobs waiting.
                if std::mem::take(&mut self.was_heard)
                    && let Poll::Ready(Some(job)) = self.poll_jobs(cx)
                {
                    return Poll::Ready(Woken::Job(job));
                }
                if self.poll_line(cx, self.room()).is_ready() {
                    self.was_heard = true;
                    return Poll::Ready(Woken::Line);
                }
                match self.poll_jobs(cx) {
                    Poll::Ready(Some(job)) => return Poll::Ready(Woken::Job(job)),
                    Poll::Ready(None) => return Poll::Ready(Woken::Stop(Ending::Closes)),
                    Poll::Pending => {}
                }
            }
            if timer.poll(cx).is_ready() || busy {
                return Poll::Ready(Woken::Time);
            }
            Poll::Pending
        })
        .await
    }

    /// The next job; none if there is nobody any more who could have one done.
    fn poll_jobs(&mut self, cx: &mut Context<'_>) -> Poll<Option<Deferred<D>>> {
        let Runner { jobs, jobs_flag, .. } = self;
        jobs_flag.poll(cx, |cx| jobs.poll_recv(cx))
    }

    /// How much may be read. While time is paused, everything clients send or do waits with their
    /// operating system, as on a line that nobody attends to.
    fn room(&self) -> Option<usize> {
        (!self.session.is_paused()).then_some(usize::MAX)
    }

    /// Asks the transports for what has arrived, and takes it in, but no more than there is room for;
    /// without any, nobody is asked. Returns how many bytes that were.
    fn poll_line(&mut self, cx: &mut Context<'_>, room: Option<usize>) -> Poll<usize> {
        let Some(most) = room else { return Poll::Pending };
        wire::with_buffer(|buffer| {
            let Runner { session, connections, .. } = self;
            let room = |handshake| session.device().room(handshake).min(most);
            let received = connections.wire.poll(cx, room, buffer);
            received.map(|(from, received)| self.receive(from, received, buffer))
        })
    }

    /// Takes in what a transport has received. Returns how many bytes that were.
    fn receive(&mut self, from: usize, received: Received, buffer: &[u8]) -> usize {
        let mut taken = 0;
        let wall = self.wall();
        if !matches!(received, Received::Finished) {
            self.perform_due(wall);
            let Runner { session, connections: Connections { wire, .. }, .. } = self;
            let label = wire.label(from);
            // To ask for it takes some time.
            let baud = if session.has_physics() { wire.client_baud(from) } else { None };
            match received {
                Received::Bytes(count) => {
                    let bytes = buffer.get(..count).unwrap_or_default();
                    session.handle_bytes(wall, &label, baud, bytes);
                    taken = bytes.len();
                }
                Received::News(news) => session.handle_news(wall, &label, baud, news),
                Received::Finished => {}
            }
            self.flush();
        }
        self.connections.wire.drop_finished();
        taken
    }

    /// Lets go of clients that have closed their side of the line, once they have every reply.
    fn dismiss_listeners(&mut self) {
        if !self.session.is_paused() {
            self.connections.wire.dismiss_listeners(|| self.session.device().is_idle());
        }
    }

    /// The moment at which something is to be done next.
    fn next_moment(&self) -> Option<Instant> {
        self.origin.checked_add(self.session.next_timeout()?)
    }

    /// Takes in everything that was sent before a control was used, although its news may still
    /// be under way: a program that writes a command and then asks where the machine is expects them to
    /// be handled in that order.
    async fn settle(&mut self) {
        let room = self.room();
        self.take_in(room, |_| false).await;
    }

    /// Takes in some of the bytes that wait on the line while time is paused, if that was
    /// requested.
    async fn listen(&mut self) {
        if let Some((bytes, answer)) = self.hears.take() {
            let taken = self.take_in(Some(bytes), |taken| taken > 0).await;
            // The caller may have stopped waiting for the answer.
            let _ = answer.send(Ok(taken));
        }
    }

    /// Takes in what has arrived, in pieces of so many bytes, until it is enough or there is no more.
    async fn take_in(&mut self, room: Option<usize>, enough: impl Fn(usize) -> bool) -> usize {
        // A client that never stops sending must not keep the control from being used.
        for _ in 0..64 {
            reactor_turn().await;
            self.connections.wire.look_closely();
            let heard = poll_fn(|cx| {
                // Who sends and reads has to get its answers meanwhile, or it loses them.
                self.connections.wire.poll_send(cx);
                Poll::Ready(self.poll_line(cx, room))
            });
            match heard.await {
                Poll::Ready(taken) if enough(taken) => return taken,
                Poll::Ready(_) => {}
                Poll::Pending => break,
            }
        }
        0
    }

    /// The device ends with its task, as if the power had gone: watchers learn what that cuts
    /// short, and what has not been told yet. For a recording of what goes in it is over.
    fn end(&mut self, at: Time) {
        self.session.end(at);
        self.flush();
        self.connections.end_recordings(&mut self.session);
        self.session.cut_off(at);
        self.flush();
    }
}

impl<D: Device + fmt::Debug> fmt::Debug for Runner<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Runner").field("session", &self.session).finish_non_exhaustive()
    }
}
