//! What it takes to have the past of a controller again.

use std::collections::VecDeque;
use std::mem;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_json::Value;
use vimc4::device::OwnedInput;
use vimc4::{EventFilter, Report, ReportKind, Sink, Time};

use crate::limits::{PAST_BYTES, PAST_INPUTS, PAST_ROUNDS};

/// A state of a controller, and everything that was done to it since.
#[derive(Clone, Debug)]
pub struct Past {
    /// When it was in that state.
    pub at: Time,
    /// The state, as [`ReportKind::State`] has it.
    pub state: Value,
    /// The inputs, and the states that were put in, oldest first.
    pub since: Vec<Report>,
}

/// Keeps the past of a controller, as far back as there is room.
#[derive(Clone, Debug, Default)]
pub struct Memory(Arc<Mutex<VecDeque<Sheet>>>);

/// A part of the past. There are two at most: when the later one is full, the earlier one is forgotten.
#[derive(Debug)]
struct Sheet {
    past: Past,
    /// How far it goes.
    until: Time,
    bytes: usize,
    /// How often everything was done that was due: what it costs to go over it again.
    rounds: u64,
}

impl Memory {
    /// All that is kept; `None` before the controller has told its state.
    #[must_use]
    pub fn past(&self) -> Option<Past> {
        let sheets = self.sheets();
        let first = &sheets.front()?.past;
        let since = sheets.iter().flat_map(|sheet| sheet.past.since.iter().cloned());
        Some(Past { at: first.at, state: first.state.clone(), since: since.collect() })
    }

    /// When it begins.
    pub(crate) fn first(&self) -> Option<Time> {
        self.sheets().front().map(|sheet| sheet.past.at)
    }

    /// What is kept is whole at any time, so a panic elsewhere is no reason to stop.
    fn sheets(&self) -> MutexGuard<'_, VecDeque<Sheet>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sheet {
    fn new(at: Time, state: Value) -> Sheet {
        Sheet { past: Past { at, state, since: Vec::new() }, until: at, bytes: 0, rounds: 0 }
    }

    fn is_full(&self) -> bool {
        self.past.since.len() >= PAST_INPUTS
            || self.bytes >= PAST_BYTES
            || self.rounds >= PAST_ROUNDS
    }
}

impl Sink for Memory {
    fn wants(&self) -> EventFilter {
        EventFilter::INPUTS
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        let mut sheets = self.sheets();
        match &report.what {
            ReportKind::State { by: None, state } => {
                sheets.push_back(Sheet::new(report.at, state.clone()))
            }
            ReportKind::Input { .. } | ReportKind::State { .. } => {
                let Some(sheet) = sheets.back_mut() else { return };
                sheet.bytes += match &report.what {
                    ReportKind::Input { input: OwnedInput::Bytes(bytes), .. } => bytes.len(),
                    // As large as a state is when it is written down.
                    ReportKind::State { .. } => PAST_BYTES / 64,
                    _ => mem::size_of::<Report>(),
                };
                sheet.past.since.push(report.clone());
            }
            _ => {}
        }
    }

    fn settled(&mut self, at: Time, state: &dyn Fn() -> Value) {
        let mut sheets = self.sheets();
        let Some(sheet) = sheets.back_mut() else { return };
        sheet.rounds += 1;
        sheet.until = at;
        if sheet.is_full() {
            sheets.push_back(Sheet::new(at, state()));
            while sheets.len() > 2 {
                sheets.pop_front();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vimc4::Source;

    fn report(at: u64, what: ReportKind) -> Report {
        Report { controller: "".into(), at: Time::from_nanos(at), what }
    }

    #[test]
    fn the_oldest_part_is_forgotten_and_the_rest_begins_with_a_state() {
        let mut memory = Memory::default();
        assert!(memory.past().is_none());
        let explain = |_: &[u8]| String::new();
        let input = || ReportKind::Input {
            by: Source::Controls("a test".into()),
            input: OwnedInput::Bytes("x".into()),
        };
        memory.report(&report(0, ReportKind::State { by: None, state: Value::from(0) }), &explain);
        let count = 3 * PAST_INPUTS as u64 + 5;
        for at in 1..=count {
            memory.report(&report(at, input()), &explain);
            memory.settled(Time::from_nanos(at), &|| Value::from(at));
        }
        let past = memory.past().unwrap();
        let first = 2 * PAST_INPUTS as u64;
        assert_eq!((past.at.as_nanos(), past.state), (first, Value::from(first)));
        assert_eq!(past.since.len() as u64, count - first);
        assert_eq!(past.since[0].at.as_nanos(), first + 1);
    }

    #[test]
    fn a_program_without_end_is_kept_for_so_many_rounds() {
        let mut memory = Memory::default();
        let state = ReportKind::State { by: None, state: Value::from(0) };
        memory.report(&report(0, state), &|_| String::new());
        for at in 1..=3 * PAST_ROUNDS {
            memory.settled(Time::from_nanos(at), &|| Value::from(at));
        }
        assert_eq!(memory.first(), Some(Time::from_nanos(2 * PAST_ROUNDS)));
    }
}
