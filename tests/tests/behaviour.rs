//! The behaviour document says what the sessions say.

use std::fs;

use vimc4_conform::fixtures;
use vimc4_tests::behaviour;

#[test]
fn the_document_is_up_to_date() {
    let sessions = fixtures::sessions().unwrap_or_else(|error| panic!("{error}"));
    let written = fs::read_to_string(behaviour::document_path()).unwrap_or_default();
    let wanted = behaviour::document(&sessions);
    let mut lines = written.lines().zip(wanted.lines()).enumerate();
    let first = lines.find(|(_, (is, should))| is != should);
    assert!(
        written == wanted,
        "docs/behaviour.md is stale, first in {first:#?}\n\
         make it anew: cargo run -p vimc4-tests --bin behaviour"
    );
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
