//! What the jobs leave out: every command, and everything that can be said of one, is in some.

use std::collections::BTreeSet;

use libtest_mimic::Trial;
use vimc4_ncp::language::{self, reference};
use vimc4_tests::jobs::JobCase;

/// Where each kind of problem has its name.
const PROBLEMS: [&str; 2] = [
    include_str!("../../../crates/ncp/src/language/problem.rs"),
    include_str!("../../../crates/ncp/src/job/problem.rs"),
];

/// What no job can have: it is said of what the operator types. `emulator/tests/job.rs` types it.
const TYPED: &str = "for-files";

pub(crate) fn trials(jobs: &[JobCase]) -> Vec<Trial> {
    let commands = missing_commands(jobs);
    let problems = missing_problems(jobs);
    let test = |name: &str, missing: Vec<String>| {
        Trial::test(name, move || match missing.is_empty() {
            true => Ok(()),
            false => Err(format!("no job has\n  {}", missing.join("\n  ")).into()),
        })
    };
    vec![test("every command is in a job", commands), test("every problem is in a job", problems)]
}

fn missing_commands(jobs: &[JobCase]) -> Vec<String> {
    let mut seen = BTreeSet::new();
    for job in jobs.iter().filter(|job| job.commands.is_some()) {
        let text = language::decode(&job.program);
        for line in language::lines(&text) {
            let read = language::parse(line.text, &mut |_, _| {});
            if let Some(command) = read.command {
                let named = line.text.get(command.span.range()).unwrap_or_default();
                let ends = named.find(|c: char| !c.is_ascii_alphabetic() && c != '_');
                seen.insert(named[..ends.unwrap_or(named.len())].to_ascii_uppercase());
            }
        }
    }
    let known = |name: &&str| {
        seen.iter().any(|seen| seen == name || *name == "IMF_PBL" && seen.starts_with(*name))
    };
    let names = reference::COMMANDS.iter().map(|info| info.name);
    names.filter(|name| !known(name)).map(str::to_owned).collect()
}

fn missing_problems(jobs: &[JobCase]) -> Vec<String> {
    let said = jobs
        .iter()
        .flat_map(|job| job.diagnostics.iter().chain(job.field_diagnostics.iter().flatten()));
    let seen: BTreeSet<&str> =
        said.filter_map(|said| Some(said.split(' ').nth(2)?.trim_end_matches(':'))).collect();
    let names = PROBLEMS.iter().flat_map(|source| codes(source));
    names.filter(|name| !seen.contains(name) && *name != TYPED).map(str::to_owned).collect()
}

/// The names in `fn code` of a source.
fn codes(source: &str) -> Vec<&str> {
    let code = source.split_once("fn code(").and_then(|(_, rest)| rest.split_once("pub fn "));
    let quoted = code.map_or("", |(code, _)| code).split('"').skip(1).step_by(2);
    quoted.filter(|text| !text.contains(' ')).collect()
}
