//! The behaviour document: what the controllers do, how certain that is, and the sessions that
//! hold it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use vimc4_conform::format::{Evidence, MODELS, Session, TOPICS};

/// Where the document is.
#[must_use]
pub fn document_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/behaviour.md")
}

const HEAD: &str = "\
# Behaviour and its evidence

What the virtual controllers do, one behaviour a row, and how certain it is that real ones do the
same. Each row is held by a session of that name, a file below
[`fixtures/sessions`](../fixtures/sessions) that is played on every model it names.

- **D** documented: a manual says so. `99` is the IMC4 manual of 1999, `05` that of the IMC4-M of
  2005, `12` that of the iMC-M, iMC-MP and iMC-S8 of 2012.
- **F** field: host software in daily use with real controllers depends on it.
- **A** assumed: no manual says. What could plausibly be otherwise is a value in the profile of a
  model or machine, so that the owner of a real one can set it right.

This file is made from the sessions by `cargo run -p vimc4-tests --bin behaviour`.
";

/// Makes the document.
#[must_use]
pub fn document(sessions: &[Session]) -> String {
    let mut text = HEAD.to_owned();
    let counts = [
        ("documented", count(sessions, |evidence| evidence.documented)),
        ("from the field", count(sessions, |evidence| evidence.field)),
        ("assumed at least in part", count(sessions, |evidence| evidence.assumed)),
    ];
    let counts = counts.map(|(name, number)| format!("{number} {name}")).join(", ");
    let _ = writeln!(text, "\n{} behaviours: {counts}.", sessions.len());
    for (topic, heading) in TOPICS {
        let _ = writeln!(
            text,
            "\n## {heading}\n\n| behaviour | evidence | source | models | session |\n\
             |---|---|---|---|---|"
        );
        for session in sessions.iter().filter(|session| session.topic() == topic) {
            let Session { id, title, evidence, source, .. } = session;
            let name = id.strip_prefix(topic).unwrap_or(id).trim_start_matches('/');
            let (file, _) = id.rsplit_once('/').unwrap_or((id, ""));
            let _ = writeln!(
                text,
                "| {} | {evidence} | {} | {} | [{name}](../fixtures/sessions/{file}.toml) |",
                cell(title),
                cell(source),
                models(&session.models)
            );
        }
    }
    text
}

fn count(sessions: &[Session], has: impl Fn(&Evidence) -> bool) -> usize {
    sessions.iter().filter(|session| has(&session.evidence)).count()
}

/// The models in as few words as they have.
fn models(models: &[&str]) -> String {
    if models.len() == MODELS.len() {
        return "all".to_owned();
    }
    let of_2012 = |model: &&str| !model.starts_with("imc4");
    let mut names: Vec<&str> = models.iter().filter(|model| !of_2012(model)).copied().collect();
    if MODELS.iter().filter(|model| of_2012(model)).all(|model| models.contains(model)) {
        names.push("iMC-xx");
    } else {
        names.extend(models.iter().filter(|model| of_2012(model)));
    }
    names.join(", ")
}

/// Text that a table can hold.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
