//! A program under a filter, and the process that attends it.

mod filter;
mod request;
mod supervisor;
mod sys;
mod terminal;

use std::fmt;
use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

use rustix::net::{
    AddressFamily, RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer,
    SendAncillaryMessage, SendFlags, SocketFlags, SocketType, recvmsg, sendmsg, socketpair,
};
use rustix::process::{
    Pid, Signal, WaitId, WaitIdOptions, WaitOptions, getpgrp, getpid, kill_process, waitid,
};

use self::supervisor::{Supervisor, Watch};
use self::sys::{Filter, Listener, Signals, Told};
use self::terminal::Terminal;
use crate::ignored_signals;
use crate::launch::{Ending, LaunchError};
use crate::state::{Lines, Peer};

/// How long the processes that a program started may outlive it before the user is told. Wine's
/// server stays for three seconds by itself.
const LINGER_LIMIT: Duration = Duration::from_secs(5);

/// Signals that are meant for the program, whichever process receives them.
const PASSED_ON: [i32; 9] = [
    libc::SIGHUP,
    libc::SIGINT,
    libc::SIGQUIT,
    libc::SIGTERM,
    libc::SIGUSR1,
    libc::SIGUSR2,
    libc::SIGTSTP,
    libc::SIGCONT,
    libc::SIGWINCH,
];

/// Further signals that are waited for: children end and stop, and writing to the terminal from the
/// background must not stop the answering process.
const OTHERS: [i32; 3] = [libc::SIGCHLD, libc::SIGTTOU, libc::SIGTTIN];

/// The far side's hold on the lines of a running program.
#[derive(Clone)]
pub struct Port(Arc<Supervisor>);

impl fmt::Debug for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Port").finish_non_exhaustive()
    }
}

impl Port {
    /// The device takes more now, or does not: CTS, where a device drives it.
    pub fn set_ready(&self, ready: bool) {
        self.0.set_ready(ready);
    }

    /// The device switches a line of its own, such as [`DSR`](crate::DSR), where a device drives it.
    pub fn set_line(&self, line: u32, on: bool) {
        self.0.set_line(line, on);
    }
}

/// A program that runs with modem lines.
#[derive(Debug)]
#[must_use = "its program must be attended until it ends"]
pub struct Running {
    program: Pid,
    port: Port,
    signals: Signals,
    ignored: u64,
}

/// A process that is ready to run a program and to attend it.
#[derive(Debug)]
pub struct Launcher {
    signals: Signals,
    /// Signals that were blocked for this process before, and so stay blocked for the program.
    before: Signals,
    ignored: u64,
}

/// Makes this process ready to run a program. From here on signals wait for [`Running::attend`].
/// Call it once and before any thread is started, because threads inherit the blocked signals.
///
/// # Errors
///
/// If programs cannot be run in this way here.
pub fn prepare() -> Result<Launcher, LaunchError> {
    let release = rustix::system::uname().release().to_string_lossy().into_owned();
    if !is_recent(&release) {
        return Err(LaunchError::OldKernel(release));
    }
    let system = LaunchError::System;
    if !Listener::is_understood().map_err(LaunchError::Filter)? {
        return Err(LaunchError::Filter(io::ErrorKind::Unsupported.into()));
    }
    // Orphaned processes become our children: we learn of their end, and they stay our offspring on
    // systems that let a process look into the memory of its offspring only.
    rustix::process::set_child_subreaper(Some(getpid())).map_err(|e| system(e.into()))?;
    // With SIGCHLD ignored, we would not learn that a child has ended.
    sys::take_default(libc::SIGCHLD);
    let all = [&PASSED_ON[..], &OTHERS[..]].concat();
    let signals = Signals::of(&all);
    let before = signals.block().map_err(system)?;
    Ok(Launcher { signals, before, ignored: ignored_signals() })
}

impl Launcher {
    /// Runs a command so that requests for modem lines on `terminal`, a pseudo-terminal or a link
    /// to one, are answered from `lines`, for the `peer` at their far side.
    ///
    /// # Errors
    ///
    /// If the program cannot be run. Nothing has been started then.
    pub fn launch(
        self,
        mut command: Command,
        terminal: &Path,
        lines: Lines,
        peer: Box<dyn Peer>,
    ) -> Result<Running, LaunchError> {
        let system = LaunchError::System;
        let Launcher { signals, before, ignored } = self;
        let path = terminal.to_owned();
        let terminal = Terminal::new(terminal).map_err(system)?;
        match terminal.identity() {
            None => return Err(LaunchError::NoTerminal(path)),
            Some(identity) if !identity.is_pseudo() => return Err(LaunchError::RealPort(path)),
            Some(_) => {}
        }
        let watch = Watch::new(&terminal);
        let pair = socketpair(AddressFamily::UNIX, SocketType::DGRAM, SocketFlags::CLOEXEC, None);
        let (ours, theirs) = pair.map_err(|e| system(e.into()))?;
        let filter = Filter::new(&filter::program());
        sys::before_exec(&mut command, move || {
            before.set()?;
            rustix::thread::set_no_new_privs(true)?;
            let listener = filter.install()?;
            hand_over(&theirs, &listener)
        });
        let started = command.spawn();
        let listener = receive(&ours).ok().flatten();
        let (child, listener) = match (started, listener) {
            (Ok(child), Some(listener)) => (child, listener),
            (Ok(_), None) => return Err(LaunchError::System(io::ErrorKind::BrokenPipe.into())),
            (Err(source), Some(_)) => {
                let name = command.get_program().display().to_string();
                return Err(LaunchError::Program { name, source });
            }
            (Err(error), None) if error.raw_os_error() == Some(libc::EBUSY) => {
                return Err(LaunchError::Nested);
            }
            (Err(error), None) => return Err(LaunchError::Filter(error)),
        };
        let program = Pid::from_child(&child);
        // The program may wait for an answer already.
        let listener = Listener::new(listener);
        let supervisor = Arc::new(Supervisor::new(listener, terminal, lines, peer));
        if let Err(error) = supervisor.start(watch) {
            let _ = kill_process(program, Signal::KILL);
            return Err(LaunchError::System(error));
        }
        Ok(Running { program, port: Port(supervisor), signals, ignored })
    }
}

/// Puts a terminal back to the line discipline that every terminal begins with. A pseudo-terminal
/// whose near end stays open is not put back by itself when its last client closes it.
///
/// # Errors
///
/// What the system says.
pub fn use_default_discipline(terminal: impl AsFd) -> io::Result<()> {
    const N_TTY: libc::c_int = 0;
    sys::set_discipline(terminal.as_fd(), N_TTY)
}

/// Whether the kernel can continue a call after asking about it.
fn is_recent(release: &str) -> bool {
    let mut numbers = release.split(|c: char| !c.is_ascii_digit()).map(str::parse::<u32>);
    match (numbers.next(), numbers.next()) {
        (Some(Ok(major)), Some(Ok(minor))) => (major, minor) >= (5, 5),
        // Whatever it is, it will say so itself.
        _ => true,
    }
}

/// Gives a descriptor to the process at the other end.
fn hand_over(socket: &OwnedFd, descriptor: &OwnedFd) -> io::Result<()> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut message = SendAncillaryBuffer::new(&mut space);
    let descriptors = [descriptor.as_fd()];
    message.push(SendAncillaryMessage::ScmRights(&descriptors));
    sendmsg(socket, &[IoSlice::new(&[0])], &mut message, SendFlags::NOSIGNAL)?;
    Ok(())
}

/// Takes a descriptor that was handed over before.
fn receive(socket: &OwnedFd) -> io::Result<Option<OwnedFd>> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut message = RecvAncillaryBuffer::new(&mut space);
    let flags = RecvFlags::DONTWAIT | RecvFlags::CMSG_CLOEXEC;
    recvmsg(socket, &mut [IoSliceMut::new(&mut [0])], &mut message, flags)?;
    for part in message.drain() {
        if let RecvAncillaryMessage::ScmRights(mut descriptors) = part {
            return Ok(descriptors.next());
        }
    }
    Ok(None)
}

impl Running {
    /// The far side's hold on the lines.
    #[must_use]
    pub fn port(&self) -> Port {
        self.port.clone()
    }

    /// Attends the program until it and everything that it has started have ended, as a shell
    /// attends a job: passes signals on, and stops when the program is stopped. `lingering` is
    /// called once if anything outlives the program; a signal then ends the waiting.
    ///
    /// # Errors
    ///
    /// If the system does not tell of signals.
    pub fn attend(self, mut lingering: impl FnMut()) -> Result<Ending, LaunchError> {
        let mut ending = None;
        let mut said = false;
        while self.take_children(&mut ending) {
            let limit = (ending.is_some() && !said).then_some(LINGER_LIMIT);
            match (self.signals.wait(limit).map_err(LaunchError::System)?, ending) {
                (Some(told), None) => self.pass_on(told),
                (Some(told), Some(ending)) if self.asks_for_an_end(told.signal) => {
                    return Ok(ending);
                }
                (None, Some(_)) if !said => {
                    said = true;
                    lingering();
                }
                _ => {}
            }
        }
        // No child is left, so the end of the program itself has been seen.
        Ok(ending.unwrap_or(Ending::Code(0)))
    }

    /// Takes note of every child that has ended or stopped. Returns whether there are others.
    fn take_children(&self, ending: &mut Option<Ending>) -> bool {
        loop {
            match rustix::process::wait(WaitOptions::NOHANG | WaitOptions::UNTRACED) {
                Ok(None) => return true,
                Ok(Some((child, status))) if child == self.program => {
                    if let Some(signal) = status.stopping_signal() {
                        self.stop_too(signal);
                    } else if let Some(signal) = status.terminating_signal() {
                        *ending = Some(Ending::Signal(signal));
                    } else {
                        let code = status.exit_status().and_then(|code| u8::try_from(code).ok());
                        *ending = Some(Ending::Code(code.unwrap_or(1)));
                    }
                }
                Ok(Some(_)) | Err(rustix::io::Errno::INTR) => {}
                Err(_) => return false,
            }
        }
    }

    /// Whether a signal ends the waiting for processes that outlive the program.
    fn asks_for_an_end(&self, signal: i32) -> bool {
        [libc::SIGHUP, libc::SIGINT, libc::SIGQUIT, libc::SIGTERM].contains(&signal)
            && self.ignored >> (signal - 1) & 1 == 0
    }

    /// The program has been stopped. If the shell is to notice, we stop too, and it wakes both.
    fn stop_too(&self, signal: i32) {
        // A debugger stops and wakes the program alone, and the program must still get its answers.
        // But where a shell waits for us, only that shell can wake the program.
        if signal == libc::SIGSTOP && !in_foreground() {
            return;
        }
        let _ = kill_process(getpid(), Signal::STOP);
        // We go on from here; a signal that woke us alone is meant for the program too.
        self.wake();
    }

    /// Wakes the program, unless something has happened to it since it was last seen to stop. Whoever
    /// wakes our whole group has woken the program already, and a key may have stopped it again before
    /// we came to run: it must then stay so, and we are to stop with it.
    fn wake(&self) {
        let news = WaitIdOptions::CONTINUED | WaitIdOptions::STOPPED;
        let look = WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        if let Ok(None) = waitid(WaitId::Pid(self.program), news | look) {
            let _ = kill_process(self.program, Signal::CONT);
        }
    }

    /// Passes on a signal that was sent to us alone. What comes from the terminal goes to the whole
    /// group, and so to the program anyway.
    fn pass_on(&self, told: Told) {
        let Some(by) = told.by else { return };
        if !PASSED_ON.contains(&told.signal) || by == self.program.as_raw_nonzero().get() {
            return;
        }
        match Signal::from_named_raw(told.signal) {
            Some(Signal::CONT) => self.wake(),
            Some(signal) => drop(kill_process(self.program, signal)),
            None => {}
        }
    }
}

/// Whether our group is the one that its terminal listens to.
fn in_foreground() -> bool {
    // The field of `stat` saves opening the terminal, which may be none of our descriptors.
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else { return false };
    let fields = stat.rsplit_once(')').map(|(_, fields)| fields);
    let group = fields.and_then(|fields| fields.split_ascii_whitespace().nth(5));
    group.and_then(|group| group.parse().ok()) == Some(getpgrp().as_raw_nonzero().get())
}

impl Ending {
    /// Ends this process as the program has ended, so that its parent cannot tell the difference.
    /// The program has left its core already, if it was to leave one.
    pub fn pass_on(self) -> ! {
        let signal = match self {
            Ending::Code(code) => std::process::exit(code.into()),
            Ending::Signal(signal) => signal,
        };
        let none = rustix::process::Rlimit { current: Some(0), maximum: Some(0) };
        let _ = rustix::process::setrlimit(rustix::process::Resource::Core, none);
        sys::take_default(signal);
        if let Some(named) = Signal::from_named_raw(signal) {
            let _ = kill_process(getpid(), named);
        }
        // A signal that was blocked comes now.
        let _ = Signals::of(&[]).set();
        std::process::exit(128 + signal)
    }
}

#[cfg(test)]
mod tests {
    use super::is_recent;

    #[test]
    fn kernels_are_told_apart() {
        for old in ["3.10.0-1160.el7.x86_64", "4.19.0-26-amd64", "5.4.0-200-generic", "5.4"] {
            assert!(!is_recent(old), "{old}");
        }
        for recent in ["5.5.0", "5.15.167.4-microsoft-standard-WSL2", "6.18.44", "10.0-rc1", "?"] {
            assert!(is_recent(recent), "{recent}");
        }
    }
}
