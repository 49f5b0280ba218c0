//! What passes between a client and a device, and is recorded.

use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use bytes::Bytes;
use vimc4::{RecordingFile, recording_head};
use vimc4_catalogue::{Controller, Machine, Model};
use vimc4_device::{Device, Line, Time};
use vimc4_timeline::recording::{Entry, Given, What};

use crate::failure::Failure;

/// The clock of what was heard on the line of a real controller.
pub(super) const WALL: &str = "wall";

/// So many pieces wait for a client that does not read, before it loses what comes.
const WAITING: usize = 4_096;

/// What both directions share.
pub(super) struct Tap {
    tape: Mutex<Tape>,
    /// What writes to the device; `None` while it is gone.
    device: Mutex<Option<Box<dyn Write + Send>>>,
    /// Where what the device says goes to; `None` while there is no client.
    client: Mutex<Option<SyncSender<Bytes>>>,
}

/// The recording, and when it began.
pub(super) struct Tape {
    file: RecordingFile,
    began: Instant,
    by: Arc<str>,
}

impl Tap {
    pub(super) fn new(tape: Tape, device: Option<Box<dyn Write + Send>>) -> Tap {
        Tap { tape: Mutex::new(tape), device: Mutex::new(device), client: Mutex::new(None) }
    }

    /// The device is there, or is gone.
    pub(super) fn device(&self, writer: Option<Box<dyn Write + Send>>) {
        *lock(&self.device) = writer;
    }

    /// Passes on what the client says; it waits until the device takes it.
    pub(super) fn client_says(&self, bytes: &[u8]) {
        lock(&self.tape).given(Bytes::copy_from_slice(bytes));
        let mut device = lock(&self.device);
        let written = device.as_mut().is_some_and(|device| write(device, bytes).is_ok());
        drop(device);
        if !written {
            self.mark(&format!("{} bytes are lost, for the device is gone", bytes.len()));
        }
    }

    /// Somebody listens, or nobody does any more.
    pub(super) fn client(&self, listens: bool) -> Option<Receiver<Bytes>> {
        let mut client = lock(&self.client);
        if !listens {
            *client = None;
            return None;
        }
        let (sender, receiver) = sync_channel(WAITING);
        *client = Some(sender);
        Some(receiver)
    }

    /// Passes on what the device says, which has arrived then.
    pub(super) fn device_says(&self, at: Instant, bytes: Bytes) {
        lock(&self.tape).sent(at, bytes.clone());
        let client = lock(&self.client);
        let lost = client.as_ref().is_some_and(|client| {
            matches!(client.try_send(bytes.clone()), Err(TrySendError::Full(_)))
        });
        drop(client);
        if lost {
            self.mark(&format!("{} bytes are lost, for the client does not read", bytes.len()));
        }
    }

    /// Says something, here and in the recording.
    pub(super) fn note(&self, text: &str) {
        let _ = writeln!(io::stderr(), "{text}");
        self.mark(text);
    }

    fn mark(&self, text: &str) {
        lock(&self.tape).add(Instant::now(), What::Mark(text.to_owned()));
    }

    /// Ends the recording.
    pub(super) fn end(&self) {
        let tape = lock(&self.tape);
        tape.add(Instant::now(), What::End("it was ended".to_owned()));
        tape.file.finish();
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
        let tell = |trouble: &str| drop(writeln!(io::stderr(), "{trouble}"));
        let file = RecordingFile::create(path, head, size, Vec::new(), Box::new(tell));
        let file = file.map_err(Failure::usage)?;
        // What state it is really in nobody knows: it counts as just switched on.
        let fresh = Controller::new(model, Arc::clone(machine), b"").map_err(Failure::midway)?;
        let state = serde_json::to_value(Line::ideal(fresh).state()).unwrap_or_default();
        file.add(&Entry::new(Time::ZERO, What::State { by: None, state }));
        Ok(Tape { file, began: Instant::now(), by: Arc::from("client") })
    }

    fn given(&self, bytes: Bytes) {
        let by = Arc::clone(&self.by);
        self.add(Instant::now(), What::Given { by, given: Given::Bytes(bytes) });
    }

    fn sent(&self, at: Instant, bytes: Bytes) {
        self.add(at, What::Sent(bytes));
    }

    fn add(&self, at: Instant, what: What) {
        let nanos = at.saturating_duration_since(self.began).as_nanos();
        let at = Time::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX));
        self.file.add(&Entry::new(at, what));
    }
}

/// Writes all of it, however long that takes.
fn write(to: &mut dyn Write, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        match to.write(bytes) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(written) => bytes = bytes.get(written..).unwrap_or_default(),
            Err(error) if waits(&error) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

fn waits(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// What is shared is whole at any time, so a panic elsewhere is no reason to stop.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
