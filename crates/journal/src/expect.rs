//! Expectations of a controller.
//!
//! A sentence says what has to happen, in which order, how often, never or always:
//!
//! ```
//! # use vimc4_catalogue::{bare, machine, model};
//! # use vimc4_device::{Device, Harness, Kinds, Output};
//! # use vimc4_journal::{Journal, Picture};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let (model, mill) = (model("imc4")?, machine("mill")?);
//! # let mut imc4 = Harness::new(bare(&model, &mill, b"")?).watching(Kinds::ALL);
//! # let names = model.names(imc4.device().signals()).with_scales(mill.scales());
//! # let mut journal = Journal::new(Picture::of(imc4.device()), 1_000);
//! # imc4.ask(b"@07\r@0A400,900,0,900,0,900,0,900\r@0P\r")?;
//! # while let Some(output) = imc4.take_output() {
//! #     if let Output::Event(stamp, event) = output { journal.keep(stamp, event, ""); }
//! # }
//! journal.expect(&names).command("@A").answered("0").once().then().command("@P").once().so_far()?;
//! journal.expect(&names).never("x > 5mm or z < -5mm").so_far()?;
//!
//! let unmet = journal.expect(&names).command("@A").at_least(2).so_far().unwrap_err();
//! assert!(unmet.to_string().starts_with(
//!     "expected command @A, at least twice\n  but it came once"
//! ), "{unmet}");
//! # Ok(())
//! # }
//! ```
//!
//! Without a count, a command or a condition is not a sentence yet, and cannot be checked:
//!
//! ```compile_fail
//! # fn of(journal: &vimc4_journal::Journal, names: &vimc4_device::Names) {
//! journal.expect(names).command("@A").so_far();
//! # }
//! ```

mod check;
mod closest;
mod eye;
mod failed;
mod failure;
mod sentence;
mod text;
mod watch;

use std::fmt::Write;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use vimc4_device::{Condition, Event, Names};

use crate::words::{quoted, short};

pub use check::Mistake;
pub use failed::Reason;
pub use failure::{Failure, Unmet};
pub use sentence::{
    Clauses, CommandClause, ConditionLike, Expect, Follower, Following, Looker, Must, Sentence,
    Whenever,
};
pub use watch::{Trial, Watch};

/// An expectation: plain data, which can be serialised.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Expectation {
    /// These things happen, stage after stage.
    ///
    /// An event counts for one stage only: the latest that expects it and that can be reached. A
    /// stage can be reached when everything required by those before it has come. Unexpected events
    /// are ignored.
    Order(Vec<Stage>),
    /// Whenever one thing happens, another holds.
    Rule(Box<Rule>),
}

/// Things that happen in any order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// The least time after the stage before is complete, or after the beginning.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<Duration>,
    /// The most time after the stage before within which it is complete.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within: Option<Duration>,
    /// The things.
    pub clauses: Vec<Clause>,
}

/// Something that happens a number of times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clause {
    /// What.
    pub what: Pattern,
    /// How often at least.
    pub least: u64,
    /// How often at most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub most: Option<u64>,
}

/// Something that happens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// A condition becomes true. One that is true at the beginning becomes so then.
    When(Condition),
    /// A command begins; with a reply, it is answered so.
    Command {
        /// Its mnemonic, or what its line begins with.
        like: String,
        /// How it is answered.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        reply: Option<Reply>,
        /// The most time after its beginning.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        within: Option<Duration>,
    },
}

/// How a command is answered.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reply {
    /// By anything.
    Any,
    /// By this text, without the end of its line.
    Text(String),
    /// By an error: this one, or any.
    Error(Option<String>),
}

/// What holds whenever something happens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// Whenever this happens.
    pub whenever: Pattern,
    /// This is so.
    pub then: Then,
    /// Whether it is met too if that never happens.
    #[serde(default)]
    pub if_at_all: bool,
}

/// What holds then.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Then {
    /// A state has lasted at least so long.
    Held {
        /// The state.
        state: Condition,
        /// How long; 0 if holding at that moment is enough.
        span: Duration,
    },
    /// Something else happens at the same time or after it.
    Follows {
        /// What.
        what: Pattern,
        /// The most time until then.
        within: Duration,
    },
}

impl Expectation {
    /// In words, for people.
    #[must_use]
    pub fn in_words(&self, names: &Names) -> String {
        match self {
            Expectation::Order(stages) => {
                let stages: Vec<String> =
                    stages.iter().map(|stage| stage.in_words(names)).collect();
                stages.join("; then ")
            }
            Expectation::Rule(rule) => {
                let Rule { whenever, then, if_at_all } = &**rule;
                let mut whenever = whenever.in_words(names);
                if *if_at_all {
                    whenever.push_str(", if at all");
                }
                match then {
                    Then::Held { state, span } if span.is_zero() => {
                        format!("whenever {whenever}: {}", names.write(state))
                    }
                    Then::Held { state, span } => {
                        let (state, span) = (names.write(state), short(*span));
                        format!("whenever {whenever}: {state} for at least {span}")
                    }
                    Then::Follows { what, within } => {
                        let (what, within) = (what.in_words(names), short(*within));
                        format!("whenever {whenever}: {what} within {within}")
                    }
                }
            }
        }
    }
}

impl Stage {
    fn in_words(&self, names: &Names) -> String {
        let clauses: Vec<String> =
            self.clauses.iter().map(|clause| clause.in_words(names)).collect();
        let mut text = clauses.join(", and ");
        // Writing to a string cannot fail.
        if let Some(after) = self.after {
            let _ = write!(text, ", no sooner than after {}", short(after));
        }
        if let Some(within) = self.within {
            let _ = write!(text, ", within {}", short(within));
        }
        text
    }
}

impl Clause {
    pub(crate) fn in_words(&self, names: &Names) -> String {
        format!("{}, {}", self.what.in_words(names), self.number())
    }

    /// How often, in words.
    pub(crate) fn number(&self) -> String {
        match (self.least, self.most) {
            (0, Some(0)) => "never".to_owned(),
            (least, Some(most)) if least == most => times(least),
            (0, Some(most)) => format!("at most {}", times(most)),
            (least, Some(most)) => format!("{least} to {}", times(most)),
            (least, None) => format!("at least {}", times(least)),
        }
    }

    /// Whether this count is enough.
    pub(crate) fn is_complete(&self, count: u64) -> bool {
        count >= self.least
    }
}

impl Pattern {
    pub(crate) fn in_words(&self, names: &Names) -> String {
        match self {
            Pattern::When(condition) => names.write(condition).to_string(),
            Pattern::Command { like, reply, within } => {
                let mut text = format!("command {}", quoted(like));
                let reply = match reply {
                    None => String::new(),
                    Some(Reply::Any) => " answered".to_owned(),
                    Some(Reply::Text(answer)) => format!(" answered {}", quoted(answer)),
                    Some(Reply::Error(None)) => " answered with an error".to_owned(),
                    Some(Reply::Error(Some(code))) => {
                        format!(" answered with error {}", quoted(code))
                    }
                };
                text.push_str(&reply);
                if let Some(within) = within {
                    let _ = write!(text, " within {}", short(*within));
                }
                text
            }
        }
    }
}

impl Reply {
    /// Whether an answer matches.
    pub(crate) fn is(&self, answer: &Event) -> bool {
        match self {
            Reply::Any => true,
            Reply::Text(text) => Condition::Answer { text: text.clone() }.is_seen_in(answer),
            Reply::Error(code) => Condition::Error { code: code.clone() }.is_seen_in(answer),
        }
    }
}

/// `once`, `twice`, `3 times`.
pub(crate) fn times(count: u64) -> String {
    match count {
        0 => "never".to_owned(),
        1 => "once".to_owned(),
        2 => "twice".to_owned(),
        count => format!("{count} times"),
    }
}
