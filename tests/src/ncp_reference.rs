//! The reference of the isel NC intermediate format: its commands, and how jobs behave, each with
//! the job that holds it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use vimc4::Family;
use vimc4_ncp::language::reference::{self, COMMANDS, CommandInfo, Number, Parameter};

use crate::behaviour::cell;
use crate::jobs::JobCase;

/// Where the document is.
#[must_use]
pub fn document_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/ncp-reference.md")
}

const HEAD: &str = "\
# Job files: reference

Every command of the isel NC intermediate format, and how jobs behave, one behaviour a row. Each is
held by a job of that name below [`fixtures/ncp`](../fixtures/ncp), which is checked, run on every
model it names and, where that is possible, stored and started. [Job files](ncp.md) is the guide.

The marks are those of [the behaviour of the controllers](behaviour.md): **D** documented, in isel's
manual of 1998, **F** from files in use, **A** assumed.

This file is made from the table of commands and from the jobs by
`cargo run -p vimc4-tests --bin behaviour`.

## Commands

";

/// The topics, in the order in which one learns of them.
const TOPICS: [(&str, &str); 16] = [
    ("reading", "Reading"),
    ("setup", "The beginning"),
    ("reference", "Reference runs"),
    ("straight", "Straight movements"),
    ("speed", "Speeds"),
    ("arcs", "Arcs"),
    ("helix", "Helices"),
    ("zero", "Work-piece zeros"),
    ("limits", "Limits"),
    ("drilling", "Drilling"),
    ("cylinder", "Cylinders"),
    ("ports", "Ports, spindle, coolant"),
    ("operator", "The operator"),
    ("ends", "The end"),
    ("compile", "Stored programs"),
    ("gerbv", "Files of other programs"),
];

/// Makes the document.
#[must_use]
pub fn document(jobs: &[JobCase]) -> String {
    let mut text = HEAD.to_owned();
    text += &reference::markdown();
    text += "\n## Words\n";
    for (place, command) in COMMANDS.iter().enumerate() {
        let alike = |other: &&CommandInfo| std::ptr::eq(other.parameters, command.parameters);
        let told_before = COMMANDS[..place].iter().any(|other| alike(&other));
        if !command.parameters.is_empty() && !told_before {
            words(&mut text, &COMMANDS.iter().filter(alike).collect::<Vec<_>>());
        }
    }
    text += "\n## Behaviour\n";
    let known =
        |job: &&JobCase| TOPICS.iter().any(|(topic, _)| job.id.starts_with(&format!("{topic}/")));
    let others: Vec<&JobCase> = jobs.iter().filter(|job| !known(job)).collect();
    for (topic, heading) in TOPICS {
        let of_topic = jobs.iter().filter(|job| job.id.starts_with(&format!("{topic}/")));
        table(&mut text, heading, &of_topic.collect::<Vec<_>>());
    }
    table(&mut text, "More", &others);
    text
}

/// The words of commands that take the same.
fn words(text: &mut String, commands: &[&CommandInfo]) {
    let names: Vec<String> = commands
        .iter()
        .map(|command| format!("`{}`, as in `{}`", command.pattern(), command.example))
        .collect();
    let _ = writeln!(text, "\n{}\n", names.join("  \n"));
    let parameters = commands.first().map(|command| command.parameters).unwrap_or_default();
    for Parameter { name, meaning, value } in parameters {
        let name = if name.is_empty() { String::new() } else { format!("`{name}` ") };
        let value = match value {
            Some(Number { unit: "", .. }) | None => String::new(),
            Some(Number { unit, .. }) => format!(", in {unit}"),
        };
        let _ = writeln!(text, "- {name}{meaning}{value}");
    }
}

/// A row for each title; what is in several rows of a table, or on several models, is one.
fn table(text: &mut String, heading: &str, jobs: &[&JobCase]) {
    if jobs.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "\n### {heading}\n\n| behaviour | evidence | source | models | job |\n|---|---|---|---|---|"
    );
    for (place, job) in jobs.iter().enumerate() {
        let same = |other: &&&JobCase| other.title == job.title && stem(other) == stem(job);
        if jobs[..place].iter().any(|other| same(&other)) {
            continue;
        }
        let mut models: Vec<&str> = jobs.iter().filter(same).map(|job| job.model).collect();
        models.sort_unstable();
        models.dedup();
        let models = if models.len() == Family::Isel.models().len() {
            "all".to_owned()
        } else {
            models.join(", ")
        };
        let (file, name) = stem(job);
        let _ = writeln!(
            text,
            "| {} | {} | {} | {models} | [{name}](../fixtures/ncp/{file}.toml) |",
            cell(&job.title),
            job.source.evidence(),
            cell(&job.source.to_string()),
        );
    }
}

/// The file of a job, and its name in it, without the number of its row.
fn stem(job: &JobCase) -> (String, String) {
    let mut parts = job.id.split('/');
    let mut next = || parts.next().unwrap_or_default();
    let (topic, file, name) = (next(), next(), next());
    (format!("{topic}/{file}"), name.to_owned())
}
