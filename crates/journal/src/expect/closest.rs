//! What came closest to something that did not come.

use std::collections::BTreeMap;
use std::time::Duration;

use bytes::Bytes;
use vimc4_device::{Condition, Event, Grouped, LengthUnit, Names, Time, escape};

use super::{Pattern, Reply, times};
use crate::journal::signal_words;
use crate::words::{Excerpt, seconds, short};
use crate::{Entry, Journal, Move, Picture, What};

/// Something that came close, and how it differs.
#[derive(Debug)]
pub(super) struct Near {
    pub(super) entry: Option<u64>,
    pub(super) text: String,
}

/// What came closest to a pattern after an entry and up to a time. It may have come `early`, before
/// its turn.
pub(super) fn closest(
    pattern: &Pattern,
    early: bool,
    journal: &Journal,
    before: u64,
    until: Time,
    names: &Names,
) -> Vec<Near> {
    let past = Past { journal, before, until, names, early };
    match pattern {
        Pattern::Command { like, reply, within } => {
            past.command(like, reply.as_ref(), *within).into_iter().collect()
        }
        Pattern::When(condition) => past.condition(condition),
    }
}

/// What happened in the time that counts.
struct Past<'a> {
    journal: &'a Journal,
    before: u64,
    until: Time,
    names: &'a Names,
    early: bool,
}

impl<'a> Past<'a> {
    fn entries(&self) -> impl DoubleEndedIterator<Item = &'a Entry> + use<'a> {
        let (before, until) = (self.before, self.until);
        self.journal.entries().filter(move |entry| entry.number > before && entry.at <= until)
    }

    // --- commands ---

    fn commands(&self) -> impl Iterator<Item = (&'a Entry, &'a str, &'a Bytes)> + use<'a> {
        self.entries().filter_map(|entry| match entry.event() {
            Some(Event::Command { mnemonic, bytes }) => Some((entry, &**mnemonic, bytes)),
            _ => None,
        })
    }

    fn command(&self, like: &str, reply: Option<&Reply>, within: Option<Duration>) -> Option<Near> {
        let wanted = Condition::Command { like: Some(like.to_owned()) };
        let is_it = |entry: &Entry| entry.event().is_some_and(|event| wanted.is_seen_in(event));
        // The same command: with the right answer too late, with a wrong answer, or with other
        // numbers.
        let score = |(entry, mnemonic, bytes): &(&'a Entry, &str, &Bytes)| {
            if is_it(entry) {
                let right =
                    self.answers(entry).any(|(_, answer)| reply.is_none_or(|r| r.is(answer)));
                return usize::MAX - usize::from(!right);
            }
            let alike = like.bytes().zip(bytes.iter()).take_while(|(one, other)| one == *other);
            if is_form_of(like, mnemonic) { alike.count() + 1 } else { 0 }
        };
        let best = self.commands().filter(|command| score(command) > 0).max_by_key(score);
        let Some((entry, _, bytes)) = best else { return Some(self.others()) };
        let place = format!("at {}, {}", seconds(entry.at), Excerpt(bytes));
        let text = match reply {
            _ if !is_it(entry) => format!("{place} does not begin with {like}"),
            Some(reply) if !self.answers(entry).any(|(_, answer)| reply.is(answer)) => {
                self.other_answer(entry, reply, &place)
            }
            Some(_) if within.is_some_and(|within| self.took(entry, reply) > Some(within)) => {
                let (took, within) = (self.took(entry, reply)?, within?);
                format!("{place} was answered after {}, not within {}", short(took), short(within))
            }
            _ if self.early => format!("{place} came before its turn"),
            _ => return None,
        };
        Some(Near { entry: Some(entry.number), text })
    }

    /// The commands that came instead.
    fn others(&self) -> Near {
        let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
        for (_, mnemonic, _) in self.commands() {
            *counts.entry(mnemonic).or_default() += 1;
        }
        let named = counts.into_iter().map(|(mnemonic, count)| match count {
            1 => mnemonic.to_owned(),
            count => format!("{mnemonic} ({})", times(count)),
        });
        let named = named.collect::<Vec<_>>().join(", ");
        let text = match named.as_str() {
            "" => "no command came at all".to_owned(),
            named => format!("none; the commands that came are {named}"),
        };
        Near { entry: None, text }
    }

    /// How long the right answer to a command took.
    fn took(&self, command: &'a Entry, reply: Option<&Reply>) -> Option<Duration> {
        let mut answers = self.answers(command);
        let right = answers.find(|(_, answer)| reply.is_none_or(|reply| reply.is(answer)));
        right.map(|(entry, _)| entry.at - command.at)
    }

    /// The answers to a command.
    fn answers(
        &self,
        command: &'a Entry,
    ) -> impl Iterator<Item = (&'a Entry, &'a Event)> + use<'a> {
        let number = command.command;
        let behind = self.entries().filter(move |entry| {
            entry.number > command.number && number.is_some() && entry.command == number
        });
        behind.filter_map(|entry| match entry.event() {
            Some(event @ Event::Answer { .. }) => Some((entry, event)),
            _ => None,
        })
    }

    /// How the answer to a command differs.
    fn other_answer(&self, command: &'a Entry, reply: &Reply, place: &str) -> String {
        let Some((_, Event::Answer { bytes, why, .. })) = self.answers(command).next() else {
            return format!("{place} has not been answered");
        };
        let said = escape(bytes.trim_ascii_end());
        let because = why.as_ref().map_or_else(String::new, |why| format!(": {why}"));
        match reply {
            Reply::Text(text) => format!("{place} was answered {said}, not {text}{because}"),
            Reply::Error(Some(code)) => {
                format!("{place} was answered {said}, not with error {code}{because}")
            }
            Reply::Error(None) | Reply::Any => {
                format!("{place} was answered {said}, which is not an error")
            }
        }
    }

    // --- conditions ---

    /// How close each part of a condition came.
    fn condition(&self, condition: &Condition) -> Vec<Near> {
        match condition {
            Condition::All(parts) => parts.iter().flat_map(|part| self.part(part, true)).collect(),
            Condition::Any(parts) => parts.iter().flat_map(|part| self.condition(part)).collect(),
            one => self.part(one, false),
        }
    }

    fn part(&self, condition: &Condition, together: bool) -> Vec<Near> {
        match condition {
            Condition::All(_) | Condition::Any(_) => return self.condition(condition),
            _ => {}
        }
        let name = self.names.write(condition);
        let first = self.first(condition);
        if together && let Some((at, entry)) = first {
            let text = format!("`{name}` was so first at {}, but not with the rest", seconds(at));
            return vec![Near { entry, text }];
        }
        if let Some((at, entry)) = first {
            let text = format!("it was so at {}, before its turn", seconds(at));
            return if self.early { vec![Near { entry, text }] } else { Vec::new() };
        }
        let near = match *condition {
            Condition::AxisAt { axis, position } => self.axis(axis, position, position),
            Condition::AxisBelow { axis, position } => {
                self.axis(axis, i64::MIN, position.saturating_sub(1))
            }
            Condition::AxisAbove { axis, position } => {
                self.axis(axis, position.saturating_add(1), i64::MAX)
            }
            Condition::PortBit { port, .. } => self.port(port),
            Condition::SignalIs { signal, .. } | Condition::SignalChanges { signal, .. } => {
                let last = self.entries().rev().find_map(|entry| match entry.event()? {
                    Event::Signal { signal: of, value } if *of == signal => Some((entry, *value)),
                    _ => None,
                });
                match last {
                    Some((entry, value)) => {
                        let words = signal_words(signal, value, self.names);
                        let text = format!("{words} since {}", seconds(entry.at));
                        Some(Near { entry: Some(entry.number), text })
                    }
                    None => self.start().signal(signal).map(|value| {
                        let words = signal_words(signal, value, self.names);
                        Near { entry: None, text: format!("{words} all the time") }
                    }),
                }
            }
            Condition::Answer { .. } | Condition::Error { .. } | Condition::Answered { .. } => {
                self.last_said()
            }
            Condition::Command { like: Some(ref like) } => self.command(like, None, None),
            Condition::Line { .. } => {
                self.entries().rev().find_map(|entry| match entry.event()? {
                    Event::Line { line, .. } => {
                        let text = format!("line {line} was the last, at {}", seconds(entry.at));
                        Some(Near { entry: Some(entry.number), text })
                    }
                    _ => None,
                })
            }
            _ => None,
        };
        near.into_iter().collect()
    }

    /// When a condition first held.
    fn first(&self, condition: &Condition) -> Option<(Time, Option<u64>)> {
        let mut picture = self.start();
        let mut from = picture.at();
        if picture.holds(condition, from, None) {
            return Some((from, None));
        }
        let mut before = None;
        for entry in self.entries() {
            let crossing = condition.begins(&picture.from(from), from);
            if let Some(at) = crossing.filter(|at| *at <= entry.at) {
                return Some((at, before));
            }
            picture.apply(entry);
            (from, before) = (entry.at, Some(entry.number));
            if picture.holds(condition, from, entry.event()) {
                return Some((from, before));
            }
        }
        let at = condition.begins(&picture.from(from), from).filter(|at| *at <= self.until)?;
        Some((at, before))
    }

    /// The picture when the time that counts began.
    fn start(&self) -> Picture {
        let mut picture = self.journal.start().clone();
        let earlier = self.journal.entries().take_while(|entry| entry.number <= self.before);
        earlier.for_each(|entry| picture.apply(entry));
        picture
    }

    /// How close an axis came to a range.
    fn axis(&self, axis: u8, low: i64, high: i64) -> Option<Near> {
        let place = usize::from(axis);
        let mut picture = self.start();
        let mut best: Option<(u64, i64, Option<u64>)> = None;
        let mut consider = |least: i64, most: i64, entry: Option<u64>| {
            let (distance, at) =
                if most < low { (low.abs_diff(most), most) } else { (least.abs_diff(high), least) };
            if best.is_none_or(|(closest, ..)| distance < closest) {
                best = Some((distance, at, entry));
            }
        };
        if let Some(here) = picture.position(axis) {
            consider(here, here, None);
        }
        let mut last = None;
        let mut box_of = |picture: &Picture, at: Time, entry: Option<u64>| {
            if let Some(course) = picture.running() {
                let steps = course.segment.profile.steps_at(at.nanos_since(course.began));
                let made = Move::new(None, course, Some((at, steps)));
                if let (Some(least), Some(most)) = (made.low.get(place), made.high.get(place)) {
                    consider(*least, *most, entry);
                }
            }
        };
        for entry in self.entries() {
            box_of(&picture, entry.at, last);
            picture.apply(entry);
            last = Some(entry.number);
        }
        box_of(&picture, self.until, last);
        let (distance, at, entry) = best?;
        let name = self.names.axis_name(axis).to_uppercase();
        let steps = if distance == 1 { "step" } else { "steps" };
        let way = Grouped(i64::try_from(distance).unwrap_or(i64::MAX));
        let measure = self.measure(axis, at);
        let text = format!("{name} came to {}{measure}, {way} {steps} short of it", Grouped(at));
        Some(Near { entry, text })
    }

    /// ` (-4.8 mm)`, where that is known.
    fn measure(&self, axis: u8, steps: i64) -> String {
        let Some(scale) = self.names.scale(axis) else { return String::new() };
        let units = steps as f64 * f64::from(scale.units) / f64::from(scale.steps.max(1));
        let (value, unit) = match scale.unit {
            LengthUnit::Micrometre => (units / 1_000.0, "mm"),
            LengthUnit::Degree => (units, "°"),
        };
        let text = format!("{value:.4}");
        format!(" ({} {unit})", text.trim_end_matches('0').trim_end_matches('.'))
    }

    fn port(&self, port: u16) -> Option<Near> {
        let last = self.entries().rev().find_map(|entry| match entry.event()? {
            Event::Port { port: of, value } if *of == port => Some((entry, *value)),
            _ => None,
        });
        Some(match last {
            Some((entry, value)) => {
                let text = format!("port {port} is {value} since {}", seconds(entry.at));
                Near { entry: Some(entry.number), text }
            }
            None => {
                let value = self.start().port(port)?;
                Near { entry: None, text: format!("port {port} is {value} all the time") }
            }
        })
    }

    /// What was answered last.
    fn last_said(&self) -> Option<Near> {
        self.entries().rev().find_map(|entry| match &entry.what {
            What::Event(Event::Answer { bytes, why, .. }) => {
                let because = why.as_ref().map_or_else(String::new, |why| format!(": {why}"));
                let said = escape(bytes.trim_ascii_end());
                let text = format!("the last answer was {said} at {}{because}", seconds(entry.at));
                Some(Near { entry: Some(entry.number), text })
            }
            _ => None,
        })
    }
}

/// Whether a command that begins so may have this mnemonic: `@0A900` has `@A`.
fn is_form_of(like: &str, mnemonic: &str) -> bool {
    let mut rest = like.to_owned();
    if let Some(line) = rest.strip_prefix('@') {
        rest = format!("@{}", line.trim_start_matches(|c: char| c.is_ascii_digit()));
    }
    let letters = mnemonic.split_once('/').map_or(mnemonic, |(letters, _)| letters);
    !letters.is_empty() && rest.starts_with(letters)
}
