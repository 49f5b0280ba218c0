//! Standard output while controllers run.

use std::io::{self, ErrorKind, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// How many answers wait for a slow reader; further answers wait for room.
const WAITING: u32 = 64;

/// Writes answers in a thread of its own: a paused terminal (Ctrl-S), or a pipe without a reader,
/// delays neither controllers nor a requested end.
pub(crate) struct Answers {
    /// `None` if no thread could be started.
    texts: Option<Sender<(String, Room)>>,
    room: Arc<Semaphore>,
}

/// Room for one answer, until it is written.
pub(crate) struct Room(
    #[expect(dead_code, reason = "it is held until it is dropped")] Option<OwnedSemaphorePermit>,
);

impl Answers {
    pub(crate) fn begin() -> Answers {
        let (texts, coming) = channel::<(String, Room)>();
        let write = move || {
            for (text, room) in coming {
                say(&text);
                drop(room);
            }
        };
        let thread = thread::Builder::new().name("answers".to_owned()).spawn(write);
        let room = Arc::new(Semaphore::new(WAITING as usize));
        Answers { texts: thread.ok().map(|_| texts), room }
    }

    /// Waits until there is room for another answer.
    pub(crate) async fn room(&self) -> Room {
        // It is never closed.
        Room(Arc::clone(&self.room).acquire_owned().await.ok())
    }

    /// Has an answer written.
    pub(crate) fn give(&self, room: Room, text: String) {
        match &self.texts {
            Some(texts) => drop(texts.send((text, room))),
            None => say(&text),
        }
    }

    /// Waits until everything is written.
    pub(crate) async fn written(&self) {
        let _ = self.room.acquire_many(WAITING).await;
    }
}

/// Prints on standard output. A missing reader is no reason to end; any other failure to write is
/// reported once. Blocks as long as the reader does.
pub(crate) fn say(text: &str) {
    static SAID: AtomicBool = AtomicBool::new(false);
    let mut out = io::stdout().lock();
    if let Err(error) = out.write_all(text.as_bytes()).and_then(|()| out.flush())
        && error.kind() != ErrorKind::BrokenPipe
        && !SAID.swap(true, Ordering::Relaxed)
    {
        let _ = writeln!(
            io::stderr(),
            "cannot write to standard output: {error}; the controllers run all the same"
        );
    }
}
