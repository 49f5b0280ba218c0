//! Moving across the place where a branch parts, what makes a branch, and what a past command means.

#![expect(clippy::panic, clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod drive;

use vimc4_debug::{Debugger, Reason, uninterrupted};
use vimc4_device::Input;
use vimc4_timeline::{BranchId, Place};

use drive::{debugger, run, stop};

/// Two moves, the second of which begins in the instant in which the first ends.
fn moved() -> Debugger {
    let mut debugger = debugger("imc4", "mill");
    debugger.give(Input::Bytes(b"@01\r@0A300,900\r@0A-100,900\r"));
    run(&mut debugger, &["continue"]);
    debugger
}

/// All moments after events, and some between.
fn places() -> Vec<Place> {
    let mut debugger = moved();
    let mut places = Vec::new();
    run(&mut debugger, &["goto start"]);
    while matches!(stop(run(&mut debugger, &["step event"])).why, Reason::Step(_)) {
        places.push(debugger.place());
    }
    for line in ["goto 100ms", "last x = 200", "goto start"] {
        run(&mut debugger, &[line]);
        places.push(debugger.place());
    }
    places.pop();
    places
}

#[test]
fn moves_across_a_parting_stay_on_the_branch() {
    for place in places() {
        let mut debugger = moved();
        debugger.go_to(place).unwrap();
        run(&mut debugger, &["hold probe", "send @0P", "continue", "step 20ms"]);
        let at = place.moment.at.as_nanos();
        let end = debugger.place();
        if end.branch == BranchId(0) {
            continue;
        }
        let mut moves: Vec<String> = Vec::new();
        for unit in ["event", "command", "cause", "steps", "7ms", "400ms"] {
            for count in [1, 3, 8] {
                moves.push(format!("back {count} {unit}"));
            }
        }
        for nanos in [at.saturating_sub(1), at, at + 1, 0, at / 2] {
            moves.push(format!("goto {nanos}ns"));
        }
        for line in ["goto start", "reverse", "goto command 1", "goto command 2", "last x = 100"] {
            moves.push(line.to_owned());
        }
        for back in moves {
            for ahead in ["step event", "step cause", "next x = 50", "goto +1ms", "step 400ms"] {
                run(&mut debugger, &["goto end"]);
                assert_eq!(debugger.place().branch, end.branch, "{back}");
                if debugger.execute(&back, &mut uninterrupted).is_err() {
                    continue;
                }
                let there = debugger.place();
                let on_way = |own: &Debugger| {
                    let here = own.place();
                    here.branch == end.branch || here.moment <= place.moment
                };
                assert!(on_way(&debugger), "{place:?}: {back} to {there:?}");
                run(&mut debugger, &[ahead]);
                assert!(on_way(&debugger), "{place:?}: {back} to {there:?}, {ahead}");
                run(&mut debugger, &[ahead]);
                assert!(on_way(&debugger), "{place:?}: {back} to {there:?}, {ahead}");
                let heading = debugger.history().heading();
                assert_eq!(heading, end.branch, "{place:?}: {back} to {there:?}, {ahead}");
            }
        }
    }
}

#[test]
fn what_changes_nothing_makes_no_branch() {
    let mut debugger = moved();
    run(&mut debugger, &["goto 100ms"]);
    let (place, digest) = (debugger.place(), debugger.digest());
    let nothing = "ok, without effect: it was so already";
    for line in [
        "set stop 0",
        "release stop",
        "set probe 0",
        "put state.ramp.acceleration = state.ramp.acceleration",
    ] {
        assert_eq!(run(&mut debugger, &[line]).to_string(), nothing, "{line}");
        assert_eq!(debugger.history().branches().count(), 1, "{line}");
        assert_eq!((debugger.place(), debugger.digest()), (place, digest), "{line}");
    }
    run(&mut debugger, &["set probe 1"]);
    assert_eq!(debugger.history().branches().count(), 2);
    assert_eq!(debugger.evaluate("signals.probe").unwrap(), 1);
}

#[test]
fn a_time_beyond_the_end_leads_to_the_end() {
    let mut debugger = moved();
    let end = debugger.place();
    for line in ["goto 100000s", "goto +1s", "goto 20min"] {
        let stop = stop(run(&mut debugger, &["goto start", line]));
        assert_eq!((stop.why, stop.place), (Reason::Rest, end), "{line}");
        assert_eq!(debugger.history().branches().next().unwrap().end, end.moment, "{line}");
    }
    // What is under way goes on by itself, and time passes where somebody wants that.
    debugger.give(Input::Bytes(b"@0A300,900\r"));
    let under_way = stop(run(&mut debugger, &["goto +100ms"]));
    assert_eq!(
        (under_way.why, debugger.now()),
        (Reason::Gone, end.moment.at.after_nanos(100_000_000))
    );
    run(&mut debugger, &["goto end", "step 10s"]);
    assert!(debugger.now() > end.moment.at.after_nanos(10_000_000_000));
}

#[test]
fn a_past_command_keeps_the_meaning_that_it_had() {
    let mut debugger = debugger("imc4", "mill");
    debugger.give(Input::Bytes(b"@01\r@0A300,900\r@03\r@0A100,900,50,900\r@01\r"));
    run(&mut debugger, &["continue"]);
    let meaning = |debugger: &mut Debugger, number: u64| {
        let listed = debugger.commands().lines.into_iter().find(|line| line.number == number);
        listed.unwrap().meaning
    };
    for place in ["goto start", "goto command 2", "goto command 3", "goto end"] {
        run(&mut debugger, &[place]);
        assert_eq!(meaning(&mut debugger, 2), "relative move X +300 steps at 900 Hz", "{place}");
        let second = "relative move X +100 steps at 900 Hz, Y +50 steps at 900 Hz";
        assert_eq!(meaning(&mut debugger, 4), second, "{place}");
    }
    run(&mut debugger, &["goto end"]);
    let why = run(&mut debugger, &["why motion"]).to_string();
    assert!(why.contains("X +100 steps at 900 Hz, Y +50 steps at 900 Hz"), "{why}");
}

#[test]
fn a_count_behind_the_unit_is_told_where_it_belongs() {
    let mut debugger = moved();
    for (line, right) in [("step command 3", "step 3 command"), ("back event 2", "back 2 event")] {
        let wrong = debugger.execute(line, &mut uninterrupted).unwrap_err().to_string();
        assert_eq!(wrong, format!("the count comes before the unit, as in `{right}`"));
        run(&mut debugger, &[right]);
    }
}
