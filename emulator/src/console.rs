//! `vimc4 console`: a controller, a program or a job, step by step, forward and back.

#[cfg(feature = "api")]
mod afar;
pub(crate) mod camera;
pub(crate) mod cancel;
mod interrupts;
mod opened;
pub(crate) mod reading;
pub(crate) mod screen;
mod script;
pub(crate) mod session;
mod shell;

use std::cell::RefCell;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use vimc4::{Clients, Clock, Emulator};
use vimc4_catalogue::{Controller, Machine, bare};
use vimc4_debug::Debugger;

use crate::completions;
use crate::failure::Failure;
use crate::here::here;
use crate::identity::none_twice;
use crate::job::source::JobOptions;
use crate::output;
use crate::places::{LISTENS, PTY, counted_up, link, numbered, of_flash};
use crate::setup::Setup;
use crate::text;
use crate::typed_options::TypedOptions;
use crate::values::duration;
use cancel::Cancel;
use opened::{Opened, Sending};
use screen::SaidKind;
use script::{Console, Script};
use session::{Outcome, Session, Wrong};
use shell::{PROMPT, Shell};

#[derive(clap::Args)]
#[command(
    long_about = concat!("\
Step through what a controller does, forward and back, and ask why

WHAT is a file: a recording, a list of commands, a stored program, a plot file or a job file in the isel NC
intermediate format. A recording is of a controller; any other file is sent to one in virtual time, as
`vimc4 run` does it. The console stands at the beginning. A stored program is stored, and START is pressed.

Without a file, or with the name of a model, there is a controller behind ", here!("a pseudo-terminal and ", ""), "a TCP port,
as `vimc4 serve` has it. While you type, its time is paused; clients stay connected and notice only
the delay. `continue` lets it go on to the next breakpoint or Ctrl-C. Stepping forward moves the controller itself; going
back, or doing something there, only looks, until `take` takes it there. With `", here!("--pty none ", ""), "--tcp none` there are
no clients, and time passes only as you step. With `--connect` the controller is one of a `vimc4 serve --http`
that runs, where time passes by itself; at the end it goes on.

Every command is a line; `help` lists them, an empty line does the last one again, Tab completes. What
is done in the past begins a branch, and nothing is lost. Without a terminal, lines come from
a pipe or from --script, and the first that fails ends it."),
    after_long_help = "\
Examples:
  vimc4 console examples/commands.txt --machine mill
  vimc4 console examples/plate.ncp --machine mill --screen
  vimc4 console examples/overlooked.jsonl
  vimc4 console imc-s8 --machine mill
  vimc4 console examples/commands.txt --machine mill --script examples/look.txt
  vimc4 console --connect http://127.0.0.1:8080

Exit codes: 0 it was ended, 1 an `assert` of a script does not hold, or a command of it is wrong, 2 wrong
usage: nothing was done."
)]
pub(crate) struct Arguments {
    /// A file to step through, or the model of a controller
    #[arg(value_name = "WHAT")]
    what: Option<String>,
    #[command(flatten)]
    setup: Setup,
    #[command(flatten)]
    ports: Ports,
    /// Carry out the commands in this file, and end; `-` is standard input
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// Begin with the full screen
    #[arg(long, conflicts_with = "script")]
    screen: bool,
    /// Go on sending a file after an error reply, as software does that ignores it
    #[arg(long)]
    keep_going: bool,
    /// How much virtual time the sending of a file may take, such as 90s, 5min or 1h
    #[arg(long = "for", id = "for", value_name = "DURATION", default_value = "1h", value_parser = duration)]
    time: Duration,
    /// The axes a data field is stored with: 1, 3 or 7 for X, X+Y, X+Y+Z, and 8 more with A; by
    /// default those of its comment `; axes: N`, or 7
    #[arg(long, value_parser = crate::run::axes, add = completions::words(&["1", "3", "7", "8", "9", "11", "15"]))]
    axes: Option<u8>,
    #[command(flatten)]
    job: JobOptions,
    #[cfg(feature = "api")]
    #[command(flatten)]
    afar: afar::Arguments,
}

/// Of each option by itself: that of a whole struct would stay for the options that follow.
const HEADING: &str = "A controller behind ports";

/// The options of [`Ports`].
const PORTS: [&str; 9] =
    ["pty", "replace", "tcp", "serial", "time", "flash", "count", "tcp-clients", "fresh-clients"];

/// Where clients find a controller, as `vimc4 serve` has it.
#[derive(clap::Args)]
struct Ports {
    /// A pseudo-terminal and a link to it of this name; `none` for no pseudo-terminal
    #[arg(help_heading = HEADING, long, value_name = "LINK", num_args = 0..=1, default_missing_value = PTY, hide = cfg!(not(unix)))]
    pty: Option<PathBuf>,
    /// Take the link of that name even from an emulator that is still running
    #[arg(help_heading = HEADING, long, hide = cfg!(not(unix)))]
    replace: bool,
    /// Listen on this address; `none` for no TCP port, port 0 for a free one
    #[arg(help_heading = HEADING, long, value_name = "ADDR", default_value = LISTENS, add = completions::words(&[LISTENS, "127.0.0.1:0", "0.0.0.0:4004", "none"]))]
    tcp: String,
    /// A real serial port; once for each controller
    #[arg(help_heading = HEADING, long, value_name = "DEV")]
    serial: Vec<String>,
    /// How time passes while the controller runs: real, a factor such as 8x or 0.5x, or instant
    #[arg(help_heading = HEADING, long = "time", id = "time", value_name = "CLOCK", default_value_t = Clock::Real, add = completions::words(&["real", "instant", "8x"]))]
    clock: Clock,
    /// Keep the flash memory in this file, which is created if it does not exist
    #[arg(help_heading = HEADING, long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// How many controllers; `controller NUMBER` looks at another one
    #[arg(help_heading = HEADING, long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1_000))]
    count: u16,
    /// What happens to a second TCP client: refuse it, let it take over, or let it observe
    #[arg(help_heading = HEADING, long, value_name = "POLICY", default_value_t = Clients::Refuse, add = completions::words(&["refuse", "takeover", "observe"]))]
    tcp_clients: Clients,
    /// Forget the half line of a client that has left
    #[arg(help_heading = HEADING, long)]
    fresh_clients: bool,
}

impl Ports {
    fn link(&self) -> Option<PathBuf> {
        link(self.pty.as_deref(), self.replace)
    }

    /// Whether nobody can reach it: then it needs no time of its own.
    fn are_none(&self) -> bool {
        self.link().is_none() && self.tcp == "none" && self.serial.is_empty()
    }

    fn start(&self, model: &str, machine: &Arc<Machine>) -> Result<Vec<Emulator>, Failure> {
        let count = self.count;
        if !self.serial.is_empty() && self.serial.len() != usize::from(count) {
            return Err(Failure::usage(format!(
                "{count} controllers cannot share {} serial ports; give --serial once for each",
                self.serial.len()
            )));
        }
        if self.clock == Clock::Manual {
            return Err(Failure::usage(
                "time that is moved by hand has nothing to be paused; choose real, instant or 8x",
            ));
        }
        let model = vimc4::model(model)?;
        let mut emulators = Vec::new();
        for number in 1..=count {
            let several = (count > 1).then_some(number);
            let mut builder = Emulator::builder()
                .with_model(model.clone())
                .with_machine(Arc::clone(machine))
                .time(self.clock)
                .tcp_clients(self.tcp_clients)
                .fresh_clients(self.fresh_clients)
                .record(false)
                // The first one is looked at before anybody can have reached it.
                .paused(number == 1)
                .name(number.to_string());
            if let Some(link) = self.link() {
                builder = builder.pty(numbered(&link, several)).replace_link(self.replace);
            }
            if self.tcp != "none" {
                builder = builder.tcp(counted_up(&self.tcp, number - 1)?);
            }
            if let Some(device) = self.serial.get(usize::from(number) - 1) {
                builder = builder.serial(device);
            }
            if let Some(file) = &self.flash {
                builder = builder.flash(of_flash(file, several)?);
            }
            emulators.push(builder.start()?);
        }
        Ok(emulators)
    }
}

pub(crate) fn run(arguments: Arguments, typed: &TypedOptions) -> Result<ExitCode, Failure> {
    #[cfg(feature = "api")]
    if arguments.afar.is_meant() {
        return afar::run(&arguments.afar, arguments.script.as_deref());
    }
    if arguments.screen {
        screen::check()?;
    }
    none_twice(arguments.inputs(), arguments.ports.flash.as_deref())?;
    let script = arguments.script.as_deref().map(Script::read).transpose()?;
    let cancel = Cancel::default();
    let links = Links::default();
    let left = links.clone();
    interrupts::listen(&cancel, move || left.remove());
    let mut session = open(&arguments, typed, cancel, &links)?;
    session.show = reading::on_terminal();
    session.inputs = arguments.inputs().map(Path::to_owned).collect();
    let session = Rc::new(RefCell::new(session));
    let end = converse(&session, arguments.screen, script.as_ref());
    let emulators = Rc::into_inner(session).map(|session| session.into_inner().into_emulators());
    for mut emulator in emulators.into_iter().flatten() {
        emulator.unlink();
        emulator.stop();
    }
    end
}

impl Arguments {
    /// The files that are read, which no output may replace.
    fn inputs(&self) -> impl Iterator<Item = &Path> {
        let what = self.what.as_deref().map(Path::new);
        what.into_iter().chain(self.script.as_deref()).chain(self.setup.files())
    }
}

/// Carries out what is typed or written down.
fn converse(
    session: &Rc<RefCell<Session>>,
    screen: bool,
    script: Option<&Script>,
) -> Result<ExitCode, Failure> {
    if !screen && let Some(code) = script::written_down(&mut *session.borrow_mut(), script)? {
        return Ok(code);
    }
    interactive(session, screen)
}

/// What the command line names.
fn open(
    arguments: &Arguments,
    typed: &TypedOptions,
    cancel: Cancel,
    links: &Links,
) -> Result<Session, Failure> {
    let Arguments { setup, ports, time, keep_going, axes, job, .. } = arguments;
    let (model, file) = match arguments.what.as_deref() {
        None => (setup.model(), None),
        Some(what) if Path::new(what).is_file() => (setup.model(), Some(Path::new(what))),
        Some(what) if vimc4_catalogue::models().contains(&what) => {
            typed.refuse(&["model"], "beside the name of a model")?;
            (what, None)
        }
        Some(what) => {
            return Err(Failure::usage(format!(
                "{what} is neither a file nor a model; name a file, or one of {}",
                vimc4_catalogue::models().join(", ")
            )));
        }
    };
    if let Some(file) = file {
        typed.refuse(&PORTS, "with a file, which no client reaches")?;
        let (time, keeps_going, axes, job) = (*time, *keep_going, *axes, job.clone());
        let sending = Sending { time, keeps_going, axes, job };
        let Opened { debugger, machine, note, share } = opened::open(file, setup.clone(), sending)?;
        let mut session = Session::new(debugger, machine, cancel);
        if let Some(note) = note {
            // Where nobody can be told it is seen in the history. The screen shows it, too.
            let _ = writeln!(io::stderr(), "{}", text::shown(&note));
            session.say(&text::shown(&note), SaidKind::Wrong);
        }
        session.share = share;
        if let Some(notice) = session.notice() {
            let _ = writeln!(io::stderr(), "{}", text::shown(&notice));
        }
        return Ok(session);
    }
    job.only_for_jobs(model)?;
    typed.refuse(&["for", "keep-going", "axes"], "without a file")?;
    let machine = vimc4::machine(setup.machine())?;
    typed.refuse_if(ports.link().is_none(), &["replace"], "without a pseudo-terminal")?;
    typed.refuse_if(ports.tcp == "none", &["tcp-clients"], "with --tcp none")?;
    if ports.are_none() {
        typed.refuse(&["time", "flash", "count", "fresh-clients"], "without clients")?;
        let model = vimc4::model(model)?;
        let controller: Controller = bare(&model, &machine, &[]).map_err(Failure::midway)?;
        return Ok(Session::new(Debugger::new(controller), machine, cancel));
    }
    let emulators = ports.start(model, &machine)?;
    for emulator in &emulators {
        links.add(emulator.port());
        let places = [
            emulator.port().map(|path| format!("pty {}\n", path.display())),
            emulator.tcp_addr().map(|address| format!("tcp {address}\n")),
            emulator.serial().map(|device| format!("serial {device}\n")),
        ];
        output::print(&text::shown(&places.into_iter().flatten().collect::<String>()))?;
    }
    Session::live(emulators, machine, cancel).map_err(|Wrong(wrong)| Failure::midway(wrong))
}

/// The links to pseudo-terminals, which nothing may leave behind.
#[derive(Clone, Default)]
struct Links(Arc<Mutex<Vec<PathBuf>>>);

impl Links {
    fn add(&self, path: Option<&Path>) {
        let mut links = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        links.extend(path.map(Path::to_owned));
    }

    fn remove(&self) {
        let links = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for link in links.iter().filter(|link| link.is_symlink()) {
            let _ = fs::remove_file(link);
        }
    }
}

/// Somebody is at the terminal.
fn interactive(
    session: &Rc<RefCell<Session>>,
    begins_with_screen: bool,
) -> Result<ExitCode, Failure> {
    if begins_with_screen && screen::run(&mut session.borrow_mut(), true)? == screen::Leaving::Quits
    {
        return Ok(ExitCode::SUCCESS);
    }
    if !begins_with_screen {
        output::print(&greeting(&session.borrow()))?;
    }
    let mut shell = Shell::new(Rc::clone(session))?;
    loop {
        if session.borrow().debugger.has_unread() {
            shell.meanwhile(PROMPT, |is_wanted| session.borrow_mut().read_on(is_wanted))?;
        }
        let Some(line) = shell.line(PROMPT)? else { break };
        let outcome = Console::carry_out(&mut *session.borrow_mut(), &line);
        match outcome {
            Ok(Outcome::Picture(..)) => {}
            Ok(Outcome::Said(text)) if text.is_empty() => {}
            Ok(Outcome::Said(text)) => output::print(&format!("{text}\n"))?,
            Ok(Outcome::Screen) => match screen::check() {
                Ok(()) => match screen::run(&mut session.borrow_mut(), false)? {
                    screen::Leaving::Quits => break,
                    screen::Leaving::Closed => {}
                },
                Err(failure) => _ = failure.report(),
            },
            Ok(Outcome::Source(file)) => {
                match script::called(&mut *session.borrow_mut(), &file, 0) {
                    Ok(script::Flow::GoesOn) => {}
                    Ok(script::Flow::Ends) => break,
                    Err(failure) => _ = failure.report(),
                }
            }
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
