//! What is said when an expectation is not met.

use std::fmt;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use thiserror::Error;
use vimc4_device::{Names, Time};

use super::check::Mistake;
use super::closest::{Near, closest};
use super::failed::{Failed, Reason, Why};
use super::{Clause, Expectation, Pattern, Then, times};
use crate::Journal;
use crate::words::{seconds, short};

/// An expectation that was not met: what was expected, what is wrong, what came closest, and what happened
/// around it.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// The expectation in words.
    pub expected: String,
    /// Which sort of failure it is, for programs.
    pub reason: Reason,
    /// What is wrong, in words.
    pub but: String,
    /// When that was clear.
    pub at: Time,
    /// The number of the entry that shows it, if one does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub entry: Option<u64>,
    /// What came closest, and how it differs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub closest: Vec<String>,
    /// What happened around it, in the words of the log.
    pub around: Vec<String>,
}

/// Why an expectation is not met: what happened, or a mistake in it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Unmet {
    /// It could never be met.
    #[error(transparent)]
    Mistake(#[from] Mistake),
    /// It was not met.
    #[error(transparent)]
    Failure(#[from] Box<Failure>),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected {}\n  but {}", self.expected, self.but)?;
        for near in &self.closest {
            write!(f, "\n  closest: {near}")?;
        }
        if !self.around.is_empty() {
            f.write_str("\n  what happened around it:")?;
        }
        self.around.iter().try_for_each(|line| write!(f, "\n  {line}"))
    }
}

/// Written for people, because failing tests print it so.
impl fmt::Debug for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\n{self}\n")
    }
}

impl std::error::Error for Failure {}

/// How many lines are shown before and after the place in question.
const BEFORE: u64 = 8;
const AFTER: u64 = 5;

impl Failure {
    pub(super) fn of(
        expected: &Expectation,
        failed: &Failed,
        before: u64,
        journal: &Journal,
        names: &Names,
    ) -> Failure {
        let Failed { at, entry, why } = failed;
        let but = but(expected, *why, *at, names);
        let near = searched(expected, *why)
            .map(|(pattern, early)| closest(pattern, early, journal, before, *at, names))
            .unwrap_or_default();
        // Where no entry shows it, the place in question is what came closest, or the last entry.
        let there = entry.or_else(|| near.iter().find_map(|near| near.entry));
        let upto = |at: &Time| {
            let mut past = journal.entries().rev();
            past.find(|entry| entry.at <= *at).map(|entry| entry.number)
        };
        let around = there.or_else(|| upto(at)).map(|number| {
            let lines = journal.around(number, BEFORE, AFTER, names);
            lines.into_iter().map(|(own, line)| {
                let mark = if there == Some(own) { '>' } else { ' ' };
                format!("{mark} {line}")
            })
        });
        Failure {
            expected: expected.in_words(names),
            reason: failed.reason(),
            but,
            at: *at,
            entry: *entry,
            closest: near.into_iter().map(|Near { text, .. }| text).collect(),
            around: around.into_iter().flatten().collect(),
        }
    }
}

fn clause(expected: &Expectation, stage: usize, clause: usize) -> Option<(&Clause, bool)> {
    let Expectation::Order(stages) = expected else { return None };
    let alone = stages.len() == 1 && stages.iter().all(|stage| stage.clauses.len() == 1);
    Some((stages.get(stage)?.clauses.get(clause)?, alone))
}

/// Which pattern to look for as the closest, and whether it may have come before its turn.
fn searched(expected: &Expectation, why: Why) -> Option<(&Pattern, bool)> {
    match (expected, why) {
        (_, Why::Missing { stage, clause: of, .. } | Why::TooLate { stage, clause: of, .. }) => {
            clause(expected, stage, of).map(|(clause, _)| (&clause.what, stage > 0))
        }
        (Expectation::Rule(rule), Why::NeverCame) => Some((&rule.whenever, false)),
        (Expectation::Rule(rule), Why::NotFollowed { .. }) => match &rule.then {
            Then::Follows { what, .. } => Some((what, false)),
            Then::Held { .. } => None,
        },
        _ => None,
    }
}

/// What is wrong, in words.
fn but(expected: &Expectation, why: Why, at: Time, names: &Names) -> String {
    let name = |stage: usize, of: usize| match clause(expected, stage, of) {
        Some((clause, false)) => format!("`{}`", clause.what.in_words(names)),
        _ => "it".to_owned(),
    };
    let number = |stage: usize, of: usize| {
        clause(expected, stage, of).map_or_else(String::new, |(clause, _)| clause.number())
    };
    let came_times = |came: u64| match came {
        0 => "never came".to_owned(),
        came => format!("came {}", times(came)),
    };
    match why {
        Why::Missing { stage, clause, came } => {
            let mut text = format!("{} {}", name(stage, clause), came_times(came));
            if name(stage, clause) != "it" {
                text.push_str(&format!(", and should have come {}", number(stage, clause)));
            }
            text
        }
        Why::TooOften { stage, clause, came } => {
            let what = name(stage, clause);
            match came {
                1 => format!("{what} came at {}", seconds(at)),
                came => format!("{what} came a {} time at {}", ordinal(came), seconds(at)),
            }
        }
        Why::TooEarly { stage, clause, waited } => format!(
            "{} came at {}, after {}",
            name(stage, clause),
            seconds(at),
            if waited == Duration::ZERO { "no time".to_owned() } else { short(waited) }
        ),
        Why::TooLate { stage, clause, came } => {
            let by = seconds(Time::from_nanos(at.as_nanos().saturating_sub(1)));
            let so_far = match came {
                0 => format!("had not come by {by}"),
                came => format!("had come only {} by {by}", times(came)),
            };
            let number = number(stage, clause);
            format!("{} {so_far}, and should have come {number}", name(stage, clause))
        }
        Why::NotHeld { since: None } => format!("it was not so at {}", seconds(at)),
        Why::NotHeld { since: Some(since) } if since == at => {
            format!("it was so only from that very moment on, {}", seconds(at))
        }
        Why::NotHeld { since: Some(since) } => {
            format!("at {} it had been so for {} only", seconds(at), short(at - since))
        }
        Why::NotFollowed { began, over: false } => {
            format!("what happened at {} was not followed by it in time", seconds(began))
        }
        Why::NotFollowed { began, over: true } => format!(
            "what happened at {} was not followed by it before the end, {} later",
            seconds(began),
            short(at - began)
        ),
        Why::NeverCame => {
            "it never came to that, so nothing is known; say `if_at_all()` if that is right, too"
                .to_owned()
        }
        Why::Forgotten { dropped } => format!(
            "nobody knows: the first {dropped} entries are not in the journal any more; watch from the \
             beginning instead, or forget what is over in between"
        ),
    }
}

/// `second`, `3rd`.
fn ordinal(count: u64) -> String {
    match (count, count % 10, count % 100) {
        (2, ..) => "second".to_owned(),
        (_, 1, 11) | (_, 2, 12) | (_, 3, 13) => format!("{count}th"),
        (_, 1, _) => format!("{count}st"),
        (_, 2, _) => format!("{count}nd"),
        (_, 3, _) => format!("{count}rd"),
        _ => format!("{count}th"),
    }
}
