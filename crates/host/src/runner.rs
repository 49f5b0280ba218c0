//! The task that runs a controller.

use std::fmt;
use std::future::{Future, poll_fn};
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};

use thiserror::Error;
use tokio::sync::{mpsc, oneshot};
use tokio::task::yield_now;
use vimc4_device::{Condition, Device, Input, Kinds, OwnedInput, Time};

use crate::BreakpointView;
use crate::Clock;
use crate::ControlError;
use crate::bell::Bell;
use crate::deeds;
use crate::drive::Drive;
use crate::flash::{FlashFile, FlashFileError};
use crate::journey::Ticket;
use crate::reception;
use crate::rig::Rig;
use crate::storage::Storage;
use crate::timer::Timer;
use crate::transport::Transport;
use crate::travel::Destination;
use crate::turn::reactor_turn;
use crate::wire;
use crate::{BreakpointId, Deed, Effect, News, Sink, SinkId, Source};
use crate::{Pause, Step};
use vimc4_session::LineClients;

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
    /// The device, all that it is plugged into, and how its time passes.
    drive: Drive<D>,
    clients: LineClients,
    jobs: mpsc::UnboundedReceiver<Deferred<D>>,
    /// Rings when there is a job.
    asked: Bell,
    /// Whether the line was heard last, so that jobs have their turn.
    was_heard: bool,
    stop: oneshot::Receiver<Ending>,
    /// Rings when it is to stop, or something is asked of a journey.
    orders: Bell,
    /// Wakes the task when something is asked of a journey.
    nudges: mpsc::UnboundedReceiver<()>,
    /// A request to take in so many bytes of the line although time is paused, and to answer how
    /// many were taken.
    hears: Option<(usize, oneshot::Sender<Result<usize, ControlError>>)>,
    /// Everything that happened before there was a sink.
    early: Vec<News>,
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
    /// Something is asked of a journey.
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
            drive: Drive::new(device, clock),
            clients: LineClients::default(),
            jobs,
            asked: Bell::default(),
            was_heard: false,
            stop,
            orders: Bell::default(),
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
        self.drive.rig.storage = storage;
        self.early.extend(mended);
        Ok(self)
    }

    /// Gives it a name, which distinguishes its reports from those of other controllers of the
    /// process.
    #[must_use]
    pub fn named(mut self, name: &str) -> Runner<D> {
        self.drive.rig.sinks.call(name);
        self
    }

    /// Bytes are read at the speeds that both ends of the line have: that to which a client has set its
    /// port, where that is known, and that of the device.
    #[must_use]
    pub fn with_line_physics(mut self, on: bool) -> Runner<D> {
        self.drive.rig.has_physics = on;
        self
    }

    /// Says what ends a line, so that a half line that a client has left can be reported when the
    /// next client comes. With `fresh` it is forgotten instead: the device gets whole lines only.
    #[must_use]
    pub fn with_lines(mut self, ends: &'static [u8], fresh: bool) -> Runner<D> {
        self.clients.set_lines(ends, fresh);
        self
    }

    /// Says what ends a line, as bytes and in words, where LF does not: a client that ends its lines
    /// with LF alone waits for an answer that will never come, and is told so.
    #[must_use]
    pub fn with_line_feeds(mut self, ends: &'static [u8], right: &'static str) -> Runner<D> {
        self.clients.set_line_feeds(ends, right);
        self
    }

    /// Opens a way to the line.
    pub fn attach(&mut self, transport: Box<dyn Transport>) {
        self.drive.rig.wire.attach(transport);
    }

    /// Lets a sink watch from now on.
    pub fn watch(&mut self, sink: Box<dyn Sink>) -> SinkId {
        self.drive.rig.watch(sink)
    }

    /// Detaches a sink. Returns whether it was still attached.
    pub fn detach(&mut self, id: SinkId) -> bool {
        self.drive.rig.detach(id)
    }

    /// Pauses its time from the first moment, in this name: nothing that clients send is taken in
    /// before time [goes on](crate::Handle::resume).
    pub fn begin_paused(&mut self, who: &str) {
        self.drive.rig.pause(Source::Controls(who.into()));
    }

    /// A sink wants to be told [at another time](Sink::due) that time has passed than it said last.
    pub fn look_again(&mut self) {
        self.drive.rig.sinks.look_again();
    }

    /// The device.
    pub fn device(&self) -> &D {
        &self.drive.rig.device
    }

    // --- what a handle asks for ---

    pub(crate) fn act(&mut self, by: &Source, deed: Deed, inputs: &[Input<'_>]) -> Effect {
        deeds::act(&mut self.drive, by, deed, inputs)
    }

    pub(crate) fn do_to(&mut self, by: &Source, inputs: &[Input<'_>]) -> Effect {
        deeds::give(&mut self.drive, by, inputs)
    }

    pub(crate) fn set_out(&mut self, by: Source, destination: Destination, ticket: Ticket) {
        self.drive.set_out(by, destination, ticket);
    }

    pub(crate) fn restore(&mut self, by: &Source, state: D::State) {
        self.drive.restore(by, state);
    }

    pub(crate) fn pause(&mut self, by: Source) -> Time {
        self.drive.pause(by)
    }

    pub(crate) fn resume(&mut self, by: &Source) -> Result<Time, ControlError> {
        self.drive.resume(by)
    }

    /// How its time passes.
    pub fn clock(&self) -> Clock {
        self.drive.clock()
    }

    pub(crate) fn set_clock(&mut self, clock: Clock) -> Result<(), ControlError> {
        self.drive.set_clock(clock)
    }

    pub(crate) fn step(&mut self) -> Result<Step, ControlError> {
        self.drive.step()
    }

    pub(crate) fn wait_until(&mut self, at: Time) -> Result<Time, ControlError> {
        self.drive.wait_until(at)
    }

    pub(crate) fn give(&mut self, by: Source, input: OwnedInput) {
        self.drive.give(input, by);
    }

    pub(crate) fn hear(
        &mut self,
        bytes: usize,
        answer: oneshot::Sender<Result<usize, ControlError>>,
    ) {
        if self.drive.rig.is_paused() {
            self.hears = Some((bytes, answer));
        } else {
            let _ = answer.send(Err(ControlError::NotPaused));
        }
    }

    pub(crate) fn paused(&self) -> Option<&Pause> {
        self.drive.rig.paused()
    }

    pub(crate) fn tell_of_pause(&mut self, answer: oneshot::Sender<Result<Pause, ControlError>>) {
        self.drive.rig.tell_of_pause(answer);
    }

    pub(crate) fn break_when(&mut self, condition: Condition) -> BreakpointId {
        self.drive.rig.break_when(condition)
    }

    pub(crate) fn stop_when(&mut self, condition: Condition, by: Source) -> BreakpointId {
        self.drive.rig.stop_when(condition, by)
    }

    pub(crate) fn remove_breakpoint(&mut self, id: BreakpointId) -> bool {
        self.drive.rig.remove_breakpoint(id)
    }

    pub(crate) fn breakpoints(&self) -> Vec<BreakpointView> {
        self.drive.rig.breakpoints.views()
    }

    // --- the loop ---

    /// Runs until it is told to stop, until the last handle is dropped, or until the flash file
    /// fails.
    pub async fn run(mut self) -> Result<(), RunError> {
        let mut timer = Timer::new().map_err(RunError::Timer)?;
        self.drive.start();
        for news in std::mem::take(&mut self.early) {
            let now = self.device().now();
            self.drive.rig.tell_news(now, news);
        }
        // The device may have had something to say before the first input.
        self.drive.rig.drain();
        loop {
            let busy = self.drive.move_time();
            self.drive.rig.dismiss_listeners();
            if let Some(failure) = self.drive.rig.storage.take_failure() {
                self.end(self.device().now());
                return Err(failure.into());
            }
            // In vain until there is a timer for it, but then the clock stands still anyway.
            let _ = timer.arm(self.drive.next_moment());
            if busy {
                // The reactor gets its turn, so that looking at the line shows what is there.
                yield_now().await;
            }
            match self.look_up(&mut timer, busy).await {
                Woken::Line => {}
                Woken::Job(job) => {
                    self.settle().await;
                    self.drive.catch_up();
                    job(&mut self);
                    self.listen().await;
                }
                Woken::Stop(ending) => {
                    self.end(self.drive.present());
                    if let Ending::Leaves = ending {
                        std::mem::forget(self);
                    }
                    return Ok(());
                }
                Woken::Nudge => self.drive.give_up_waiting(),
                Woken::Time => self.drive.jump(),
            }
        }
    }

    /// Waits for something to happen; with `busy` it only looks.
    async fn look_up(&mut self, timer: &mut Timer, busy: bool) -> Woken<D> {
        poll_fn(|cx| {
            let Runner { stop, nudges, orders, .. } = &mut *self;
            let ordered = orders.answer(cx, |cx| {
                if let Poll::Ready(ending) = Pin::new(stop).poll(cx) {
                    return Poll::Ready(Woken::Stop(ending.unwrap_or(Ending::Closes)));
                }
                match nudges.poll_recv(cx) {
                    Poll::Ready(Some(())) => Poll::Ready(Woken::Nudge),
                    // The handle that has the sender is gone; nothing will be wished any more.
                    Poll::Ready(None) | Poll::Pending => Poll::Pending,
                }
            });
            if ordered.is_ready() {
                return ordered;
            }
            // Before anything is received: a client that never stops sending gets its answers too.
            self.drive.rig.wire.poll_send(cx);
            let sinks = &mut self.drive.rig.sinks;
            let were_full = sinks.were_full();
            let are_full = sinks.poll_ready(cx).is_pending();
            if were_full && !are_full {
                return Poll::Ready(Woken::Time);
            }
            if !are_full && !self.drive.is_away() {
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
        let Runner { jobs, asked, .. } = self;
        asked.answer(cx, |cx| jobs.poll_recv(cx))
    }

    /// How much may be read. While time is paused, everything clients send or do waits with their
    /// operating system, as on a line that nobody attends to.
    fn room(&self) -> Option<usize> {
        (!self.drive.rig.is_paused()).then_some(usize::MAX)
    }

    /// Asks the transports for what has arrived, and takes it in, but no more than there is room for;
    /// without any, nobody is asked. Returns how many bytes that were.
    fn poll_line(&mut self, cx: &mut Context<'_>, room: Option<usize>) -> Poll<usize> {
        let Some(most) = room else { return Poll::Pending };
        wire::with_buffer(|buffer| {
            let Runner { drive, clients, .. } = self;
            let Rig { wire, device, .. } = &mut drive.rig;
            let room = |handshake| device.room(handshake).min(most);
            wire.poll(cx, room, buffer)
                .map(|(from, received)| reception::receive(drive, clients, from, received, buffer))
        })
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
            self.drive.rig.wire.look_closely();
            let heard = poll_fn(|cx| {
                // Who sends and reads has to get its answers meanwhile, or it loses them.
                self.drive.rig.wire.poll_send(cx);
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
        let rig = &mut self.drive.rig;
        rig.release();
        rig.tell_unheard(at);
        rig.tell_news(at, News::Ends);
        rig.end_recordings();
        if rig.is_wanted(Kinds::ANSWER) {
            // The device knows how to tell of half a line, if it has it.
            if let Some(half) = self.clients.held_back() {
                rig.input(Input::Bytes(&half), at, None);
            }
            rig.input(Input::Power(false), at, None);
        }
    }
}

impl<D: Device + fmt::Debug> fmt::Debug for Runner<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Runner").field("drive", &self.drive).finish_non_exhaustive()
    }
}
