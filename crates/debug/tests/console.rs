//! Lines as people type them, and what is answered.

#![expect(clippy::panic, clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod drive;

use vimc4_debug::{DebugError, Debugger, Reason, Remedy, Way, uninterrupted};
use vimc4_device::{Device, Input, Time};

use drive::{debugger, run, stop};

fn said(debugger: &mut Debugger, line: &str) -> String {
    run(debugger, &[line]).to_string()
}

fn wrong(debugger: &mut Debugger, line: &str) -> DebugError {
    match debugger.execute(line, &mut uninterrupted) {
        Ok(answer) => panic!("`{line}` is carried out: {answer:?}"),
        Err(error) => error,
    }
}

/// An IMC4 that has moved X to 1,000 and back to 0.
fn moved() -> Debugger {
    let mut debugger = debugger("imc4", "bench");
    debugger.give(Input::Bytes(b"@01\r@0A1000,1000\r@0A-1000,1000\r"));
    run(&mut debugger, &["continue", "assert idle", "assert x = 0"]);
    debugger
}

#[test]
fn a_walk_forward_and_back_by_commands_and_steps() {
    let mut debugger = moved();
    let there = stop(run(&mut debugger, &["goto start", "step 2 commands"]));
    assert_eq!(there.why, Reason::Step(vimc4_debug::Unit::Command));
    assert_eq!(
        there.command.as_ref().map(|command| command.line.as_slice()),
        Some(&b"@0A1000,1000"[..])
    );
    run(
        &mut debugger,
        &["assert x = 0", "step 3 steps", "assert x = 3", "back step", "assert x = 2"],
    );
    run(&mut debugger, &["step command", "assert x = 1000", "back 1000 steps", "assert x = 1"]);
    // The last of these steps is the end of the motion.
    run(&mut debugger, &["step 999 steps", "assert x = 1000"]);
    run(&mut debugger, &["goto end", "reverse", "assert x = 0"]);
    assert_eq!(debugger.now().as_nanos(), 0);
}

#[test]
fn what_was_so_is_found_at_its_instant() {
    let mut debugger = moved();
    run(&mut debugger, &["last x = 400", "assert x = 400", "assert x.speed < 0"]);
    run(&mut debugger, &["last x = 400", "assert x = 400", "assert x.speed > 0"]);
    let nowhere = stop(run(&mut debugger, &["last x = 400"]));
    assert_eq!(nowhere.why, Reason::Nowhere);
    run(&mut debugger, &["assert x = 400", "next x > 999", "assert x = 1000"]);
    run(&mut debugger, &["next command @A", "assert x = 1000"]);
    run(&mut debugger, &["next x < 1", "assert x = 0"]);
    // What was only looked for has not happened.
    let end = debugger.place();
    assert_eq!(stop(run(&mut debugger, &["next x < -5"])).why, Reason::Nowhere);
    assert_eq!(debugger.place(), end);
}

#[test]
fn breakpoints_stop_both_ways() {
    let mut debugger = moved();
    assert_eq!(
        said(&mut debugger, "break x > 500 if x.speed > 0"),
        "breakpoint 1: x > 500 if x.speed > 0"
    );
    run(&mut debugger, &["break command @A hit 2", "goto start"]);
    assert_eq!(stop(run(&mut debugger, &["continue"])).why.to_string(), "breakpoint 1");
    run(&mut debugger, &["assert x = 501"]);
    assert_eq!(stop(run(&mut debugger, &["continue"])).why.to_string(), "breakpoint 2");
    assert_eq!(stop(run(&mut debugger, &["continue"])).why, Reason::Rest);
    assert_eq!(stop(run(&mut debugger, &["reverse"])).why.to_string(), "breakpoint 2");
    run(&mut debugger, &["disable 2"]);
    assert_eq!(stop(run(&mut debugger, &["reverse"])).why.to_string(), "breakpoint 1");
    run(&mut debugger, &["assert x = 501"]);
    assert_eq!(stop(run(&mut debugger, &["reverse"])).why, Reason::Beginning);
    let list = said(&mut debugger, "breakpoints");
    assert!(list.contains("(disabled)") && list.contains("x > 500"), "{list}");
    run(&mut debugger, &["delete all"]);
    assert_eq!(said(&mut debugger, "breakpoints"), "there are no breakpoints");
}

#[test]
fn hits_are_counted_at_the_same_places_both_ways() {
    for (hits, wanted) in [
        ("hit 5", &[5][..]),
        ("from 8", &[8, 9, 10]),
        ("every 3", &[3, 6, 9]),
        ("if x > 0 hit 2", &[3]),
    ] {
        let mut debugger = debugger("imc4", "bench");
        debugger.give(Input::Bytes(b"@01\r"));
        for _ in 0..10 {
            debugger.give(Input::Bytes(b"@0A100,1000\r"));
        }
        run(&mut debugger, &["continue", "assert x = 1000", "goto start"]);
        run(&mut debugger, &[&format!("break command @A {hits}")]);
        let walk = |line: &str, debugger: &mut Debugger| {
            let mut places = Vec::new();
            while let Reason::Breakpoints(_) = stop(run(debugger, &[line])).why {
                places.push(debugger.evaluate("x").unwrap().as_i64().unwrap() / 100 + 1);
            }
            places
        };
        assert_eq!(walk("continue", &mut debugger), wanted, "{hits}");
        let back: Vec<i64> = wanted.iter().rev().copied().collect();
        assert_eq!(walk("reverse", &mut debugger), back, "{hits}");
        // As often as one goes there, by whatever way.
        assert_eq!(walk("continue", &mut debugger), wanted, "{hits}");
        run(&mut debugger, &["goto end", "goto +1s"]);
        assert_eq!(walk("reverse", &mut debugger), back, "{hits}");
        run(&mut debugger, &["next x = 650", "reverse", "next x = 650"]);
        let behind: Vec<i64> = wanted.iter().copied().filter(|place| *place > 7).collect();
        assert_eq!(walk("continue", &mut debugger), behind, "{hits}");
    }
}

#[test]
fn hits_are_counted_once_however_often_a_walk_ends_at_a_time() {
    let mut debugger = debugger("imc4", "bench");
    debugger.give(Input::Bytes(b"@01\r@0A1000,1000\r"));
    debugger.give(Input::Bytes(b"@0A-1000,1000\r"));
    run(&mut debugger, &["break x = 500 hit 2", "break x = 500 log {x}"]);
    let mut notes = Vec::new();
    let (mut met, mut until) = (Reason::Time, 0);
    while met == Reason::Time && until < 3_000 {
        until += 10;
        let at = Time::from_nanos(until * 1_000_000);
        let stop = debugger.go(Way::Forward, Some(at), &mut uninterrupted);
        notes.extend(stop.notes.iter().map(|note| note.text.clone()));
        met = stop.why;
    }
    assert_eq!(met.to_string(), "breakpoint 1");
    run(&mut debugger, &["assert x = 500", "assert x.speed < 0"]);
    assert_eq!(notes, ["500", "500"]);
}

#[test]
fn the_list_of_breakpoints_counts_hits_up_to_here() {
    let mut debugger = moved();
    run(&mut debugger, &["break command @A", "goto start"]);
    for (walk, count) in [
        ("continue", "1 time"),
        ("continue", "2 times"),
        ("reverse", "1 time"),
        ("reverse", "0 times"),
    ] {
        run(&mut debugger, &[walk]);
        let list = said(&mut debugger, "breakpoints");
        assert!(list.contains(&format!("  {count}")), "{walk}: {list}");
    }
}

#[test]
fn a_long_expression_is_refused() {
    let mut debugger = moved();
    for chain in ["1+", "1*", "1 or ", "1 and "] {
        let error = wrong(&mut debugger, &format!("print {}1", chain.repeat(60_000))).to_string();
        assert!(error.contains("it has 256 at most"), "{error}");
    }
    for deep in ["(", "-"] {
        let error = wrong(&mut debugger, &format!("print {}1", deep.repeat(60_000))).to_string();
        assert!(error.contains("within each other"), "{error}");
    }
    assert_eq!(said(&mut debugger, &format!("print {}1", "1+".repeat(256))), "257");
    wrong(&mut debugger, &format!("run until {}x = 1", "(".repeat(60_000)));
    // This one is long, and not deep.
    run(&mut debugger, &[&format!("run until {}x = 0", "x = 1 or ".repeat(60_000))]);
}

#[test]
fn a_tracepoint_notes_and_nobody_stops() {
    let mut debugger = moved();
    let traced = said(&mut debugger, "trace command @A log x is {x}, speed {x.speed / 1000000}");
    let lines: Vec<&str> = traced.lines().collect();
    assert_eq!(lines.len(), 2, "{traced}");
    assert!(lines[0].ends_with("x is 0, speed 0") || lines[0].contains("x is 0"), "{traced}");
    assert!(lines[1].contains("x is 1000"), "{traced}");
    // In the middle of a motion too.
    let traced = said(&mut debugger, "trace x = 250 log {x.position}");
    assert_eq!(traced.lines().count(), 2, "{traced}");
    run(&mut debugger, &["goto start", "break x = 250 log here"]);
    let rest = stop(run(&mut debugger, &["continue"]));
    assert_eq!((rest.why, rest.notes.len()), (Reason::Rest, 2));
}

#[test]
fn a_data_breakpoint_stops_where_a_field_changes() {
    let mut debugger = moved();
    run(&mut debugger, &["goto start", "break change activity"]);
    run(&mut debugger, &["continue", "assert activity = move", "assert x = 0"]);
    run(&mut debugger, &["delete all", "goto end"]);
    let change = said(&mut debugger, "who x");
    assert!(change.contains("x was 1 and became 0"), "{change}");
    let change = said(&mut debugger, "who changed axes.x.configured");
    assert!(change.contains("was false and became true") && change.contains("#1 @01"), "{change}");
}

#[test]
fn what_is_done_in_the_past_begins_a_branch() {
    let mut debugger = moved();
    run(&mut debugger, &["goto start", "next x = 400", "mark here", "hold stop", "continue"]);
    run(&mut debugger, &["rename stopped", "assert x < 1000"]);
    let branches = said(&mut debugger, "branches");
    assert!(branches.contains("  main") && branches.contains("* stopped"), "{branches}");
    // Back over the parting and forward again leads here again.
    let end = debugger.place();
    run(&mut debugger, &["mark there", "back 5 causes", "goto here", "goto there"]);
    assert_eq!(debugger.place(), end);
    run(&mut debugger, &["goto main", "assert x = 0", "goto here", "assert x = 400"]);
    run(&mut debugger, &["put x = 77", "assert x = 77"]);
}

#[test]
fn why_leads_back_to_a_byte_or_a_button() {
    let mut debugger = debugger("imc4", "mill");
    run(&mut debugger, &["send @07", "send @0R7", "send @0F1", "continue"]);
    run(&mut debugger, &["send @0A-5000,2000,0,21,0,21,0,21", "continue"]);
    let why = said(&mut debugger, "why error");

    assert!(why.contains("@0A-5000,2000"), "{why}");
    assert!(why.lines().last().unwrap().contains("came over the line"), "{why}");

    let mut debugger = moved();
    run(&mut debugger, &["goto start", "next x = 400", "press stop", "continue"]);
    let why = said(&mut debugger, "why stop");
    assert!(why.contains("stop was pressed"), "{why}");
}

#[test]
fn what_if_it_were_otherwise() {
    let mut debugger = moved();
    run(&mut debugger, &["goto start", "next x = 400"]);
    let parting = said(&mut debugger, "what if press stop");
    assert!(parting.contains("the futures part at"), "{parting}");
    run(&mut debugger, &["goto main", "goto start"]);
    let parting = said(&mut debugger, "what if model imc4-m");
    assert!(parting.starts_with("if imc4-m: "), "{parting}");
    assert_eq!(debugger.history().branches().count(), 3);
    let error = wrong(&mut debugger, "what if quirk nothing = 1");
    assert!(error.to_string().starts_with("there is no quirk `nothing`; there are "), "{error}");
}

#[test]
fn what_comes_of_it_without_a_word_is_told() {
    let mut debugger = moved();
    let parting = said(&mut debugger, "what if fault push x 7");
    assert!(parting.contains("nothing else is said, and the counters are the same"), "{parting}");
    assert!(parting.contains("\n    state.plant.carriage.0  is 7, was 0"), "{parting}");
    let parting = said(&mut debugger, "what if send @0V");
    assert!(parting.contains("the futures part"), "{parting}");
    let parting = said(&mut debugger, "what if quirk lost_steps = false");
    assert!(parting.contains("nothing else comes of it"), "{parting}");
}

#[test]
fn nothing_is_before_the_beginning() {
    let mut debugger = moved();
    let beginning = stop(run(&mut debugger, &["goto start"])).place;
    for line in ["goto -5s", "back 5s", "goto -0s"] {
        run(&mut debugger, &[line]);
        assert_eq!(debugger.place(), beginning, "{line}");
    }
    run(&mut debugger, &["next x = 400", "goto -10h"]);
    assert_eq!(debugger.place(), beginning);
}

/// What came out at a moment is told whichever way one comes there.
#[test]
fn a_walk_back_ends_with_what_has_come_out() {
    let mut debugger = moved();
    for unit in ["event", "command", "segment", "cause", "byte"] {
        run(&mut debugger, &["goto start"]);
        let step = format!("step {unit}");
        let ahead: Vec<_> = (0..3).map(|_| stop(run(&mut debugger, &[&step]))).collect();
        run(&mut debugger, &[&step]);
        for stop_ahead in ahead.iter().rev() {
            let back = stop(run(&mut debugger, &[&format!("back {unit}")]));
            assert_eq!(
                (back.place, back.outputs),
                (stop_ahead.place, stop_ahead.outputs.clone()),
                "{unit}"
            );
        }
    }
}

#[test]
fn the_faults_that_the_help_names_are_those_that_work_here() {
    for line in ["help", "help fault"] {
        let help = said(&mut moved(), line);
        let named: Vec<&str> =
            help.split('`').skip(1).step_by(2).filter(|told| told.starts_with("fault ")).collect();
        assert!(named.contains(&"fault cut both for 200ms"), "{help}");
        for fault in named {
            run(&mut moved(), &[fault]);
        }
    }
}

#[test]
fn what_is_wrong_is_said_and_nothing_happens() {
    let mut debugger = moved();
    let begin = debugger.place();
    for (line, error) in [
        ("stepp", "`stepp` is not a command; `step` is probably meant"),
        ("contiune", "`contiune` is not a command; `continue` is probably meant"),
        ("pres stop", "`pres` is not a command; `press` is probably meant"),
        ("nonsense", "`nonsense` is not a command; `help` lists them"),
        ("st", "`st` is not a command; there is step"),
        ("step 3 lightyears", "`lightyears` is not a unit"),
        ("goto moon", "`moon` is not a place"),
        ("break", "`break` is not finished; it is typed `break WHAT"),
        ("why not", "`why not` is not understood; it is typed `why ["),
        ("put x 5", "`put x 5` has no `=`; `put x = 5` is probably meant"),
        (
            "put it 5",
            "`put it 5` is not understood; it is typed `put FIELD = VALUE`, as in `put x = 500`",
        ),
        ("print nothing.there", "there is no `nothing`"),
        ("print axes.q", "there is no `q`: `axes` has a, x, y, z"),
        ("press cover", "`press cover` is wrong at `cover`: "),
        (
            "cover ajar",
            "`cover ajar` is wrong at `ajar`: `cover` cannot be `ajar`; it can be open or",
        ),
        ("set stop 2", "`set stop 2` is wrong at `2`: stop can be 0 or 1"),
        ("put activity = idle", "`activity` is computed"),
        ("where am I", "nothing follows `where`"),
        ("send \\q", "`\\q"),
        ("delete 9", "there is no breakpoint 9"),
        ("assert command @A", "`command @A` happens"),
    ] {
        let message = wrong(&mut debugger, line).to_string();
        assert!(message.starts_with(error), "{line}: {message}");
    }
    let failed = wrong(&mut debugger, "assert x = 5");
    assert!(failed.is_failed_assertion());
    assert!(failed.to_string().contains(": x is 0"), "{failed}");
    assert_eq!(debugger.place(), begin);
}

#[test]
fn what_an_error_names_as_its_remedy_can_be_done() {
    let mut debugger = moved();
    for line in [
        "delete 1",
        "enable 3",
        "goto n",
        "goto command 99",
        "goto line 3",
        "goto difference 3",
        "list file",
        "list program",
        "unwatch 1",
        "unmark n",
    ] {
        let message = wrong(&mut debugger, line).to_string();
        let (_, remedy) = message.split_once("; ").unwrap_or_else(|| panic!("{line}: {message}"));
        let named: Vec<&str> = remedy.split('`').skip(1).step_by(2).collect();
        let lines = named.iter().filter(|named| {
            !["command 12", "line 7", "difference 1", "start", "end"].contains(named)
        });
        for own in lines.clone() {
            let done = debugger.execute(own, &mut uninterrupted);
            assert!(done.is_ok(), "{line}: {message}: {done:?}");
        }
        assert!(lines.count() > 0, "{line}: {message}");
    }
    for line in ["continue 10000000h", "step 10000000h"] {
        let message = wrong(&mut debugger, line).to_string();
        assert!(message.contains("; it can be 5124095h at most"), "{line}: {message}");
    }
    assert!(debugger.execute("break at 5124095h", &mut uninterrupted).is_ok());
    assert!(
        wrong(&mut debugger, "continue 7").to_string().starts_with("`7` has no unit of time; ")
    );
    let delete = wrong(&mut debugger, "delete").to_string();
    assert!(delete.starts_with("`delete` is not finished; it is typed `delete "), "{delete}");
}

#[test]
fn everything_in_the_table_is_carried_out() {
    use vimc4_debug::TABLE;
    let mut names: Vec<&str> = Vec::new();
    for directive in TABLE {
        names.push(directive.name);
        names.extend(directive.short);
        let mut debugger = moved();
        run(&mut debugger, &["mark before", "watch x", "break command @A", "break x = 1"]);
        if directive.example.starts_with("goto") || directive.example.starts_with("list") {
            continue;
        }
        let done = debugger.execute(directive.example, &mut uninterrupted);
        let failed = done.as_ref().err().is_some_and(|error| !error.is_failed_assertion());
        assert!(!failed, "{}: {}", directive.example, done.unwrap_err());
        assert!(said(&mut debugger, "help press").starts_with("press BUTTON"));
        let help = said(&mut debugger, &format!("help {}", directive.name));
        assert!(help.starts_with(&directive.usage()), "{help}");
    }
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count, "a name is there twice");
}

/// The part of the manual about the commands, as the table says it.
fn manual() -> String {
    use vimc4_debug::Group;
    let mut text = String::new();
    for group in Group::ALL {
        text += &format!("### {group}\n\n");
        for directive in vimc4_debug::TABLE.iter().filter(|directive| directive.group == group) {
            let short = directive.short.map_or(String::new(), |short| format!(" (`{short}`)"));
            text += &format!("**`{}`**{short}: {}.", directive.usage(), directive.about);
            if !directive.more.is_empty() {
                text += &format!(" {}", directive.more);
            }
            text += &format!(" For example `{}`.\n\n", directive.example);
        }
    }
    text
}

#[test]
fn the_manual_has_every_command_of_the_table() {
    const MANUAL: &str = include_str!("../../../docs/console.md");
    let (_, rest) = MANUAL.split_once("<!-- commands: begin -->").unwrap();
    let (written, _) = rest.split_once("<!-- commands: end -->").unwrap();
    let words =
        |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>().join(" ");
    let manual = manual();
    assert_eq!(words(written), words(&manual), "docs/console.md should have:\n{manual}");
    // The units are those that there are.
    for (name, _, about) in vimc4_debug::Unit::NAMED {
        assert!(MANUAL.contains(&format!("| `{name}` | {about} |")), "{name}");
        assert!(vimc4_debug::Directive::named("step").unwrap().more.contains(name), "{name}");
    }
}

#[test]
fn a_line_is_completed_as_it_can_go_on() {
    let mut debugger = moved();
    run(&mut debugger, &["mark before", "break x = 1"]);
    let offered = |line: &str| -> Vec<String> {
        let completion = debugger.complete(line, line.len());
        completion.candidates.into_iter().map(|candidate| candidate.text).collect()
    };
    for (line, expected) in [
        ("conti", "continue"),
        ("step 3 seg", "segment"),
        ("print axes.x.po", "axes.x.position"),
        ("print z", "z"),
        ("who details.pro", "details.program"),
        ("goto be", "before"),
        ("delete ", "1"),
        ("press st", "stop"),
        ("cov", "cover"),
        ("cover ", "open"),
        ("next limit x", "x+"),
        ("break comm", "command"),
        ("why sw", "switch"),
        ("help bre", "break"),
    ] {
        let offered = offered(line);
        assert!(
            offered.iter().any(|text| text.trim_end() == expected) || line.ends_with(expected),
            "{line}: {offered:?}"
        );
    }
    assert!(offered("nonsense ").is_empty());
}

/// The conversations in the manual are as they are, one controller after the other.
#[test]
fn what_the_manual_shows_is_what_is_answered() {
    const MANUAL: &str = include_str!("../../../docs/console.md");
    let conversations = MANUAL.split("```text\n").skip(1);
    let mut count = 0;
    for conversation in conversations.filter_map(|rest| rest.split_once("```")) {
        let mut debugger = debugger("imc4", "mill");
        let mut shown = String::new();
        for line in conversation.0.lines().filter_map(|line| line.strip_prefix("> ")) {
            shown += &format!("> {line}\n");
            let answer = match debugger.execute(line, &mut uninterrupted) {
                Ok(answer) => answer.to_string(),
                Err(error) => error.to_string(),
            };
            for line in answer.lines() {
                shown += &format!("{line}\n");
            }
        }
        assert_eq!(shown, conversation.0, "the manual should have:\n{shown}");
        count += 1;
    }
    assert!(count > 0);
}

#[test]
fn what_is_at_the_end_of_what_is_known_belongs_to_what_comes_of_it() {
    for last in ["step", "next x = 20000", "continue 2s", "continue 5.0173624s"] {
        let mut debugger = debugger("imc4", "mill");
        run(&mut debugger, &["send @07", "continue", "send @0A60000,4000,0,900,0,900,0,900", last]);
        let parting = said(&mut debugger, "what if machine bench");
        let parts = parting.contains("part at 5.0173625s") && parting.contains("said  2");
        assert!(parts, "{last}: {parting}");
    }
}

#[test]
fn what_goes_wrong_on_the_way_is_told() {
    let mut debugger = debugger("imc4", "mill");
    run(&mut debugger, &["send @07", "send @0A60000,4000,0,900,0,900,0,900", "send @0P"]);
    let told = said(&mut debugger, "continue");
    assert!(told.contains("\n5.0173625s  answer to @A: 2, limit switch X+"), "{told}");
    assert!(told.starts_with("5.0173625s  warning: "), "{told}");
    assert!(told.lines().last().unwrap().contains("< "), "{told}");
    assert_eq!(told.matches("answer to @A: 2").count(), 1, "{told}");
    // Also over what is recorded.
    run(&mut debugger, &["goto start"]);
    assert_eq!(said(&mut debugger, "continue"), told);
}

#[test]
fn why_is_about_what_matters_at_an_instant() {
    let mut debugger = debugger("imc4", "mill");
    run(&mut debugger, &["send @07", "send @0A6000,4000,0,900,0,900,0,900", "next x = 3000"]);
    run(&mut debugger, &["mark there", "press estop", "continue"]);
    let why = said(&mut debugger, "why");
    assert!(why.contains("answer to @A: 9"), "{why}");
    run(&mut debugger, &["goto there", "press stop"]);
    let why = said(&mut debugger, "why");
    assert!(why.lines().next().unwrap().contains("the motion brakes"), "{why}");
    assert!(why.contains("stop was pressed"), "{why}");
    // A signal has its name.
    run(
        &mut debugger,
        &["goto start", "continue", "set stop 1", "assert signals.stop = 1", "back cause"],
    );
    run(&mut debugger, &["assert signals.stop = 0"]);
    let step = said(&mut debugger, "step event");
    assert!(step.contains("stop was pressed or set to 1"), "{step}");
}

#[test]
fn what_is_done_holds_at_once_and_what_is_sent_comes_with_the_next_step() {
    let mut debugger = debugger("imc4", "mill");
    run(&mut debugger, &["send @07", "send @0A6000,4000,0,900,0,900,0,900", "next x = 3000"]);
    for (done, so) in [
        ("set probe 1", "signals.probe = 1"),
        ("hold stop", "signals.stop = 1"),
        ("cover open", "signals.cover = 0"),
        ("press estop", "signals.estop = 1"),
        ("power off", "not powered"),
    ] {
        // In the past, on a branch, and once more where nothing has happened yet.
        for there in ["goto start", "goto end"] {
            run(
                &mut debugger,
                &["goto main", there, "next x = 3000", done, &format!("assert {so}")],
            );
        }
    }
    run(&mut debugger, &["goto start", "step command", "send @0V"]);
    let step = said(&mut debugger, "step byte");
    assert!(debugger.digest() != 0 && step.contains("a byte"), "{step}");
}

#[test]
fn an_expression_is_met_in_the_middle_of_a_motion_at_its_instant() {
    let mut debugger = debugger("imc4", "bench");
    debugger.give(Input::Bytes(b"@01\r@0A30000,4000\r"));
    run(&mut debugger, &["continue", "goto start", "break x.speed > 2000000000"]);
    let there = stop(run(&mut debugger, &["continue"]));
    assert_eq!(there.why.to_string(), "breakpoint 1");
    let speed = debugger.evaluate("x.speed").unwrap().as_i64().unwrap();
    assert!((2_000_000_000..2_100_000_000).contains(&speed), "{speed}");
    // It was not so before.
    run(&mut debugger, &["back 1ms", "assert x.speed < 2000000001", "goto start"]);
    run(&mut debugger, &["goto end", "reverse"]);
    assert_eq!(debugger.now(), there.at);
    // With what must be so as well, and again and again.
    run(&mut debugger, &["delete all", "break x.speed > 2000000000 if x > 29000", "goto start"]);
    assert_eq!(stop(run(&mut debugger, &["continue"])).why, Reason::Rest);
}

#[test]
fn what_does_not_fit_is_not_put() {
    let mut debugger = moved();
    for put in ["x = 99999999999999", "state.position.0 = 2147483648", "x = -8388609"] {
        let message = wrong(&mut debugger, &format!("put {put}")).to_string();
        assert!(message.contains("it can be from -8388608 to 8388607"), "{put}: {message}");
    }
    run(&mut debugger, &["put x = -8388608", "assert x = -8388608", "put x = 8388607"]);
    run(&mut debugger, &["assert x = 8388607"]);
}

#[test]
fn a_future_that_is_no_other_leaves_the_present_as_it_was() {
    let mut debugger = moved();
    run(&mut debugger, &["goto start", "next x = 400", "step command"]);
    run(&mut debugger, &["goto end", "what if model imc-s8"]);
    let branches = said(&mut debugger, "branches");
    assert!(branches.starts_with("* main") && !branches.contains("* if"), "{branches}");
    assert_eq!(debugger.history().heading(), debugger.place().branch);
}

#[test]
fn a_name_is_no_other_place() {
    let mut debugger = moved();
    for name in ["start", "end", "1.5s", "+10ms", "command 5", "line 3", "main"] {
        let message = wrong(&mut debugger, &format!("mark {name}")).to_string();
        assert!(message.contains(name), "{message}");
    }
    wrong(&mut debugger, "rename start");
    run(&mut debugger, &["rename main", "mark a b", "goto start", "goto a b", "assert x = 0"]);
    run(&mut debugger, &["mark a b", "mark here"]);
    wrong(&mut debugger, "rename here");
}

#[test]
fn what_can_not_be_meant_is_refused() {
    let mut debugger = moved();
    for (line, error) in [
        ("step 0", "the count of steps is from 1 on"),
        ("step -1", "the count of steps is a number from 1"),
        ("back 99999999999999999999 steps", "the count of steps is a number from 1"),
        ("over 99999999999999999999", "`99999999999999999999` is not from 0"),
        ("next outside x 3000..0", "`outside x 3000..0` is wrong at"),
        ("break command @A log {nonsense}", "there is no `nonsense`"),
        ("watch x.speed / 0", "division by 0"),
        ("print 99999999999999999999", "`99999999999999999999` is too large"),
    ] {
        let message = wrong(&mut debugger, line).to_string();
        assert!(message.starts_with(error), "{line}: {message}");
    }
    assert!(debugger.breakpoints().is_empty() && debugger.watches().is_empty());
    let mut debugger = crate::debugger("imc4", "bench");
    assert_eq!(said(&mut debugger, "print signals.input 0.3"), "0");
}

#[test]
fn faults_and_rules_are_debugged_with_the_controller() {
    let mut debugger = moved();
    run(&mut debugger, &["goto start", "next x = 400", "fault jam x", "continue", "assert idle"]);
    let axis = |debugger: &Debugger| {
        let view = debugger.device().view(debugger.now());
        view.axes.first().map(|axis| (axis.position, axis.carriage)).unwrap()
    };
    let (position, carriage) = axis(&debugger);
    assert_ne!(position, carriage, "the motor stands, the counter goes on");
    // Like everything that is given, they come with the next walk.
    run(&mut debugger, &["fault end all", "fault push x 40", "fault push x 2", "advance 1ms"]);
    assert_eq!(axis(&debugger).1, carriage + 42);
    // And of two at the same instant neither replaces the other.
    run(
        &mut debugger,
        &["goto start", "next x = 400", "fault jam x", "fault backlash x 3", "continue"],
    );
    let (position, carriage) = axis(&debugger);
    assert_ne!(position, carriage, "it is jammed all the same");

    // One that waits for something begins there, and so does what a rule does; both go back.
    let mut debugger = drive::debugger("imc4", "bench");
    run(&mut debugger, &["fault jam x after x > 300", "rule once when x > 700: press stop"]);
    run(&mut debugger, &["send @01", "send @0A1000,1000", "continue"]);
    let (position, carriage) = axis(&debugger);
    assert!((701..1000).contains(&position), "{position}");
    run(&mut debugger, &["goto start", "next x = 301"]);
    assert_eq!(carriage, axis(&debugger).1, "it stands where it was jammed");
    let acted = |debugger: &mut Debugger| said(debugger, "rules").contains("acted once");
    assert!(!acted(&mut debugger), "{}", said(&mut debugger, "rules"));
    run(&mut debugger, &["goto end"]);
    assert!(acted(&mut debugger), "{}", said(&mut debugger, "rules"));
    run(&mut debugger, &["reset", "advance 1ms"]);
    assert_eq!(said(&mut debugger, "faults"), "nothing is wrong");
    assert_eq!(said(&mut debugger, "rules"), "there are no rules");

    // What a fault of the line swallows has not come out.
    run(&mut debugger, &["fault drop to-host once", "send @0P", "advance 1s"]);
    let moment = debugger.place();
    run(&mut debugger, &["goto start", "goto end"]);
    assert_eq!(debugger.place(), moment);
    assert!(said(&mut debugger, "faults").contains("is over, struck once"));
}

#[test]
fn what_has_no_effect_is_said_in_the_words_of_all_others() {
    let mut debugger = moved();
    for (line, words) in [
        ("fault end 5", "ok, without effect: there is no such fault"),
        ("fault end all", "ok, without effect: nothing is wrong"),
        ("rule end 5", "ok, without effect: there is no such rule"),
        ("reset", "ok, without effect: there are no rules, and nothing is wrong"),
        ("press stop", "ok, without effect: nothing moves and no program runs"),
        ("power on", "ok, without effect: it was so already"),
        ("set probe 0", "ok, without effect: it was so already"),
        ("fault load z 50", "ok, without effect: the machine profile does not say what the motor"),
        ("set probe 1", ""),
        ("fault jam x", ""),
        ("fault end all", ""),
        ("rule when x > 3: press stop", ""),
        ("reset", ""),
    ] {
        let said = said(&mut debugger, line);
        let is_it = if words.is_empty() { said.is_empty() } else { said.starts_with(words) };
        assert!(is_it, "{line}: {said}");
    }
    // In the past, too, where it begins a branch.
    run(&mut debugger, &["goto start", "next x = 400"]);
    assert_eq!(said(&mut debugger, "press stop"), "");
    assert_eq!(said(&mut debugger, "fault end 5"), "ok, without effect: there is no such fault");
}

#[test]
fn a_remedy_is_worded_by_whoever_was_asked() {
    let mut debugger = moved();
    for (line, message, remedy) in [
        ("goto command 99", "no command has the number 99 here", Some(Remedy::Numbers)),
        ("nonsense", "`nonsense` is not a command", Some(Remedy::Help)),
        ("assert x = 77", "`x = 77` is not so at ", None),
    ] {
        let error = wrong(&mut debugger, line);
        let mut asked = None;
        let worded = error.worded(|remedy| {
            asked = Some(remedy);
            "look there".to_owned()
        });
        assert!(worded.starts_with(message), "{worded}");
        assert_eq!((asked, worded.ends_with("; look there")), (remedy, remedy.is_some()), "{line}");
    }
    let error = wrong(&mut debugger, "goto command 99").to_string();
    assert!(error.ends_with("; `list commands` shows some with their numbers"), "{error}");
}

#[test]
fn an_input_and_an_output_of_one_number_are_two_ports() {
    let mut debugger = debugger("imc4", "bench");
    let begin = said(&mut debugger, "print ports");
    for port in ["in0 ", "in2 ", "out0 ", "out2 "] {
        assert!(begin.contains(&format!("\n  {port}")), "{begin}");
    }
    run(&mut debugger, &["input 0.2 1", "assert ports.in0 = 196 and ports.out0 = 0"]);
    run(&mut debugger, &["break change ports.out0", "send @0B0,8", "continue"]);
    assert_eq!(said(&mut debugger, "print ports.out0"), "8");
    run(&mut debugger, &["assert ports.in0 = 196", "goto start"]);
    let wrong = wrong(&mut debugger, "print ports.1").to_string();
    assert!(wrong.starts_with("there is no `1`: `ports` has in0, in1, "), "{wrong}");
}

#[test]
fn a_search_that_finds_nothing_changes_nothing() {
    for search in [
        "next x = 9999",
        "run until x 9999",
        "goto command 99",
        "list commands",
        "trace x > 9999",
        "break x > 9999 hit 3",
        "breakpoints",
    ] {
        // What was sent is on its way.
        let mut debugger = debugger("imc4", "bench");
        run(&mut debugger, &["break command @0A hit 9", "send @01"]);
        let (begin, state) = (debugger.place(), debugger.line().state());
        let _ = debugger.execute(search, &mut uninterrupted);
        assert_eq!((debugger.place(), debugger.line().state()), (begin, state), "{search}");
        assert!(debugger.history().is_at_end(), "{search}");
        // What is sent next comes behind it.
        run(&mut debugger, &["send @0A1000,900", "continue", "assert x = 1000"]);
        assert_eq!(debugger.history().branches().count(), 1, "{search}");
    }
    // What is found is there.
    let mut debugger = debugger("imc4", "bench");
    run(&mut debugger, &["send @01", "send @0A1000,900", "next x = 400", "assert x = 400"]);
    assert!(debugger.history().is_at_end());
    // A command that is still on its way can be gone to.
    run(&mut debugger, &["send @0P", "goto command 3", "assert x = 1000"]);
}

/// `x` alone is `quit`, which nothing follows.
#[test]
fn a_line_that_is_an_expression_shows_its_value() {
    let mut debugger = moved();
    for (line, value) in [
        ("x>5", "false"),
        ("x=0", "true"),
        ("y=0", "true"),
        ("x*2", "0"),
        ("x+7", "7"),
        ("(x > 5)", "false"),
        ("not x", "true"),
        ("1+1", "2"),
    ] {
        let shown = said(&mut debugger, line);
        assert_eq!(shown, said(&mut debugger, &format!("print {line}")), "{line}");
        assert!(shown.ends_with(value), "{shown}");
    }
    assert_eq!(said(&mut debugger, "x.speed"), said(&mut debugger, "print x.speed"));
    assert!(wrong(&mut debugger, "x>").to_string().ends_with("is missing at the end"));
    assert!(wrong(&mut debugger, "x-unknown").to_string().contains("is not a command"));
}

#[test]
fn an_axis_before_an_operator_is_an_expression() {
    let mut debugger = moved();
    for (line, told) in [("x + 1", "1"), ("x is 5", "false"), ("y = 0 and x < 5", "true")] {
        assert_eq!(said(&mut debugger, line), told, "{line}");
    }
    for line in ["x >", "y +", "z !="] {
        let wrong = wrong(&mut debugger, line).to_string();
        assert!(wrong.ends_with("is missing at the end"), "{line}: {wrong}");
    }
    assert!(wrong(&mut debugger, "x now").to_string().contains("nothing follows `quit`"));
    let long = format!("x now {}", "and ".repeat(10_000));
    assert!(wrong(&mut debugger, &long).to_string().len() < 300);
}
