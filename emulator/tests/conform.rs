//! `vimc4 conform` against `vimc4 serve`, and against ports that are none.
#![cfg(unix)]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::Command;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, LIMIT, Timed, until};
use process::{Process, connect, run, said, tcp, vimc4};

/// The machine that tests run on may be busy, so times are compared loosely.
const LOOSE: [&str; 2] = ["--tolerance", "3s"];
const FAR: &str = "100000,100000,100000,100000";

fn command(folder: &Path, arguments: &[&str]) -> Command {
    vimc4(folder, &[&["conform"], arguments].concat())
}

fn conform(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    said(command(folder, arguments).output_in_time().unwrap())
}

/// Runs with `--json`, whose report it reads.
fn report(folder: &Path, arguments: &[&str]) -> (i32, Value, String) {
    let mut all = arguments.to_vec();
    all.extend(["--json"]);
    all.extend(LOOSE);
    let (code, out, errors) = conform(folder, &all);
    let report =
        serde_json::from_str(&out).unwrap_or_else(|error| panic!("{error}: {out}{errors}"));
    (code, report, errors)
}

/// The sessions with this result.
fn with<'r>(report: &'r Value, result: &str) -> Vec<&'r str> {
    let sessions = report["sessions"].as_array().unwrap().iter();
    sessions.filter(|s| s["result"] == result).map(|s| s["id"].as_str().unwrap()).collect()
}

#[test]
fn harmless_sessions_pass_over_a_pseudo_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let (_serve, _) = Process::serve(folder.path(), &[]);
    let mut arguments = vec!["./vimc4.pty"];
    arguments.extend(LOOSE);
    let (code, out, errors) = conform(folder.path(), &arguments);
    assert_eq!(code, 0, "{out}{errors}");
    let passed = out.split_once(" passed, 0 failed").map(|(count, _)| count.parse::<usize>());
    assert!(passed.is_some_and(|count| count.unwrap() >= 20), "{out}");
    assert!(out.contains("need hands at the panel or the inputs"), "{out}");
    assert_eq!(errors, "", "no progress in a pipe");
}

#[test]
fn harmless_sessions_pass_over_tcp() {
    let folder = tempfile::tempdir().unwrap();
    let (_serve, ready) = Process::serve(folder.path(), &["--model", "imc-s8"]);
    let arguments = [tcp(&ready, 0), "--model", "imc-s8", "line/", "errors/", "time/"];
    let (code, report, errors) = report(folder.path(), &arguments);
    assert_eq!((code, with(&report, "failed")), (0, vec![]), "{errors}");
    assert!(with(&report, "passed").len() >= 5, "{report}");
    assert_eq!(report["ended_early"], Value::Null);
    assert_eq!(report["baud"], Value::Null);
    // Nothing that moves was played.
    let moving = report["sessions"].as_array().unwrap().iter();
    let moving = moving.filter(|s| s["detail"].as_str().is_some_and(|d| d.contains("moves")));
    assert!(moving.clone().count() > 20);
    assert!(moving.clone().all(|s| s["result"] == "not-played"));
}

#[test]
fn a_card_that_tells_of_configured_axes_only_is_one() {
    let folder = tempfile::tempdir().unwrap();
    let (_serve, ready) = Process::serve(folder.path(), &["--model", "c142"]);
    // After a reset it has no axis to tell of.
    let arguments = [tcp(&ready, 0), "--model", "c142"];
    let (code, report, errors) = report(folder.path(), &arguments);
    assert_eq!((code, with(&report, "failed")), (0, vec![]), "{errors}");
    assert_eq!(with(&report, "passed"), ["isel/old/c142/at-rest"], "{report}");
}

#[test]
fn with_everything_allowed_it_moves_stores_erases_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let (_serve, ready) = Process::serve(folder.path(), &["--model", "imc4-m", "--pty", "none"]);
    let allow = ["--allow", "moves,reference,outputs,flash", "--envelope", FAR, "--yes"];
    let sessions = [
        "stop/software-stop/quirk-f",
        "stop/break-and-reset/next-line",
        "line/texts/position",
        "axes/zero/",
        "program/storing/every-line",
        "program/storing/incomplete",
        "ports/outputs",
    ];
    let mut arguments = vec![tcp(&ready, 0), "--model", "imc4-m"];
    arguments.extend(allow);
    arguments.extend(sessions);
    let (code, report, errors) = report(folder.path(), &arguments);
    assert_eq!((code, with(&report, "failed")), (0, vec![]), "{errors}");
    assert!(with(&report, "passed").len() >= 15, "{report}");
    assert!(errors.contains("X 0…5000  10000 Hz"), "{errors}");
    assert!(errors.contains("The stored program is erased"), "{errors}");
    // The axes are where they were, and no program is left.
    let mut client = connect(tcp(&ready, 0));
    client.write_all(b"@01\r@0i\r").unwrap();
    let mut answer = [0; 2];
    client.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"00");
}

#[test]
fn a_quirk_that_differs_is_found_and_named() {
    let folder = tempfile::tempdir().unwrap();
    for (quirk, own, other, model, sessions, failing) in [
        (
            "stop_reply",
            "\"F\"",
            "\"F0\"",
            "imc4",
            vec!["stop/software-stop/quirk-f", "stop/software-stop/at-rest", "straight/parameters"],
            "isel/stop/software-stop/quirk-f",
        ),
        (
            "version_handshake",
            "\"first\"",
            "\"last\"",
            "imc-s8",
            vec!["line/texts/version", "line/texts/user-info", "line/framing/blanks"],
            "isel/line/texts/version-of-the-imc-xx",
        ),
    ] {
        let (_, profile, _) = run(folder.path(), &["models", "show", model]);
        let line = format!("{quirk} = {own}");
        assert!(profile.contains(&line), "{profile}");
        let profile = profile.replace(&line, &format!("{quirk} = {other}"));
        fs::write(folder.path().join("other.toml"), profile).unwrap();
        let (_serve, ready) =
            Process::serve(folder.path(), &["--model", "other.toml", "--pty", "none"]);
        let mut arguments = vec![tcp(&ready, 0), "--model", model];
        arguments.extend(["--allow", "moves,reference", "--envelope", FAR, "--yes"]);
        arguments.extend(sessions);
        let (code, report, errors) = report(folder.path(), &arguments);
        assert_eq!(code, 1, "{errors}");
        let failed = with(&report, "failed");
        assert!(failed.contains(&failing), "{failed:?}");
        for session in report["sessions"].as_array().unwrap() {
            if session["result"] == "failed" {
                let cause = &session["explanations"][0]["cause"];
                assert_eq!(cause["key"], format!("quirks.{quirk}"), "{session}");
                assert_eq!(cause["value"], other, "{session}");
            }
        }
        assert!(!with(&report, "passed").is_empty(), "{report}");
        assert!(errors.contains(&format!("quirk {quirk} = {other} would explain it")), "{errors}");
        assert!(errors.contains("expected") && errors.contains("  ->"), "{errors}");
    }
}

#[test]
fn dangers_are_shown_and_need_consent() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = "127.0.0.1:1";
    let (code, out, errors) = conform(
        folder.path(),
        &[nowhere, "--allow", "moves", "--envelope", "9,9,9", "stop/", "axes/"],
    );
    assert_eq!(code, 2, "{errors}");
    assert!(out.contains("All moves together, in steps from where the axes are now: X"), "{out}");
    assert!(errors.contains("add --yes"), "{errors}");
    for (arguments, words) in [
        (vec!["--allow", "moves"], "add --envelope X,Y,Z in steps"),
        (vec!["--allow", "reference"], "--allow moves,reference"),
        (vec!["--allow", "moves", "--envelope", "5"], "two to six axes are needed"),
        (vec!["--allow", "everything"], "moves, reference, outputs, flash"),
        (vec!["nonsense/"], "no session of this model has nonsense/"),
        (vec!["--model", "imc5"], "built in are imc4"),
        (vec!["--sessions", "nowhere"], "cannot read nowhere"),
        (vec!["stop/buttons"], "none of these sessions can be played"),
    ] {
        let mut all = vec![nowhere];
        all.extend(&arguments);
        let (code, _, errors) = conform(folder.path(), &all);
        assert_eq!(code, 2, "{arguments:?}: {errors}");
        assert!(errors.contains(words), "{arguments:?}: {errors}");
    }
    for list in [
        vec!["--list", "stop/software-stop"],
        // With a port too, which is not needed.
        vec!["./vimc4.pty", "--list", "stop/software-stop"],
        vec![nowhere, "stop/software-stop", "--list"],
        vec!["COM3", "--list", "stop/software-stop"],
    ] {
        let (code, out, errors) = conform(folder.path(), &list);
        assert_eq!(code, 0, "{list:?}: {errors}");
        assert!(out.contains("- isel/stop/software-stop/quirk-f needs --allow moves"), "{out}");
        assert!(!out.contains("isel/axes/"), "{list:?}: {out}");
    }
    for port in ["./vimc4.pty", "127.0.0.1:4004"] {
        let (code, out, errors) = conform(folder.path(), &[port, "--list"]);
        assert_eq!(code, 0, "{port}: {errors}");
        assert!(out.contains("isel/stop/") && out.contains("isel/axes/"), "{out}");
    }
    let (code, _, errors) = conform(folder.path(), &["stpo/", "--list"]);
    assert_eq!(code, 2, "{errors}");
    assert!(errors.contains("no session of this model has stpo/"), "{errors}");
    let list =
        ["--list", "--json", "--allow", "moves", "--envelope", "5000,0,0", "software-stop/quirk-f"];
    let (_, out, _) = conform(folder.path(), &list);
    let list: Value = serde_json::from_str(&out).unwrap();
    let mut listed = list["sessions"].as_array().unwrap().iter();
    let listed = listed.find(|s| s["id"] == "isel/stop/software-stop/quirk-f").unwrap();
    assert_eq!((&listed["played"], &listed["high"][0]), (&Value::from(true), &Value::from(5_000)));
}

#[test]
fn sessions_of_ones_own_are_played() {
    let folder = tempfile::tempdir().unwrap();
    let (_serve, ready) = Process::serve(folder.path(), &["--pty", "none"]);
    fs::create_dir_all(folder.path().join("own/mine")).unwrap();
    let text = "models = \"imc4\"\nevidence = \"F\"\nsource = \"field\"\n[[session]]\n\
                name = \"hello\"\ntitle = \"It says where it is\"\n\
                script = '''\n> @0P -> 0000000000000000000\n'''\n";
    fs::write(folder.path().join("own/mine/first.toml"), text).unwrap();
    let arguments = [tcp(&ready, 0), "--sessions", "own", "-v"];
    let (code, out, errors) = conform(folder.path(), &arguments);
    assert_eq!(code, 0, "{out}{errors}");
    assert!(
        out.contains("passed  isel/mine/first/hello\n1 passed, 0 failed, 0 not played"),
        "{out}"
    );
    assert!(errors.contains("> @0P\\r") && errors.contains("< 0000000000000000000"), "{errors}");
    fs::write(folder.path().join("own/mine/first.toml"), text.replace("> @0P", "@0P")).unwrap();
    let (code, _, errors) = conform(folder.path(), &arguments);
    assert_eq!(code, 2);
    assert!(errors.contains("own/mine/first.toml:8") && errors.contains("a line begins with"));
}

// --- ports that are none ---

/// Somebody at a TCP port who is not a controller.
fn pretender(what: impl Fn(TcpStream) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    thread::spawn(move || {
        for stream in listener.incoming() {
            what(stream.unwrap());
        }
    });
    address
}

/// Passes on what a client sends to a controller, and back. Says what came from the client.
fn between(controller: SocketAddr) -> (String, Receiver<Vec<u8>>) {
    let (sender, sent) = channel();
    let address = pretender(move |mut client| {
        let mut server = TcpStream::connect(controller).unwrap();
        let (mut from, mut to) = (server.try_clone().unwrap(), client.try_clone().unwrap());
        thread::spawn(move || std::io::copy(&mut from, &mut to));
        let mut buffer = [0; 256];
        while let Ok(count @ 1..) = client.read(&mut buffer) {
            server.write_all(&buffer[..count]).unwrap();
            sender.send(buffer[..count].to_vec()).unwrap();
        }
    });
    (address, sent)
}

#[test]
fn a_port_where_no_controller_is_says_what_may_be_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let silent = pretender(|mut stream| drop(std::io::copy(&mut stream, &mut std::io::sink())));
    let echo = pretender(|stream| drop(std::io::copy(&mut &stream, &mut &stream)));
    let garbage = pretender(|mut stream| {
        let mut buffer = [0; 64];
        while let Ok(1..) = stream.read(&mut buffer) {
            stream.write_all(b"\xF8\x80\x1C\xFE").unwrap();
        }
    });
    let closing = pretender(drop);
    fs::write(folder.path().join("file"), "precious").unwrap();
    std::os::unix::fs::symlink("/dev/pts/none", folder.path().join("dead.pty")).unwrap();
    let ports = [
        (silent.as_str(), vec!["nothing answers", "the right port", "crossed"]),
        (&echo, vec!["sends back what it is sent", "local echo"]),
        (&garbage, vec!["makes no sense", r"\xF8\x80\x1C\xFE", "baud rate"]),
        (&closing, vec!["closed before anything was answered", "another client may hold"]),
        ("127.0.0.1:1", vec!["cannot open 127.0.0.1:1", "nothing listens there"]),
        ("/dev/none", vec!["cannot open /dev/none", "/dev/ttyUSB0 or COM3"]),
        ("dead.pty", vec!["cannot open dead.pty", "the emulator that made it has ended"]),
        ("file", vec!["cannot open file", "check that it is a serial port"]),
    ];
    for (port, words) in ports {
        let (code, _, errors) = conform(folder.path(), &[port, "line/framing"]);
        assert_eq!(code, 2, "{port}: {errors}");
        for word in words {
            assert!(errors.contains(word), "{port}: {errors}");
        }
    }
    assert_eq!(fs::read_to_string(folder.path().join("file")).unwrap(), "precious");
}

#[test]
fn a_second_client_is_told_that_there_is_another() {
    let folder = tempfile::tempdir().unwrap();
    let (_serve, ready) = Process::serve(folder.path(), &[]);
    let _first = connect(tcp(&ready, 0));
    let (code, _, errors) = conform(folder.path(), &[tcp(&ready, 0), "line/framing"]);
    assert_eq!(code, 2);
    assert!(errors.contains("another client may hold it"), "{errors}");
    assert!(errors.contains(" has the line"), "{errors}");
}

#[test]
fn a_port_that_is_unplugged_is_named_with_the_session() {
    for port in ["pty", "tcp"] {
        let folder = tempfile::tempdir().unwrap();
        let (mut serve, ready) = Process::serve(folder.path(), &[]);
        let name = if port == "pty" { "./vimc4.pty" } else { tcp(&ready, 0) };
        let mut running = command(folder.path(), &[name, "--json", "-v"]).start().unwrap();
        let mut lines =
            BufReader::new(Timed::new("standard error", running.stderr.take().unwrap()));
        let mut errors = String::new();
        while !errors.contains("passed  isel/line/") {
            assert_ne!(lines.read_line(&mut errors).unwrap(), 0, "{errors}");
        }
        serve.child.kill().unwrap();
        lines.read_to_string(&mut errors).unwrap();
        let (code, out, _) = said(running.output_in_time().unwrap());
        assert_eq!(code, 2, "{out}{errors}");
        assert!(errors.contains("is gone, during isel/line/"), "{errors}");
        assert!(errors.contains("plug it in"), "{errors}");
        // What was found out before is not lost.
        let report: Value = serde_json::from_str(&out).unwrap();
        assert!(report["ended_early"].as_str().unwrap().contains("is gone"), "{out}");
        assert!(!with(&report, "passed").is_empty(), "{out}");
    }
}

/// A folder with a session of one's own for LPKF's models.
fn own_sessions_of_lpkf(folder: &Path) {
    let text = "models = \"lpkf\"\nevidence = \"F\"\nsource = \"field\"\n[[session]]\n\
                name = \"there\"\ntitle = \"It goes there\"\n\
                script = '''\n> PA300,200; -> C\\r\n> PR-10,5; -> C\\r\nposition 290 205\n'''\n\
                [[session]]\nname = \"long\"\ntitle = \"A long way\"\n\
                script = '''\n> PA30000,0; -> C\\r\n'''\n";
    fs::create_dir(folder.join("own")).unwrap();
    fs::write(folder.join("own/ways.toml"), text).unwrap();
}

#[test]
fn another_family_is_reset_moved_and_brought_back_in_its_own_language() {
    for model in ["smcu", "motionsystem"] {
        let folder = tempfile::tempdir().unwrap();
        own_sessions_of_lpkf(folder.path());
        let (_serve, ready) = Process::serve(folder.path(), &["--model", model, "--pty", "none"]);
        let mut arguments = vec![tcp(&ready, 0), "--model", model, "--sessions", "own"];
        arguments.extend(["--allow", "moves", "--envelope", "300,205", "--yes"]);
        let (code, report, errors) = report(folder.path(), &arguments);
        assert_eq!((code, with(&report, "failed")), (0, vec![]), "{errors}");
        assert_eq!(with(&report, "passed"), ["lpkf/own/ways/there"]);
        assert_eq!(report["sessions"][1]["detail"], "leaves the envelope: X 0…30000");
        assert!(errors.contains("X 0…300  Y 0…205"), "{errors}");
        assert!(errors.contains("only a stop at the machine"), "{errors}");
        // The axes are where they were.
        let mut client = connect(tcp(&ready, 0));
        client.write_all(b"!ON0;PR0,7;").unwrap();
        let mut answer = [0; 7];
        client.read_exact(&mut answer).unwrap();
        assert!(answer.starts_with(b"P0,0,0"), "{}", answer.escape_ascii());
        // Who stands elsewhere counts from elsewhere.
        until("it stands elsewhere", || {
            client.write_all(b"!ON0;").unwrap();
            let mut answer = String::new();
            while !answer.ends_with("\r") {
                let mut byte = [0];
                client.read_exact(&mut byte).unwrap();
                answer.extend(byte.map(char::from));
            }
            answer.starts_with("P0,7,0")
        });
        drop(client);
        let (code, _, errors) = conform(folder.path(), &arguments);
        assert_eq!(code, 2, "{errors}");
        assert!(errors.contains("are at X 0, Y 7"), "{errors}");
        assert!(errors.contains("`PA0,0;`"), "{errors}");
    }
}

#[test]
fn an_interrupt_takes_away_what_waits_where_nothing_halts_what_moves() {
    let folder = tempfile::tempdir().unwrap();
    own_sessions_of_lpkf(folder.path());
    let (_serve, ready) = Process::serve(folder.path(), &["--model", "smcu", "--pty", "none"]);
    let (address, sent) = between(tcp(&ready, 0).parse().unwrap());
    let mut arguments = vec![address.as_str(), "--model", "smcu", "--sessions", "own", "long"];
    arguments.extend(["--yes", "--allow", "moves", "--envelope", "30000,0"]);
    let running = command(folder.path(), &arguments).start().unwrap();
    while sent.recv_timeout(LIMIT).unwrap() != b"PA30000,0;\r" {}
    kill_process(Pid::from_child(&running), Signal::INT).unwrap();
    assert_eq!(sent.recv_timeout(LIMIT).unwrap(), b"!CC;!CB;");
    let (code, _, errors) = said(running.output_in_time().unwrap());
    assert_eq!(code, 2);
    assert!(errors.contains("interrupted, during lpkf/own/ways/long"), "{errors}");
    assert!(errors.contains("goes on to its end"), "{errors}");
}

#[test]
fn an_interrupt_halts_what_moves() {
    let folder = tempfile::tempdir().unwrap();
    let (_serve, ready) = Process::serve(folder.path(), &["--pty", "none"]);
    let (address, sent) = between(tcp(&ready, 0).parse().unwrap());
    let text = "models = \"imc4\"\nevidence = \"F\"\nsource = \"field\"\n[[session]]\n\
                name = \"long\"\ntitle = \"A long way\"\n\
                script = '''\n> @01 -> 0\n> @0A300000,10000 -> 0\n'''\n";
    fs::create_dir(folder.path().join("own")).unwrap();
    fs::write(folder.path().join("own/long.toml"), text).unwrap();
    let mut arguments = vec![address.as_str(), "--sessions", "own", "--yes", "--allow", "moves"];
    arguments.extend(["--envelope", "300000,0,0"]);
    let running = command(folder.path(), &arguments).start().unwrap();
    let moving = b"@0A300000,10000\r";
    while sent.recv_timeout(LIMIT).unwrap() != moving {}
    kill_process(Pid::from_child(&running), Signal::INT).unwrap();
    assert_eq!(sent.recv_timeout(LIMIT).unwrap(), [253]);
    let (code, _, errors) = said(running.output_in_time().unwrap());
    assert_eq!(code, 2);
    assert!(errors.contains("interrupted, during isel/own/long/long"), "{errors}");
    assert!(errors.contains("253 was sent"), "{errors}");
    // Nothing more was sent.
    assert!(sent.recv_timeout(Duration::from_millis(200)).is_err());
}
