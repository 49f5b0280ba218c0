//! `vimc4 run` from outside.

#![expect(clippy::unwrap_used, reason = "a test that cannot run the command has failed")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime};

use serde_json::{Value, json};

/// A program of this folder.
fn program(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs").join(name)
}

fn vimc4(file: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
    command.arg("run").arg(file).args(arguments.split_whitespace());
    command.stdin(Stdio::null()).output_in_time().unwrap()
}

/// Runs a program of this folder: exit code and standard output. Nothing but complaints goes to
/// standard error, in particular no progress, since nobody is there to watch.
fn run(name: &str, arguments: &str) -> (i32, String) {
    let output = vimc4(&program(name), arguments);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(errors, "", "{name} {arguments}");
    (output.status.code().unwrap(), String::from_utf8(output.stdout).unwrap())
}

/// The same as JSON.
fn summary(name: &str, arguments: &str) -> (i32, Value) {
    let (code, text) = run(name, &format!("{arguments} --json"));
    assert_eq!(text.lines().count(), 1, "{text}");
    (code, serde_json::from_str(&text).unwrap())
}

/// The line that says why it ended.
fn ended(text: &str) -> &str {
    text.lines().find_map(|line| line.strip_prefix("ended     ")).unwrap()
}

/// Standard error when the arguments or the file are wrong.
fn complaint(file: &Path, arguments: &str) -> String {
    let output = vimc4(file, arguments);
    assert_eq!(output.status.code(), Some(2), "{file:?} {arguments}");
    assert!(output.stdout.is_empty(), "{file:?} {arguments}");
    String::from_utf8(output.stderr).unwrap()
}

const SECOND: u64 = 1_000_000_000;

#[test]
fn a_command_list_is_answered_line_by_line() {
    let (code, text) = run("drill.txt", "--machine mill");
    assert_eq!(code, 0, "{text}");
    let answers: Vec<(usize, &str, &str)> = text
        .lines()
        .take(6)
        .map(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            (words[0].parse().unwrap(), words[1], words[2])
        })
        .collect();
    assert_eq!(
        answers,
        [
            (2, "@07", "0"),
            (3, "@0d2500,2500,1500", "0"),
            (4, "@0R7", "0"),
            (7, "@0M2400,4000,1600,4000,-500,900,0,900", "0"),
            (9, "@0A800,4000,0,4000,-500,900,500,900", "0"),
            (10, "@0P", "0000C80000640FFFE0C"),
        ]
    );
    // The mill has 80 steps/mm on X, 100 on Z.
    let x: Vec<&str> = text.lines().find(|l| l.starts_with('X')).unwrap().split(' ').collect();
    assert!(x.contains(&"3,200") && x.contains(&"40.000"), "{text}");
    assert!(text.contains("at 19200 baud"), "{text}");
    assert_eq!(ended(&text), "every command was answered");
}

#[test]
fn what_it_says_is_what_happened() {
    let (code, value) = summary("drill.txt", "--machine mill");
    assert_eq!((code, &value["ended"]), (0, &json!("done")));
    assert_eq!(value["answers"].as_array().unwrap().len(), 6);
    assert_eq!(value["answers"][0]["command"], "@07");
    // To the switches and a step out of them, then 2,400 and 800.
    assert_eq!(value["axes"]["X"]["position"], 3_200);
    assert_eq!(value["axes"]["X"]["travelled"], 4_001 + 1 + 2_400 + 800);
    assert_eq!(value["axes"]["Z"]["position"], -500);
    assert_eq!(value["axes"]["Z"]["travelled"], 2_001 + 1 + 500 + 1_000);
    let spans = value["answers"].as_array().unwrap().iter();
    let took: u64 = spans.map(|answer| answer["took_ns"].as_u64().unwrap()).sum();
    assert_eq!(value["time_ns"], took);
    // The references one by one, then a diagonal, then Z, X, Z.
    let mm =
        (4_002.0 + 4_002.0) / 80.0 + 20.02 + 2_400f64.hypot(1_600.0) / 80.0 + 5.0 + 10.0 + 10.0;
    assert!((value["path_mm"].as_f64().unwrap() - mm).abs() < 1e-6, "{} {mm}", value["path_mm"]);
}

#[test]
fn an_error_reply_ends_it_with_its_line() {
    let (code, text) = run("typo.txt", "");
    assert_eq!(code, 1);
    assert!(ended(&text).contains("line 4 (`@0A5o0,1500"), "{text}");
    assert!(ended(&text).contains("answered 1"), "{text}");
    assert!(!text.contains("@0A700"), "what comes after an error is not sent: {text}");
    let (_, value) = summary("typo.txt", "");
    assert_eq!((&value["ended"], &value["line"]), (&json!("error"), &json!(4)));
    assert_eq!(value["axes"]["X"]["position"], 500);
}

#[test]
fn a_program_is_stored_and_runs_for_some_rounds() {
    for (rounds, end) in [(1, "1 round"), (4, "4 rounds")] {
        let (code, text) = run("shuttle.txt", &format!("--machine mill --loops {rounds}"));
        assert_eq!(code, 3, "{text}");
        assert_eq!(ended(&text), format!("the program has made {end}"));
        assert!(text.contains("stored 7 lines"), "{text}");
        let (_, value) = summary("shuttle.txt", &format!("--loops {rounds}"));
        assert_eq!(value["rounds"], rounds);
        assert_eq!(value["axes"]["X"]["travelled"], rounds * 3 * 2_400);
        assert_eq!(value["axes"]["Z"]["travelled"], rounds * 3 * 300);
        assert_eq!(value["axes"]["X"]["position"], 0);
        // The pause of a second is in every round.
        assert!(value["time_ns"].as_u64().unwrap() > rounds * SECOND);
    }
}

#[test]
fn time_is_virtual_and_ends_when_it_should() {
    let began = Instant::now();
    let (code, value) = summary("shuttle.txt", "--for 10min");
    assert_eq!((code, &value["ended"]), (3, &json!("for")));
    assert_eq!(value["time_ns"], 600 * SECOND);
    assert!(value["rounds"].as_u64().unwrap() > 100);
    assert!(began.elapsed() < Duration::from_secs(60));
    // In the middle of a move, which counts as far as it has come.
    let (_, value) = summary("shuttle.txt", "--for 200ms");
    assert_eq!(value["axes"]["X"]["travelled"], value["axes"]["X"]["position"]);
    assert!((1..1_200).contains(&value["axes"]["X"]["position"].as_u64().unwrap()));
    assert_eq!(value["line"], 6);
}

#[test]
fn waiting_for_nothing_ends_it_at_once() {
    for (name, place, why) in [
        ("gate.txt", "line 4 (`o0,2,0,-1`)", "program waits for a port"),
        ("poll.txt", "line 4 (`30,-1`)", "it goes round and round"),
        ("halt.txt", "line 2 (`30,0`)", "program halted on itself"),
    ] {
        let (code, text) = run(name, "");
        assert_eq!(code, 3, "{text}");
        assert!(ended(&text).contains(place) && ended(&text).contains(why), "{text}");
        let (_, value) = summary(name, "");
        assert_eq!(value["ended"], "waits");
        assert!(value["time_ns"].as_u64().unwrap() < SECOND, "{value}");
        assert_eq!(value["rounds"], 0);
    }
    let (code, text) = run("shuttle.txt", "--press stop@300ms");
    assert_eq!(code, 3);
    assert!(ended(&text).contains("program stopped"), "{text}");
    let (code, text) = run("shuttle.txt", "--press estop");
    assert_eq!((code, ended(&text)), (3, "START did not start the program"));
}

#[test]
fn the_outside_world_does_what_it_is_told() {
    let move_ns = summary("halt.txt", "").1["time_ns"].as_u64().unwrap();
    assert!(move_ns < SECOND);
    for name in ["gate.txt", "poll.txt"] {
        let (code, value) = summary(name, "--input 0.2=1@2s");
        assert_eq!((code, &value["ended"]), (0, &json!("done")), "{value}");
        assert_eq!(value["axes"]["X"]["position"], 1_280);
        let time = value["time_ns"].as_u64().unwrap();
        assert!((2 * SECOND..3 * SECOND).contains(&time), "{time}");
        // Known from the beginning it holds nobody up.
        let (code, value) = summary(name, "--input 0.2=1");
        assert_eq!(code, 0);
        assert!(value["time_ns"].as_u64().unwrap() < SECOND, "{value}");
        // On and off again between two moves is too late.
        let (code, value) = summary(name, "--input 0.2=1 --input 0.2=0@50ms");
        assert_eq!((code, &value["ended"]), (3, &json!("waits")), "{value}");
    }
    let arguments = "--press stop@300ms --press start@5s --loops 1";
    let (code, value) = summary("shuttle.txt", arguments);
    assert_eq!((code, &value["rounds"]), (3, &json!(1)));
    assert_eq!(value["axes"]["X"]["travelled"], 3 * 2_400);
    assert!(value["time_ns"].as_u64().unwrap() > 5 * SECOND);
}

#[test]
fn a_stopped_command_goes_on_with_the_next_if_that_is_its_purpose() {
    let (code, value) = summary("stop.txt", "--press stop@1s");
    assert_eq!(code, 0, "{value}");
    let answers: Vec<&Value> = value["answers"].as_array().unwrap().iter().collect();
    let answers: Vec<&str> = answers.iter().map(|a| a["answer"].as_str().unwrap()).collect();
    assert_eq!(answers, ["0", "F", "0", "0002328000000000000"]);
    assert_eq!(value["axes"]["X"]["travelled"], 9_000);

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("stopped.txt");
    fs::write(&file, "@01\n@0A9000,3000\n@0A10,900\n").unwrap();
    let output = vimc4(&file, "--press stop@1s");
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(ended(&text).contains("line 2") && ended(&text).contains("stopped"), "{text}");
}

#[test]
fn an_error_of_a_program_is_found_in_the_file() {
    let (code, text) = run("beyond.txt", "--machine mill");
    assert_eq!(code, 1);
    assert!(ended(&text).contains("line 6 (`m60000"), "{text}");
    assert!(ended(&text).contains("2: limit switch"), "{text}");
    assert_eq!(run("beyond.txt", "--machine bench").0, 0);
    // What cannot be stored is found before anything moves.
    let (code, text) = run("beyond.txt", "--axes 3");
    assert_eq!(code, 1);
    assert!(ended(&text).contains("line 2 (`77`) was answered 3"), "{text}");
}

#[test]
fn a_program_can_be_part_of_a_command_list() {
    let (code, value) = summary("stored.txt", "--model imc-s8");
    assert_eq!(code, 0, "{value}");
    assert_eq!(value["axes"]["X"]["travelled"], 800);
    assert!(value["time_ns"].as_u64().unwrap() > 2 * SECOND);
    // An error is the answer, and found in the file.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("far.txt");
    fs::write(&file, "@01\n@0i\n0400,800\n\n; far\n090000,4000\n9\n@0S\n").unwrap();
    let output = vimc4(&file, "--model imc-m --machine mill");
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("line 6 (`090000,4000`) ended the program with 2"), "{text}");
    assert!(ended(&text).contains("line 8 (`@0S`) was answered 2"), "{text}");
    // The older ones need the button.
    let (code, text) = run("stored.txt", "--model imc4");
    assert_eq!(code, 1);
    assert!(ended(&text).contains("line 8 (`@0S`) was answered G"), "{text}");
}

#[test]
fn a_list_that_stores_a_program_starts_it_at_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("whole.txt");
    fs::write(&file, "@01\n@0A300,900\n@0i\n0500,900\n520\n9\n").unwrap();
    for (arguments, seconds) in [("", 2..4), ("--press start@20s", 22..24)] {
        let output = vimc4(&file, &format!("{arguments} --json"));
        assert_eq!(output.status.code(), Some(0));
        let value: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(value["text"], "the program came to its end");
        assert_eq!(value["axes"]["X"]["position"], 800);
        let time = value["time_ns"].as_u64().unwrap() / SECOND;
        assert!(seconds.contains(&time), "{value}");
    }
    // If it never is, that is said too.
    let output = vimc4(&file, "--press estop@5s --press start@6s");
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!((output.status.code(), ended(&text)), (Some(3), "START did not start the program"));
}

#[test]
fn inputs_are_there_from_the_beginning() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ports.txt");
    fs::write(&file, "@0b0\n@01\n@0A900,900\n@0b0\n").unwrap();
    let output = vimc4(&file, "--input 0.2=1 --input 0.3=1@0.5s --json");
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    let answers: Vec<_> = value["answers"].as_array().unwrap().iter().collect();
    assert_eq!((&answers[0]["answer"], &answers[3]["answer"]), (&json!("0C4"), &json!("0CC")));
}

#[test]
fn everything_outside_can_be_set_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("move.txt");
    fs::write(&file, "@01\n@0A900,900\n").unwrap();
    for (arguments, answer) in [
        ("", "0"),
        ("--input power-ok=0", "9"),
        ("--input power-ok=0 --input power-ok=1", "0"),
        ("--input cover=open", "H"),
        ("--input cover=0", "H"),
        ("--input cover=open --input cover=closed", "0"),
    ] {
        let output = vimc4(&file, &format!("{arguments} --json"));
        let value: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(value["answers"][1]["answer"], answer, "{arguments}: {value}");
    }
}

#[test]
fn every_axis_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("turn.txt");
    fs::write(&file, "0100,900,0,900,0,900,6000,2000\n").unwrap();
    let output = vimc4(&file, "--axes 15 --machine mill-4axis --json");
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    let a = &value["axes"]["A"];
    assert_eq!(
        (&a["position"], &a["unit"], &a["unit_per_step"]),
        (&json!(6_000), &json!("°"), &json!(0.015))
    );
    assert!((value["path_mm"].as_f64().unwrap() - 1.25).abs() < 1e-9, "a turn is no way: {value}");
}

#[test]
fn lines_may_end_as_they_like() {
    let text = fs::read_to_string(program("shuttle.txt")).unwrap();
    let expected = summary("shuttle.txt", "--loops 2");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("shuttle.txt");
    for (end, last) in [("\r\n", ""), ("\r", ""), ("\r\n", "9\r\n")] {
        fs::write(&file, text.replace('\n', end) + last).unwrap();
        let output = vimc4(&file, "--loops 2 --json");
        let value: Value = serde_json::from_slice(&output.stdout).unwrap();
        for key in ["time_ns", "axes", "rounds", "line"] {
            assert_eq!(value[key], expected.1[key], "{key} with {end:?}");
        }
    }
}

#[test]
fn more_is_said_when_asked() {
    let (_, text) = run("shuttle.txt", "--loops 1 -v");
    assert!(text.contains("(wait 1.0 s)"), "{text}");
    assert_eq!(text.lines().filter(|l| l.trim_start().starts_with("7  0-1200")).count(), 1 + 3);
}

#[test]
fn a_stream_is_fed_as_the_controller_completes_it() {
    let arguments = "--model smcu --machine board-plotter";
    let (code, text) = run("board.plt", arguments);
    assert_eq!(code, 0, "{text}");
    let answers: Vec<(&str, &str)> = text
        .lines()
        .take_while(|line| !line.is_empty())
        .filter_map(|line| Some((line.get(8..40)?.trim_end(), line.get(42..)?)))
        .map(|(command, rest)| (command, rest.split("  after").next().unwrap()))
        .collect();
    assert_eq!(answers[..3], [("IN", "Z"), ("!CT1", "C"), ("!EM1", "C")]);
    assert!(answers.contains(&("!ON0", "P1000,1000,0  C")), "{text}");
    assert!(answers.contains(&("!OC", "(no answer)")), "{text}");
    assert_eq!(ended(&text), "every command was carried out");
    // 1,000 steps of 7.9375 µm and a quarter of a circle with that radius.
    assert!(text.contains("20.405 mm of it with the head down, in "), "{text}");

    let (code, json) = summary("board.plt", arguments);
    assert_eq!((code, &json["ended"]), (0, &json!("done")));
    assert_eq!(json["axes"]["X"]["position"], 1_000);
    let down = json["head_down"]["path_mm"].as_f64().unwrap();
    assert!((20.39..20.42).contains(&down), "{down}");
    assert!(json["head_down"]["time_ns"].as_u64().unwrap() < json["time_ns"].as_u64().unwrap());
}

#[test]
fn without_echo_a_stream_goes_as_fast_as_there_is_room() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("long.plt");
    let ways: String = (1..=400).map(|n| format!("PA{n}00,{n}00;\n")).collect();
    let run = |text: String| {
        fs::write(&file, text).unwrap();
        let output = vimc4(&file, "--model smcu --json");
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        (output.status.code().unwrap(), json)
    };
    let (_, with_echo) = run(ways.clone());
    let (code, without) = run(format!("!CT0;{ways}"));
    assert_eq!((code, &without["ended"]), (0, &json!("done")));
    assert_eq!(without["axes"]["X"]["position"], 40_000);
    assert_eq!(without["time_ns"], with_echo["time_ns"], "waiting costs nothing");
    assert_eq!(without["warnings"], json!([]), "nothing is lost");
    // A stop overtakes what waits, and so does what lifts it.
    let (code, stopped) = run("!CT0;PA9000,0;PA0,0;!ST;PA5,5;".to_owned());
    assert_eq!((code, &stopped["ended"]), (3, &json!("waits")));
    assert_eq!(stopped["axes"]["X"]["position"], 9_000);
    assert_eq!(run("!CT0;PA9000,0;PA0,0;!ST;PA5,5;!GO;".to_owned()).0, 0);
}

#[test]
fn a_status_ends_a_stream_with_its_line() {
    let (code, text) = run("board-typo.plt", "--model smcu");
    assert_eq!(code, 1, "{text}");
    assert!(ended(&text).contains("board-typo.plt, line 4 (`PA200`) was answered E06: "), "{text}");
    let (_, json) = summary("board-typo.plt", "--model motionsystem");
    assert_eq!((&json["ended"], &json["line"]), (&json!("error"), &json!(2)), "it has no head");
}

/// Runs a plot of this text: exit code and standard output.
fn plot(text: &[u8], arguments: &str) -> (i32, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plot.plt");
    fs::write(&file, text).unwrap();
    let output = vimc4(&file, arguments);
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "", "{arguments}");
    (output.status.code().unwrap(), String::from_utf8(output.stdout).unwrap())
}

/// The same as JSON.
fn plot_summary(text: &[u8], arguments: &str) -> (i32, Value) {
    let (code, text) = plot(text, &format!("{arguments} --json"));
    (code, serde_json::from_str(&text).unwrap())
}

/// A frame as plot programs write it: pairs behind the head's commands, several in one.
const FRAME: &str = "IN;PU400,300;PD1600,300,1600,900,400,900,400,300;PU0,0;";

#[test]
fn a_plot_that_moves_nothing_is_no_success() {
    let spread = FRAME.replace(';', ";\n");
    let with_line_feeds = FRAME.replace([';', ','], "\n");
    for (text, second) in [(FRAME, 1), (&spread, 3), (&with_line_feeds, 4)] {
        let (code, said) = plot(text.as_bytes(), "--model smcu");
        assert_eq!(code, 1, "{said}");
        assert_eq!(
            ended(&said),
            "the end of the file was reached, but 12 numbers that belong to no command were ignored \
             at 3 places"
        );
        assert!(said.contains("bare_pairs = \"repeat\" under [quirks] smcu takes them"), "{said}");
        assert!(said.contains("path      0.000 mm"), "{said}");
        let (code, json) = plot_summary(text.as_bytes(), "--model smcu");
        assert_eq!((code, &json["ended"]), (1, &json!("error")));
        let places = json["ignored"].as_array().unwrap();
        let numbers: Vec<u64> = places.iter().map(|p| p["numbers"].as_u64().unwrap()).collect();
        assert_eq!(numbers, [2, 8, 2], "{json}");
        assert_eq!(places[1]["line"], second, "{json}");
        assert!(places[0]["text"].as_str().unwrap().starts_with("400"), "{json}");
        // Whoever asks for it gets it.
        let (code, said) = plot(text.as_bytes(), "--model smcu --ignore-numbers");
        assert_eq!(code, 0, "{said}");
        assert!(ended(&said).contains("12 numbers"), "{said}");
    }
    // One number, and more places than anybody wants to read.
    let (_, said) = plot(b"PU5;PA1,1;", "--model smcu");
    assert!(ended(&said).contains("1 number that belongs to no command was ignored"), "{said}");
    assert!(said.contains("line 1     5\n"), "{said}");
    let (_, said) = plot("PU5,5;PD;\n".repeat(25).as_bytes(), "--model smcu");
    assert!(said.contains("line 20    5,5\n          and 5 more\n"), "{said}");
}

#[test]
fn the_value_of_the_profile_that_is_named_takes_the_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let profile = vimc4::model_profile("smcu").unwrap();
    let profile = profile.replace("bare_pairs = \"ignore\"", "bare_pairs = \"repeat\"");
    let profile = profile.replace("line_feed = \"separate\"", "line_feed = \"end\"");
    let file = folder.path().join("mine.toml");
    fs::write(&file, profile).unwrap();
    let arguments = format!("--model {}", file.display());
    for text in [FRAME, &FRAME.replace(';', "\n"), &FRAME.replace(';', ";\r\n")] {
        let (code, said) = plot(text.as_bytes(), &arguments);
        assert_eq!((code, ended(&said)), (0, "every command was carried out"), "{said}");
        // 1,200 and 600 steps of 12.5 µm, twice.
        assert!(said.contains("45.000 mm of it with the head down"), "{said}");
    }
}

#[test]
fn unknown_commands_are_left_out_when_asked() {
    let text = b"IN;SP1;VS20000;\nPA100,0;LT;PD;PA200,0;PU;SP0;";
    let (code, said) = plot(text, "--model smcu");
    assert_eq!(code, 1);
    assert!(ended(&said).contains("plot.plt, line 1 (`SP1`) was answered E0D: "), "{said}");
    assert!(said.contains("--keep-going leaves out"), "{said}");
    let (code, said) = plot(text, "--model smcu --keep-going");
    assert_eq!(code, 0, "{said}");
    assert!(ended(&said).contains("3 commands that the controller does not know were left out"));
    assert!(said.contains("line 1     SP1\n          line 2     LT\n          line 2     SP0\n"));
    assert!(said.contains("1.250 mm of it with the head down"), "{said}");
    // A command of other machines of the family: the value that would know it is named.
    let (_, said) = plot(b"CI50;", "--model smcu");
    assert!(said.contains("a profile with shapes = true under [language] knows it"), "{said}");
    // It goes on after nothing else.
    let (code, said) = plot(b"SP1;PA5;PA5,5;", "--model smcu --keep-going");
    assert_eq!(code, 1);
    assert!(ended(&said).contains("(`PA5`) was answered E06: "), "{said}");
    // Without echo nobody says so, but they are left out all the same.
    let (code, json) = plot_summary(b"!CT0;SP1;PA5,5;", "--model smcu");
    assert_eq!((code, &json["unknown"]), (1, &json!([{ "line": 1, "command": "SP1" }])));
    assert_eq!(plot(b"!CT0;SP1;PA5,5;", "--model smcu --keep-going").0, 0);
}

#[test]
fn without_echo_times_belong_to_their_commands() {
    // 1,000 steps of 7.9375 µm at 50 mm/s and 1,000 mm/s²: 208.75 ms.
    let text = b"!CT0;PA1000,0;XX;PA0,0;!GO;PD;PA1000,0;PU;";
    let (_, json) = plot_summary(text, "--model smcu --keep-going");
    let answers = json["answers"].as_array().unwrap().iter();
    let took: Vec<(&str, u64)> = answers
        .map(|answer| (answer["command"].as_str().unwrap(), answer["took_ns"].as_u64().unwrap()))
        .collect();
    let took_of = |command: &str| {
        let of = took.iter().filter(|(name, _)| *name == command).map(|(_, took)| took / 10_000);
        of.collect::<Vec<_>>()
    };
    assert_eq!(took_of("PA1000,0")[0], 20_875, "{took:?}");
    assert_eq!(took_of("PA0,0"), [20_875], "{took:?}");
    assert_eq!(took_of("XX"), [0], "{took:?}");
    assert_eq!(took_of("!GO"), [0], "{took:?}");
    // What overtakes the others may take them away.
    let (code, said) = plot(b"!CT0;PA1000,0;PA0,0;PD;\n!CB;PA5,5;", "--model smcu");
    assert_eq!(code, 0, "{said}");
    assert!(ended(&said).contains("2 commands were taken away before their turn"), "{said}");
    assert!(said.contains("line 1     PA0,0\n          line 1     PD\n"), "{said}");
}

/// The commands of a plot in the order in which they were carried out.
fn carried_out(json: &Value) -> Vec<&str> {
    json["answers"].as_array().unwrap().iter().filter_map(|a| a["command"].as_str()).collect()
}

/// A profile of an SMCU with one value in place of another.
fn smcu_with(value: &str, other: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let profile = vimc4::model_profile("smcu").unwrap();
    assert!(profile.contains(value), "{value}");
    let file = folder.path().join("mine.toml");
    fs::write(&file, profile.replace(value, other)).unwrap();
    (folder, format!("--model {}", file.display()))
}

#[test]
fn after_in_commands_are_waited_for_as_the_echo_mode_is() {
    let text = b"IN;PA100,100;PA2000,2000;!CB;PA5,5;";
    let order = ["IN", "PA100,100", "PA2000,2000", "!CB", "PA5,5"];
    for (value, other) in [("init_reply = \"Z\"", "init_reply = \"C\""), ("title", "title")] {
        let (_folder, profile) = smcu_with(value, other);
        let (code, json) = plot_summary(text, &profile);
        assert_eq!((code, carried_out(&json)), (0, order.to_vec()), "{json}");
        assert_eq!(json["taken_away"], json!([]));
    }
    let arguments = "--model smcu --machine board-plotter";
    let (code, json) = plot_summary(b"IN;OH;PA100,1;!ST;", arguments);
    assert_eq!((code, carried_out(&json)), (0, vec!["IN", "OH", "PA100,1", "!ST"]), "{json}");
    let (_, json) = plot_summary(b"IN;!CT0;SP1;", arguments);
    assert_eq!(carried_out(&json), ["IN", "!CT0", "SP1"], "{json}");
    // Where `IN` ends the echo mode, whatever it answers, nothing is waited for.
    for reply in ["Z", "C"] {
        let (_folder, profile) = smcu_with(
            "init_reply = \"Z\"\ninit_echo = \"on\"",
            &format!("init_reply = \"{reply}\"\ninit_echo = \"off\""),
        );
        let (_, json) = plot_summary(text, &profile);
        assert_eq!(json["taken_away"][0]["command"], "PA2000,2000", "{json}");
        let (_, json) = plot_summary(b"IN;!CT1;PA100,100;PA2000,2000;!CB;PA5,5;", &profile);
        assert_eq!(json["taken_away"], json!([]), "{json}");
    }
}

#[test]
fn every_line_of_numbers_is_listed_where_line_feeds_end_them() {
    let (_folder, profile) = smcu_with("line_feed = \"separate\"", "line_feed = \"end\"");
    for (text, listed) in [
        ("PA1,1\nPD\n2,2\n3,3\n", &[(3, "2,2"), (4, "3,3")][..]),
        ("PA1,1\n2,2\n3,3\n4,4\n", &[(2, "2,2"), (3, "3,3"), (4, "4,4")]),
    ] {
        let (code, json) = plot_summary(text.as_bytes(), &profile);
        let places = json["ignored"].as_array().unwrap().iter();
        let places: Vec<_> = places
            .map(|place| (place["line"].as_u64().unwrap(), place["text"].as_str().unwrap()))
            .collect();
        assert_eq!((code, places), (1, listed.to_vec()), "{json}");
    }
}

#[test]
fn a_sign_or_a_point_by_itself_is_nothing() {
    let (_folder, profile) = smcu_with("bare_pairs = \"ignore\"", "bare_pairs = \"repeat\"");
    for (text, order) in [
        ("\x1B.(;IN;PA1,1;", &["IN", "PA1,1"][..]),
        ("PU;-;PA1,1;", &["PU", "PA1,1"]),
        ("PU;-PA1,1;+2,2;- 3,3;", &["PU", "PA1,1", "+2,2", "- 3,3"]),
        (".;SP1;PA1,1;", &["SP1", "PA1,1"]),
        ("PU-.+;PD .", &["PU", "PD"]),
    ] {
        let (code, json) = plot_summary(text.as_bytes(), &format!("{profile} --keep-going"));
        assert_eq!((code, carried_out(&json)), (0, order.to_vec()), "{text}: {json}");
        assert_eq!(json["taken_away"], json!([]), "{text}");
    }
}

#[test]
fn moves_of_unknown_commands_are_not_left_out() {
    let (_folder, profile) = smcu_with("unknown_pairs = \"ignore\"", "unknown_pairs = \"move\"");
    let (code, json) = plot_summary(b"PA1,1;SP1,2;PA3,3;", &profile);
    assert_eq!((code, &json["unknown"]), (0, &json!([])), "{json}");
    let (_, said) = plot(b"PA1,1;SP1,2;PA3,3;", &format!("{profile} -v"));
    assert!(said.contains("(move to X 1 Y 2)"), "{said}");
    let (code, json) = plot_summary(b"PA1,1;SP1;PA3,3;", &format!("{profile} --keep-going"));
    assert_eq!((code, &json["unknown"][0]["command"]), (0, &json!("SP1")), "{json}");
}

#[test]
fn a_value_that_no_status_is_for_is_named() {
    for (text, reason) in [
        ("AA0,0,400;", "400: an arc is at most a turn, 360 degrees"),
        ("AA0,0;", "AA takes 3 numbers (x, y, a), 2 came"),
        ("!WR999,1;", "999: the address of a port is 0 to 255"),
        ("!OI4;", "4: the trackball is opened with 1, 2 or 3"),
    ] {
        let (code, said) = plot(text.as_bytes(), "--model smcu -v");
        assert_eq!(code, 1);
        assert!(ended(&said).ends_with(&format!("was answered E07: {reason}")), "{said}");
        assert!(said.contains(&format!("({reason})")), "{said}");
    }
}

#[test]
fn lower_case_letters_are_said_to_be_no_commands() {
    let (code, said) = plot(b"in;pu;\npa100,100;PA5,5;", "--model smcu");
    assert_eq!(code, 1, "{said}");
    let listed = "line 1     in\n          line 1     pu\n          line 2     pa100,100\n";
    assert!(ended(&said).contains("3 commands in lower-case letters"), "{said}");
    assert!(said.contains(listed) && said.contains("write PA, not pa"), "{said}");
    assert!(!said.contains("bare_pairs"), "{said}");
    // Text that is no such command is not spoken of.
    let (code, said) = plot(b"PU;drilled in mm;PA5,5;", "--model smcu");
    assert_eq!(code, 0, "{said}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plot.plt");
    fs::write(&file, "in;pu;").unwrap();
    let output = vimc4(&file, "--model smcu");
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn a_stop_in_a_file_is_told_how_it_ends() {
    let (code, said) = plot(b"PA100,0;!ST;\nPA5,5;", "--model smcu");
    assert_eq!(code, 3, "{said}");
    assert!(ended(&said).contains("line 2 (`PA5,5`): stopped"), "{said}");
    assert!(said.contains("`!GO;` lets commands go on"), "{said}");
    assert!(!said.contains("--input"), "{said}");
    let (_, said) = plot(b"!OI2;PA5,5;", "--model smcu");
    assert!(said.contains("`!CI;` closes the trackball"), "{said}");
}

#[test]
fn a_binary_file_is_said_to_be_one() {
    let folder = tempfile::tempdir().unwrap();
    let bytes: Vec<u8> = (0..2_000u32).map(|n| (n * n / 7) as u8).collect();
    for (name, what) in [("board.LMD", "LMD"), ("board.plt", "not text")] {
        let file = folder.path().join(name);
        fs::write(&file, &bytes).unwrap();
        let said = complaint(&file, "--model smcu");
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains("is binary") && said.contains(what), "{said}");
        assert!(said.contains("HPGL"), "{said}");
    }
    // A text of that name is a plot, and NULs may stand wherever commands end.
    let file = folder.path().join("text.lmd");
    for plot in ["IN;\0PA5,5;\0PU;\0", &format!("{}IN;PA5,5;", "\0".repeat(20))] {
        fs::write(&file, plot).unwrap();
        assert_eq!(vimc4(&file, "--model smcu").status.code(), Some(0), "{plot:?}");
    }
}

#[test]
fn a_machine_homes_before_time_counts() {
    let (_, json) = plot_summary(b"PA100,0;", "--model smcu --machine board-plotter");
    assert_eq!(json["axes"]["X"]["travelled"], 100);
    assert_eq!(json["axes"]["Y"]["travelled"], 0);
    let (_, bench) = plot_summary(b"PA100,0;", "--model smcu");
    assert_eq!(json["time_ns"], bench["time_ns"]);
}

#[test]
fn circles_can_be_piped_into_it() {
    let circle = Command::new(env!("CARGO_BIN_EXE_vimc4"))
        .args(["circle", "--radius", "333", "--from", "20", "--to", "275", "--speed", "2500"])
        .output_in_time()
        .unwrap();
    assert!(circle.status.success());
    let mut run = Command::new(env!("CARGO_BIN_EXE_vimc4"))
        .args(["run", "-", "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .start()
        .unwrap();
    let mut line = run.stdin.take().unwrap();
    line.write_all(b"@03\n").unwrap();
    // With its comments, as they are on a terminal.
    line.write_all(&circle.stderr).unwrap();
    line.write_all(&circle.stdout).unwrap();
    drop(line);
    let value: Value = serde_json::from_slice(&run.output_in_time().unwrap().stdout).unwrap();
    let at = |radius: f64, angle: f64| {
        (radius * angle.to_radians().cos(), radius * angle.to_radians().sin())
    };
    let ((x0, y0), (x1, y1)) = (at(333.0, 20.0), at(333.0, 275.0));
    let x = value["axes"]["X"]["position"].as_f64().unwrap();
    let y = value["axes"]["Y"]["position"].as_f64().unwrap();
    assert!((x - (x1 - x0)).hypot(y - (y1 - y0)) < 2.0, "{value}");
    let arc = 333.0 * 255f64.to_radians() * 0.0125;
    assert!((value["path_mm"].as_f64().unwrap() / arc - 1.0).abs() < 0.005, "{value}");
}

#[test]
fn what_cannot_be_run_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    let bad = file("mine.toml", b"name = \"mine\"\ntitle = \"mine\"\ntilt = 3\n");
    let bad = bad.display();
    for (path, arguments, right) in [
        (program("none.txt"), "", "standard input"),
        (folder.path().to_owned(), "", "cannot read"),
        (file("empty.txt", b"; nothing\r\n\r\n"), "", "holds no command"),
        (file("utf16.txt", b"\xFF\xFE@\x000\x00"), "", "UTF-8"),
        (program("drill.txt"), "--model imc5", "imc4, imc4-m"),
        (program("drill.txt"), "--machine moon", "bench, mill"),
        (program("drill.txt"), &format!("--machine {bad}"), "line 3"),
        (program("drill.txt"), "--machine none.toml", "none.toml"),
        (program("drill.txt"), "--axes 5", "1, 3, 7"),
        (program("drill.txt"), "--for 10", "as in 250ms"),
        (program("drill.txt"), "--loops 0", "--loops"),
        (program("drill.txt"), "--input 0.2", "0.3=1@2s"),
        (program("drill.txt"), "--input 0.2=1@soon", "as in 250ms"),
        (program("drill.txt"), "--input 9.0=1", "inputs are input 0.2, input 0.3"),
        (program("drill.txt"), "--input pwer-ok=1", "did you mean power-ok?"),
        (program("drill.txt"), "--input cover=shut", "cover can be open or closed"),
        (program("drill.txt"), "--input in1=1", "in1 is called input 0.2"),
        (program("drill.txt"), "--press strat", "did you mean start?"),
    ] {
        let complaint = complaint(&path, arguments);
        assert!(complaint.contains(right), "{path:?} {arguments}: {complaint}");
    }
}

/// Older cards answer small letters at once, and execute them then.
#[test]
fn a_line_for_another_controller_says_why_it_has_no_answer() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("two.txt");
    fs::write(&file, "@07\n@1A5,900\n@0P\n").unwrap();
    let text = String::from_utf8(vimc4(&file, "").stdout).unwrap();
    let why = "for controller 1, this one is 0";
    assert!(text.contains(&format!("  (no answer): {why}\n")), "{text}");
    let json: Value = serde_json::from_slice(&vimc4(&file, "--json").stdout).unwrap();
    assert_eq!(json["answers"][1]["answer"], Value::Null, "{json}");
    assert_eq!(json["answers"][1]["why"], why, "{json}");
    assert!(json["answers"][2].get("why").is_none(), "{json}");
    assert_eq!((&json["ended"], &json["line"]), (&json!("error"), &json!(2)), "{json}");
    assert_eq!(ended(&text), "every command was sent, but 1 was not answered");
    assert_eq!(vimc4(&file, "").status.code(), Some(1));
}

/// A host waits for its answer, and so does a run: what rules do meanwhile happens.
#[test]
fn a_command_that_loses_its_answer_is_no_success() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cut.txt");
    fs::write(&file, "@07\n@0A3000,2000,0,900,0,900,0,900\n@0P\n").unwrap();
    let rules = "[[rule]]\nname=\"p\"\nwhen=\"x > 500\"\ntimes=1\ndo=\"power off for 100ms\"\n\
                 [[rule]]\nwhen=\"rule p then 300ms\"\ndo=\"hold stop for 50ms\"\n";
    let scenario = folder.path().join("power.toml");
    fs::write(&scenario, rules).unwrap();
    let arguments = format!("--for 30s --scenario {}", scenario.display());
    let output = vimc4(&file, &arguments);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(ended(&text).ends_with("line 2 (`@0A3000,2000,0,900,0,900,0,900`) was never answered"));
    assert!(text.contains("(no answer)") && !text.contains("@0P"), "{text}");
    assert!(text.contains("hold stop"), "the rule that follows acts: {text}");
    let json = vimc4(&file, &format!("{arguments} --json"));
    let json: Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!((&json["ended"], &json["line"]), (&json!("waits"), &json!(2)), "{json}");
    assert!(json["time_ns"].as_u64().unwrap() > SECOND / 2, "{json}");
}

#[test]
fn what_is_said_behind_an_early_answer_belongs_to_its_command() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("job.txt");
    fs::write(
        &file,
        "@07\n@0r7\n@0a100,900,0,0,0,0,0,0\n@0P\n@0m5,900,5,900,90000,900,0,900\n@0V\n",
    )
    .unwrap();
    let output = vimc4(&file, "--model c142 --machine mill -v");
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    let line = |number: &str| {
        text.lines().find(|line| line.trim_start().starts_with(number)).unwrap().to_owned()
    };
    // It is answered before it moves.
    assert!(line("3 ").contains("  0  done after "), "{text}");
    assert!(!line("4 ").contains("after"), "{text}");
    assert!(line("5 ").contains("  02  after "), "{text}");
    assert!(line("5 ").contains("limit switch Z+"), "{text}");
    assert!(line("5 ").contains("(absolute move X to 5 at 900 Hz"), "{text}");
    let end =
        "line 5 (`@0m5,900,5,900,90000,900,0,900`) was answered 0, and then 2: limit switch Z+";
    assert!(ended(&text).contains(end), "{text}");
}

#[test]
fn the_time_of_an_early_answer_is_when_it_came() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("job.txt");
    fs::write(&file, "@03\n@0r3\n@0P\n").unwrap();
    let text = String::from_utf8(vimc4(&file, "--model c142 --machine mill -v").stdout).unwrap();
    assert!(text.contains("@0r3                              0  done after 4.0"), "{text}");
    let json = vimc4(&file, "--model c142 --machine mill --json").stdout;
    let summary: Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(summary["answers"][1]["took_ns"], 0, "{summary}");
}

#[test]
fn a_stop_of_a_stored_program_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.txt");
    fs::write(&file, "0 5000,1000\n0 -5000,1000\n").unwrap();
    let presses = "--axes 1 --press start@0s --press stop@1s --press start@3s";
    let text = String::from_utf8(vimc4(&file, presses).stdout).unwrap();
    let said =
        "cut short: in line 1 of the program, by STOP at the panel: START or @0S goes on with it";
    assert!(text.contains(said), "{text}");
}

#[test]
fn where_an_axis_is_not_known_is_said_with_what_finds_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("job.txt");
    let found = "unknown   the place of X; a reference run finds it";
    for (commands, options, is_known) in [
        ("@01\n@0A8000,1000\n", "--press estop@2s", false),
        ("@01\n@0R1\n@0A-100,1000\n", "--machine mill", false),
        ("@01\n@0R1\n@0A100,1000\n", "--machine mill", true),
        ("@01\n@0A100,1000\n@0n1\n@0A100,1000\n", "--machine mill", true),
    ] {
        fs::write(&file, commands).unwrap();
        let text = String::from_utf8(vimc4(&file, options).stdout).unwrap();
        assert_eq!(text.contains(found), !is_known, "{commands}: {text}");
        let json = vimc4(&file, &format!("{options} --json")).stdout;
        let summary: Value = serde_json::from_slice(&json).unwrap();
        let known = &summary["axes"]["X"]["position_known"];
        assert_eq!(known == &json!(false), !is_known, "{commands}: {summary}");
    }
}

/// Runs the command in a folder: exit code, standard output and standard error.
fn in_folder(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
    let command = command.args(arguments).current_dir(folder).stdin(Stdio::null());
    let Output { status, stdout, stderr } = command.output_in_time().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (status.code().unwrap(), text(stdout), text(stderr))
}

/// What the page of scenarios shows comes out.
#[test]
fn a_scenario_goes_as_its_page_shows() {
    let page = include_str!("../../docs/scenarios.md");
    let block = |begin: &str| {
        let (_, rest) = page.split_once(begin).unwrap();
        rest.split_once("```\n").unwrap().0.to_owned()
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let line = "run examples/commands.txt --machine mill --scenario examples/scenario.toml";
    let arguments: Vec<&str> = line.split(' ').collect();
    let (code, out, _) = in_folder(&root, &arguments);
    assert_eq!((code, out), (1, block(&format!("```console\n$ vimc4 {line}\n"))));

    let folder = tempfile::tempdir().unwrap();
    let wrong = "[[rule]]\nwhen = \"x > far\"\ndo = \"press stop\"\n";
    fs::write(folder.path().join("wrong.toml"), wrong).unwrap();
    fs::write(folder.path().join("commands.txt"), "@07\n").unwrap();
    let arguments = ["run", "commands.txt", "--scenario", "wrong.toml"];
    let (code, out, error) = in_folder(folder.path(), &arguments);
    assert_eq!((code, out), (2, String::new()));
    assert_eq!(error.trim_end(), block("in the file:\n\n```text\n").trim_end());

    // The file of the page is the file of the examples.
    let example = include_str!("../../examples/scenario.toml");
    let rules = &example[example.find("[[rule]]").unwrap()..];
    assert!(page.contains(rules), "{rules}");
}

/// What is wrong with a file of rules is said with its place, before anything else is touched.
#[test]
fn a_wrong_scenario_is_found_first() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("commands.txt"), "@07\n").unwrap();
    let rule = |name: &str, when: &str| {
        format!("[[rule]]\nname = \"{name}\"\nwhen = \"{when}\"\ndo = \"press stop\"\n")
    };
    let cases: [(Vec<u8>, &str); 11] = [
        (rule("a", "rule nosuch").into(), "line 3: there is no rule `nosuch`"),
        (rule("a", "rule a").into(), "line 3: it can never act: it waits for rule `a`"),
        ((rule("a", "rule b") + &rule("b", "rule a")).into(), "line 3: it can never act"),
        ((rule("a", "x > 1") + &rule("a", "x > 2")).into(), "line 7: there are two rules `a`"),
        (rule("a", "@PU").into(), "line 3: `when @PU` is wrong at `@PU`"),
        (rule("a", "@ZZZ").into(), "line 3: `when @ZZZ` is wrong at `@ZZZ`"),
        (b"# nothing\n".to_vec(), "there is no rule in it"),
        ((rule("a", "x > 1") + "times = -1\n").into(), "line 5: `times` is a whole number"),
        (b"[[rule]]\nat = 2024-01-01\ndo = \"press stop\"\n".to_vec(), "line 2: `at` is a text"),
        (b"[[rule]]\nat = \"2s\"\ndo = \"\xe4\"\n".to_vec(), "line 3: byte 26 of the file, 0xe4"),
        (b"[[rule]]\nat = \"2s\"\ndoes = \"x\"\n".to_vec(), "line 3: unknown field `does`"),
    ];
    // What would be right is said once.
    for (order, wrong, help) in [
        ("cover shut", "`cover` cannot be `shut`", "it can be open or closed"),
        ("nonsense", "is wrong", "something that is done to the controller"),
    ] {
        let text = format!("[[rule]]\nwhen = \"x > 1\"\ndo = \"{order}\"\n");
        fs::write(folder.path().join("wrong.toml"), text).unwrap();
        let arguments = ["run", "commands.txt", "--scenario", "wrong.toml"];
        let (_, _, errors) = in_folder(folder.path(), &arguments);
        assert!(errors.contains(wrong) && errors.contains(&format!("help: {help}")), "{errors}");
        assert_eq!(errors.matches(help).count(), 1, "{errors}");
        assert_eq!(errors.matches(wrong).count(), 1, "{errors}");
    }
    for (text, said) in cases {
        fs::write(folder.path().join("wrong.toml"), text).unwrap();
        let run = ["run", "commands.txt", "--scenario", "wrong.toml"];
        let serve = [
            "serve",
            "--tcp",
            "none",
            "--scenario",
            "wrong.toml",
            "--record",
            "a.jsonl",
            "--coverage",
            "a.json",
            "--flash",
            "a.flash",
        ];
        for arguments in [&run[..], &serve[..]] {
            let (code, _, error) = in_folder(folder.path(), arguments);
            assert_eq!(code, 2, "{said}: {error}");
            assert!(error.contains(said), "{said}: {error}");
            assert!(!error.contains("built-in profile"), "{error}");
        }
        for left in ["a.jsonl", "a.json", "a.flash"] {
            assert!(!folder.path().join(left).exists(), "{left}");
        }
    }
}

/// A recording has the scenario, and a replay does the same.
#[test]
fn a_scenario_is_recorded_and_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let rules = "[[rule]]\nname = \"a\"\nwhen = \"x > 50\"\ntimes = 1\n\
                 do = \"hold stop for 2ms; fault duplicate to-host\"\n\
                 [[rule]]\nwhen = \"rule a then 1ms\"\ndo = \"input 0.2 1\"\n";
    fs::write(folder.path().join("rules.toml"), rules).unwrap();
    fs::write(folder.path().join("commands.txt"), "@01\n@0A1000,900\n@0S\n").unwrap();
    let arguments =
        ["run", "commands.txt", "--scenario", "rules.toml", "--record", "session.jsonl"];
    let (_, out, error) = in_folder(folder.path(), &arguments);
    assert!(out.contains("rule 1.1 (a) acts: hold stop; fault duplicate to-host"), "{out}{error}");
    assert!(out.contains("rule 1.2 acts: input 0.2 1"), "{out}");
    let recording = fs::read_to_string(folder.path().join("session.jsonl")).unwrap();
    assert!(recording.contains("\"rule\":\"0\\n"), "{recording}");
    let (code, out, error) = in_folder(folder.path(), &["replay", "session.jsonl"]);
    assert_eq!(code, 0, "{out}{error}");
}

#[test]
fn an_arc_that_ends_off_its_circle_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arcs.txt");
    fs::write(&file, "@03\n@0f-1\n@0y400,1500,119,-141,141,-1,1\n@0y400,1500,119,-141,141,-1,-1\n")
        .unwrap();
    let output = vimc4(&file, "-v");
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert_eq!(
        said.matches("steps off the circle; D 119, Rx -1, Ry -1 would end on it").count(),
        1,
        "{said}"
    );
    let summary: Value = serde_json::from_slice(&vimc4(&file, "--json").stdout).unwrap();
    assert_eq!(summary["warnings"].as_array().unwrap().len(), 1);
    assert_eq!(summary["warnings"][0]["warning"], "off-circle");
}

#[test]
fn whole_turns_that_do_not_come_back_are_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("turns.txt");
    fs::write(&file, "@07\n@0y64000,4000,-800,800,0,-1,1\n@0y64000,4000,-400,800,0,-1,1\n")
        .unwrap();
    let said = String::from_utf8(vimc4(&file, "").stdout).unwrap();
    let warning = "the arc is 10 turns long and ends 76 steps from its start; D -400, Rx -1, Ry 1 would end there";
    assert_eq!((said.matches(warning).count(), said.matches("warning").count()), (1, 1), "{said}");
}
