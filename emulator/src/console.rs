//! `vimc4 console`: a controller, a program or a job, step by step, forward and back.

mod camera;
pub(crate) mod screen;
pub(crate) mod session;
mod shell;

use std::cell::RefCell;
use std::fs;
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::rc::Rc;
use std::thread;
use std::time::Duration;

use vimc4_catalogue::{Controller, bare};
use vimc4_debug::Debugger;

use crate::completions;
use crate::failure::Failure;
use crate::opened::{self, Opened, Sending};
use crate::output;
use crate::setup::Setup;
use crate::text;
use crate::values::duration;
use session::{Cancel, Outcome, Session, Wrong};
use shell::Shell;

#[derive(clap::Args)]
#[command(
    long_about = "\
Step through what a controller does, forward and back, and ask why

WHAT is a file: a list of commands, a stored program, a plot file or a job file in the isel NC
intermediate format. It is sent to a virtual controller in virtual time, as `vimc4 run` does it, and
the console stands at its beginning. A stored program is stored, and START is pressed. Without a file,
or with the name of a model, there is a controller that has just been switched on.

Every command is a line; `help` lists them, an empty line does the last one again, Tab completes. What
is done in the past begins a branch, and nothing is lost. The same without anybody at the terminal:
lines come from a pipe or with --script, and the first that fails ends it.",
    after_long_help = "\
Examples:
  vimc4 console examples/commands.txt --machine mill
  vimc4 console examples/plate.ncp --machine mill --screen
  vimc4 console imc-s8 --machine mill
  vimc4 console examples/commands.txt --machine mill --script examples/look.txt

Exit codes: 0 it was ended, 1 an `assert` of a script does not hold, or a command of it is wrong, 2 wrong
usage: nothing was done."
)]
pub(crate) struct Arguments {
    /// A file to step through, or the model of a controller
    #[arg(value_name = "WHAT")]
    what: Option<String>,
    #[command(flatten)]
    setup: Setup,
    /// Carry out the commands in this file, and end; `-` is standard input
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// Begin with the full screen
    #[arg(long, conflicts_with = "script")]
    screen: bool,
    /// Send the rest of a file after an error reply too, as software does that overlooks it
    #[arg(long)]
    keep_going: bool,
    /// How much virtual time the sending of a file may take, such as 90s, 5min or 1h
    #[arg(long = "for", value_name = "DURATION", default_value = "1h", value_parser = duration)]
    time: Duration,
    /// The axes a data field is stored with: 1, 3 or 7 for X, X+Y, X+Y+Z, and 8 more with A; those
    /// of its comment `; axes: N` if nothing is said, else 7
    #[arg(long, value_parser = crate::run::axes, add = completions::words(&["1", "3", "7", "8", "9", "11", "15"]))]
    axes: Option<u8>,
}

pub(crate) fn run(arguments: Arguments) -> Result<ExitCode, Failure> {
    if arguments.screen {
        screen::check()?;
    }
    let opened = open(&arguments)?;
    if let Some(note) = &opened.note {
        // Where nobody can be told it is seen in the history.
        let _ = writeln!(io::stderr(), "{}", text::shown(note));
    }
    let cancel = Cancel::default();
    listen(&cancel);
    let mut session = Session::new(opened.debugger, opened.machine, cancel);
    if let Some(file) = &arguments.script {
        let name = text::name(file);
        let lines = match file.to_str() {
            Some("-") => io::read_to_string(io::stdin()),
            _ => fs::read_to_string(file),
        };
        let lines = lines.map_err(|error| {
            Failure::usage(format!("cannot read {name}: {error}; name a file of console commands"))
        })?;
        return carry_out(&mut session, &name, &lines, 0);
    }
    if !io::stdin().is_terminal() && !arguments.screen {
        return piped(&mut session);
    }
    interactive(session, arguments.screen)
}

/// What the command line names.
fn open(arguments: &Arguments) -> Result<Opened, Failure> {
    let Arguments { setup, time, keep_going, axes, .. } = arguments;
    let (model, file) = match arguments.what.as_deref() {
        None => (setup.model(), None),
        Some(what) if Path::new(what).is_file() => (setup.model(), Some(Path::new(what))),
        Some(what) if vimc4_catalogue::models().contains(&what) => (what, None),
        Some(what) => {
            return Err(Failure::usage(format!(
                "{what} is neither a file nor a model; name a file, or one of {}",
                vimc4_catalogue::models().join(", ")
            )));
        }
    };
    if let Some(file) = file {
        let sending = Sending { time: *time, keeps_going: *keep_going, axes: *axes };
        return opened::open(file, setup.clone(), sending);
    }
    let (model, machine) = (vimc4::model(model)?, vimc4::machine(setup.machine())?);
    let controller: Controller = bare(&model, &machine, &[]).map_err(Failure::midway)?;
    Ok(Opened { debugger: Debugger::new(controller), machine, note: None })
}

/// Lets Ctrl-C end what is under way, and not the console.
fn listen(cancel: &Cancel) {
    let cancel = cancel.clone();
    let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() else {
        return;
    };
    // Without the thread Ctrl-C ends the program, as it does everywhere.
    let _ = thread::Builder::new().name("interrupts".to_owned()).spawn(move || {
        runtime.block_on(async {
            while tokio::signal::ctrl_c().await.is_ok() {
                cancel.wish();
            }
        });
    });
}

/// So many files may call each other.
const DEEPEST: u32 = 16;

/// Carries out the commands of a script. The first that fails ends it.
fn carry_out(
    session: &mut Session,
    name: &str,
    lines: &str,
    depth: u32,
) -> Result<ExitCode, Failure> {
    match script(session, name, lines, depth)? {
        Flow::GoesOn | Flow::Ends => Ok(ExitCode::SUCCESS),
    }
}

/// Whether a script is to be gone on with.
#[derive(PartialEq, Eq)]
enum Flow {
    GoesOn,
    Ends,
}

fn script(session: &mut Session, name: &str, lines: &str, depth: u32) -> Result<Flow, Failure> {
    for (number, line) in (1_u32..).zip(lines.lines()) {
        let failed = |message: String| Failure::at_line(message, name, lines, number);
        match session.carry_out_once(line) {
            Ok(Outcome::Said(text)) => say(line, &text)?,
            Ok(Outcome::Quit) => return Ok(Flow::Ends),
            Ok(Outcome::Screen) => {
                let why = "the full screen needs somebody at the terminal; `picture FILE` writes it \
                           into a file";
                return Err(failed(format!("{name}, line {number}: {why}")));
            }
            Ok(Outcome::Source(file)) => {
                if called(session, &file, depth)? == Flow::Ends {
                    return Ok(Flow::Ends);
                }
            }
            Err(Wrong(message)) => {
                return Err(failed(format!("{name}, line {number}: {message}")));
            }
        }
    }
    Ok(Flow::GoesOn)
}

/// Carries out the commands of a file that another one, or somebody, calls.
fn called(session: &mut Session, file: &str, depth: u32) -> Result<Flow, Failure> {
    if depth >= DEEPEST {
        return Err(Failure::midway(format!("{file} calls itself; leave `source` out")));
    }
    let lines = fs::read_to_string(file)
        .map_err(|error| Failure::midway(format!("cannot read {file}: {error}")))?;
    script(session, file, &lines, depth + 1)
}

/// What a line of a script was answered, behind the line.
fn say(line: &str, text: &str) -> Result<(), Failure> {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return Ok(());
    }
    let end = if text.is_empty() { String::new() } else { format!("{text}\n") };
    output::print(&format!("> {}\n{end}", text::shown(line)))
}

/// Carries out what comes through a pipe, each line as it comes.
fn piped(session: &mut Session) -> Result<ExitCode, Failure> {
    let name = "standard input";
    let mut before = String::new();
    for (number, line) in (1_u32..).zip(io::stdin().lock().lines()) {
        let line = line.map_err(|error| Failure::midway(format!("cannot read {name}: {error}")))?;
        before.push_str(&line);
        before.push('\n');
        match session.carry_out_once(&line) {
            Ok(Outcome::Said(text)) => say(&line, &text)?,
            Ok(Outcome::Quit) => break,
            Ok(Outcome::Source(file)) => {
                if called(session, &file, 0)? == Flow::Ends {
                    break;
                }
            }
            Ok(Outcome::Screen) => {
                let why = "the full screen needs somebody at the terminal";
                return Err(Failure::at_line(
                    format!("{name}, line {number}: {why}"),
                    name,
                    &before,
                    number,
                ));
            }
            Err(Wrong(message)) => {
                let message = format!("{name}, line {number}: {message}");
                return Err(Failure::at_line(message, name, &before, number));
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Somebody is at the terminal.
fn interactive(session: Session, begins_with_screen: bool) -> Result<ExitCode, Failure> {
    let session = Rc::new(RefCell::new(session));
    let mut shell = Shell::new(Rc::clone(&session))?;
    if begins_with_screen {
        if screen::run(&mut session.borrow_mut())? == screen::Leaving::Quits {
            return Ok(ExitCode::SUCCESS);
        }
    } else {
        output::print(&greeting(&session.borrow()))?;
    }
    while let Some(line) = shell.line("(vimc4) ")? {
        let outcome = session.borrow_mut().carry_out(&line);
        match outcome {
            Ok(Outcome::Said(text)) if text.is_empty() => {}
            Ok(Outcome::Said(text)) => output::print(&format!("{text}\n"))?,
            Ok(Outcome::Screen) => match screen::check() {
                Ok(()) => {
                    screen::run(&mut session.borrow_mut())?;
                }
                Err(failure) => _ = failure.report(),
            },
            Ok(Outcome::Source(file)) => match called(&mut session.borrow_mut(), &file, 0) {
                Ok(Flow::GoesOn) => {}
                Ok(Flow::Ends) => break,
                Err(failure) => _ = failure.report(),
            },
            Ok(Outcome::Quit) => break,
            Err(Wrong(wrong)) => output::print(&format!("error: {}\n", text::shown(&wrong)))?,
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// What there is, and how to begin.
fn greeting(session: &Session) -> String {
    let view = session.view();
    let of = match session.debugger.source() {
        Some(source) => format!("{}, sent to ", source.name),
        None => String::new(),
    };
    let (model, machine) = (text::shown_in_line(&view.model), text::shown_in_line(&view.machine));
    format!(
        "{of}{model} on {machine}. `help` lists the commands, `screen` shows everything at once.\n"
    )
}
