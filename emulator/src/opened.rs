//! What there is to debug: a controller before a file, and what a host does with that.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use vimc4_catalogue::{Controller, Handling, Machine, Model};
use vimc4_debug::{Debugger, Piece, Source, Unit, Way};
use vimc4_device::{Condition, Device, Event, Input};
use vimc4_ncp::Severity;
use vimc4_ncp::job::{InputTest, Job, Question, Step};
use vimc4_timeline::History;

use crate::failure::Failure;
use crate::job::file;
use crate::job::perform::said;
use crate::job::source::{Reading, Site, takes_jobs};
use crate::recording::controller::quirky;
use crate::recording::history::is_recording;
use crate::run::script::{Kind, Script, ScriptLine};
use crate::setup::Setup;
use crate::text;

/// So many commands of a job are sent at most.
const MOST: usize = 10_000_000;

/// So many lines of a job are checked before somebody is asked whether it is still wanted.
const PATIENCE: u32 = 1_000;

/// A list of commands, a stored program, a plot or a job that was read: a controller that stands before
/// it, and what a host does with it.
pub(crate) struct Program {
    /// What the controller is called.
    pub(crate) name: String,
    pub(crate) machine: Arc<Machine>,
    pub(crate) history: History<Controller>,
    /// Its name is the path as it was handed in.
    pub(crate) source: Source,
    pub(crate) pieces: Vec<Piece>,
    /// The line, from 1, of each of these; 0 for one that is in no line.
    pub(crate) lines: Vec<u32>,
    /// Somebody presses START, if nothing else starts the program that is stored.
    pub(crate) start: Option<Piece>,
    /// Whether it is stored already, and only waits for START.
    pub(crate) is_stored: bool,
    /// The line of each line of the stored program.
    pub(crate) stored: Vec<u32>,
    /// What a statement is.
    pub(crate) statement: Unit,
    /// What is wrong with lines of a job, from the first on.
    pub(crate) errors: Vec<String>,
    /// The line that cannot be carried out, if the job ends there.
    pub(crate) impossible: Option<u32>,
}

/// How a file is read and sent otherwise than by default.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ways {
    /// Quirks of the model that have another value.
    pub(crate) quirks: Vec<(String, String)>,
    /// The axes of a data field, if its comments do not say them.
    pub(crate) axes: Option<u8>,
}

/// Whether somebody still waits for what is opened.
pub(crate) type Wanted<'w> = &'w dyn Fn() -> bool;

/// What a host does with a file, and where the lines of it are.
struct Host {
    pieces: Vec<Piece>,
    lines: Vec<u32>,
    of_command: Vec<u32>,
    start: Option<Piece>,
    stored: Vec<u32>,
    statement: Unit,
    errors: Vec<String>,
    impossible: Option<u32>,
}

impl Host {
    fn new(statement: Unit) -> Host {
        Host {
            pieces: Vec::new(),
            lines: Vec::new(),
            of_command: Vec::new(),
            start: None,
            stored: Vec::new(),
            statement,
            errors: Vec::new(),
            impossible: None,
        }
    }

    fn does(&mut self, line: u32, piece: Piece) {
        self.pieces.push(piece);
        self.lines.push(line);
    }
}

/// Reads a file that is not a recording. `Ok(None)` if nobody wants it any more.
///
/// # Errors
///
/// If it cannot be read or is none of these.
pub(crate) fn read(
    path: &Path,
    mut setup: Setup,
    ways: &Ways,
    wanted: Wanted<'_>,
) -> Result<Option<Program>, Failure> {
    if is_recording(path, &file::beginning(path)) {
        return Err(Failure::usage(format!(
            "{} is a recording, or part of one, and no program; name it as a recording",
            text::name(path)
        )));
    }
    let bytes = file::read(path, "a recording, a program, a list of commands, a plot or a job")?;
    setup.heed(path, &bytes)?;
    file::no_g_code(&text::name(path), &bytes)?;
    let mut model = vimc4::model(setup.model())?;
    for (name, value) in &ways.quirks {
        model = quirky(&model, name, value).map_err(Failure::usage)?;
    }
    let machine = vimc4::machine(setup.machine())?;
    let controller = Controller::new(&model, Arc::clone(&machine), b"").map_err(Failure::midway)?;
    let mut debugger = Debugger::new(controller);
    // A machine that homes by itself does so before anything is sent.
    debugger.go(Way::Forward, None, &mut |_| flow(wanted));
    let name = format!("{} on {}", model.name(), machine.name);
    let is_job = takes_jobs(&model) && file::is_job(&bytes);
    let whole = match is_job {
        true => file::decoded(&bytes),
        false => String::from_utf8_lossy(&bytes).into_owned(),
    };
    let mut is_stored = false;
    let host = if is_job {
        job(path, &whole, &setup, model, wanted)?
    } else {
        let handling = Handling::of(&model);
        let script = Script::of(path, &bytes, &handling)?;
        match script.kind {
            Kind::Commands => Some(commands(&script.lines, &handling, &debugger)),
            Kind::DataField => {
                is_stored = true;
                let axes = ways.axes.or(script.axes).unwrap_or(7);
                let stored = store(debugger, &script.lines, axes, wanted)?;
                let Some((stored, host)) = stored else { return Ok(None) };
                debugger = stored;
                Some(host)
            }
            Kind::Stream => Some(stream(&script.lines)),
        }
    };
    let Some(host) = host.filter(|_| wanted()) else { return Ok(None) };
    let Host { pieces, lines, of_command, start, stored, statement, errors, impossible } = host;
    let source = Source {
        name: path.to_string_lossy().into_owned(),
        lines: whole.lines().map(str::to_owned).collect(),
        of_command,
        ..Source::default()
    };
    let history = debugger.history().clone();
    Ok(Some(Program {
        name,
        machine,
        history,
        source,
        pieces,
        lines,
        start,
        is_stored,
        stored,
        statement,
        errors,
        impossible,
    }))
}

fn flow(wanted: Wanted<'_>) -> ControlFlow<()> {
    if wanted() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
}

fn number(line: &ScriptLine) -> u32 {
    line.number.and_then(|number| u32::try_from(number).ok()).unwrap_or(0)
}

/// The lines of a command list, each when the one before is done; and START for a program that they
/// have stored, if nothing else starts it.
fn commands(lines: &[ScriptLine], handling: &Handling, debugger: &Debugger) -> Host {
    let mut host = Host::new(Unit::Line);
    let (mut is_storing, mut is_started) = (false, true);
    for line in lines {
        host.does(number(line), Piece::Send(line.whole()));
        if line.is("@0i") {
            (is_storing, is_started) = (true, false);
            host.stored.clear();
        } else if is_storing && line.is("9") {
            is_storing = false;
        } else if is_storing {
            host.stored.push(number(line));
        }
        is_started |= handling.start.iter().any(|start| line.is(start));
    }
    host.start = start(debugger).filter(|_| !is_storing && !is_started);
    host.of_command.clone_from(&host.lines);
    host
}

/// Somebody presses START.
fn start(debugger: &Debugger) -> Option<Piece> {
    let signals = debugger.device().signals();
    let start = signals.iter().find(|signal| signal.name == "start")?;
    Some(Piece::Press(start.id))
}

/// A controller that has the lines stored as its program, and what then starts it.
fn store(
    debugger: Debugger,
    lines: &[ScriptLine],
    axes: u8,
    wanted: Wanted<'_>,
) -> Result<Option<(Debugger, Host)>, Failure> {
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
        let stop = debugger.go(Way::Forward, None, &mut |_| flow(wanted));
        if !wanted() {
            return Ok(None);
        }
        let why = stop.outputs.iter().find_map(|output| match output.event()? {
            Event::Answer { why: Some(why), bytes, .. } => Some((why.clone(), bytes.clone())),
            _ => None,
        });
        if let Some((why, answer)) = why {
            let answer = String::from_utf8_lossy(answer.trim_ascii()).into_owned();
            let place = line.number.map_or(String::new(), |number| format!("line {number}: "));
            let message = format!("{place}{} was answered {answer}: {why}", line.text());
            return Err(Failure::usage(message));
        }
    }
    // Nobody wants to go back to where it was stored.
    let debugger = Debugger::new(debugger.device().clone());
    let host = Host { start: start(&debugger), stored, ..Host::new(Unit::Line) };
    Ok(Some((debugger, host)))
}

/// The pieces of a plot, each when the one before is done, or as long as there is room.
fn stream(lines: &[ScriptLine]) -> Host {
    let mut host = Host::new(Unit::Command);
    for line in lines {
        host.does(number(line), Piece::Send(line.whole()));
    }
    host.of_command = lines.iter().filter(|line| line.command).map(number).collect();
    host
}

/// The commands of a job.
fn job(
    path: &Path,
    whole: &str,
    setup: &Setup,
    model: Model,
    wanted: Wanted<'_>,
) -> Result<Option<Host>, Failure> {
    let site = Site::of(model, vimc4::machine(setup.machine())?)?;
    let options = Reading::default().options();
    let mut host = Host::new(Unit::Line);
    let mut errors: Vec<String> = Vec::new();
    let mut job = Job::new(whole, &site.target, options);
    let mut orders = 0_u32;
    while let Some(order) = job.next(&mut |diagnostic| {
        if diagnostic.problem.severity() == Severity::Error {
            errors.push(format!("line {}: {}", diagnostic.line, said(&diagnostic.problem)));
        }
    }) {
        orders = orders.wrapping_add(1);
        if orders.is_multiple_of(PATIENCE) && !wanted() {
            return Ok(None);
        }
        if host.pieces.len() >= MOST {
            let name = text::name(path);
            return Err(Failure::usage(format!("{name} has more than {MOST} commands")));
        }
        let piece = match order.step {
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
        };
        host.does(order.line, piece);
    }
    if !errors.is_empty() {
        // A job has ended at the first; there may be more.
        errors.clear();
        vimc4_ncp::job::check(whole, &site.target, options, &mut |diagnostic| {
            if diagnostic.problem.severity() == Severity::Error {
                errors.push(format!("line {}: {}", diagnostic.line, said(&diagnostic.problem)));
            }
        });
    }
    host.impossible = job.has_failed().then(|| job.line());
    host.errors = errors;
    Ok(Some(host))
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
