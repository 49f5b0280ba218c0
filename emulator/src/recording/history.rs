//! A recording as a history, to be gone through forward and back.

use std::path::Path;
use std::sync::Arc;

use vimc4_catalogue::{Controller, Machine};
use vimc4_debug::Debugger;
use vimc4_device::{Device, Names, OwnedInput, TimedInput};
use vimc4_timeline::Place;
use vimc4_timeline::recording::{Entry, Given, LineSort, What};

use super::controller::Site;
use super::file::{read, unplayable};
use crate::failure::Failure;
use crate::text;

/// Whether a file is a recording: plain, or compressed.
pub(crate) fn is_recording(path: &Path, bytes: &[u8]) -> bool {
    let compressed = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("gz") || end.eq_ignore_ascii_case("zst"));
    compressed || bytes.starts_with(b"{\"recording\"")
}

/// Gives everything that was recorded to the recorded controller. The debugger stands at the
/// beginning of it.
///
/// # Errors
///
/// If it is no recording, or none of a controller that is at hand here.
pub(crate) fn open(path: &Path) -> Result<(Debugger, Arc<Machine>), Failure> {
    let recording = read(path)?;
    let site = Site::recorded(&recording).map_err(|error| unplayable(path, &recording, error))?;
    if recording.head.line == LineSort::Paced {
        return Err(Failure::usage(format!(
            "{} was recorded with --line-pacing, where bytes are on their way for a while; record it \
             without, or play it with `vimc4 replay`",
            text::name(path)
        )));
    }
    let controller = Controller::new(&site.model, Arc::clone(&site.machine), b"");
    let mut controller = controller.map_err(|error| unplayable(path, &recording, error))?;
    let mut entries = recording.entries.iter().peekable();
    let state = |entry: &Entry, state| {
        site.read(state)
            .map(|line| line.device)
            .map_err(|why| unplayable(path, &recording, format!("line {}: {why}", entry.line)))
    };
    while let Some(entry) = entries.next_if(|entry| !matches!(entry.what, What::Given { .. })) {
        if let What::State { state: written, .. } = &entry.what {
            controller.restore(state(entry, written)?);
            break;
        }
    }
    let mut debugger = Debugger::new(controller);
    let begin = debugger.place();
    for entry in entries {
        match &entry.what {
            What::Given { given, .. } => {
                debugger.history_mut().run_to(entry.at);
                if let Some(input) = input(&debugger, given) {
                    debugger.follow(&TimedInput { at: entry.at, input });
                }
            }
            What::State { by: Some(by), state: written } => {
                let state = state(entry, written)?;
                debugger.history_mut().run_to(entry.at);
                debugger.history_mut().fork(format!("put by {by}"), state);
            }
            What::Mark(name) => {
                debugger.history_mut().run_to(entry.at);
                debugger.mark(name.clone());
            }
            What::Sent(_) | What::End(_) => debugger.history_mut().run_to(entry.at),
            _ => {}
        }
    }
    debugger.history_mut().drain();
    let at_beginning = debugger.history_mut().go_back_to(Place { ..begin });
    debug_assert!(at_beginning, "where it began is there");
    Ok((debugger, site.machine))
}

/// What was given, for the controller at hand; nothing if it has no such signal, or if only time has
/// passed.
fn input(debugger: &Debugger, given: &Given) -> Option<OwnedInput> {
    let input = given.input(|| Names::of(debugger.device())).ok()?;
    (input != OwnedInput::Wake).then_some(input)
}
