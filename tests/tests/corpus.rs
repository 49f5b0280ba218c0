//! Replays the corpus of the fuzz targets, and holds that it reaches everything.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::panic::catch_unwind;

use vimc4_tests::fuzzing::{TARGETS, corpus, mixed};

/// Checks every input of a target by itself and mixed with another one, and says which ones did not
/// hold.
fn replay(name: &str) {
    let (_, check) = TARGETS.iter().find(|(target, _)| *target == name).unwrap();
    let inputs = corpus(name).unwrap();
    assert!(!inputs.is_empty(), "nothing to replay");
    let failed = mixed(&inputs).chain(inputs.iter().cloned());
    let failed = failed.filter(|(_, data)| catch_unwind(|| check(data)).is_err());
    let failed: Vec<String> = failed.map(|(name, _)| name).collect();
    assert!(failed.is_empty(), "{name}: {}", failed.join(", "));
}

#[test]
fn lines_are_found_in_every_input() {
    replay("lexer");
}

#[test]
fn commands_print_as_what_they_are_read_from() {
    replay("parser");
}

#[test]
fn commands_of_both_dialects_print_as_what_they_are_read_from() {
    replay("language");
}

#[test]
fn job_files_are_read_and_lead_where_they_say() {
    replay("ncp");
}

#[test]
fn profiles_are_refused_or_work() {
    replay("profiles");
}

#[test]
fn conditions_are_written_as_what_they_are_read_from() {
    replay("condition");
}

#[test]
fn faults_are_written_as_what_they_are_read_from() {
    replay("fault");
}

#[test]
fn rules_are_written_as_what_they_are_read_from() {
    replay("scenario");
}

#[test]
fn flash_images_are_refused_or_work() {
    replay("flash");
}

#[test]
fn recordings_are_refused_or_read_as_they_are_written() {
    replay("recording");
}

#[test]
fn isel_controllers_do_nothing_that_they_must_not() {
    replay("controller");
}

#[test]
fn lpkf_controllers_do_nothing_that_they_must_not() {
    replay("lpkf");
}

#[test]
fn a_history_goes_anywhere_and_is_what_it_was_there() {
    replay("history");
}

#[test]
fn a_debugger_goes_back_and_forward_to_where_it_was() {
    replay("walk");
}

#[test]
fn a_console_carries_out_or_refuses_what_is_typed() {
    replay("console");
}

#[test]
fn an_adapter_answers_whatever_a_client_says() {
    replay("adapter");
}

#[test]
fn a_port_on_the_network_takes_what_comes_in_any_pieces() {
    replay("rfc2217");
}
