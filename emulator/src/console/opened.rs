//! What the console is opened on: a recording, or a file that is sent to a controller ahead of the person
//! who steps.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use vimc4::escape;
use vimc4_catalogue::Machine;
use vimc4_debug::{
    Debugger, Feed, Options, Piece, Reason, Source, Stop, Trigger, Way, uninterrupted,
};
use vimc4_device::{CommandNumber, Condition, Event, Kinds, Output};
use vimc4_timeline::{Branch, Place};

use crate::failure::Failure;
use crate::job::file;
use crate::job::source::JobOptions;
use crate::opened::{self, Program, Ways};
use crate::recording::file::Share;
use crate::recording::history::{self, Commands};
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
#[derive(Clone, Debug)]
pub(crate) struct Sending {
    /// The most time that may pass.
    pub(crate) time: Duration,
    /// Go on after error replies.
    pub(crate) keeps_going: bool,
    /// The axes of a data field, if its comments do not say them.
    pub(crate) axes: Option<u8>,
    /// What is said about a job.
    pub(crate) job: JobOptions,
}

impl Default for Sending {
    fn default() -> Sending {
        let time = Duration::from_secs(3_600);
        Sending { time, keeps_going: false, axes: None, job: JobOptions::default() }
    }
}

/// Opens a recording, a command list, a stored program, a plot or a job: whatever the file is. What is
/// not a recording is sent to a controller that has just been switched on, in virtual time; the history
/// is of that. A program is stored, and waits for START.
///
/// # Errors
///
/// If it cannot be read or is none of these.
pub(crate) fn open(path: &Path, setup: Setup, sending: Sending) -> Result<Opened, Failure> {
    if history::is_recording(path, &file::beginning(path)) {
        sending.job.only_for_jobs(&text::name(path))?;
        let history::Opened { debugger, machine, share, .. } =
            history::open(path, Commands::Unlisted)?;
        return Ok(Opened { debugger, machine, note: None, share: Some(share) });
    }
    let ways = Ways { axes: sending.axes, job: sending.job.clone(), ..Ways::default() };
    let program = opened::read(path, setup, &ways, &|| true)?;
    let program = program.ok_or_else(|| Failure::midway("nobody has waited for it"))?;
    Ok(send(program, path, &sending))
}

/// Sends all of it, each when the one before is done, or as far as it waits for something, and stands at the
/// beginning again. The rest is sent as one goes on, on a branch too. Who is not told otherwise sends nothing more
/// after an error reply.
fn send(program: Program, path: &Path, sending: &Sending) -> Opened {
    let ends_early = program.ends_early();
    let Program { machine, history, mut source, pieces, lines, start, is_stored, .. } = program;
    source.name = text::name(path);
    let careful = |feed: Feed| if sending.keeps_going { feed } else { feed.until_error() };
    let debugger = Debugger::over(history);
    if is_stored {
        let feed = careful(Feed::new(start.into_iter().collect()));
        let mut debugger = debugger.with_feed(feed);
        // The lines that are shown are those of the program.
        debugger.mark("start of the program");
        return Opened { debugger, machine, note: None, share: None };
    }
    let sent: Vec<(u32, Vec<u8>)> = lines
        .iter()
        .zip(&pieces)
        .filter_map(|(line, piece)| match piece {
            Piece::Send(bytes) => Some((*line, bytes.clone())),
            _ => None,
        })
        .collect();
    let feed = careful(Feed::new(pieces).of_lines(lines));
    let mut debugger = debugger.with_source(source).with_feed(feed);
    let mut note = run_ahead(&mut debugger, sending);
    name_lines(&mut debugger, &sent);
    match start {
        Some(start) if note.is_none() => debugger.then(start),
        _ => {}
    }
    note = note
        .or(ends_early)
        .or_else(|| Some(format!("{}; the rest is sent then", debugger.waits()?)));
    let first = debugger.history().branches().next();
    if let Some(Branch { id: branch, first: moment, .. }) = first {
        // It is there.
        let _ = debugger.go_to(Place { branch, moment });
    }
    Opened { debugger, machine, note, share: None }
}

/// Goes on until everything was sent and is done, or until it waits. Says what went wrong, if so.
fn run_ahead(debugger: &mut Debugger, sending: &Sending) -> Option<String> {
    let end = debugger.now() + sending.time;
    let refused = Trigger::Condition(Condition::Error { code: None });
    let counts = Options { log: Some(String::new()), ..Options::default() };
    let refused = debugger.add_breakpoint(refused, counts);
    let note = loop {
        let stop = debugger.go(Way::Forward, None, &mut |now| match now <= end {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        });
        if !sending.keeps_going
            && let Some(note) = refusal(debugger, &stop)
        {
            break Some(note);
        }
        if stop.why == Reason::Cancelled {
            let line = debugger.executing().zip(debugger.source());
            let line = line.and_then(|(command, source)| source.line_of(command.number));
            break Some(format!("line {}: the time of --for is over", line.unwrap_or(0)));
        }
        // There is no operator, and questions are answered. What it waits for can only come from whoever
        // steps.
        if !debugger.answer() {
            break None;
        }
    };
    let refused = debugger.breakpoints().iter().find(|own| own.id == refused);
    let count = refused.map_or(0, |breakpoint| breakpoint.count);
    debugger.clear_breakpoints();
    match note {
        None if count > 0 => {
            let s = if count == 1 { "y" } else { "ies" };
            Some(format!("{count} error repl{s}; everything was sent all the same"))
        }
        note => note,
    }
}

/// The first command that was answered with an error on the way to a stop, for people.
fn refusal(debugger: &mut Debugger, stop: &Stop) -> Option<String> {
    let all = stop.problems.iter().chain(&stop.outputs);
    let (number, answer, why) = all.into_iter().find_map(|output| match output {
        Output::Event(stamp, Event::Answer { why: Some(why), bytes, .. }) => {
            Some((stamp.command, bytes.to_vec(), why.to_string()))
        }
        _ => None,
    })?;
    let command = debugger.last_event(Kinds::COMMAND, &mut uninterrupted, |stamp, event| {
        matches!(event, Event::Command { .. }) && stamp.command == number
    });
    let sent = match command.map(|told| told.event) {
        Some(Event::Command { bytes, .. }) => escape(&bytes),
        _ => String::new(),
    };
    let line = number.and_then(|number| debugger.source()?.line_of(number)).unwrap_or(0);
    Some(format!(
        "line {line}: {sent} was answered {}: {why}; the rest was not sent (--keep-going sends it)",
        escape(answer.trim_ascii())
    ))
}

/// Finds out which line each command comes from, by the bytes that came for it; those that are still to be sent
/// come from the lines behind.
fn name_lines(debugger: &mut Debugger, sent: &[(u32, Vec<u8>)]) {
    /// How many pieces that are not commands are skipped between two that are.
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
        let found = ahead.enumerate().find(|(_, (_, sent))| is_command(sent, bytes));
        found.map_or(0, |(place, (line, _))| {
            next += place + 1;
            *line
        })
    };
    let mut of_command: Vec<u32> = begun.values().map(line_of).collect();
    let first = begun.keys().next().copied();
    let Some(source) = debugger.source().cloned() else { return };
    let last = of_command.iter().copied().max().unwrap_or_default();
    let behind = of_command.iter().filter(|line| **line == last && last > 0).count();
    let next = source.of_command.partition_point(|line| *line < last) + behind;
    of_command.extend(source.of_command.get(next..).unwrap_or_default());
    debugger.set_source(Some(Source { of_command, first, ..source }));
}

/// Whether a command is what was sent. Of a long one only the beginning is reported.
fn is_command(sent: &[u8], command: &[u8]) -> bool {
    let sent = sent.trim_ascii_end();
    let sent = sent.strip_suffix(b";").unwrap_or(sent).trim_ascii();
    let command = command.trim_ascii();
    match command.strip_suffix(b"...") {
        Some(beginning) => sent.starts_with(beginning.trim_ascii_end()),
        None => sent == command,
    }
}
