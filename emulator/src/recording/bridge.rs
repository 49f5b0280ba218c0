//! What passes between a client and a device, and is recorded.

use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use serde_json::{Value, json};
use vimc4::{LineEvent, RecordingFile, recording_head};
use vimc4_catalogue::{Controller, Machine, Model};
use vimc4_device::{Device, Line, Names, Time};
use vimc4_timeline::recording::{Entry, Given, Player, WALL, What};

use super::controller::PlayedDevice;
use crate::failure::Failure;

/// How many pieces wait for a client that does not read, before it loses further ones.
const WAITING: usize = 4_096;

/// What both directions share.
pub(super) struct Tap {
    tape: Mutex<Tape>,
    /// Held while something is given, so that no answer to it leaves before it is recorded.
    giving: Mutex<()>,
    /// What writes to the device; `None` while it is gone.
    device: Mutex<Option<Box<dyn Write + Send>>>,
    /// The client that holds the line; `None` while there is none.
    client: Mutex<Option<Holder>>,
    /// The line has become free.
    free: Condvar,
}

/// The client that holds the line.
struct Holder {
    place: Place,
    /// Where what the device says goes to.
    ear: SyncSender<Bytes>,
}

/// Where a client is: the transport, and its name there.
#[derive(Clone)]
pub(super) struct Place {
    pub(super) transport: Arc<str>,
    pub(super) client: Arc<str>,
}

/// The recording, and when it began.
pub(super) struct Tape {
    file: RecordingFile,
    began: Instant,
    by: Arc<str>,
    /// What the device has said while something was being written to it, which is recorded first.
    late: Option<Vec<(Instant, Bytes)>>,
    /// When something was noted last: what is being written then is given no earlier.
    noted: Option<Instant>,
    twin: Option<Twin>,
}

/// The virtual controller to which everything is given as well, for the states with which the files
/// of a recording begin: a real one tells none.
struct Twin {
    player: Player<PlayedDevice>,
    /// How many bytes a file has at most, about.
    size: u64,
    /// How many bytes it has said, and how many the real one has.
    said: [u64; 2],
}

impl Tap {
    pub(super) fn new(tape: Tape, device: Option<Box<dyn Write + Send>>) -> Tap {
        let (tape, device) = (Mutex::new(tape), Mutex::new(device));
        Tap { tape, giving: Mutex::new(()), device, client: Mutex::new(None), free: Condvar::new() }
    }

    /// The device is there, or is gone.
    pub(super) fn device(&self, writer: Option<Box<dyn Write + Send>>) {
        *lock(&self.device) = writer;
    }

    /// Passes on what the client says; it waits until the device takes it. Only what the device has
    /// taken is recorded as given.
    pub(super) fn client_says(&self, place: &Place, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let _giving = lock(&self.giving);
            let at = lock(&self.tape).begin_giving();
            let mut device = lock(&self.device);
            let taken = device.as_mut().map(|device| write(device, bytes));
            drop(device);
            let count = taken.as_ref().and_then(|taken| taken.as_ref().ok()).copied();
            let (given, rest) = bytes.split_at(count.unwrap_or_default().min(bytes.len()));
            lock(&self.tape).given(at, given);
            bytes = rest;
            if count.is_none() {
                return self.unsent(place, bytes.len());
            }
        }
    }

    /// The device does not get so many bytes of a client.
    pub(super) fn unsent(&self, place: &Place, bytes: usize) {
        let Place { transport, client } = place;
        let told = json!({ "transport": **transport, "client": **client, "bytes": bytes });
        self.news(json!({ "unsent": told }));
    }

    /// The line belongs to this client, which gets what the device says, until it is
    /// [released](Tap::release); but not if another one holds it and does not leave in time.
    pub(super) fn hold(&self, place: &Place, limit: Duration) -> Option<Receiver<Bytes>> {
        let client = lock(&self.client);
        let waited = self.free.wait_timeout_while(client, limit, |client| client.is_some());
        let (mut client, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let (transport, name) = (Arc::clone(&place.transport), place.client.to_string());
        if let Some(holder) = &*client {
            let holder = holder.place.client.to_string();
            drop(client);
            let text = format!("{transport}: refused {name}, because {holder} holds the line");
            let _ = writeln!(io::stderr(), "{text}");
            self.tell(&LineEvent::Refused { transport, client: name, holder });
            return None;
        }
        let (ear, said) = sync_channel(WAITING);
        *client = Some(Holder { place: place.clone(), ear });
        // Before anything that it says.
        self.tell(&LineEvent::Opened { transport, client: name, observes: false });
        Some(said)
    }

    /// Whether a client holds the line.
    pub(super) fn is_held(&self) -> bool {
        lock(&self.client).is_some()
    }

    /// The client that holds the line has left.
    pub(super) fn release(&self) {
        let mut client = lock(&self.client);
        if let Some(Holder { place: Place { transport, client }, .. }) = client.take() {
            let client = client.to_string();
            self.tell(&LineEvent::Closed { transport, client, observes: false, taken_by: None });
        }
        self.free.notify_one();
    }

    /// Passes on what the device says, which has arrived then.
    pub(super) fn device_says(&self, at: Instant, bytes: Bytes) {
        let giving = lock(&self.giving);
        lock(&self.tape).sent(at, bytes.clone());
        drop(giving);
        let client = lock(&self.client);
        let lost = client.as_ref().is_some_and(|client| {
            matches!(client.ear.try_send(bytes.clone()), Err(TrySendError::Full(_)))
        });
        let transport = client.as_ref().map(|client| Arc::clone(&client.place.transport));
        drop(client);
        if let Some(transport) = transport.filter(|_| lost) {
            self.tell(&LineEvent::Lost { transport, bytes: bytes.len() as u64 });
        }
    }

    /// Says something, here and in the recording.
    pub(super) fn note(&self, text: &str) {
        let _ = writeln!(io::stderr(), "{text}");
        let mut tape = lock(&self.tape);
        let now = Instant::now();
        tape.noted = Some(now);
        tape.add(now, What::Mark(text.to_owned()));
    }

    fn tell(&self, news: &LineEvent) {
        // News can always be written.
        self.news(serde_json::to_value(news).unwrap_or_default());
    }

    fn news(&self, news: Value) {
        lock(&self.tape).add(Instant::now(), What::News(news));
    }

    /// Ends the recording, and returns whether everything could be written.
    pub(super) fn end(&self) -> bool {
        let mut tape = lock(&self.tape);
        tape.catch_up();
        tape.add(Instant::now(), What::End("it was ended".to_owned()));
        let is_whole = tape.file.is_open();
        tape.file.finish();
        is_whole
    }
}

impl Tape {
    /// Begins a recording of what is said on the line of a device.
    pub(super) fn begin(
        path: &Path,
        size: Option<u64>,
        device: &str,
        model: &Model,
        machine: &Arc<Machine>,
    ) -> Result<Tape, Failure> {
        let head = recording_head(model, machine, WALL, &format!("record {device}"));
        let tell = |error: &str| drop(writeln!(io::stderr(), "{error}"));
        let file = RecordingFile::create(path, head, size, Names::default(), Box::new(tell));
        let file = file.map_err(Failure::usage)?;
        // Its real state is unknown: it counts as just switched on.
        let fresh = Controller::new(model, Arc::clone(machine), b"").map_err(Failure::midway)?;
        let line = Line::ideal(fresh);
        let begun = line.state();
        let state = serde_json::to_value(&begun).unwrap_or_default();
        file.add(&Entry::new(Time::ZERO, What::State { by: None, state }));
        let twin = size.map(|size| {
            let mut player = Player::new(line);
            player.restore(begun);
            Twin { player, size, said: [0, 0] }
        });
        Ok(Tape {
            file,
            began: Instant::now(),
            by: Arc::from("client"),
            late: None,
            noted: None,
            twin,
        })
    }

    /// Something is written to the device from now on: what it says meanwhile comes after that.
    fn begin_giving(&mut self) -> Instant {
        self.late = Some(Vec::new());
        Instant::now()
    }

    /// So much of it was taken.
    fn given(&mut self, at: Instant, bytes: &[u8]) {
        if !bytes.is_empty() {
            let at = self.noted.map_or(at, |noted| at.max(noted));
            self.turn(at);
            let (by, bytes) = (Arc::clone(&self.by), Bytes::copy_from_slice(bytes));
            self.add(at, What::Given { by, given: Given::Bytes(bytes) });
        }
        self.catch_up();
    }

    fn sent(&mut self, at: Instant, bytes: Bytes) {
        match &mut self.late {
            Some(late) => late.push((at, bytes)),
            None => self.add(at, What::Sent(bytes)),
        }
    }

    /// Nothing is being written any more.
    fn catch_up(&mut self) {
        for (at, bytes) in self.late.take().unwrap_or_default() {
            self.add(at, What::Sent(bytes));
        }
    }

    /// Goes on in another file when this one is large enough: before something that is given, and
    /// when everything was answered, unless that does not happen for too long.
    fn turn(&mut self, at: Instant) {
        let at = self.time(at);
        let Some(twin) = &mut self.twin else { return };
        let written = self.file.written();
        if written < twin.size {
            return;
        }
        twin.run_to(at);
        if twin.said[0] == twin.said[1] || written / 2 >= twin.size {
            let state = twin.player.device().state();
            self.file.turn(at, &serde_json::to_value(state).unwrap_or_default());
            twin.said = [0, 0];
        }
    }

    fn add(&mut self, at: Instant, what: What) {
        let entry = Entry::new(self.time(at), what);
        self.file.add(&entry);
        if let Some(twin) = &mut self.twin {
            twin.follow(&entry);
        }
    }

    fn time(&self, at: Instant) -> Time {
        let nanos = at.saturating_duration_since(self.began).as_nanos();
        Time::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }
}

impl Twin {
    fn follow(&mut self, entry: &Entry) {
        // No state is among what a tap records later.
        let _ = self.player.play(entry, &|_| Err(String::new()));
        if let What::Sent(bytes) = &entry.what {
            self.said[1] += bytes.len() as u64;
        }
        self.count();
    }

    fn run_to(&mut self, at: Time) {
        self.player.run_to(at);
        self.count();
    }

    fn count(&mut self) {
        self.said[0] += self.player.said().drain(..).len() as u64;
    }
}

/// Writes as much as is taken at once; nothing is if it must be tried again.
fn write(to: &mut dyn Write, bytes: &[u8]) -> io::Result<usize> {
    match to.write(bytes) {
        Ok(0) => Err(ErrorKind::WriteZero.into()),
        Err(error) if waits(&error) => Ok(0),
        done => done,
    }
}

fn waits(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// The shared data is consistent at any time, so a panic elsewhere is no reason to stop.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
