//! Stored programs: a step is a line, and what never comes is said.

#![expect(clippy::panic, clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod drive;

use std::ops::ControlFlow;

use vimc4_debug::{Answer, Debugger, Feed, Piece, Reason, Unit};
use vimc4_device::{Device, Input};

use drive::{debugger, run, stop};

/// X shuttles for ever, and waits at the far side while bit 3 of port 0 is 0.
const SHUTTLE: &str =
    "01600,3000,0,900,0,900,0,900\ro0,3,0,-1\r50\r0-1600,3000,0,900,0,900,0,900\r30,-4\r9\r";

/// A controller with a stored program, and a host that only presses START.
fn stored(program: &str) -> Debugger {
    let mut filled = debugger("imc4", "bench");
    filled.give(Input::Bytes(format!("@07\r@0i\r{program}").as_bytes()));
    run(&mut filled, &["continue"]);
    let start = filled.device().signals().iter().find(|own| own.name == "start").unwrap().id;
    let feed = Feed::new(vec![Piece::Press(start)]);
    Debugger::new(filled.device().clone()).with_feed(feed)
}

/// Carries out a line, and fails if it has not ended after many thousand acts.
fn ends(debugger: &mut Debugger, line: &str) -> Answer {
    let mut left = 100_000;
    let answer = debugger.execute(line, &mut |_| {
        left -= 1;
        if left > 0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    answer.unwrap_or_else(|error| panic!("`{line}`: {error}"))
}

#[test]
fn a_step_of_a_stored_program_is_a_line_from_the_first_on() {
    let mut debugger = stored(SHUTTLE);
    let first = run(&mut debugger, &["step"]);
    assert!(first.to_string().contains("program line 1: 0"), "{first}");
    assert_eq!(stop(first).why, Reason::Step(Unit::Line));
    let second = run(&mut debugger, &["step"]);
    assert!(second.to_string().contains("program line 2: o"), "{second}");
    assert_eq!(stop(run(&mut debugger, &["back"])).why, Reason::Step(Unit::Line));
    assert!(run(&mut debugger, &["list"]).to_string().contains(">      1  01600,3000"));
}

#[test]
fn the_program_is_listed_before_it_has_begun() {
    let mut debugger = stored(SHUTTLE);
    let listed = run(&mut debugger, &["list"]).to_string();
    assert!(listed.starts_with("the stored program\n       1  01600,3000"), "{listed}");
}

#[test]
fn a_program_that_waits_for_an_input_says_for_which_and_what_changes_that() {
    let waits =
        "the program waits for bit 3 of port 0 to be 1; it is 0, and `input 0.3 1` changes that";
    let mut debugger = stored(SHUTTLE);
    run(&mut debugger, &["step 2"]);
    for line in ["step", "step command", "continue", "next x = 99999"] {
        let answer = ends(&mut debugger, line);
        assert!(answer.to_string().contains(waits), "{line}: {answer}");
    }
    run(&mut debugger, &["input 0.3 1"]);
    let on = ends(&mut debugger, "step 2 lines").to_string();
    assert!(!on.contains(waits) && on.contains("program line 3"), "{on}");
}

#[test]
fn what_never_comes_in_an_endless_program_is_said_and_the_present_stays() {
    for line in [
        "step command",
        "step 5 commands",
        "continue",
        "next x = 99999",
        "next answer error",
        "step byte",
    ] {
        let mut debugger = stored(SHUTTLE);
        run(&mut debugger, &["input 0.3 1", "step 3"]);
        let (place, digest) = (debugger.place(), debugger.digest());
        let usage = debugger.history().usage().inputs;
        let end = |debugger: &Debugger| debugger.history().branches().map(|own| own.end).max();
        let known = end(&debugger);
        let answer = ends(&mut debugger, line);
        let told = answer.to_string();
        assert!(told.contains("the program repeats itself every 1.1"), "{line}: {told}");
        assert!(told.contains("`press stop` stops it"), "{line}: {told}");
        assert!(matches!(stop(answer).why, Reason::Endless(_)), "{line}");
        assert_eq!((debugger.place(), debugger.digest()), (place, digest), "{line}");
        assert_eq!((debugger.history().usage().inputs, end(&debugger)), (usage, known), "{line}");
        // What does come is found all the same.
        let found = stop(ends(&mut debugger, "next x = 800"));
        assert_eq!(found.why, Reason::Found, "{line}");
    }
    let mut debugger = stored(SHUTTLE);
    run(&mut debugger, &["input 0.3 1", "step"]);
    let wrong = debugger.execute("goto command 9", &mut vimc4_debug::uninterrupted).unwrap_err();
    assert!(wrong.to_string().contains("repeats itself every 1.1"), "{wrong}");
}

#[test]
fn what_comes_late_is_not_taken_for_never() {
    // 300 rounds, and then another line; X has gone further with each.
    let mut debugger = stored(
        "010,3000,0,900,0,900,0,900\r01,3000,0,900,0,900,0,900\r3300,-2\r0-5,3000,0,900,0,900,0,900\r9\r",
    );
    assert_eq!(stop(ends(&mut debugger, "next line 4")).why, Reason::Found);
    // Hits are counted, and so the state is not all that matters.
    let mut debugger = stored(SHUTTLE);
    run(&mut debugger, &["input 0.3 1", "break x = 800 hit 40"]);
    assert!(matches!(stop(ends(&mut debugger, "continue")).why, Reason::Breakpoints(_)));
    // A rule acts at its time.
    let mut debugger = stored(SHUTTLE);
    run(&mut debugger, &["input 0.3 1", "at 60s: input 0.3 0"]);
    let rest = ends(&mut debugger, "continue").to_string();
    assert!(rest.contains("`input 0.3 1` changes that"), "{rest}");
}
