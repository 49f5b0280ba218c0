//! A session with a client at the other end of a stream.
//!
//! A thread reads, so that what a client says is heard while a controller is on its way.

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, BufRead, Write};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;
use vimc4_dap::framing::{Decoder, Foreign};
use vimc4_dap::{Incoming, LARGEST, Outgoing, Refusal, Running, Session, request_progress};
use vimc4_device::{Time, show_nanos};

use super::live::Served;
use super::open::Doors;
use crate::framing;

/// So many messages wait at most while something takes long.
const MOST_WAITING: usize = 64;

/// After so long of a run there is something new to tell of it.
const SLICE: Duration = Duration::from_millis(100);

/// What takes longer is shown as progress.
const LONG: Duration = Duration::from_millis(300);

/// How a session has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// The client has said so.
    Disconnected,
    /// The client is gone.
    Vanished,
}

/// What a session waits for.
enum Heard {
    /// The client has said something.
    Said(Incoming),
    /// A controller that runs by itself has something to say.
    Rung,
}

/// Talks with a client until it goes. It may attach to controllers that run already. `refused` is told why,
/// if the client speaks another protocol.
pub(super) fn serve(
    input: impl BufRead + Send + 'static,
    output: impl Write,
    served: Option<Served>,
    refused: impl FnOnce(&str) + Send + 'static,
) -> io::Result<End> {
    let (sender, incoming) = sync_channel(1);
    let bell = sender.clone();
    // Where it finds no room there is something to be heard already, after which one looks.
    let ring = Arc::new(move || drop(bell.try_send(Heard::Rung)));
    let left = Arc::new(AtomicBool::new(false));
    let has_left = Arc::clone(&left);
    thread::Builder::new().name("client".to_owned()).spawn(move || {
        read(input, &sender, refused);
        has_left.store(true, Ordering::Release);
        // Whoever waits looks up.
        let _ = sender.send(Heard::Rung);
    })?;
    let mut client = Client {
        incoming,
        left,
        waiting: VecDeque::new(),
        is_gone: false,
        output,
        seq: 0,
        failure: None,
    };
    let mut session = Session::new(Box::new(Doors { served, ring }));
    let mut shown = BTreeMap::new();
    loop {
        client.look();
        session.look();
        for message in session.drain() {
            client.say(&message);
        }
        if let Some(failure) = client.failure.take() {
            return Err(failure);
        }
        if session.is_over() {
            return Ok(End::Disconnected);
        }
        if client.is_gone && client.waiting.is_empty() {
            return Ok(End::Vanished);
        }
        match (client.waiting.pop_front(), session.running()) {
            (Some(message), _) => heed(&mut session, &mut client, message),
            (None, Some(running)) => run(&mut session, &mut client, &running, &mut shown),
            (None, None) if session.has_unread() => {
                session.read_on(&mut |_| match client.look() > 0 || client.is_gone {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                });
            }
            (None, None) => client.wait(),
        }
    }
}

/// Reads until the end; an error is an end, too. What is no header is told of.
fn read(mut input: impl BufRead, sender: &SyncSender<Heard>, refused: impl FnOnce(&str)) {
    let mut decoder = Decoder::new(LARGEST);
    loop {
        let heard = match framing::read(&mut input, &mut decoder) {
            Ok(Some(frame)) => Incoming::read(frame),
            Err(error) if error.get_ref().is_some_and(|error| error.is::<Foreign>()) => {
                let refusal = Refusal(format!("{error}; the session ends"));
                let heard = Incoming::Unreadable { seq: 0, command: String::new(), refusal };
                let _ = sender.send(Heard::Said(heard));
                return refused(&error.to_string());
            }
            Ok(None) | Err(_) => return,
        };
        if sender.send(Heard::Said(heard)).is_err() {
            return;
        }
    }
}

/// A client at its stream.
struct Client<W> {
    incoming: Receiver<Heard>,
    /// Whether nothing more will come than has.
    left: Arc<AtomicBool>,
    /// What has come and was not heeded yet.
    waiting: VecDeque<Incoming>,
    is_gone: bool,
    output: W,
    /// The number of the message that was said last.
    seq: i64,
    /// Why something could not be said.
    failure: Option<io::Error>,
}

impl<W: Write> Client<W> {
    fn say(&mut self, message: &Outgoing) {
        self.seq += 1;
        if self.failure.is_none() {
            self.failure = framing::write(&mut self.output, &message.text(self.seq)).err();
        }
    }

    /// Waits for a message.
    fn wait(&mut self) {
        match self.incoming.recv() {
            Ok(Heard::Said(message)) => self.waiting.push_back(message),
            Ok(Heard::Rung) => {}
            Err(_) => self.is_gone = true,
        }
    }

    /// Takes what has come, and says how many messages that is.
    fn look(&mut self) -> usize {
        let before = self.waiting.len();
        let left = self.left.load(Ordering::Acquire);
        loop {
            match self.incoming.try_recv() {
                Ok(Heard::Said(message)) => self.put_up(message),
                Ok(Heard::Rung) => {}
                Err(_) => {
                    self.is_gone |= left;
                    return self.waiting.len() - before;
                }
            }
        }
    }

    /// Lets a message wait, unless too many do.
    fn put_up(&mut self, message: Incoming) {
        let is_urgent = message.breaks_off(None, None) || message.cancels().is_some();
        // What ends something takes the place of what waits for it.
        let is_full = self.waiting.len() >= MOST_WAITING * if is_urgent { 2 } else { 1 };
        match message {
            Incoming::Request(request) if is_full => {
                let text = format!("{MOST_WAITING} requests wait already; pause or cancel first");
                self.say(&Outgoing::Answer {
                    to: request.seq,
                    command: request.command,
                    result: Err(Refusal(text)),
                });
            }
            Incoming::Unreadable { .. } if is_full => {}
            message => self.waiting.push_back(message),
        }
    }

    /// Whether one of the last of those that wait ends what takes long.
    fn ends(&self, last: usize, run: Option<u64>, request: Option<i64>) -> bool {
        let new = self.waiting.iter().rev().take(last);
        self.is_gone
            || self.failure.is_some()
            || new.into_iter().any(|message| message.breaks_off(run, request))
    }
}

/// Heeds a message.
fn heed<W: Write>(session: &mut Session, client: &mut Client<W>, message: Incoming) {
    if let Some(number) = message.cancels() {
        let is_meant = |waiting: &Incoming| matches!(waiting, Incoming::Request(request) if request.seq == number);
        let place = client.waiting.iter().position(is_meant);
        if let Some(Incoming::Request(request)) =
            place.and_then(|place| client.waiting.remove(place))
        {
            session.refuse(request, Refusal::cancelled());
        }
    }
    let (request, title) = match &message {
        Incoming::Request(request) => (Some(request.seq), request.title()),
        Incoming::Unreadable { .. } => (None, String::new()),
    };
    let mut ends = client.ends(usize::MAX, None, request);
    let id = request.map(request_progress).filter(|_| session.shows_progress());
    let mut shown = Shown { since: Instant::now(), last: None };
    session.receive(message, &mut |at| {
        let new = client.look();
        ends = ends || client.ends(new, None, request);
        if let Some(id) = &id {
            shown.tell(client, id, &title, at);
        }
        if ends { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    if let Some(id) = id {
        shown.end(client, &id);
    }
}

/// A progress as its client sees it.
struct Shown {
    since: Instant,
    last: Option<Instant>,
}

impl Shown {
    /// Tells how far something has come that takes long, if it is time for that.
    fn tell<W: Write>(&mut self, client: &mut Client<W>, id: &str, title: &str, at: Time) {
        let now = Instant::now();
        if now - self.since > LONG && self.last.is_none_or(|last| now - last > LONG) {
            let event = if self.last.is_none() { "progressStart" } else { "progressUpdate" };
            client.say(&progress(event, id, title, at));
            self.last = Some(now);
        }
    }

    fn end<W: Write>(&self, client: &mut Client<W>, id: &str) {
        if self.last.is_some() {
            client.say(&Outgoing::event("progressEnd", json!({ "progressId": id })));
        }
    }
}

/// Lets a controller go on for a while.
fn run<W: Write>(
    session: &mut Session,
    client: &mut Client<W>,
    running: &Running,
    all: &mut BTreeMap<u64, Shown>,
) {
    let begun = Instant::now();
    let shows = session.shows_progress();
    let shown = all.entry(running.number).or_insert(Shown { since: begun, last: None });
    let mut ends = client.ends(usize::MAX, Some(running.number), None);
    session.run(&mut |at| {
        let new = client.look();
        ends = ends || client.ends(new, Some(running.number), None);
        if shows {
            shown.tell(client, &running.number.to_string(), &running.title, at);
        }
        let is_long = begun.elapsed() > SLICE;
        let yields = running.can_pause && (!client.waiting.is_empty() || is_long);
        if ends || yields { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    all.retain(|number, shown| {
        let goes_on = session.is_running(*number);
        if !goes_on {
            shown.end(client, &number.to_string());
        }
        goes_on
    });
}

fn progress(event: &'static str, id: &str, title: &str, at: Time) -> Outgoing {
    Outgoing::event(
        event,
        json!({
            "progressId": id,
            "title": title,
            "cancellable": true,
            "message": format!("at {}", show_nanos(at.as_nanos())),
        }),
    )
}
