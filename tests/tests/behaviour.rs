//! The documents say what the fixtures say.

use std::fs;

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
