//! A scenario of an emulator, which ends with its handle.

use vimc4_device::{Rule, RuleView, Scenario, ScenarioNumber};

use crate::control::Control;
use crate::error::Error;

/// A scenario, or the words for one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AnyScenario {
    /// A scenario.
    Scenario(Scenario),
    /// Rules as people type them, one a line: `when x > 1000: press stop`.
    Words(String),
}

impl From<Scenario> for AnyScenario {
    fn from(scenario: Scenario) -> AnyScenario {
        AnyScenario::Scenario(scenario)
    }
}

impl From<Rule> for AnyScenario {
    fn from(rule: Rule) -> AnyScenario {
        AnyScenario::Scenario(rule.into())
    }
}

impl From<&str> for AnyScenario {
    fn from(words: &str) -> AnyScenario {
        AnyScenario::Words(words.to_owned())
    }
}

impl From<String> for AnyScenario {
    fn from(words: String) -> AnyScenario {
        AnyScenario::Words(words)
    }
}

/// A scenario that was begun by [`Emulator::scenario`](crate::Emulator::scenario). It ends when this is
/// dropped, and what its rules have changed is set back.
#[derive(Debug)]
#[must_use = "the scenario ends as soon as this is dropped; `let scenario = …` keeps it"]
pub struct ScenarioHandle {
    control: Control,
    number: ScenarioNumber,
    stays: bool,
}

impl ScenarioHandle {
    pub(crate) fn new(control: Control, number: ScenarioNumber) -> ScenarioHandle {
        ScenarioHandle { control, number, stays: false }
    }

    /// Its number, by which everybody else can end it.
    #[must_use]
    pub fn number(&self) -> ScenarioNumber {
        self.number
    }

    /// Its rules, how far each has come and how often it has acted; none if somebody else has ended it.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn rules(&self) -> Result<Vec<RuleView>, Error> {
        let mut rules = self.control.rules().wait()?;
        rules.retain(|view| view.id.scenario == self.number);
        Ok(rules)
    }

    /// How often its rules have acted, all together.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn acted(&self) -> Result<u64, Error> {
        Ok(self.rules()?.iter().map(|view| view.acted).sum())
    }

    /// Leaves the scenario to itself: it is there until somebody ends it.
    pub fn keep(mut self) -> ScenarioNumber {
        self.stays = true;
        self.number
    }
}

impl Drop for ScenarioHandle {
    fn drop(&mut self) {
        if !self.stays {
            // Waited for, so that what comes after the drop finds it ended. An emulator that has ended
            // has no scenarios.
            let _ = self.control.end_scenario(self.number).wait();
        }
    }
}
