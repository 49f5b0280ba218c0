//! A host that asks and waits: where one stops for it, both ways.

#![expect(clippy::panic, clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod drive;

use std::time::Duration;

use vimc4_debug::{
    Answer, BreakpointId, Debugger, Depth, Feed, Piece, Reason, Source, Trigger, Unit, Way,
    uninterrupted,
};

use vimc4_device::Device;
use vimc4_language::read_condition;

use drive::{debugger, run, stop};

const TEXT: &str = "ways\n@07\nHALT\nTOOL\nHERE\n@0A500,900,0,900,0,900,0,900\nEND\nLAST\n";

/// A host that asks in lines 3, 4 and 5 and again in lines 7 and 8, with a motion between.
fn asking() -> Debugger {
    let ask = |what: &str| Piece::Ask(what.to_owned());
    let send = |what: &str| Piece::Send(format!("{what}\r").into_bytes());
    let pieces = vec![
        send("@07"),
        ask("3"),
        ask("4"),
        ask("5"),
        send("@0A500,900,0,900,0,900,0,900"),
        ask("7"),
        ask("8"),
    ];
    let source = Source { of_command: vec![2, 6], ..Source::of_lines("asks", TEXT) };
    let feed = Feed::new(pieces).of_lines(vec![2, 3, 4, 5, 6, 7, 8]);
    debugger("imc4", "bench").with_source(source).with_feed(feed)
}

/// Where it stands: what it waits for, or the line of the command.
fn here(debugger: &mut Debugger) -> String {
    let frames = debugger.frames();
    let line = frames[0].line.map_or_else(|| "-".to_owned(), |line| line.to_string());
    let listed =
        debugger.file().unwrap().lines.iter().find(|line| line.is_present).map(|it| it.number);
    let marked = listed.map_or_else(|| "-".to_owned(), |line| line.to_string());
    // The listing and the frames agree wherever anything is under way.
    assert!(line == "-" || line == marked, "{line} {marked}");
    match debugger.waits() {
        Some(what) => {
            let what = what.split(';').next().unwrap();
            assert_eq!(what, line, "the frame is of the line that waits");
            format!("waits {what}")
        }
        None => line,
    }
}

fn go(debugger: &mut Debugger, way: Way) -> (Reason, String) {
    let stop = debugger.go(way, None, &mut uninterrupted);
    (stop.why, here(debugger))
}

#[test]
fn each_of_several_waits_stops_a_walk_forward_and_back() {
    let mut debugger = asking();
    let waits = |what: &str| (Reason::Waits(what.to_owned()), format!("waits {what}"));
    for round in 0..3 {
        for what in ["3", "4", "5", "7", "8"] {
            assert_eq!(go(&mut debugger, Way::Forward), waits(what), "round {round}");
        }
        // Behind the last there is nothing, and nobody waits any longer.
        for _ in 0..2 {
            let (why, at) = go(&mut debugger, Way::Forward);
            assert_eq!((why, at.contains("waits")), (Reason::Rest, false), "round {round}");
        }
        for what in ["8", "7", "5", "4", "3"] {
            assert_eq!(go(&mut debugger, Way::Back), waits(what), "round {round}");
        }
        assert_eq!(go(&mut debugger, Way::Back).0, Reason::Beginning);
    }
}

#[test]
fn steps_back_undo_steps_over_waits() {
    let mut debugger = asking();
    let mut step = |way| {
        debugger.step(Unit::Line, way, Depth::Into, 1, &mut uninterrupted);
        (here(&mut debugger), debugger.digest())
    };
    let there: Vec<_> = (0..7).map(|_| step(Way::Forward)).collect();
    let lines: Vec<&str> = there.iter().map(|(at, _)| at.as_str()).collect();
    assert_eq!(lines, ["2", "waits 3", "waits 4", "waits 5", "6", "waits 7", "waits 8"]);
    let back: Vec<_> = (0..6).map(|_| step(Way::Back)).collect();
    assert_eq!(back, there.iter().rev().skip(1).cloned().collect::<Vec<_>>());
    let again: Vec<_> = (0..6).map(|_| step(Way::Forward)).collect();
    assert_eq!(again, there[1..]);
}

#[test]
fn many_steps_are_as_many_single_ones_and_back_leads_where_they_began() {
    let step = |debugger: &mut Debugger, unit, way, count| {
        let stop = debugger.step(unit, way, Depth::Into, count, &mut uninterrupted);
        (stop.why, here(debugger), debugger.digest())
    };
    let mut singly = asking();
    let there: Vec<_> = (0..7).map(|_| step(&mut singly, Unit::Line, Way::Forward, 1)).collect();
    // Both where the host has asked before and where it asks for the first time.
    for debugger in [&mut asking(), &mut singly] {
        run(debugger, &["goto start"]);
        let mut at = 0;
        for count in [2, 3, 2] {
            at += count;
            let (_, line, state) = step(debugger, Unit::Line, Way::Forward, count as u64);
            assert_eq!((&line, &state), (&there[at - 1].1, &there[at - 1].2));
        }
        for count in [2, 3, 1] {
            at -= count;
            let (_, line, state) = step(debugger, Unit::Line, Way::Back, count as u64);
            assert_eq!((&line, &state), (&there[at - 1].1, &there[at - 1].2));
        }
    }
}

#[test]
fn a_wait_is_a_line_and_no_step_of_another_unit() {
    for unit in [Unit::Command, Unit::Byte, Unit::Event, Unit::Segment, Unit::Step, Unit::Cause] {
        let mut debugger = asking();
        // As if there were no waits: the states of a host that asks nobody.
        let send = |what: &str| Piece::Send(format!("{what}\r").into_bytes());
        let feed = Feed::new(vec![send("@07"), send("@0A500,900,0,900,0,900,0,900")]);
        let mut plain = drive::debugger("imc4", "bench").with_feed(feed);
        for (way, count) in
            [(Way::Forward, 2), (Way::Forward, 1), (Way::Back, 2), (Way::Forward, 2)]
        {
            let [asked, never] = [&mut debugger, &mut plain].map(|own| {
                let stop = own.step(unit, way, Depth::Into, count, &mut uninterrupted);
                (stop.why, own.now(), own.digest())
            });
            assert_eq!(asked, never, "{unit:?} {way:?} {count}");
        }
    }
}

#[test]
fn who_comes_to_a_wait_otherwise_finds_it_and_a_search_that_fails_leaves_it() {
    let mut debugger = asking();
    for _ in 0..2 {
        go(&mut debugger, Way::Forward);
    }
    run(&mut debugger, &["mark there"]);
    assert!(stop(run(&mut debugger, &["next x = 77777"])).why == Reason::Nowhere);
    assert_eq!(here(&mut debugger), "waits 4");
    assert!(stop(run(&mut debugger, &["last x = 77777"])).why == Reason::Nowhere);
    assert_eq!(here(&mut debugger), "waits 4");
    // What is done there by hand makes nobody go on.
    run(&mut debugger, &["press stop"]);
    assert_eq!(here(&mut debugger), "waits 4");
    assert_eq!(go(&mut debugger, Way::Forward).1, "waits 5");
    run(&mut debugger, &["continue", "continue", "continue", "goto there"]);
    assert_eq!(here(&mut debugger), "waits 4", "the last that was asked there before");
    // On a branch it has asked as much, and asks on.
    run(&mut debugger, &["goto start", "continue", "continue", "hold stop"]);
    assert_eq!(here(&mut debugger), "waits 4");
    assert_eq!(go(&mut debugger, Way::Forward).1, "waits 5");
}

#[test]
fn who_waits_for_nobody_comes_to_the_end_and_everybody_else_is_asked_there() {
    let mut debugger = asking();
    let mut waits = Vec::new();
    // One more turn than there are waits would be one that is asked again.
    for _ in 0..=5 {
        go(&mut debugger, Way::Forward);
        waits.extend(debugger.waits());
        debugger.answer();
    }
    assert_eq!(waits, ["3", "4", "5", "7", "8"]);
    run(&mut debugger, &["goto start"]);
    for what in ["3", "4", "5", "7", "8"] {
        assert_eq!(go(&mut debugger, Way::Forward).1, format!("waits {what}"));
    }
}

#[test]
fn a_line_is_found_beyond_waits_and_the_wait_says_what_holds_up() {
    let mut debugger = asking();
    go(&mut debugger, Way::Forward);
    let early = debugger.execute("goto line 6", &mut uninterrupted).unwrap_err().to_string();
    assert!(early.starts_with("before line 6, "), "{early}");
    assert_eq!(here(&mut debugger), "waits 3");
    run(&mut debugger, &["continue", "continue", "continue", "continue"]);
    let trigger = debugger.line_trigger(2).unwrap();
    let back = debugger.find(trigger.clone(), Way::Back, &mut uninterrupted);
    assert_eq!((back.why, here(&mut debugger)), (Reason::Gone, "2".to_owned()));
    let trigger = debugger.line_trigger(6).unwrap();
    let ahead = debugger.find(trigger, Way::Forward, &mut uninterrupted);
    assert_eq!((ahead.why, here(&mut debugger)), (Reason::Gone, "6".to_owned()));
}

#[test]
fn a_bookmark_leads_to_the_wait_it_was_set_at() {
    let mut debugger = asking();
    go(&mut debugger, Way::Forward);
    run(&mut debugger, &["mark first", "continue", "mark second", "continue", "mark third"]);
    run(&mut debugger, &["step", "mark behind", "continue"]);
    for (name, line) in
        [("second", "waits 4"), ("first", "waits 3"), ("third", "waits 5"), ("behind", "6")]
    {
        run(&mut debugger, &[&format!("goto {name}")]);
        assert_eq!(here(&mut debugger), line, "{name}");
    }
    run(&mut debugger, &["goto first"]);
    assert_eq!(go(&mut debugger, Way::Forward).1, "waits 4", "it asks on from there");
}

#[test]
fn a_line_of_a_wait_is_one_to_go_to_and_to_stop_at() {
    let mut debugger = asking();
    assert_eq!(debugger.line_trigger(1), Ok(Trigger::SourceLine(2)));
    for line in [3, 4, 5, 6, 7, 8] {
        assert_eq!(debugger.line_trigger(line), Ok(Trigger::SourceLine(line)));
    }
    // Not before it has asked what comes before.
    let early = debugger.execute("goto line 4", &mut uninterrupted).unwrap_err().to_string();
    assert_eq!(early, "before line 4, 3");
    let Answer::Stopped(stop, _) = run(&mut debugger, &["goto line 3"]) else { panic!() };
    assert_eq!(stop.met, [], "no breakpoint is there");
    assert_eq!(here(&mut debugger), "waits 3");
    for _ in 0..5 {
        go(&mut debugger, Way::Forward);
    }
    for line in ["4", "8", "3", "5", "5", "7"] {
        run(&mut debugger, &[&format!("goto line {line}")]);
        assert_eq!(here(&mut debugger), format!("waits {line}"));
    }
    run(&mut debugger, &["goto start", "break line 4", "break line 7 if x > 99999"]);
    let mut met = Vec::new();
    for _ in 0..5 {
        let stop = debugger.go(Way::Forward, None, &mut uninterrupted);
        met.push((here(&mut debugger), stop.met.len()));
    }
    let met: Vec<_> = met.iter().map(|(at, met)| (at.as_str(), *met)).collect();
    assert_eq!(met[..2], [("waits 3", 0), ("waits 4", 1)]);
    assert_eq!(met[2..], [("waits 5", 0), ("waits 7", 0), ("waits 8", 0)]);
    let trigger = debugger.line_trigger(4).unwrap();
    let back = debugger.find(trigger, Way::Back, &mut uninterrupted);
    assert_eq!((back.why, here(&mut debugger)), (Reason::Gone, "waits 4".to_owned()));
}

#[test]
fn an_error_reply_is_why_the_rest_is_not_sent() {
    let text = "@07\n@0A1,2\n@0R7\n";
    let pieces = text.lines().map(|line| Piece::Send(format!("{line}\r").into_bytes())).collect();
    let feed = Feed::new(pieces).until_error();
    let source = Source::of_lines("list", text);
    let mut debugger = debugger("imc4", "bench").with_source(source).with_feed(feed);
    for _ in 0..2 {
        let stop = debugger.go(Way::Forward, None, &mut uninterrupted);
        assert!(matches!(stop.why, Reason::Refused(_)), "{stop}");
        let said = stop.to_string();
        assert!(said.contains("line 2: @0A1,2 was answered "), "{said}");
        assert!(said.contains("; the rest was not sent"), "{said}");
    }
    let said = debugger.execute("goto line 3", &mut uninterrupted).unwrap_err().to_string();
    assert!(said.starts_with("line 3 was not sent here: line 2: @0A1,2 "), "{said}");
}

/// How often each breakpoint was hit on the way to the present.
fn counts(debugger: &mut Debugger) -> Vec<u64> {
    let counted = debugger.execute("breakpoints", &mut uninterrupted).unwrap();
    let Answer::Breakpoints(list) = counted else { panic!("{counted:?}") };
    list.iter().map(|(own, _)| own.count).collect()
}

#[test]
fn what_the_host_asks_is_counted_at_its_line_wherever_one_comes_from() {
    let mut debugger = asking();
    run(
        &mut debugger,
        &["break line 3", "break line 4", "break line 7", "break line 8 if x > 100"],
    );
    run(&mut debugger, &["break line 4 if x > 100", "break line 6", "goto end"]);
    // It has come to the first of three questions at one moment.
    assert_eq!(counts(&mut debugger), [1, 0, 0, 0, 0, 0]);
    let there = [
        [1, 1, 0, 0, 0, 0],
        [1, 1, 0, 0, 0, 0],
        [1, 1, 0, 0, 0, 1],
        [1, 1, 1, 0, 0, 1],
        [1, 1, 1, 1, 0, 1],
        [1, 1, 1, 1, 0, 1],
    ];
    for round in 0..2 {
        for counted in there {
            debugger.go(Way::Forward, None, &mut uninterrupted);
            assert_eq!(counts(&mut debugger), counted, "round {round}");
        }
        // Back again, to where it is before everything.
        for counted in there.iter().rev().skip(1) {
            debugger.go(Way::Back, None, &mut uninterrupted);
            assert_eq!(counts(&mut debugger), *counted, "round {round}");
        }
        debugger.go(Way::Back, None, &mut uninterrupted);
        assert_eq!(counts(&mut debugger), [1, 0, 0, 0, 0, 0]);
    }
    run(&mut debugger, &["goto start"]);
    assert_eq!(counts(&mut debugger), [0; 6]);
    run(&mut debugger, &["goto end"]);
    assert_eq!(counts(&mut debugger), [1, 1, 1, 1, 0, 1]);
}

#[test]
fn breakpoints_at_what_the_host_asks_log_and_heed_which_hit_it_is() {
    let noted = |stop: &vimc4_debug::Stop| -> Vec<String> {
        stop.notes.iter().map(|note| format!("{}: {}", note.by, note.text)).collect()
    };
    let mut debugger = asking();
    run(
        &mut debugger,
        &[
            "break line 3 log three {x}",
            "break line 5 if x > 100 log never",
            "break line 7 from 1 log seven {x}",
            "break line 8 hit 2 log never",
            "break line 8 hit 1",
            "break line 4 hit 2",
        ],
    );
    for round in 0..2 {
        let mut all = Vec::new();
        let mut met = Vec::new();
        for _ in 0..5 {
            let stop = debugger.go(Way::Forward, None, &mut uninterrupted);
            assert!(matches!(stop.why, Reason::Waits(_)), "{stop:?}");
            all.push(noted(&stop));
            met.push(stop.met.iter().map(|id| id.0).collect::<Vec<_>>());
        }
        assert_eq!(
            all,
            [vec!["1: three 0"], vec![], vec![], vec!["3: seven 500"], vec![]],
            "round {round}"
        );
        assert_eq!(met, [vec![], vec![], vec![], vec![], vec![5]], "round {round}");
        for _ in 0..2 {
            // Nothing is noted on the way back.
            let stop = debugger.go(Way::Back, None, &mut uninterrupted);
            assert_eq!(noted(&stop), Vec::<String>::new());
        }
        run(&mut debugger, &["goto start"]);
    }
    // Steps over pass them, too.
    let stop = debugger.step(Unit::Line, Way::Forward, Depth::Over, 6, &mut uninterrupted);
    assert_eq!(noted(&stop), ["1: three 0", "3: seven 500"]);
    // From wherever it is, all of what is known is traced.
    run(&mut debugger, &["goto end", "goto start"]);
    for (line, texts) in [
        ("trace line 7 log at {x}", &["0: at 500"][..]),
        ("trace line 3 log at {x}", &["0: at 0"]),
        ("trace line 6 log at {x}", &["0: at 0"]),
        ("trace line 7 if x > 600", &[]),
        ("trace line 7 hit 2", &[]),
    ] {
        let before = debugger.place();
        let traced = debugger.execute(line, &mut uninterrupted).unwrap();
        let Answer::Notes(notes, false) = traced else { panic!("{traced:?}") };
        let found: Vec<_> = notes.iter().map(|it| format!("{}: {}", it.by, it.text)).collect();
        assert_eq!(found, texts, "{line}");
        assert_eq!(debugger.place(), before);
    }
}

/// A host that waits for a time in lines 3 and 6, and in line 4 for what is so already.
fn waiting() -> Debugger {
    let send = |what: &str| Piece::Send(format!("{what}\r").into_bytes());
    let debugger = debugger("imc4", "bench");
    let is_so = read_condition("y < 10", debugger.names()).unwrap();
    let pieces = vec![
        send("@07"),
        Piece::Wait(Duration::from_millis(300)),
        Piece::Until(is_so, "4".to_owned()),
        send("@0A500,900,0,900,0,900,0,900"),
        Piece::Wait(Duration::from_millis(200)),
        send("@0P"),
    ];
    let text = "ways\n@07\nWAIT\nWAITBIT\n@0A500,900,0,900,0,900,0,900\nWAIT\n@0P\n";
    let source = Source { of_command: vec![2, 5, 7], ..Source::of_lines("waits", text) };
    let feed = Feed::new(pieces).of_lines(vec![2, 3, 4, 5, 6, 7]);
    debugger.with_source(source).with_feed(feed)
}

#[test]
fn a_line_at_which_the_host_waits_takes_breakpoints_and_stops_no_other_walk() {
    let mut debugger = waiting();
    assert_eq!(go(&mut debugger, Way::Forward).0, Reason::Rest);
    let (end, digest) = (debugger.now(), debugger.digest());
    assert_eq!(go(&mut debugger, Way::Back).0, Reason::Beginning);
    run(&mut debugger, &["break line 3", "break line 4", "break line 6"]);
    // Where it has been before, and where it comes for the first time.
    for mut debugger in [debugger, {
        let mut new = waiting();
        run(&mut new, &["break line 3", "break line 4", "break line 6"]);
        new
    }] {
        let met =
            |id: u64, line: &str| (Reason::Breakpoints(vec![BreakpointId(id)]), line.to_owned());
        let all = [met(1, "3"), met(2, "4"), met(3, "6")];
        for round in 0..3 {
            for (nth, met) in all.iter().enumerate() {
                assert_eq!(go(&mut debugger, Way::Forward), *met, "round {round}");
                let mut counted = [1; 3];
                counted[nth + 1..].fill(0);
                assert_eq!(counts(&mut debugger), counted, "round {round}");
            }
            assert_eq!(go(&mut debugger, Way::Forward).0, Reason::Rest, "round {round}");
            assert_eq!((debugger.now(), debugger.digest()), (end, digest), "round {round}");
            for met in all.iter().rev() {
                assert_eq!(go(&mut debugger, Way::Back), *met, "round {round}");
            }
            assert_eq!(go(&mut debugger, Way::Back).0, Reason::Beginning, "round {round}");
        }
        // The first wait begins when the answer is there, and the time of the second is still to come.
        for (line, waited) in [("goto line 3", 300), ("goto line 6", 200)] {
            run(&mut debugger, &["delete all", line]);
            let from = debugger.now();
            assert!(debugger.device().is_idle() && debugger.waits().is_none(), "{line}");
            run(&mut debugger, &["step command"]);
            assert!(debugger.now().nanos_since(from) >= waited * 1_000_000, "{line}");
        }
    }
}

#[test]
fn a_step_of_a_line_leads_to_where_the_host_waits() {
    let mut debugger = waiting();
    let mut step = |way| {
        debugger.step(Unit::Line, way, Depth::Into, 1, &mut uninterrupted);
        (here(&mut debugger), debugger.digest())
    };
    let there: Vec<_> = (0..6).map(|_| step(Way::Forward)).collect();
    let lines: Vec<&str> = there.iter().map(|(at, _)| at.as_str()).collect();
    assert_eq!(lines, ["2", "3", "4", "5", "6", "7"]);
    let back: Vec<_> = (0..5).map(|_| step(Way::Back)).collect();
    assert_eq!(back, there.iter().rev().skip(1).cloned().collect::<Vec<_>>());
    let again: Vec<_> = (0..5).map(|_| step(Way::Forward)).collect();
    assert_eq!(again, there[1..]);
}

#[test]
fn what_logs_where_the_host_waits_stops_nothing() {
    let mut debugger = waiting();
    run(
        &mut debugger,
        &["break line 3 log three {x}", "break line 6 log six {x}", "break line 4 hit 2"],
    );
    for _ in 0..2 {
        let stop = debugger.go(Way::Forward, None, &mut uninterrupted);
        let notes: Vec<&str> = stop.notes.iter().map(|note| note.text.as_str()).collect();
        assert_eq!((stop.why, &notes[..]), (Reason::Rest, &["three 0", "six 500"][..]));
        run(&mut debugger, &["goto start"]);
    }
    let traced = debugger.execute("trace line 6 log at {x}", &mut uninterrupted).unwrap();
    assert!(traced.to_string().ends_with("  at 500"), "{traced}");
}

/// A host that waits in line 4 for an input, with a motion before and one behind.
fn held_up() -> Debugger {
    let send = |what: &str| Piece::Send(format!("{what}\r").into_bytes());
    let debugger = debugger("imc4", "bench");
    let is_so = read_condition("port 0 bit 3 on", debugger.names()).unwrap();
    let pieces = vec![
        send("@07"),
        send("@0A500,900,0,900,0,900,0,900"),
        Piece::Until(is_so, "4".to_owned()),
        send("@0A-500,900,0,900,0,900,0,900"),
    ];
    let text = "ways\n@07\n@0A500,900,0,900,0,900,0,900\nWAITBIT\n@0A-500,900,0,900,0,900,0,900\n";
    let source = Source { of_command: vec![2, 3, 5], ..Source::of_lines("waits", text) };
    let feed = Feed::new(pieces).of_lines(vec![2, 3, 4, 5]);
    debugger.with_source(source).with_feed(feed)
}

const HELD_UP: &str = "4; it is 0, and `input 0.3 1` changes that";

#[test]
fn a_condition_that_is_not_so_holds_the_host_up_until_somebody_changes_that() {
    let mut debugger = held_up();
    let waits = || Reason::Waits(HELD_UP.to_owned());
    for branch in ["main", "branch 1"] {
        for _ in 0..2 {
            assert_eq!(debugger.go(Way::Forward, None, &mut uninterrupted).why, waits());
        }
        let line = debugger.step(Unit::Line, Way::Forward, Depth::Into, 1, &mut uninterrupted);
        assert_eq!(line.why, waits());
        let late = stop(run(&mut debugger, &["continue 2s"]));
        assert_eq!((late.why, debugger.frames()[0].line), (Reason::Time, Some(4)));
        assert_eq!(stop(run(&mut debugger, &["goto end"])).why, waits());
        let beyond = debugger.execute("goto line 5", &mut uninterrupted).unwrap_err();
        assert_eq!(beyond.to_string(), format!("before line 5, {HELD_UP}"));
        run(&mut debugger, &["input 0.3 1"]);
        assert_eq!(go(&mut debugger, Way::Forward).0, Reason::Rest);
        assert_eq!(debugger.evaluate("x").unwrap(), 0);
        let here = debugger.place().branch;
        let named = debugger.history().branches().find(|own| own.id == here).unwrap().name;
        assert_eq!(named, branch);
        // Back to where it waited, and once more otherwise.
        run(&mut debugger, &["goto 100ms", "hold start", "release start"]);
    }
}

#[test]
fn what_a_rule_changes_while_the_host_waits_lets_it_go_on_just_then() {
    // By every way of going on; the level lasts for a moment only.
    for line in [
        "continue",
        "goto end",
        "step 3 commands",
        "goto line 5",
        "next x < 500",
        "goto 20s",
        "step 20s",
        "advance 20s",
    ] {
        // Where the wait is still to come, where it is known, and where it has lasted.
        for before in
            [&["goto start"][..], &["continue", "goto start"], &["continue", "continue 1s"]]
        {
            let mut debugger = held_up();
            run(&mut debugger, before);
            let typed = debugger.now().as_nanos();
            run(&mut debugger, &["at 8s: input 0.3 1", "at 8001ms: input 0.3 0"]);
            if !before.contains(&"continue 1s") {
                run(&mut debugger, &["continue 1s", "goto start"]);
            }
            run(&mut debugger, &[line, "goto command 3"]);
            let after = debugger.now().as_nanos() - typed;
            assert!((8_000_000_000..8_001_000_000).contains(&after), "{line} {before:?}: {after}");
        }
    }
}

#[test]
fn a_breakpoint_where_a_condition_holds_the_host_up_is_met_there_once() {
    let mut debugger = held_up();
    run(&mut debugger, &["break line 4"]);
    for _ in 0..2 {
        let stop = debugger.go(Way::Forward, None, &mut uninterrupted);
        assert_eq!(stop.why, Reason::Waits(HELD_UP.to_owned()));
        assert_eq!(stop.met, [BreakpointId(1)]);
    }
    assert_eq!(counts(&mut debugger), [1]);
    run(&mut debugger, &["input 0.3 1", "continue"]);
    assert_eq!(counts(&mut debugger), [1]);
    // Where it is known to be so later nothing is waited for without a breakpoint.
    assert!(matches!(go(&mut debugger, Way::Back).0, Reason::Waits(_)));
    run(&mut debugger, &["delete all", "goto start"]);
    assert_eq!(go(&mut debugger, Way::Forward).0, Reason::Rest);
}

#[test]
fn a_stop_names_the_line_of_the_file_with_its_comment_and_the_breakpoints_there() {
    let send = |what: &str| Piece::Send(format!("{what}\r").into_bytes());
    let pieces = vec![send("@07"), Piece::Ask("line 3: HALT".to_owned()), send("@0A9,900,9,900")];
    let text = "AXES\n\n  HALT ; turn it over\nMOVEREL X9 Y9\n";
    let source = Source { of_command: vec![1, 4], ..Source::of_lines("jobs/turn.ncp", text) };
    let feed = Feed::new(pieces).of_lines(vec![1, 3, 4]);
    let mut debugger = debugger("imc4", "bench").with_source(source).with_feed(feed);
    let halts = "0ms  breakpoint 1, line 3: HALT\n    turn.ncp, line 3: HALT ; turn it over";
    run(&mut debugger, &["break line 3"]);
    for walk in [&["continue"][..], &["continue", "reverse"], &["goto start", "step 2 lines"]] {
        let told = run(&mut debugger, walk).to_string();
        assert!(told.starts_with(halts), "{walk:?}: {told}");
    }
    let told = run(&mut debugger, &["where"]).to_string();
    assert!(
        told.contains("\n    line 3: HALT\n    turn.ncp, line 3: HALT ; turn it over\n"),
        "{told}"
    );
    let told = run(&mut debugger, &["step command", "where"]).to_string();
    assert!(told.contains("  #2 @0A9,900,9,900\n    turn.ncp, line 4: MOVEREL X9 Y9\n"), "{told}");
}

#[test]
fn what_goes_wrong_behind_a_question_is_not_told_at_it() {
    let send = |what: &str| Piece::Send(format!("{what}\r").into_bytes());
    let pieces = vec![send("@07"), Piece::Ask("3".to_owned()), send("@0Q")];
    let source = Source { of_command: vec![2, 4], ..Source::of_lines("asks", TEXT) };
    let feed = Feed::new(pieces).of_lines(vec![2, 3, 4]);
    let mut debugger = debugger("imc4", "bench").with_source(source).with_feed(feed);
    let mut told = |lines: &[&str]| run(&mut debugger, lines).to_string();
    let first = told(&["continue"]);
    assert!(!first.contains("no command begins like this"), "{first}");
    let refused = told(&["continue"]);
    assert!(refused.contains("no command begins like this"), "{refused}");
    // The same again, now that it is known what comes.
    let again = told(&["goto start", "continue"]);
    assert!(!again.contains("no command begins like this"), "{again}");
}

#[test]
fn only_breakpoints_that_people_make_have_numbers() {
    let mut debugger = asking();
    let mut numbers = Vec::new();
    for line in ["goto line 3", "goto line 3", "continue", "who x", "trace line 3"] {
        run(&mut debugger, &[line]);
        let Answer::Breakpoint(id, _) = run(&mut debugger, &["break line 4"]) else { panic!() };
        numbers.push(id.0);
    }
    assert_eq!(numbers, [1, 2, 3, 4, 5]);
    assert_eq!(counts(&mut debugger).len(), 5);
}

#[test]
fn what_the_host_would_have_done_in_a_search_for_nothing_is_not_done() {
    for search in ["next x = 9999", "goto command 99", "goto line 99"] {
        let mut debugger = asking();
        let _ = debugger.execute(search, &mut uninterrupted);
        let at_end = debugger.history().is_at_end();
        assert!(at_end && debugger.place().moment.inputs == 0, "{search}");
        // It asks as if nothing had been, and what is done by hand begins no branch.
        run(&mut debugger, &["send @01"]);
        assert_eq!(debugger.history().branches().count(), 1, "{search}");
        let same = |own: &mut Debugger| {
            let mut places = Vec::new();
            for _ in 0..6 {
                let stop = own.go(Way::Forward, None, &mut uninterrupted);
                places.push((stop.why, stop.place));
            }
            places
        };
        let mut other = asking();
        run(&mut other, &["send @01"]);
        assert_eq!(same(&mut debugger), same(&mut other), "{search}");
    }
}
