//! Opening what is to be debugged: files of commands, programs, plots, jobs and recordings.

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use vimc4_catalogue::{Controller, Handling, Model};
use vimc4_dap::{Configuration, Open, Opened, Refusal};
use vimc4_debug::{Debugger, Feed, Piece, Source, Unit, Way};
use vimc4_device::{Condition, Device, Event, Input, Time};
use vimc4_ncp::Severity;
use vimc4_ncp::job::{InputTest, Job, Question, Step};
use vimc4_timeline::{History, Progress};

use super::live::{self, Served};
use crate::failure::Failure;
use crate::job::file;
use crate::job::perform::said;
use crate::job::source::{Reading, Site, takes_jobs};
use crate::live::Ring;
use crate::recording::controller::quirky;
use crate::recording::history::{self, Commands};
use crate::run::script::{Kind, Script, ScriptLine};
use crate::setup::Setup;
use crate::text;

/// So many commands of a job are sent at most.
const MOST: usize = 10_000_000;

/// So many errors of a job are told.
const MOST_ERRORS: usize = 5;

/// Opens files of this computer, and controllers behind its ports.
pub(super) struct Doors {
    /// The controllers that run already, if there are any.
    pub(super) served: Option<Served>,
    /// Is called when one that runs by itself has something to say.
    pub(super) ring: Ring,
}

/// So long is nobody asked whether to go on while something is opened.
const PATIENCE: Duration = Duration::from_millis(5);

impl Open for Doors {
    fn open(
        &mut self,
        configuration: &Configuration,
        progress: &mut Progress<'_>,
    ) -> Result<Vec<Opened>, Refusal> {
        let each = configuration.each();
        let several = each.iter().filter(|each| each.serve).count() > 1;
        let mut numbers = 1..;
        let open = |each: &Configuration| {
            let is_of_file = each.program.is_some() || each.recording.is_some();
            let mut opened = match each.serve {
                false => open(each, progress)?,
                true if is_of_file => {
                    return Err(Refusal::new(
                        "what is behind ports is sent by host software: `serve` goes without \
                         `program` and `recording`",
                    ));
                }
                true => live::start(each, numbers.next().filter(|_| several), &self.ring)?,
            };
            if let Some(name) = &each.name {
                opened.name.clone_from(name);
            }
            Ok(opened)
        };
        each.iter().map(open).collect()
    }

    fn attach(&mut self, configuration: &Configuration) -> Result<Vec<Opened>, Refusal> {
        match &self.served {
            Some(served) => served.attach(configuration, &self.ring),
            None => Err(Refusal::new(
                "no controllers run here to attach to: name a `recording`, or connect to the port of \
                 `vimc4 serve --dap PORT`",
            )),
        }
    }

    fn is_same_file(&self, one: &str, other: &str) -> bool {
        let whole = |path: &str| fs::canonicalize(path).unwrap_or_else(|_| PathBuf::from(path));
        one == other || whole(one) == whole(other)
    }
}

/// Whether somebody still waits for what is opened.
struct Wanted(Arc<AtomicBool>);

impl Wanted {
    /// Says so to what takes long.
    fn flow(&self) -> ControlFlow<()> {
        match self.0.load(Ordering::Relaxed) {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        }
    }

    /// An error, if nobody does.
    fn check(&self) -> Result<(), Refusal> {
        if self.flow().is_break() { Err(Refusal::cancelled()) } else { Ok(()) }
    }
}

fn refused(failure: Failure) -> Refusal {
    Refusal::new(failure.text())
}

fn open(configuration: &Configuration, progress: &mut Progress<'_>) -> Result<Opened, Refusal> {
    let path = |name: &str| match &configuration.cwd {
        Some(folder) => Path::new(folder).join(name),
        None => PathBuf::from(name),
    };
    match (&configuration.program, &configuration.recording) {
        (Some(program), None) => read(configuration, path(program), progress).map(Program::opened),
        (None, Some(recording)) => of_recording(configuration, &path(recording)),
        (Some(_), Some(_)) => Err(Refusal::new("there is a program or a recording, not both")),
        (None, None) => Err(Refusal::new(
            "nothing to debug is named: `program` is a file of commands, a program, a plot or a \
             job, `recording` one that was recorded, `serve` a controller behind ports",
        )),
    }
}

/// Reads a program. It can be of any size, and what is read can take its time, so a thread does it. If it
/// is cancelled nobody waits for that, and it ends where it next looks.
fn read(
    configuration: &Configuration,
    path: PathBuf,
    progress: &mut Progress<'_>,
) -> Result<Program, Refusal> {
    let configuration = configuration.clone();
    let is_wanted = Arc::new(AtomicBool::new(true));
    let wanted = Wanted(Arc::clone(&is_wanted));
    let (sender, opened) = channel();
    let open = move || drop(sender.send(of_program(&configuration, &path, &wanted)));
    thread::Builder::new().name("opening".to_owned()).spawn(open).map_err(Refusal::new)?;
    loop {
        match opened.recv_timeout(PATIENCE) {
            Ok(opened) => return opened,
            Err(RecvTimeoutError::Timeout) if progress(Time::ZERO).is_continue() => {}
            Err(RecvTimeoutError::Timeout) => {
                is_wanted.store(false, Ordering::Relaxed);
                return Err(Refusal::cancelled());
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Refusal::new("it cannot be opened: the adapter has failed"));
            }
        }
    }
}

/// A program that was read: a controller that stands before it, and what a host does with it.
struct Program {
    name: String,
    history: History<Controller>,
    source: Source,
    pieces: Vec<Piece>,
    stored: Vec<u32>,
    statement: Unit,
}

impl Program {
    fn opened(self) -> Opened {
        let Program { name, history, source, pieces, stored, statement } = self;
        let debugger = Debugger::over(history).with_source(source).with_feed(Feed::new(pieces));
        let (live, said) = (None, String::new());
        Opened { name, debugger, stored, is_file: true, statement, live, said }
    }
}

/// What a host does with a file, and where the lines of it are.
struct Host {
    pieces: Vec<Piece>,
    of_command: Vec<u32>,
    /// The line of each line of the stored program.
    stored: Vec<u32>,
    statement: Unit,
}

fn of_program(
    configuration: &Configuration,
    path: &Path,
    wanted: &Wanted,
) -> Result<Program, Refusal> {
    let bytes = file::read(path, "a file of commands").map_err(refused)?;
    let Configuration { model, machine, .. } = configuration;
    let mut setup = Setup::said(model.clone(), machine.clone());
    setup.heed(path, &bytes).map_err(refused)?;
    file::no_g_code(&text::name(path), &bytes).map_err(refused)?;
    let mut model = vimc4::model(setup.model()).map_err(Failure::from).map_err(refused)?;
    for (name, value) in &configuration.quirks {
        model = quirky(&model, name, value).map_err(Refusal)?;
    }
    let machine = vimc4::machine(setup.machine()).map_err(Failure::from).map_err(refused)?;
    let controller = Controller::new(&model, Arc::clone(&machine), b"").map_err(Refusal::new)?;
    let mut debugger = Debugger::new(controller);
    // A machine that homes by itself does so before anything is sent.
    debugger.go(Way::Forward, None, &mut |_| wanted.flow());
    let name = format!("{} on {}", model.name(), machine.name);
    let whole = if takes_jobs(&model) && file::is_job(&bytes) {
        file::decoded(&bytes)
    } else {
        String::from_utf8_lossy(&bytes).into_owned()
    };
    let host = if takes_jobs(&model) && file::is_job(&bytes) {
        job(path, &whole, &setup, model, wanted)?
    } else {
        let handling = Handling::of(&model);
        let script = Script::of(path, &bytes, &handling).map_err(refused)?;
        match script.kind {
            Kind::Commands => commands(&script.lines, &handling, &debugger),
            Kind::DataField => {
                let axes = script.axes.unwrap_or(7);
                let (stored, host) = program(debugger, &script.lines, axes, wanted)?;
                debugger = stored;
                host
            }
            Kind::Stream => stream(&script.lines),
        }
    };
    let source = Source {
        name: absolute(path),
        lines: whole.lines().map(str::to_owned).collect(),
        of_command: host.of_command,
        first: None,
    };
    let history = debugger.history().clone();
    let Host { pieces, stored, statement, .. } = host;
    Ok(Program { name, history, source, pieces, stored, statement })
}

/// The path of a file as an editor finds it, wherever it was started.
fn absolute(path: &Path) -> String {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    path.to_string_lossy().into_owned()
}

fn number(line: &ScriptLine) -> u32 {
    line.number.and_then(|number| u32::try_from(number).ok()).unwrap_or(0)
}

/// The lines of a command list, each when the one before is done; and START for a program that they
/// have stored, if nothing else starts it.
fn commands(lines: &[ScriptLine], handling: &Handling, debugger: &Debugger) -> Host {
    let mut pieces: Vec<Piece> = Vec::with_capacity(lines.len());
    let mut stored = Vec::new();
    let (mut is_storing, mut is_started) = (false, true);
    for line in lines {
        pieces.push(Piece::Send(line.whole()));
        if line.is("@0i") {
            (is_storing, is_started) = (true, false);
            stored.clear();
        } else if is_storing && line.is("9") {
            is_storing = false;
        } else if is_storing {
            stored.push(number(line));
        }
        is_started |= handling.start.iter().any(|start| line.is(start));
    }
    if !is_storing && !is_started {
        pieces.extend(start(debugger));
    }
    let of_command = lines.iter().map(number).collect();
    Host { pieces, of_command, stored, statement: Unit::Line }
}

/// Somebody presses START.
fn start(debugger: &Debugger) -> Option<Piece> {
    let signals = debugger.device().signals();
    let start = signals.iter().find(|signal| signal.name == "start")?;
    Some(Piece::Press(start.id))
}

/// A controller that has the lines stored as its program, and what then starts it.
fn program(
    debugger: Debugger,
    lines: &[ScriptLine],
    axes: u8,
    wanted: &Wanted,
) -> Result<(Debugger, Host), Refusal> {
    let set_axes = [axes & 7, axes & 8].into_iter().filter(|axes| *axes != 0);
    let mut all: Vec<ScriptLine> =
        set_axes.map(|axes| ScriptLine::added(&format!("@0{axes}"))).collect();
    all.push(ScriptLine::added("@0i"));
    all.extend_from_slice(lines);
    let mut stored: Vec<u32> = lines.iter().map(number).collect();
    if lines.last().is_some_and(|line| line.is("9")) {
        stored.pop();
    } else {
        all.push(ScriptLine::added("9"));
    }
    let mut debugger = debugger;
    for line in &all {
        debugger.give(Input::Bytes(&line.whole()));
        let stop = debugger.go(Way::Forward, None, &mut |_| wanted.flow());
        wanted.check()?;
        let why = stop.outputs.iter().find_map(|output| match output.event()? {
            Event::Answer { why: Some(why), bytes, .. } => Some((why.clone(), bytes.clone())),
            _ => None,
        });
        if let Some((why, answer)) = why {
            let answer = String::from_utf8_lossy(answer.trim_ascii()).into_owned();
            let place = line.number.map_or(String::new(), |number| format!("line {number}: "));
            return Err(Refusal(format!("{place}{} was answered {answer}: {why}", line.text())));
        }
    }
    // Nobody wants to go back to where it was stored.
    let pieces = start(&debugger).into_iter().collect();
    let debugger = Debugger::new(debugger.device().clone());
    Ok((debugger, Host { pieces, of_command: Vec::new(), stored, statement: Unit::Line }))
}

/// The pieces of a plot, each when the one before is done, or as long as there is room.
fn stream(lines: &[ScriptLine]) -> Host {
    let pieces = lines.iter().map(|line| Piece::Send(line.whole())).collect();
    let of_command = lines.iter().filter(|line| line.command).map(number).collect();
    Host { pieces, of_command, stored: Vec::new(), statement: Unit::Command }
}

/// The commands of a job.
fn job(
    path: &Path,
    whole: &str,
    setup: &Setup,
    model: Model,
    wanted: &Wanted,
) -> Result<Host, Refusal> {
    let mut site = Site::new(setup.model(), setup.machine()).map_err(refused)?;
    site.model = model;
    let options = Reading::default().options();
    let mut errors: Vec<String> = Vec::new();
    vimc4_ncp::job::check(whole, &site.target, options, &mut |diagnostic| {
        if diagnostic.problem.severity() == Severity::Error {
            errors.push(format!("line {}: {}", diagnostic.line, said(&diagnostic.problem)));
        }
    });
    if !errors.is_empty() {
        let more = errors.len().saturating_sub(MOST_ERRORS);
        errors.truncate(MOST_ERRORS);
        let more = if more > 0 { format!(", and {more} more") } else { String::new() };
        return Err(Refusal(format!("{}: {}{more}", text::name(path), errors.join(", "))));
    }
    let mut host = Host {
        pieces: Vec::new(),
        of_command: Vec::new(),
        stored: Vec::new(),
        statement: Unit::Line,
    };
    let mut job = Job::new(whole, &site.target, options);
    while let Some(order) = job.next(&mut |_| {}) {
        wanted.check()?;
        if host.pieces.len() >= MOST {
            return Err(Refusal(format!("{} has more than {MOST} commands", text::name(path))));
        }
        host.pieces.push(match order.step {
            Step::Dwell(micros) => Piece::Wait(Duration::from_micros(micros)),
            Step::Await(test) => Piece::Until(condition(test), waiting(order.line, test)),
            Step::Ask(question) => {
                if question == Question::Teach {
                    job.take_zero();
                }
                Piece::Ask(asking(order.line, question))
            }
            step => match step.line(site.target.controller.dialect) {
                Some(bytes) => {
                    host.of_command.push(order.line);
                    Piece::Send(bytes)
                }
                None => continue,
            },
        });
    }
    Ok(host)
}

/// When an input is as a job waits for it.
fn condition(InputTest { port, bit, value }: InputTest) -> Condition {
    let bit_is = |bit: u8, level: bool| Condition::PortBit { port, bit, level };
    match bit {
        Some(bit) => bit_is(bit, value != 0),
        None => Condition::All((0..8).map(|bit| bit_is(bit, value >> bit & 1 == 1)).collect()),
    }
}

fn waiting(line: u32, InputTest { port, bit, value }: InputTest) -> String {
    match bit {
        Some(bit) => format!("line {line} waits for port {port} bit {bit} to be {value}"),
        None => format!("line {line} waits for port {port} to be {value}"),
    }
}

fn asking(line: u32, question: Question) -> String {
    match question {
        Question::Halt => format!("line {line}: HALT; continue goes on"),
        Question::Tool(number) => format!("line {line}: put in tool {number}; continue goes on"),
        Question::Teach => format!("line {line}: this place is the zero; continue goes on"),
    }
}

// --- recordings ---

/// It is read on as somebody comes to its end, and while nothing is asked.
fn of_recording(configuration: &Configuration, path: &Path) -> Result<Opened, Refusal> {
    let said_otherwise = [&configuration.model, &configuration.machine];
    if said_otherwise.into_iter().any(Option::is_some) || !configuration.quirks.is_empty() {
        return Err(Refusal::new(
            "a recording has its own model, machine and quirks; `vimc4 replay` plays it into others",
        ));
    }
    let opened = history::open(path, Commands::Listed).map_err(refused)?;
    let history::Opened { mut debugger, model, machine, controller, .. } = opened;
    debugger.stay_within(true);
    let name = match controller.as_str() {
        "" => format!("{} on {}", model.name(), machine.name),
        controller => controller.to_owned(),
    };
    // Between the lines of a program there are commands, and the other way round.
    Ok(Opened {
        name,
        debugger,
        stored: Vec::new(),
        is_file: false,
        statement: Unit::Line,
        live: None,
        said: String::new(),
    })
}
