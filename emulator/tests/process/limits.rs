//! Every wait of a test has a limit, and every program it starts has default signals and locale.
//!
//! The standard library waits without a limit, so tests start programs and wait for them only through this module.
//! A wait that takes too long fails and names what did not happen.
//!
//! A program inherits the signals that its parent ignores: SIGHUP under `nohup`, SIGINT and SIGQUIT in the background
//! of a script. Setting a disposition between `fork` and `exec` needs unsafe code, and `env --default-signal` is not
//! everywhere. But `exec` resets a signal that the parent *catches* to its default. So before the first program
//! starts, [`InTime::start`] makes the test catch the signals it was told to ignore, and does nothing when one comes.
#![expect(
    dead_code,
    clippy::expect_used,
    reason = "each test uses its part of it, and fails where it cannot go on"
)]

use std::any::Any;
use std::io::{self, ErrorKind, Read, Write};
#[cfg(unix)]
use std::os::fd::AsFd;
#[cfg(windows)]
use std::os::windows::io::AsHandle as AsFd;
use std::panic::resume_unwind;
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// How long a single step may take before it counts as hanging. A busy computer is slow, so this is generous: only a
/// test that fails waits as long.
pub(crate) const LIMIT: Duration = Duration::from_secs(120);

/// How long a program may run from its start to its end.
const RUN_LIMIT: Duration = Duration::from_secs(300);

/// The methods of a command with a limit.
pub(crate) trait InTime {
    /// `spawn`, with default signal dispositions and messages in English.
    fn start(&mut self) -> io::Result<Child>;

    /// `status`, with a limit.
    fn status_in_time(&mut self) -> io::Result<ExitStatus>;

    /// `output`, with a limit. Nothing is on standard input, and both outputs are collected. A command with other
    /// streams is started first: `command.start()?.output_in_time()`.
    fn output_in_time(&mut self) -> io::Result<Output>;
}

impl InTime for Command {
    fn start(&mut self) -> io::Result<Child> {
        #[cfg(unix)]
        catch_ignored_signals();
        // Tests compare messages of other programs, which speak the language of the person who runs the tests.
        let set =
            |name: &str| self.get_envs().any(|(other, value)| other == name && value.is_some());
        if !set("LC_ALL") {
            self.env("LC_ALL", "C.UTF-8").env_remove("LANGUAGE");
        }
        self.spawn()
    }

    fn status_in_time(&mut self) -> io::Result<ExitStatus> {
        end_of(&mut self.start()?, RUN_LIMIT)
    }

    fn output_in_time(&mut self) -> io::Result<Output> {
        self.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        self.start()?.output_in_time()
    }
}

/// The methods of a started program with a limit.
pub(crate) trait EndsInTime {
    /// `wait`, with a limit.
    fn wait_in_time(&mut self) -> io::Result<ExitStatus>;

    /// `wait_with_output`, with a limit. An error shows the output so far.
    fn output_in_time(self) -> io::Result<Output>;
}

impl EndsInTime for Child {
    fn wait_in_time(&mut self) -> io::Result<ExitStatus> {
        end_of(self, RUN_LIMIT)
    }

    fn output_in_time(mut self) -> io::Result<Output> {
        drop(self.stdin.take());
        let stdout = Collected::of(self.stdout.take());
        let stderr = Collected::of(self.stderr.take());
        let all = |error: io::Error| {
            let [out, err] = [stdout.bytes(), stderr.bytes()];
            let [out, err] = [&out, &err].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
            io::Error::new(error.kind(), format!("{error}; output so far:\n{out}{err}"))
        };
        let status = end_of(&mut self, RUN_LIMIT).map_err(all)?;
        for output in [&stdout, &stderr] {
            until("the end of the output of a program that has ended", || output.is_complete());
        }
        Ok(Output { status, stdout: stdout.bytes(), stderr: stderr.bytes() })
    }
}

/// Waits for the end of a program. Kills it after the limit.
pub(crate) fn end_of(child: &mut Child, limit: Duration) -> io::Result<ExitStatus> {
    let begun = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if begun.elapsed() > limit {
            let name = name_of(child);
            child.kill()?;
            child.wait()?;
            return Err(late(&format!("{name} to end"), limit));
        }
        thread::sleep(Duration::from_millis(2));
    }
}

/// What a program was started with, as far as the system tells.
fn name_of(child: &Child) -> String {
    let line = std::fs::read(format!("/proc/{}/cmdline", child.id())).unwrap_or_default();
    let words: Vec<_> = line.split(|byte| *byte == 0).map(String::from_utf8_lossy).collect();
    format!("process {} ({})", child.id(), words.join(" ").trim_end())
}

fn late(what: &str, limit: Duration) -> io::Error {
    io::Error::new(ErrorKind::TimedOut, format!("waited {} s for {what}", limit.as_secs()))
}

/// What comes from a pipe until it closes, collected by a thread.
struct Collected {
    bytes: Arc<Mutex<Vec<u8>>>,
    thread: Option<JoinHandle<()>>,
}

impl Collected {
    fn of(pipe: Option<impl Read + Send + 'static>) -> Collected {
        let bytes = Arc::new(Mutex::new(Vec::new()));
        let to = Arc::clone(&bytes);
        let collect = move |mut pipe: Box<dyn Read + Send>| {
            let mut piece = [0; 65_536];
            while let Ok(count @ 1..) = pipe.read(&mut piece) {
                to.lock().unwrap_or_else(PoisonError::into_inner).extend(&piece[..count]);
            }
        };
        let pipe = pipe.map(|pipe| Box::new(pipe) as Box<dyn Read + Send>);
        let thread = pipe.map(|pipe| thread::spawn(move || collect(pipe)));
        Collected { bytes, thread }
    }

    fn is_complete(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    fn bytes(&self) -> Vec<u8> {
        self.bytes.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Waits until this holds.
#[track_caller]
pub(crate) fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < LIMIT, "{}", late(what, LIMIT));
        thread::sleep(Duration::from_millis(2));
    }
}

/// The result of a thread.
#[track_caller]
pub(crate) fn joined<T>(what: &str, thread: JoinHandle<T>) -> T {
    until(what, || thread.is_finished());
    thread.join().unwrap_or_else(|panic: Box<dyn Any + Send>| resume_unwind(panic))
}

/// The result of a call that may block, such as opening a named pipe.
#[track_caller]
pub(crate) fn in_time<T: Send + 'static>(
    what: &str,
    call: impl FnOnce() -> T + Send + 'static,
) -> T {
    joined(what, thread::spawn(call))
}

/// A pipe or terminal of which no read and no write waits longer than [`LIMIT`].
pub(crate) struct Timed<S> {
    stream: S,
    name: String,
}

impl<S: AsFd> Timed<S> {
    pub(crate) fn new(name: impl Into<String>, stream: S) -> Timed<S> {
        Timed { stream, name: name.into() }
    }

    /// Without a limit, for a thread whose listener has one.
    pub(crate) fn into_inner(self) -> S {
        self.stream
    }

    pub(crate) fn get_ref(&self) -> &S {
        &self.stream
    }

    #[cfg(unix)]
    fn wait(&self, is_reading: bool) -> io::Result<()> {
        use rustix::event::{PollFd, PollFlags, Timespec, poll};
        let (flags, what) = match is_reading {
            true => (PollFlags::IN, "bytes from"),
            false => (PollFlags::OUT, "room to write to"),
        };
        let limit = Timespec::try_from(LIMIT).map_err(io::Error::other)?;
        match poll(&mut [PollFd::new(&self.stream, flags)], Some(&limit))? {
            0 => Err(late(&format!("{what} {}", self.name), LIMIT)),
            _ => Ok(()),
        }
    }

    #[cfg(windows)]
    fn wait(&self, _is_reading: bool) -> io::Result<()> {
        Ok(())
    }
}

impl<S: Read + AsFd> Read for Timed<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.wait(true)?;
        self.stream.read(buffer)
    }
}

impl<S: Write + AsFd> Write for Timed<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.wait(false)?;
        // A pipe that can be written to has room for as many.
        self.stream.write(&bytes[..bytes.len().min(512)])
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

#[cfg(unix)]
fn catch_ignored_signals() {
    use rustix::process::Signal;
    use tokio::runtime::Builder;
    use tokio::signal::unix::{SignalKind, signal};
    static CAUGHT: std::sync::Once = std::sync::Once::new();
    CAUGHT.call_once(|| {
        // Elsewhere than on Linux nothing says which signals are ignored, and they stay so.
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
        let all =
            [Signal::HUP, Signal::INT, Signal::QUIT, Signal::TERM, Signal::USR1, Signal::USR2];
        let ignored =
            all.map(Signal::as_raw).into_iter().filter(|raw| mask & (1 << (raw - 1)) != 0);
        // Tokio never takes back a handler, so the runtime may go.
        let runtime = Builder::new_current_thread().enable_all().build();
        let runtime = runtime.expect("a runtime for catching signals");
        let _entered = runtime.enter();
        for raw in ignored {
            drop(signal(SignalKind::from_raw(raw)).expect("an ignored signal can be caught"));
        }
    });
}
