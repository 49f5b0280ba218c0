//! Which programs have a terminal open.
//!
//! A PTY does not tell its near end when a client opens or closes the far end as long as
//! somebody, here we ourselves, keeps it open. inotify does: the kernel queues an event within
//! the client's `open` and `close`. One inotify instance serves all controllers of the process
//! (users may have 128), and one thread waits for it; but a program that receives something from a terminal
//! that counts as closed, or is about to send to one that counts as open, drains the queue first,
//! so that the answer to a client's first byte is never sent to nobody.
//!
//! inotify merges equal events that follow each other unread, so that two quick opens would be
//! counted as one. But a program that watches the folder too is told of each opening twice, in turns: once of
//! the folder and once of the terminal, and no two equal events follow each other. Only when two
//! processors do it at the very same time they still may. Where the count contradicts what is seen,
//! the open files of all processes that we may look at decide.

use std::collections::BTreeMap;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Waker;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::fs::inotify::{self, CreateFlags, ReadFlags, Reader, WatchFlags};
use rustix::fs::{Mode, OFlags, open};
use rustix::io::Errno;
use rustix::termios::{Action, QueueSelector, ioctl_tiocnxcl, tcflow, tcflush, tcgetattr};
use vimc4_lines::use_default_discipline;

use super::terminal::{LineSettings, set_raw};
use super::users::{User, Users};

/// The watch over one terminal.
#[derive(Debug)]
pub(super) struct Watch {
    watcher: Arc<Watcher>,
    number: i32,
}

/// What a look at a terminal shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Seen {
    /// Somebody other than we ourselves has it open.
    pub(super) open: bool,
    /// How often it is open, without our own descriptor.
    pub(super) opens: u32,
    /// How often the last client has closed it.
    pub(super) closings: u64,
}

#[derive(Debug)]
struct Watcher {
    inotify: OwnedFd,
    terminals: Mutex<BTreeMap<i32, Terminal>>,
    /// The thread has been started.
    attended: AtomicBool,
}

type Identity = (u64, u64);

/// The line discipline that every terminal begins with.
const N_TTY: u8 = 0;

#[derive(Debug)]
struct Terminal {
    /// Our own descriptor of the client's end.
    kept: OwnedFd,
    /// The client's end.
    path: PathBuf,
    /// Device and inode, by which its other descriptors are found.
    identity: Identity,
    /// The speed that every client finds.
    baud: u32,
    opens: u32,
    closings: u64,
    /// How many openings and closings of our own are still to be told of.
    own: (u32, u32),
    /// How many events there were.
    events: u64,
    waker: Option<Waker>,
}

impl Watch {
    /// Watches the terminal at `path`, of which `kept` stays open as long as the watch, and
    /// makes it a raw line at this speed for every client.
    pub(super) fn new(kept: OwnedFd, path: &Path, baud: u32) -> io::Result<Watch> {
        set_raw(&kept, baud)?;
        let watcher = Watcher::shared()?;
        let number = {
            let mut terminals = watcher.terminals();
            let flags = WatchFlags::OPEN | WatchFlags::CLOSE;
            if let Some(folder) = path.parent() {
                // It keeps the events apart, and nothing else depends on it.
                let _ = inotify::add_watch(&watcher.inotify, folder, flags);
            }
            let number = inotify::add_watch(&watcher.inotify, path, flags)?;
            let file = rustix::fs::fstat(&kept)?;
            let identity = (file.st_dev, file.st_ino);
            let terminal = Terminal {
                kept,
                path: path.to_owned(),
                identity,
                baud,
                opens: 0,
                closings: 0,
                own: (0, 0),
                events: 0,
                waker: None,
            };
            terminals.insert(number, terminal);
            number
        };
        Ok(Watch { watcher, number })
    }

    /// Which clients have it open at this moment.
    pub(super) fn look(&self) -> Seen {
        let mut terminals = self.watcher.terminals();
        self.watcher.drain(&mut terminals);
        terminals.get(&self.number).map_or_else(Seen::default, Terminal::seen)
    }

    /// Which clients have it open as far as is known, without asking the system. `waker` is told
    /// when that changes.
    pub(super) fn known(&self, waker: &Waker) -> Seen {
        self.watcher.attend();
        let mut terminals = self.watcher.terminals();
        let Some(terminal) = terminals.get_mut(&self.number) else { return Seen::default() };
        match &mut terminal.waker {
            Some(old) => old.clone_from(waker),
            none => *none = Some(waker.clone()),
        }
        terminal.seen()
    }

    /// Writes to the terminal if what was `seen` still holds. A client that closes it from now on
    /// is noticed only after the writing, and then the written bytes are flushed: they cannot slip
    /// through to the next client.
    pub(super) fn write_if<T>(&self, seen: Seen, write: impl FnOnce() -> T) -> Option<T> {
        let mut terminals = self.watcher.terminals();
        self.watcher.drain(&mut terminals);
        let terminal = terminals.get(&self.number)?;
        (seen == terminal.seen()).then(write)
    }

    /// How the line is set.
    pub(super) fn settings(&self) -> Option<LineSettings> {
        let terminals = self.watcher.terminals();
        LineSettings::of(&terminals.get(&self.number)?.kept).ok()
    }

    /// Clients find another speed from now on. One that is there has to change it itself, as on
    /// a real line.
    pub(super) fn set_baud(&self, baud: u32) {
        let mut terminals = self.watcher.terminals();
        self.watcher.drain(&mut terminals);
        if let Some(terminal) = terminals.get_mut(&self.number)
            && terminal.baud != baud
        {
            terminal.baud = baud;
            if terminal.opens == 0 {
                let _ = set_raw(&terminal.kept, baud);
            }
        }
    }

    /// Which programs have it open, in words, if they are more than one, or one that reads it in two
    /// places.
    pub(super) fn programs(&self) -> Option<String> {
        let identity = self.watcher.terminals().get(&self.number)?.identity;
        // Looking at all processes takes its time; nobody else waits for it.
        let users = Users::of_file(identity, None);
        let own = std::process::id();
        // Our own descriptor is not a program's.
        let ours = |user: &User| usize::from(user.process == own);
        let programs = users.seen.iter().filter(|user| user.descriptors > ours(user));
        let name = |user: &User| format!("{} (process {})", user.name, user.process);
        match programs.collect::<Vec<_>>().as_slice() {
            [] => None,
            // A program that reads in one place and writes in another gets every answer.
            [one] => {
                let handles = one.readers.saturating_sub(ours(one));
                (handles > 1).then(|| format!("{handles} handles of {}", name(one)))
            }
            many => Some(many.iter().map(|user| name(user)).collect::<Vec<_>>().join(" and ")),
        }
    }

    /// The terminal counts as closed: looks whether an opening was merged into another one, so that
    /// somebody has it open all the same. A program that opens it meanwhile is a new client, for
    /// which nothing sent before is meant.
    pub(super) fn is_open_after_all(&self) -> bool {
        // Looking at all processes takes its time; nobody else waits for it.
        let Some((identity, events)) = self.closed_since() else { return false };
        if !others(identity).0 {
            return false;
        }
        let mut terminals = self.watcher.terminals();
        self.watcher.drain(&mut terminals);
        match terminals.get_mut(&self.number) {
            Some(terminal) if terminal.events == events => {
                terminal.opens = 1;
                true
            }
            _ => false,
        }
    }

    /// The terminal and how many events it has had, if it counts as closed.
    fn closed_since(&self) -> Option<(Identity, u64)> {
        let mut terminals = self.watcher.terminals();
        self.watcher.drain(&mut terminals);
        let terminal = terminals.get(&self.number)?;
        (terminal.opens == 0).then_some((terminal.identity, terminal.events))
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        let mut terminals = self.watcher.terminals();
        let _ = inotify::remove_watch(&self.watcher.inotify, self.number);
        terminals.remove(&self.number);
    }
}

impl Watcher {
    /// The one of this process.
    fn shared() -> io::Result<Arc<Watcher>> {
        static SHARED: Mutex<Option<Arc<Watcher>>> = Mutex::new(None);
        let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(watcher) = &*shared {
            return Ok(Arc::clone(watcher));
        }
        let watcher = Arc::new(Watcher {
            inotify: inotify::init(CreateFlags::NONBLOCK | CreateFlags::CLOEXEC)?,
            terminals: Mutex::default(),
            attended: AtomicBool::new(false),
        });
        *shared = Some(Arc::clone(&watcher));
        Ok(watcher)
    }

    /// Starts the thread when the first controller waits, and not while the first ones are still
    /// being made: a new thread holds them up.
    fn attend(self: &Arc<Watcher>) {
        if self.attended.load(Ordering::Relaxed) || self.attended.swap(true, Ordering::Relaxed) {
            return;
        }
        let watcher = Arc::clone(self);
        let thread = std::thread::Builder::new().name("pty watch".to_owned());
        if thread.spawn(move || watcher.wait()).is_err() {
            // There may be one to be had next time.
            self.attended.store(false, Ordering::Relaxed);
        }
    }

    fn terminals(&self) -> MutexGuard<'_, BTreeMap<i32, Terminal>> {
        self.terminals.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The thread: it sleeps in the kernel until somebody opens or closes a terminal.
    fn wait(&self) {
        loop {
            match poll(&mut [PollFd::new(&self.inotify, PollFlags::IN)], None) {
                Ok(_) => self.drain(&mut self.terminals()),
                Err(Errno::INTR) => {}
                Err(_) => return,
            }
        }
    }

    /// Takes every event that is queued.
    fn drain(&self, terminals: &mut BTreeMap<i32, Terminal>) {
        let mut buffer = [MaybeUninit::uninit(); 4_096];
        let mut events = Reader::new(&self.inotify, &mut buffer);
        let (mut changed, mut closed) = (Vec::new(), Vec::new());
        while let Ok(event) = events.next() {
            let Some(terminal) = terminals.get_mut(&event.wd()) else { continue };
            terminal.events += 1;
            if event.events().contains(ReadFlags::OPEN) {
                match terminal.own.0.checked_sub(1) {
                    Some(own) => terminal.own.0 = own,
                    None => terminal.opens += 1,
                }
            }
            if event.events().intersects(ReadFlags::CLOSE_WRITE | ReadFlags::CLOSE_NOWRITE) {
                match terminal.own.1.checked_sub(1) {
                    Some(own) => terminal.own.1 = own,
                    None => {
                        terminal.opens = terminal.opens.saturating_sub(1);
                        if terminal.opens == 0 {
                            terminal.clear();
                        }
                    }
                }
                closed.push(event.wd());
            }
            if let Some(waker) = &terminal.waker {
                waker.wake_by_ref();
            }
            changed.push(event.wd());
        }
        for number in changed {
            if let Some(terminal) = terminals.get_mut(&number) {
                terminal.mend();
            }
        }
        for number in closed {
            if let Some(terminal) = terminals.get_mut(&number) {
                if terminal.opens > 0 {
                    terminal.recount();
                }
                terminal.settle();
            }
        }
    }
}

impl Terminal {
    fn seen(&self) -> Seen {
        Seen { open: self.opens > 0, opens: self.opens, closings: self.closings }
    }

    /// The last client has left: what it has not read is gone.
    fn clear(&mut self) {
        let _ = tcflush(&self.kept, QueueSelector::IFlush);
        self.closings += 1;
    }

    /// Exclusive use, a stopped output, a line discipline and the settings of a client end with
    /// it, unless the next one is there already and may have its own.
    fn settle(&self) {
        if self.opens == 0 {
            let _ = ioctl_tiocnxcl(&self.kept);
            // Asking for the one that is there already would take a lock that readers hold.
            if !tcgetattr(&self.kept).is_ok_and(|settings| settings.line_discipline == N_TTY) {
                let _ = use_default_discipline(&self.kept);
            }
            let _ = tcflow(&self.kept, Action::OOn);
            let _ = set_raw(&self.kept, self.baud);
        }
    }

    /// A client may hang the terminal up. Every descriptor of it is dead then, ours too, and the
    /// next program to open it finds it set up as an interactive terminal. It gets a living one of
    /// ours before the dead one is let go, so that the near end notices nothing.
    fn mend(&mut self) {
        // Other errors come from a line discipline that knows no settings.
        if tcgetattr(&self.kept).err() != Some(Errno::IO) {
            return;
        }
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let Ok(kept) = open(&self.path, flags, Mode::empty()) else { return };
        // Our opening, and the closing of the dead one, are told of like any other.
        self.own = (self.own.0 + 1, self.own.1 + 1);
        self.kept = kept;
        let _ = set_raw(&self.kept, self.baud);
    }

    /// One of several clients has left, or several closings were merged and nobody is there.
    fn recount(&mut self) {
        let (seen, all_looked_at) = others(self.identity);
        if seen {
            return;
        }
        if all_looked_at {
            self.opens = 0;
            self.clear();
        } else {
            // Somebody whom we may not see may have it open. Exclusive use, at least, must not
            // outlive who asked for it.
            let _ = ioctl_tiocnxcl(&self.kept);
        }
    }
}

/// Whether anybody other than we ourselves has a terminal open, and whether all could be asked.
fn others(identity: Identity) -> (bool, bool) {
    let users = Users::of_file(identity, None);
    // Our own descriptor is among them.
    let descriptors: usize = users.seen.iter().map(|user| user.descriptors).sum();
    (descriptors > 1, users.all_looked_at)
}
