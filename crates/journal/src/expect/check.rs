//! Mistakes in expectations.

use std::fmt;

use serde::{Deserialize, Serialize};
use vimc4_device::{AXES, Condition, Names, parted};
use vimc4_language::{SyntaxError, known_command, known_error};

use super::{Clause, Expectation, Pattern, Reply, Rule, Then};
use crate::Picture;

/// A mistake in an expectation that could never be met, or never fail: why, and what would be
/// right.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Mistake {
    why: String,
    /// What would be right, where the reason ends with just that.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    right: String,
}

impl Mistake {
    pub(crate) fn new(why: String) -> Mistake {
        Mistake { why, right: String::new() }
    }

    /// What happens in one moment is no state; `follows` says how it is asked for that it comes after.
    pub(super) fn of_happening(what: &str, follows: &str) -> Mistake {
        Mistake::new(format!(
            "`{what}` happens in one moment and lasts no time; {follows}, or name a state"
        ))
    }

    /// The problem and the remedy, as two sentences. The remedy is empty if the text has none.
    #[must_use]
    pub fn problem_and_remedy(&self) -> (String, String) {
        let text = self.to_string();
        let problem = text.strip_suffix(&self.right).and_then(|before| before.strip_suffix(": "));
        let (problem, remedy) = match problem {
            Some(problem) if parted(&self.right).is_none() => (problem, self.right.as_str()),
            _ => parted(&text).unwrap_or((&text, "")),
        };
        (problem.to_owned(), remedy.to_owned())
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "this cannot be expected: {}", self.why)
    }
}

impl std::error::Error for Mistake {}

impl From<SyntaxError> for Mistake {
    fn from(error: SyntaxError) -> Mistake {
        Mistake { why: error.to_string(), right: error.message() }
    }
}

type Checked = Result<(), Mistake>;

fn wrong(why: String) -> Checked {
    Err(Mistake::new(why))
}

/// A count that anything would fit.
pub(super) fn number(clause: &Clause, names: &Names) -> Option<Mistake> {
    let what = clause.what.in_words(names);
    match (clause.least, clause.most) {
        (0, None) => Some(Mistake::new(format!(
            "`{what}` at least 0 times is always so; say at least once, at most so many times, or never"
        ))),
        (least, Some(most)) if least > most => Some(Mistake::new(format!(
            "`{what}` cannot come {least} times or more and {most} or less"
        ))),
        _ => None,
    }
}

/// Checks everything about an expectation, also one that was deserialised.
pub(super) fn expectation(expected: &Expectation, names: &Names, picture: &Picture) -> Checked {
    match expected {
        Expectation::Order(stages) => {
            let mut clauses = stages.iter().flat_map(|stage| &stage.clauses).peekable();
            if clauses.peek().is_none() {
                return wrong("it says nothing".to_owned());
            }
            for stage in stages {
                if let (Some(after), Some(within)) = (stage.after, stage.within)
                    && within < after
                {
                    return wrong(format!("nothing comes after {after:?} and within {within:?}"));
                }
            }
            if stages.iter().any(|stage| stage.clauses.is_empty()) {
                return wrong("a stage has nothing in it".to_owned());
            }
            for clause in clauses {
                if let Some(mistake) = number(clause, names) {
                    return Err(mistake);
                }
                pattern(&clause.what, names, picture)?;
            }
            Ok(())
        }
        Expectation::Rule(rule) => {
            let Rule { whenever, then, .. } = &**rule;
            pattern(whenever, names, picture)?;
            match then {
                Then::Held { state, .. } => seen(state, names, picture),
                Then::Follows { what, .. } => pattern(what, names, picture),
            }
        }
    }
}

fn pattern(pattern: &Pattern, names: &Names, picture: &Picture) -> Checked {
    match pattern {
        Pattern::When(condition) => seen(condition, names, picture),
        Pattern::Command { like, reply, .. } => {
            known_command(like, names)?;
            if let Some(Reply::Error(code)) = reply {
                known_error(code.as_deref(), names)?;
            }
            Ok(())
        }
    }
}

/// Checks a condition, and whether a journal shows what it is about.
fn seen(condition: &Condition, names: &Names, picture: &Picture) -> Checked {
    self::condition(condition, names)?;
    match condition {
        Condition::PortBit { port, bit, .. } if !picture.knows_bit(*port, *bit) => wrong(format!(
            "port {port} bit {bit} is neither an output nor a user input; name the signal behind it, as \
             in `signal NAME is 1`"
        )),
        Condition::All(parts) | Condition::Any(parts) => {
            parts.iter().try_for_each(|part| seen(part, names, picture))
        }
        _ => Ok(()),
    }
}

/// A condition that could never hold.
pub(super) fn condition(condition: &Condition, names: &Names) -> Checked {
    let has_axis = |axis: u8| match names.has_axis(axis) {
        true => Ok(()),
        false => wrong(format!(
            "there is no axis {axis} (0 for X); axes are {}",
            names.shown_axes().join(", ")
        )),
    };
    match condition {
        Condition::AxisAt { axis, .. }
        | Condition::AxisBelow { axis, .. }
        | Condition::AxisAbove { axis, .. }
        | Condition::Limit { axis, .. } => has_axis(*axis),
        Condition::Idle => wrong(
            "`idle` is not followed; expect the answer of the last command, or the end of a motion"
                .to_owned(),
        ),
        Condition::SignalIs { signal, value }
        | Condition::SignalChanges { signal, to: Some(value) } => {
            let Some(known) = names.signals().iter().find(|known| known.id == *signal) else {
                return wrong(format!("there is no signal {}", signal.0));
            };
            match known.values().contains(value) {
                true => Ok(()),
                false => wrong(format!(
                    "`{}` cannot be {value}; it can be {}",
                    known.name,
                    known.values_in_words()
                )),
            }
        }
        Condition::Command { like: Some(like) } => Ok(known_command(like, names).map(drop)?),
        Condition::Error { code } => Ok(known_error(code.as_deref(), names).map(drop)?),
        Condition::Any(parts) if parts.is_empty() => wrong("`never` is never so".to_owned()),
        Condition::Any(parts) => parts.iter().try_for_each(|part| self::condition(part, names)),
        Condition::All(parts) => {
            parts.iter().try_for_each(|part| self::condition(part, names))?;
            contradiction(parts, names)
        }
        _ => Ok(()),
    }
}

/// Parts that cannot hold in one moment.
fn contradiction(parts: &[Condition], names: &Names) -> Checked {
    let together = || parts.iter().map(|part| names.write(part).to_string());
    let both = |why: &str| {
        let together: Vec<String> = together().collect();
        wrong(format!("`{}` is never so: {why}", together.join(" and ")))
    };
    let (mut low, mut high) = ([i64::MIN; AXES], [i64::MAX; AXES]);
    for part in parts {
        let (axis, least, most) = match *part {
            Condition::AxisAt { axis, position } => (axis, position, position),
            Condition::AxisBelow { axis, position } => (axis, i64::MIN, position.saturating_sub(1)),
            Condition::AxisAbove { axis, position } => (axis, position.saturating_add(1), i64::MAX),
            _ => continue,
        };
        let axis = usize::from(axis);
        if let (Some(low), Some(high)) = (low.get_mut(axis), high.get_mut(axis)) {
            (*low, *high) = ((*low).max(least), (*high).min(most));
        }
    }
    if low.iter().zip(&high).any(|(low, high)| low > high) {
        return both("no place is both");
    }
    let mut kinds = parts.iter().filter_map(happening);
    if let Some(first) = kinds.next()
        && kinds.any(|other| other != first)
    {
        return both(
            "these happen one after the other, each in a moment of its own; say `answered` of a \
             command, or `then`",
        );
    }
    Ok(())
}

/// Which sort of entry shows an event condition.
fn happening(condition: &Condition) -> Option<u8> {
    match condition {
        Condition::Command { .. } => Some(0),
        Condition::Answered { .. } | Condition::Answer { .. } | Condition::Error { .. } => Some(1),
        Condition::Line { .. } => Some(2),
        Condition::SignalChanges { .. } => Some(3),
        _ => None,
    }
}
