//! How a program is asked to end.

use std::future::poll_fn;
use std::io::{self, Write};
use std::process::{self, ExitCode};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Mutex, MutexGuard, PoisonError};
#[cfg(windows)]
use std::task::Context;
use std::task::Poll;
use std::thread;

#[cfg(unix)]
use tokio::signal::unix::{Signal, SignalKind, signal};
#[cfg(windows)]
use tokio::signal::windows;

use crate::failure::Failure;
use crate::port::Port;

/// Ctrl-C, and the other ways in which a terminal, the system or a service manager asks for an
/// end.
#[cfg(unix)]
pub(crate) struct Endings(Vec<(Signal, u8)>);

/// The exit code of a program that SIGQUIT has ended, as shells have it.
#[cfg(unix)]
const QUIT: u8 = 131;

#[cfg(unix)]
impl Endings {
    pub(crate) fn listen() -> Endings {
        Endings::of(vec![(SignalKind::interrupt(), 0)])
    }

    /// The same without Ctrl-C, for a program to which that means something else.
    pub(crate) fn without_interrupt() -> Endings {
        Endings::of(Vec::new())
    }

    fn of(mut kinds: Vec<(SignalKind, u8)>) -> Endings {
        kinds.extend([(SignalKind::terminate(), 0), (SignalKind::quit(), QUIT)]);
        // A program that was started with `nohup` is to outlive the terminal.
        if !is_ignored(SignalKind::hangup()) {
            kinds.push((SignalKind::hangup(), 0));
        }
        let heard = |(kind, code)| Some((signal(kind).ok()?, code));
        Endings(kinds.into_iter().filter_map(heard).collect())
    }

    /// Waits until an end is requested, and returns the exit code for it.
    pub(crate) async fn told(&mut self) -> ExitCode {
        poll_fn(|cx| {
            let mut signals = self.0.iter_mut();
            let heard = |(signal, code): &mut (Signal, u8)| {
                signal.poll_recv(cx).is_ready().then_some(*code)
            };
            signals.find_map(heard).map_or(Poll::Pending, |code| Poll::Ready(ExitCode::from(code)))
        })
        .await
    }
}

/// Whether the program was started with a signal ignored.
#[cfg(unix)]
fn is_ignored(signal: SignalKind) -> bool {
    // Signals count from 1.
    let bit = u32::try_from(signal.as_raw_value() - 1);
    bit.is_ok_and(|bit| vimc4_lines::ignored_signals() >> bit & 1 == 1)
}

/// Ctrl-C, and the other ways in which a console or the system asks for an end: Ctrl-Break, a window
/// that is closed, a user who logs off, a shutdown.
#[cfg(windows)]
pub(crate) struct Endings(Vec<Ending>);

/// Tells whether an end was requested in one of these ways.
#[cfg(windows)]
type Ending = Box<dyn FnMut(&mut Context<'_>) -> bool + Send>;

/// Listens for one of them, each of which has a type of its own.
#[cfg(windows)]
macro_rules! ending {
    ($listen:path) => {
        $listen().ok().map(|mut ending| {
            Box::new(move |cx: &mut Context<'_>| ending.poll_recv(cx).is_ready()) as Ending
        })
    };
}

#[cfg(windows)]
impl Endings {
    pub(crate) fn listen() -> Endings {
        let Endings(mut endings) = Endings::without_interrupt();
        endings.extend(ending!(windows::ctrl_c));
        Endings(endings)
    }

    /// The same without Ctrl-C, for a program to which that means something else.
    pub(crate) fn without_interrupt() -> Endings {
        let endings = [
            ending!(windows::ctrl_break),
            ending!(windows::ctrl_close),
            ending!(windows::ctrl_logoff),
            ending!(windows::ctrl_shutdown),
        ];
        Endings(endings.into_iter().flatten().collect())
    }

    /// Waits until an end is requested, and returns the exit code for it.
    pub(crate) async fn told(&mut self) -> ExitCode {
        poll_fn(|cx| match self.0.iter_mut().any(|ending| ending(cx)) {
            true => Poll::Ready(ExitCode::SUCCESS),
            false => Poll::Pending,
        })
        .await
    }
}

/// The exit code of a program that Ctrl-C has ended, as shells have it.
pub(crate) const INTERRUPTED: u8 = 130;

/// Who ends a program that is asked to end.
struct Course {
    /// The work that leaves files ends them itself, once it sees that it was asked.
    is_in_order: bool,
    /// Tells that work, if it waits for something else.
    wake: Option<Box<dyn FnOnce() + Send>>,
}

static COURSE: Mutex<Course> = Mutex::new(Course { is_in_order: false, wake: None });

/// Whether work that ends in order was asked to.
static ASKED: AtomicBool = AtomicBool::new(false);

fn course() -> MutexGuard<'static, Course> {
    COURSE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From here on Ctrl-C, or another request, ends the program with its code: at once, or when work that
/// ends in order has done so. One more ends it at once.
///
/// # Errors
///
/// If the system has no means to wait for that.
pub(crate) fn heed() -> Result<(), Failure> {
    in_background(|asked| {
        asked();
        // It is held until the end: nothing that has to end in order begins any more.
        let mut course = course();
        if course.is_in_order {
            ASKED.store(true, Ordering::Relaxed);
            course.wake.take().into_iter().for_each(|wake| wake());
            drop(course);
            asked();
        }
        process::exit(INTERRUPTED.into());
    })
}

/// Work that is not broken off, because it leaves files that are to be whole: it looks whether it was
/// asked to end, and ends them.
pub(crate) struct InOrder(());

impl InOrder {
    pub(crate) fn begin() -> InOrder {
        course().is_in_order = true;
        InOrder(())
    }

    /// Whether it was asked to end.
    pub(crate) fn is_asked(&self) -> bool {
        ASKED.load(Ordering::Relaxed)
    }

    /// Its files are whole. If it was asked to end meanwhile, so does the program.
    pub(crate) fn done(self) {
        course().is_in_order = false;
        if self.is_asked() {
            process::exit(INTERRUPTED.into());
        }
    }
}

/// Waits for what may never come, and no longer than until the work that waits is asked to end; then there
/// is nothing.
pub(crate) fn unless_asked<T: Send + 'static>(
    wait: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    let (sender, come) = channel();
    let asked = sender.clone();
    let mut course = course();
    if ASKED.load(Ordering::Relaxed) {
        return None;
    }
    course.wake = Some(Box::new(move || drop(asked.send(None))));
    drop(course);
    let waits = move || drop(sender.send(Some(wait())));
    thread::Builder::new().name("waiting".to_owned()).spawn(waits).ok()?;
    come.recv().ok().flatten()
}

/// Lets Ctrl-C, and other requests to end, interrupt the port, so that `halt` is sent and its
/// effect awaited. At a second request the program ends at once.
pub(crate) fn interrupt(port: &Port, halt: &'static [u8]) -> Result<(), Failure> {
    let interrupt = port.interrupter();
    let mut sideways = port.sideways();
    // From here on Ctrl-C does not end the program before the controller was told to halt.
    in_background(move |asked| {
        asked();
        interrupt();
        asked();
        // It may not have been sent yet, and does no harm twice.
        sideways.iter_mut().for_each(|send| send(halt));
        let _ = writeln!(
            io::stderr(),
            "interrupted again: ended without waiting, and the machine may still be moving; use the \
             emergency stop if it does"
        );
        process::exit(INTERRUPTED.into());
    })
}

/// Has a thread wait for requests to end: what it is given comes back when one has come.
fn in_background(react: impl FnOnce(&mut dyn FnMut()) + Send + 'static) -> Result<(), Failure> {
    let failed = |error| Failure::usage(format!("cannot wait for Ctrl-C: {error}"));
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
    let mut endings = runtime.block_on(async { Endings::listen() });
    let told = move || {
        react(&mut || {
            let _ = runtime.block_on(endings.told());
        });
    };
    thread::Builder::new().name("endings".to_owned()).spawn(told).map_err(failed)?;
    Ok(())
}
