//! The behaviour document: what the controllers do, how certain that is, and the sessions that
//! hold it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use vimc4::Family;
use vimc4_conform::fixtures::topics;
use vimc4_conform::format::Session;
use vimc4_conform::source::{Evidence, with_manual};
use vimc4_lpkf::language::{Dialect, Status, forms};

use crate::shown::{Shown, shown};

/// So many sessions are named beside a command or a status.
const NAMED: usize = 3;

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

- **D** documented: a manual says so. Of isel's, `99` is the IMC4 manual of 1999, `05` that of the
  IMC4-M of 2005, `12` that of the iMC-M, iMC-MP and iMC-S8 of 2012. LPKF's is the catalogue of
  commands and status messages of the SMCU and the MotionSystem, cited by its headings.
- **F** field: host software in daily use with real controllers depends on it.
- **A** assumed: no manual says. What could plausibly be otherwise is a value in the profile of a
  model or machine, so that the owner of a real one can set it right.

`all` are the models of the family that have a manual. The c142 has none: it is what programs of the
field rely on, and is named where a behaviour is shown for it.

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
    for family in Family::ALL {
        let _ = writeln!(text, "\n## {family}");
        for (topic, heading) in topics(family) {
            let of_topic =
                |session: &&Session| session.family == family && session.topic() == *topic;
            let sessions: Vec<&Session> = sessions.iter().filter(of_topic).collect();
            if !sessions.is_empty() {
                table(&mut text, heading, &sessions);
            }
        }
    }
    let of_lpkf = sessions.iter().filter(|session| session.family == Family::Lpkf);
    let shown = shown(of_lpkf);
    commands(&mut text, &shown);
    statuses(&mut text, &shown);
    text
}

/// The behaviours of one topic.
fn table(text: &mut String, heading: &str, sessions: &[&Session]) {
    let _ = writeln!(
        text,
        "\n### {heading}\n\n| behaviour | evidence | source | models | session |\n\
         |---|---|---|---|---|"
    );
    for session in sessions {
        let Session { title, source, .. } = session;
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            cell(title),
            source.evidence(),
            cell(&source.to_string()),
            models(session),
            link(session, 2)
        );
    }
}

/// Every form of every command of LPKF's.
fn commands(text: &mut String, shown: &[Shown<'_>]) {
    let _ = writeln!(
        text,
        "\n### Every command\n\nA number after the letters is how many parameters that form has.\n\n\
         | command | | models | evidence | source | sessions |\n|---|---|---|---|---|---|"
    );
    for form in forms() {
        let models = names(|dialect| form.known_to(dialect));
        let _ = writeln!(
            text,
            "| `{}` | {} | {models} | {} | {} | {} |",
            form.mnemonic,
            cell(form.title),
            form.evidence,
            cell(form.source),
            held(shown.iter().filter(|shown| shown.holds(form)))
        );
    }
}

/// Every status of LPKF's.
fn statuses(text: &mut String, shown: &[Shown<'_>]) {
    let _ = writeln!(
        text,
        "\n### Every status\n\n| SMCU | MotionSystem | | evidence | sessions |\n|---|---|---|---|---|"
    );
    for &status in Status::ALL {
        let [smcu, motion_system] = Dialect::ALL.map(|dialect| {
            status.written(dialect, false).map_or("–".into(), |s| format!("`{s}`"))
        });
        let sends = |shown: &&Shown<'_>| {
            Dialect::ALL
                .into_iter()
                .any(|dialect| shown.speaks(dialect) && shown.sends(status, dialect))
        };
        let _ = writeln!(
            text,
            "| {smcu} | {motion_system} | {} | {} | {} |",
            cell(status.meaning()),
            status.evidence(),
            held(shown.iter().filter(sends))
        );
    }
}

/// The names of those of LPKF's models that `has` says.
fn names(has: impl Fn(Dialect) -> bool) -> String {
    let names = Dialect::ALL.into_iter().zip(["smcu", "motionsystem"]);
    let names: Vec<&str> = names.filter(|(dialect, _)| has(*dialect)).map(|(_, n)| n).collect();
    if names.len() == Dialect::ALL.len() { "all".to_owned() } else { names.join(", ") }
}

/// The sessions in which something is seen, those first in which little else is.
fn held<'s>(shown: impl Iterator<Item = &'s Shown<'s>>) -> String {
    let mut shown: Vec<&Shown<'_>> = shown.collect();
    shown.sort_by_key(|shown| (shown.record.commands.len(), &shown.session.id));
    let mut links: Vec<String> = Vec::new();
    for shown in shown {
        let link = link(shown.session, 1);
        if links.len() < NAMED && !links.contains(&link) {
            links.push(link);
        }
    }
    if links.is_empty() { "–".to_owned() } else { links.join(", ") }
}

/// A link to a session, named without the first folders of its name.
fn link(session: &Session, left_out: usize) -> String {
    let name: Vec<&str> = session.id.split('/').skip(left_out).collect();
    let (file, _) = session.id.rsplit_once('/').unwrap_or((&session.id, ""));
    format!("[{}](../fixtures/sessions/{file}.toml)", name.join("/"))
}

fn count(sessions: &[Session], has: impl Fn(&Evidence) -> bool) -> usize {
    sessions.iter().filter(|session| has(&session.source.evidence())).count()
}

/// The models in as few words as they have.
fn models(session: &Session) -> String {
    let models = &session.models;
    let family = with_manual(session.family);
    if *models == family {
        return "all".to_owned();
    }
    let of_2012 = |model: &&str| model.starts_with("imc-");
    let mut names: Vec<&str> = models.iter().filter(|model| !of_2012(model)).copied().collect();
    let mut together = family.iter().filter(|model| of_2012(model)).peekable();
    if together.peek().is_some() && together.all(|model| models.contains(model)) {
        names.push("iMC-xx");
    } else {
        names.extend(models.iter().filter(|model| of_2012(model)));
    }
    names.join(", ")
}

/// Text that a table can hold.
pub(crate) fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
