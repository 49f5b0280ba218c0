//! What a sweep has found, for people and for programs.

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use vimc4::sweep::{Exit, Group, Results};
use vimc4_device::Grouped;

use super::folder::{printed_of, recording_of};
use crate::failure::Failure;
use crate::output;

/// So many outcomes with which nothing is wrong are listed.
const LISTED: usize = 12;

/// What a report is about.
pub(super) struct About<'a> {
    /// The folder of the recordings.
    pub(super) out: &'a Path,
    pub(super) json: bool,
}

/// How far a sweep has come and how long it will take, on a terminal.
pub(super) fn progress(points: u64) -> ProgressBar {
    let bar = ProgressBar::new(points);
    let style = ProgressStyle::with_template("{bar:30} {pos} of {len} points, {eta} left  {msg}");
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Prints the report; the exit code says whether something is wrong.
pub(super) fn print(results: &Results, about: &About<'_>) -> Result<ExitCode, Failure> {
    let groups = results.groups();
    let is_bad = |group: &Group<'_>| !group.outcome.verdicts.is_empty();
    let bad = groups.iter().filter(|group| is_bad(group)).count();
    if about.json {
        let outcomes: Vec<_> = groups.iter().map(|group| told(group, about.out)).collect();
        let report = json!({
            "points": results.total(), "done": results.done(), "bad": bad,
            "unsteady": results.is_unsteady(), "outcomes": outcomes,
        });
        output::print(&format!("{report}\n"))?;
    } else {
        output::print(&text(results, &groups, bad, about))?;
    }
    Ok(if bad > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn told(group: &Group<'_>, out: &Path) -> serde_json::Value {
    let case = group.case;
    json!({
        "title": group.outcome.title(),
        "outcome": group.outcome,
        "points": group.points,
        "heard": group.outcome.heard(),
        "did": group.outcome.did(),
        "broken": case.map(|case| &case.broken),
        "machine": case.map(|case| &case.machine),
        "should": case.and_then(|case| case.should.as_ref()),
        "point": case.map(|case| case.point),
        "recording": case.map(|case| out.join(recording_of(case))),
    })
}

fn text(results: &Results, groups: &[Group<'_>], bad: usize, about: &About<'_>) -> String {
    let count = |count: u64, one: &str| {
        let number = Grouped(i64::try_from(count).unwrap_or(i64::MAX));
        format!("{number} {one}{}", if count == 1 { "" } else { "s" })
    };
    let of = results.name();
    let of = if of.is_empty() { String::new() } else { format!("{of}: ") };
    let part = match results.done() == results.total() {
        true => String::new(),
        false => format!(" of {}", count(results.total(), "point")),
    };
    let done = match part.is_empty() {
        true => count(results.done(), "point"),
        false => Grouped(i64::try_from(results.done()).unwrap_or(i64::MAX)).to_string(),
    };
    let outcomes = count(groups.len() as u64, "outcome");
    let is_played = groups.iter().any(|group| group.outcome.exit == Exit::Played);
    let wrong = match (is_played, bad) {
        (true, _) => String::new(),
        (false, 0) => ", nothing is wrong with any".to_owned(),
        (false, bad) => format!(", {bad} with something wrong"),
    };
    let mut text = format!("{of}{done}{part}, {outcomes}{wrong}\n");
    if results.is_unsteady() {
        text += "The host has not always done the same after hearing the same: --run-all runs it for every point.\n";
    }
    for group in groups.iter().filter(|group| !group.outcome.verdicts.is_empty()) {
        let outcome = group.outcome;
        let _ = writeln!(text, "\n{} ({})", outcome.title(), count(group.points, "point"));
        if let Some(case) = group.case {
            let mut line = |name: &str, words: &str| {
                let _ = writeln!(text, "  {name:<9}{words}");
            };
            line("broken", &case.broken);
            line("heard", &outcome.heard());
            line("did", &outcome.did());
            line("machine", &case.machine);
            if let Some(should) = &case.should {
                line("should", should);
            }
            line("case", &about.out.join(recording_of(case)).display().to_string());
            let printed = about.out.join(printed_of(case));
            if printed.exists() {
                line("printed", &printed.display().to_string());
            }
        }
    }
    let good: Vec<_> = groups.iter().filter(|group| group.outcome.verdicts.is_empty()).collect();
    if !good.is_empty() {
        text += if is_played { "\n" } else { "\nNothing is wrong with these:\n" };
    }
    for group in good.iter().take(LISTED) {
        let number = group.case.map_or_else(String::new, recording_of);
        let (title, heard) = (group.outcome.title(), group.outcome.heard());
        let points = Grouped(i64::try_from(group.points).unwrap_or(i64::MAX)).to_string();
        let _ = writeln!(text, "{points:>8}  {title}: heard {heard} ({number})");
    }
    if let Some(more) = good.len().checked_sub(LISTED).filter(|more| *more > 0) {
        let _ = writeln!(text, "{:>8}  more outcomes; --json lists all", more);
    }
    text
}
