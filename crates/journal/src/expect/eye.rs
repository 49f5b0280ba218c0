//! Sees when something that is expected comes.

use std::collections::VecDeque;
use std::time::Duration;

use vimc4_device::{CommandNumber, Condition, Event, Kinds, Time};

use super::{Pattern, Reply};
use crate::{Entry, Picture};

/// A moment: right after an entry, or at an instant between two.
pub(super) struct Moment<'a> {
    pub(super) picture: &'a Picture,
    pub(super) now: Time,
    pub(super) entry: Option<&'a Entry>,
}

impl Moment<'_> {
    /// Whether a condition holds.
    fn holds(&self, condition: &Condition) -> bool {
        let event = self.entry.and_then(Entry::event);
        self.picture.holds(condition, self.now, event)
    }

    /// Whether it holds without what happens.
    fn lasts(&self, condition: &Condition) -> bool {
        self.picture.holds(condition, self.now, None)
    }
}

/// Sees when something comes.
#[derive(Clone, Debug)]
pub(super) enum Eye {
    /// A condition becomes true, each of its parts by itself.
    When(Vec<Part>),
    /// A command begins, or is answered.
    Command {
        command: Condition,
        reply: Option<Reply>,
        within: Option<Duration>,
        /// Commands that have not been answered as expected.
        open: VecDeque<(CommandNumber, Time)>,
    },
}

/// A condition, and since when it has held.
#[derive(Clone, Debug)]
pub(super) struct Part {
    condition: Condition,
    since: Option<Time>,
}

/// The most commands that are followed at a time; more are hardly ever open.
const OPEN: usize = 256;

impl Eye {
    pub(super) fn of(pattern: &Pattern) -> Eye {
        match pattern {
            Pattern::When(Condition::Any(parts)) => {
                Eye::When(parts.iter().map(Part::new).collect())
            }
            Pattern::When(one) => Eye::of_state(one),
            Pattern::Command { like, reply, within } => Eye::Command {
                command: Condition::Command { like: Some(like.clone()) },
                reply: reply.clone(),
                within: *within,
                open: VecDeque::new(),
            },
        }
    }

    /// One that sees a condition as a whole.
    pub(super) fn of_state(condition: &Condition) -> Eye {
        Eye::When(vec![Part::new(condition)])
    }

    /// Since when the first of its parts that hold has held.
    pub(super) fn since(&self) -> Option<Time> {
        match self {
            Eye::When(parts) => parts.iter().filter_map(|part| part.since).min(),
            Eye::Command { .. } => None,
        }
    }

    /// Whether it comes at a moment.
    pub(super) fn look(&mut self, moment: &Moment<'_>) -> bool {
        match self {
            Eye::When(parts) => {
                let mut comes = false;
                for Part { condition, since } in parts {
                    let is_so = moment.holds(condition);
                    comes |= is_so && since.is_none();
                    // What only happens is over with its moment.
                    let lasts = is_so && moment.lasts(condition);
                    *since = lasts.then_some(since.unwrap_or(moment.now));
                }
                comes
            }
            Eye::Command { command, reply, within, open } => {
                let Some(entry) = moment.entry else { return false };
                let (Some(event), at) = (entry.event(), entry.at) else { return false };
                match event {
                    Event::Command { .. } if command.is_seen_in(event) => {
                        if reply.is_some()
                            && let Some(number) = entry.command
                        {
                            if open.len() == OPEN {
                                open.pop_front();
                            }
                            open.push_back((number, at));
                        }
                        reply.is_none()
                    }
                    Event::Answer { .. } => {
                        let Some(reply) = reply else { return false };
                        let own =
                            |(number, _): &(CommandNumber, Time)| Some(*number) == entry.command;
                        let Some(place) = open.iter().position(own) else { return false };
                        let in_time = |(_, began): &(CommandNumber, Time)| {
                            within.is_none_or(|within| at - *began <= within)
                        };
                        let comes = reply.is(event) && open.get(place).is_some_and(in_time);
                        if comes {
                            open.remove(place);
                        }
                        comes
                    }
                    _ => false,
                }
            }
        }
    }

    /// The kinds of events that can make a difference to it.
    pub(super) fn kinds(&self) -> Kinds {
        match self {
            Eye::When(parts) => parts
                .iter()
                .fold(Kinds::NONE, |kinds, part| Kinds::and(kinds, changes(&part.condition))),
            Eye::Command { reply: None, .. } => Kinds::COMMAND,
            Eye::Command { .. } => Kinds::and(Kinds::COMMAND, Kinds::ANSWER),
        }
    }

    /// Whether it may have to be checked between two events.
    pub(super) fn is_timed(&self) -> bool {
        match self {
            Eye::When(parts) => !parts.iter().all(|part| only_happens(&part.condition)),
            Eye::Command { .. } => false,
        }
    }

    /// When it has to be checked next because of a motion.
    pub(super) fn next(&self, picture: &Picture, now: Time) -> Option<Time> {
        let Eye::When(parts) = self else { return None };
        let span = picture.from(now);
        let next = |Part { condition, since }: &Part| {
            if picture.running().is_none() && !names_a_time(condition) {
                return None;
            }
            let next = match since {
                Some(_) => condition.ends(&span, now),
                None => condition.begins(&span, now),
            };
            next.filter(|at| *at > now)
        };
        parts.iter().filter_map(next).min()
    }
}

impl Part {
    fn new(condition: &Condition) -> Part {
        Part { condition: condition.clone(), since: None }
    }
}

/// Whether something comes only with an event.
fn only_happens(condition: &Condition) -> bool {
    matches!(
        condition,
        Condition::Command { .. }
            | Condition::Answered { .. }
            | Condition::Answer { .. }
            | Condition::Error { .. }
            | Condition::Line { .. }
            | Condition::SignalChanges { .. }
    )
}

fn names_a_time(condition: &Condition) -> bool {
    match condition {
        Condition::At(_) => true,
        Condition::All(parts) | Condition::Any(parts) => parts.iter().any(names_a_time),
        _ => false,
    }
}

/// The kinds of events by which a condition comes or ends; of states, those that the picture follows.
fn changes(condition: &Condition) -> Kinds {
    match condition {
        Condition::All(parts) | Condition::Any(parts) => {
            parts.iter().fold(Kinds::NONE, |kinds, part| Kinds::and(kinds, changes(part)))
        }
        Condition::AxisAt { .. }
        | Condition::AxisBelow { .. }
        | Condition::AxisAbove { .. }
        | Condition::Outside { .. } => Kinds::MOTION,
        Condition::PortBit { .. } => Kinds::and(Kinds::PORT, Kinds::SIGNAL),
        Condition::SignalIs { .. } => Kinds::SIGNAL,
        Condition::Limit { .. } => Kinds::SWITCH,
        // It is not followed: such expectations are refused.
        Condition::Idle => Kinds::NONE,
        // It comes by itself.
        Condition::At(_) => Kinds::NONE,
        happening => happening.kinds(),
    }
}
