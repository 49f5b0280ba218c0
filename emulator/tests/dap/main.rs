//! `vimc4 dap` as an editor talks to it.

#![expect(clippy::cognitive_complexity, reason = "one test is one story")]
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot talk to the adapter has failed"
)]

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufReader, Write};
use std::net::{Shutdown, TcpStream};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use tempfile::TempDir;

mod cancels;
mod editor;
#[cfg(unix)]
mod live;
#[path = "../process/mod.rs"]
#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use editor::{Editor, text};
use process::limits::{InTime, LIMIT};
use process::{Process, VIMC4, connect, framed, read_message};

fn example(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name);
    fs::canonicalize(path).unwrap().to_str().unwrap().to_owned()
}

fn drilling() -> Value {
    json!({ "program": example("commands.txt"), "machine": "mill" })
}

/// A file of a test's own.
fn file(content: &str) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("program.txt");
    fs::write(&path, content).unwrap();
    let path = path.to_str().unwrap().to_owned();
    (folder, path)
}

/// A program with a loop in a loop.
const LOOPS: &str = "\
; axes: 7
0100,900,0,21,0,21,0,21
00,21,10,900,0,21,0,21
32,-1
0-100,900,0,21,0,21,0,21
33,-4
9
";

/// One that never ends, and goes a step further each time: it never repeats itself.
const ENDLESS: &str = "\
; axes: 7
01001,9000,0,21,0,21,0,21
0-1000,9000,0,21,0,21,0,21
30,-2
9
";

// --- a session ---

/// What Visual Studio Code says, in its order: `launch` is not waited for, the breakpoints of every
/// file come one after the other, and each stop is looked at.
#[test]
fn a_session_as_visual_studio_code_has_it() {
    let program = example("commands.txt");
    let mut editor = Editor::silent();
    let capabilities = editor.ask(
        "initialize",
        json!({
            "clientID": "vscode", "clientName": "Visual Studio Code", "adapterID": "vimc4",
            "pathFormat": "path", "linesStartAt1": true, "columnsStartAt1": true,
            "supportsVariableType": true, "supportsVariablePaging": true,
            "supportsRunInTerminalRequest": true, "locale": "en",
            "supportsProgressReporting": true, "supportsInvalidatedEvent": true,
            "supportsMemoryReferences": true, "supportsArgsCanBeInterpretedByShell": true,
            "supportsMemoryEvent": true, "supportsStartDebuggingRequest": true,
        }),
    );
    assert_eq!(capabilities["supportsStepBack"], true);
    assert_eq!(capabilities["exceptionBreakpointFilters"][0]["default"], true);
    let launch = editor.send(
        "launch",
        json!({
            "name": "Drill", "type": "vimc4", "request": "launch", "program": program,
            "machine": "mill", "__configurationTarget": 6, "__sessionId": "1f7c",
        }),
    );
    assert_eq!(editor.answer(launch), Ok(Value::Null));
    editor.event("initialized");
    let source = json!({ "name": "commands.txt", "path": program });
    let set = editor.ask(
        "setBreakpoints",
        json!({
            "source": source, "lines": [6, 9], "sourceModified": false,
            "breakpoints": [{ "line": 6 }, { "line": 9 }],
        }),
    );
    // A comment stands for the next line with a command.
    let lines: Vec<_> = set["breakpoints"].as_array().unwrap().iter().map(|b| &b["line"]).collect();
    assert_eq!(lines, [7, 9]);
    editor.ask("setFunctionBreakpoints", json!({ "breakpoints": [] }));
    editor.ask("setDataBreakpoints", json!({ "breakpoints": [] }));
    editor.ask("setExceptionBreakpoints", json!({ "filters": ["errors"], "filterOptions": [] }));
    editor.ask("configurationDone", json!({}));
    assert_eq!(
        editor.ask("threads", Value::Null)["threads"],
        json!([{ "id": 1, "name": "imc4 on mill" }])
    );
    let stopped = editor.event("stopped");
    assert_eq!(stopped["reason"], "breakpoint");
    assert_eq!(stopped["hitBreakpointIds"], json!([1]));
    assert_eq!(stopped["threadId"], 1);
    editor.ask("threads", Value::Null);
    let stack = editor.ask("stackTrace", json!({ "threadId": 1, "startFrame": 0, "levels": 1 }));
    assert_eq!(stack["totalFrames"], 1);
    let frame = &stack["stackFrames"][0];
    assert_eq!((&frame["line"], &frame["source"]["path"]), (&json!(7), &json!(program)));
    let scopes = editor.ask("scopes", json!({ "frameId": frame["id"] }));
    let axes = scopes["scopes"][0]["variablesReference"].as_i64().unwrap();
    let axes = editor.variables(axes);
    let x = axes.iter().find(|axis| axis["name"] == "x").unwrap();
    assert_eq!((&x["value"], &x["type"]), (&json!("0"), &json!("group")));
    let watch = json!({ "expression": "y + 1", "frameId": frame["id"], "context": "watch" });
    assert_eq!(editor.ask("evaluate", watch)["result"], "1");
    let stopped = editor.walk("continue");
    assert_eq!((&stopped["reason"], editor.line()), (&json!("breakpoint"), 9));
    let place = (editor.value("x"), editor.value("y"), editor.value("z"));
    assert_eq!(place, ("2400".into(), "1600".into(), "-500".into()));
    // The end is no end of the session: one can go back from there.
    let end = editor.walk("continue");
    assert_eq!(end["description"], "The end: everything is done");
    assert_eq!(editor.value("x"), "3200");
    editor.walk("reverseContinue");
    assert_eq!(editor.line(), 9);
    editor.walk("continue");
    // A step finds nothing more there; whoever goes on at the end is done.
    for step in ["stepIn", "next", "stepOut"] {
        assert_eq!(editor.walk(step)["description"], "The end: everything is done", "{step}");
    }
    editor.ask("continue", json!({ "threadId": 1 }));
    assert_eq!(editor.event("exited")["exitCode"], 0);
    editor.event("terminated");
    editor.disconnect();
}

/// The other order that the protocol allows: everything is set, and then the program is named.
#[test]
fn a_session_that_is_set_before_its_program_is_open() {
    let mut editor = Editor::new();
    let program = example("commands.txt");
    let set = editor.set_lines(&program, json!([{ "line": 4 }]));
    assert_eq!(set[0]["verified"], false);
    assert_eq!(set[0]["message"], "no program is open yet");
    let set = editor.ask("setFunctionBreakpoints", json!({ "breakpoints": [{ "name": "@0P" }] }));
    assert_eq!(set["breakpoints"][0]["verified"], false);
    editor.ask("configurationDone", json!({}));
    editor.ask("launch", drilling());
    for id in [1, 2] {
        let changed = editor.event("breakpoint");
        assert_eq!(changed["reason"], "changed");
        assert_eq!(
            (&changed["breakpoint"]["id"], &changed["breakpoint"]["verified"]),
            (&json!(id), &json!(true))
        );
    }
    assert_eq!(editor.event("stopped")["hitBreakpointIds"], json!([1]));
    let stopped = editor.walk("continue");
    assert_eq!((&stopped["reason"], editor.line()), (&json!("function breakpoint"), 10));
    editor.disconnect();
}

#[test]
fn what_is_done_takes_as_long_as_in_a_run() {
    for (name, model, machine) in [("commands.txt", "imc4", "mill"), ("plate.ncp", "imc4", "mill")]
    {
        let program = example(name);
        let run = Command::new(VIMC4)
            .args(["run", &program, "--model", model, "--machine", machine, "--json"])
            .output_in_time()
            .unwrap();
        let run: Value = serde_json::from_slice(&run.stdout).unwrap();
        let mut editor = Editor::new();
        editor.ask("launch", json!({ "program": program, "model": model, "machine": machine }));
        editor.ask("configurationDone", json!({}));
        editor.event("stopped");
        assert_eq!(editor.value("at"), run["time_ns"].to_string(), "{name}");
    }
}

// --- going ---

#[test]
fn steps_forward_and_back_lead_to_the_same_state() {
    for granularity in ["statement", "line", "instruction"] {
        let mut editor = Editor::at_entry(drilling());
        editor.steps("next", "line");
        editor.steps("next", "line");
        if granularity == "instruction" {
            // Into the reference run.
            editor.steps("stepIn", granularity);
        }
        let mut before = Vec::new();
        for _ in 0..3 {
            before.push((editor.all("State"), editor.stack()));
            editor.steps("next", granularity);
        }
        let after = editor.all("State");
        while let Some(before) = before.pop() {
            assert_eq!(editor.steps("stepBack", granularity)["reason"], "step");
            assert_eq!((editor.all("State"), editor.stack()), before, "{granularity}");
        }
        for _ in 0..3 {
            editor.steps("stepIn", granularity);
        }
        assert_eq!(editor.all("State"), after, "{granularity}");
    }
}

#[test]
fn an_instruction_is_a_step_of_a_motor() {
    let (_folder, program) = file("@07\n@0A100,900,0,21,0,21,0,21\n");
    let mut editor = Editor::at_entry(json!({ "program": program }));
    editor.steps("next", "line");
    for x in ["1", "2", "3"] {
        let stopped = editor.steps("next", "instruction");
        assert_eq!((&stopped["reason"], editor.value("x")), (&json!("step"), x.to_owned()));
    }
    editor.steps("stepBack", "instruction");
    assert_eq!(editor.value("x"), "2");
    editor.steps("next", "line");
    assert_eq!(editor.value("x"), "100", "behind the last line is the end");
    editor.steps("stepBack", "instruction");
    assert_eq!(editor.value("x"), "99");
}

#[test]
fn a_statement_of_a_plot_is_a_command() {
    let board =
        json!({ "program": example("board.plt"), "model": "smcu", "machine": "board-plotter" });
    let mut editor = Editor::at_entry(board);
    assert_eq!(editor.stack(), [(1, "IN".to_owned())]);
    editor.steps("next", "statement");
    assert_eq!(editor.stack(), [(1, "!CT1".to_owned())]);
    editor.steps("next", "line");
    assert_eq!(editor.stack(), [(2, "!EM1".to_owned())]);
    editor.steps("stepBack", "statement");
    assert_eq!(editor.stack(), [(1, "!CT1".to_owned())]);
    let end = editor.walk("continue");
    assert_eq!(end["description"], "The end: everything is done");
    assert_eq!((editor.value("x"), editor.line()), ("0".to_owned(), 7));
}

/// A stream that does not wait for answers keeps the buffer filled, also under a debugger.
#[test]
fn a_plot_without_answers_takes_as_long_as_in_a_run() {
    let lines: String = (1..=60).map(|n| format!("PA{},{};", n * 40, n % 7 * 30)).collect();
    let (_folder, program) = file(&format!("!CM0;PU;\n{lines}\n"));
    let run = Command::new(VIMC4)
        .args(["run", &program, "--model", "smcu", "--json"])
        .output_in_time()
        .unwrap();
    let run: Value = serde_json::from_slice(&run.stdout).unwrap();
    let mut editor = Editor::at_entry(json!({ "program": program, "model": "smcu" }));
    let begin: u64 = editor.value("at").parse().unwrap();
    editor.walk("continue");
    let end: u64 = editor.value("at").parse().unwrap();
    assert_eq!(Some(end - begin), run["time_ns"].as_u64(), "{run}");
}

#[test]
fn loops_are_frames_and_are_gone_over_into_and_out_of() {
    let (_folder, program) = file(LOOPS);
    let mut editor = Editor::at_entry(json!({ "program": program }));
    assert_eq!(editor.line(), 2);
    editor.steps("stepIn", "line");
    editor.steps("stepIn", "line");
    assert_eq!(editor.line(), 4);
    editor.steps("stepIn", "line");
    // The block of the loop is run again, and the loop is a frame around it.
    let stack = editor.stack();
    assert_eq!(stack[0].0, 3);
    assert!(stack.len() > 1 && stack[1].1.starts_with("loop of line 4, "), "{stack:?}");
    assert_eq!(stack[1].0, 4, "the line of the file");
    let deep = stack.len();
    editor.walk("stepOut");
    // The line that ends the loop is outside of it.
    assert_eq!((editor.stack().len(), editor.line()), (deep - 1, 4));
    editor.walk("next");
    assert_eq!(editor.line(), 5);
    let there = editor.all("State");
    editor.walk("stepBack");
    editor.walk("next");
    assert_eq!(editor.all("State"), there);
    // Rounds of the outer loop, of which this is the first.
    editor.set_lines(&program, json!([{ "line": 5 }]));
    let mut rounds = 1;
    while editor.walk("continue")["reason"] == "breakpoint" {
        rounds += 1;
    }
    // This model makes three rounds besides the first, and the inner loop two.
    assert_eq!((rounds, editor.value("x"), editor.value("y")), (4, "0".into(), "120".into()));
}

#[test]
fn a_step_back_undoes_a_step_in_round_by_round() {
    let (_folder, loops) = file(LOOPS);
    step_in_and_back(&loops, 20);
    // It ends with a line at which it waits for ever.
    step_in_and_back(&example("program.txt"), 2);
}

/// Steps into a program to where it rests, and back, and looks at each stop.
fn step_in_and_back(program: &str, least: usize) {
    let mut editor = Editor::at_entry(json!({ "program": program }));
    let mut stops = vec![(editor.stack(), editor.console("digest"))];
    loop {
        if editor.walk("stepIn")["reason"] != "step" {
            break;
        }
        stops.push((editor.stack(), editor.console("digest")));
    }
    assert!(stops.len() >= least, "{stops:?}");
    for stop in stops.iter().rev() {
        editor.walk("stepBack");
        assert_eq!(&(editor.stack(), editor.console("digest")), stop);
    }
}

#[test]
fn a_pause_of_what_stands_still_is_told_of() {
    let mut editor = Editor::at_entry(drilling());
    assert_eq!(editor.walk("pause")["reason"], "pause");
    assert_eq!(editor.line(), 2);
}

#[test]
fn one_goes_to_lines_and_back_to_where_frames_began() {
    let mut editor = Editor::at_entry(drilling());
    let source = json!({ "path": example("commands.txt") });
    let targets = editor.ask("gotoTargets", json!({ "source": source, "line": 9 }));
    let id = |targets: &Value, place: usize| targets["targets"][place]["id"].clone();
    assert_eq!(targets["targets"][0]["line"], 9);
    // It has not been there yet.
    let back = id(&targets, 0);
    editor.ask("goto", json!({ "threadId": 1, "targetId": back }));
    let stopped = editor.event("stopped");
    assert_eq!(
        (&stopped["reason"], &stopped["text"]),
        (&json!("goto"), &json!("that is nowhere; still here"))
    );
    assert_eq!(editor.line(), 2);
    // The other one is still there, and both are gone once it has led somewhere.
    editor.ask("goto", json!({ "threadId": 1, "targetId": id(&targets, 1) }));
    editor.event("stopped");
    assert_eq!(editor.line(), 9);
    assert!(
        editor.refused("goto", json!({ "threadId": 1, "targetId": back })).contains("no longer")
    );
    let nowhere = json!({ "source": source, "line": 0 });
    assert_eq!(editor.refused("gotoTargets", nowhere), "there is no line 0");
    editor.steps("next", "instruction");
    assert_eq!(editor.value("x"), "2401");
    let stack = editor.ask("stackTrace", json!({ "threadId": 1 }));
    editor.ask("restartFrame", json!({ "frameId": stack["stackFrames"][0]["id"] }));
    editor.event("stopped");
    assert_eq!((editor.line(), editor.value("x")), (9, "2400".to_owned()));
    let locations =
        editor.ask("breakpointLocations", json!({ "source": source, "line": 1, "endLine": 7 }));
    assert_eq!(
        locations["breakpoints"],
        json!([{ "line": 2 }, { "line": 3 }, { "line": 4 }, { "line": 7 }])
    );
}

#[test]
fn a_restart_reads_the_file_again() {
    let (_folder, program) = file("@07\n@0A100,900,0,21,0,21,0,21\n");
    let mut editor = Editor::at_entry(json!({ "program": program }));
    editor.set_lines(&program, json!([{ "line": 2 }]));
    editor.walk("continue");
    editor.walk("continue");
    assert_eq!(editor.value("x"), "100");
    fs::write(&program, "; longer\n@07\n@0A200,900,0,21,0,21,0,21\n").unwrap();
    editor.ask("restart", json!({ "arguments": { "program": program, "stopOnEntry": false } }));
    let stopped = editor.event("stopped");
    assert_eq!((&stopped["reason"], editor.line()), (&json!("breakpoint"), 2));
    editor.walk("continue");
    assert_eq!(editor.value("x"), "200");
    editor.ask("terminate", json!({}));
    editor.event("terminated");
    editor.disconnect();
}

#[test]
fn a_program_can_just_run_or_end_at_its_end() {
    for (key, value) in [("noDebug", true), ("endAtEnd", true)] {
        let mut editor = Editor::new();
        let program = example("commands.txt");
        if key == "noDebug" {
            editor.set_lines(&program, json!([{ "line": 4 }]));
        }
        let mut configuration = drilling();
        configuration[key] = value.into();
        editor.ask("launch", configuration);
        editor.ask("configurationDone", json!({}));
        assert_eq!(editor.event("exited")["exitCode"], 0);
        editor.event("terminated");
        assert!(editor.events.iter().all(|(event, _)| event != "stopped"));
    }
}

// --- breakpoints ---

#[test]
fn lines_have_conditions_hit_counts_and_log_messages() {
    let (_folder, program) = file(LOOPS);
    let mut editor = Editor::at_entry(json!({ "program": program }));
    editor.set_lines(&program, json!([{ "line": 3, "condition": "y >= 30" }]));
    editor.walk("continue");
    assert_eq!(editor.value("y"), "30");
    // The same breakpoint on the way back, at the last time before.
    editor.walk("reverseContinue");
    editor.set_lines(&program, json!([{ "line": 3, "hitCondition": "3" }]));
    let stopped = editor.walk("continue");
    assert_eq!(stopped["text"], "line 3 of the file hit 3");
    let third = editor.value("y");
    editor.walk("reverseContinue");
    let set = editor.set_lines(
        &program,
        json!([
            { "line": 3, "logMessage": "y is {y}, and x {x}" },
            { "line": 5, "hitCondition": "% 2" },
        ]),
    );
    assert!(set.iter().all(|set| set["verified"] == true), "{set:?}");
    editor.walk("continue");
    assert_eq!(editor.line(), 5);
    let told = editor.event("output");
    assert_eq!(told["category"], "console");
    assert!(text(&told["output"]).starts_with("y is ") && text(&told["output"]).ends_with('\n'));
    assert_eq!((&told["line"], &told["source"]["path"]), (&json!(3), &json!(program)));
    assert_eq!(third, "20", "the third time the line begins");
    let set = editor.set_lines(&program, json!([
        { "line": 3, "condition": "nothing > 5" }, { "line": 3, "hitCondition": "often" }, { "line": 99 },
    ]));
    for (set, what) in set.iter().zip(["there is no `nothing`", "is not a hit count", "line 99"]) {
        assert_eq!(set["verified"], false);
        assert!(text(&set["message"]).contains(what), "{set}");
    }
    let elsewhere = editor.set_lines("/elsewhere.txt", json!([{ "line": 1 }]));
    assert_eq!(elsewhere[0]["verified"], false);
    assert!(text(&elsewhere[0]["message"]).contains("commands from this file"), "{elsewhere:?}");
}

#[test]
fn commands_and_conditions_are_function_breakpoints() {
    let mut editor = Editor::at_entry(drilling());
    let set = editor.ask(
        "setFunctionBreakpoints",
        json!({ "breakpoints": [
        { "name": "@M" }, { "name": "z < -499" }, { "name": "no such thing" },
    ] }),
    );
    let set = set["breakpoints"].as_array().unwrap().clone();
    assert_eq!(
        set.iter().map(|set| set["verified"].as_bool().unwrap()).collect::<Vec<_>>(),
        [true, true, false]
    );
    assert!(!text(&set[2]["message"]).is_empty());
    let stopped = editor.walk("continue");
    assert_eq!((&stopped["reason"], editor.line()), (&json!("function breakpoint"), 7));
    editor.walk("continue");
    // At the very instant.
    assert_eq!((editor.line(), editor.value("z")), (7, "-500".to_owned()));
}

#[test]
fn fields_and_switches_are_data_breakpoints() {
    let mut editor = Editor::at_entry(drilling());
    let axes = editor.scope("Axes");
    let x = editor.variables(axes).into_iter().find(|axis| axis["name"] == "x").unwrap();
    let x = x["variablesReference"].clone();
    let info =
        editor.ask("dataBreakpointInfo", json!({ "variablesReference": x, "name": "referenced" }));
    let id = info["dataId"].clone();
    assert_eq!(info["accessTypes"], json!(["write"]));
    let info = editor.ask("dataBreakpointInfo", json!({ "name": "nonsense" }));
    assert_eq!(info["dataId"], Value::Null);
    let info = editor.ask("dataBreakpointInfo", json!({ "name": "signals.stop" }));
    let stop = info["dataId"].clone();
    let set = editor.ask("setDataBreakpoints", json!({ "breakpoints": [
        { "dataId": id, "accessType": "write" }, { "dataId": stop }, { "dataId": "0:y", "condition": "y = 800" },
    ] }));
    assert!(
        set["breakpoints"].as_array().unwrap().iter().all(|set| set["verified"] == true),
        "{set}"
    );
    let read = json!([{ "dataId": "0:y", "accessType": "read" }]);
    let read = editor.ask("setDataBreakpoints", json!({ "breakpoints": read }));
    assert_eq!(read["breakpoints"][0]["verified"], false);
    assert!(text(&read["breakpoints"][0]["message"]).contains("`write`"), "{read}");
    let info = editor.ask("dataBreakpointInfo", json!({ "name": "" }));
    assert_eq!(info["dataId"], Value::Null);
    editor.ask("setDataBreakpoints", json!({ "breakpoints": [
        { "dataId": id, "accessType": "write" }, { "dataId": stop }, { "dataId": "0:y", "condition": "y = 800" },
    ] }));
    let stopped = editor.walk("continue");
    assert_eq!(stopped["reason"], "data breakpoint");
    assert_eq!(editor.value("axes.x.referenced"), "true");
    editor.walk("continue");
    assert_eq!((editor.value("y"), editor.line()), ("800".to_owned(), 7));
    editor.walk("reverseContinue");
    assert_eq!(editor.value("axes.x.referenced"), "true");
    assert_eq!(editor.line(), 4);
}

/// However many pulses of one motion are looked at, each of them is, once, in both directions.
#[test]
fn pulses_are_counted_on_the_whole_of_a_long_motion() {
    let (_folder, program) = file("@01\r\n@0A100000,2000\r\n");
    let mut editor = Editor::at_entry(json!({ "program": program }));
    let set = |editor: &mut Editor, with: Value| {
        let mut breakpoint = json!({ "dataId": "0:axes.x.position" });
        breakpoint.as_object_mut().unwrap().extend(with.as_object().unwrap().clone());
        editor.ask("setDataBreakpoints", json!({ "breakpoints": [breakpoint] }));
    };
    set(&mut editor, json!({ "hitCondition": "5000" }));
    assert_eq!(editor.walk("continue")["reason"], "data breakpoint");
    assert_eq!(editor.value("x"), "5000");
    set(&mut editor, json!({ "condition": "x = 90000" }));
    editor.walk("continue");
    assert_eq!(editor.value("x"), "90000");
    editor.walk("continue");
    set(&mut editor, json!({ "condition": "x = 3000" }));
    editor.walk("reverseContinue");
    assert_eq!(editor.value("x"), "3000");
}

#[test]
fn error_replies_are_exceptions() {
    let (_folder, program) = file("@07\n@0Q\n@0A100,900,0,21,0,21,0,21\n@0M9,9\n");
    let mut editor = Editor::at_entry(json!({ "program": program }));
    assert!(
        editor.refused("setExceptionBreakpoints", json!({ "filters": ["all"] })).contains("errors")
    );
    editor.ask("setExceptionBreakpoints", json!({ "filters": ["errors"] }));
    let stopped = editor.walk("continue");
    assert_eq!((&stopped["reason"], editor.line()), (&json!("exception"), 2));
    let info = editor.ask("exceptionInfo", json!({ "threadId": 1 }));
    let code = text(&info["exceptionId"]);
    assert_eq!(info["breakMode"], "always");
    assert!(!text(&info["description"]).is_empty());
    assert!(text(&stopped["text"]).contains(&text(&info["description"])));
    // The rest is not sent, and that is told where everything else has ended.
    editor.ask("setExceptionBreakpoints", json!({ "filters": [] }));
    let end = text(&editor.walk("continue")["text"]);
    let told = format!("the end: line 2: @0Q was answered {code}: ");
    assert!(
        end.starts_with(&told) && end.ends_with("; the rest was not sent (`keepGoing` sends it)"),
        "{end}"
    );
    editor.ask("setExceptionBreakpoints", json!({ "filters": ["errors"] }));
    // Another code only.
    editor.ask("reverseContinue", json!({ "threadId": 1 }));
    editor.event("stopped");
    assert!(editor.refused("exceptionInfo", json!({ "threadId": 1 })).contains("error reply"));
    let other = if code == "5" { "3" } else { "5" };
    let set = editor.ask(
        "setExceptionBreakpoints",
        json!({
            "filters": [], "filterOptions": [{ "filterId": "errors", "condition": other }],
        }),
    );
    assert_eq!(set["breakpoints"][0]["verified"], true);
    let next = editor.walk("continue");
    assert!(next["reason"] != "exception" || editor.line() != 2, "{next}");
    editor.walk("reverseContinue");
    editor.ask("setExceptionBreakpoints", json!({
        "filters": [], "filterOptions": [{ "filterId": "errors", "condition": format!("{code}, {other}") }],
    }));
    editor.walk("continue");
    assert_eq!(editor.line(), 2);
    // The same from the other side.
    let mut editor = Editor::at_entry(json!({ "program": program, "keepGoing": true }));
    editor.ask("setExceptionBreakpoints", json!({ "filters": ["errors"] }));
    let stopped = editor.walk("continue");
    let info = editor.ask("exceptionInfo", json!({ "threadId": 1 }));
    assert_eq!(editor.walk("next")["reason"], "step");
    assert_eq!(editor.walk("reverseContinue"), stopped);
    assert_eq!(editor.ask("exceptionInfo", json!({ "threadId": 1 })), info);
    // A run that nobody looks at says that something was wrong.
    let mut editor = Editor::new();
    editor.ask("launch", json!({ "program": program, "noDebug": true }));
    editor.ask("configurationDone", json!({}));
    assert_eq!(editor.event("exited")["exitCode"], 1);
}

// --- looking, and setting ---

#[test]
fn values_are_looked_at_and_set() {
    let mut editor = Editor::at_entry(drilling());
    editor.set_lines(&example("commands.txt"), json!([{ "line": 7 }]));
    editor.walk("continue");
    let signals = editor.scope("Signals");
    let stop = |editor: &mut Editor, reference| {
        let found = editor.variables(reference).into_iter().find(|own| own["name"] == "stop");
        text(&found.unwrap()["value"])
    };
    assert_eq!(stop(&mut editor, signals), "0");
    let wrong = json!({ "variablesReference": signals, "name": "stop", "value": "often" });
    assert!(editor.refused("setVariable", wrong).contains("stop is 0 to 1"));
    let arguments = json!({ "variablesReference": signals, "name": "stop", "value": "1" });
    assert_eq!(editor.ask("setVariable", arguments)["value"], "1");
    assert_eq!(stop(&mut editor, signals), "1");
    let set = editor.ask("setExpression", json!({ "expression": "x", "value": "50" }));
    assert_eq!((&set["value"], editor.value("x")), (&json!("50"), "50".to_owned()));
    assert!(
        editor
            .refused("setExpression", json!({ "expression": "axes.x.speed", "value": "5" }))
            .contains("cannot be set")
    );
    assert!(
        editor
            .refused("setExpression", json!({ "expression": "x", "value": "\"far\"" }))
            .contains("cannot be that")
    );
    assert!(editor.refused("evaluate", json!({ "expression": "x +" })).contains("at the end"));
    // Pages of a list.
    let state = editor.scope("State");
    let all = editor.variables(state);
    let two =
        editor.ask("variables", json!({ "variablesReference": state, "start": 1, "count": 2 }));
    assert_eq!(two["variables"].as_array().unwrap()[..], all[1..3]);
    let none = editor.ask("variables", json!({ "variablesReference": state, "filter": "indexed" }));
    assert_eq!(none["variables"], json!([]));
    // The past is still there, on another branch.
    assert!(editor.console("branches").lines().count() >= 2);
}

#[test]
fn a_host_goes_on_where_something_was_changed_in_the_past() {
    let mut editor = Editor::at_entry(drilling());
    editor.walk("continue");
    assert_eq!(editor.value("x"), "3200");
    editor.set_lines(&example("commands.txt"), json!([{ "line": 9 }]));
    editor.walk("reverseContinue");
    editor.ask("setExpression", json!({ "expression": "x", "value": "1000" }));
    editor.set_lines(&example("commands.txt"), json!([]));
    editor.walk("continue");
    // The relative way of line 9 begins elsewhere, and line 10 is sent too.
    assert_eq!((editor.value("x"), editor.line()), ("1800".to_owned(), 10));
}

#[test]
fn what_is_typed_shifts_no_line() {
    let mut editor = Editor::at_entry(drilling());
    let at = editor.steps("next", "line");
    assert_eq!((&at["reason"], editor.line()), (&json!("step"), 3));
    editor.console("send @0V");
    let program = example("commands.txt");
    editor.set_lines(&program, json!([{ "line": 7 }, { "line": 9 }]));
    for line in [7, 9] {
        assert_eq!(editor.walk("continue")["reason"], "breakpoint");
        let command = if line == 7 { "@0M2400" } else { "@0A800" };
        let (stopped, name) = editor.stack()[0].clone();
        assert!(stopped == line && name.starts_with(command), "{stopped} {name}");
    }
}

#[test]
fn the_console_has_the_commands_of_the_debugger() {
    let mut editor = Editor::at_entry(drilling());
    assert_eq!(editor.console("x + 5"), "5");
    assert_eq!(editor.console("x"), "0", "and not the end");
    assert_eq!(editor.console("y"), "0", "and not why");
    for (wrong, right) in [("1/0", "division by 0"), ("z<", "missing"), ("z <", "missing")] {
        let wrong = json!({ "expression": wrong, "context": "repl" });
        let said = editor.refused("evaluate", wrong.clone());
        assert!(said.contains(right) && !said.contains("is not a command"), "{wrong}: {said}");
    }
    assert!(editor.console("help").contains("Forward and back"));
    assert!(
        editor
            .refused("evaluate", json!({ "expression": "nonsense", "context": "repl" }))
            .contains("nonsense")
    );
    assert!(
        editor
            .refused("evaluate", json!({ "expression": "quit", "context": "repl" }))
            .contains("editor")
    );
    // What moves says so to the rest of the editor.
    let said = editor.console("next z < -100");
    assert!(said.contains("found"), "{said}");
    assert_eq!(editor.event("stopped")["reason"], "goto");
    assert_eq!(editor.line(), 7);
    let completions = editor.ask("completions", json!({ "text": "rev", "column": 4 }));
    let target = &completions["targets"][0];
    assert_eq!(
        (&target["label"], &target["start"], &target["length"]),
        (&json!("reverse"), &json!(0), &json!(3))
    );
    let hover = editor.ask("evaluate", json!({ "expression": "axes.x", "context": "hover" }));
    assert!(hover["variablesReference"].as_i64().unwrap() > 0);
}

/// As in `vimc4 console`, where the whole file has been sent at the beginning.
#[test]
fn the_console_goes_to_what_is_still_to_be_sent() {
    let mut editor = Editor::at_entry(drilling());
    editor.console("goto line 9");
    editor.event("stopped");
    assert_eq!((editor.line(), editor.value("x")), (9, "2400".to_owned()));
    editor.console("goto command 4");
    editor.event("stopped");
    let fourth = editor.line();
    editor.console("goto end");
    editor.event("stopped");
    let end = (editor.value("at"), editor.value("x"));
    editor.console("goto -30s");
    editor.event("stopped");
    editor.console("goto -5s");
    assert_eq!(editor.value("at"), "0");
    let mut other = Editor::at_entry(drilling());
    other.walk("continue");
    assert_eq!((other.value("at"), other.value("x")), end);
    assert_eq!(fourth, 7);
}

#[test]
fn stored_programs_are_disassembled() {
    let (_folder, program) = file(LOOPS);
    let mut editor = Editor::at_entry(json!({ "program": program }));
    let stack = editor.ask("stackTrace", json!({ "threadId": 1 }));
    let at = stack["stackFrames"][0]["instructionPointerReference"].clone();
    let code = editor.ask(
        "disassemble",
        json!({
            "memoryReference": at, "instructionOffset": -2, "instructionCount": 5,
        }),
    );
    let code = code["instructions"].as_array().unwrap();
    assert_eq!(code.len(), 5);
    assert_eq!(
        (&code[0]["presentationHint"], &code[1]["presentationHint"]),
        (&json!("invalid"), &json!("invalid"))
    );
    assert_eq!(code[2]["address"], at);
    let told = text(&code[2]["instruction"]);
    assert!(told.starts_with("0100,900,0,21,0,21,0,21   ; "), "{told}");
    assert_eq!((&code[2]["line"], &code[2]["location"]["path"]), (&json!(2), &json!(program)));
    let addresses: BTreeSet<String> = code.iter().map(|code| text(&code["address"])).collect();
    assert_eq!(addresses.len(), 5);
    assert!(
        editor
            .refused("disassemble", json!({ "memoryReference": "here", "instructionCount": 1 }))
            .contains("here")
    );
    let many = json!({ "memoryReference": at, "instructionCount": 1_000_000_000 });
    assert!(editor.refused("disassemble", many).contains("from 0 to 10000"));
    let few = json!({ "memoryReference": at, "instructionCount": -8 });
    assert!(editor.refused("disassemble", few).contains("and here it is -8"));
    let sources = editor.ask("loadedSources", json!({}))["sources"].as_array().unwrap().clone();
    assert_eq!(sources[0]["path"], program);
    let reference = sources[1]["sourceReference"].clone();
    let content = editor.ask("source", json!({ "sourceReference": reference }));
    assert!(text(&content["content"]).starts_with("0100,900,0,21,0,21,0,21\n"));
    assert!(editor.refused("source", json!({ "sourceReference": 99 })).contains("99"));
}

#[test]
fn jobs_stop_at_their_questions() {
    let job = "IMF_PBL\nREF XYZ\nMOVEABS X1000\nHALT\nWAITBIT E1.3=1\nMOVEABS X2000\n";
    let (_folder, program) = file(job);
    let mut editor = Editor::at_entry(json!({ "program": program }));
    assert_eq!(editor.line(), 2);
    let halt = editor.walk("continue");
    assert_eq!((editor.line(), editor.stack()[0].1.as_str()), (4, "HALT"));
    assert_eq!(
        (&halt["reason"], text(&halt["text"]).contains("line 4: HALT")),
        (&json!("pause"), true),
        "{halt}"
    );
    let there = editor.value("x");
    let waits = editor.walk("continue");
    assert!(text(&waits["text"]).contains("line 5 waits for port 0 bit 2 to be 1"), "{waits}");
    assert_eq!(editor.line(), 5);
    let ahead = json!({ "expression": "goto line 6", "context": "repl" });
    let ahead = editor.refused("evaluate", ahead);
    assert!(ahead.contains("line 5 waits for port 0 bit 2"), "{ahead}");
    assert_eq!(editor.walk("continue")["text"], waits["text"]);
    let signals = editor.scope("Signals");
    editor.ask(
        "setVariable",
        json!({ "variablesReference": signals, "name": "input 0.2", "value": "1" }),
    );
    // Whoever comes by once more is asked once more, by whatever way, and goes on as before.
    for step in ["continue", "next"] {
        while editor.walk("reverseContinue")["reason"] != "entry" {}
        let again = loop {
            let stop = editor.walk(step);
            if stop["reason"] == "pause" {
                break stop;
            }
        };
        assert_eq!((&again["text"], editor.value("x")), (&halt["text"], there.clone()), "{step}");
    }
    let end = editor.walk("continue");
    assert_eq!(end["description"], "The end: everything is done");
    assert_ne!(editor.value("x"), there);
    assert_eq!(editor.line(), 6);
    let (_folder, wrong) = file("IMF_PBL\nREF XYZ\nMOVABS X1000\n");
    let mut editor = Editor::new();
    assert!(editor.refused("launch", json!({ "program": wrong })).contains("line 3"));
    // It can be mended.
    fs::write(&wrong, "IMF_PBL\nREF XYZ\nMOVEABS X1000\n").unwrap();
    editor.ask("launch", json!({ "program": wrong }));
}

/// Where the work-piece lies is said as to `vimc4 ncp run`, beside several controllers, too.
#[test]
fn a_job_is_debugged_with_the_options_that_it_is_run_with() {
    let (_folder, job) = file("IMF_PBL\nREF XYZ\nVEL 5000\nMOVEABS X1000 Z-5000\n");
    let zero = json!(["--zero=100mm,50mm,-60mm"]);
    for (launch, x) in [
        (json!({ "program": job, "jobOptions": zero }), "8080"),
        (json!({ "program": job }), "80"),
        (json!({ "controllers": [{ "program": job }], "jobOptions": zero }), "8080"),
        (
            json!({ "controllers": [{ "program": job, "jobOptions": [] }], "jobOptions": zero }),
            "80",
        ),
    ] {
        let mut launch = launch;
        launch["machine"] = "mill".into();
        let mut editor = Editor::at_entry(launch.clone());
        editor.walk("continue");
        assert_eq!(editor.value("x"), x, "{launch}");
    }
}

/// In the words of `vimc4 console`.
#[test]
fn what_is_no_job_has_no_options_of_jobs() {
    let (_folder, job) = file("IMF_PBL\nREF XYZ\nMOVEABS X1000\n");
    let (zero, list) = (json!(["--zero=100mm"]), example("commands.txt"));
    let refused = |launch: Value| Editor::new().refused("launch", launch);
    let options = ["--no-ref", "--lenient", "--zero", "--wpreg", "--drilldef-unit"];
    let words =
        format!("{list} is no job; {} are for job files, so leave them out", options.join(", "));
    let about = vimc4_dap::ATTRIBUTES.iter().find(|(name, ..)| *name == "jobOptions").unwrap().2;
    assert!(options.iter().all(|option| about.contains(option)), "{about}");
    let launch = json!({ "program": list, "machine": "mill", "jobOptions": zero });
    assert_eq!(refused(launch), words);
    let named = json!({ "machine": "mill", "controllers": [
        { "program": job, "jobOptions": zero },
        { "program": list, "jobOptions": zero, "name": "b" },
    ] });
    assert_eq!(refused(named), format!("controller b: {words}"));
    let behind_ports = refused(json!({ "serve": true, "jobOptions": zero }));
    let belongs =
        "`jobOptions` belongs to a program and means nothing for a controller behind ports";
    assert_eq!(behind_ports, format!("{belongs}; leave it out"));
    drop(Editor::at_entry(json!({ "program": list, "machine": "mill", "jobOptions": [] })));
}

#[test]
fn an_attribute_that_means_nothing_is_told_with_what_is_perhaps_meant() {
    let said = |launch: Value| -> Vec<String> {
        let editor = Editor::at_entry(launch);
        let outputs = editor.events.iter().filter(|(event, _)| event == "output");
        outputs.map(|(_, body)| text(&body["output"])).collect()
    };
    let mut launch = drilling();
    launch["type"] = "vimc4".into();
    launch["name"] = "This file".into();
    launch["__sessionId"] = "5".into();
    launch["presentation"] = json!({ "hidden": true });
    let is_told = |said: &[String]| said.iter().any(|it| it.contains("means nothing here"));
    assert!(!is_told(&said(launch.clone())), "{launch}");
    launch["zero"] = "100mm".into();
    let perhaps = "the attribute `zero` means nothing here; perhaps `jobOptions` is meant\n";
    assert!(said(launch).contains(&perhaps.to_owned()));
}

/// It may be why nothing is opened.
#[test]
fn an_attribute_that_means_nothing_is_told_also_where_nothing_is_opened() {
    for (request, perhaps) in [
        ("launch", "perhaps `program` is meant\n"),
        ("attach", "nor would `program`: attach takes a recording, or the controllers that run "),
    ] {
        let mut editor = Editor::new();
        editor.refused(request, json!({ "programm": "job.ncp" }));
        let told = text(&editor.event("output")["output"]);
        let words = format!("the attribute `programm` means nothing here; {perhaps}");
        assert!(told.starts_with(&words), "{request}: {told}");
    }
}

/// As the table of the page has it: what is set has an effect.
#[test]
fn an_attribute_that_means_nothing_for_what_is_debugged_is_refused() {
    let (list, recording) = (example("commands.txt"), example("limit.jsonl"));
    let refused = |request: &str, launch: Value| Editor::new().refused(request, launch);
    for name in ["pty", "tcp", "time", "flash", "serial"] {
        let mut launch = json!({ "program": list });
        launch[name] = "x".into();
        let words = "belongs to a controller behind ports and means nothing for a program";
        assert_eq!(refused("launch", launch), format!("`{name}` {words}; leave it out"));
    }
    for request in ["launch", "attach"] {
        let words = "`keepGoing` belongs to a program and means nothing for a recording; ";
        let kept = refused(request, json!({ "recording": recording, "keepGoing": true }));
        assert!(kept.starts_with(words), "{request}: {kept}");
    }
    let ends = refused("launch", json!({ "serve": true, "endAtEnd": true }));
    let words = "`endAtEnd` belongs to a program or a recording and means nothing for ";
    assert!(ends.starts_with(words), "{ends}");
    // What is false or null is not said.
    let launch = json!({ "program": list, "pty": null, "serve": false, "stopOnEntry": null });
    Editor::new().ask("launch", launch);
    // One of several has its own.
    let (_folder, wrong) = file("@07\r@0x\r@0P\r");
    let several = json!({ "controllers": [{ "program": wrong, "keepGoing": true }] });
    let mut editor = Editor::at_entry(several);
    assert_eq!(editor.walk("continue")["description"], "The end: everything is done");
    // That counts against what stands beside.
    let own = json!([{ "program": wrong, "keepGoing": false }]);
    let mut editor = Editor::at_entry(json!({ "keepGoing": true, "controllers": own }));
    assert_ne!(editor.walk("continue")["description"], "The end: everything is done");
}

/// Where, and what belongs there, in words that are no programmer's.
#[test]
fn an_attribute_of_another_type_is_named() {
    let list = example("commands.txt");
    for (launch, words) in [
        (
            json!({ "program": list, "machine": 5 }),
            "`machine`: there is the number 5 where a text belongs",
        ),
        (
            json!({ "controllers": ["1"] }),
            "`controllers[0]`: there is the text \"1\" where an object ",
        ),
        (json!([]), "there is a list where an object belongs"),
    ] {
        for request in ["launch", "attach"] {
            let refused = Editor::new().refused(request, launch.clone());
            let words = format!("the attributes of the configuration: {words}");
            assert!(refused.starts_with(&words), "{refused}");
        }
    }
    let mut editor = Editor::at_entry(drilling());
    let refused = editor.refused("restart", "x".into());
    assert_eq!(
        refused,
        "the arguments of restart: there is the text \"x\" where an object belongs"
    );
    let start = json!({ "threadId": 1, "startFrame": -1 });
    let refused = editor.refused("stackTrace", start);
    assert!(refused.ends_with("there is the number -1 where a whole number from 0 belongs"));
}

/// Before the first line there is nothing, and the beginning is told of at once.
#[test]
fn the_first_step_back_from_the_first_line_is_at_the_beginning() {
    for granularity in ["statement", "line", "instruction"] {
        let mut editor = Editor::at_entry(drilling());
        for _ in 0..2 {
            let stop = editor.steps("stepBack", granularity);
            assert_eq!(stop["description"], "The beginning", "{granularity}");
        }
        editor.walk("next");
        assert_eq!(editor.stack()[0].1, "@07");
    }
}

/// Also where an axis has the name of a command.
#[test]
fn an_expression_that_is_not_finished_is_told_as_one() {
    let mut editor = Editor::at_entry(drilling());
    for text in ["x >", "x > 5 and", "y +", "z <"] {
        let [console, watch] = ["repl", "watch"].map(|context| {
            editor.refused("evaluate", json!({ "expression": text, "context": context }))
        });
        assert_eq!(console, watch, "{text}");
        assert!(console.ends_with("is missing at the end"), "{console}");
    }
    let long = format!("x {}", "+ ".repeat(50_000));
    let told = editor.refused("evaluate", json!({ "expression": long, "context": "repl" }));
    assert!(told.len() < 500, "{}", told.len());
    let word = "q".repeat(100_000);
    for context in ["repl", "watch"] {
        let told = editor.refused("evaluate", json!({ "expression": word, "context": context }));
        assert!(told.len() < 1_000, "{context}: {}", told.len());
    }
}

/// A plotter's command never comes to a controller of isel's.
#[test]
fn a_command_that_the_model_has_not_is_no_function_breakpoint() {
    let mut editor = Editor::at_entry(drilling());
    let names = ["PA", "@0A", "@A", "@0P", "x > 5"].map(|name| json!({ "name": name }));
    let set = editor.ask("setFunctionBreakpoints", json!({ "breakpoints": names }));
    let set = set["breakpoints"].as_array().unwrap();
    let verified: Vec<bool> = set.iter().map(|own| own["verified"] == true).collect();
    assert_eq!(verified, [false, true, true, true, true], "{set:?}");
    let why = text(&set[0]["message"]);
    assert!(why.contains("what a command begins with: "), "{why}");
    let unfinished = json!({ "breakpoints": [{ "name": "x > 5 and" }] });
    let set = editor.ask("setFunctionBreakpoints", unfinished);
    let why = text(&set["breakpoints"][0]["message"]);
    assert!(!why.contains("command x > 5"), "{why}");
}

#[test]
fn a_value_that_cannot_be_is_told_in_words() {
    let refused = Editor::new().refused("launch", json!({ "program": "" }));
    assert_eq!(refused, "`program` is empty; give it a value, or leave it out");
    let mut editor = Editor::at_entry(drilling());
    let controller = editor.scope("Controller");
    let set = json!({ "variablesReference": controller, "name": "nope", "value": "1" });
    assert_eq!(editor.refused("setVariable", set), "there is no nope there");
    let set = json!({ "expression": "signals.cover", "value": "" });
    assert!(editor.refused("setExpression", set).ends_with(", and not nothing"));
    for (expression, belongs) in [
        ("x", "a whole number"),
        ("state.position", "a list of 6"),
        ("state.outputs", "a whole number from 0"),
    ] {
        let set = json!({ "expression": expression, "value": "abc" });
        let words = format!("there is the text \"abc\" where {belongs} belongs");
        let refused = editor.refused("setExpression", set);
        assert_eq!(refused, format!("`{expression}` cannot be that: {words}"));
    }
    for (expression, value, words) in [
        ("state.activity", "abc", "`abc` is none of `Idle`, "),
        ("state.activity", "", "an empty text is none of `Idle`, "),
        ("state.activity", "5", "there is the number 5 where one of `Idle`, "),
        ("x", "-99999999999999999999", "the number -1e+20 is too large; a whole number from -"),
    ] {
        let set = json!({ "expression": expression, "value": value });
        let refused = editor.refused("setExpression", set);
        let words = format!("`{expression}` cannot be that: {words}");
        assert!(refused.starts_with(&words), "{refused}");
    }
    let refused = editor.refused("next", json!([1, "line"]));
    assert_eq!(refused, "the arguments of next: there is a list where an object belongs");
}

/// That it is for other controllers is said of a job, whatever options it has.
#[test]
fn a_job_for_other_controllers_is_told_as_one_with_options_too() {
    let (_folder, job) = file("IMF_PBL\nREF XYZ\nMOVEABS X1000\n");
    for options in [json!([]), json!(["--zero=1mm,2mm,3mm"]), json!(["--no-ref"])] {
        let launch = json!({ "program": job, "model": "smcu", "jobOptions": options });
        let refused = Editor::new().refused("launch", launch);
        let words = "is a job file, and the smcu does not speak isel's @-format; choose one of ";
        assert!(refused.contains(words), "{options}: {refused}");
    }
}

#[test]
fn an_entry_of_controllers_is_one_controller() {
    let list = example("commands.txt");
    let within = json!([{ "program": list }]);
    for (request, entry, which) in [
        ("launch", json!({ "program": list, "controllers": within }), "controller 1 of the list"),
        ("launch", json!({ "name": "b", "controllers": within }), "controller b"),
        ("attach", json!({ "name": "b", "controllers": [{ "name": "2" }] }), "controller b"),
    ] {
        let refused = Editor::new().refused(request, json!({ "controllers": [entry] }));
        let words = "an entry of `controllers` is one controller and has no `controllers` itself";
        assert!(refused.starts_with(&format!("{which}: {words}")), "{refused}");
    }
}

#[test]
fn options_of_jobs_that_are_wrong_are_refused_with_what_is_right() {
    let (_folder, job) = file("IMF_PBL\nWPZERO\nMOVEABS X1000\n");
    for (options, wrong) in [
        (json!(["--zerro=1,2"]), "'--zerro'"),
        (json!(["--zero=1,2,foo"]), "\"foo\" is not a coordinate of Z"),
        (json!(["--yes"]), "--no-ref, --lenient, --zero"),
        (json!([5]), "`jobOptions[0]`: there is the number 5 where a text belongs"),
        (json!("--lenient"), "`jobOptions`: there is the text \"--lenient\" where a list belongs"),
    ] {
        let launch = json!({ "program": job, "machine": "mill", "jobOptions": options });
        let refused = Editor::new().refused("launch", launch);
        assert!(refused.contains(wrong), "{refused}");
    }
    // A remedy that is an option says where options go.
    let refused = Editor::new().refused("launch", json!({ "program": job, "machine": "mill" }));
    assert!(refused.contains("--no-ref") && refused.contains("`jobOptions`"), "{refused}");
    drop(Editor::at_entry(json!({ "program": job, "jobOptions": ["--no-ref"] })));
}

/// It ends where `vimc4 ncp run --lenient` ends it.
#[test]
fn a_lenient_reading_leaves_lines_out_and_says_where_the_job_ends() {
    let (_folder, job) = file("IMF_PBL\n(Steps: 64)\nREF XYZ\nMOVEABS X1000\nMOVABS Y1000\n");
    let lenient = json!({ "program": job, "machine": "mill", "jobOptions": ["--lenient"] });
    let mut editor = Editor::at_entry(lenient);
    let said = editor.events.iter().find(|(event, body)| {
        *event == "output" && text(&body["output"]).contains("line 5 cannot be carried out")
    });
    assert!(said.is_some(), "{:?}", editor.events);
    editor.walk("continue");
    assert_eq!(editor.value("x"), "80");
    let refused = Editor::new().refused("launch", json!({ "program": job, "machine": "mill" }));
    assert!(refused.contains("line 2: ") && refused.contains("line 5: "), "{refused}");
}

#[test]
fn waits_that_follow_each_other_all_stop_both_ways() {
    let job = "IMF_PBL\nREF XYZ\nMOVEABS X1000\nHALT\nGETTOOL 3\nWPTEACH\nHALT\n";
    let (_folder, program) = file(job);
    let mut editor = Editor::at_entry(json!({ "program": program }));
    for line in [4, 5, 6, 7] {
        let stop = editor.walk("continue");
        assert_eq!((&stop["reason"], editor.line()), (&json!("pause"), line));
    }
    assert_eq!(editor.walk("continue")["description"], "The end: everything is done");
    assert_ne!(editor.stack()[0].1, "HALT");
    for line in [7, 6, 5, 4] {
        let stop = editor.walk("reverseContinue");
        assert_eq!((&stop["reason"], editor.line()), (&json!("pause"), line));
        let listed = editor.console("list file");
        let marked = listed.lines().find(|line| line.starts_with('>')).unwrap();
        assert!(marked.contains(&format!(" {line} ")), "{listed}");
    }
    // Their lines are lines as others are: to stop at, and to go to.
    let set = editor.set_lines(&program, json!([{ "line": 6 }]));
    assert_eq!((&set[0]["verified"], &set[0]["line"]), (&json!(true), &json!(6)));
    for (line, reason) in [(5, "pause"), (6, "breakpoint"), (7, "pause")] {
        let stop = editor.walk("continue");
        assert_eq!((&stop["reason"], editor.line()), (&json!(reason), line));
        let hit = stop["hitBreakpointIds"].as_array().map_or(0, Vec::len);
        assert_eq!(hit, usize::from(line == 6), "{stop}");
    }
    let source = json!({ "path": program });
    let targets = editor.ask("gotoTargets", json!({ "source": source, "line": 5 }));
    let back = &targets["targets"][0];
    assert_eq!(back["label"], "Line 5: back to when it last began");
    editor.ask("goto", json!({ "threadId": 1, "targetId": back["id"] }));
    assert_eq!(editor.event("stopped")["reason"], "goto");
    assert_eq!(editor.line(), 5);
}

// --- what would harm a session ---

#[cfg(unix)]
#[test]
fn what_is_read_while_a_client_talks_is_a_file() {
    let (folder, program) = file("@07\r");
    let pipe = folder.path().join("pipe").to_str().unwrap().to_owned();
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status_in_time().unwrap().success());
    for wrong in [pipe.as_str(), "/dev/stdin", "-"] {
        let mut editor = Editor::new();
        for (request, about) in [
            ("launch", json!({ "program": wrong })),
            ("launch", json!({ "recording": wrong })),
            ("attach", json!({ "recording": wrong })),
            ("launch", json!({ "program": program, "machine": wrong })),
            ("launch", json!({ "program": program, "model": wrong })),
            ("launch", json!({ "serve": true, "pty": "none", "tcp": "none", "flash": wrong })),
        ] {
            let said = editor.refused(request, about.clone());
            assert!(said.contains("name a file"), "{about}: {said}");
        }
        // The client's messages are all there.
        editor.ask("launch", json!({ "program": program }));
    }
}

#[test]
fn no_expression_is_too_long_for_the_adapter() {
    let mut editor = Editor::at_entry(drilling());
    for chain in ["1+", "1*", "1-", "1 or ", "0 or ", "1 and ", "not ", "!", "-", "(", "x = 1 or "]
    {
        let expression = chain.repeat(60_000) + "1";
        for context in ["watch", "hover", "repl"] {
            let arguments = json!({ "expression": expression, "context": context });
            if let Err(refused) = editor.try_to("evaluate", arguments) {
                assert!(!refused.is_empty(), "{chain}");
            }
        }
    }
    let chain = "1+".repeat(8_000) + "1";
    let refused = editor.refused("evaluate", json!({ "expression": chain }));
    assert!(refused.contains("too many operators"), "{refused}");
    let sum = "1+".repeat(200) + "1";
    assert_eq!(editor.value(&sum), "201");
    let set = editor.set_lines(
        &example("commands.txt"),
        json!([
            { "line": 7, "condition": format!("{chain} = x") },
            { "line": 7, "logMessage": format!("{{{chain}}}") },
            { "line": 9 },
        ]),
    );
    assert_eq!(set[0]["verified"], false);
    assert!(text(&set[0]["message"]).contains("too many operators"), "{}", set[0]);
    editor.walk("continue");
    assert_eq!(editor.line(), 9);
}

#[test]
fn what_is_typed_moves_nothing() {
    for (configuration, most) in [
        (json!({ "recording": example("limit.jsonl") }), 9),
        (json!({ "recording": example("overlooked.jsonl") }), 6),
        (drilling(), 3),
        (
            json!({ "program": example("board.plt"), "model": "smcu", "machine": "board-plotter" }),
            3,
        ),
    ] {
        let mut editor = Editor::at_entry(configuration.clone());
        for step in 0..=most {
            let before = (editor.value("at"), editor.stack(), editor.all("State"));
            for typed in ["1+1", "help", "why", "x", "where", "breakpoints", "digest"] {
                // There is not always something to ask why of.
                let arguments = json!({ "expression": typed, "context": "repl" });
                let _ = editor.try_to("evaluate", arguments);
            }
            let after = (editor.value("at"), editor.stack(), editor.all("State"));
            assert_eq!(after, before, "{configuration} {step}");
            assert!(
                editor.events.iter().all(|(event, _)| event != "stopped"),
                "{configuration} {step}: {:?}",
                editor.events
            );
            editor.walk("next");
        }
    }
    // Neither does it at the beginning, where one has come back to.
    let mut editor = Editor::at_entry(drilling());
    for step in ["next", "next", "stepBack", "stepBack"] {
        editor.walk(step);
    }
    let before = editor.stack();
    assert_eq!(editor.console("1+1"), "2");
    assert_eq!(editor.stack(), before);
}

#[test]
fn codes_that_no_error_has_are_refused() {
    let mut editor = Editor::at_entry(json!({ "recording": example("limit.jsonl") }));
    let set = |editor: &mut Editor, codes: &str| {
        let option = json!({ "filterId": "errors", "condition": codes });
        let set = editor.ask("setExceptionBreakpoints", json!({ "filterOptions": [option] }));
        set["breakpoints"][0].clone()
    };
    for codes in ["~~", "abc", "3;5", "3,,5", "999", ",", "3,"] {
        let told = set(&mut editor, codes);
        assert_eq!(told["verified"], false, "{codes}");
        assert!(text(&told["message"]).contains("3, 5"), "{codes}: {told}");
    }
    for codes in ["", " ", "2", "2, 3", "2 3", " 2 , 3 "] {
        assert_eq!(set(&mut editor, codes)["verified"], true, "{codes}");
    }
}

#[test]
fn what_has_ended_goes_nowhere() {
    let mut editor = Editor::at_entry(drilling());
    let end = editor.walk("continue");
    assert_eq!(end["description"], "The end: everything is done");
    editor.ask("continue", json!({ "threadId": 1 }));
    editor.event("terminated");
    assert_eq!(editor.ask("threads", json!({}))["threads"], json!([]));
    for request in ["continue", "reverseContinue", "next", "stepBack", "stepOut", "stackTrace"] {
        let refused = editor.refused(request, json!({ "threadId": 1 }));
        assert!(refused.contains("has ended; restart begins again"), "{request}: {refused}");
    }
    let refused = editor.refused("evaluate", json!({ "expression": "x" }));
    assert!(refused.contains("have ended"), "{refused}");
    assert!(editor.events.iter().all(|(event, _)| event != "stopped"), "{:?}", editor.events);
    editor.ask("restart", json!({}));
    assert_eq!(editor.event("stopped")["reason"], "entry");
    assert_eq!(editor.ask("threads", json!({}))["threads"][0]["id"], 1);
}

#[test]
fn an_attach_that_is_refused_changes_nothing() {
    let mut editor = Editor::at_entry(drilling());
    editor.refused("attach", json!({}));
    editor.ask("restart", json!({}));
    editor.event("stopped");
    // Nor before anything is open.
    let mut editor = Editor::new();
    editor.refused("attach", json!({}));
    editor.ask("launch", drilling());
    editor.ask("configurationDone", json!({}));
    editor.event("stopped");
    editor.ask("restart", json!({}));
    editor.event("stopped");
}

#[test]
fn an_axis_is_set_where_it_is_listed() {
    let mut editor = Editor::at_entry(drilling());
    let axes = editor.scope("Axes");
    let set = editor
        .ask("setVariable", json!({ "variablesReference": axes, "name": "x", "value": "50" }));
    assert_eq!((&set["value"], editor.value("x")), (&json!("50"), "50".to_owned()));
    let axes = editor.scope("Axes");
    let far = json!({ "variablesReference": axes, "name": "x", "value": "far" });
    assert!(editor.refused("setVariable", far).contains("cannot be that"));
}

#[test]
fn one_steps_out_of_a_list_to_its_end_and_back_to_its_last_line() {
    let mut editor = Editor::at_entry(drilling());
    while editor.line() < 9 {
        editor.walk("next");
    }
    editor.steps("next", "instruction");
    let end = editor.walk("stepOut");
    assert_eq!((&end["description"], editor.line()), (&json!("The end: everything is done"), 10));
    for (program, last) in
        [(drilling(), 10), (json!({ "program": example("plate.ncp"), "machine": "mill" }), 0)]
    {
        let mut editor = Editor::at_entry(program);
        let mut lines = vec![editor.line()];
        while editor.walk("next")["reason"] == "step" {
            lines.push(editor.line());
        }
        assert!(last == 0 || lines.last() == Some(&last), "{lines:?}");
        while editor.walk("stepBack")["reason"] == "step" && lines.len() > 1 {
            assert_eq!(Some(editor.line()), lines.pop());
        }
        assert_eq!(lines.len(), 1);
    }
}

#[test]
fn quirks_are_as_profiles_have_them() {
    let mut configuration = drilling();
    configuration["quirks"] = json!({ "lost_steps": false });
    Editor::at_entry(configuration.clone());
    configuration["quirks"] = json!({ "lost_steps": [1] });
    let refused = Editor::new().refused("launch", configuration);
    assert!(refused.contains("`quirks`: the value of lost_steps"), "{refused}");
}

// --- several controllers, and recordings ---

#[test]
fn a_torn_recording_is_told_of() {
    let whole = fs::read(example("limit.jsonl")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("torn.jsonl");
    fs::write(&path, &whole[..whole.len() - 20]).unwrap();
    let lines = whole.iter().filter(|byte| **byte == b'\n').count();
    let mut editor = Editor::at_entry(json!({ "recording": path }));
    let told = editor.event("output");
    assert!(text(&told["output"]).contains(&format!("Line {lines} was torn off")), "{told}");
}

#[test]
fn a_recording_that_contradicts_the_emulation_is_opened_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed.jsonl");
    let whole = fs::read_to_string(example("overlooked.jsonl")).unwrap();
    fs::write(&path, whole.replace(r#""out":"F""#, r#""out":"0""#)).unwrap();
    let mut editor = Editor::at_entry(json!({ "recording": path }));
    let differs =
        "differs from the recording from 8.698 s on: reply to command 4: recorded 0, emulated F";
    let told = editor.event("output");
    assert!(text(&told["output"]).contains(differs), "{told}");
    let listed = "  1  8.698321617s  reply to command 4: recorded 0, emulated F (line 16)";
    assert_eq!(editor.console("differences"), listed);
    editor.console("replies recorded");
    assert!(editor.console("continue 9s").contains("answer to @A: 0"));
    assert!(editor.console("goto difference 1").starts_with("8.698321617s"));
    editor.disconnect();
}

#[test]
fn a_recording_is_no_program() {
    let mut editor = Editor::new();
    let refused = editor.refused("launch", json!({ "program": example("limit.jsonl") }));
    assert!(refused.contains("limit.jsonl is a recording"), "{refused}");
    assert!(refused.len() < 200, "{refused}");
}

#[test]
fn controllers_are_threads_and_go_each_by_itself() {
    let (_folder, endless) = file(ENDLESS);
    let mut editor = Editor::new();
    editor.ask(
        "launch",
        json!({
            "machine": "mill", "stopOnEntry": true,
            "controllers": [
                { "program": example("commands.txt"), "name": "drill" },
                { "program": endless, "name": "shuttle" },
            ],
        }),
    );
    editor.ask("configurationDone", json!({}));
    editor.event("stopped");
    editor.event("stopped");
    let threads = editor.ask("threads", json!({}));
    assert_eq!(
        threads["threads"],
        json!([{ "id": 1, "name": "drill" }, { "id": 2, "name": "shuttle" }])
    );
    // One runs without an end; the other is stepped through meanwhile.
    let going = editor.ask("continue", json!({ "threadId": 2 }));
    assert_eq!(going["allThreadsContinued"], false);
    for line in [3, 4, 7] {
        assert_eq!(editor.walk("next")["threadId"], 1);
        assert_eq!(editor.line(), line);
    }
    assert!(editor.refused("stackTrace", json!({ "threadId": 2 })).contains("pause comes first"));
    assert!(editor.refused("stackTrace", json!({ "threadId": 3 })).contains("1 to 2"));
    editor.ask("pause", json!({ "threadId": 2 }));
    assert_eq!(editor.event("stopped")["threadId"], 2);
    editor.ask("stackTrace", json!({ "threadId": 2 }));
    editor.disconnect();
}

#[test]
fn a_refusal_names_the_controller_of_the_list() {
    let plot = example("board.plt");
    let refused = |controllers: Value| {
        Editor::new().refused("launch", json!({ "machine": "mill", "controllers": controllers }))
    };
    let named = refused(json!([
        { "name": "drill", "program": example("commands.txt") },
        { "name": "board", "program": plot },
    ]));
    assert!(named.starts_with("controller board: ") && named.contains("is a plot"), "{named}");
    assert!(named.contains("the imc4") && named.contains("smcu"), "{named}");
    let unnamed = refused(json!([{ "program": plot }]));
    assert!(unnamed.starts_with("controller 1 of the list: "), "{unnamed}");
    // What stands beside the list is for those that have none of their own, and a recording has.
    let recording = json!({ "name": "before", "recording": example("limit.jsonl") });
    drop(Editor::at_entry(json!({
        "machine": "mill", "quirks": {},
        "controllers": [recording, { "program": example("commands.txt") }],
    })));
    let alone = json!({ "machine": "mill", "controllers": [recording] });
    let alone = Editor::new().refused("launch", alone);
    assert!(alone.starts_with("a recording has its own model, machine and quirks; "), "{alone}");
}

#[test]
fn recordings_are_debugged() {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("drill.jsonl");
    let recording = recording.to_str().unwrap();
    let run = Command::new(VIMC4)
        .args(["run", &example("commands.txt"), "--machine", "mill", "--record", recording])
        .output_in_time()
        .unwrap();
    assert!(run.status.success());
    let mut editor = Editor::new();
    assert!(editor.refused("attach", drilling()).contains("launch"));
    let name = PathBuf::from(recording);
    let name = name.file_name().unwrap().to_str().unwrap();
    editor.ask("attach", json!({ "recording": name, "cwd": folder.path(), "stopOnEntry": true }));
    editor.ask("configurationDone", json!({}));
    editor.event("stopped");
    let stack = editor.ask("stackTrace", json!({ "threadId": 1 }));
    let frame = &stack["stackFrames"][0];
    assert_eq!((&frame["name"], &frame["line"]), (&json!("@07"), &json!(1)));
    let reference = frame["source"]["sourceReference"].clone();
    let content = editor.ask(
        "source",
        json!({ "source": { "sourceReference": reference }, "sourceReference": reference }),
    );
    let lines = text(&content["content"]);
    assert_eq!(lines.lines().nth(2), Some("@0R7"));
    let set = editor.ask(
        "setBreakpoints",
        json!({
            "source": { "sourceReference": reference }, "breakpoints": [{ "line": 5 }],
        }),
    );
    assert_eq!(set["breakpoints"][0]["verified"], true);
    editor.walk("continue");
    assert_eq!(editor.stack()[0].1, "@0A800,4000,0,4000,-500,900,500,900");
    let end = editor.walk("continue");
    assert_eq!(end["description"], "The end of what is recorded");
    assert_eq!(editor.value("x"), "3200");
    editor.walk("reverseContinue");
    assert_eq!(editor.line(), 5);
}

#[test]
fn a_long_recording_is_read_on_while_nothing_is_asked() {
    let folder = tempfile::tempdir().unwrap();
    let commands = folder.path().join("long.txt");
    fs::write(&commands, "@01\n".to_owned() + &"@0P\n".repeat(9_000)).unwrap();
    let recording = folder.path().join("long.jsonl");
    let mut run = Command::new(VIMC4);
    run.arg("run").arg(&commands).arg("--record").arg(&recording);
    assert!(run.output_in_time().unwrap().status.success());
    let mut editor = Editor::new();
    editor.ask("attach", json!({ "recording": recording, "stopOnEntry": true }));
    editor.ask("configurationDone", json!({}));
    editor.event("stopped");
    // The rest of its lines is there a moment later.
    let reference = loop {
        let source = editor.event("loadedSource");
        assert_eq!(source["reason"], "changed");
        let reference = source["source"]["sourceReference"].clone();
        let content = editor.ask("source", json!({ "sourceReference": reference }));
        if text(&content["content"]).lines().count() == 9_001 {
            break reference;
        }
    };
    assert_eq!(editor.line(), 1);
    editor.set_lines_of(json!({ "sourceReference": reference }), json!([{ "line": 8_888 }]));
    editor.walk("continue");
    assert_eq!(editor.line(), 8_888);
}

// --- breaking off ---

#[test]
fn what_takes_long_is_paused_and_cancelled() {
    let (_folder, program) = file(ENDLESS);
    let mut editor = Editor::silent();
    editor.ask("initialize", json!({ "supportsProgressReporting": true }));
    editor.ask("launch", json!({ "program": program }));
    editor.ask("configurationDone", json!({}));
    // It runs, and answers meanwhile.
    let progress = editor.event("progressStart");
    assert_eq!(progress["cancellable"], true);
    editor.event("progressUpdate");
    editor.ask("threads", json!({}));
    assert!(editor.refused("stackTrace", json!({ "threadId": 1 })).contains("pause"));
    // A breakpoint that is set meanwhile counts from now on.
    editor.set_lines(&program, json!([{ "line": 3 }]));
    assert_eq!(editor.event("stopped")["reason"], "breakpoint");
    editor.event("progressEnd");
    editor.set_lines(&program, json!([]));
    editor.ask("continue", json!({ "threadId": 1 }));
    editor.ask("pause", json!({ "threadId": 1 }));
    assert_eq!(editor.event("stopped")["reason"], "pause");
    assert_eq!(editor.stack()[0].0.clamp(2, 4), editor.line());
    editor.ask("continue", json!({ "threadId": 1 }));
    let progress = editor.event("progressStart");
    editor.ask("cancel", json!({ "progressId": progress["progressId"] }));
    assert_eq!(editor.event("stopped")["reason"], "pause");
    // Something that will never be is looked for.
    let asked = editor.send("evaluate", json!({ "expression": "next y = 5", "context": "repl" }));
    let cancel = editor.send("cancel", json!({ "requestId": asked }));
    assert_eq!(editor.answer(asked), Err("cancelled".to_owned()));
    assert_eq!(editor.answer(cancel), Ok(Value::Null));
    // It shows how far it has come, and is cancelled by that, too.
    let asked = editor.send("evaluate", json!({ "expression": "next y = 5", "context": "repl" }));
    let progress = editor.event("progressStart");
    assert_eq!(progress["title"], "next y = 5");
    assert!(text(&progress["message"]).starts_with("at "), "{progress}");
    let cancel = editor.send("cancel", json!({ "progressId": progress["progressId"] }));
    assert_eq!(editor.answer(asked), Err("cancelled".to_owned()));
    assert_eq!(editor.answer(cancel), Ok(Value::Null));
    // What waits behind it is cancelled as well.
    let asked = editor.send("evaluate", json!({ "expression": "next y = 5", "context": "repl" }));
    let waiting = editor.send("threads", json!({}));
    let cancel = editor.send("cancel", json!({ "requestId": waiting }));
    let first = editor.send("cancel", json!({ "requestId": asked }));
    assert_eq!(editor.answer(asked), Err("cancelled".to_owned()));
    let mut answers = Vec::new();
    for _ in 0..3 {
        let message = loop {
            let message = editor.hear();
            if message["type"] == "response" {
                break message;
            }
        };
        answers.push((
            message["request_seq"].as_i64().unwrap(),
            message["success"].as_bool().unwrap(),
        ));
    }
    answers.sort_unstable();
    assert_eq!(answers.iter().map(|(seq, _)| *seq).collect::<Vec<_>>(), [waiting, cancel, first]);
    // A step that does not end, and a way back that is long.
    editor.set_lines(&program, json!([{ "line": 2, "condition": "y = 5" }]));
    editor.ask("reverseContinue", json!({ "threadId": 1 }));
    editor.ask("pause", json!({ "threadId": 1 }));
    editor.event("stopped");
    editor.disconnect();
}

#[test]
fn too_many_requests_are_refused() {
    let (_folder, program) = file(ENDLESS);
    let mut editor = Editor::at_entry(json!({ "program": program }));
    let asked = editor.send("evaluate", json!({ "expression": "next y = 5", "context": "repl" }));
    let crowd: Vec<i64> = (0..500).map(|_| editor.send("threads", json!({}))).collect();
    editor.send("cancel", json!({ "requestId": asked }));
    let (mut refused, mut answered) = (0, 0);
    for _ in 0..crowd.len() + 2 {
        let message = editor.hear();
        match message["success"].as_bool() {
            Some(false) if text(&message["message"]).contains("requests wait already") => {
                refused += 1
            }
            Some(_) => answered += 1,
            None => {}
        }
    }
    assert_eq!(refused + answered, crowd.len() + 2);
    assert!(answered >= 3, "{answered}");
    editor.ask("threads", json!({}));
}

#[test]
fn a_client_that_vanishes_ends_the_session() {
    let mut editor = Editor::new();
    editor.adapter.as_mut().unwrap().input = None;
    assert_eq!(editor.leaves(), Some(1));
    // Also while something runs that has no end.
    let (_folder, program) = file(ENDLESS);
    let mut editor = Editor::new();
    editor.ask("launch", json!({ "program": program }));
    editor.ask("configurationDone", json!({}));
    editor.adapter.as_mut().unwrap().input = None;
    assert_eq!(editor.leaves(), Some(1));
}

#[test]
fn clients_come_and_go_at_a_port() {
    let mut command = Command::new(VIMC4);
    let mut adapter = Process::start(command.args(["dap", "--port", "0"]).stderr(Stdio::piped()));
    let errors = adapter.errors();
    let line = adapter.line();
    let address = line.strip_prefix("debug adapter at ").unwrap().to_owned();
    // A page in a browser may send a request as well, and is no editor.
    let mut page = connect(&address);
    let message = framed(&json!({ "seq": 1, "type": "request", "command": "initialize" }));
    page.write_all(format!("POST / HTTP/1.1\r\nHost: {address}\r\n{message}").as_bytes()).unwrap();
    let mut from = BufReader::new(page);
    let refused = read_message(&mut from).unwrap();
    assert_eq!((&refused["success"], read_message(&mut from)), (&json!(false), None));
    let told = errors.recv_timeout(LIMIT).unwrap();
    assert!(told.contains("closed the connection of 127.0.0.1:"), "{told}");
    assert!(told.ends_with("the first line is neither Content-Length nor Content-Type"), "{told}");
    let talk = |leave: bool| {
        let mut stream = connect(&address);
        let mut from = BufReader::new(stream.try_clone().unwrap());
        let ask = |stream: &mut TcpStream,
                   from: &mut BufReader<TcpStream>,
                   seq: i64,
                   command: &str,
                   arguments: Value| {
            let message = json!({ "seq": seq, "type": "request", "command": command, "arguments": arguments });
            stream.write_all(framed(&message).as_bytes()).unwrap();
            loop {
                let message = read_message(from).unwrap();
                if message["type"] == "response" {
                    assert_eq!(
                        (&message["request_seq"], &message["success"]),
                        (&json!(seq), &json!(true))
                    );
                    return;
                }
            }
        };
        ask(&mut stream, &mut from, 1, "initialize", json!({}));
        ask(&mut stream, &mut from, 2, "launch", drilling());
        if leave {
            stream.shutdown(Shutdown::Both).unwrap();
            return;
        }
        ask(&mut stream, &mut from, 3, "disconnect", json!({}));
        // The adapter closes its end.
        while read_message(&mut from).is_some() {}
    };
    // More of them than may be there at once.
    for round in 0..20 {
        talk(round % 2 == 0);
    }
}

// --- what is wrong ---

#[test]
fn nothing_bad_is_left_without_an_answer() {
    let mut editor = Editor::silent();
    assert_eq!(editor.refused("threads", json!({})), "initialize comes first");
    Editor::silent().disconnect();
    assert!(editor.refused("initialize", json!({ "pathFormat": "uri" })).contains("uri"));
    editor.ask("initialize", json!({}));
    assert_eq!(editor.refused("initialize", json!({})), "initialize comes only once");
    assert_eq!(editor.refused("readMemory", json!({})), "there is no request readMemory");
    for arguments in [
        json!({}),
        json!([1]),
        json!("x"),
        json!({ "threadId": 1 }),
        json!({ "frameId": -1 }),
        json!({ "variablesReference": 99, "name": "x", "value": "" }),
    ] {
        for row in vimc4_dap::REQUESTS {
            if matches!(
                row.command,
                "initialize" | "disconnect" | "terminate" | "launch" | "attach"
            ) {
                continue;
            }
            // An answer; not what is in it.
            let _ = editor.try_to(row.command, arguments.clone());
        }
    }
    for (configuration, what) in [
        (json!({}), "nothing to debug is named"),
        (json!({ "program": "/nowhere.txt" }), "cannot read /nowhere.txt"),
        (json!({ "program": 5 }), "configuration"),
        (json!({ "program": "-" }), "the adapter reads its client's messages from there"),
        (json!({ "recording": "-", "cwd": "/tmp" }), "`recording` cannot be -"),
        (json!({ "program": "/dev/stdin" }), "`program` cannot be /dev/stdin"),
        (
            json!({ "program": example("commands.txt"), "controllers": [{ "name": "a" }, { "name": "a" }] }),
            "two controllers are called a",
        ),
        (json!({ "program": example("commands.txt"), "recording": "x" }), "not both"),
        (json!({ "program": example("commands.txt"), "model": "nonsense" }), "nonsense"),
        (json!({ "program": example("commands.txt"), "machine": "nonsense" }), "nonsense"),
        (
            json!({ "program": example("commands.txt"), "quirks": { "nonsense": "1" } }),
            "no quirk nonsense",
        ),
    ] {
        let refused = editor.refused("launch", configuration.clone());
        assert!(refused.contains(what), "{configuration}: {refused}");
        assert!(!refused.contains("standard input"), "{configuration}: {refused}");
    }
    for (bytes, what) in [
        ("Content-Length: 3\r\n\r\n{{{", "no JSON"),
        ("Content-Length: 2\r\n\r\n[]", "a request has"),
        ("Content-Length: x\r\n\r\n", "Content-Length"),
        ("gibberish\r\n\r\n", "Content-Length"),
    ] {
        editor.write(bytes.as_bytes());
        let refused = editor.answer(0).unwrap_err();
        assert!(refused.contains(what), "{bytes}: {refused}");
    }
    let long = 2 << 20;
    editor.write(format!("Content-Length: {long}\r\n\r\n").as_bytes());
    // Before it comes.
    assert!(editor.answer(0).unwrap_err().contains("bytes at most"));
    editor.write(&vec![b' '; long]);
    editor.ask("launch", drilling());
    assert!(editor.refused("launch", drilling()).contains("restart"));
    editor.disconnect();

    // Who speaks another language is left alone.
    let mut editor = Editor::silent();
    editor.write("x".repeat(20_000).as_bytes());
    let refused = editor.answer(0).unwrap_err();
    assert_eq!(refused, "a header has a line without an end; the session ends");
    assert_eq!(editor.leaves(), Some(1));
}

/// A test that asks for it by its name is above, for every request there is.
#[test]
fn every_request_of_the_table_is_asked_for_here() {
    let here = include_str!("main.rs");
    for row in vimc4_dap::REQUESTS {
        let asked = format!("\"{}\"", row.command);
        assert!(here.contains(&asked), "nobody asks for {}", row.command);
    }
}

// --- what is written about it ---

/// The rows of a table that begin with code: `| `NAME` | …`.
fn rows(text: &str, heading: &str) -> Vec<Vec<String>> {
    let section = text.split(heading).nth(1).unwrap_or_else(|| panic!("there is no {heading}"));
    let section = section.split("\n## ").next().unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    rows.map(|row| row.trim_matches('|').split(" | ").map(|cell| cell.trim().to_owned()).collect())
        .collect()
}

#[test]
fn the_page_has_the_tables_of_the_program() {
    let page = include_str!("../../../docs/debugging.md");
    let requests: Vec<Vec<String>> = vimc4_dap::REQUESTS
        .iter()
        .map(|row| vec![format!("`{}`", row.command), row.about.to_owned()])
        .collect();
    assert_eq!(rows(page, "## The requests"), requests);
    let attributes: Vec<Vec<String>> = vimc4_dap::ATTRIBUTES
        .iter()
        .map(|(name, kind, about)| {
            vec![format!("`{name}`"), (*kind).to_owned(), (*about).to_owned()]
        })
        .collect();
    assert_eq!(rows(page, "## The attributes"), attributes);
}

/// What Visual Studio Code is told of the attributes is what there is.
#[test]
fn the_extension_of_visual_studio_code_knows_the_attributes() {
    let extension: Value =
        serde_json::from_str(include_str!("../../../editors/vscode/package.json")).unwrap();
    let debugger = &extension["contributes"]["debuggers"][0];
    assert_eq!(debugger["type"], "vimc4");
    let known: BTreeSet<String> = vimc4_dap::ATTRIBUTES
        .iter()
        .map(|(name, ..)| (*name).to_owned())
        .filter(|name| name != "noDebug")
        .collect();
    for request in ["launch", "attach"] {
        let properties = &debugger["configurationAttributes"][request]["properties"];
        for (name, kind, about) in vimc4_dap::ATTRIBUTES {
            if let Some(property) = properties.get(name) {
                assert_eq!(
                    (text(&property["type"]), text(&property["description"])),
                    (kind.to_owned(), about.to_owned())
                );
            }
        }
        let named: BTreeSet<String> = properties.as_object().unwrap().keys().cloned().collect();
        assert!(named.is_subset(&known), "{named:?}");
        assert!(request == "attach" || named == known, "{named:?}");
    }
}

/// The configurations that the page shows are opened.
#[test]
fn the_configurations_of_the_page_are_opened() {
    let page = include_str!("../../../docs/debugging.md");
    let mut opened = 0;
    for block in page.split("```json\n").skip(1) {
        let block = block.split("```").next().unwrap();
        let file: Value =
            serde_json::from_str(block).unwrap_or_else(|error| panic!("{error}: {block}"));
        for configuration in file["configurations"].as_array().unwrap() {
            assert_eq!(configuration["type"], "vimc4");
            let request = text(&configuration["request"]);
            let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
            let folder = fs::canonicalize(root).unwrap().to_str().unwrap().to_owned();
            let text = configuration.to_string().replace("${workspaceFolder}", &folder);
            let text = text.replace("${file}", &example("commands.txt"));
            // Others may have that port.
            let text = text.replace("127.0.0.1:4004", "127.0.0.1:0");
            let mut editor = Editor::new();
            editor.ask(&request, serde_json::from_str(&text).unwrap());
            editor.ask("configurationDone", json!({}));
            editor.event("stopped");
            opened += 1;
        }
    }
    assert!(opened >= 4, "{opened}");
}
