//! A recording as a history, to be gone through forward and back.

use std::cell::Cell;
use std::collections::VecDeque;
use std::io::Read as _;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

use serde_json::Value;
use vimc4_catalogue::{Machine, Model, State};
use vimc4_debug::{Debugger, Recorded, Reel, uninterrupted};
use vimc4_device::{Device, LineState, Names, OwnedInput, Time};
use vimc4_timeline::History;
use vimc4_timeline::recording::{Comparison, Entry, Given, Tolerance, What};

use super::controller::{PlayedDevice, Site};
use super::file::{Lines, Share, torn_off};
use crate::failure::Failure;
use crate::text;
use vimc4_answers::profiles::known;

/// How many lines are read before anything is shown: some tens of milliseconds, and most recordings
/// as a whole.
const BEGINNING: usize = 10_000;

/// A recording that was opened.
pub(crate) struct Opened {
    /// Stands at the beginning, and reads on as it is gone through.
    pub(crate) debugger: Debugger,
    pub(crate) model: Model,
    pub(crate) machine: Arc<Machine>,
    /// The name of the controller, if it has one.
    pub(crate) controller: String,
    /// How much of it has been read.
    pub(crate) share: Share,
}

/// Whether the commands of a recording are the lines that a debugger shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Commands {
    /// They are.
    Listed,
    /// They are not.
    Unlisted,
}

/// Whether a file that begins like this is a recording: plain, or compressed, whatever it is called.
pub(crate) fn is_recording(path: &Path, beginning: &[u8]) -> bool {
    let compressed = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("gz") || end.eq_ignore_ascii_case("zst"));
    // Something else may be compressed, too. What is broken is told of when it is opened.
    let mut unpacked = Vec::new();
    let _ = vimc4::unpacking(beginning).and_then(|text| text.take(64).read_to_end(&mut unpacked));
    // No program, plot or job begins like JSON: such a file is a recording, or what is left of one,
    // and what is wrong with it is said when it is opened.
    let text = unpacked.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&unpacked);
    match text.trim_ascii() {
        [] => compressed,
        text => text.starts_with(b"{\""),
    }
}

/// Refuses a recording where a program is meant.
///
/// # Errors
///
/// If it is one.
pub(crate) fn no_recording(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    if !is_recording(path, bytes) {
        return Ok(());
    }
    let (name, named) = (text::name(path), text::shown_in_line(&path.display().to_string()));
    if path == Path::new("-") {
        return Err(Failure::usage(format!(
            "{name} is a recording; `vimc4 replay -` plays it again"
        )));
    }
    Err(Failure::usage(format!(
        "{name} is a recording; `vimc4 replay {named}` plays it again, `vimc4 console {named}` \
         looks at it"
    )))
}

/// Opens a recording, in the state in which it begins.
///
/// # Errors
///
/// If it is not a recording, or none of a controller that is at hand here, or something is wrong at
/// its beginning. Problems further down are reported when they are reached.
pub(crate) fn open(path: &Path, commands: Commands) -> Result<Opened, Failure> {
    let lines = Lines::open(path)?;
    let head = lines.reader().head().clone();
    let site = Site::of_head(&head).map_err(|error| lines.unplayable(1, error))?;
    let mut line = site.fresh()?;
    let names = Names::of(&line);
    let (model, machine) = (site.model.clone(), Arc::clone(&site.machine));
    let (failure, share) = (Rc::new(Cell::new(None)), lines.share().clone());
    let player = site.player()?.without_meanings();
    let comparison = Comparison::new(player, Tolerance::of(&head));
    let queue = VecDeque::new();
    let mut tape =
        Tape { lines, site, names, queue, comparison, is_over: false, failure: failure.clone() };
    let mut first = tape.lines.next()?;
    // It begins with a state; without one, as a controller that was just switched on.
    while let Some(entry) = first.take_if(|entry| !matches!(entry.what, What::Given { .. })) {
        tape.compare(&entry)?;
        if let What::State { state, .. } = &entry.what {
            line.restore(state_of(&tape.lines, &tape.site, &entry, state)?);
            break;
        }
        first = tape.lines.next()?;
    }
    if let Some(first) = first {
        tape.take(&first)?;
    }
    let mut debugger = Debugger::over(History::new(line)).with_reel(Box::new(tape));
    if commands == Commands::Listed {
        debugger.list_commands(format!("commands of {}", text::name(path)));
    }
    let _ = debugger.read_on(BEGINNING, &mut uninterrupted);
    if let Some(failure) = failure.take() {
        return Err(failure);
    }
    Ok(Opened { debugger, model, machine, controller: head.controller, share })
}

/// The lines of a recording for the controller at hand.
struct Tape {
    lines: Lines,
    site: Site,
    names: Names,
    /// What was read and is not handed out yet.
    queue: VecDeque<(Time, Recorded)>,
    /// Compares what is read with a controller of its own.
    comparison: Comparison<PlayedDevice>,
    /// Everything is read.
    is_over: bool,
    /// What was wrong, for a caller that can show the place.
    failure: Rc<Cell<Option<Failure>>>,
}

impl Reel for Tape {
    fn next(&mut self) -> Result<Option<(Time, Recorded)>, String> {
        self.following().map_err(|failure| {
            let why = failure.text();
            self.failure.set(Some(failure));
            why
        })
    }

    fn share(&self) -> Option<u32> {
        self.lines.share().thousandths()
    }

    fn notice(&self) -> Option<String> {
        self.lines.reader().torn().map(torn_off)
    }
}

impl Tape {
    fn following(&mut self) -> Result<Option<(Time, Recorded)>, Failure> {
        loop {
            if let Some(next) = self.queue.pop_front() {
                return Ok(Some(next));
            }
            if self.is_over {
                return Ok(None);
            }
            match self.lines.next()? {
                Some(entry) => self.take(&entry)?,
                None => {
                    self.is_over = true;
                    self.comparison.finish();
                    self.tell_mismatches();
                }
            }
        }
    }

    /// Compares an entry, and has what it means for the history handed out.
    fn take(&mut self, entry: &Entry) -> Result<(), Failure> {
        self.compare(entry)?;
        let recorded = match &entry.what {
            What::Given { given, .. } => self.given(entry, given)?,
            What::State { by: Some(by), state } => {
                let state = state_of(&self.lines, &self.site, entry, state)?;
                Recorded::Put(by.to_string(), Box::new(state))
            }
            What::Mark(name) => Recorded::Mark(name.clone()),
            What::Sent(_) | What::End(_) => Recorded::Passed,
            What::State { by: None, .. } | What::Stands(_) | What::Goes | What::News(_) => {
                return Ok(());
            }
        };
        self.queue.push_back((entry.at, recorded));
        Ok(())
    }

    fn compare(&mut self, entry: &Entry) -> Result<(), Failure> {
        let Tape { lines, site, comparison, .. } = self;
        comparison
            .read(entry, &|state| site.read(state), &mut |_| {})
            .map_err(|error| lines.unplayable(entry.line, error))?;
        self.tell_mismatches();
        Ok(())
    }

    /// No time passes with a mismatch, which is found out only after it.
    fn tell_mismatches(&mut self) {
        let found = self.comparison.take_mismatches();
        self.queue.extend(found.map(|mismatch| (Time::ZERO, Recorded::Differs(mismatch))));
    }

    fn given(&self, entry: &Entry, given: &Given) -> Result<Recorded, Failure> {
        match known(&self.names, given) {
            Ok(OwnedInput::Wake) => Ok(Recorded::Passed),
            Ok(input) => Ok(Recorded::Given(input)),
            Err(why) => {
                let why = format!("line {}: {why}", entry.line);
                Err(self.lines.unplayable(entry.line, why))
            }
        }
    }
}

fn state_of(
    lines: &Lines,
    site: &Site,
    entry: &Entry,
    state: &Value,
) -> Result<LineState<State>, Failure> {
    let number = entry.line;
    site.read(state).map_err(|why| lines.unplayable(number, format!("line {number}: {why}")))
}
