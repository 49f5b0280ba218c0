//! What there is to debug: a controller with its history, and the text its commands come from.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use vimc4::escape;
use vimc4_catalogue::{Controller, Handling, Machine};
use vimc4_debug::{Debugger, Source, uninterrupted};
use vimc4_device::{CommandNumber, Device, Event, Input, Kinds, OwnedInput, Time, TimedInput};
use vimc4_ncp::job::Job;
use vimc4_timeline::{Branch, Place};

use crate::failure::Failure;
use crate::job::file;
use crate::job::operator::Operator;
use crate::job::perform::{Ending, Piece, Work, perform};
use crate::job::source::{Reading, Site, takes_jobs};
use crate::job::virtual_time::{Sent, Virtual};
use crate::recording::file::Share;
use crate::recording::history::{self, Commands};
use crate::run::driver::{Driver, Halt};
use crate::run::meter::Meter;
use crate::run::script::{Kind, Script, ScriptLine};
use crate::setup::Setup;
use crate::text;

/// What there is to debug.
pub(crate) struct Opened {
    /// Stands where the file begins.
    pub(crate) debugger: Debugger,
    pub(crate) machine: Arc<Machine>,
    /// Why not all of the file was sent, if so.
    pub(crate) note: Option<String>,
    /// How much of a recording has been read.
    pub(crate) share: Option<Share>,
}

/// How a file is sent to a controller in virtual time, so that there is a history.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sending {
    /// So much time may pass.
    pub(crate) time: Duration,
    /// Go on after error replies.
    pub(crate) keeps_going: bool,
    /// The axes of a data field, if its comments do not say them.
    pub(crate) axes: Option<u8>,
}

impl Default for Sending {
    fn default() -> Sending {
        Sending { time: Duration::from_secs(3_600), keeps_going: false, axes: None }
    }
}

/// Opens a recording, a command list, a stored program, a plot or a job: whatever the file is. What is
/// not a recording is sent to a controller that has just been switched on, in virtual time, as `vimc4
/// run` does it; the history is of that.
///
/// # Errors
///
/// If it cannot be read or is none of these.
pub(crate) fn open(path: &Path, mut setup: Setup, sending: Sending) -> Result<Opened, Failure> {
    if history::is_recording(path, &file::beginning(path)) {
        let history::Opened { debugger, machine, share, .. } =
            history::open(path, Commands::Unlisted)?;
        return Ok(Opened { debugger, machine, note: None, share: Some(share) });
    }
    let bytes = file::read(path, "a recording, a program, a list of commands, a plot or a job")?;
    let name = text::name(path);
    setup.heed(path, &bytes)?;
    let model = vimc4::model(setup.model())?;
    let machine = vimc4::machine(setup.machine())?;
    file::no_g_code(&name, &bytes)?;
    let controller = || Controller::new(&model, Arc::clone(&machine), b"").map_err(Failure::midway);
    let mut debugger = Debugger::new(controller()?);
    let handling = Handling::of(&model);
    let note = if takes_jobs(&model) && file::is_job(&bytes) {
        let text = file::decoded(&bytes);
        let site = Site::new(setup.model(), setup.machine())?;
        let job = Job::new(&text, &site.target, Reading::default().options());
        let work = Work::Job(Box::new(job));
        send(&mut debugger, (&name, &text), work, (handling, &machine), sending)
    } else {
        let script = Script::of(path, &bytes, &handling)?;
        let text = String::from_utf8_lossy(&bytes);
        match script.kind {
            Kind::DataField => {
                let axes = sending.axes.or(script.axes).unwrap_or(7);
                store(&mut debugger, &script.lines, axes);
                None
            }
            Kind::Commands => {
                let lines: Vec<_> =
                    script.lines.iter().map(|line| (number(line), line.whole())).collect();
                let work = Work::List(lines.into_iter());
                send(&mut debugger, (&name, &text), work, (handling, &machine), sending)
            }
            Kind::Stream => {
                let pieces = script.lines.iter().map(|line| Piece {
                    line: number(line),
                    bytes: line.whole(),
                    is_command: line.command,
                });
                let work = Work::Plot(pieces.collect::<Vec<_>>().into_iter());
                send(&mut debugger, (&name, &text), work, (handling, &machine), sending)
            }
        }
    };
    Ok(Opened { debugger, machine, note, share: None })
}

fn number(line: &ScriptLine) -> u32 {
    line.number.and_then(|number| u32::try_from(number).ok()).unwrap_or(0)
}

/// Sends all of it to one controller, each when the one before is done, and gives the debugger's the
/// same at the same times. Says why not all of it was sent, if so.
fn send(
    debugger: &mut Debugger,
    (name, text): (&str, &str),
    mut work: Work<'_>,
    (handling, machine): (Handling, &Machine),
    sending: Sending,
) -> Option<String> {
    let driver = Driver::new(debugger.device().clone(), Meter::new(machine), None);
    let mut link = Virtual::new(driver, handling, false);
    link.record = Some(Vec::new());
    let end = link.driver.now() + sending.time;
    link.driver.stop_at(end);
    // Nobody is there: what is asked is accepted, and what waits for a signal does not wait.
    let mut operator = Operator::new(text, true, true, false);
    let mut refused = 0;
    let note = loop {
        match perform(&mut work, &mut link, &mut operator) {
            Ok(Ending::Refused { line, sent, answer }) => {
                if sending.keeps_going {
                    refused += 1;
                    continue;
                }
                let answer = link.refusal(&sent, &answer);
                break Some(format!(
                    "line {line}: {} was answered {answer}; the rest was not sent (--keep-going \
                     sends it)",
                    escape(sent.trim_ascii_end())
                ));
            }
            Ok(Ending::Done) if refused > 0 => {
                let s = if refused == 1 { "y" } else { "ies" };
                break Some(format!("{refused} error repl{s}; everything was sent all the same"));
            }
            Ok(Ending::Done) => break None,
            Ok(Ending::Impossible { line, why }) => {
                break Some(format!("line {line} cannot be carried out: {why}"));
            }
            Ok(Ending::FalseReference { line }) => {
                break Some(format!(
                    "line {line}: a reference run was stopped; the rest was not sent"
                ));
            }
            Ok(Ending::Ended { line } | Ending::Unattended { line }) => {
                break Some(format!("line {line} waits for somebody; the rest was not sent"));
            }
            Err(Halt::Time) => {
                break Some(format!("line {}: the time of --for is over", link.line));
            }
            Err(_) => {
                break Some(format!(
                    "line {} waits, and nothing will change that; the rest was not sent",
                    link.line
                ));
            }
        }
    };
    let end = link.driver.now();
    let sent = link.record.take().unwrap_or_default();
    let source = follow(debugger, &sent, end);
    let lines = text.lines().map(str::to_owned).collect();
    debugger.set_source(Some(Source { name: name.to_owned(), lines, ..source }));
    note
}

/// Gives all of this to the debugger's controller, and stands at its beginning again. Which line each
/// command comes from is found by the bytes that came for it.
fn follow(debugger: &mut Debugger, sent: &[Sent], end: Time) -> Source {
    for Sent { at, bytes, .. } in sent {
        debugger.follow(&TimedInput { at: *at, input: Input::Bytes(bytes).into() });
    }
    debugger.history_mut().run_to(end);
    debugger.history_mut().drain();
    let source = source_of(debugger, sent);
    let first = debugger.history().branches().next();
    if let Some(Branch { id: branch, first: moment, .. }) = first {
        // It is there.
        let _ = debugger.go_to(Place { branch, moment });
    }
    source
}

/// The line of each command, in order. Commands begin in the order in which they were sent; of what
/// was sent some is not a command.
fn source_of(debugger: &mut Debugger, sent: &[Sent]) -> Source {
    /// So much that is not a command is passed over between two that are.
    const PASSED_OVER: usize = 64;
    let mut begun: BTreeMap<CommandNumber, Vec<u8>> = BTreeMap::new();
    // One walk over all of it: it tells of every command and finds none.
    let _ = debugger.last_event(Kinds::COMMAND, &mut uninterrupted, |stamp, event| {
        if let (Some(number), Event::Command { bytes, .. }) = (stamp.command, event) {
            begun.entry(number).or_insert_with(|| bytes.to_vec());
        }
        false
    });
    let mut next = 0;
    let line_of = |bytes: &Vec<u8>| {
        let ahead = sent.get(next..).unwrap_or_default().iter().take(PASSED_OVER);
        let found = ahead.enumerate().find(|(_, sent)| is_command(&sent.bytes, bytes));
        found.map_or(0, |(place, sent)| {
            next += place + 1;
            sent.line
        })
    };
    let of_command = begun.values().map(line_of).collect();
    Source { of_command, first: begun.keys().next().copied(), ..Source::default() }
}

/// Whether a command is what was sent. Of a long one only the beginning is told.
fn is_command(sent: &[u8], command: &[u8]) -> bool {
    let sent = sent.trim_ascii_end();
    let sent = sent.strip_suffix(b";").unwrap_or(sent).trim_ascii();
    let command = command.trim_ascii();
    match command.strip_suffix(b"...") {
        Some(beginning) => sent.starts_with(beginning.trim_ascii_end()),
        None => sent == command,
    }
}

/// So long somebody keeps START pressed.
const PRESS: Duration = Duration::from_millis(100);

/// Stores lines as a program and presses START; stands there.
fn store(debugger: &mut Debugger, lines: &[ScriptLine], axes: u8) {
    let go_on = &mut uninterrupted;
    let set_axes = [axes & 7, axes & 8].into_iter().filter(|axes| *axes != 0);
    let mut all: Vec<Vec<u8>> = set_axes.map(|axes| format!("@0{axes}\r").into_bytes()).collect();
    all.push(b"@0i\r".to_vec());
    all.extend(lines.iter().map(ScriptLine::whole));
    if !lines.last().is_some_and(|line| line.is("9")) {
        all.push(b"9\r".to_vec());
    }
    for line in &all {
        debugger.give(Input::Bytes(line));
        debugger.go(vimc4_debug::Way::Forward, None, go_on);
    }
    let signals = debugger.device().signals();
    let Some(start) = signals.iter().find(|signal| signal.name == "start") else { return };
    let begin = debugger.now();
    debugger.mark("start of the program");
    let place = debugger.place();
    for (value, after) in [(1, Duration::ZERO), (0, PRESS)] {
        debugger
            .follow(&TimedInput { at: begin + after, input: OwnedInput::Signal(start.id, value) });
    }
    // It is there.
    let _ = debugger.go_to(place);
}
