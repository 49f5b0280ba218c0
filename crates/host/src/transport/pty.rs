//! A pseudo-terminal: the line as a serial port of this computer.

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags, open};
use thiserror::Error;

use super::near::Near;
use super::outbox::Outbox;
use super::terminal::LineSettings;
use super::watch::{Seen, Watch};
use super::writes::{Writer, Writes};
use super::{Received, Sent, Transport, take};
use crate::LineEvent;

/// That several programs have it open is told no more often than this.
const REMINDER: Duration = Duration::from_secs(10);

/// How often the programs are looked up once another one has opened it.
const LOOKS: u32 = 3;

/// So many clients at most that came and went between two looks are told of.
const VISITS: u64 = 16;

/// More bytes that clients have written the system does not keep.
const KEPT: usize = 68 << 10;

/// A pseudo-terminal whose far end a client opens like a serial port.
///
/// The emulator keeps one descriptor of the client's end for itself. Without it the near end
/// would report the end of the file for ever once a first client has left, and a client that
/// died with exclusive use of the terminal would lock everybody else out.
///
/// What a client has not read when the last one closes is gone, as it is on a cable that is
/// pulled out: the next client reads nothing stale. (The flush takes place some ten microseconds
/// after the closing; only a client that opens and reads within them could be faster.) What a
/// client wrote before it closed still arrives. What it has set, such as a speed, an echo or
/// exclusive use, ends with it too: every client finds a raw line at the device's speed. Modem
/// lines do not exist here; a client that insists on them is told ENOTTY.
#[derive(Debug)]
pub struct Pty {
    label: Arc<str>,
    path: PathBuf,
    near: Near,
    outbox: Outbox,
    watch: Watch,
    writes: Writes,
    seen: Seen,
    /// It counts as closed since the last answer, which may be a mistake.
    unsure: bool,
    /// The speed of the device's line.
    baud: u32,
    /// The present client's settings have been compared with the device's.
    compared: bool,
    news: VecDeque<LineEvent>,
    /// What has been read already and comes after the news.
    early: VecDeque<u8>,
    /// How many more times the programs that have it open are looked up.
    looks: u32,
    /// How much has been taken in before the news that a client has gone.
    left_over: usize,
    /// When it was told that several programs have it open.
    told: Option<Instant>,
    /// The system is asked what has arrived and who has come and gone, although it has not told.
    closely: bool,
}

/// Why no pseudo-terminal can be opened.
#[derive(Debug, Error)]
pub enum PtyError {
    /// The system gives out no pair.
    #[error("cannot make a pseudo-terminal: {0}; is /dev/pts mounted?")]
    Pair(#[source] io::Error),
    /// The client's end cannot be set up or watched.
    #[error("cannot set up the pseudo-terminal {path}: {source}", path = .path.display())]
    SetUp {
        /// The client's end.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
}

impl Pty {
    /// Makes a pseudo-terminal in raw mode at this speed. It must be called within a tokio
    /// runtime.
    pub fn open(baud: u32) -> Result<Pty, PtyError> {
        let (near, path) = Near::open().map_err(PtyError::Pair)?;
        let failed = |source| PtyError::SetUp { path: path.clone(), source };
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let kept = open(&path, flags, Mode::empty()).map_err(|e| failed(e.into()))?;
        let watch = Watch::new(kept, &path, baud).map_err(failed)?;
        Ok(Pty {
            label: Arc::from("pty"),
            near,
            outbox: Outbox::default(),
            watch,
            writes: Writes::new(&path),
            seen: Seen::default(),
            unsure: false,
            baud,
            compared: false,
            news: VecDeque::new(),
            early: VecDeque::new(),
            looks: 0,
            left_over: 0,
            told: None,
            closely: false,
            path,
        })
    }

    /// The terminal that clients open, such as `/dev/pts/3`.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Looks up which programs have the terminal open now.
    fn look(&mut self) {
        let seen = self.watch.look();
        self.notice(seen);
    }

    /// Says what has changed since the last look.
    fn notice(&mut self, seen: Seen) {
        let transport = || Arc::clone(&self.label);
        let client = || "a client".to_owned();
        let opened =
            || LineEvent::Opened { transport: transport(), client: client(), observes: false };
        let closed = || LineEvent::Closed {
            transport: transport(),
            client: client(),
            observes: false,
            taken_by: None,
        };
        if seen.closings != self.seen.closings {
            // The terminal's own queue has been flushed; what waits here goes the same way.
            let bytes = self.outbox.clear();
            if bytes > 0 {
                self.news.push_back(LineEvent::Lost { transport: transport(), bytes });
            }
            let mut closings = seen.closings.wrapping_sub(self.seen.closings);
            if self.seen.open {
                self.news.push_back(closed());
                closings = closings.saturating_sub(1);
            }
            // A client that has come and gone since the last look was here all the same.
            for _ in 0..closings.min(VISITS) {
                self.news.push_back(opened());
                self.news.push_back(closed());
            }
            self.seen.open = false;
            self.unsure = true;
        }
        if seen.open && !self.seen.open {
            self.compared = false;
            self.news.push_back(opened());
        }
        if seen.opens <= 1 {
            self.looks = 0;
        } else if seen.opens > self.seen.opens {
            self.looks = LOOKS;
        }
        // A program that opens it is told of a moment before it can be seen to have it.
        if self.looks > 0 {
            self.looks -= 1;
            if self.told.is_none_or(|told| told.elapsed() >= REMINDER)
                && let Some(programs) = self.watch.programs()
            {
                self.looks = 0;
                self.told = Some(Instant::now());
                self.news.push_back(LineEvent::Shared { transport: transport(), programs });
            }
        }
        self.seen = seen;
    }

    /// Looks, once a client or a change of speed, whether the client talks as the device does.
    fn compare(&mut self) {
        if std::mem::replace(&mut self.compared, true) {
            return;
        }
        let Some(LineSettings { baud: client, parity }) = self.watch.settings() else { return };
        let transport = || Arc::clone(&self.label);
        // A speed of 0 means to hang up, which some programs use for a terminal without a line.
        if client != self.baud && client != 0 {
            let news = LineEvent::WrongSpeed {
                transport: transport(),
                client,
                line: self.baud,
                noise: false,
            };
            self.news.push_back(news);
        }
        if let Some(parity) = parity {
            self.news.push_back(LineEvent::WrongParity {
                transport: transport(),
                parity: parity.into(),
            });
        }
    }

    /// Reads the bytes that a client wrote before it closed, once its closing is next in order.
    ///
    /// It comes before the news, so that no half of a line is left of it. The next client may have written
    /// already. What only that one wrote, or both wrote, comes behind the news, as the next client's.
    fn read_left_over(&mut self, buffer: &mut [u8]) -> usize {
        if !self.news.front().is_some_and(is_closing) || self.left_over >= KEPT {
            return 0;
        }
        if !self.early.is_empty() {
            return take(&mut self.early, buffer);
        }
        // Of several clients that have come and gone, the last one.
        let is_last = self.news.iter().filter(|news| is_closing(news)).count() == 1;
        if !is_last || matches!(self.writes.writer(), Writer::Next | Writer::Nobody) {
            return 0;
        }
        let read = self.near.try_read(buffer).unwrap_or(0);
        if read > 0 && self.writes.writer() == Writer::Next {
            // The next client has written meanwhile.
            self.early.extend(buffer.iter().take(read));
            self.left_over = KEPT;
            return 0;
        }
        read
    }

    fn poll_read(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<io::Result<usize>> {
        if std::mem::take(&mut self.closely) {
            match self.near.try_read(buffer) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                read => return Poll::Ready(read),
            }
        }
        self.near.poll_read(cx, buffer)
    }
}

fn is_closing(news: &LineEvent) -> bool {
    matches!(news, LineEvent::Closed { .. })
}

impl Transport for Pty {
    fn label(&self) -> &Arc<str> {
        &self.label
    }

    /// A speed of 0 means to hang up, which some programs use for a terminal without a line.
    fn client_baud(&mut self) -> Option<u32> {
        self.watch.settings().map(|settings| settings.baud).filter(|baud| *baud != 0)
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<Received> {
        let known = self.watch.known(cx.waker());
        let seen = if self.closely { self.watch.look() } else { known };
        self.notice(seen);
        // It waits for the news no longer than for what the system keeps.
        let read = self.read_left_over(buffer);
        if read > 0 {
            self.left_over += read;
            return Poll::Ready(Received::Bytes(read));
        }
        if let Some(news) = self.news.pop_front() {
            self.left_over = 0;
            if is_closing(&news) && !self.news.iter().any(is_closing) {
                self.writes.has_left();
            }
            return Poll::Ready(Received::News(news));
        }
        if buffer.is_empty() {
            return Poll::Pending;
        }
        if !self.early.is_empty() {
            return Poll::Ready(Received::Bytes(take(&mut self.early, buffer)));
        }
        if self.writes.look() {
            // Whose bytes come next has to be known before they are read.
            self.look();
            if !self.news.is_empty() {
                return self.poll_receive(cx, buffer);
            }
        }
        match self.poll_read(cx, buffer) {
            Poll::Pending => Poll::Pending,
            Poll::Ready(Ok(n)) if n > 0 => {
                if n < buffer.len() {
                    self.writes.are_read();
                }
                if self.writes.look() {
                    // Somebody left between the look and the reading. Bytes of the next client wait for
                    // the news of that.
                    self.look();
                    if self.writes.writer() == Writer::Next {
                        self.left_over = KEPT;
                    }
                }
                // The news of the opening may be slower than the client's first bytes.
                if !self.seen.open {
                    self.look();
                }
                self.unsure |= !self.seen.open;
                self.compare();
                if self.news.is_empty() {
                    return Poll::Ready(Received::Bytes(n));
                }
                self.early.extend(&buffer[..n]);
                self.poll_receive(cx, buffer)
            }
            // With our own descriptor of the far end this does not happen; if it does, waiting
            // for the next wake-up is all there is to do.
            Poll::Ready(_) => Poll::Pending,
        }
    }

    /// A pseudo-terminal has no handshake lines: a client writes whether or not it may.
    fn has_handshake(&self) -> bool {
        false
    }

    fn poll_send(&mut self, cx: &mut Context<'_>) {
        while !self.outbox.is_empty() {
            self.look();
            let Pty { near, outbox, watch, seen, .. } = self;
            let mut write = |bytes: &[u8]| match near.poll_write(cx, bytes) {
                Poll::Ready(written) => written,
                Poll::Pending => Err(io::ErrorKind::WouldBlock.into()),
            };
            if watch.write_if(*seen, || outbox.flush(&mut write)).is_some() {
                return;
            }
        }
    }

    fn send(&mut self, bytes: &[u8]) -> Sent {
        // A client that has written is known. A client that is not yet known has missed nothing
        // that was meant for it, and clients of other transports must not pay for the question.
        if !self.seen.open {
            if !self.unsure {
                return Sent::Nobody;
            }
            self.look();
        }
        loop {
            if !self.seen.open {
                // The asking client may have closed only one of two descriptors.
                if !std::mem::take(&mut self.unsure) || !self.watch.is_open_after_all() {
                    return Sent::Nobody;
                }
                self.look();
                continue;
            }
            let Pty { near, outbox, watch, seen, .. } = self;
            match watch.write_if(*seen, || outbox.send(bytes, |bytes| near.try_write(bytes))) {
                Some(Ok(0)) => return Sent::Accepted,
                Some(Ok(lost)) => return Sent::Lost(lost),
                Some(Err(_)) => return Sent::Nobody,
                // Somebody has come or gone since the last look.
                None => self.look(),
            }
        }
    }

    fn look_closely(&mut self) {
        self.closely = true;
    }

    fn set_baud(&mut self, baud: u32) {
        self.baud = baud;
        self.compared = false;
        self.watch.set_baud(baud);
    }
}
