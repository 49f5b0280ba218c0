//! Scenarios: what happens around a device, and when, as plain data.
//!
//! A scenario is a list of rules; a rule is what it waits for, and deeds. It begins and ends as an
//! [input](crate::Input::Rule) with a time like any other, so recordings carry scenarios, histories
//! replay them, and a state has them in it. [`Line`](crate::Line) looks after them: it sees every cause
//! and every byte. Instants are computed on the running motion, never polled.
//!
//! What a deed changes is *held*: it is set back when its time is over, and at the latest when its
//! scenario ends. What somebody else has changed meanwhile stays as it is.

mod check;
mod text;

use std::fmt;
use std::time::Duration;

use serde::{Deserialize, Serialize};

pub use check::ScenarioError;

use crate::{Condition, Deed, FaultNumber};

/// The most rules that a device has at once, those of all its scenarios together. Those that are over
/// give way to others, the oldest first; a scenario for whose rules there is no room does not begin.
pub const MOST_RULES: usize = 1_000;

/// What happens around a device, and when.
///
/// ```
/// use std::time::Duration;
/// use vimc4_device::{Act, Condition, Deed, Rule, Scenario};
///
/// let blink = Deed::Power(false);
/// let scenario = Scenario::new()
///     .rule(Rule::at(Duration::from_secs(2)).act(Act::new(blink).lasting(Duration::from_millis(100))))
///     .rule(Rule::when(Condition::Idle).times(1).act(Deed::Press("start".to_owned())));
/// assert_eq!(scenario.rules[0].to_string(), "at 2s: power off for 100ms");
/// assert_eq!(scenario.rules[1].to_string(), "rule once when idle: press start");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Scenario {
    /// Its rules. At one instant they act in this order.
    pub rules: Vec<Rule>,
}

impl Scenario {
    /// One without rules.
    #[must_use]
    pub fn new() -> Scenario {
        Scenario::default()
    }

    /// The same with one more rule.
    #[must_use]
    pub fn rule(mut self, rule: Rule) -> Scenario {
        self.rules.push(rule);
        self
    }
}

impl From<Rule> for Scenario {
    fn from(rule: Rule) -> Scenario {
        Scenario { rules: vec![rule] }
    }
}

/// Deeds, and what they wait for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct Rule {
    /// What other rules call it: letters, digits, `-` and `_`, and no word of the language.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// What it waits for.
    pub trigger: Trigger,
    /// It acts no more often than this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<u64>,
    /// What is done then, one after the other at the same instant.
    pub acts: Vec<Act>,
}

impl Rule {
    /// A rule that does nothing yet.
    #[must_use]
    pub fn new(trigger: Trigger) -> Rule {
        Rule { name: None, trigger, times: None, acts: Vec::new() }
    }

    /// Once, so long after its scenario has begun.
    #[must_use]
    pub fn at(time: Duration) -> Rule {
        Rule::new(Trigger::At(time))
    }

    /// Again and again, so far apart; the first time after that time.
    #[must_use]
    pub fn every(span: Duration) -> Rule {
        Rule::new(Trigger::Every { first: span, span })
    }

    /// Whenever this happens or becomes so; at once, if it is so already.
    #[must_use]
    pub fn when(condition: Condition) -> Rule {
        Rule::new(Trigger::When(vec![Cue { awaits: Awaits::Condition(condition), times: 1 }]))
    }

    /// As long as this is so, and whenever it is.
    #[must_use]
    pub fn during(condition: Condition) -> Rule {
        Rule::new(Trigger::While(condition))
    }

    /// The same under a name.
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Rule {
        Rule { name: Some(name.into()), ..self }
    }

    /// The same, no more often than this.
    #[must_use]
    pub fn times(self, times: u64) -> Rule {
        Rule { times: Some(times), ..self }
    }

    /// The same with one more thing that it does.
    #[must_use]
    pub fn act(mut self, act: impl Into<Act>) -> Rule {
        self.acts.push(act.into());
        self
    }
}

/// What a rule waits for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trigger {
    /// So long after its scenario has begun, once.
    At(Duration),
    /// First so long after its scenario has begun, and then again and again.
    Every {
        /// When first.
        first: Duration,
        /// How far apart, [`Rule::SHORTEST`] at least.
        span: Duration,
    },
    /// These come, one after the other; and then anew.
    When(Vec<Cue>),
    /// This is so. What the rule does is undone when it is not so any more.
    While(Condition),
}

impl Rule {
    /// No rule acts again and again in shorter intervals by itself, so that time goes on.
    pub const SHORTEST: Duration = Duration::from_millis(1);
}

/// Something that has to come.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cue {
    /// What.
    pub awaits: Awaits,
    /// How often, from 1.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub times: u32,
}

fn one() -> u32 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_one(times: &u32) -> bool {
    *times == 1
}

/// What has to come.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Awaits {
    /// This happens, or is so; where it is waited for several times, becomes so.
    Condition(Condition),
    /// A rule of this name acts.
    Rule(String),
    /// So much time passes.
    Time(Duration),
}

/// Something that a rule does.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct Act {
    /// What.
    pub deed: Deed,
    /// How long, if not until the scenario ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lasts: Option<Lasts>,
}

impl Act {
    /// It stays so until the scenario ends, or as long as a [`Trigger::While`] is so.
    #[must_use]
    pub fn new(deed: Deed) -> Act {
        Act { deed, lasts: None }
    }

    /// The same for so long.
    #[must_use]
    pub fn lasting(self, span: Duration) -> Act {
        Act { lasts: Some(Lasts::For(span)), ..self }
    }

    /// The same until this happens or is so.
    #[must_use]
    pub fn until(self, condition: Condition) -> Act {
        Act { lasts: Some(Lasts::Until(condition)), ..self }
    }
}

impl From<Deed> for Act {
    fn from(deed: Deed) -> Act {
        Act::new(deed)
    }
}

/// How long something that a rule does is so.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lasts {
    /// So long.
    For(Duration),
    /// Until this happens or is so.
    Until(Condition),
}

/// The number of a scenario, by which it is ended.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct ScenarioNumber(pub u32);

impl ScenarioNumber {
    /// Stands for the number that is next: one more than the highest that a scenario ever had.
    pub const NEXT: ScenarioNumber = ScenarioNumber(0);

    pub(crate) fn is_next(&self) -> bool {
        *self == ScenarioNumber::NEXT
    }
}

impl fmt::Display for ScenarioNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// What is done about scenarios.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ruling {
    /// A scenario begins, with this number, unless there would be more rules than [there can
    /// be](MOST_RULES). One that has the number already ends.
    Begin(ScenarioNumber, Scenario),
    /// The scenario of this number ends, if there is one: what its rules hold is set back.
    End(ScenarioNumber),
    /// All end.
    EndAll,
}

/// Which rule of a device.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct RuleId {
    /// Its scenario.
    pub scenario: ScenarioNumber,
    /// Which of the scenario's rules, from 1; 0 if it is the only one.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub place: u32,
    /// Its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_zero(place: &u32) -> bool {
    *place == 0
}

/// Its number, and its name in brackets: `3.1 (jam)`.
impl fmt::Display for RuleId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RuleId { scenario, place, name } = self;
        write!(f, "{scenario}")?;
        if *place > 0 {
            write!(f, ".{place}")?;
        }
        name.as_ref().map_or(Ok(()), |name| write!(f, " ({name})"))
    }
}

/// A rule that a device has.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RuleView {
    /// Which.
    pub id: RuleId,
    /// What it is.
    pub rule: Rule,
    /// How far it has come.
    pub stage: RuleStage,
    /// How often it has acted.
    pub acted: u64,
}

/// How far a rule has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RuleStage {
    /// It waits.
    Waits,
    /// It holds what it has changed.
    Holds,
    /// It has acted as often as it was to.
    Over,
}

impl fmt::Display for RuleStage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            RuleStage::Waits => "waits",
            RuleStage::Holds => "holds",
            RuleStage::Over => "is over",
        })
    }
}

/// What is told of a rule.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum RuleNews {
    /// It was begun.
    Begins,
    /// It acts: what it does, in the words of orders, and the numbers of the faults that begin with that.
    Acts(Vec<String>, Vec<FaultNumber>),
    /// Something that it cannot do here: what, and why.
    Cannot(String, String),
    /// What it has held is set back.
    SetsBack,
    /// It has acted so often at one instant that time would never go on; it is over.
    Runaway,
    /// Its scenario was ended.
    Ends,
}

/// In a few words, for people: what follows "rule 3".
impl fmt::Display for RuleNews {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RuleNews::Begins => f.write_str("begins"),
            RuleNews::Acts(deeds, _) => write!(f, "acts: {}", deeds.join("; ")),
            RuleNews::Cannot(deed, why) => write!(f, "cannot {deed}: {why}"),
            RuleNews::SetsBack => f.write_str("sets back what it has changed"),
            RuleNews::Runaway => f.write_str("is over: it would act at this instant for ever"),
            RuleNews::Ends => f.write_str("ends"),
        }
    }
}
