//! How a program is asked to end.

use std::future::poll_fn;
use std::io::{self, Write};
use std::process::{self, ExitCode};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
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
const INTERRUPTED: i32 = 130;

/// What is still to be done when somebody ends the program.
type Deed = Box<dyn FnOnce() -> Result<(), Failure> + Send>;
static DEEDS: Mutex<Vec<Deed>> = Mutex::new(Vec::new());

/// That it is being done.
static BEGUN: AtomicBool = AtomicBool::new(false);

/// Whether somebody ends the program, and what is still to be done for that is being done.
pub(crate) fn has_begun() -> bool {
    BEGUN.load(Ordering::Relaxed)
}

/// Lets those do it who end the program.
pub(crate) fn wait_for_end() -> ! {
    loop {
        thread::park();
    }
}

/// Has something done before Ctrl-C, or another request, ends the program; one more ends it at once.
///
/// # Errors
///
/// If the system has no means to wait for that.
pub(crate) fn before_end(
    deed: impl FnOnce() -> Result<(), Failure> + Send + 'static,
) -> Result<(), Failure> {
    let lock = || DEEDS.lock().unwrap_or_else(PoisonError::into_inner);
    let is_first = lock().is_empty();
    lock().push(Box::new(deed));
    if !is_first {
        return Ok(());
    }
    let failed = |error| Failure::usage(format!("cannot wait for Ctrl-C: {error}"));
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
    let mut endings = runtime.block_on(async { Endings::listen() });
    let end = move || {
        BEGUN.store(true, Ordering::Relaxed);
        for deed in std::mem::take(&mut *lock()) {
            if let Err(failure) = deed() {
                failure.report();
            }
        }
        process::exit(INTERRUPTED);
    };
    let told = move || {
        runtime.block_on(endings.told());
        if thread::Builder::new().name("ending".to_owned()).spawn(end).is_ok() {
            runtime.block_on(endings.told());
        }
        process::exit(INTERRUPTED);
    };
    thread::Builder::new().name("endings".to_owned()).spawn(told).map_err(failed)?;
    Ok(())
}

/// Lets Ctrl-C, and other requests to end, interrupt the port, so that `halt` is sent and its
/// effect awaited. At a second request the program ends at once.
pub(crate) fn interrupt(port: &Port, halt: &'static [u8]) -> Result<(), Failure> {
    let interrupt = port.interrupter();
    let mut sideways = port.sideways();
    let failed = |error| Failure::usage(format!("cannot wait for Ctrl-C: {error}"));
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
    // From here on Ctrl-C does not end the program before the controller was told to halt.
    let endings = runtime.block_on(async { Endings::listen() });
    let told = move || {
        let mut endings = endings;
        runtime.block_on(endings.told());
        interrupt();
        runtime.block_on(endings.told());
        // It may not have been sent yet, and does no harm twice.
        sideways.iter_mut().for_each(|send| send(halt));
        let _ = writeln!(
            io::stderr(),
            "interrupted again: ended without waiting, and the machine may still be moving; use the \
             emergency stop if it does"
        );
        process::exit(INTERRUPTED);
    };
    thread::Builder::new().name("endings".to_owned()).spawn(told).map_err(failed)?;
    Ok(())
}
