//! The documents say what the fixtures say.

use std::fs;

use toml::{Table, Value};
use vimc4_conform::fixtures;
use vimc4_tests::{behaviour, jobs, ncp_reference};

#[test]
fn the_documents_are_up_to_date() {
    let sessions = fixtures::sessions().unwrap_or_else(|error| panic!("{error}"));
    let jobs = jobs::jobs().unwrap_or_else(|error| panic!("{error}"));
    for (path, wanted) in [
        (behaviour::document_path(), behaviour::document(&sessions)),
        (ncp_reference::document_path(), ncp_reference::document(&jobs)),
    ] {
        let written = fs::read_to_string(&path).unwrap_or_default();
        let mut lines = written.lines().zip(wanted.lines()).enumerate();
        let first = lines.find(|(_, (is, should))| is != should);
        assert!(
            written == wanted,
            "{} is stale, first in {first:#?}\n\
             make it anew: cargo run -p vimc4-tests --bin behaviour",
            path.display()
        );
    }
}

#[test]
fn every_title_is_a_row_of_its_own() {
    let sessions = fixtures::sessions().unwrap_or_else(|error| panic!("{error}"));
    for (at, session) in sessions.iter().enumerate() {
        let same = sessions[..at].iter().find(|other| {
            other.title == session.title && other.models.iter().any(|m| session.models.contains(m))
        });
        let Some(same) = same else { continue };
        panic!("{} and {} say the same: {}", same.id, session.id, session.title);
    }
}

/// The worked example of `docs/profiles.md`, and the session that plays it.
const PROFILES: &str = include_str!("../../docs/profiles.md");
const EXAMPLE: &str = "isel/settings/effect/mixed-wiring";

#[test]
fn the_machine_of_the_worked_example_is_the_one_that_is_played() {
    let block = |start: &str| {
        let blocks = PROFILES.split("```").skip(1).step_by(2);
        blocks.into_iter().find_map(|block| block.strip_prefix(start)).unwrap_or_default()
    };
    let machine = block("toml\nname =");
    let machine = format!("name ={machine}");
    if let Err(error) = vimc4::Machine::from_toml(&machine) {
        panic!("{error}");
    }
    let machine: Table = machine.parse().unwrap_or_else(|error| panic!("{error}"));
    let sessions = fixtures::sessions().unwrap_or_else(|error| panic!("{error}"));
    let session = sessions.iter().find(|session| session.id == EXAMPLE);
    let session = session.unwrap_or_else(|| panic!("no session {EXAMPLE}"));
    assert!(holds(&machine, &session.machine.differs), "{:#?}", session.machine.differs);
    let sent = block("\n@0");
    let script = include_str!("../../fixtures/sessions/isel/settings/effect.toml");
    for line in format!("@0{sent}").lines() {
        assert!(script.contains(&format!("> {line} -> 0")), "{line}");
    }
}

/// Whether a table has every value of a part of it.
fn holds(whole: &Table, part: &Table) -> bool {
    part.iter().all(|(key, value)| match (whole.get(key), value) {
        (Some(Value::Table(whole)), Value::Table(part)) => holds(whole, part),
        (found, value) => found == Some(value),
    })
}
