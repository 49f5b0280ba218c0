//! The task that runs a controller.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::fmt;
use std::future::{Future, poll_fn};
use std::io;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};
use std::time::{Duration, Instant};

use bytes::Bytes;
use thiserror::Error;
use tokio::sync::{mpsc, oneshot};
use tokio::task::yield_now;
use vimc4_device::{
    Condition, Device, Event, Forecast, Foresight, Input, Kinds, MAX_CAUSES, Output, SignalId,
    Stamp, Time, Warning,
};

use crate::bell::Bell;
use crate::clock::{Clock, Ticking};
use crate::flash::{FlashFile, FlashFileError, unix_lines};
use crate::half_line::HalfLine;
use crate::journey::{Progress, Ticket, Wish};
use crate::line_feeds::LineFeeds;
use crate::reply::ControlError;
use crate::report::{Deed, Effect, News, Report, Sink, SinkId, Source, Wants, What};
use crate::timer::Timer;
use crate::transport::{Received, Sent, Transport};

/// How many deadlines are performed before the line is looked at again.
const BATCH: u32 = 10_000;

/// How long that may take.
const BATCH_TIME: Duration = Duration::from_millis(5);

/// How many causes are looked ahead for somebody who waits while time runs by itself, without
/// holding up the line. What is not decided by then is waited for.
const FORESIGHT: u32 = 1_000;

/// How long the computer may be behind a clock that runs by itself before the clock gives way.
const PATIENCE: Duration = Duration::from_millis(250);

/// How much is read at once. The controllers of a thread take turns after each piece, and a
/// client may fill every piece with the shortest commands there are.
const CHUNK: usize = 1_024;

thread_local! {
    /// What is being read. Nobody reads while he takes in what he has read.
    static BUFFER: RefCell<[u8; CHUNK]> = const { RefCell::new([0; CHUNK]) };
}

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
    device: D,
    clock: Clock,
    ticking: Option<Ticking>,
    /// Since when the device has been behind its clock without a pause.
    behind: Option<Instant>,
    transports: Vec<Box<dyn Transport>>,
    /// The transport that is asked first, so that one client's flood leaves room for others.
    first: usize,
    flash: Option<FlashFile>,
    /// What it is called in reports.
    name: Arc<str>,
    sinks: Vec<Watching>,
    /// The last number that a sink was given.
    last_sink: u64,
    wants: Wants,
    baud: u32,
    /// Whether clients may send, as the handshake lines say.
    ready: bool,
    jobs: mpsc::UnboundedReceiver<Deferred<D>>,
    /// Rings when there is a job.
    asked: Bell,
    stop: oneshot::Receiver<()>,
    /// Rings when it is to stop, or something is wished of a journey.
    orders: Bell,
    /// Wakes the task when something is wished of a journey.
    nudges: mpsc::UnboundedReceiver<()>,
    journey: Option<Travel<D>>,
    waiters: Vec<Waiter>,
    /// What has come out of the device while it was looked at moment by moment.
    seen: VecDeque<Output>,
    failure: Option<RunError>,
    /// What happened before anybody watched.
    early: Vec<News>,
    half: HalfLine,
    feeds: LineFeeds,
    /// Who has the line open and may send.
    clients: Vec<Source>,
    /// Who has sent something last, as far as several could have.
    speaker: Option<Source>,
    /// How often something was sent or stored.
    said: u64,
    /// How many bytes have come since the power was taken away; `None` while it is on.
    unpowered: Option<u64>,
}

/// A sink, and what it wants.
struct Watching {
    id: SinkId,
    wants: Wants,
    sink: Box<dyn Sink>,
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

pub(crate) enum Destination {
    After(Duration),
    Until(Condition),
}

/// Somebody who waits for a condition while time runs by itself.
struct Waiter {
    condition: Condition,
    /// When it will hold, if it does before the device's next deadline.
    at: Option<Time>,
    ticket: Ticket,
}

/// Time is on its way.
struct Travel<D> {
    by: Source,
    ticket: Ticket,
    began: Time,
    /// Until this holds; `None` if it goes to a time.
    until: Option<Condition>,
    /// When that will be, as far as it has been looked.
    forecast: Option<Box<Forecast<D>>>,
    /// How many causes may still be looked ahead.
    causes: u32,
    /// Where it goes, if that is known.
    to: Option<Time>,
    paused: bool,
}

impl<D: Device + Clone> Travel<D> {
    /// Time stands still; what happens in the meantime may change when a condition will hold.
    fn pause(&mut self) {
        self.paused = true;
        if self.until.is_some() {
            (self.forecast, self.to, self.causes) = (None, None, MAX_CAUSES);
        }
    }

    /// Looks ahead for a few milliseconds at most, where it is not known yet where it goes.
    fn foresee(&mut self, device: &D) -> Foresight {
        let (None, Some(condition)) = (self.to, &self.until) else {
            return self.to.map_or(Foresight::Never, Foresight::At);
        };
        let forecast =
            self.forecast.get_or_insert_with(|| Box::new(Forecast::new(device, condition.clone())));
        let began = Instant::now();
        while self.causes > 0 && began.elapsed() < BATCH_TIME {
            let causes = self.causes.min(FORESIGHT);
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
}

/// What leaves the device at one time, so that it costs one write.
#[derive(Default)]
struct Leaving {
    first: Option<(Time, Bytes)>,
    /// All of it, if it is more than the first.
    all: Vec<u8>,
}

impl Leaving {
    /// Whether something that is said at a time belongs to it, and there is room.
    fn is_at(&self, at: Time) -> bool {
        self.all.len() < CHUNK && self.first.as_ref().is_none_or(|(first, _)| *first == at)
    }

    fn add(&mut self, at: Time, bytes: Bytes) {
        match &self.first {
            None => self.first = Some((at, bytes)),
            Some((_, first)) => {
                if self.all.is_empty() {
                    self.all.extend_from_slice(first);
                }
                self.all.extend_from_slice(&bytes);
            }
        }
    }

    fn take(&mut self) -> Option<(Time, Bytes)> {
        let (at, first) = self.first.take()?;
        let all = std::mem::take(&mut self.all);
        Some((at, if all.is_empty() { first } else { all.into() }))
    }
}

/// Why the task looked up.
enum Woken<D: Device> {
    /// Something has arrived on the line, and was passed on.
    Line,
    Job(Deferred<D>),
    Stop,
    /// Something is wished of a journey.
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
        stop: oneshot::Receiver<()>,
    ) -> Runner<D> {
        let baud = device.baud();
        let powered = device.view(device.now()).powered;
        let mut runner = Runner {
            device,
            clock,
            ticking: None,
            behind: None,
            transports: Vec::new(),
            first: 0,
            flash: None,
            name: Arc::from(""),
            sinks: Vec::new(),
            last_sink: 0,
            wants: Wants::default(),
            baud,
            ready: true,
            jobs,
            asked: Bell::default(),
            orders: Bell::default(),
            nudges,
            stop,
            journey: None,
            waiters: Vec::new(),
            seen: VecDeque::new(),
            failure: None,
            early: Vec::new(),
            half: HalfLine::default(),
            feeds: LineFeeds::default(),
            clients: Vec::new(),
            speaker: None,
            said: 0,
            unpowered: (!powered).then_some(0),
        };
        runner.watch_kinds();
        runner
    }

    /// Keeps the device's flash memory in a file. `image` is what the file held when it was
    /// opened; where the device reads it differently (it drops a torn record, or begins a fresh
    /// memory), the file follows.
    pub fn with_flash(
        mut self,
        mut file: FlashFile,
        image: &[u8],
    ) -> Result<Runner<D>, FlashFileError> {
        let present = self.device.flash_image();
        if present != image {
            // A new file is not worth a word.
            if !image.is_empty() {
                let (what, file) = (difference(image, &present), file.path().display().to_string());
                self.early.push(News::FlashMended { file, what });
            }
            file.apply(&vimc4_device::FlashChange::Replace(Bytes::from(present)))?;
            file.sync()?;
        }
        self.flash = Some(file);
        Ok(self)
    }

    /// Gives it a name, by which its reports are told from those of other controllers of the process.
    #[must_use]
    pub fn named(mut self, name: &str) -> Runner<D> {
        self.name = Arc::from(name);
        self
    }

    /// Says what ends a line, so that a half line that a client has left can be told of when the
    /// next one comes. With `fresh` it is forgotten instead: the device gets whole lines only.
    #[must_use]
    pub fn with_lines(mut self, ends: &'static [u8], fresh: bool) -> Runner<D> {
        self.half = HalfLine::new(ends, fresh);
        self
    }

    /// Says what ends a line, as bytes and in words, where LF does not: a client that ends its lines
    /// with LF alone waits for an answer that will never come, and is told so.
    #[must_use]
    pub fn with_line_feeds(mut self, ends: &'static [u8], right: &'static str) -> Runner<D> {
        self.feeds = LineFeeds::new(ends, right);
        self
    }

    /// Opens a way to the line.
    pub fn attach(&mut self, mut transport: Box<dyn Transport>) {
        transport.set_baud(self.baud);
        if !self.ready {
            transport.set_ready(false);
        }
        self.transports.push(transport);
    }

    /// Lets a sink watch from now on.
    pub fn watch(&mut self, mut sink: Box<dyn Sink>) -> SinkId {
        let wants = sink.wants();
        if wants.inputs {
            let what = What::State { by: None, state: self.written_state() };
            let report = Report { controller: Arc::clone(&self.name), at: self.device.now(), what };
            sink.report(&report, &|command| self.device.explain(command));
        }
        self.last_sink += 1;
        let id = SinkId(self.last_sink);
        self.sinks.push(Watching { id, wants, sink });
        self.mind_wants();
        id
    }

    /// Lets go of a sink. Returns whether it was still there.
    pub fn detach(&mut self, id: SinkId) -> bool {
        let before = self.sinks.len();
        self.sinks.retain(|watching| watching.id != id);
        self.mind_wants();
        self.sinks.len() < before
    }

    fn mind_wants(&mut self) {
        self.wants = self.sinks.iter().fold(Wants::default(), |all, of| all.and(of.wants));
        self.watch_kinds();
    }

    fn watch_kinds(&mut self) {
        let needed = self.waiters.iter().map(|waiter| waiter.condition.kinds());
        self.device.watch(needed.fold(self.wants.kinds, Kinds::and));
    }

    /// The state of the device as it is written down. Every state can be; if one should not, there
    /// is nothing to be told of it.
    fn written_state(&self) -> serde_json::Value {
        serde_json::to_value(self.device.state()).unwrap_or_default()
    }

    /// The device.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// Runs until it is told to stop, until nobody holds a handle any more, or until the flash
    /// file fails.
    pub async fn run(mut self) -> Result<(), RunError> {
        let mut timer = Timer::new().map_err(RunError::Timer)?;
        self.ticking = self.clock.rate().map(|rate| Ticking::start(rate, self.device.now()));
        for news in std::mem::take(&mut self.early) {
            self.news_at(self.device.now(), news);
        }
        // The device may have had something to say before the first input.
        self.drain();
        loop {
            let busy = self.move_time();
            self.dismiss_listeners();
            if let Some(failure) = self.failure.take() {
                self.end(self.device.now());
                return Err(failure);
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
                    self.catch_up();
                    job(&mut self);
                }
                Woken::Stop => {
                    self.end(self.present());
                    return Ok(());
                }
                Woken::Nudge => self.give_up_waiting(),
                Woken::Time => self.jump(),
            }
        }
    }

    /// The device ends with its task, as if the power had gone: who watches learns what that cuts
    /// short, and what has not been told yet. For a recording of what goes in it is over.
    fn end(&mut self, at: Time) {
        self.tell_unheard(at);
        self.news_at(at, News::Ends);
        self.sinks.retain(|watching| !watching.wants.inputs);
        self.mind_wants();
        if self.wants.kinds.contain(Kinds::ANSWER) {
            self.input_at(Input::Power(false), at, None);
        }
    }

    /// Waits for something to happen; with `busy` it only looks.
    async fn look_up(&mut self, timer: &mut Timer, busy: bool) -> Woken<D> {
        poll_fn(|cx| {
            let Runner { stop, nudges, orders, .. } = &mut *self;
            let ordered = orders.answer(cx, |cx| {
                if Pin::new(stop).poll(cx).is_ready() {
                    return Poll::Ready(Woken::Stop);
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
            for transport in &mut self.transports {
                transport.poll_send(cx);
            }
            // A journey through time and its catching up are not disturbed: what arrives in
            // between arrives when they have ended, or in a pause.
            let travels = self.journey.as_ref().is_some_and(|travel| !travel.paused);
            if !travels && self.behind.is_none() {
                if self.poll_line(cx).is_ready() {
                    return Poll::Ready(Woken::Line);
                }
                let Runner { jobs, asked, .. } = &mut *self;
                match asked.answer(cx, |cx| jobs.poll_recv(cx)) {
                    Poll::Ready(Some(job)) => return Poll::Ready(Woken::Job(job)),
                    Poll::Ready(None) => return Poll::Ready(Woken::Stop),
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

    /// Asks the transports for what has arrived, beginning after the one that spoke last, and
    /// takes it in. What is read lies in a buffer of the thread: a controller that waits keeps none.
    fn poll_line(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        BUFFER.with_borrow_mut(|buffer| self.poll_transports(cx, buffer))
    }

    fn poll_transports(&mut self, cx: &mut Context<'_>, buffer: &mut [u8; CHUNK]) -> Poll<()> {
        let count = self.transports.len();
        for offset in 0..count {
            let index = (self.first + offset) % count;
            let transport = &mut self.transports[index];
            // What the device does not take now stays with the client, whose operating system
            // holds it back.
            let room = self.device.room(transport.has_handshake()).min(buffer.len());
            if let Poll::Ready(received) = transport.poll_receive(cx, &mut buffer[..room]) {
                self.first = index + 1;
                self.receive(index, received, buffer);
                return Poll::Ready(());
            }
        }
        Poll::Pending
    }

    /// Lets go of clients that have closed their side of the line, once they have every answer.
    fn dismiss_listeners(&mut self) {
        for transport in &mut self.transports {
            if transport.has_listener() && self.device.is_idle() {
                transport.dismiss_listener();
            }
        }
    }

    /// Takes in everything that was sent before a control was used, although its news may still
    /// be under way: a program that writes a command and then asks where the machine is expects them to
    /// be handled in that order.
    async fn settle(&mut self) {
        // A client that never stops sending must not keep the control from being used.
        for _ in 0..64 {
            reactor_turn().await;
            for transport in &mut self.transports {
                transport.look_closely();
            }
            let looked = poll_fn(|cx| Poll::Ready(self.poll_line(cx))).await;
            if looked.is_pending() {
                return;
            }
        }
    }

    /// Takes in what a transport has to say. All that comes of it has one time.
    fn receive(&mut self, from: usize, received: Received, buffer: &[u8]) {
        match received {
            Received::Bytes(count) => {
                let at = self.catch_up_to_present();
                let bytes = buffer.get(..count).unwrap_or_default();
                self.mind_speaker(from, at);
                self.take_line(from, bytes, at);
                if let Some(right) = self.feeds.wrong(bytes) {
                    let transport = Arc::clone(self.transports[from].label());
                    self.news_at(at, News::LineFeed { transport, right: right.into() });
                }
                self.disappoint();
            }
            Received::Finished => {}
            Received::News(news) => {
                let at = self.catch_up_to_present();
                let half = self.mind_clients(&news);
                let coming = matches!(news, News::Opened { .. });
                // A client that comes is told what it will find, and of one that goes what it has left.
                if coming {
                    half.into_iter().for_each(|half| self.news_at(at, half));
                    self.news_at(at, news);
                } else {
                    self.news_at(at, news);
                    half.into_iter().for_each(|half| self.news_at(at, half));
                }
            }
        }
        self.transports.retain(|transport| !transport.is_finished());
    }

    /// Passes on what has arrived, and says when it begins behind a half line of somebody else.
    fn take_line(&mut self, from: usize, bytes: &[u8], at: Time) {
        if self.half.is_off() {
            return self.bytes(from, bytes, at);
        }
        let by = (self.half.is_begun() || !self.half.is_whole(bytes)).then(|| self.source(from));
        if let Some(by) = &by
            && let Some(half) = self.half.spoils(by, &self.clients)
        {
            let transport = Arc::clone(self.transports[from].label());
            self.news_at(at, News::HalfLine { transport, half, spoils: true });
        }
        let given = self.half.take(bytes, by);
        match given {
            Cow::Borrowed(bytes) => self.bytes(from, bytes, at),
            Cow::Owned(bytes) if bytes.is_empty() => {}
            Cow::Owned(bytes) => self.bytes(from, &bytes, at),
        }
        // What somebody has written last may come in only when others are alone, elsewhere.
        if !self.clients.is_empty()
            && let Some(half) = self.half.comes_late(&self.clients)
        {
            let transport = Arc::clone(self.transports[from].label());
            self.news_at(at, News::HalfLine { transport, half, spoils: false });
        }
    }

    /// Bytes reach the device. Of those that act at once it is said who has sent them.
    fn bytes(&mut self, from: usize, bytes: &[u8], at: Time) {
        let urgent = self.wants.kinds.contain(Kinds::COMMAND)
            && bytes.iter().any(|byte| self.device.is_urgent(*byte));
        // Who has sent them takes some finding out.
        let by = (self.wants.inputs || urgent).then(|| self.source(from));
        let Some(by) = by.as_ref().filter(|_| urgent) else {
            return self.input_at(Input::Bytes(bytes), at, by.as_ref());
        };
        let mut rest = bytes;
        while let Some(place) = rest.iter().position(|byte| self.device.is_urgent(*byte)) {
            let (before, after) = rest.split_at(place);
            if !before.is_empty() {
                self.input_at(Input::Bytes(before), at, Some(by));
            }
            let (first, after) = after.split_at(1);
            let deed = Deed::Byte(first.first().copied().unwrap_or_default());
            self.pass_time(at);
            self.news_at(at, News::Deed { by: by.clone(), deed: deed.clone() });
            // A device may answer such a byte although nothing comes of it.
            let before = self.device.state();
            self.input_at(Input::Bytes(first), at, Some(by));
            if self.device.state() == before {
                let off = self.unpowered.is_some();
                let why =
                    if off { "the power is off" } else { "there is nothing that it could end" };
                self.news_at(at, News::NoEffect { by: by.clone(), deed, why: Some(why.into()) });
            }
            rest = after;
        }
        if !rest.is_empty() {
            self.input_at(Input::Bytes(rest), at, Some(by));
        }
    }

    /// Who sends on a transport.
    fn source(&self, from: usize) -> Source {
        let label = self.transports.get(from).map(|transport| transport.label().as_ref());
        let label = label.unwrap_or_default();
        let of = |source: &&Source| match source {
            Source::Client { transport, .. } => transport == label,
            Source::Controls(_) => false,
        };
        let known = self.clients.iter().rfind(of).cloned();
        known.unwrap_or_else(|| Source::Client { transport: label.to_owned(), client: None })
    }

    /// Says who speaks, where it could be somebody else.
    fn mind_speaker(&mut self, from: usize, at: Time) {
        let alone = self.clients.len() < 2 && self.speaker.is_none();
        if alone || self.sinks.is_empty() {
            return;
        }
        let source = self.source(from);
        if self.speaker.as_ref() == Some(&source) {
            return;
        }
        if let Source::Client { client, .. } = &source {
            let transport = Arc::clone(self.transports[from].label());
            let client = client.clone().unwrap_or_else(|| "a client".to_owned());
            self.news_at(at, News::Speaks { transport, client });
        }
        self.speaker = Some(source);
    }

    /// A client that may send comes or goes, with the half line that it has left.
    fn mind_clients(&mut self, news: &News) -> Option<News> {
        let source = |transport: &Arc<str>, client: &String| Source::Client {
            transport: transport.as_ref().to_owned(),
            client: Some(client.clone()),
        };
        let (transport, half) = match news {
            // An observer sends nothing.
            News::Opened { observes: true, .. } | News::Closed { observes: true, .. } => {
                return None;
            }
            News::Opened { transport, client, .. } => {
                self.feeds.begin();
                let half = self.half.comes(transport, &self.clients);
                self.clients.push(source(transport, client));
                (transport, half)
            }
            News::Closed { transport, client, .. } => {
                let gone = source(transport, client);
                if let Some(place) = self.clients.iter().position(|source| *source == gone) {
                    self.clients.remove(place);
                }
                if self.clients.is_empty() {
                    // The next client is the only one that can send.
                    self.speaker = None;
                }
                (transport, self.half.goes(&gone, &self.clients))
            }
            _ => return None,
        };
        let transport = Arc::clone(transport);
        half.map(|half| News::HalfLine { transport, half, spoils: false })
    }

    /// Lets time pass until the destination is reached, and then replies.
    pub(crate) fn set_out(&mut self, by: Source, destination: Destination, ticket: Ticket) {
        let now = self.device.now();
        ticket.tell(Progress { now, ..Progress::default() });
        if self.journey.is_some() {
            return ticket.end(Err(ControlError::Unsupported(
                "time is on its way already, and paused; resume or cancel that journey first",
            )));
        }
        let (until, to) = match destination {
            Destination::After(span) => (None, Some(now + span)),
            Destination::Until(condition) => (Some(condition), None),
        };
        if self.ticking.is_none() {
            let (forecast, causes, paused) = (None, MAX_CAUSES, false);
            let began = now;
            let travel = Travel { by, ticket, began, until, forecast, causes, to, paused };
            self.journey = Some(travel);
            return;
        }
        let Some(condition) = until else {
            return ticket.end(Err(ControlError::RunsByItself));
        };
        // What comes from outside can happen at any time.
        let by_itself = !condition.has_happenings();
        if by_itself && self.device.foresee(&condition, FORESIGHT) == Foresight::Never {
            return ticket.end(Err(ControlError::Never));
        }
        let at = self.device.crossing(&condition);
        self.waiters.push(Waiter { condition, at, ticket });
        self.watch_kinds();
        // It may have been given up before it began.
        self.give_up_waiting();
    }

    /// The time at which something happens now; what is due before has been done.
    fn catch_up_to_present(&mut self) -> Time {
        let at = self.present();
        if !self.is_due(at) {
            return at;
        }
        self.catch_up();
        self.present()
    }

    /// Somebody does something to the device, and learns whether anything has come of it.
    pub(crate) fn act(&mut self, by: &Source, deed: Deed, inputs: &[Input<'_>]) -> Effect {
        let at = self.catch_up_to_present();
        self.pass_time(at);
        let told = self.wants.kinds.contain(Kinds::COMMAND);
        if told {
            self.news_at(at, News::Deed { by: by.clone(), deed: deed.clone() });
        }
        let changed = self.changes(by, inputs, at);
        self.disappoint();
        if changed {
            return Effect::Something;
        }
        let why = self.why_without_effect(inputs, at);
        if told {
            let by = by.clone();
            self.news_at(at, News::NoEffect { by, deed, why: why.map(Cow::Borrowed) });
        }
        Effect::Nothing { why }
    }

    /// Why inputs have changed nothing.
    fn why_without_effect(&self, inputs: &[Input<'_>], at: Time) -> Option<&'static str> {
        // Nothing has changed, so what is so now was so before.
        let is_so = |id: SignalId, value: i32| {
            let signals = self.device.view(at).signals;
            signals.iter().any(|signal| signal.id == id && signal.value == Some(value))
        };
        let already = "it was so already";
        match inputs {
            [Input::Signal(signal, value)] if is_so(*signal, *value) => Some(already),
            // Of several things each may have undone the one before: the first reason that there is.
            _ => inputs
                .iter()
                .find_map(|input| match input {
                    Input::Signal(signal, value) => self.device.why_without_effect(*signal, *value),
                    _ => None,
                })
                .or((inputs.len() == 1).then_some(already)),
        }
    }

    /// Something happens to the device, of which all that is due by then has been done. Returns
    /// whether the device is another one than before, or has said or stored something.
    fn changes(&mut self, by: &Source, inputs: &[Input<'_>], at: Time) -> bool {
        let (before, said) = (self.device.state(), self.said);
        for input in inputs {
            self.input_at(*input, at, Some(by));
        }
        self.said != said || self.device.state() != before
    }

    /// Tells those who wait for what cannot come any more: the device rests.
    fn disappoint(&mut self) {
        if self.waiters.is_empty() || self.device.wake().is_some_and(|at| at != Time::NEVER) {
            return;
        }
        let hopeless =
            |waiter: &mut Waiter| waiter.at.is_none() && !waiter.condition.has_happenings();
        let hopeless = self.waiters.extract_if(.., hopeless).collect();
        self.dismiss_waiters(hopeless, || Err(ControlError::Never));
    }

    /// Nobody waits for these conditions any more, nor needs to see what they need.
    fn dismiss_waiters(
        &mut self,
        waiters: Vec<Waiter>,
        end: impl Fn() -> Result<Time, ControlError>,
    ) {
        if !waiters.is_empty() {
            self.watch_kinds();
        }
        for waiter in waiters {
            waiter.ticket.end(end());
        }
    }

    /// Lets go of those who do not want to wait any more.
    fn give_up_waiting(&mut self) {
        let at = self.device.now();
        let wish = |waiter: &mut Waiter| waiter.ticket.wish() == Wish::Cancel;
        let given_up = self.waiters.extract_if(.., wish).collect();
        self.dismiss_waiters(given_up, || Err(ControlError::Cancelled { at }));
    }

    /// The same as [`Device::handle`], and after each cause those are answered who have waited for
    /// what happened in it.
    fn handle_by_moments(&mut self, input: Input<'_>, at: Time) {
        while self.device.perform(at) {
            self.answer_waiters();
        }
        self.device.accept(input, at);
        self.answer_waiters();
        while self.device.perform(at) {
            self.answer_waiters();
        }
    }

    fn answer_waiters(&mut self) {
        let before = self.seen.len();
        while let Some(output) = self.device.poll_output() {
            self.seen.push_back(output);
        }
        let Runner { seen, device, waiters, .. } = self;
        let events = seen.range(before..).filter_map(Output::event);
        let met = |waiter: &mut Waiter| {
            let Waiter { condition, .. } = waiter;
            condition.has_happenings() && device.holds(condition, events.clone())
        };
        let now = device.now();
        let met = waiters.extract_if(.., met).collect();
        self.dismiss_waiters(met, || Ok(now));
    }

    /// Something happens to the device. Who has done it has to be known if anybody wants to see
    /// what goes in.
    fn input_at(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
        if self.wants.inputs
            && let Some(by) = by
        {
            let what = || What::Input { by: by.clone(), input: input.into() };
            self.tell(at, |wants| wants.inputs, what);
        }
        match (input, &mut self.unpowered) {
            (Input::Bytes(bytes), Some(unheard)) => {
                *unheard += u64::try_from(bytes.len()).unwrap_or(u64::MAX);
            }
            (Input::Power(true), _) => {
                self.tell_unheard(at);
                self.unpowered = None;
            }
            (Input::Power(false), None) => self.unpowered = Some(0),
            _ => {}
        }
        if self.waiters.iter().any(|waiter| waiter.condition.has_happenings()) {
            self.handle_by_moments(input, at);
        } else {
            self.device.handle(input, at);
        }
        self.drain();
        for waiter in &mut self.waiters {
            waiter.at = self.device.crossing(&waiter.condition);
        }
    }

    /// Nothing but time passes.
    fn pass_time(&mut self, at: Time) {
        self.input_at(Input::Wake, at, None);
    }

    /// Says how much has come in vain since the power was taken away.
    fn tell_unheard(&mut self, at: Time) {
        if let Some(unheard) = &mut self.unpowered
            && *unheard > 0
        {
            let bytes = std::mem::take(unheard);
            self.news_at(at, News::PowerWasOff { bytes });
        }
    }

    /// Continues from an earlier state.
    pub(crate) fn restore(&mut self, by: &Source, state: D::State) {
        let at = self.catch_up_to_present();
        self.pass_time(at);
        if self.wants.kinds.contain(Kinds::COMMAND) {
            self.news_at(at, News::Deed { by: by.clone(), deed: Deed::Restore });
        }
        self.tell_unheard(at);
        if let Some(travel) = self.journey.take() {
            // It is paused, and its destination belongs to another time.
            travel.ticket.end(Err(ControlError::Cancelled { at }));
        }
        let before = self.flash.is_some().then(|| self.device.flash_image());
        self.device.restore(state);
        self.watch_kinds();
        let now = self.device.now();
        self.unpowered = (!self.device.view(now).powered).then_some(0);
        if self.wants.inputs {
            let what = What::State { by: Some(by.clone()), state: self.written_state() };
            self.tell(at, |wants| wants.inputs, || what);
        }
        if let Some(rate) = self.clock.rate() {
            self.ticking = Some(Ticking::start(rate, now));
        }
        let after = self.device.flash_image();
        if before.is_some_and(|before| before != after) {
            self.store(&vimc4_device::FlashChange::Replace(Bytes::from(after)));
            self.secure();
        }
        self.pass_time(now);
        self.disappoint();
    }

    // --- time ---

    /// The model time at this moment.
    fn present(&self) -> Time {
        match &self.ticking {
            // While the device is behind, its own time is the present one.
            Some(ticking) if self.behind.is_none() => ticking.now().max(self.device.now()),
            _ => self.device.now(),
        }
    }

    /// Lets time pass as far as the clock says. Returns whether more is to be done at once.
    fn move_time(&mut self) -> bool {
        if let Some(mut travel) = self.journey.take() {
            let Some(end) = self.travel(&mut travel) else {
                let busy = !travel.paused;
                self.journey = Some(travel);
                return busy;
            };
            let Travel { by, ticket, began, .. } = travel;
            let now = self.device.now();
            if end.is_ok() || now > began {
                self.input_at(Input::Wake, now, Some(&by));
            }
            ticket.end(end);
        }
        if let Some(ticking) = self.ticking {
            // A device that has nothing to do yet need not be told that time passes.
            return self.has_deadline() && self.is_due(ticking.now()) && self.catch_up();
        }
        self.clock == Clock::Instant && self.next_deadline().is_some()
    }

    /// Goes on with a journey for a few milliseconds at most. Returns how it ends, if it does.
    fn travel(&mut self, travel: &mut Travel<D>) -> Option<Result<Time, ControlError>> {
        travel.paused = false;
        match travel.ticket.wish() {
            Wish::Cancel => {
                return Some(Err(ControlError::Cancelled { at: self.device.now() }));
            }
            Wish::Pause => travel.pause(),
            Wish::Go => match travel.foresee(&self.device) {
                Foresight::Never => return Some(Err(ControlError::Never)),
                Foresight::Open => {}
                Foresight::At(to) if self.run_to(to) => return Some(Ok(to)),
                Foresight::At(_) => {}
            },
        }
        let (now, to, paused) = (self.device.now(), travel.to, travel.paused);
        travel.ticket.tell(Progress { now, to, paused });
        None
    }

    /// The clock is `Instant` and nothing is readable: time jumps.
    fn jump(&mut self) {
        if self.clock == Clock::Instant && self.journey.is_none() {
            let began = Instant::now();
            for _ in 0..BATCH {
                let Some(due) = self.next_deadline() else { return };
                self.step(due);
                if self.failure.is_some() || began.elapsed() >= BATCH_TIME {
                    return;
                }
            }
        }
    }

    /// Performs what is due by now. Returns whether that did not come to an end.
    fn catch_up(&mut self) -> bool {
        let Some(ticking) = self.ticking else { return false };
        let done = self.run_to(ticking.now());
        if done {
            self.behind = None;
        } else if self.behind.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
            // The computer is too slow for this device at this speed. The clock gives way,
            // because a line that nobody reads would be worse.
            self.ticking = self.clock.rate().map(|rate| Ticking::start(rate, self.device.now()));
            self.behind = None;
        }
        !done
    }

    /// Performs causes one by one until `target`, for a few milliseconds at most. Returns
    /// whether it arrived.
    fn run_to(&mut self, target: Time) -> bool {
        let began = Instant::now();
        for _ in 0..BATCH {
            match self.next_deadline() {
                Some(due) if due <= target => self.step(due),
                _ => {
                    if self.device.now() < target {
                        self.step(target);
                    }
                    return true;
                }
            }
            if self.failure.is_some() || began.elapsed() >= BATCH_TIME {
                break;
            }
        }
        false
    }

    fn step(&mut self, at: Time) {
        self.pass_time(at);
        let now = self.device.now();
        let is_due = |waiter: &mut Waiter| waiter.at.is_some_and(|at| at <= now);
        let due = self.waiters.extract_if(.., is_due).collect();
        self.dismiss_waiters(due, || Ok(now));
        self.disappoint();
    }

    /// Whether something is to be done by then, or the device is behind its clock.
    fn is_due(&self, at: Time) -> bool {
        self.behind.is_some() || self.next_deadline().is_some_and(|due| due <= at)
    }

    /// Whether anything will be due at all. To look at the clock would cost more.
    fn has_deadline(&self) -> bool {
        self.behind.is_some() || self.next_deadline().is_some()
    }

    /// The next time at which the device does something, or somebody waits for it.
    fn next_deadline(&self) -> Option<Time> {
        let waiters = self.waiters.iter().filter_map(|waiter| waiter.at);
        self.device.wake().into_iter().chain(waiters).min().filter(|at| *at != Time::NEVER)
    }

    /// The moment at which the timer must ring.
    fn next_moment(&self) -> Option<Instant> {
        self.ticking.and_then(|ticking| ticking.moment_of(self.next_deadline()?))
    }

    // --- outputs ---

    /// Passes on what the device has to say, in order: what is stored is on disk before the
    /// answer that confirms it is sent. What is said at one and the same time leaves in one
    /// piece.
    fn drain(&mut self) {
        let mut leaving = Leaving::default();
        while let Some(output) = self.seen.pop_front().or_else(|| self.device.poll_output()) {
            match output {
                Output::Bytes(at, bytes) => {
                    if !leaving.is_at(at) {
                        self.send_all(&mut leaving);
                    }
                    leaving.add(at, bytes);
                }
                Output::Flash(_, change) => {
                    self.send_all(&mut leaving);
                    self.store(&change);
                }
                Output::Event(Stamp { at, command }, event) => {
                    self.send_all(&mut leaving);
                    let kind = event.kind();
                    let what = || What::Event { command, event };
                    self.tell(at, |wants| wants.kinds.contain(kind), what);
                }
            }
        }
        self.send_all(&mut leaving);
        self.secure();
        let baud = self.device.baud();
        if baud != self.baud {
            self.baud = baud;
            for transport in &mut self.transports {
                transport.set_baud(baud);
            }
        }
        let ready = self.device.room(true) > 0;
        if ready != self.ready {
            self.ready = ready;
            for transport in &mut self.transports {
                transport.set_ready(ready);
            }
        }
    }

    fn send_all(&mut self, leaving: &mut Leaving) {
        if let Some((at, bytes)) = leaving.take() {
            self.secure();
            self.send(at, bytes);
        }
    }

    fn store(&mut self, change: &vimc4_device::FlashChange) {
        self.said += 1;
        if let Some(flash) = &mut self.flash
            && let Err(error) = flash.apply(change)
        {
            self.failure.get_or_insert(error.into());
        }
    }

    fn secure(&mut self) {
        if let Some(flash) = &mut self.flash
            && let Err(error) = flash.sync()
        {
            self.failure.get_or_insert(error.into());
        }
    }

    fn send(&mut self, at: Time, bytes: Bytes) {
        if self.failure.is_some() {
            return;
        }
        self.said += 1;
        let mut heard = false;
        let mut losses = Vec::new();
        for transport in &mut self.transports {
            match transport.send(&bytes) {
                Sent::Nobody => {}
                Sent::Accepted => heard = true,
                Sent::Lost(bytes) => {
                    heard = true;
                    losses.push(News::Lost { transport: Arc::clone(transport.label()), bytes });
                }
            }
        }
        let lost = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        self.tell(at, |wants| wants.sent, || What::Sent { bytes });
        for news in losses {
            self.news_at(at, news);
        }
        if !heard {
            let event = Event::Warning(Warning::NobodyListens { lost });
            let what = || What::Event { command: None, event };
            self.tell(at, |wants| wants.kinds.contain(Kinds::WARNING), what);
        }
    }

    fn news_at(&mut self, at: Time, news: News) {
        self.tell(at, |_| true, || What::News(news));
    }

    /// Tells the sinks that want it.
    fn tell(&mut self, at: Time, wanted: impl Fn(&Wants) -> bool, what: impl FnOnce() -> What) {
        if self.sinks.is_empty() || !wanted(&self.wants) {
            return;
        }
        let report = Report { controller: Arc::clone(&self.name), at, what: what() };
        let Runner { sinks, device, .. } = self;
        let explain = |command: &[u8]| device.explain(command);
        let mut enough = false;
        for Watching { sink, .. } in sinks.iter_mut().filter(|of| wanted(&of.wants)) {
            sink.report(&report, &explain);
            enough |= sink.has_enough();
        }
        if enough {
            self.sinks.retain(|of| !of.sink.has_enough());
            self.mind_wants();
        }
    }
}

impl<D: Device + fmt::Debug> fmt::Debug for Runner<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Runner")
            .field("device", &self.device)
            .field("clock", &self.clock)
            .finish_non_exhaustive()
    }
}

/// How a file of flash memory differed from what the device has made of it, for people.
fn difference(held: &[u8], present: &[u8]) -> String {
    let torn = held.strip_prefix(present).map_or(0, <[u8]>::len);
    match torn {
        _ if unix_lines(held).as_ref() == present => {
            "had the line ends of Windows, and has its own again".to_owned()
        }
        0 => "was not as the controller writes it, and is now".to_owned(),
        1 => "the last byte was half a record, which counts as not written".to_owned(),
        torn => format!("{torn} bytes at its end were half a record, which counts as not written"),
    }
}

/// Lets the reactor look at the world, and comes back when it has. [`yield_now`] by itself comes
/// back as soon as anything wakes the task, and the control that has just been used does.
async fn reactor_turn() {
    struct Turn {
        task: Waker,
        over: AtomicBool,
    }

    impl Wake for Turn {
        fn wake(self: Arc<Self>) {
            self.over.store(true, Ordering::Release);
            self.task.wake_by_ref();
        }
    }

    let mut turn: Option<Arc<Turn>> = None;
    poll_fn(move |cx| {
        if let Some(turn) = &turn {
            return if turn.over.load(Ordering::Acquire) { Poll::Ready(()) } else { Poll::Pending };
        }
        let begun = Arc::new(Turn { task: cx.waker().clone(), over: AtomicBool::new(false) });
        let waker = Waker::from(Arc::clone(&begun));
        turn = Some(begun);
        pin!(yield_now()).poll(&mut Context::from_waker(&waker))
    })
    .await;
}
