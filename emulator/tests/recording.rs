//! Recordings: written, killed, read, played again, compared, cut and made shorter.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::Duration;

use rustix::process::Signal;
use serde_json::{Value, json};
use vimc4::device::OwnedInput;
use vimc4::{Clock, Emulator};
use vimc4_timeline::recording::{Given, Recording, What};

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, joined, until};
use process::{Process, VIMC4, ask, connect, rest_of, run, tcp, vimc4};

/// A recording in which an axis runs into its limit switch.
const LIMIT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/limit.jsonl");

/// A controller behind TCP, and nowhere else.
fn serve(folder: &Path, arguments: &[&str]) -> (Process, Value) {
    Process::serve(folder, &[&["--pty", "none"], arguments].concat())
}

/// Ends it, and returns what it said on standard error.
fn quit(mut serve: Process) -> String {
    // It may have ended by itself.
    let _ = serve.input.as_mut().unwrap().write_all(b"quit\n");
    let (code, errors) = serve.end();
    assert_eq!(code, Some(0), "{errors}");
    errors
}

fn read(path: &Path) -> Recording {
    Recording::read(&vimc4::unpack(fs::read(path).unwrap()).unwrap()).unwrap()
}

/// All that came out.
fn out(recording: &Recording) -> Vec<u8> {
    let sent = recording.entries.iter().filter_map(|entry| match &entry.what {
        What::Sent(bytes) => Some(bytes.to_vec()),
        _ => None,
    });
    sent.flatten().collect()
}

#[test]
fn what_is_served_is_recorded_and_happens_again() {
    let folder = tempfile::tempdir().unwrap();
    for clock in ["real", "100x", "instant"] {
        let file = format!("{clock}.jsonl");
        let arguments = ["--record", &file, "--time", clock, "--machine", "mill", "--line-pacing"];
        let (serve, ready) = serve(folder.path(), &arguments);
        let mut client = connect(tcp(&ready, 0));
        assert_eq!(ask(&mut client, "@07\r", 1), "0");
        assert_eq!(ask(&mut client, "@0A100,900,0,900,0,900,0,900\r", 1), "0");
        assert_eq!(ask(&mut client, "@0P\r", 19), "0000064000000000000");
        drop(client);
        quit(serve);
        let (code, text, errors) = run(folder.path(), &["replay", &file]);
        assert_eq!(code, 0, "{text}{errors}");
        assert!(text.starts_with("equal: 3 inputs and 21 bytes up to "), "{text}");
        let recording = read(&folder.path().join(&file));
        assert_eq!((recording.head.clock.as_str(), recording.head.from.as_str()), (clock, "serve"));
        assert!(recording.is_whole());
        // What was on its way is gone through like everything else.
        let lines = "next x = 50\nback command\nassert x = 0\ngoto end\nassert x = 100\nlast command\n\
                     why motion\n";
        fs::write(folder.path().join("lines"), lines).unwrap();
        let (code, text, errors) = run(folder.path(), &["console", &file, "--script", "lines"]);
        assert_eq!(code, 0, "{text}{errors}");
        assert!(text.ends_with("@0A100,900,0,900,0,900,0,900 came over the line\n"), "{text}");
    }
}

#[test]
fn each_of_several_controllers_has_a_file_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--count", "3", "--record", "r.jsonl.gz", "--time", "instant"];
    let (serve, ready) = serve(folder.path(), &arguments);
    // It is plain text as long as it grows.
    assert!(folder.path().join("r-2.jsonl").exists());
    for number in 0..3 {
        assert_eq!(ask(&mut connect(tcp(&ready, number)), "@01\r", 1), "0");
    }
    quit(serve);
    for number in 1..=3 {
        let file = format!("r-{number}.jsonl.gz");
        assert_eq!(read(&folder.path().join(&file)).head.controller, number.to_string());
        let (_, text, _) = run(folder.path(), &["replay", &file]);
        assert!(text.starts_with("equal: 1 input and 1 byte up to "), "{text}");
        assert!(!folder.path().join(format!("r-{number}.jsonl")).exists());
    }
}

#[test]
fn no_recording_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    for (there, wanted) in [
        ("a.jsonl", "a.jsonl"),
        ("b.jsonl.zst", "b.jsonl.zst"),
        // Where it would be written before it is compressed.
        ("c.jsonl", "c.jsonl.zst"),
    ] {
        fs::write(folder.path().join(there), "dear to somebody").unwrap();
        let (code, _, errors) =
            run(folder.path(), &["serve", "--tcp", "127.0.0.1:0", "--record", wanted]);
        assert_eq!(code, 2, "{errors}");
        assert!(errors.contains("no recording is overwritten: name another file"), "{errors}");
        let kept = fs::read_to_string(folder.path().join(there)).unwrap();
        assert_eq!(kept, "dear to somebody");
    }
}

#[test]
fn a_recording_goes_on_in_files_that_play_by_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--record", "r.jsonl.zst", "--record-size", "40k", "--time", "instant"];
    let (serve, ready) = serve(folder.path(), &arguments);
    let mut client = connect(tcp(&ready, 0));
    assert_eq!(ask(&mut client, "@01\r", 1), "0");
    for number in 1..=2_000 {
        assert_eq!(ask(&mut client, "@0A1,900\r", 1), "0");
        let place = format!("0{number:06X}000000000000");
        assert_eq!(ask(&mut client, "@0P\r", 19), place);
    }
    drop(client);
    quit(serve);
    let (mut inputs, mut bytes, mut parts) = (0, 0, 0);
    for part in 1.. {
        let file = if part == 1 { "r.jsonl.zst".to_owned() } else { format!("r.{part}.jsonl.zst") };
        if !folder.path().join(&file).exists() {
            break;
        }
        let (code, text, errors) = run(folder.path(), &["replay", &file, "--json"]);
        assert_eq!(code, 0, "{text}{errors}");
        let report: Value = serde_json::from_str(&text).unwrap();
        assert_eq!((&report["equal"], &report["whole"]), (&Value::from(true), &Value::from(true)));
        inputs += report["inputs"].as_u64().unwrap();
        bytes += report["bytes"].as_u64().unwrap();
        assert_eq!(read(&folder.path().join(&file)).head.part, part);
        parts = part;
    }
    assert!(parts > 3, "{parts}");
    assert_eq!((inputs, bytes), (4_001, 1 + 2_000 * 20));
}

/// How often the program is killed.
const KILLS: u64 = 200;

#[test]
fn whatever_a_client_has_seen_is_recorded_when_it_is_killed() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = 7u64;
    let mut seen_in_all = 0;
    for number in 0..KILLS {
        let file = format!("{number}.jsonl");
        let (mut serve, ready) = serve(folder.path(), &["--record", &file, "--time", "instant"]);
        let mut client = connect(tcp(&ready, 0));
        assert_eq!(ask(&mut client, "@01\r", 1), "0");
        random =
            random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let delay = Duration::from_micros((random >> 33) % 20_000);
        let (hears, heard) = std::sync::mpsc::channel();
        let talks = std::thread::spawn(move || {
            // Several commands are under way at any time, but not without end: instant time goes on
            // when the line is silent.
            let commands = b"@0A7,900\r@0P\r@0A-7,900\r@0P\r";
            let replies = 40;
            let (mut seen, mut sent, mut is_alive) = (b"0".to_vec(), 0, true);
            let mut buffer = [0; 4_096];
            loop {
                while is_alive && sent < seen.len() / replies + 8 {
                    is_alive = client.write_all(commands).is_ok();
                    sent += 1;
                }
                let Ok(count @ 1..) = client.read(&mut buffer) else { return seen };
                seen.extend(&buffer[..count]);
                let _ = hears.send(());
            }
        });
        heard.recv_timeout(process::limits::LIMIT).unwrap();
        std::thread::sleep(delay);
        serve.child.kill().unwrap();
        serve.child.wait_in_time().unwrap();
        let seen = joined("the end of the conversation", talks);
        let path = folder.path().join(&file);
        let recording = read(&path);
        let recorded = out(&recording);
        assert!(!recording.is_whole());
        assert!(recorded.starts_with(&seen), "{} recorded, {} seen", recorded.len(), seen.len());
        seen_in_all += seen.len();
        // Some of them are played as well, each has the same to say.
        if number % 10 == 0 {
            let (code, text, errors) = run(folder.path(), &["replay", &file]);
            assert_eq!(code, 0, "{text}{errors}");
            assert!(text.contains("It has no end"), "{text}");
        }
        fs::remove_file(path).unwrap();
    }
    assert!(seen_in_all > 1_000, "{seen_in_all}");
}

#[test]
fn a_full_disk_ends_the_recording_and_nothing_else() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // A file that may have no more than so many bytes is as good as a full disk.
    let script = format!(
        "ulimit -f 60; trap '' XFSZ; exec {VIMC4} serve --json --tcp 127.0.0.1:0 --pty none \
         --time instant --record r.jsonl"
    );
    let mut bash = Command::new("bash");
    bash.args(["-c", &script]).current_dir(folder.path()).stderr(Stdio::piped());
    let mut serve = Process::start(&mut bash);
    let ready = serde_json::from_str(&serve.line()).unwrap();
    let mut client = connect(tcp(&ready, 0));
    assert_eq!(ask(&mut client, "@01\r", 1), "0");
    for _ in 0..2_000 {
        assert_eq!(ask(&mut client, "@0P\r", 19), "0000000000000000000");
    }
    drop(client);
    serve.give("quit\n");
    let (code, errors) = serve.end();
    assert_eq!(code, Some(1), "{errors}");
    assert!(errors.contains("cannot go on with the recording r.jsonl"), "{errors}");
    assert!(errors.contains("it is whole up to here"), "{errors}");
    let path = folder.path().join("r.jsonl");
    let recording = read(&path);
    assert!(recording.torn.is_none() && recording.entries.len() > 300);
    let (code, text, _) = run(folder.path(), &["replay", "r.jsonl"]);
    assert_eq!(code, 0, "{text}");

    fs::write(folder.path().join("list.txt"), "@01\n".to_owned() + &"@0P\n".repeat(2_000)).unwrap();
    let script =
        format!("ulimit -f 60; trap '' XFSZ; exec {VIMC4} run list.txt --record run.jsonl");
    let mut bash = Command::new("bash");
    let run = bash.args(["-c", &script]).current_dir(folder.path()).output_in_time().unwrap();
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{errors}");
    assert!(errors.contains("cannot go on with the recording run.jsonl"), "{errors}");
}

#[test]
fn a_byte_that_differs_is_shown_with_what_led_there() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(LIMIT)
        .unwrap()
        .replace("\"0000C80000000FFFE0C\"", "\"0000C80000001FFFE0C\"");
    fs::write(folder.path().join("wrong.jsonl"), text).unwrap();
    let (code, text, _) = run(folder.path(), &["replay", "wrong.jsonl"]);
    assert_eq!(code, 1);
    for part in [
        "They part after 77 bytes that are equal, at line 27:\n",
        "  recorded  16.447940004 s  1FFFE0C\n",
        "  played    16.447940004 s  0FFFE0C\n",
        "  in        command 12: @0P  read position\n",
        "What led there, played:\n",
        "  16.447940004 s  command 11: answered 0\n",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    let (code, text, _) = run(folder.path(), &["diff", "wrong.jsonl", LIMIT]);
    assert_eq!(code, 1);
    assert!(text.contains("They part after 77 bytes"), "{text}");
}

#[test]
fn a_quirk_that_explains_a_difference_is_named() {
    // A controller that loses no steps is one of the quirk lost_steps = false.
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(LIMIT).unwrap();
    let text = text.replace("16447940004,\"out\":\"0\"", "16398340004,\"out\":\"0\"");
    let text: String = text
        .lines()
        .filter(|line| !line.contains("\"state\"") || line.starts_with("{\"at\":0,"))
        .map(|line| format!("{line}\n"))
        .collect();
    fs::write(folder.path().join("real.jsonl"), text).unwrap();
    let (code, text, _) = run(folder.path(), &["replay", "real.jsonl"]);
    assert_eq!(code, 1);
    assert!(text.contains("\nquirk lost_steps = false would explain it\n"), "{text}");
    assert_eq!(text.matches("would explain it").count(), 1, "{text}");
}

#[test]
fn another_controller_parts_at_its_first_byte_and_its_first_field() {
    let folder = tempfile::tempdir().unwrap();
    let (code, text, _) = run(folder.path(), &["replay", LIMIT, "--quirk", "lost_steps=false"]);
    assert_eq!(code, 1);
    for part in [
        "The other controller differs from the recorded one from 9.994 s on.\nThey part after 64 bytes that are equal, at line 25:\n  recorded  16.447940004 s  0\n  other     16.398340004 s  0\n",
        "found at 9.994206670 s (line 17):\n  device.isel.plant.carriage.1\n  recorded  16125\n  other     16001\n",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    // The value that it has makes no difference.
    let (code, text, _) = run(folder.path(), &["replay", LIMIT, "--quirk", "lost_steps=true"]);
    assert_eq!((code, text.starts_with("equal: 12 inputs")), (0, true), "{text}");
    // On a machine without ends nothing stands in the way.
    let (code, text, _) = run(folder.path(), &["replay", LIMIT, "--machine", "bench"]);
    assert_eq!(code, 1);
    assert!(
        text.contains("device.isel.plant.carriage.0\n  recorded  4000\n  other     0\n"),
        "{text}"
    );
    // Another family understands nothing of it.
    let (code, text, errors) = run(folder.path(), &["replay", LIMIT, "--model", "smcu"]);
    assert_eq!(code, 1, "{errors}");
    assert!(text.contains("They part after 0 bytes"), "{text}");
    for (quirk, message) in [
        ("lost_steps", "`lost_steps` is not a quirk"),
        ("no_such=1", "imc4 has no quirk no_such"),
        ("lost_steps=7", "lost_steps cannot be 7"),
    ] {
        let (code, _, errors) = run(folder.path(), &["replay", LIMIT, "--quirk", quirk]);
        assert_eq!(code, 2);
        assert!(errors.contains(message), "{errors}");
    }
}

#[test]
fn what_is_cut_out_and_what_is_left_play_by_themselves() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to) in [("0s", "3s"), ("4s", "12s"), ("9994206670ns", "1h")] {
        let _ = fs::remove_file(folder.path().join("part.jsonl"));
        let cut = ["cut", LIMIT, "--from", from, "--to", to, "--out", "part.jsonl"];
        let (code, _, errors) = run(folder.path(), &cut);
        assert_eq!(code, 0, "{errors}");
        let (code, text, errors) = run(folder.path(), &["replay", "part.jsonl"]);
        assert_eq!(code, 0, "{from} to {to}: {text}{errors}");
    }
    let (code, _, errors) = run(folder.path(), &["cut", LIMIT, "--out", "part.jsonl"]);
    assert_eq!(code, 2);
    assert!(errors.contains("no recording is overwritten: name another file"), "{errors}");

    let (code, short, errors) = run(folder.path(), &["minimise", LIMIT]);
    assert_eq!(code, 0, "{errors}");
    fs::write(folder.path().join("short.jsonl"), &short).unwrap();
    let lines: Vec<_> = short.lines().filter_map(|line| line.split_once("\"in\":")).collect();
    assert_eq!(lines.len(), 2, "{short}");
    assert!(lines[0].1.starts_with("\"@07\\r\""), "{short}");
    let (_, text, _) = run(folder.path(), &["replay", "short.jsonl"]);
    assert!(text.starts_with("equal: 2 inputs and 2 bytes"), "{text}");

    let quirk = ["minimise", LIMIT, "--quirk", "lost_steps=false", "--out", "quirk.jsonl"];
    let (code, _, errors) = run(folder.path(), &quirk);
    assert_eq!(code, 0, "{errors}");
    let (code, _, _) =
        run(folder.path(), &["replay", "quirk.jsonl", "--quirk", "lost_steps=false"]);
    assert_eq!(code, 1);
    let kept = read(&folder.path().join("quirk.jsonl"));
    assert!(
        kept.entries.iter().filter(|entry| matches!(entry.what, What::Given { .. })).count() < 6
    );
    let (code, _, errors) = run(folder.path(), &["minimise", LIMIT, "--shows", "F"]);
    assert_eq!(code, 1);
    assert!(errors.contains("does not show the reply F"), "{errors}");
}

#[test]
fn what_is_wrong_with_a_recording_is_said_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(LIMIT).unwrap();
    let cases = [
        (
            text.replace("\"recording\":1", "\"recording\":2"),
            "line 1: it is a recording of version 2",
        ),
        (
            text.replace("\"out\":\"2\"", "\"out\":2"),
            "line 17: a line of a recording cannot be read",
        ),
        (
            text.replace("\"referenced\":", "\"referanced\":"),
            "line 2: it is not a state of this controller",
        ),
        (text.replacen("\"lost_steps\":true", "\"lost_steps\":7", 1), "line 1: the model: "),
        (
            text.replacen("\"lost_steps\":true", "\"lost_steps\":false", 1),
            "line 2: it is not a state",
        ),
        (
            text.replacen("\"family\":\"isel\"", "\"family\":\"lpkf\"", 1),
            "line 1: its family is lpkf",
        ),
        (
            text.replacen("\"baud\":19200", "\"baud\":7", 1),
            "line 1: the model: the line cannot run at 7",
        ),
        ("@07\n".to_owned(), "line 1: this is not a recording"),
    ];
    for (text, message) in cases {
        fs::write(folder.path().join("wrong.jsonl"), text).unwrap();
        let (code, _, errors) = run(folder.path(), &["replay", "wrong.jsonl"]);
        assert_eq!(code, 1, "{message}: {errors}");
        assert!(errors.contains(message), "{message}: {errors}");
        // And the line itself is shown.
        let line = message.split(':').next().unwrap().trim_start_matches("line ");
        assert!(errors.contains(&format!("{line} | ")), "{message}: {errors}");
    }
    // A state that none can be in leads nowhere; it is said, whatever comes of it.
    for (old, new) in [
        ("\"carriage\":[4000", "\"carriage\":[9223372036854775807"),
        ("\"now\":0", "\"now\":18446744073709551615"),
    ] {
        let changed = text.replace(old, new);
        assert_ne!(changed, text);
        fs::write(folder.path().join("wrong.jsonl"), changed).unwrap();
        let (code, _, errors) = run(folder.path(), &["replay", "wrong.jsonl"]);
        assert!(code < 2 && !errors.contains("panicked"), "{code}: {errors}");
    }
    let (code, _, errors) = run(folder.path(), &["replay", "nowhere.jsonl"]);
    assert_eq!(code, 2, "{errors}");
}

/// A recording of so many questions after a command that sets the axes.
fn long(folder: &Path, questions: usize) -> String {
    fs::write(folder.join("long.txt"), "@01\n".to_owned() + &"@0P\n".repeat(questions)).unwrap();
    let (code, _, errors) = run(folder, &["run", "long.txt", "--record", "long.jsonl"]);
    assert_eq!((code, &*errors), (0, ""));
    fs::read_to_string(folder.join("long.jsonl")).unwrap()
}

#[test]
fn a_long_recording_is_there_before_it_is_read_and_told_of_where_it_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let text = long(folder.path(), 12_000);
    let mut lines: Vec<&str> = text.lines().collect();
    let console = |file: &str, commands: &str| {
        fs::write(folder.path().join("script.txt"), commands).unwrap();
        run(folder.path(), &["console", file, "--script", "script.txt"])
    };
    // Its head and its beginning make the first picture.
    let (code, out, _) = console("long.jsonl", "usage\ngoto end\nusage\n");
    assert_eq!(code, 0, "{out}");
    assert!(out.contains("% of it is read"), "{out}");
    assert!(out.contains("12001 inputs") && out.trim_end().ends_with("at least"), "{out}");

    // Line 20,000 was edited by hand.
    lines[19_999] = "{\"at\":0,\"ni\":\"@0P\\r\"}";
    fs::write(folder.path().join("edited.jsonl"), lines.join("\n") + "\n").unwrap();
    let commands = "assert x = 0\ngoto command 9000\nback\ncontinue\n";
    let (code, out, errors) = console("edited.jsonl", commands);
    assert_eq!(code, 1);
    assert!(out.contains("#9000 @0P"), "{out}");
    assert!(errors.contains("edited.jsonl, line 20000: ") && errors.contains("`ni`"), "{errors}");
    assert!(errors.contains("script.txt, line 4"), "{errors}");

    // One that was torn off ends there, compressed or not.
    let torn = &text[..text.len() / 2];
    fs::write(folder.path().join("torn.jsonl"), torn).unwrap();
    vimc4::pack(&folder.path().join("packed.jsonl.zst"), text.as_bytes()).unwrap();
    for (file, last) in [("torn.jsonl", "continue\ncontinue\n"), ("packed.jsonl.zst", "goto end\n")]
    {
        let (code, out, errors) = console(file, &format!("{last}usage\n"));
        assert_eq!((code, &*errors), (0, ""), "{file}");
        assert!(out.trim_end().ends_with("at least"), "{file}: {out}");
    }
}

#[test]
fn a_test_that_fails_leaves_its_recording() {
    let folder = tempfile::tempdir().unwrap();
    let test = |fails: bool| {
        let path = folder.path().join(format!("{fails}.jsonl.gz"));
        let file = path.clone();
        let test = std::thread::spawn(move || {
            let builder = Emulator::builder().time(Clock::Manual).record_failure(file);
            let emulator = builder.start().unwrap();
            let mut port = emulator.connect().unwrap();
            port.write_all(b"@01\r").unwrap();
            emulator.run_until_idle().unwrap();
            assert!(!fails, "as wanted");
        });
        until("the end of the test", || test.is_finished());
        assert_eq!(test.join().is_err(), fails);
        path
    };
    assert!(!test(false).exists());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    let recording = read(&test(true));
    assert_eq!(out(&recording), b"0");
    assert_eq!(recording.head.from, "library");
    assert!(recording.is_whole());
}

#[test]
fn runs_and_jobs_are_recorded() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| root.join(name).display().to_string();
    let (commands, program, plot, plate) =
        (file("commands.txt"), file("program.txt"), file("board.plt"), file("plate.ncp"));
    let runs: [&[&str]; 4] = [
        &["run", &commands, "--machine", "mill"],
        &["run", &program, "--press", "stop@5s", "--press", "start@8s", "--for", "1min"],
        &["run", &plot, "--model", "smcu", "--machine", "board-plotter"],
        &["ncp", "run", &plate, "--machine", "mill", "--yes"],
    ];
    for (number, wanted) in runs.into_iter().enumerate() {
        let name = format!("{number}.jsonl");
        let (code, plain, _) = run(folder.path(), wanted);
        let recorded = [wanted, &["--record", &name]].concat();
        let (same, text, errors) = run(folder.path(), &recorded);
        assert_eq!((&text, same), (&plain, code), "{wanted:?}: {errors}");
        let (code, text, errors) = run(folder.path(), &["replay", &name]);
        assert_eq!(code, 0, "{wanted:?}: {text}{errors}");
        let recording = read(&folder.path().join(&name));
        assert!(recording.is_whole() && recording.entries.len() > 8, "{wanted:?}");
    }
}

/// A recording of a program that goes round and round, so long that no replay comes to its end.
fn endless(folder: &Path) -> String {
    fs::write(
        folder.join("round.txt"),
        "0400,2000,0,900,0,900,0,900\n0-400,2000,0,900,0,900,0,900\n3 0,-2\n9\n",
    )
    .unwrap();
    let (code, _, errors) = run(
        folder,
        &["run", "round.txt", "--machine", "mill", "--for", "1s", "--record", "round.jsonl"],
    );
    assert_eq!(code, 3, "{errors}");
    let text = fs::read_to_string(folder.join("round.jsonl")).unwrap();
    let last = text.lines().rev().nth(1).unwrap();
    let begin = text.split_once(last).unwrap().0;
    // More than fits into a pipe: who has got rid of it knows that it is being read.
    let mark = format!("{{\"at\":1000000000,\"mark\":\"{}\"}}\n", "round ".repeat(100));
    let marks = mark.repeat(1_000);
    format!("{begin}{marks}{{\"at\":1000000000000000000,\"end\":\"the run has ended\"}}\n")
}

#[test]
fn an_interrupted_replay_says_how_far_it_has_come() {
    let folder = tempfile::tempdir().unwrap();
    let text = endless(folder.path());
    let replay = |arguments: &[&str]| {
        let mut command = vimc4(folder.path(), &["replay", "-"]);
        let mut replay = Process::start(command.args(arguments));
        replay.give(&text);
        replay
    };
    for other in [&[][..], &["--quirk", "lost_steps=false"]] {
        let (plain, json) = (other.to_vec(), [other, &["--json"]].concat());
        // It is still being read.
        let mut reading = replay(&plain);
        reading.signal(Signal::INT);
        let status = reading.ended();
        let (_, out, errors) = reading.finish();
        assert_eq!((status.code(), errors.as_str()), (Some(130), ""), "{out}");
        assert_eq!(out, "interrupted: nothing was compared yet, for it was still being read\n");
        let mut paging = replay(&[&plain[..], &["--html", "page.html"]].concat());
        paging.signal(Signal::INT);
        let status = paging.ended();
        let (_, out, errors) = paging.finish();
        assert_eq!((status.code(), errors.as_str()), (Some(130), ""), "{out}");
        assert_eq!(
            out,
            "interrupted: nothing was compared yet, for its page was still being written\n"
        );
        assert!(!folder.path().join("page.html").exists());
        // It takes a moment until it compares.
        let compared = (0..100).map(Duration::from_millis).find_map(|pause| {
            let said = |arguments: &[&str]| {
                let mut comparing = replay(arguments);
                drop(comparing.input.take());
                thread::sleep(pause * 20);
                comparing.signal(Signal::INT);
                let (code, out, errors) = comparing.finish();
                assert_eq!((code, errors.as_str()), (Some(130), ""), "{out}");
                out
            };
            let out = said(&plain);
            // Nothing was compared until then, or not all of the inputs were given.
            if !out.contains("equal so far, 8 inputs") {
                assert!(out.starts_with("interrupted"), "{out}");
                return None;
            }
            assert!(out.starts_with("interrupted at "), "{out}");
            let told: Value = serde_json::from_str(&said(&json)).unwrap();
            assert_eq!((&told["interrupted"], &told["equal"]), (&json!(true), &Value::Null));
            (told["inputs"] == 8).then(|| told["inputs"].clone())
        });
        assert_eq!(compared, Some(json!(8)));
    }
}

#[test]
fn an_interrupted_replay_names_what_differs_already() {
    let folder = tempfile::tempdir().unwrap();
    let text = endless(folder.path()).replacen(r#""out":"0""#, r#""out":"1""#, 1);
    let said = |arguments: &[&str]| {
        let said = (0..100).map(Duration::from_millis).find_map(|pause| {
            let mut command = vimc4(folder.path(), &["replay", "-"]);
            let mut replay = Process::start(command.args(arguments));
            replay.give(&text);
            drop(replay.input.take());
            thread::sleep(pause * 20);
            replay.signal(Signal::INT);
            let (code, out, errors) = replay.finish();
            assert_eq!((code, errors.as_str()), (Some(130), ""), "{out}");
            // It takes a moment until it has come to where they part.
            let parted = out.contains("something differs") || out.contains(r#""equal":false"#);
            parted.then_some(out)
        });
        said.unwrap()
    };
    let out = said(&[]);
    assert!(out.starts_with("interrupted at ") && out.contains(": something differs\n"), "{out}");
    assert!(out.contains("They part after 0 bytes that are equal, at line 4:\n"), "{out}");
    let told: Value = serde_json::from_str(&said(&["--json"])).unwrap();
    assert_eq!((&told["equal"], &told["explanations"]), (&json!(false), &Value::Null));
    assert_eq!((&told["said"]["before"], &told["said"]["line"]), (&json!(0), &json!(4)), "{told}");
    assert_eq!(told["field"], Value::Null);
}

// --- the tap ---

struct Tap {
    process: Process,
    tcp: Option<String>,
    errors: Receiver<String>,
}

impl Tap {
    fn start(folder: &Path, arguments: &[&str]) -> Tap {
        let mut command = vimc4(folder, &["record"]);
        let mut process = Process::start(command.args(arguments));
        let mut tap = Tap { errors: process.errors(), process, tcp: None };
        loop {
            let line = tap.process.line();
            match line.strip_prefix("tcp ") {
                Some(address) => tap.tcp = Some(address.to_owned()),
                None if line == "ready" => return tap,
                None => assert!(!line.is_empty(), "{}", tap.end()),
            }
        }
    }

    fn connect(&self) -> TcpStream {
        connect(self.tcp.as_deref().unwrap())
    }

    /// Ends it as Ctrl-C does, and returns what it said on standard error.
    fn end(&mut self) -> String {
        self.process.signal(Signal::INT);
        self.process.ended();
        rest_of(&self.errors)
    }
}

/// All that went in.
fn given(recording: &Recording) -> Vec<u8> {
    let given = recording.entries.iter().filter_map(|entry| match &entry.what {
        What::Given { given: Given::Bytes(bytes), .. } => Some(bytes.to_vec()),
        _ => None,
    });
    given.flatten().collect()
}

/// Sends a command at a time and says what it has sent and heard.
const CLIENT: &str = r#"
import serial, sys
port = serial.Serial(sys.argv[1], 19200, timeout=60)
sent = heard = b""
for number in range(200):
    for command, count in ((b"@01\r", 1), (b"@0A1,900\r", 1), (b"@0P\r", 19), (b"@0\xf0\x80\x00X\r", 1)):
        port.write(command)
        sent += command
        heard += port.read(count)
print(sent.hex())
print(heard.hex())
"#;

#[test]
fn what_passes_between_pyserial_and_a_device_is_recorded_as_both_saw_it() {
    let serial = Command::new("python3").args(["-c", "import serial"]).status_in_time();
    if !serial.is_ok_and(|status| status.success()) {
        assert!(std::env::var_os("VIMC4_REQUIRE_TOOLS").is_none(), "python3-serial is missing");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let device = Emulator::builder().pty(folder.path().join("device")).start().unwrap();
    let arguments =
        ["r.jsonl", "--device", "./device", "--pty", "./machine", "--tcp", "127.0.0.1:0"];
    let mut tap = Tap::start(folder.path(), &arguments);
    let client = Command::new("python3")
        .args(["-c", CLIENT, "./machine"])
        .current_dir(folder.path())
        .output_in_time()
        .unwrap();
    assert!(client.status.success(), "{}", String::from_utf8_lossy(&client.stderr));
    let errors = tap.end();
    assert_eq!(errors, "");
    assert!(!folder.path().join("machine").is_symlink());
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let recording = read(&folder.path().join("r.jsonl"));
    let text = String::from_utf8(client.stdout).unwrap();
    let (sent, heard) = text.trim().split_once('\n').unwrap();
    assert_eq!(hex(&given(&recording)), sent);
    assert_eq!(hex(&out(&recording)), heard);
    assert!(recording.is_whole());
    // So it reached the device, and so it came from there.
    let commands = device.commands().unwrap();
    assert_eq!(commands.len(), 800);
    assert_eq!(&commands[3].bytes[..], b"@0\xf0\x80\x00X");
    let replay = ["replay", "r.jsonl", "--tolerance", "10min"];
    let (code, text, errors) = run(folder.path(), &replay);
    assert_eq!(code, 0, "{text}{errors}");
    assert!(text.contains("each within the tolerance"), "{text}");
}

#[test]
fn the_quirk_of_a_real_controller_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let profile = vimc4::model_profile("imc4").unwrap();
    let real = profile.replace("version_handshake = \"last\"", "version_handshake = \"first\"");
    assert_ne!(real, profile);
    fs::write(folder.path().join("real.toml"), real).unwrap();
    let model = folder.path().join("real.toml").display().to_string();
    let device = Emulator::builder().model(model).tcp("127.0.0.1:0").start().unwrap();
    let address = device.tcp_addr().unwrap().to_string();
    let arguments = ["r.jsonl.gz", "--device", &address, "--tcp", "127.0.0.1:0"];
    let mut tap = Tap::start(folder.path(), &arguments);
    let mut client = tap.connect();
    let version = ask(&mut client, "@0V\r", 1);
    assert_eq!(version, "0");
    device.run_until(&vimc4::Condition::Idle).unwrap();
    // All of it.
    client.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    let _ = client.read_to_end(&mut Vec::new());
    tap.end();
    let replay = ["replay", "r.jsonl.gz", "--tolerance", "10min"];
    let (code, text, _) = run(folder.path(), &replay);
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("quirk version_handshake = first would explain it\n"), "{text}");
    // With it there is nothing to explain.
    let with = [&replay[..], &["--quirk", "version_handshake=first"]].concat();
    let (code, text, _) = run(folder.path(), &with);
    assert_eq!(code, 0, "{text}");
}

#[test]
fn a_device_that_is_unplugged_is_served_again_when_it_is_back() {
    let folder = tempfile::tempdir().unwrap();
    let device = Emulator::builder().tcp("127.0.0.1:0").start().unwrap();
    let address = device.tcp_addr().unwrap().to_string();
    let arguments = ["r.jsonl", "--device", &address, "--tcp", "127.0.0.1:0"];
    let mut tap = Tap::start(folder.path(), &arguments);
    let mut client = tap.connect();
    assert_eq!(ask(&mut client, "@01\r", 1), "0");
    let path = folder.path().join("r.jsonl");
    let marked = |text: &str| wait_for(&path, text);
    drop(device);
    marked("is gone");
    client.write_all(b"lost\r").unwrap();
    marked("\"news\":{\"unsent\":{\"bytes\":5,");
    let _device = Emulator::builder().tcp(&address).start().unwrap();
    marked(&format!("{address} is back"));
    assert_eq!(ask(&mut client, "@07\r", 1), "0");
    let errors = tap.end();
    assert!(
        errors.contains(" is gone: ") && errors.contains(&format!("{address} is back")),
        "{errors}"
    );
    let recording = read(&path);
    assert!(recording.is_whole());
    // Nobody plays what the device has never got.
    assert_eq!(given(&recording), b"@01\r@07\r");
    assert_eq!(out(&recording), b"00");
    let (code, text, errors) = run(folder.path(), &["replay", "r.jsonl", "--tolerance", "10min"]);
    assert_eq!(code, 0, "{text}{errors}");
}

/// Waits until a recording says something.
fn wait_for(path: &Path, text: &str) {
    until(text, || fs::read_to_string(path).unwrap().contains(text));
}

#[test]
fn a_second_client_of_a_tap_is_refused_and_moves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let device = Emulator::builder().tcp("127.0.0.1:0").start().unwrap();
    let address = device.tcp_addr().unwrap().to_string();
    let arguments = ["r.jsonl", "--device", &address, "--tcp", "127.0.0.1:0"];
    let mut tap = Tap::start(folder.path(), &arguments);
    let path = folder.path().join("r.jsonl");
    let mut first = tap.connect();
    assert_eq!(ask(&mut first, "@01\r", 1), "0");
    // One that stays is told, and one that leaves has never been there.
    for stays in [true, false] {
        let mut second = tap.connect();
        second.write_all(b"@0A500,900\r").unwrap();
        let name = second.local_addr().unwrap();
        if stays {
            let read = second.read(&mut [0; 1]);
            let reset =
                |error: &std::io::Error| error.kind() == std::io::ErrorKind::ConnectionReset;
            assert!(read.as_ref().map_or_else(reset, |count| *count == 0), "{read:?}");
        }
        drop(second);
        wait_for(&path, &format!("\"refused\":{{\"client\":\"{name}\""));
    }
    drop(first);
    wait_for(&path, "\"closed\"");
    let mut third = tap.connect();
    assert_eq!(ask(&mut third, "@07\r", 1), "0");
    let errors = tap.end();
    assert_eq!(errors.matches("holds the line").count(), 2, "{errors}");
    let commands = device.commands().unwrap();
    let commands: Vec<_> = commands.iter().map(|command| &command.bytes[..]).collect();
    assert_eq!(commands, [b"@01", b"@07"]);
    assert_eq!(given(&read(&path)), b"@01\r@07\r");
    let (_, text, _) = run(folder.path(), &["replay", "r.jsonl", "--tolerance", "10min"]);
    assert!(text.starts_with("equal: 2 inputs and 2 bytes"), "{text}");
}

#[test]
fn the_recording_of_a_tap_goes_on_in_files_that_play_by_themselves() {
    for (size, name, count, least) in [("1", "one.jsonl", 40, 80), ("20k", "many.jsonl.gz", 300, 3)]
    {
        let folder = tempfile::tempdir().unwrap();
        let device = Emulator::builder().tcp("127.0.0.1:0").start().unwrap();
        let address = device.tcp_addr().unwrap().to_string();
        let arguments = [name, "--device", &address, "--tcp", "127.0.0.1:0", "--record-size", size];
        let mut tap = Tap::start(folder.path(), &arguments);
        let mut client = tap.connect();
        assert_eq!(ask(&mut client, "@01\r", 1), "0");
        for _ in 0..count {
            assert_eq!(ask(&mut client, "@0A1,900\r", 1), "0");
            assert_eq!(ask(&mut client, "@0P\r", 19).len(), 19);
        }
        tap.end();
        let (mut inputs, mut parts) = (0, 0);
        for part in 1.. {
            let (stem, ending) = name.split_once('.').unwrap();
            let file = match part {
                1 => name.to_owned(),
                _ => format!("{stem}.{part}.{ending}"),
            };
            if !folder.path().join(&file).exists() {
                break;
            }
            if parts % (least / 2) == 0 {
                let replay = ["replay", &file, "--tolerance", "10min"];
                let (code, text, errors) = run(folder.path(), &replay);
                assert_eq!(code, 0, "{file}: {text}{errors}");
            }
            let recording = read(&folder.path().join(&file));
            assert!(recording.is_whole());
            assert_eq!(recording.head.part, part);
            let is_given = |entry: &&vimc4_timeline::recording::Entry| {
                matches!(entry.what, What::Given { .. })
            };
            inputs += recording.entries.iter().filter(is_given).count();
            parts = part;
        }
        assert!(parts >= least, "{size}: {parts}");
        assert_eq!(inputs, 1 + 2 * count);
    }
}

#[test]
fn recordings_of_every_version_are_played_for_ever() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/recordings");
    let mut kinds = std::collections::BTreeSet::new();
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let (code, text, errors) = run(Path::new(folder), &["replay", path.to_str().unwrap()]);
        assert_eq!(code, 0, "{}: {text}{errors}", path.display());
        assert!(text.starts_with("equal: "), "{text}");
        for line in fs::read_to_string(&path).unwrap().lines().skip(1) {
            let line: Value = serde_json::from_str(line).unwrap();
            kinds.extend(line.as_object().unwrap().keys().cloned());
        }
        count += 1;
    }
    assert_eq!(count, 2, "one for each family and version");
    let all = ["at", "by", "end", "in", "mark", "news", "out", "power", "signal", "state", "value"];
    assert!(all.iter().all(|kind| kinds.contains(*kind)), "{kinds:?}");
    assert!(kinds.contains("wait"), "{kinds:?}");
}

#[test]
fn a_recording_of_before_a_quirk_was_known_is_still_played() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(LIMIT).unwrap();
    // In the head and in every state.
    let older = text.replace("\"lower_case\":\"after\",", "");
    assert!(text.matches("\"lower_case\":\"after\",").count() > 2);
    fs::write(folder.path().join("older.jsonl"), older).unwrap();
    let (code, text, errors) = run(folder.path(), &["replay", "older.jsonl"]);
    assert_eq!(code, 0, "{text}{errors}");
}

/// What it says of text on its standard input, and its exit code. The text goes on for ever, if the
/// program does not end.
fn said_of_endless(folder: &Path, arguments: &[&str], head: &[u8], text: &[u8]) -> (String, i32) {
    let mut child =
        vimc4(folder, arguments).stdin(Stdio::piped()).stdout(Stdio::null()).start().unwrap();
    let mut input = child.stdin.take().unwrap();
    // Nobody reads so much.
    let mut left = 200_000_000 / text.len();
    let _ = input.write_all(head);
    while left > 0 && input.write_all(text).is_ok() {
        left -= 1;
    }
    drop(input);
    let output = child.output_in_time().unwrap();
    assert!(left > 0, "all of it was read");
    (String::from_utf8(output.stderr).unwrap(), output.status.code().unwrap())
}

#[test]
fn what_is_no_recording_is_not_read_to_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(LIMIT).unwrap();
    let head = text.split_inclusive('\n').next().unwrap();
    let long = format!("{head}{{\"at\":0,\"in\":\"");
    for (beginning, endless, message) in [
        ("", "y\n".repeat(4_096), "line 1: this is not a recording: its first line is not a head"),
        ("", "\0".repeat(8_192), "line 1: it has more than 8 MiB"),
        ("", "\n".repeat(8_192), "line 1: this is not a recording"),
        (head, "y\n".repeat(4_096), "line 2: a line of a recording cannot be read"),
        (&long, "@0P\\r".repeat(1_024), "line 2: it has more than 8 MiB"),
    ] {
        let (errors, code) = said_of_endless(
            folder.path(),
            &["replay", "-"],
            beginning.as_bytes(),
            endless.as_bytes(),
        );
        assert_eq!(code, 1, "{errors}");
        assert!(errors.contains(message), "{message}: {errors}");
    }
}

#[test]
fn what_was_edited_by_hand_is_refused_where_it_cannot_be() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(LIMIT).unwrap();
    let (head, rest) = text.split_once('\n').unwrap();
    let (state, rest) = rest.split_once('\n').unwrap();
    let signal = |name: &str, value: i32| {
        let line = format!("{{\"at\":0,\"signal\":\"{name}\",\"value\":{value},\"by\":\"me\"}}");
        format!("{head}\n{state}\n{line}\n{rest}")
    };
    let lines = text.lines().count();
    let wide: Vec<u8> = text.bytes().flat_map(|byte| [byte, 0]).collect();
    let clock = text.replacen("\"clock\":\"", "\"clock\":\"x", 1);
    let other = state.replacen("\"name\":\"imc4\"", "\"name\":\"imc-s8\"", 1);
    let other = format!("{head}\n{other}\n{rest}");
    for (text, message) in [
        (
            signal("stopp", 1).into_bytes(),
            "line 3: there is no signal `stopp`, there are ".to_owned(),
        ),
        (signal("stop", 7).into_bytes(), "line 3: stop cannot be 7, it is from 0 to 1".to_owned()),
        (clock.into_bytes(), "is not a clock: it is real, instant, manual, wall".to_owned()),
        (
            format!("{text}{{\"at\":99999999999,\"mark\":\"later\"}}\n").into_bytes(),
            format!("line {0}: line {0} comes after the end", lines + 1),
        ),
        (wide, "it is text in UTF-16".to_owned()),
        (
            other.into_bytes(),
            "a state of imc-s8 on mill, and the first line names imc4 on mill".to_owned(),
        ),
    ] {
        fs::write(folder.path().join("wrong.jsonl"), text).unwrap();
        for command in [
            &["replay", "wrong.jsonl"][..],
            &["cut", "wrong.jsonl"],
            &["diff", LIMIT, "wrong.jsonl"],
        ] {
            let (code, _, errors) = run(folder.path(), command);
            assert_eq!(code, 1, "{message}: {errors}");
            assert!(errors.contains(&message), "{message}: {errors}");
        }
    }
    fs::write(folder.path().join("right.jsonl"), signal("stop", 0)).unwrap();
    let (code, _, errors) = run(folder.path(), &["cut", "right.jsonl", "--to", "0s"]);
    assert_eq!(code, 0, "{errors}");
    // A byte order mark changes nothing.
    fs::write(folder.path().join("marked.jsonl"), format!("\u{feff}{text}")).unwrap();
    let played = |name: &str| run(folder.path(), &["replay", name]);
    assert_eq!(played("marked.jsonl"), played(LIMIT));
    let (code, said, errors) = run(folder.path(), &["diff", LIMIT, "marked.jsonl"]);
    assert_eq!(code, 0, "{said}{errors}");
}

#[test]
fn what_is_left_goes_to_standard_output_by_its_name_too() {
    let folder = tempfile::tempdir().unwrap();
    for verb in ["minimise", "cut"] {
        let (_, plain, _) = run(folder.path(), &[verb, LIMIT]);
        let (code, named, errors) = run(folder.path(), &[verb, LIMIT, "--out", "-"]);
        assert_eq!((code, named), (0, plain), "{errors}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    let (code, _, errors) = run(folder.path(), &["cut", LIMIT, "--to", "99999999999s"]);
    assert_eq!(code, 2);
    assert!(errors.contains("it is too long") && !errors.contains("unit"), "{errors}");
}

#[test]
fn a_line_that_is_out_of_order_is_refused_by_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(LIMIT).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let with_time = |line: &str, at: &str| {
        let (_, rest) = line.split_once(',').unwrap();
        format!("{{\"at\":{at},{rest}")
    };
    let time =
        |line: &str| line.split_once("\"at\":").unwrap().1.split_once(',').unwrap().0.to_owned();
    let find = |key: &str| lines.iter().rposition(|line| line.contains(key)).unwrap();
    let (answer, state, end) = (find("\"out\":"), find("\"state\":"), find("\"end\":"));
    let edited = |place: usize, at: &str| {
        let mut edited = lines.clone();
        let line = with_time(lines[place], at);
        edited[place] = &line;
        edited.join("\n") + "\n"
    };
    // The line before these that is the first of its time.
    let last = (1..end).find(|it| time(lines[*it]) == time(lines[end])).unwrap();
    for (text, line, at, of) in [
        // An answer in the future, and what comes after it.
        (edited(answer, "18446744073709551615"), answer + 2, None, answer + 1),
        (edited(state, "5"), state + 1, Some("5"), last + 1),
        (edited(end, "5"), end + 1, Some("5"), last + 1),
    ] {
        fs::write(folder.path().join("wrong.jsonl"), text).unwrap();
        let at = at.map_or_else(|| time(lines[line - 1]), str::to_owned);
        let message = format!("line {line}: its time, {at}, is before that of line {of}, ");
        for command in [
            &["replay", "wrong.jsonl"][..],
            &["cut", "wrong.jsonl"],
            &["minimise", "wrong.jsonl"],
            &["diff", LIMIT, "wrong.jsonl"],
            &["console", "wrong.jsonl"],
        ] {
            let (code, _, errors) = run(folder.path(), command);
            let errors = errors.split_whitespace().collect::<Vec<_>>().join(" ");
            assert_eq!(code, 1, "{command:?}: {errors}");
            assert!(errors.contains(&message), "{command:?}, {message}: {errors}");
        }
    }
}

#[test]
fn nothing_is_cut_out_of_a_time_that_was_not_recorded() {
    let folder = tempfile::tempdir().unwrap();
    // One whose computer stopped in the middle of a move.
    let text = fs::read_to_string(LIMIT).unwrap();
    let lines = text.split_inclusive('\n').take(15).collect::<String>();
    fs::write(folder.path().join("short.jsonl"), &lines).unwrap();
    let whole = Recording::read(lines.as_bytes()).unwrap();
    let end = whole.entries.last().unwrap().at;
    let cut = ["cut", "short.jsonl", "--to", "1h", "--out", "part.jsonl"];
    let (code, _, errors) = run(folder.path(), &cut);
    assert_eq!(code, 0, "{errors}");
    assert!(
        errors.contains("short.jsonl goes no further than ")
            && errors.contains("the part ends with it"),
        "{errors}"
    );
    let part = read(&folder.path().join("part.jsonl"));
    assert_eq!(part.entries.last().unwrap().at, end);
    let (code, text, errors) = run(folder.path(), &["replay", "part.jsonl"]);
    assert_eq!(code, 0, "{text}{errors}");
    let (code, text, errors) = run(folder.path(), &["cut", "short.jsonl", "--from", "1h"]);
    assert_eq!((&*text, code), ("", 2), "{errors}");
    assert!(
        errors.contains("short.jsonl goes no further than ") && errors.contains("before --from"),
        "{errors}"
    );
}

#[test]
fn less_of_a_recording_is_compressed_by_its_name_and_read_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    for (command, name, magic) in [
        ("cut", "a.jsonl.gz", &[0x1F, 0x8B][..]),
        ("cut", "b.jsonl.GZ", &[0x1F, 0x8B]),
        ("cut", "c.jsonl.zst", &[0x28, 0xB5, 0x2F, 0xFD]),
        ("minimise", "d.jsonl.zst", &[0x28, 0xB5, 0x2F, 0xFD]),
    ] {
        let (code, _, errors) = run(folder.path(), &[command, LIMIT, "--out", name]);
        assert_eq!(code, 0, "{errors}");
        assert!(fs::read(folder.path().join(name)).unwrap().starts_with(magic), "{name}");
        let (code, text, errors) = run(folder.path(), &["replay", name]);
        assert_eq!(code, 0, "{text}{errors}");
    }
    // Torn off, it is read as far as it goes.
    let bytes = fs::read(folder.path().join("a.jsonl.gz")).unwrap();
    fs::write(folder.path().join("torn.gz"), &bytes[..bytes.len() - 400]).unwrap();
    let (code, text, errors) = run(folder.path(), &["replay", "torn.gz"]);
    assert_eq!(code, 0, "{text}{errors}");
    assert!(text.contains("It has no end"), "{text}");
    // What is damaged is said so in plain words.
    let damaged = |name: &str, place: usize| {
        let mut bytes = fs::read(folder.path().join(name)).unwrap();
        bytes[place..place + 4].fill(0xFF);
        fs::write(folder.path().join("damaged"), bytes).unwrap();
        let (code, _, errors) = run(folder.path(), &["replay", "damaged"]);
        assert_eq!(code, 1, "{name}: {errors}");
        assert!(errors.contains("what is compressed in it is damaged"), "{name}: {errors}");
    };
    // The sum of a gzip archive, and the first block of the other.
    damaged("a.jsonl.gz", bytes.len() - 8);
    damaged("c.jsonl.zst", 8);
    fs::write(folder.path().join("nothing.gz"), &bytes[..12]).unwrap();
    let (code, _, errors) = run(folder.path(), &["replay", "nothing.gz"]);
    assert_eq!(code, 1, "{errors}");
    assert!(errors.contains("it is compressed and broken off in its first line"), "{errors}");
}

#[test]
fn recordings_that_differ_in_times_only_are_told_so() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(LIMIT).unwrap();
    let later = text.replace("\"at\":16447940004,", "\"at\":16447940005,");
    assert_ne!(later, text);
    fs::write(folder.path().join("later.jsonl"), later).unwrap();
    let (code, text, _) = run(folder.path(), &["diff", LIMIT, "later.jsonl"]);
    assert_eq!(code, 1);
    assert!(
        text.starts_with("What went in and what came out is the same, at other times.\n"),
        "{text}"
    );
    assert!(text.contains("They part after 64 bytes"), "{text}");
    assert!(!text.contains("Every byte is equal"), "{text}");
}

#[test]
fn pictures_and_waveforms_show_what_was_lived_after_going_back_too() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("back.jsonl");
    let emulator = Emulator::builder().machine("mill").time(Clock::Manual).record(&*file);
    let emulator = emulator.start().unwrap();
    let control = emulator.control();
    let send = |line: &'static str| {
        control.inject(OwnedInput::Bytes(line.as_bytes().into())).wait().unwrap();
    };
    let advance = |millis| emulator.advance(Duration::from_millis(millis)).unwrap();
    send("@01\r");
    advance(1_000);
    let at_rest = emulator.snapshot().unwrap();
    send("@0A900,900\r");
    advance(2_000);
    emulator.restore(&at_rest).unwrap();
    send("@0A-300,900\r");
    advance(1_000);
    assert_eq!(emulator.position().unwrap()[0], -300);
    drop(emulator);

    let mut replay = vec!["replay", "back.jsonl", "--csv", "back.csv", "--plot", "back.svg"];
    if cfg!(feature = "api") {
        replay.extend(["--html", "back.html"]);
    }
    let (code, said, errors) = run(folder.path(), &replay);
    assert_eq!(code, 0, "{said}{errors}");
    assert!(errors.contains("went back once"), "{errors}");
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let table = read("back.csv");
    let rows: Vec<&str> = table.lines().collect();
    for row in [
        "3.000000000,note,put back by the library to 1s",
        "3.000000000,x.position,0",
        "3.000000000,command,\"@0A-300,900\"",
    ] {
        assert!(rows.contains(&row), "{row}");
    }
    let last = rows.iter().rfind(|row| row.contains(",x.position,")).unwrap();
    assert!(last.ends_with(",x.position,-300") && last.starts_with("3.3"), "{last}");
    // A part across it has all of it, and plays by itself.
    let cut = ["cut", "back.jsonl", "--from", "1.2s", "--to", "5s", "--out", "part.jsonl"];
    let (code, _, errors) = run(folder.path(), &cut);
    assert_eq!(code, 0, "{errors}");
    assert!(errors.contains("goes no further than 3.000000000 s; the part ends"), "{errors}");
    let (code, said, errors) = run(folder.path(), &["replay", "part.jsonl"]);
    assert_eq!(code, 0, "{said}{errors}");
    assert!(said.starts_with("equal: 3 inputs and 2 bytes up to 2.000000000 s"), "{said}");
    let (code, _, errors) = run(folder.path(), &["cut", "part.jsonl", "--to", "1s"]);
    assert_eq!(code, 2);
    assert!(errors.contains("part.jsonl begins at 1.199999999 s, which is after --to"), "{errors}");
    // 80 steps a millimetre.
    let picture = read("back.svg");
    assert!(picture.contains("<title>put back at 3.000 s, X 0.000 mm"), "{picture}");
    assert!(picture.contains("<title>end at 3.337 s, X -3.750 mm"), "{picture}");
}

#[test]
fn a_recording_that_contradicts_the_emulation_is_shown_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/overlooked.jsonl");
    let text = fs::read_to_string(path).unwrap();
    let without = |line: &str| {
        let kept = text.lines().filter(|own| !own.contains(line));
        kept.map(|own| format!("{own}\n")).collect::<String>()
    };
    for (name, text, from) in [
        ("reply", text.replace(r#""out":"F""#, r#""out":"0""#), "8.698"),
        ("position", text.replace(r#""position":[24001,"#, r#""position":[24002,"#), "10.275"),
        ("input", without(r#""in":"@0R7"#), "5.011"),
    ] {
        let file = format!("{name}.jsonl");
        fs::write(folder.path().join(&file), text).unwrap();
        let differs = format!("differs from the recording from {from} s on");
        let (code, text, errors) = run(folder.path(), &["replay", &file]);
        assert_eq!(code, 1, "{text}{errors}");
        assert!(text.contains(&differs), "{text}");
        let (code, text, errors) = run(folder.path(), &["diff", path, &file]);
        assert_eq!(code, 1, "{name}: {text}{errors}");
        if name == "position" {
            let field = "device.isel.position.0\n  one       24001\n  other     24002\n";
            assert!(text.contains(field), "{text}");
        }
        let (code, _, errors) = run(folder.path(), &["cut", &file]);
        assert!(code == 0 && errors.contains(&differs), "{errors}");
        let html = format!("{name}.html");
        let (_, text, errors) = run(folder.path(), &["replay", &file, "--html", &html]);
        assert!(errors.contains(&differs), "{text}{errors}");
        // The picture is what the screen shows.
        let picture = format!("{name}.svg");
        fs::write(folder.path().join("lines"), format!("differences\npicture {picture}\n"))
            .unwrap();
        let (code, text, errors) = run(folder.path(), &["console", &file, "--script", "lines"]);
        assert_eq!(code, 0, "{text}{errors}");
        assert!(errors.contains(&differs), "{errors}");
        assert!(text.contains("  1  ") && text.contains("recorded"), "{text}");
        let picture = fs::read_to_string(folder.path().join(picture)).unwrap();
        assert!(picture.contains(&format!("≠ recording from {from} s on")), "{picture}");
    }
}
