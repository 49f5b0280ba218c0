//! What several of the tests use.

use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use vimc4::{Emulator, EventFilter, Kinds, LineEvent, Report, Sink};

pub(crate) use crate::limits::until as wait_until;
use crate::limits::{InTime, LIMIT};

/// Names the role in which this program starts itself.
pub(crate) const ROLE: &str = "VIMC4_ROBUST_ROLE";

/// This program in another role.
pub(crate) fn in_role(role: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.env(ROLE, role);
    command
}

pub(crate) fn has(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status_in_time().is_ok_and(|status| status.success())
}

pub(crate) fn connect(emulator: &Emulator) -> TcpStream {
    let stream = TcpStream::connect(emulator.tcp_addr().unwrap()).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    stream
}

/// A client on a pseudo-terminal that does not wait for ever.
pub(crate) struct Terminal(pub(crate) File);

impl Terminal {
    /// Opens it. A terminal that its last user had for itself is free a moment after that one
    /// has gone, so being told that it is busy is no reason to give up at once.
    pub(crate) fn open(path: &Path) -> Terminal {
        let deadline = Instant::now() + LIMIT;
        loop {
            match OpenOptions::new().read(true).write(true).open(path) {
                Ok(file) => return Terminal(file),
                Err(error) if error.kind() == ErrorKind::ResourceBusy => {
                    assert!(Instant::now() < deadline, "it stays locked");
                    thread::sleep(Duration::from_micros(100));
                }
                Err(error) => panic!("{}: {error}", path.display()),
            }
        }
    }

    /// Whether something can be read within this time.
    pub(crate) fn hears(&self, within: Duration) -> bool {
        let within = Timespec::try_from(within).unwrap();
        poll(&mut [PollFd::new(&self.0, PollFlags::IN)], Some(&within)).unwrap() > 0
    }
}

impl Read for Terminal {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        assert!(self.hears(LIMIT), "the controller does not answer");
        self.0.read(buffer)
    }
}

impl Write for Terminal {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

/// Sends a line and reads `count` bytes.
pub(crate) fn ask(port: &mut (impl Read + Write), line: &str, count: usize) -> String {
    port.write_all(format!("{line}\r").as_bytes()).unwrap();
    let mut answer = vec![0; count];
    port.read_exact(&mut answer).unwrap();
    String::from_utf8(answer).unwrap()
}

/// X as `@0P` reports it, with the other axes at zero.
pub(crate) fn at(x: usize) -> String {
    format!("0{x:06X}000000000000")
}

pub(crate) fn descriptors() -> usize {
    fs::read_dir("/proc/self/fd").unwrap().count()
}

/// Counts clients that have left, clients that have lost something, and those that have taken it
/// from each other.
#[derive(Clone, Default)]
pub(crate) struct Counts {
    pub(crate) closed: Arc<AtomicUsize>,
    pub(crate) lost: Arc<AtomicUsize>,
    pub(crate) shared: Arc<AtomicUsize>,
}

impl Counts {
    /// Does something and waits until a client has left.
    pub(crate) fn after_leaving(&self, leave: impl FnOnce()) {
        let left = self.closed.load(Ordering::SeqCst);
        leave();
        wait_until("the news of the leaving", || self.closed.load(Ordering::SeqCst) > left);
    }
}

impl Sink for Counts {
    fn wants(&self) -> EventFilter {
        EventFilter { kinds: Kinds::ALL, ..EventFilter::default() }
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        match report.news() {
            Some(LineEvent::Closed { .. }) => self.closed.fetch_add(1, Ordering::SeqCst),
            Some(LineEvent::Lost { .. }) => self.lost.fetch_add(1, Ordering::SeqCst),
            Some(LineEvent::Shared { .. }) => self.shared.fetch_add(1, Ordering::SeqCst),
            _ => 0,
        };
    }
}
