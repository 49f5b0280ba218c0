//! Stored programs with loops, files of commands, both families, and searches that are given up.

#![expect(clippy::panic, clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod drive;

use std::ops::ControlFlow;

use vimc4_debug::{Debugger, Depth, FrameKind, Reason, Source, Trigger, Unit, Way, uninterrupted};
use vimc4_device::Input;
use vimc4_language::read_condition;

use drive::{debugger, run, stop};

/// The line of the stored program that is executed, from 1.
fn line(debugger: &mut Debugger) -> Option<u32> {
    let frame = debugger.frames().into_iter().find(|frame| frame.kind == FrameKind::Line);
    frame.and_then(|frame| frame.line)
}

/// A program that moves by 10 and by 5 steps, three times in all, and then by 100; it has run.
fn looped() -> Debugger {
    let mut debugger = debugger("imc4", "bench");
    debugger.give(Input::Bytes(b"@01\r@0i\r010,900\r05,900\r33,-2\r0100,900\r9\r"));
    run(&mut debugger, &["continue", "press start", "continue", "goto start", "next line"]);
    debugger
}

#[test]
fn lines_and_rounds_of_a_program_are_stepped_both_ways() {
    let mut debugger = looped();
    let mut lines = vec![line(&mut debugger).unwrap()];
    while let Reason::Step(_) = stop(run(&mut debugger, &["step line"])).why {
        lines.push(line(&mut debugger).unwrap());
    }
    // As often as this model's loops run: the lines of the block, then what comes behind them.
    assert_eq!(lines[..6], [1, 2, 3, 1, 2, 3], "{lines:?}");
    assert_eq!(lines.last(), Some(&4), "{lines:?}");
    let mut back = Vec::new();
    while let Reason::Step(_) = stop(run(&mut debugger, &["back line"])).why {
        let Some(line) = line(&mut debugger) else { break };
        back.push(line);
    }
    back.reverse();
    // The last one was the present.
    assert!(lines.starts_with(&back) || lines[..lines.len() - 1] == back[..], "{back:?}");

    // The rounds of the loop.
    run(&mut debugger, &["goto start", "next line 3"]);
    let left = |debugger: &mut Debugger| {
        debugger.frames().into_iter().find_map(|frame| match frame.kind {
            FrameKind::Loop { left } => Some(left),
            _ => None,
        })
    };
    let first = left(&mut debugger).unwrap();
    run(&mut debugger, &["step loop"]);
    assert_eq!(left(&mut debugger), first.checked_sub(1));
    run(&mut debugger, &["back loop"]);
    assert_eq!(left(&mut debugger), Some(first));
}

#[test]
fn loops_are_gone_over_and_out_of() {
    let mut debugger = looped();
    // From the line before the loop command, over all of its rounds.
    run(&mut debugger, &["step line"]);
    assert_eq!(line(&mut debugger), Some(2));
    run(&mut debugger, &["over"]);
    assert_eq!((line(&mut debugger), debugger.frames().len()), (Some(3), 2));
    run(&mut debugger, &["over"]);
    assert_eq!(line(&mut debugger), Some(4));
    run(&mut debugger, &["back over"]);
    assert_eq!((line(&mut debugger), debugger.frames().len()), (Some(3), 2));
    // Out of the middle of it.
    run(&mut debugger, &["goto start", "next line 3", "step line"]);
    assert_eq!((line(&mut debugger), debugger.frames().len()), (Some(1), 3));
    run(&mut debugger, &["out"]);
    assert_eq!((line(&mut debugger), debugger.frames().len()), (Some(3), 2));
    run(&mut debugger, &["goto start", "next line 3", "step 2 lines", "back out"]);
    assert_eq!((line(&mut debugger), debugger.frames().len()), (Some(2), 2));
    // Out of the program itself.
    run(&mut debugger, &["out", "assert idle"]);
    // Breakpoints within are heeded on the way.
    run(&mut debugger, &["goto start", "next line 2", "break line 1 if x > 20"]);
    assert_eq!(stop(run(&mut debugger, &["over"])).why.to_string(), "breakpoint 1");
}

#[test]
fn a_program_is_listed_with_a_marker_and_breakpoints() {
    let mut debugger = looped();
    run(&mut debugger, &["step line", "break line 3"]);
    let listing = debugger.program().unwrap();
    let lines: Vec<_> =
        listing.lines.iter().map(|line| (line.is_present, line.breakpoint.is_some())).collect();
    assert_eq!(lines, [(false, false), (true, false), (false, true), (false, false)]);
    assert!(listing.lines[0].meaning.contains("10"), "{listing}");
    let why = run(&mut debugger, &["why motion"]).to_string();
    assert!(why.contains("line 2 of the program 05,900"), "{why}");
    assert!(why.contains("start was pressed"), "{why}");
}

#[test]
fn the_lines_of_a_file_are_stepped_and_stopped_at() {
    let text = "@01\n\n@0A100,900\n@0A100,900\n";
    let mut debugger = debugger("imc4", "bench");
    let bytes = text.replace("\n\n", "\n").replace('\n', "\r");
    debugger.give(Input::Bytes(bytes.as_bytes()));
    debugger.set_source(Some(Source::of_lines("moves.txt", text)));
    // The empty line stands for the next one.
    assert_eq!(debugger.line_trigger(2), Ok(Trigger::SourceLine(3)));
    assert!(debugger.line_trigger(5).is_err());
    run(&mut debugger, &["break line 2", "continue"]);
    assert_eq!(debugger.frames()[0].line, Some(3));
    assert_eq!(debugger.file().unwrap().lines[2].breakpoint.map(|id| id.0), Some(1));
    run(&mut debugger, &["step line"]);
    assert_eq!(debugger.frames()[0].line, Some(4));
    run(&mut debugger, &["assert x = 100", "back line", "assert x = 0", "back line"]);
    assert_eq!(debugger.frames()[0].line, Some(1));
    run(&mut debugger, &["goto line 4", "assert x = 100", "goto command 2", "assert x = 0"]);
}

#[test]
fn an_arc_shows_its_difference_register() {
    let mut debugger = debugger("imc4", "bench");
    debugger.give(Input::Bytes(b"@03\r@0y400,900,-50,100,0,-1,-1\r"));
    debugger.step(Unit::Segment, Way::Forward, Depth::Into, 1, &mut uninterrupted);
    let register = debugger.motion().unwrap().register.unwrap();
    assert_eq!((register.x, register.y, register.d), (100, 0, -50));
    run(&mut debugger, &["step step"]);
    // D is not above 0: a step in Y, and D grows by its amount.
    let register = debugger.motion().unwrap().register.unwrap();
    assert_eq!((register.x, register.y, register.d), (100, -1, -49));
}

#[test]
fn a_plotter_is_debugged_as_well() {
    let mut debugger = debugger("smcu", "bench");
    debugger.give(Input::Bytes(b"!CM1;PU;PA1000,1000;PD;PR5,5;PA;"));
    run(&mut debugger, &["continue", "assert x = 1005", "last x = 700", "assert y = 700"]);
    let why = run(&mut debugger, &["why motion"]).to_string();
    assert!(why.contains("PA1000,1000") && why.contains("came over the line"), "{why}");
    assert!(why.lines().last().unwrap().contains("PA1000,1000"), "{why}");
    run(&mut debugger, &["step 2 commands", "back 2 commands", "step 10 steps", "back 10 steps"]);
    let before = debugger.place();
    run(&mut debugger, &["what if quirk init_echo = on"]);
    assert_eq!(debugger.place(), before);
    assert_eq!(debugger.history().branches().count(), 2);
}

#[test]
fn whoever_gives_up_is_heard_soon_and_is_where_the_search_began() {
    let mut debugger = debugger("imc4", "bench");
    // An endless program.
    debugger.give(Input::Bytes(b"@01\r@0i\r01,900\r30,-1\r9\r"));
    run(&mut debugger, &["continue", "press start"]);
    let mut asked = 0;
    let mut soon = |_| {
        asked += 1;
        if asked > 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let stop = debugger.go(Way::Forward, None, &mut soon);
    assert_eq!(stop.why, Reason::Cancelled);
    let here = debugger.place();
    let mut at_once = |_| ControlFlow::Break(());
    let condition = read_condition("signal stop is 1", debugger.names()).unwrap();
    let stop = debugger.seek(&condition, Way::Back, &mut at_once);
    assert_eq!((stop.why, debugger.place()), (Reason::Cancelled, here));
    for line in ["who y", "trace y = 5", "what if machine mill", "goto command 99"] {
        let error = debugger.execute(line, &mut at_once).unwrap_err();
        assert_eq!(error.to_string(), "cancelled", "{line}");
        assert_eq!(debugger.place(), here, "{line}");
    }
    // So many acts are between two questions that it is far less than 50 ms.
    let mut times = 0_u64;
    let acts = debugger.history().present().moment.causes;
    let mut count = |_| {
        times += 1;
        ControlFlow::Continue(())
    };
    let stop = debugger.seek(&condition, Way::Back, &mut count);
    assert_eq!(stop.why, Reason::Nowhere);
    assert!(times * 4_096 + 4_096 >= acts.min(8_192), "{times} for {acts}");
}
