//! The recording of a case.

use std::sync::Arc;

use vimc4_device::{
    Device, Event, FaultNews, Harness, Kinds, Names, Output, OwnedInput, TimedInput,
};
use vimc4_timeline::recording::{Entry, Given, Head, Recording, What};

use crate::recording::controller::PlayedDevice;

/// A recording has no more lines than this, where a case can be shown in them.
const LINES: usize = 30;

/// So many lines of the host are shown at least before the fault strikes.
const BEFORE: usize = 2;

/// Causes that may follow the last input.
const AFTERWARDS: u32 = 100_000;

/// Records what happens when a device is given these inputs. Where that is long, it begins with the state
/// shortly before the fault strikes.
pub(super) fn record(
    head: Head,
    device: &PlayedDevice,
    inputs: &[TimedInput],
    note: &str,
) -> Recording {
    let mut take = Take {
        harness: Harness::new(device.clone()).watching(Kinds::FAULT),
        names: Names::of(device),
        by: Arc::from("sweep"),
        entries: Vec::new(),
        starts: Vec::new(),
        strikes: None,
    };
    for input in inputs.iter().filter(|given| given.input != OwnedInput::Wake) {
        take.give(input);
    }
    for _ in 0..AFTERWARDS {
        if take.harness.step().is_none() {
            break;
        }
        take.take();
    }
    take.finish(head, note)
}

struct Take {
    harness: Harness<PlayedDevice>,
    names: Names,
    by: Arc<str>,
    entries: Vec<Entry>,
    /// Where the recording could begin: before which entry, and in which state.
    starts: Vec<(usize, Entry)>,
    /// The entry at which a fault has struck first.
    strikes: Option<usize>,
}

impl Take {
    fn give(&mut self, TimedInput { at, input }: &TimedInput) {
        self.harness.run_to(*at);
        self.take();
        let is_line = matches!(input, OwnedInput::Bytes(_));
        if self.starts.is_empty() || is_line && self.strikes.is_none() {
            self.starts.push((self.entries.len(), self.state()));
        }
        let (given, by) = (Given::of(input, || self.names.clone()), Arc::clone(&self.by));
        self.entries.push(Entry::new(*at, What::Given { by, given }));
        self.harness.input(input.as_input());
        self.take();
    }

    fn take(&mut self) {
        while let Some(output) = self.harness.take_output() {
            match output {
                Output::Bytes(at, bytes) => match self.entries.last_mut() {
                    Some(Entry { at: before, what: What::Sent(sent), .. }) if *before == at => {
                        *sent = [&sent[..], &bytes[..]].concat().into();
                    }
                    _ => self.entries.push(Entry::new(at, What::Sent(bytes))),
                },
                Output::Event(_, Event::Fault { news, .. }) => {
                    let strikes = matches!(news, FaultNews::Strikes(_) | FaultNews::Armed);
                    if strikes && self.strikes.is_none() {
                        self.strikes = Some(self.entries.len());
                    }
                }
                _ => {}
            }
        }
    }

    fn state(&self) -> Entry {
        let device = self.harness.device();
        // Every state can be written down.
        let state = serde_json::to_value(device.state()).unwrap_or_default();
        Entry::new(device.now(), What::State { by: None, state })
    }

    fn finish(self, head: Head, note: &str) -> Recording {
        // Head, state, note, state, end.
        let others = 5;
        let latest = self.starts.len().saturating_sub(1 + BEFORE);
        let fits = |(from, _): &&(usize, Entry)| self.entries.len() - from + others <= LINES;
        let start = self.starts.iter().take(latest + 1).find(fits);
        let start = start.or_else(|| self.starts.get(latest));
        let Some((from, begin)) = start.cloned() else {
            return Recording { head, entries: Vec::new(), torn: None };
        };
        let mut entries = vec![begin.clone(), Entry::new(begin.at, What::Mark(note.to_owned()))];
        let end = self.state();
        entries.extend(self.entries.into_iter().skip(from));
        let at = end.at;
        entries.push(end);
        entries.push(Entry::new(at, What::End("the case ends here".to_owned())));
        Recording { head, entries, torn: None }
    }
}
