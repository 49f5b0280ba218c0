//! The lines that people type while controllers run.

use std::io::{self, BufRead, ErrorKind, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use tokio::sync::mpsc;
use vimc4::{Emulator, HELP, Order, Signal};

/// No order is as long as this; a longer line is taken in pieces.
const LONGEST: u64 = 1_000;

/// Reads standard input line by line in a thread of its own. The channel closes at its end.
pub(crate) fn read() -> mpsc::Receiver<String> {
    let (sender, lines) = mpsc::channel(16);
    // Without the thread nobody can type, but the controllers run.
    let _ = thread::Builder::new().name("orders".to_owned()).spawn(move || {
        if in_background() {
            // Nobody types, and nobody has ended the input either.
            loop {
                thread::park();
            }
        }
        let mut input = io::stdin().lock();
        let mut line = Vec::new();
        loop {
            line.clear();
            match input.by_ref().take(LONGEST).read_until(b'\n', &mut line) {
                Ok(0) | Err(_) => return,
                Ok(_) => {}
            }
            if sender.blocking_send(String::from_utf8_lossy(&line).into_owned()).is_err() {
                return;
            }
        }
    });
    lines
}

/// A program in the background that reads from its terminal is stopped by the system.
#[cfg(unix)]
fn in_background() -> bool {
    let group = rustix::termios::tcgetpgrp(rustix::stdio::stdin());
    group.is_ok_and(|group| group != rustix::process::getpgrp())
}

#[cfg(not(unix))]
fn in_background() -> bool {
    false
}

/// What a line asks for, beyond what was done at once.
pub(crate) enum Next {
    Continue,
    Quit,
}

/// Carries out one line. With several controllers it begins with the number of one.
pub(crate) fn carry_out(line: &str, emulators: &[Emulator], signals: &[Signal]) -> Next {
    let line = line.trim();
    let (number, order) = match (emulators.len(), line) {
        (_, "help") => {
            answer("", HELP);
            if emulators.len() > 1 {
                answer("", "Begin each with the number of a controller, as in `1 press start`.");
            }
            return Next::Continue;
        }
        (_, "quit") => return Next::Quit,
        (1, _) => (1, line),
        (_, "") => return Next::Continue,
        (count, _) => {
            let (number, order) = line.split_once(' ').unwrap_or((line, ""));
            match number.parse::<usize>() {
                Ok(number) if (1..=count).contains(&number) && !order.is_empty() => (number, order),
                _ => {
                    let wrong = format!(
                        "`{line}` is wrong: begin with the number of a controller, 1 to {count}, \
                         as in `1 press start`"
                    );
                    complain("", &wrong);
                    return Next::Continue;
                }
            }
        }
    };
    let prefix = if emulators.len() > 1 { format!("{number}: ") } else { String::new() };
    let Some(emulator) = emulators.get(number - 1) else { return Next::Continue };
    match Order::parse(order, signals) {
        Ok(None) => {}
        Ok(Some(Order::Quit)) => return Next::Quit,
        Ok(Some(order)) => {
            let outcome = emulator.control().give(&order);
            // The next line need not wait: `press stop` must work while the machine is awaited.
            tokio::spawn(async move {
                match outcome.await {
                    Ok(text) => answer(&prefix, &text),
                    Err(error) => complain(&prefix, &error.to_string()),
                }
            });
        }
        Err(error) => complain(&prefix, &error.to_string()),
    }
    Next::Continue
}

fn answer(prefix: &str, text: &str) {
    say(&format!("{prefix}{text}\n"));
}

/// Prints on standard output. Nobody may be reading, which is no reason to end; what cannot be
/// written although somebody may want to read it is said once.
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

/// Where the answers are too: a script waits for a line there.
fn complain(prefix: &str, text: &str) {
    answer(prefix, &format!("error: {text}"));
}
