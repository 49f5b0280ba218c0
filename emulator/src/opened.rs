//! What there is to debug: a controller before a file, and what a host does with that.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use vimc4_catalogue::{Controller, Handling, Machine};
use vimc4_debug::{Debugger, Piece, Source, Unit, Way, Wired};
use vimc4_device::{Device, Event, Input, SignalId};
use vimc4_ncp::{Diagnostic, Severity};
use vimc4_script::{Host, Kind, Script, ScriptLine, is_job, number, storing, takes_jobs, told};
use vimc4_timeline::History;

use crate::failure::Failure;
use crate::job::file;
use crate::job::source::{JobOptions, Site};
use crate::recording::history::is_recording;
use crate::setup::Setup;
use crate::text;
use vimc4_answers::profiles::quirky;

/// A list of commands, a stored program, a plot or a job that was read: a controller that stands before
/// it, and what a host does with it.
pub(crate) struct Program {
    /// What the controller is called.
    pub(crate) name: String,
    pub(crate) machine: Arc<Machine>,
    pub(crate) history: History<Wired>,
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

impl Program {
    /// Why a job ends before its last line, if it does.
    pub(crate) fn ends_early(&self) -> Option<String> {
        let line = self.impossible?;
        let why = self.errors.first().map(String::as_str).unwrap_or_default();
        let why = why.strip_prefix(&format!("line {line}: ")).unwrap_or(why);
        Some(format!("line {line} cannot be carried out: {why}"))
    }
}

/// How a file is read and sent otherwise than by default.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ways {
    /// Quirks of the model that have another value.
    pub(crate) quirks: Vec<(String, String)>,
    /// The axes of a data field, if its comments do not say them.
    pub(crate) axes: Option<u8>,
    /// What is said about a job; other files have no such options.
    pub(crate) job: JobOptions,
}

/// Whether somebody still waits for what is opened.
pub(crate) type Wanted<'w> = &'w dyn Fn() -> bool;

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
    let is_job = takes_jobs(&model) && is_job(&bytes);
    let whole = match is_job {
        true => file::decoded(&bytes),
        false => String::from_utf8_lossy(&bytes).into_owned(),
    };
    let mut is_stored = false;
    let host = if is_job {
        let mut site = Site::of(model, Arc::clone(&machine))?;
        ways.job.zeros.set(&mut site)?;
        let options = ways.job.reading.options();
        let host = Host::job(&whole, &site.target, options, &|| flow(wanted));
        host.map_err(|error| Failure::usage(format!("{}: {error}", text::name(path))))?
    } else {
        let handling = Handling::of(&model);
        let script = Script::of(&text::name(path), &bytes, &handling).map_err(Failure::usage)?;
        // A job for other controllers has been told as one by now.
        ways.job.only_for_jobs(&text::name(path))?;
        match script.kind {
            Kind::Commands => Some(Host::commands(&script.lines, &handling, start(&debugger))),
            Kind::DataField => {
                is_stored = true;
                let axes = ways.axes.or(script.axes).unwrap_or(7);
                let stored = store(debugger, &script.lines, axes, wanted)?;
                let Some((stored, host)) = stored else { return Ok(None) };
                debugger = stored;
                Some(host)
            }
            Kind::Stream => Some(Host::stream(&script.lines)),
        }
    };
    let Some(host) = host.filter(|_| wanted()) else { return Ok(None) };
    let Host { pieces, lines, of_command, start, stored, statement, errors, impossible } = host;
    let is_error = |found: &&Diagnostic| ways.job.reading.severity(found) == Severity::Error;
    let errors = errors.iter().filter(is_error).map(told).collect();
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

/// The button START.
fn start(debugger: &Debugger) -> Option<SignalId> {
    debugger.device().signals().iter().find(|signal| signal.name == "start").map(|start| start.id)
}

/// A controller that has the lines stored as its program, and what then starts it.
fn store(
    debugger: Debugger,
    lines: &[ScriptLine],
    axes: u8,
    wanted: Wanted<'_>,
) -> Result<Option<(Debugger, Host)>, Failure> {
    let mut stored: Vec<u32> = lines.iter().map(number).collect();
    if lines.last().is_some_and(|line| line.is("9")) {
        stored.pop();
    }
    let mut debugger = debugger;
    for line in &storing(lines, axes) {
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
    let host = Host { start: start(&debugger).map(Piece::Press), stored, ..Host::new(Unit::Line) };
    Ok(Some((debugger, host)))
}
