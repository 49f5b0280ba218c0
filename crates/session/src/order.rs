//! What orders are answered.

use vimc4_device::{Awaits, Cue, RuleView, Scenario, ScenarioNumber, Trigger};

use crate::Effect;

/// What came of a deed: that something changed nothing is worth a word.
#[must_use]
pub fn said(effect: &Effect) -> String {
    match effect {
        Effect::Something => "ok".to_owned(),
        Effect::Nothing { why: Some(why) } => format!("ok, without effect: {why}"),
        Effect::Nothing { why: None } => "ok, without effect".to_owned(),
    }
}

/// What came of erasing the memory at the panel, which takes so many ms.
#[must_use]
pub fn erased(effect: &Effect, was_powered: bool, takes_ms: u64) -> String {
    match effect {
        Effect::Something if was_powered => format!(
            "ok: the memory is erased, which takes {} s; then press on, for the emergency stop has \
             switched the stages off",
            takes_ms as f64 / 1_000.0
        ),
        Effect::Something => "ok, but nothing is erased: the power is off".to_owned(),
        effect => said(effect),
    }
}

/// What came of rules that have begun: whether one waits for another that is not among those that there
/// are now.
#[must_use]
pub fn ruled(number: ScenarioNumber, scenario: &Scenario, rules: &[RuleView]) -> String {
    let is_there = |name: &&String| {
        let is_it = |view: &RuleView| view.id.name.as_ref() == Some(*name);
        rules.iter().any(|view| is_it(view) && view.id.scenario != number)
    };
    match heard(scenario).iter().find(|name| !is_there(name)) {
        Some(name) => format!("ok, rule {number}; there is no rule `{name}` yet"),
        None => format!("ok, rule {number}"),
    }
}

/// The names of the rules that others wait for.
fn heard(scenario: &Scenario) -> Vec<String> {
    let cues = scenario.rules.iter().filter_map(|rule| match &rule.trigger {
        Trigger::When(cues) => Some(cues.iter()),
        _ => None,
    });
    let name = |cue: &Cue| match &cue.awaits {
        Awaits::Rule(name) => Some(name.clone()),
        _ => None,
    };
    cues.flatten().filter_map(name).collect()
}
