//! Whether the rules of a scenario go together.

use std::error::Error;
use std::fmt;

use super::{Awaits, Cue, Rule, Scenario, Trigger};

/// Why the rules of a scenario do not go together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenarioError {
    rule: usize,
    message: String,
    right: &'static str,
}

impl ScenarioError {
    /// The place of the rule that is wrong, from 0.
    #[must_use]
    pub fn rule(&self) -> usize {
        self.rule
    }

    /// What would be right, for people.
    #[must_use]
    pub fn right(&self) -> &str {
        self.right
    }
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for ScenarioError {}

impl Scenario {
    /// Whether nothing in it can never come. `others` are the names of the rules that are there besides.
    ///
    /// ```
    /// use vimc4_device::{Awaits, Cue, Deed, Rule, Scenario, Trigger};
    ///
    /// let slips = Cue { awaits: Awaits::Rule("slips".to_owned()), times: 1 };
    /// let rule = Rule::new(Trigger::When(vec![slips])).act(Deed::Power(false));
    /// let scenario = Scenario::from(rule);
    /// assert_eq!(scenario.check([]).unwrap_err().to_string(), "there is no rule `slips`");
    /// assert_eq!(scenario.check(["slips"]), Ok(()));
    /// ```
    ///
    /// # Errors
    ///
    /// If a rule waits for one that is not there or that can never act because it waits in turn, or if two
    /// have the same name.
    pub fn check<'n>(
        &self,
        others: impl IntoIterator<Item = &'n str>,
    ) -> Result<(), ScenarioError> {
        let wrong = |rule, message, right| Err(ScenarioError { rule, message, right });
        let others: Vec<&str> = others.into_iter().collect();
        let mut names: Vec<&str> = Vec::new();
        for (place, rule) in self.rules.iter().enumerate() {
            let Some(name) = rule.name.as_deref() else { continue };
            if names.contains(&name) {
                return wrong(
                    place,
                    format!("there are two rules `{name}`"),
                    "give it another name",
                );
            }
            names.push(name);
        }
        for (place, rule) in self.rules.iter().enumerate() {
            let is_there = |name: &&str| names.contains(name) || others.contains(name);
            if let Some(name) = heard(rule).find(|name| !is_there(name)) {
                let right = "write the name of a rule that there is";
                return wrong(place, format!("there is no rule `{name}`"), right);
            }
        }
        // Those that can act, and then those that can act because those can.
        let mut can = others;
        loop {
            let before = can.len();
            for rule in &self.rules {
                if let Some(name) = rule.name.as_deref()
                    && !can.contains(&name)
                    && heard(rule).all(|name| can.contains(&name))
                {
                    can.push(name);
                }
            }
            if can.len() == before {
                break;
            }
        }
        for (place, rule) in self.rules.iter().enumerate() {
            if let Some(name) = heard(rule).find(|name| !can.contains(name)) {
                let message =
                    format!("it can never act: it waits for rule `{name}`, and that for it");
                return wrong(place, message, "let one of them wait for something else");
            }
        }
        Ok(())
    }
}

/// The names of the rules that one waits for.
fn heard(rule: &Rule) -> impl Iterator<Item = &str> {
    let cues: &[Cue] = match &rule.trigger {
        Trigger::When(cues) => cues,
        _ => &[],
    };
    cues.iter().filter_map(|cue| match &cue.awaits {
        Awaits::Rule(name) => Some(name.as_str()),
        _ => None,
    })
}
