//! What a host does with a file, piece by piece.

use std::ops::ControlFlow;
use std::time::Duration;

use vimc4_catalogue::{Handling, Machine, Model};
use vimc4_debug::{Piece, Unit};
use vimc4_device::{Condition, SignalId};
use vimc4_motion::Ramp;
use vimc4_ncp::job::{
    Controller, InputPort, InputTest, Job, Options, OutputPort, Question, Step, Target,
};
use vimc4_ncp::{Diagnostic, Problem, Severity};

use crate::ScriptLine;
use crate::sort::no_jobs;

/// So many commands of a job are sent at most.
const MOST: usize = 10_000_000;

/// So many lines of a job are checked before somebody is asked whether it is still wanted.
const PATIENCE: u32 = 1_000;

/// What a host does with a file, and where the lines of it are.
#[derive(Clone, Debug)]
pub struct Host {
    /// One after the other, each when the controller has completed the one before.
    pub pieces: Vec<Piece>,
    /// The line of each of them, from 1; 0 for one that is in no line.
    pub lines: Vec<u32>,
    /// The line of each command that is sent.
    pub of_command: Vec<u32>,
    /// Somebody presses START, if nothing else starts the program that is stored.
    pub start: Option<Piece>,
    /// The line of each line of the stored program.
    pub stored: Vec<u32>,
    /// What a statement is.
    pub statement: Unit,
    /// What is wrong with lines of a job, from the first on.
    pub errors: Vec<Diagnostic>,
    /// The line that cannot be carried out, if the job ends there.
    pub impossible: Option<u32>,
}

impl Host {
    /// One that does nothing yet.
    #[must_use]
    pub fn new(statement: Unit) -> Host {
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

    /// The lines of a command list, each when the one before is done; and the button START, which is
    /// `start`, for a program that they have stored, if nothing else starts it.
    #[must_use]
    pub fn commands(lines: &[ScriptLine], handling: &Handling, start: Option<SignalId>) -> Host {
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
        host.start = start.map(Piece::Press).filter(|_| !is_storing && !is_started);
        host.of_command.clone_from(&host.lines);
        host
    }

    /// The pieces of a plot, each when the one before is done, or as long as there is room.
    #[must_use]
    pub fn stream(lines: &[ScriptLine]) -> Host {
        let mut host = Host::new(Unit::Command);
        for line in lines {
            host.does(number(line), Piece::Send(line.whole()));
        }
        host.of_command = lines.iter().filter(|line| line.command).map(number).collect();
        host
    }

    /// The commands of the job in this text; `None` if nobody wants them any more.
    ///
    /// # Errors
    ///
    /// Why there are none, as a sentence.
    pub fn job(
        text: &str,
        target: &Target,
        options: Options,
        wanted: &dyn Fn() -> ControlFlow<()>,
    ) -> Result<Option<Host>, String> {
        let mut host = Host::new(Unit::Line);
        let mut errors: Vec<Diagnostic> = Vec::new();
        let mut job = Job::new(text, target, options);
        let mut orders = 0_u32;
        while let Some(order) = job.next(&mut |diagnostic| {
            if diagnostic.problem.severity() == Severity::Error {
                errors.push(diagnostic);
            }
        }) {
            orders = orders.wrapping_add(1);
            if orders.is_multiple_of(PATIENCE) && wanted().is_break() {
                return Ok(None);
            }
            if host.pieces.len() >= MOST {
                return Err(format!("it has more than {MOST} commands"));
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
                step => match step.line(target.controller.dialect) {
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
            vimc4_ncp::job::check(text, target, options, &mut |diagnostic| {
                if diagnostic.problem.severity() == Severity::Error {
                    errors.push(diagnostic);
                }
            });
        }
        host.impossible = job.has_failed().then(|| job.line());
        host.errors = errors;
        Ok(Some(host))
    }
}

/// The lines that have a data field stored as a program: it with what sets its axes before it, and with
/// its end.
#[must_use]
pub fn storing(lines: &[ScriptLine], axes: u8) -> Vec<ScriptLine> {
    let set_axes = [axes & 7, axes & 8].into_iter().filter(|axes| *axes != 0);
    let mut all: Vec<ScriptLine> =
        set_axes.map(|axes| ScriptLine::added(&format!("@0{axes}"))).collect();
    all.push(ScriptLine::added("@0i"));
    all.extend_from_slice(lines);
    if !lines.last().is_some_and(|line| line.is("9")) {
        all.push(ScriptLine::added("9"));
    }
    all
}

/// The number of a line, 0 for one that is in no file.
#[must_use]
pub fn number(line: &ScriptLine) -> u32 {
    line.number.and_then(|number| u32::try_from(number).ok()).unwrap_or(0)
}

/// Whether job files are for this model: they become lines of isel's @-format.
#[must_use]
pub fn takes_jobs(model: &Model) -> bool {
    model.isel().is_some()
}

/// A controller on a machine, as jobs see them.
///
/// # Errors
///
/// If the controller takes no jobs, as a sentence.
pub fn target(model: &Model, machine: &Machine) -> Result<Target, String> {
    let Some(inner) = model.isel() else { return Err(no_jobs(model)) };
    let read = |port| {
        let bits = inner.ports.input_bits(port)?;
        Some((port, InputPort { wired: bits.wired, free: bits.free, rest: bits.rest }))
    };
    let written = |port| {
        let (wired, is_single) = inner.ports.output_bits(port)?;
        Some((port, OutputPort { wired, is_single }))
    };
    let controller = Controller {
        dialect: inner.command_set.dialect(),
        speeds: inner.limits.speeds(),
        ramp: Ramp {
            start_stop: inner.defaults.start_stop,
            acceleration: inner.defaults.acceleration,
        },
        inputs: inner.ports.inputs().filter_map(read).collect(),
        outputs: inner.ports.outputs().filter_map(written).collect(),
        memory: inner.flash.size,
        command_bytes: inner.flash.command_bytes,
        parameter_bytes: inner.flash.parameter_bytes,
        branch_from_next: inner.quirks.branches_from_next(),
    };
    Ok(Target::new(controller, machine))
}

/// A problem, where it is, and what would be right.
#[must_use]
pub fn told(diagnostic: &Diagnostic) -> String {
    format!("line {}: {}", diagnostic.line, said(&diagnostic.problem))
}

/// A problem and what would be right.
#[must_use]
pub fn said(problem: &Problem) -> String {
    let help = problem.help().map(|help| format!("; {help}")).unwrap_or_default();
    format!("{problem}{help}")
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
