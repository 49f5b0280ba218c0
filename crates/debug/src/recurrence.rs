//! A stored program that repeats itself for ever: a search through it has no end.

use std::collections::VecDeque;
use std::time::Duration;

use serde_json::Value;
use vimc4_device::{Condition, Device, Event, Output, Point, Time, TimerView};
use vimc4_timeline::{Act, Sought, Stretch, Which};

use crate::Wired;

/// Looks for something beyond the end of the history, and notices when the controller is in the same state as
/// before. What did not come in between never comes, unless something from outside changes the state.
///
/// States are compared where lines of the stored program begin, each with one that is kept. The kept one is
/// replaced after 1, 2, 4, 8 … lines (Brent's algorithm), so a repetition of any length is found.
pub(crate) struct Recurrence<'s, S> {
    sought: &'s mut S,
    /// No input comes after this instant.
    end: Time,
    kept: Option<EarlierState>,
    /// How many lines have begun since then, and at how many the state is replaced.
    lines: u64,
    most: u64,
    span: Option<Duration>,
}

/// A state, and what tells at low cost that another one is different.
struct EarlierState {
    at: Time,
    line: u32,
    position: Point,
    timers: Vec<TimerView>,
    state: Value,
}

impl<'s, S> Recurrence<'s, S> {
    pub(crate) fn new(sought: &'s mut S, end: Time) -> Recurrence<'s, S> {
        Recurrence { sought, end, kept: None, lines: 0, most: 1, span: None }
    }

    /// The length of the repetition, if that is where the search has ended.
    pub(crate) fn span(&self) -> Option<Duration> {
        self.span
    }

    /// Whether the controller is in a state that it was in before.
    fn repeats(&mut self, device: &Wired, line: u32) -> bool {
        // What faults and rules do may depend on the time.
        if device.now() <= self.end || !device.faults().is_empty() || !device.rules().is_empty() {
            return false;
        }
        let position = device.position(device.now());
        let same = self.kept.as_ref().filter(|kept| kept.line == line && kept.position == position);
        if let Some(kept) = same {
            let nanos = device.now().nanos_since(kept.at);
            if nanos > 0 && kept.is_later(&EarlierState::of(device, line, position), nanos) {
                self.span = Some(Duration::from_nanos(nanos));
                return true;
            }
        }
        self.lines += 1;
        if self.kept.is_none() || self.lines >= self.most {
            self.kept = Some(EarlierState::of(device, line, position));
            (self.lines, self.most) = (0, self.most.saturating_mul(2));
        }
        false
    }
}

impl EarlierState {
    fn of(device: &Wired, line: u32, position: Point) -> EarlierState {
        let at = device.now();
        let state = serde_json::to_value(device.state()).unwrap_or_default();
        EarlierState { at, line, position, timers: device.view(at).timers, state }
    }

    /// Whether another state is the same so many nanoseconds later.
    fn is_later(&self, other: &EarlierState, nanos: u64) -> bool {
        let is_shifted = |(one, other): (&TimerView, &TimerView)| {
            one.cause == other.cause && one.due.after_nanos(nanos) == other.due
        };
        self.timers.len() == other.timers.len()
            && self.timers.iter().zip(&other.timers).all(is_shifted)
            && is_same(&self.state, &other.state, nanos)
    }
}

/// Whether two values are the same, but for times that are so many nanoseconds later.
fn is_same(one: &Value, other: &Value, nanos: u64) -> bool {
    match (one, other) {
        (Value::Object(one), Value::Object(other)) => {
            let pairs = one.iter().zip(other);
            one.len() == other.len()
                && pairs.into_iter().all(|((key, one), (other_key, other))| {
                    key == other_key && is_same(one, other, nanos)
                })
        }
        (Value::Array(one), Value::Array(other)) => {
            one.len() == other.len()
                && one.iter().zip(other).all(|(one, other)| is_same(one, other, nanos))
        }
        (one, other) if one == other => true,
        (one, other) => one
            .as_u64()
            .zip(other.as_u64())
            .is_some_and(|(one, other)| one.checked_add(nanos) == Some(other)),
    }
}

/// Whether a condition depends on the state of a controller and on events only.
pub(crate) fn is_timeless(condition: &Condition) -> bool {
    match condition {
        Condition::At(_) => false,
        Condition::All(parts) | Condition::Any(parts) => parts.iter().all(is_timeless),
        _ => true,
    }
}

impl<S: Sought<Wired>> Sought<Wired> for Recurrence<'_, S> {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        self.sought.can_be_in(stretch)
    }

    fn begin(&mut self, device: &Wired) {
        self.sought.begin(device);
    }

    fn between(&mut self, device: &Wired, until: Time, which: Which) -> Option<Time> {
        self.sought.between(device, until, which)
    }

    fn looked_until(&mut self) -> Option<Time> {
        self.sought.looked_until()
    }

    fn after(&mut self, device: &Wired, act: Act, outputs: &VecDeque<Output>) -> bool {
        let is_found = self.sought.after(device, act, outputs);
        let line = outputs.iter().find_map(|output| match output.event()? {
            Event::Line { line, .. } => Some(*line),
            _ => None,
        });
        is_found || line.is_some_and(|line| self.repeats(device, line))
    }
}
