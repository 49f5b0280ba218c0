//! What is said before anything is played: which sessions, and what they would do.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::io::{self, BufRead, IsTerminal, Write};

use serde_json::json;
use vimc4_catalogue::Handling;
use vimc4_conform::choice::show_ways;
use vimc4_conform::travel::Travel;

use super::arguments::{Allow, Arguments};
use super::chosen::Choice;
use crate::failure::Failure;
use crate::output;

/// Says which sessions would be played, and why the others not.
pub(super) fn list(
    choices: &[Choice<'_>],
    axes: &[&str],
    arguments: &Arguments,
) -> Result<(), Failure> {
    if arguments.json {
        let sessions: Vec<_> = choices.iter().map(|choice| as_json(choice, axes.len())).collect();
        return output::print(&format!("{}\n", json!({ "sessions": sessions })));
    }
    let mut text = String::new();
    for choice in choices {
        let id = &choice.session.id;
        text += &match &choice.plan {
            Ok(plan) if plan.travel.is_nothing() => format!("{id}\n"),
            Ok(plan) => {
                let (ways, top) = (show_ways(&plan.travel, axes), plan.travel.top);
                format!("{id}  {ways}  {top} Hz\n")
            }
            Err(reason) => format!("- {id} {reason}\n"),
        };
    }
    let played = choices.iter().filter(|choice| choice.plan.is_ok()).count();
    text += &format!("\n{played} of {} sessions would be played\n", choices.len());
    output::print(&(text + &reasons(choices)))
}

fn as_json(choice: &Choice<'_>, axes: usize) -> serde_json::Value {
    match &choice.plan {
        Ok(plan) => json!({
            "id": choice.session.id,
            "played": true,
            "low": plan.travel.low[..axes],
            "high": plan.travel.high[..axes],
            "hz": plan.travel.top,
            "takes_ns": plan.takes,
        }),
        Err(reason) => json!({
            "id": choice.session.id,
            "played": false,
            "reason": reason.key(),
            "detail": reason.to_string(),
        }),
    }
}

/// How many are not played for which reason.
fn reasons(choices: &[Choice<'_>]) -> String {
    let mut counts = BTreeMap::new();
    for reason in choices.iter().filter_map(|choice| choice.plan.as_ref().err()) {
        *counts.entry(reason.in_general()).or_default() += 1;
    }
    tally(&counts)
}

/// One reason a line, the commonest first.
pub(super) fn tally(counts: &BTreeMap<String, usize>) -> String {
    let mut counts: Vec<_> = counts.iter().collect();
    counts.sort_by_key(|(_, count)| Reverse(**count));
    counts.into_iter().map(|(reason, count)| format!("{count:6} {reason}\n")).collect()
}

/// Says what is going to happen at the machine.
pub(super) fn dangers(
    port: &str,
    choices: &[Choice<'_>],
    handling: &Handling,
    arguments: &Arguments,
) {
    let axes = handling.model().axis_names();
    let plans: Vec<_> =
        choices.iter().filter_map(|c| Some((c.session, c.plan.as_ref().ok()?))).collect();
    let mut text = format!("What is at {port} will do this:\n");
    let mut all = Travel::default();
    for (session, plan) in &plans {
        if !plan.travel.is_nothing() {
            all.include(&plan.travel);
            let (ways, top) = (show_ways(&plan.travel, axes), plan.travel.top);
            text += &format!("  {}  {ways}  {top} Hz\n", session.id);
        }
    }
    if !all.is_nothing() {
        let (ways, top) = (show_ways(&all, axes), all.top);
        text += &format!(
            "All moves together, in steps from where the axes are now: {ways}, up to {top} Hz.\n\
             After each session the axes go back to where they were.\n"
        );
    }
    let needs: Vec<_> = plans.iter().map(|(session, _)| session.needs().effects).collect();
    if needs.iter().any(|needs| needs.reference) {
        text += "Reference runs go to the reference switches, however far they are; from then on \
                 the ways above count from there.\n";
    }
    if needs.iter().any(|needs| needs.outputs) {
        text += "Outputs are switched: spindle, brake, motor currents, cover, what is connected.\n";
    }
    if arguments.allow.contains(&Allow::Flash) {
        text += "The stored program is erased, and saved settings become the factory's, also \
                 those of the limit switches.\n";
    }
    text += &format!("{}\n", handling.warning);
    // Messages to people must not disturb output for programs.
    let _ = match arguments.json {
        true => io::stderr().lock().write_all(text.as_bytes()),
        false => io::stdout().lock().write_all(text.as_bytes()),
    };
}

/// Asks a person.
pub(crate) fn confirm() -> Result<(), Failure> {
    if !io::stdin().is_terminal() {
        return Err(Failure::usage(
            "this needs somebody's consent, and nobody is at the terminal; add --yes if nobody \
             can be hurt",
        ));
    }
    let mut answer = String::new();
    let _ = write!(io::stderr(), "Type yes to begin: ");
    match io::stdin().lock().read_line(&mut answer) {
        Ok(_) if answer.trim() == "yes" => Ok(()),
        _ => Err(Failure::usage("not begun; nothing was sent")),
    }
}
