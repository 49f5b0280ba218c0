//! How long it takes until what takes long has ended, once somebody does not want to wait for it.
//!
//! A measurement and no test: it takes a while, and what is right depends on the computer. It is to be run
//! of a program that was built to be fast:
//!
//! ```sh
//! cargo test --release -p vimc4-emulator --test dap -- --ignored --nocapture cancels
//! ```

use std::fmt::Write;
use std::fs;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::editor::Editor;
use crate::{ENDLESS, example, file};

/// So many of each kind.
const EACH: u64 = 25;

/// Lets something begin, sends what ends it, and says how long that took until the end was heard of.
fn ended(editor: &mut Editor, begin: &Began<'_>, number: u64) -> Duration {
    let request = match begin {
        Began::Walk(command) => {
            editor.ask(command, json!({ "threadId": 1 }));
            None
        }
        Began::Console(line) => {
            Some(editor.send("evaluate", json!({ "expression": line, "context": "repl" })))
        }
        Began::Open(configuration) => Some(editor.send("launch", (*configuration).clone())),
    };
    // At another moment each time.
    thread::sleep(Duration::from_millis(100 + number * 17 % 200));
    let begun = Instant::now();
    match request {
        None => {
            editor.send("pause", json!({ "threadId": 1 }));
            assert_eq!(editor.heard_of("stopped")["text"], "paused");
        }
        Some(request) => {
            editor.send("cancel", json!({ "requestId": request }));
            let answer = editor.heard_answer(request);
            assert_eq!(answer["message"], "cancelled", "{answer}");
        }
    }
    begun.elapsed()
}

enum Began<'a> {
    Walk(&'a str),
    Console(&'a str),
    Open(&'a Value),
}

/// An editor that looks at a program without an end which has run for a while.
fn after_a_while(program: &str) -> Editor {
    let mut editor = Editor::at_entry(json!({ "program": program }));
    editor.ask("continue", json!({ "threadId": 1 }));
    thread::sleep(Duration::from_secs(4));
    editor.ask("pause", json!({ "threadId": 1 }));
    editor.event("stopped");
    editor
}

#[expect(clippy::too_many_lines, reason = "the measurement goes step by step")]
#[test]
#[ignore = "a measurement, which is to be run of a release build"]
fn cancels() {
    let (_folder, endless) = file(ENDLESS);
    let (_other, round) =
        file("; axes: 7\n01,9000,0,21,0,21,0,21\n0-1,9000,0,21,0,21,0,21\n30,-2\n9\n");
    let (_long, long) = file("@07\r\n@0A8000000,2000,0,21,0,21,0,21\r\n");
    let commands: String = "@07\n".to_owned() + &"@0A1,9000,0,21,0,21,0,21\n".repeat(400_000);
    let (_list, list) = file(&commands);
    let folder = tempfile::tempdir().unwrap();
    let job = folder.path().join("job.ncp");
    let head = fs::read_to_string(example("plate.ncp")).unwrap();
    let lines: Vec<&str> = head.lines().collect();
    let middle = lines.iter().position(|line| line.starts_with("MOVEABS")).unwrap_or(6);
    let mut text = lines[..middle].join("\n");
    for number in 0..400_000 {
        write!(text, "\nMOVEABS X{} Y0", number % 1_000).unwrap();
    }
    fs::write(&job, text + "\nPROGEND\n").unwrap();
    let job = json!({ "program": job.to_str().unwrap(), "machine": "mill" });

    let mut all = Vec::new();
    let mut measure = |name: &str, editor: &mut dyn FnMut(u64) -> Editor, begin: &Began<'_>| {
        let mut times = Vec::new();
        let mut kept = None;
        for number in 0..EACH {
            // What was cancelled can be begun again; what was opened cannot.
            let kept_one = kept.take().filter(|_| !matches!(begin, Began::Open(_)));
            let mut own = kept_one.unwrap_or_else(|| editor(number));
            times.push(ended(&mut own, begin, number));
            kept = Some(own);
        }
        times.sort();
        println!(
            "{name:<44} median {:?}, worst {:?}",
            times[times.len() / 2],
            times[times.len() - 1]
        );
        all.extend(times);
    };
    let function = |editor: &mut Editor, condition: &str| {
        let breakpoints = json!({ "breakpoints": [{ "name": condition }] });
        editor.ask("setFunctionBreakpoints", breakpoints);
    };
    measure(
        "continue",
        &mut |_| Editor::at_entry(json!({ "program": endless })),
        &Began::Walk("continue"),
    );
    measure(
        "next, over a loop without an end",
        &mut |_| {
            let mut editor = Editor::at_entry(json!({ "program": round }));
            editor.steps("stepIn", "line");
            editor.steps("stepIn", "line");
            editor
        },
        &Began::Walk("stepOut"),
    );
    measure(
        "continue, a breakpoint counts each pulse",
        &mut |_| {
            let mut editor = Editor::at_entry(json!({ "program": long }));
            editor.ask(
                "setDataBreakpoints",
                json!({ "breakpoints": [
            { "dataId": "0:axes.x.position", "hitCondition": "8000000" }
        ] }),
            );
            editor
        },
        &Began::Walk("continue"),
    );
    measure(
        "evaluate `next x > 100000`",
        &mut |_| Editor::at_entry(json!({ "program": endless })),
        &Began::Console("next x > 100000"),
    );
    measure(
        "reverseContinue, an expression",
        &mut |_| {
            let mut editor = after_a_while(&round);
            function(&mut editor, "x * 2 = 17");
            editor
        },
        &Began::Walk("reverseContinue"),
    );
    measure(
        "evaluate `last …`",
        &mut |_| after_a_while(&round),
        &Began::Console("last x = 1 and port 0 bit 3 on"),
    );
    measure(
        "evaluate `who changed …`",
        &mut |_| after_a_while(&round),
        &Began::Console("who changed signals.estop"),
    );
    measure(
        "evaluate `what if …`",
        &mut |_| {
            let mut editor = after_a_while(&round);
            editor.console("goto start");
            editor.event("stopped");
            editor
        },
        &Began::Console("what if press on"),
    );
    measure("launch of a long job", &mut |_| Editor::new(), &Began::Open(&job));
    measure(
        "continue in a long list",
        &mut |_| Editor::at_entry(json!({ "program": list })),
        &Began::Walk("continue"),
    );
    all.sort();
    println!(
        "{} cancels: median {:?}, worst {:?}",
        all.len(),
        all[all.len() / 2],
        all[all.len() - 1]
    );
}
