//! An error answer says why: those of every session, and word by word those of the table in
//! `fixtures/reasons`, which has every code of every model.

#![expect(clippy::expect_used, clippy::panic, reason = "what cannot be read fails the test")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use vimc4_conform::fixtures;
use vimc4_conform::format::{Session, parse};
use vimc4_conform::play::{Drive, play};
use vimc4_conform::workshop::Workshop;
use vimc4_isel_wire::Reply;
use vimc4_lpkf::language::{Dialect, Status};
use vimc4_tests::plain::debug_text;
use vimc4_tests::shown::shown;

#[test]
fn every_row_of_the_table_is_explained_in_its_words() {
    let mut wrong = Vec::new();
    for session in &table() {
        for model in &session.models {
            let played = Workshop::new(session, model).and_then(|workshop| {
                let played = play(session, Drive::Smooth, |flash| workshop.build(flash));
                played.map_err(|failure| failure.to_string())
            });
            wrong.extend(
                played.err().map(|failure| format!("{} on {model}: {failure}", session.id)),
            );
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn every_error_of_every_session_is_explained_and_its_code_in_the_table() {
    let sessions = fixtures::sessions().unwrap_or_else(|error| panic!("{error}"));
    let (table, mut wrong) = (explained(&table()), BTreeSet::new());
    for shown in shown(&sessions) {
        let (id, model) = (&shown.session.id, shown.model);
        for (mnemonic, code, why) in &shown.record.errors {
            if is_generic(why, code) {
                wrong.insert(format!("{id} on {model}: {mnemonic} {code}: {why:?} is no reason"));
            }
            if !table.contains(&(model, code.clone())) {
                wrong.insert(format!("{model}: {code} is in no row, but {id} answers it"));
            }
        }
    }
    let wrong: Vec<String> = wrong.into_iter().collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_message_of_every_session_is_in_words() {
    let sessions = fixtures::sessions().unwrap_or_else(|error| panic!("{error}"));
    let mut wrong = BTreeSet::new();
    let mut count = 0;
    for shown in shown(sessions.iter().chain(&table())) {
        count += shown.record.messages.len();
        wrong.extend(shown.record.messages.iter().filter_map(|message| {
            debug_text(message).map(|part| format!("{}: {part}", shown.session.id))
        }));
    }
    assert!(count > 1_000, "only {count} messages were seen");
    let wrong: Vec<String> = wrong.into_iter().collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_code_there_is_has_a_row() {
    let rows = explained(&table());
    let has = |code: &str| rows.iter().any(|(_, known)| known == code);
    let isel = Reply::ALL.iter().filter(|reply| **reply != Reply::Done);
    let isel = isel.map(|reply| char::from(reply.code()).to_string());
    let lpkf = Dialect::ALL.into_iter().flat_map(|dialect| {
        Status::ALL.iter().filter_map(move |status| status.written(dialect, false))
    });
    let missing: Vec<String> = isel.chain(lpkf).filter(|code| !has(code)).collect();
    assert!(missing.is_empty(), "in no row: {}", missing.join(", "));
}

/// The rows, which are written as sessions are.
fn table() -> Vec<Session> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/reasons");
    let programs = fixtures::programs();
    let read = |file: &str| {
        let path = folder.join(file);
        let text = fs::read_to_string(&path).expect("the table is there");
        parse("reasons", &path, &text, &programs).unwrap_or_else(|error| panic!("{error}"))
    };
    ["isel.toml", "lpkf.toml"].into_iter().flat_map(read).collect()
}

/// The models and the codes that rows of the table explain.
fn explained(table: &[Session]) -> BTreeSet<(&'static str, String)> {
    let shown = shown(table);
    let codes = |model, errors: &BTreeSet<(_, String, String)>| {
        errors.iter().map(|(_, code, _)| (model, code.clone())).collect::<Vec<_>>()
    };
    shown.iter().flat_map(|shown| codes(shown.model, &shown.record.errors)).collect()
}

/// Whether a reason says no more than the code does.
fn is_generic(why: &str, code: &str) -> bool {
    let why = why.split("; commands ").next().unwrap_or_default();
    let of_reply = Reply::ALL.iter().any(|reply| reply.meaning() == why);
    let of_status = Status::ALL.iter().any(|status| status.meaning() == why);
    why.trim().is_empty() || why == code || of_reply || of_status
}
