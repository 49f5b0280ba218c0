//! The supervisor: answers the kernel's questions for one terminal.

use std::collections::VecDeque;
use std::fs;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::OwnedFd;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::inotify::{self, CreateFlags, ReadFlags, Reader, WatchFlags};
use rustix::io::Errno;

use super::filter;
use super::request::{self, INTEGER, Layout, number};
use super::sys::{Asked, Listener, read_memory, write_memory};
use super::terminal::{Held, Identity, Terminal};
use crate::state::{Changed, Lines, Peer};

/// How often threads that wait for a line to change are checked. The kernel does not tell when a
/// signal is to interrupt a thread whose call is being answered, nor when a terminal goes away.
/// Nothing is checked while no thread waits.
const ROUND: Duration = Duration::from_millis(50);

/// How many of them are checked at a time, so that hundreds of them do not delay other calls.
const AT_ONCE: usize = 16;

/// What the kernel returns from a call that a signal interrupts: it becomes `EINTR`, or the call
/// is made again, as the signal's handler wants it.
const RESTART: i32 = 512;

/// Answers for one terminal.
pub(super) struct Supervisor {
    listener: Listener,
    terminal: Terminal,
    state: Mutex<State>,
    /// Called without holding the state, because it may want to change the state.
    peer: Mutex<Box<dyn Peer>>,
}

struct State {
    lines: Lines,
    waiting: VecDeque<Waiting>,
}

/// A thread in `TIOCMIWAIT`.
#[derive(Clone, Copy)]
struct Waiting {
    call: u64,
    thread: u32,
    mask: u32,
    terminal: Identity,
}

/// How often the terminal is open, as inotify reports it. Two openings at one instant may be
/// reported as one; a port that then counts as closed too early counts as open again with its next
/// request.
pub(super) struct Watch {
    inotify: Option<OwnedFd>,
    watched: Option<(Identity, i32)>,
    opens: u32,
}

/// What a request comes to.
enum Answer {
    /// It is not ours, or the kernel can best say what is wrong with it.
    GoOn,
    /// It returns 0 or this error.
    Is(i32),
    /// Nothing yet.
    Wait(Waiting),
    /// No thread waits for an answer any more.
    Nobody,
}

impl Supervisor {
    pub(super) fn new(
        listener: Listener,
        terminal: Terminal,
        lines: Lines,
        peer: Box<dyn Peer>,
    ) -> Supervisor {
        listener.hurry();
        let state = Mutex::new(State { lines, waiting: VecDeque::new() });
        Supervisor { listener, terminal, state, peer: Mutex::new(peer) }
    }

    /// Answers in a thread of its own, until no task is left that could ask.
    pub(super) fn start(self: &Arc<Supervisor>, watch: Watch) -> io::Result<()> {
        let supervisor = Arc::clone(self);
        thread::Builder::new().name("lines".to_owned()).spawn(move || supervisor.run(watch))?;
        Ok(())
    }

    /// The device takes more now, or does not.
    pub(super) fn set_ready(&self, ready: bool) {
        self.change(|lines| lines.set_ready(ready));
    }

    /// The device switches a line of its own.
    pub(super) fn set_line(&self, line: u32, on: bool) {
        self.change(|lines| lines.set_line(line, on));
    }

    fn peer(&self) -> MutexGuard<'_, Box<dyn Peer>> {
        self.peer.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the lines, reports what the program did to its own, and releases the threads that
    /// waited for the change.
    fn change(&self, change: impl FnOnce(&mut Lines) -> Changed) {
        let mut state = self.state();
        let State { lines, waiting } = &mut *state;
        let changed = change(lines);
        waiting.retain(|waiting| {
            let woken = changed.wakes(waiting.mask);
            if woken {
                self.listener.answer(waiting.call, 0);
            }
            !woken
        });
        drop(state);
        for (line, on) in changed.host() {
            self.peer().hears(line, on);
        }
    }

    // --- the thread ---

    fn run(&self, mut watch: Watch) {
        let mut round = None;
        loop {
            let somebody_waits = !self.state().waiting.is_empty();
            round = somebody_waits.then(|| round.unwrap_or_else(|| Instant::now() + ROUND));
            let Some((asked, opened)) = self.sleep(&watch, round) else { return };
            // Openings first: a thread that asks has opened the terminal before.
            if opened {
                self.follow(&mut watch);
            }
            if asked && self.serve(&mut watch).is_err() {
                return;
            }
            if round.is_some_and(|round| round <= Instant::now()) {
                self.look_after(&mut watch);
                round = None;
            }
        }
    }

    /// Waits for a question, an opening or closing, or the next check. Returns whether there is a
    /// question and whether there was an opening or closing; `None` when no task is left.
    fn sleep(&self, watch: &Watch, round: Option<Instant>) -> Option<(bool, bool)> {
        let left = round.map(|round| {
            let left = round.saturating_duration_since(Instant::now());
            Timespec {
                tv_sec: 0,
                tv_nsec: left.as_nanos().min(999_999_999).try_into().unwrap_or(0),
            }
        });
        let listener = self.listener.descriptor();
        let inotify = watch.inotify.as_ref().unwrap_or(listener);
        let mut events =
            [PollFd::new(listener, PollFlags::IN), PollFd::new(inotify, PollFlags::IN)];
        match poll(&mut events, left.as_ref()) {
            Err(Errno::INTR) => return Some((false, false)),
            Err(_) => return None,
            Ok(_) => {}
        }
        let [asked, opened] = events.map(|event| event.revents());
        if asked.contains(PollFlags::IN) {
            return Some((true, opened.contains(PollFlags::IN)));
        }
        if asked.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL) {
            return None;
        }
        Some((false, opened.contains(PollFlags::IN)))
    }

    /// Takes one question and answers it.
    fn serve(&self, watch: &mut Watch) -> io::Result<()> {
        let asked = match self.listener.receive() {
            Ok(asked) => asked,
            // It was killed or interrupted before we came to it.
            Err(error) if matches!(error.raw_os_error(), Some(libc::ENOENT | libc::EINTR)) => {
                return Ok(());
            }
            Err(error) => return Err(error),
        };
        match self.decide(watch, &asked) {
            Answer::GoOn => self.listener.go_on(asked.id),
            Answer::Is(error) => self.listener.answer(asked.id, error),
            Answer::Wait(waiting) => self.state().waiting.push_back(waiting),
            Answer::Nobody => {}
        }
        Ok(())
    }

    fn decide(&self, watch: &mut Watch, asked: &Asked) -> Answer {
        let Some(layout) = filter::layout(asked.architecture, asked.number) else {
            return Answer::GoOn;
        };
        let [descriptor, request, argument, ..] = asked.arguments;
        // The kernel takes no notice of the upper halves of these two.
        let low = |argument: u64| u32::try_from(argument & 0xFFFF_FFFF).unwrap_or_default();
        let (descriptor, request) = (low(descriptor), low(request));
        let Some(terminal) = self.identity(watch) else { return Answer::GoOn };
        let held = match asked.thread {
            0 => Held::Not,
            thread => terminal.held_as(thread, descriptor),
        };
        // What we read is that thread's memory only if the thread still waits.
        if held == Held::Not || !self.listener.waits(asked.id) {
            return Answer::GoOn;
        }
        if held == Held::Named {
            return Answer::Is(libc::EBADF);
        }
        if watch.opens == 0 {
            watch.opens = 1;
            self.change(Lines::opened);
        }
        if request == number::TIOCMIWAIT {
            // Its argument is the mask itself.
            let (call, thread) = (asked.id, asked.thread);
            return Answer::Wait(Waiting { call, thread, mask: low(argument), terminal });
        }
        match self.perform(asked, request, argument, layout) {
            Ok(true) => Answer::Is(0),
            Ok(false) => Answer::Nobody,
            Err(error) => match error.raw_os_error() {
                Some(libc::EFAULT) => Answer::Is(libc::EFAULT),
                // We may not look into this program, so it is served as if we were not here.
                _ => Answer::GoOn,
            },
        }
    }

    /// Carries out a request with an argument in memory. Returns whether the thread still waits.
    fn perform(
        &self,
        asked: &Asked,
        request: u32,
        argument: u64,
        layout: Layout,
    ) -> io::Result<bool> {
        let write = |bytes: &[u8]| -> io::Result<bool> {
            if !self.listener.waits(asked.id) {
                return Ok(false);
            }
            write_memory(asked.thread, argument, bytes).map(|()| true)
        };
        match request {
            number::TIOCMGET => {
                let takes_more = self.peer().takes_more();
                if let Some(ready) = takes_more {
                    self.set_ready(ready);
                }
                let levels = self.state().lines.levels();
                write(&levels.to_le_bytes())
            }
            number::TIOCGICOUNT => {
                let counts = self.state().lines.counts();
                write(&request::counters(counts))
            }
            number::TIOCGSERIAL => {
                let settings = self.state().lines.settings();
                write(&request::settings(settings, layout))
            }
            // Whatever is written is taken at once, so the transmitter is always empty.
            number::TIOCSERGETLSR => write(&1_u32.to_le_bytes()),
            number::TIOCSSERIAL => {
                let mut bytes = vec![0; request::settings_size(layout)];
                read_memory(asked.thread, argument, &mut bytes)?;
                if !self.listener.waits(asked.id) {
                    return Ok(false);
                }
                if let Some(settings) = request::read_settings(&bytes) {
                    self.state().lines.set_settings(settings);
                }
                Ok(true)
            }
            _ => {
                let mut bits = [0; INTEGER];
                read_memory(asked.thread, argument, &mut bits)?;
                if !self.listener.waits(asked.id) {
                    return Ok(false);
                }
                let bits = u32::from_le_bytes(bits);
                self.change(|lines| match request {
                    number::TIOCMBIS => lines.switch_on(bits),
                    number::TIOCMBIC => lines.switch_off(bits),
                    _ => lines.set(bits),
                });
                Ok(true)
            }
        }
    }

    // --- threads that wait for a change ---

    /// Checks the next few waiting threads: whether they still exist, are to be interrupted, or
    /// wait at a terminal that has gone.
    fn look_after(&self, watch: &mut Watch) {
        let now = self.identity(watch);
        let mut state = self.state();
        for _ in 0..state.waiting.len().min(AT_ONCE) {
            let Some(waiting) = state.waiting.pop_front() else { return };
            if !self.listener.waits(waiting.call) {
                continue;
            }
            if now != Some(waiting.terminal) {
                self.listener.answer(waiting.call, libc::EIO);
            } else if let Some(error) = interruption(waiting.thread) {
                self.listener.answer(waiting.call, error);
            } else {
                state.waiting.push_back(waiting);
            }
        }
    }

    // --- openings and closings ---

    /// Watches the file that the name leads to now.
    fn identity(&self, watch: &mut Watch) -> Option<Identity> {
        let identity = self.terminal.identity();
        if identity != watch.watched.map(|(identity, _)| identity) {
            watch.turn_to(&self.terminal, identity);
            self.change(Lines::closed);
        }
        identity
    }

    /// Reads what inotify reports.
    fn follow(&self, watch: &mut Watch) {
        for opened in watch.events() {
            let before = watch.opens;
            watch.opens = if opened { before + 1 } else { before.saturating_sub(1) };
            match (before, watch.opens) {
                (0, 1) => self.change(Lines::opened),
                (1, 0) => self.change(Lines::closed),
                _ => {}
            }
        }
    }
}

impl Watch {
    /// Begins to watch, before there is a program that could open the terminal. Without inotify a
    /// port is open from its first request on.
    pub(super) fn new(terminal: &Terminal) -> Watch {
        let inotify = inotify::init(CreateFlags::NONBLOCK | CreateFlags::CLOEXEC).ok();
        let mut watch = Watch { inotify, watched: None, opens: 0 };
        watch.turn_to(terminal, terminal.identity());
        watch
    }

    fn turn_to(&mut self, terminal: &Terminal, identity: Option<Identity>) {
        self.opens = 0;
        if let (Some(inotify), Some((_, number))) = (&self.inotify, self.watched.take()) {
            let _ = inotify::remove_watch(inotify, number);
        }
        let Some(identity) = identity else { return };
        let flags = WatchFlags::OPEN | WatchFlags::CLOSE;
        let number = self.inotify.as_ref().map(|i| inotify::add_watch(i, terminal.path(), flags));
        self.watched = Some((identity, number.and_then(Result::ok).unwrap_or(-1)));
    }

    /// The openings and closings that are queued, in their order.
    fn events(&self) -> Vec<bool> {
        let (Some(inotify), Some((_, number))) = (&self.inotify, self.watched) else {
            return Vec::new();
        };
        let mut buffer = [MaybeUninit::uninit(); 4_096];
        let mut events = Reader::new(inotify, &mut buffer);
        let mut told = Vec::new();
        while let Ok(event) = events.next() {
            let kinds = event.events();
            if event.wd() != number {
                continue;
            }
            if kinds.contains(ReadFlags::OPEN) {
                told.push(true);
            }
            if kinds.intersects(ReadFlags::CLOSE_WRITE | ReadFlags::CLOSE_NOWRITE) {
                told.push(false);
            }
        }
        told
    }
}

/// With which error a signal is to end the call that a thread waits in, if one is to.
fn interruption(thread: u32) -> Option<i32> {
    let status = fs::read_to_string(format!("/proc/{thread}/status")).ok()?;
    interruption_of(&status)
}

/// As [`interruption`], from what the system says of the thread.
///
/// A signal for the thread stays until the thread takes it, so the kernel is there to make the call
/// anew if that is what the handler wants. A signal for its process may be taken by another thread
/// meanwhile, and then [`RESTART`] would not be translated.
fn interruption_of(status: &str) -> Option<i32> {
    let field = |name: &str| {
        status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':')).map(str::trim)
    };
    let set = |name| field(name).and_then(|text| u64::from_str_radix(text, 16).ok()).unwrap_or(0);
    let heard = !(set("SigBlk") | set("SigIgn"));
    let alone = field("Threads") == Some("1");
    if set("SigPnd") & heard != 0 || (alone && set("ShdPnd") & heard != 0) {
        Some(RESTART)
    } else {
        (set("ShdPnd") & heard != 0).then_some(libc::EINTR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pending_signal_interrupts_unless_it_is_blocked_or_ignored() {
        let status = |threads: u32, own: u64, shared: u64, blocked: u64, ignored: u64| {
            format!(
                "Name:\tSigPnd: 1\nThreads:\t{threads}\nSigPnd:\t{own:016x}\nShdPnd:\t{shared:016x}\
                 \nSigBlk:\t{blocked:016x}\nSigIgn:\t{ignored:016x}\nSigCgt:\t0000000000000002\n"
            )
        };
        assert_eq!(interruption_of(&status(1, 0, 0, 0, 0)), None);
        assert_eq!(interruption_of(&status(1, 0, 2, 0, 0)), Some(RESTART));
        assert_eq!(interruption_of(&status(5, 2, 0, 0, 0)), Some(RESTART));
        assert_eq!(interruption_of(&status(5, 0, 2, 0, 0)), Some(libc::EINTR));
        assert_eq!(interruption_of(&status(1, 2, 2, 2, 0)), None);
        assert_eq!(interruption_of(&status(1, 2, 2, 0, 2)), None);
        assert_eq!(interruption_of(&status(1, 1 << 18, 2, 2, 0)), Some(RESTART));
        assert_eq!(interruption_of(""), None);
    }
}
