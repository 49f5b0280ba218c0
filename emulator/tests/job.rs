//! Job files, end to end: checked, run, compiled, sent.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use vimc4::{Button, Clock, Emulator, Event, Motion, Point};

/// Lines, an arc off the raster, a helix, a turning axis, holes, a work-piece zero.
const JOB: &str = "\
IMF_PBL_V1.0
REF XYZA
VEL 20000
FASTVEL 60000
FASTABS X20000 Y15003
MOVEABS Z-3000 X21001
CWABS I30007 J15003 X30007 Y24000
CWHLXREL I0 J-9000 X9000 Y-9000 Z1000
MOVEREL X500 A400
WPZEROABS X10000 Y10000
DRILLDEF C2 P0 D2000 T100 V10000 F900 O600 I100 R200 L500 S1000
DRILL X5000 Y5000
DRILL X7000
SETBIT A1.4
WAIT 200
MOVEABS X0 Y0
PROGEND
";

fn vimc4(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs it, and it must end with this code.
fn ends(folder: &Path, arguments: &[&str], code: i32) -> (String, String) {
    let output = vimc4(folder, arguments);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{arguments:?}\n{out}\n{err}");
    (out, err)
}

/// The counters after each step in a table of `--trace`.
fn traced(path: &Path) -> Vec<[i64; 4]> {
    let table = fs::read_to_string(path).unwrap();
    let mut rows = table.lines();
    assert_eq!(rows.next().unwrap(), "seconds,X,Y,Z,A");
    let places = rows.map(|row| {
        let mut fields = row.split(',').skip(1).map(|field| field.parse().unwrap());
        std::array::from_fn(|_| fields.next().unwrap())
    });
    places.collect()
}

/// The counters after each step of what an emulator has recorded.
fn recorded(emulator: &Emulator) -> Vec<[i64; 4]> {
    let mut places = Vec::new();
    let mut running: Option<(Point, Box<vimc4_motion::Segment>)> = None;
    for (_, event) in emulator.events().unwrap() {
        match event {
            Event::Motion(Motion::Begins { origin, segment }) => running = Some((origin, segment)),
            Event::Motion(Motion::Ends { steps }) => {
                let (origin, segment) = running.take().unwrap();
                let steps = segment.path.steps().take(steps as usize);
                places.extend(
                    steps.map(|step| std::array::from_fn(|axis| origin[axis] + step[axis])),
                );
            }
            _ => {}
        }
    }
    places
}

#[test]
fn run_sent_and_stored_it_takes_the_same_path() {
    for model in ["imc4", "imc-s8"] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        fs::write(folder.join("job.ncp"), JOB).unwrap();
        let job = ["job.ncp", "--model", model];
        let with = |before: &[&'static str], after: &[&'static str]| -> Vec<&str> {
            [before, &job, after].concat()
        };

        ends(folder, &with(&["ncp", "run"], &["--trace", "run.csv"]), 0);
        let run = traced(&folder.join("run.csv"));
        assert!(run.len() > 5_000, "{}", run.len());

        ends(folder, &with(&["ncp", "compile"], &["--output", "job.cnc"]), 0);
        let stored = ["run", "job.cnc", "--model", model, "--axes", "15", "--trace", "stored.csv"];
        ends(folder, &stored, 0);
        assert_eq!(traced(&folder.join("stored.csv")), run, "stored on {model}");

        let emulator = Emulator::builder()
            .model(model)
            .pty(folder.join("port"))
            .time(Clock::Instant)
            .record(true)
            .start()
            .unwrap();
        let (said, _) = ends(folder, &with(&["send"], &["--to", "port"]), 0);
        let end = run.last().unwrap();
        let place = format!("at X {}, Y {}, Z {}, A {} steps", end[0], end[1], end[2], end[3]);
        assert!(said.contains(&place), "{said} {place}");
        assert_eq!(recorded(&emulator), run, "sent to {model}");
        assert_eq!(emulator.position().unwrap(), end);
    }
}

#[test]
fn check_says_everything_and_where() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let job = "IMF_PBL\nREF XYZ\nMOVEABSX 5\nMOVEABS X5 Q7\n(Steps per circle: 64)\nMOVEABS B5\n";
    fs::write(folder.join("job.ncp"), job).unwrap();
    let (out, _) = ends(folder, &["ncp", "check", "job.ncp", "--format", "short"], 1);
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines.len(), 5, "{out}");
    for (line, place) in lines.iter().zip(["3:1", "4:12", "5:1", "6:9"]) {
        assert!(line.starts_with(&format!("job.ncp:{place}: error[")), "{line}");
    }
    assert_eq!(lines[4], "job.ncp: 6 lines, 4 errors");

    let (out, _) = ends(folder, &["ncp", "check", "job.ncp", "--format", "json"], 1);
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["errors"], 4);
    assert_eq!(json["diagnostics"][1]["text"], "Q7");
    assert_eq!(json["diagnostics"][1]["column"], 12);

    let (out, _) = ends(folder, &["ncp", "check", "job.ncp"], 1);
    assert!(out.contains("[job.ncp:4:12]") && out.contains("4 │ MOVEABS X5 Q7"), "{out}");

    // What may move something is not left out.
    let lenient = ["ncp", "check", "job.ncp", "--format", "short", "--lenient"];
    let (out, _) = ends(folder, &lenient, 1);
    assert!(out.ends_with("6 lines, 3 errors, 1 warning\n"), "{out}");
}

#[test]
fn with_an_error_nothing_is_done_unless_it_is_lenient() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let job =
        "IMF_PBL\nREF XYZ\nMOVEABS X1000\n(no command)\nMOVEABS Y1000\nMOVEABS C5\nMOVEABS X0\n";
    fs::write(folder.join("job.ncp"), job).unwrap();
    let (out, err) = ends(folder, &["ncp", "run", "job.ncp"], 1);
    assert!(out.is_empty() && err.contains("job.ncp has 2 errors"), "{out}{err}");

    let emulator =
        Emulator::builder().pty(folder.join("port")).time(Clock::Instant).start().unwrap();
    ends(folder, &["send", "job.ncp", "--to", "port"], 1);
    assert!(emulator.commands().unwrap().is_empty());

    let (out, _) = ends(folder, &["ncp", "run", "job.ncp", "--lenient", "--json"], 1);
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&json["ended"], &json["line"]), (&"error".into(), &6.into()));
    assert_eq!(json["axes"]["Y"]["position"], 80);
    ends(folder, &["send", "job.ncp", "--to", "port", "--lenient"], 1);
    assert_eq!(emulator.position().unwrap(), [80, 80, 0, 0]);
}

#[test]
fn an_error_reply_names_the_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("job.ncp"), "IMF_PBL\nREF XYZ\nMOVEABS X1000\nMOVEABS X2000\n").unwrap();
    let emulator = Emulator::builder().tcp("127.0.0.1:0").time(Clock::Instant).start().unwrap();
    emulator.hold(Button::EmergencyStop).unwrap();
    let port = emulator.tcp_addr().unwrap().to_string();
    let (_, err) = ends(folder, &["send", "job.ncp", "--to", &port], 1);
    assert!(err.contains("answered 9") && err.contains("[job.ncp:2:1]"), "{err}");
}

#[test]
fn a_command_list_is_sent_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("list.txt"), "; two axes\n@03\n@0A 500,900, 300,900\n@0P\n").unwrap();
    let emulator = Emulator::builder().tcp("127.0.0.1:0").time(Clock::Instant).start().unwrap();
    let port = emulator.tcp_addr().unwrap().to_string();
    let (out, _) = ends(folder, &["send", "list.txt", "--to", &port, "-v"], 0);
    assert!(out.contains("     4  @0P") && out.contains("00001F400012C000000"), "{out}");
    assert_eq!(emulator.position().unwrap()[..2], [500, 300]);
}

/// A `vimc4 send` that is under way.
fn sending(folder: &Path, arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
    command.arg("send").args(arguments).current_dir(folder).stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < Duration::from_secs(20), "{what}");
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn stop_pauses_and_start_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("job.ncp"), "IMF_PBL\nREF XYZ\nVEL 50000\nMOVEABS X50000\n").unwrap();
    let emulator = Emulator::builder().tcp("127.0.0.1:0").start().unwrap();
    let port = emulator.tcp_addr().unwrap().to_string();
    let child = sending(folder, &["job.ncp", "--to", &port]);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 400);
    emulator.press(Button::Stop).unwrap();
    let mut last = -1;
    until("it stops", || std::mem::replace(&mut last, x()) == x());
    assert!(x() < 4_000);
    // START is a button that somebody holds for a moment; the host looks ten times a second.
    emulator.hold(Button::Start).unwrap();
    let output = child.wait_with_output().unwrap();
    emulator.release(Button::Start).unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("line 4: stopped; START goes on"));
    assert_eq!(x(), 4_000);
}

#[test]
fn ctrl_c_brakes_and_says_where() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("job.ncp"), "IMF_PBL\nREF XYZ\nMOVEABS X500000\n").unwrap();
    let emulator = Emulator::builder().pty(folder.join("port")).start().unwrap();
    let child = sending(folder, &["job.ncp", "--to", "port"]);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 100);
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    let err = text(&output.stderr);
    assert_ne!(output.status.code(), Some(0));
    let place = format!("at X {}, Y 0, Z 0, A 0 steps", x());
    assert!(err.contains("come to rest along its ramp") && err.contains(&place), "{err} {place}");
    assert!(err.contains("[job.ncp:3:1]"), "{err}");
}

#[test]
fn nobody_there_is_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("job.ncp"), "IMF_PBL\nREF XYZ\n").unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().to_string();
    let silent = thread::spawn(move || {
        let (mut client, _): (TcpStream, _) = listener.accept().unwrap();
        let mut sent = Vec::new();
        let _ = client.read_to_end(&mut sent);
        sent
    });
    let (_, err) = ends(folder, &["send", "job.ncp", "--to", &port], 2);
    assert!(err.contains("nothing answers"), "{err}");
    assert_eq!(silent.join().unwrap(), b"@07\r");
}

#[test]
fn questions_and_waits() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let job =
        "IMF_PBL\nREF XYZ\nHALT ; turn the part\nMOVEABS X1000\nWAITBIT E1.3==1\nMOVEABS X0\n";
    fs::write(folder.join("job.ncp"), job).unwrap();
    let run = |more: &[&'static str], code| {
        ends(folder, &[&["ncp", "run", "job.ncp"], more].concat(), code)
    };
    let (out, err) = run(&[], 3);
    assert!(out.contains("line 3 waits") && err.contains("turn the part"), "{out}{err}");
    let (out, _) = run(&["--yes"], 3);
    assert!(out.contains("line 5 waits"), "{out}");
    run(&["--yes", "--skip-waits"], 0);
    let (out, _) = run(&["--yes", "--input", "0.2=1@10s", "--json"], 0);
    let json: Value = serde_json::from_str(&out).unwrap();
    assert!(json["time_ns"].as_u64().unwrap() > 10_000_000_000);

    // A stored program has nobody to ask, and says so.
    let (_, err) = ends(folder, &["ncp", "compile", "job.ncp"], 1);
    assert!(err.contains("no-operator") && err.contains("[job.ncp:3:1]"), "{err}");
}

/// A terminal that somebody types at: what they type into, and the end for the program.
fn terminal() -> (fs::File, fs::File) {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    let typed = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&typed).unwrap();
    unlockpt(&typed).unwrap();
    let name = ptsname(&typed, Vec::new()).unwrap().into_string().unwrap();
    let end = fs::File::options().read(true).write(true).open(name).unwrap();
    (fs::File::from(typed), end)
}

#[test]
fn the_operator_finds_the_zero() {
    let folder = tempfile::tempdir().unwrap();
    let job = "IMF_PBL\nREF XYZ\nWPTEACH\nMOVEABS X1000\nWPTEACH\nMOVEABS Y1000\n";
    fs::write(folder.path().join("job.ncp"), job).unwrap();
    let (mut typed, end) = terminal();
    // The first is found after a slip, the second is left where it was.
    typed.write_all(b"MOVEREL X500\nMOVEREL Q5\n\nMOVEREL X500\nk\n").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
    command.args(["ncp", "run", "job.ncp", "--json"]).current_dir(&folder).stdin(end);
    let output = command.output().unwrap();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    let json: Value = serde_json::from_str(&out).unwrap_or_else(|_| panic!("{out}{err}"));
    assert_eq!(
        (&json["axes"]["X"]["position"], &json["axes"]["Y"]["position"]),
        (&160.into(), &80.into())
    );
    assert!(
        err.contains("line 3: find the work-piece zero") && err.contains("MOVEREL takes no `Q`"),
        "{err}"
    );
}

#[test]
fn enter_is_the_stop_key() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("job.ncp"), "IMF_PBL\nREF XYZ\nVEL 50000\nMOVEABS X50000\n").unwrap();
    let emulator = Emulator::builder().tcp("127.0.0.1:0").start().unwrap();
    let port = emulator.tcp_addr().unwrap().to_string();
    let (mut typed, end) = terminal();
    let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
    command.args(["send", "job.ncp", "--to", &port]).current_dir(folder).stdin(end);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 400);
    typed.write_all(b"\n").unwrap();
    let mut last = -1;
    until("it stops", || std::mem::replace(&mut last, x()) == x());
    let stopped = x();
    assert!(stopped < 4_000);
    thread::sleep(Duration::from_millis(300));
    assert_eq!(x(), stopped);
    typed.write_all(b"\n").unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(
        text(&output.stderr).contains("line 4: stopped; Enter, or START at the panel, goes on")
    );
    assert_eq!(x(), 4_000);
}

#[test]
fn what_cannot_begin_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("job.ncp"), "IMF_PBL\n").unwrap();
    for (arguments, said) in [
        (&["ncp", "check", "nothing.ncp"][..], "cannot read nothing.ncp"),
        (&["ncp", "check", "job.ncp", "--model", "smcu"], "does not speak isel's @-format"),
        (&["ncp", "run", "job.ncp", "--machine", "nothing"], "nothing"),
        (&["send", "job.ncp", "--to", "nowhere"], "cannot open nowhere"),
    ] {
        let (_, err) = ends(folder, arguments, 2);
        assert!(err.contains(said), "{err}");
    }
    let mut utf16 = fs::File::create(folder.join("wide.ncp")).unwrap();
    utf16.write_all(b"\xFF\xFEI\0").unwrap();
    let (_, err) = ends(folder, &["ncp", "check", "wide.ncp"], 2);
    assert!(err.contains("UTF-16"), "{err}");
}

#[test]
fn help_says_what_a_command_does_at_length() {
    let folder = tempfile::tempdir().unwrap();
    for (command, said) in [
        (&["run"][..], "START button"),
        (&["conform"], "Each session is a conversation"),
        (&["circle"], "counted counterclockwise from the first axis"),
        (&["send"], "Enter stops a motion along its ramp"),
        (&["ncp", "check"], "the machine's travel"),
        (&["ncp", "run"], "The job is checked first"),
        (&["ncp", "compile"], "has nobody to ask"),
        (&["ncp", "lsp"], "as you type"),
    ] {
        let (out, _) = ends(folder.path(), &[command, &["--help"]].concat(), 0);
        assert!(out.contains(said), "{command:?}: {out}");
    }
}

#[test]
fn a_job_fits_where_its_zero_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let job = "IMF_PBL\nREF XYZ\nMOVEABS X1000 Y2000 Z5000\nWPREG3ACT\nMOVEABS X0\n";
    fs::write(folder.join("job.ncp"), job).unwrap();
    let check = ["ncp", "check", "job.ncp", "--format", "short"];
    let (out, _) = ends(folder, &[&check[..], &["--machine", "mill"]].concat(), 1);
    assert!(out.contains("beyond-travel") && out.contains("--zero X,Y,Z"), "{out}");

    let mill = vimc4(folder, &["machines", "show", "mill"]).stdout;
    let own = "\n[job.zero]\nx = 100000\ny = 50000\nz = -60000\n\n[job.registers.3]\nx = 7000\n";
    fs::write(folder.join("mine.toml"), text(&mill) + own).unwrap();
    let from_outside =
        ["--machine", "mill", "--zero", "100mm,50mm,-60mm", "--wpreg", "3=7mm"].as_slice();
    let from_profile = ["--machine", "mine.toml"].as_slice();
    for site in [from_outside, from_profile] {
        ends(folder, &[&check[..], site].concat(), 0);
        let run = [&["ncp", "run", "job.ncp", "--json"], site].concat();
        let (out, _) = ends(folder, &run, 0);
        let summary: Value = serde_json::from_str(&out).unwrap();
        let end = ["X", "Y", "Z"].map(|axis| summary["axes"][axis]["position"].as_i64().unwrap());
        assert_eq!(end, [7 * 80, 52 * 80, -55 * 100]);
    }

    for (arguments, said) in [
        (&["--zero", "1,2,3,4,5"][..], "there are four axes at most"),
        (&["--zero", "1,x"], "\"x\" is no coordinate of Y"),
        (&["--wpreg", "9=1"], "\"9\" is no register"),
        (&["--machine", "board-plotter", "--zero", ",,1"], "board-plotter has no Z axis"),
    ] {
        let (_, err) = ends(folder, &[&check[..], arguments].concat(), 2);
        assert!(err.contains(said), "{err}");
    }
}
