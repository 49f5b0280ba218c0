//! Job files, end to end: checked, run, compiled, sent.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::ops::Deref;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use vimc4::{Button, Clock, Emulator, Event, Motion, Point};

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, LIMIT, Timed, joined, until};
use process::{Chatter, Process, VIMC4, pseudo_terminal, rest_of, vimc4};

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

/// A folder of its own, which goes when it is dropped.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }

    /// With a job in `job.ncp`.
    fn with(job: impl AsRef<[u8]>) -> Folder {
        let folder = Folder::new();
        fs::write(folder.join("job.ncp"), job).unwrap();
        folder
    }
}

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        self.0.path()
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs it, and it must end with this code.
fn ends(folder: &Path, arguments: &[&str], code: i32) -> (String, String) {
    let (ended, out, err) = process::run(folder, arguments);
    assert_eq!(ended, code, "{arguments:?}\n{out}\n{err}");
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
        let folder = Folder::with(JOB);
        let job = ["job.ncp", "--model", model];
        let with = |before: &[&'static str], after: &[&'static str]| -> Vec<&str> {
            [before, &job, after].concat()
        };

        ends(&folder, &with(&["ncp", "run"], &["--trace", "run.csv"]), 0);
        let run = traced(&folder.join("run.csv"));
        assert!(run.len() > 5_000, "{}", run.len());

        ends(&folder, &with(&["ncp", "compile"], &["--output", "job.cnc"]), 0);
        // The axes stand in the file.
        let stored = ["run", "job.cnc", "--model", model, "--trace", "stored.csv"];
        ends(&folder, &stored, 0);
        assert_eq!(traced(&folder.join("stored.csv")), run, "stored on {model}");

        let (emulator, port) = listening(model, "bench", Clock::Instant);
        let (out, _) =
            ends(&folder, &["send", "job.cnc", "--to", &port, "--model", model, "--yes"], 0);
        assert!(out.contains("stored; START at the machine runs it"), "{out}");
        assert!(recorded(&emulator).is_empty());
        emulator.press(Button::Start).unwrap();
        until("the program ends", || recorded(&emulator).len() >= run.len());
        assert!(recorded(&emulator) == run, "stored by send on {model}");

        let emulator = Emulator::builder()
            .model(model)
            .pty(folder.join("port"))
            .time(Clock::Instant)
            .record(true)
            .start()
            .unwrap();
        let (said, _) = ends(&folder, &with(&["send"], &["--to", "port"]), 0);
        let end = run.last().unwrap();
        // The bench has 80 steps to the mm.
        let place = |axis: usize| format!("{:.3}", end[axis] as f64 * 0.0125);
        let place = format!("at X {} mm, Y {} mm, Z {} mm, A ", place(0), place(1), place(2));
        assert!(said.contains(&place), "{said} {place}");
        assert_eq!(recorded(&emulator), run, "sent to {model}");
        assert_eq!(emulator.position().unwrap(), end);
    }
}

#[test]
fn check_says_everything_and_where() {
    let job = "IMF_PBL\nREF XYZ\nMOVEABSX 5\nMOVEABS X5 Q7\n(Steps per circle: 64)\nMOVEABS B5\nPROGEND\n";
    let folder = Folder::with(job);
    let (out, _) = ends(&folder, &["ncp", "check", "job.ncp", "--format", "short"], 1);
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines.len(), 5, "{out}");
    for (line, place) in lines.iter().zip(["3:1", "4:12", "5:1", "6:9"]) {
        assert!(line.starts_with(&format!("job.ncp:{place}: error[")), "{line}");
    }
    assert_eq!(lines[4], "job.ncp: 7 lines, 4 errors");

    let (out, _) = ends(&folder, &["ncp", "check", "job.ncp", "--format", "json"], 1);
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["errors"], 4);
    assert_eq!(json["diagnostics"][1]["text"], "Q7");
    assert_eq!(json["diagnostics"][1]["column"], 12);

    let (out, _) = ends(&folder, &["ncp", "check", "job.ncp"], 1);
    assert!(out.contains("--> job.ncp:4:12") && out.contains("4 | MOVEABS X5 Q7"), "{out}");

    // What may move something is not left out.
    let lenient = ["ncp", "check", "job.ncp", "--format", "short", "--lenient"];
    let (out, _) = ends(&folder, &lenient, 1);
    assert!(out.ends_with("7 lines, 3 errors, 1 warning\n"), "{out}");
    assert!(out.contains("\njob.ncp: the job ends at line 3: unknown command `MOVEABSX`"), "{out}");
    let (out, _) = ends(&folder, &["ncp", "check", "job.ncp", "--format", "json", "--lenient"], 1);
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["ends_in_line"], 3);
    let (out, _) = ends(&folder, &["ncp", "check", "job.ncp", "--format", "short"], 1);
    assert!(!out.contains("the job ends"), "{out}");
}

#[test]
fn with_an_error_nothing_is_done_unless_it_is_lenient() {
    let job =
        "IMF_PBL\nREF XYZ\nMOVEABS X1000\n(no command)\nMOVEABS Y1000\nMOVEABS C5\nMOVEABS X0\n";
    let folder = Folder::with(job);
    let (out, err) = ends(&folder, &["ncp", "run", "job.ncp"], 1);
    assert!(out.is_empty() && err.contains("job.ncp has 2 errors"), "{out}{err}");

    let emulator =
        Emulator::builder().pty(folder.join("port")).time(Clock::Instant).start().unwrap();
    ends(&folder, &["send", "job.ncp", "--to", "port"], 1);
    // Where there is nothing to send that is told in the words of `run`.
    for (name, text) in [("empty.txt", ""), ("remark.txt", "; nothing\r\n\r\n")] {
        fs::write(folder.join(name), text).unwrap();
        let (_, err) = ends(&folder, &["send", name, "--to", "port"], 2);
        assert!(err.contains(&format!("{name} holds no command")), "{err}");
    }
    assert!(emulator.commands().unwrap().is_empty());

    let (out, _) = ends(&folder, &["ncp", "run", "job.ncp", "--lenient", "--json"], 1);
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&json["ended"], &json["line"]), (&"error".into(), &6.into()));
    assert_eq!(json["axes"]["Y"]["position"], 80);
    ends(&folder, &["send", "job.ncp", "--to", "port", "--lenient"], 1);
    assert_eq!(emulator.position().unwrap(), [80, 80, 0, 0]);
}

#[test]
fn an_error_reply_names_the_line() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\nMOVEABS X2000\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    emulator.hold(Button::EmergencyStop).unwrap();
    let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port], 1);
    assert!(err.contains("answered 9") && err.contains("--> job.ncp:2:1"), "{err}");
}

#[test]
fn a_command_list_is_sent_as_it_is() {
    let folder = Folder::new();
    fs::write(folder.join("list.txt"), "; two axes\n@03\n@0A 500,900, 300,900\n@0P\n").unwrap();
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let (out, _) = ends(&folder, &["send", "list.txt", "--to", &port, "-v"], 0);
    assert!(out.contains("     4  @0P") && out.contains("00001F400012C000000"), "{out}");
    assert_eq!(emulator.position().unwrap()[..2], [500, 300]);
}

#[test]
fn a_list_for_a_card_that_tells_of_configured_axes_only_is_sent() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("list.txt"), "@0P\n@02\n@0A300,900\n@0P\n@03\n@0P\n").unwrap();
    let (_emulator, port) = listening("c142", "bench", Clock::Instant);
    let send = ["send", "list.txt", "--to", &port, "--model", "c142", "-v"];
    let (out, _) = ends(folder, &send, 0);
    let answers = ["0", "0", "0", "000012C", "0", "000000000012C"];
    for (line, answer) in out.lines().zip(answers) {
        assert!(line.split_whitespace().any(|word| word == answer), "{answer}: {out}");
    }
    assert!(out.lines().count() >= answers.len(), "{out}");
}

/// A `vimc4 send` that is under way.
fn sending(folder: &Path, arguments: &[&str]) -> Child {
    sending_from(folder, arguments, Stdio::null())
}

/// The same with somebody who types, or nobody.
fn sending_from(folder: &Path, arguments: &[&str], typed: impl Into<Stdio>) -> Child {
    vimc4(folder, &[&["send"], arguments].concat()).stdin(typed).start().unwrap()
}

/// Waits until an axis stays where it is.
fn until_it_rests(x: impl Fn() -> i64) {
    let mut last = -1;
    until("it stops", || std::mem::replace(&mut last, x()) == x());
}

#[test]
fn stop_pauses_and_start_goes_on() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 50000\nMOVEABS X50000\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Real);
    let child = sending(&folder, &["job.ncp", "--to", &port]);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 400);
    emulator.press(Button::Stop).unwrap();
    until_it_rests(x);
    assert!(x() < 4_000);
    // START is a button that somebody holds for a moment; the host looks ten times a second.
    emulator.hold(Button::Start).unwrap();
    let output = child.output_in_time().unwrap();
    emulator.release(Button::Start).unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(
        text(&output.stderr)
            .contains("line 4: stopped; START at the panel, held until it moves, goes on")
    );
    assert_eq!(x(), 4_000);
}

/// A job that mills with a spindle that needs 1 s to run up.
const MILLING: &str =
    "IMF_PBL\nREF XYZ\nVEL 50000\nSPINDLE CW TIME1000\nMOVEABS X50000\nSPINDLE OFF\nPROGEND\n";

#[test]
fn a_stopped_job_does_not_go_on_with_a_standing_spindle() {
    let folder = Folder::with(MILLING);
    // During the motion, which begins at 6 s, and while the spindle runs up.
    for (stop, begins) in
        [("6.3s", "STOP at the panel switches"), ("5.5s", "STOP at the panel has")]
    {
        let stop = format!("stop@{stop}");
        let arguments = [
            "ncp",
            "run",
            "job.ncp",
            "--machine",
            "mill",
            "-v",
            "--press",
            &stop,
            "--press",
            "start@9s",
        ];
        let (out, err) = ends(&folder, &arguments, 0);
        let said = format!("line 5: {begins}");
        assert!(
            err.contains(&said) && err.contains("is switched on again, and runs up for 1 s"),
            "{err}"
        );
        let lines: Vec<&str> = out.lines().filter(|line| line.contains('@')).collect();
        let on: Vec<usize> = (0..lines.len()).filter(|at| lines[*at].contains("@0B2,1")).collect();
        assert_eq!(on.len(), 2, "{out}");
        let next = lines[on[1] + 1];
        assert!(next.contains("@0S") || next.contains("@0A4000"), "{out}");
        assert!(out.contains("warning   STOP at the panel has switched the spindle off"), "{out}");
    }
}

#[test]
fn a_spindle_that_stop_has_switched_off_is_switched_on_again_at_a_port() {
    let folder = Folder::with(MILLING);
    fs::write(folder.join("list.txt"), "@01\n@0B2,1\n@0A4000,4000\n@0B2,0\n").unwrap();
    for (file, model) in [("job.ncp", "imc4"), ("list.txt", "imc4"), ("job.ncp", "imc-s8")] {
        let (emulator, port) = listening(model, "bench", Clock::Real);
        let arguments = [file, "--to", &port, "--model", model, "--machine", "mill"];
        let child = sending(&folder, &arguments);
        let x = || emulator.position().unwrap()[0];
        let spindle = || {
            let ports = emulator.view().unwrap().ports;
            ports.iter().find(|port| !port.input && port.port == 2).unwrap().value
        };
        until("it moves", || x() > 400);
        assert_eq!(spindle(), 1);
        emulator.press(Button::Stop).unwrap();
        until_it_rests(x);
        assert_eq!(spindle(), 0);
        thread::sleep(Duration::from_millis(300));
        emulator.hold(Button::Start).unwrap();
        until("the spindle is on", || spindle() == 1);
        let output = child.output_in_time().unwrap();
        let err = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{err}");
        assert!(err.contains("; it is switched on again"), "{err}");
        let sent = sent(&emulator);
        let again = sent.iter().rposition(|sent| sent == "@0B2,1").unwrap();
        let next = sent[again..].iter().find(|sent| !sent.contains(['b', 'P', 'D', '1'])).unwrap();
        // A controller whose START goes on by itself is only followed.
        assert_eq!(next, if model == "imc4" { "@0S" } else { "@0B2,0" }, "{sent:?}");
    }
}

#[test]
fn ctrl_c_brakes_and_says_where() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X500000\n");
    let emulator = Emulator::builder().pty(folder.join("port")).start().unwrap();
    let child = sending(&folder, &["job.ncp", "--to", "port"]);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 100);
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let output = child.output_in_time().unwrap();
    let err = text(&output.stderr);
    assert_ne!(output.status.code(), Some(0));
    let place = format!("at X {:.3} mm, Y 0.000 mm", x() as f64 * 0.0125);
    assert!(err.contains("come to rest along its ramp") && err.contains(&place), "{err} {place}");
    assert!(err.contains("--> job.ncp:3:1"), "{err}");
}

#[test]
fn nobody_there_is_told_at_once() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\n");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().to_string();
    let silent = thread::spawn(move || {
        let (mut client, _): (TcpStream, _) = listener.accept().unwrap();
        let mut sent = Vec::new();
        let _ = client.read_to_end(&mut sent);
        sent
    });
    let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port], 2);
    assert!(err.contains("nothing answers"), "{err}");
    assert_eq!(joined("the end of the silent server", silent), b"@0V\r");
}

#[test]
fn questions_and_waits() {
    let folder = Folder::new();
    let job =
        "IMF_PBL\nREF XYZ\nHALT ; turn the part\nMOVEABS X1000\nWAITBIT E1.3==1\nMOVEABS X0\n";
    fs::write(folder.join("job.ncp"), job).unwrap();
    let run = |more: &[&'static str], code| {
        ends(&folder, &[&["ncp", "run", "job.ncp"], more].concat(), code)
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
    let (_, err) = ends(&folder, &["ncp", "compile", "job.ncp"], 1);
    assert!(err.contains("no-operator") && err.contains("--> job.ncp:3:1"), "{err}");
}

/// A terminal that somebody types at: what they type into, and the end for the program.
fn terminal() -> (fs::File, fs::File) {
    let (typed, name) = pseudo_terminal();
    let end = process::terminal(name).into_inner();
    (fs::File::from(typed), end)
}

/// What `ncp run` says of `job.ncp`, as JSON and to who has typed this at a terminal.
fn run_with(folder: &Path, machine: &str, typed: &str) -> (Value, String) {
    let (mut terminal, end) = terminal();
    terminal.write_all(typed.as_bytes()).unwrap();
    let mut command = Command::new(VIMC4);
    command.args(["ncp", "run", "job.ncp", "--machine", machine, "--json"]);
    command.current_dir(folder).stdin(end).stdout(Stdio::piped()).stderr(Stdio::piped());
    let output = command.start().unwrap().output_in_time().unwrap();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    let json = serde_json::from_str(&out);
    assert!(json.is_ok(), "{out}{err}");
    (json.unwrap(), err)
}

#[test]
fn the_operator_finds_the_zero() {
    let folder = Folder::new();
    let job = "IMF_PBL\nREF XYZ\nWPTEACH\nMOVEABS X1000\nWPTEACH\nMOVEABS Y1000\n";
    fs::write(folder.join("job.ncp"), job).unwrap();
    // The first is found after a slip, the second is left where it was.
    let typed = "MOVEREL X500\nMOVEREL Q5\n\nMOVEREL X500\nk\n";
    let (json, err) = run_with(&folder, "bench", typed);
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
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 50000\nMOVEABS X50000\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Real);
    let (mut typed, end) = terminal();
    let child = sending_from(&folder, &["job.ncp", "--to", &port], end);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 400);
    typed.write_all(b"\n").unwrap();
    until_it_rests(x);
    let stopped = x();
    assert!(stopped < 4_000);
    thread::sleep(Duration::from_millis(300));
    assert_eq!(x(), stopped);
    typed.write_all(b"\n").unwrap();
    let output = child.output_in_time().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(
        text(&output.stderr).contains("line 4: stopped; Enter goes on, q ends the job; START at")
    );
    assert_eq!(x(), 4_000);
}

#[test]
fn what_cannot_begin_says_why() {
    let folder = Folder::with("IMF_PBL\n");
    for (arguments, said) in [
        (&["ncp", "check", "nothing.ncp"][..], "cannot read nothing.ncp"),
        (&["ncp", "check", "job.ncp", "--model", "smcu"], "does not speak isel's @-format"),
        (&["ncp", "run", "job.ncp", "--machine", "nothing"], "nothing"),
        (&["send", "job.ncp", "--to", "nowhere"], "cannot open nowhere"),
    ] {
        let (_, err) = ends(&folder, arguments, 2);
        assert!(err.contains(said), "{err}");
    }
    let mut utf16 = fs::File::create(folder.join("wide.ncp")).unwrap();
    utf16.write_all(b"\xFF\xFEI\0").unwrap();
    let (_, err) = ends(&folder, &["ncp", "check", "wide.ncp"], 2);
    assert!(err.contains("UTF-16"), "{err}");
    // What is certainly something else is told as that, and not line by line.
    for (bytes, said) in [
        (&b"; of 1999\n@07\n"[..], "is a command list and no job"),
        (b"IN;PA1,2;", "is a plot file and no job"),
        (b"\x1F\x8B\x08", "is packed with gzip"),
        (b"{\"recording\":1}\n", "is a recording"),
    ] {
        fs::write(folder.join("other"), bytes).unwrap();
        for command in ["run", "check", "compile"] {
            let (_, err) = ends(&folder, &["ncp", command, "other"], 2);
            assert!(err.contains(said), "{command}: {err}");
        }
    }
}

#[test]
fn help_says_what_a_command_does_at_length() {
    let folder = Folder::new();
    for (command, said) in [
        (&["run"][..], "START button"),
        (&["conform"], "Each session is a conversation"),
        (&["circle"], "counted counterclockwise from the first axis"),
        (&["send"], "Enter, and any other line, stops a motion along its ramp"),
        (&["ncp", "check"], "the machine's travel"),
        (&["ncp", "run"], "The job is checked first"),
        (&["ncp", "compile"], "cannot ask anybody"),
        (&["ncp", "lsp"], "as you type"),
    ] {
        let (out, _) = ends(&folder, &[command, &["--help"]].concat(), 0);
        assert!(out.contains(said), "{command:?}: {out}");
    }
}

#[test]
fn a_job_fits_where_its_zero_is_said() {
    let job = "IMF_PBL\nREF XYZ\nMOVEABS X1000 Y2000 Z5000\nWPREG3ACT\nMOVEABS X0\n";
    let folder = Folder::with(job);
    let check = ["ncp", "check", "job.ncp", "--format", "short"];
    let (out, _) = ends(&folder, &[&check[..], &["--machine", "mill"]].concat(), 1);
    assert!(out.contains("beyond-travel") && out.contains("--zero X,Y,Z"), "{out}");

    let (_, mill, _) = process::run(&folder, &["machines", "show", "mill"]);
    let own = "\n[job.zero]\nx = 100000\ny = 50000\nz = -60000\n\n[job.registers.3]\nx = 7000\n";
    fs::write(folder.join("mine.toml"), mill + own).unwrap();
    let from_outside =
        ["--machine", "mill", "--zero", "100mm,50mm,-60mm", "--wpreg", "3=7mm"].as_slice();
    let from_profile = ["--machine", "mine.toml"].as_slice();
    for site in [from_outside, from_profile] {
        ends(&folder, &[&check[..], site].concat(), 0);
        let run = [&["ncp", "run", "job.ncp", "--json"], site].concat();
        let (out, _) = ends(&folder, &run, 0);
        let summary: Value = serde_json::from_str(&out).unwrap();
        let end = ["X", "Y", "Z"].map(|axis| summary["axes"][axis]["position"].as_i64().unwrap());
        assert_eq!(end, [7 * 80, 52 * 80, -55 * 100]);
    }

    for (arguments, said) in [
        (&["--zero", "1,2,3,4,5"][..], "there are four axes at most"),
        (&["--zero", "1,x"], "\"x\" is not a coordinate of Y"),
        (&["--wpreg", "9=1"], "\"9\" is not a register"),
        (&["--machine", "board-plotter", "--zero", ",,1"], "board-plotter has no Z axis"),
    ] {
        let (_, err) = ends(&folder, &[&check[..], arguments].concat(), 2);
        assert!(err.contains(said), "{err}");
    }
}

/// A controller and the arguments that send a job to it.
fn listening(model: &str, machine: &str, clock: Clock) -> (Emulator, String) {
    let emulator = Emulator::builder()
        .model(model)
        .machine(machine)
        .tcp("127.0.0.1:0")
        .time(clock)
        .record(true);
    let emulator = emulator.start().unwrap();
    let port = emulator.tcp_addr().unwrap().to_string();
    (emulator, port)
}

/// What was sent, command by command.
fn sent(emulator: &Emulator) -> Vec<String> {
    let commands = emulator.commands().unwrap();
    commands.iter().map(|command| text(&command.bytes)).collect()
}

#[test]
fn a_job_for_another_model_is_refused_before_anything_moves() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\n");
    fs::write(folder.join("plot.plt"), "IN;PA100,100;").unwrap();
    for (there, asked, what) in [
        ("imc-s8", "imc4", "is imc-s8 (it says `isel iMC-S8"),
        ("imc4", "imc-s8", "is imc4 (it says"),
        ("imc4-m", "imc4", "is imc4-m (it says"),
        ("imc-mp", "imc-m", "is imc-mp (it says"),
    ] {
        let (emulator, port) = listening(there, "bench", Clock::Instant);
        let send = ["send", "job.ncp", "--to", &port, "--model", asked];
        let (_, err) = ends(&folder, &send, 2);
        assert!(err.contains(what) && err.contains("--any-model"), "{err}");
        assert_eq!(sent(&emulator), ["@0V"]);
        ends(&folder, &[&send[..], &["--any-model"]].concat(), 0);
        assert_eq!(emulator.position().unwrap()[0], 80);
    }
    let (emulator, port) = listening("motionsystem", "board-plotter", Clock::Instant);
    let send = ["send", "plot.plt", "--to", &port, "--machine", "board-plotter", "--model", "smcu"];
    let (_, err) = ends(&folder, &send, 2);
    assert!(err.contains("is motionsystem (it says `S204"), "{err}");
    assert_eq!(emulator.position().unwrap()[..2], [0, 0]);
}

/// A profile of a built-in model in which something is replaced.
fn profile(folder: &Path, model: &str, replaced: &str, by: &str) -> String {
    let (text, _) = ends(folder, &["models", "show", model], 0);
    assert!(text.contains(replaced), "{text}");
    let path = folder.join("model.toml");
    fs::write(&path, text.replace(replaced, by)).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn where_start_resumes_the_host_sends_nothing() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 50000\nMOVEABS X50000\n");
    for resumes in [true, false] {
        let (text_of, _) = ends(&folder, &["models", "show", "imc-s8"], 0);
        let held = if text_of.contains("start_resumes_dnc = true") { "true" } else { "false" };
        let quirk = |value: &str| format!("start_resumes_dnc = {value}");
        let wanted = if resumes { "true" } else { "false" };
        let model = profile(&folder, "imc-s8", &quirk(held), &quirk(wanted));
        let (emulator, port) = listening(&model, "bench", Clock::Real);
        let child = sending(&folder, &["job.ncp", "--to", &port, "--model", &model]);
        let x = || emulator.position().unwrap()[0];
        until("it moves", || x() > 400);
        emulator.press(Button::Stop).unwrap();
        until_it_rests(x);
        assert!(x() < 4_000);
        match resumes {
            // Long enough for a host that polls.
            true => {
                thread::sleep(Duration::from_millis(300));
                emulator.press(Button::Start).unwrap();
            }
            false => emulator.hold(Button::Start).unwrap(),
        }
        let output = child.output_in_time().unwrap();
        let err = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{err}");
        assert_eq!(x(), 4_000);
        let polled = sent(&emulator).iter().filter(|sent| sent.starts_with("@0DS0")).count();
        let started = sent(&emulator).iter().filter(|sent| sent.starts_with("@0S")).count();
        match resumes {
            true => {
                assert_eq!((polled, started), (0, 0));
                assert!(err.contains("line 4: stopped; START at the panel goes on"), "{err}");
            }
            false => {
                assert!(polled > 0 && started == 1);
                assert!(err.contains("START at the panel, held until it moves, goes on"), "{err}");
            }
        }
    }
}

/// Holes, outputs, a spindle, a zero, a tool: what a later line depends on.
const LONG_JOB: &str = "\
IMF_PBL
REF XYZ
VEL 20000
FASTVEL 60000
GETTOOL 3
SPINDLE CW RPM8000 TIME500
SETBIT A1.4
WPZEROABS X10000 Y10000 Z-20000
FASTABS X5000 Y5000 Z10000
PLANE XZ
MOVEABS Z0
MOVEREL X2000
MOVEREL Y2500
PLANE XY
CWREL I1000 J0
DRILLDEF C1 D2000 V5000 L500 S1000
DRILL X1000 Y1000
MOVEABS X0 Y0
SPINDLE OFF
PROGEND
";

#[test]
fn an_aborted_job_goes_on_with_its_line() {
    let folder = Folder::with(LONG_JOB);
    let machine = ["--machine", "bench", "--yes"];
    for model in ["imc4", "imc-s8"] {
        let whole = {
            let (emulator, port) = listening(model, "bench", Clock::Instant);
            let send = ["send", "job.ncp", "--to", &port, "--model", model];
            ends(&folder, &[&send[..], &machine].concat(), 0);
            recorded(&emulator)
        };
        // Aborted by an emergency stop in the middle, and gone on with.
        let (emulator, port) = listening(model, "bench", Clock::Instant);
        let send = ["send", "job.ncp", "--to", &port, "--model", model];
        for line in [11_u32, 13, 15, 17, 18] {
            let from = line.to_string();
            let resumed = [&send[..], &machine, &["--from", &from]].concat();
            let before = emulator.events().unwrap().len();
            let (out, err) = ends(&folder, &resumed, 0);
            assert!(out.contains("done in"), "{out}");
            assert!(err.contains(&format!("The job goes on with line {line}.")), "{err}");
            assert!(
                err.contains("work-piece zero X 10.000 mm, Y 10.000 mm, Z -20.000 mm"),
                "{err}"
            );
            assert!(err.contains("tool 3 is in") && err.contains("port 2 is 1"), "{err}");
            assert!(err.contains("reference runs come first: Z, Y, X"), "{err}");
            assert!(before < emulator.events().unwrap().len());
            assert_eq!(emulator.position().unwrap()[..3], whole.last().unwrap()[..3]);
            // What comes behind the approach is, step for step, what the whole job ends with.
            let places = recorded(&emulator);
            let steps = if line == 18 { 80 } else { 1_000 };
            assert!(places.ends_with(&whole[whole.len() - steps..]), "{model} line {line}");
        }
        // From above: across where Z is as high as it ever was, then the spindle, and then down.
        let commands = sent(&emulator);
        let last = commands.iter().rposition(|sent| sent == "@0R7").unwrap();
        let way: Vec<&String> = commands[last..]
            .iter()
            .filter(|sent| sent.starts_with("@0A") || sent.starts_with("@0B2"))
            .take(3)
            .collect();
        let steps = |sent: &str| -> Vec<i64> {
            sent[3..].split(',').step_by(2).map(|steps| steps.parse().unwrap()).collect()
        };
        let (across, down) = (steps(way[0]), steps(way[2]));
        assert!(across[0] != 0 && across[1] != 0 && across[2] == 0, "{way:?}");
        assert!(way[1].starts_with("@0B2,"), "{way:?}");
        assert!(down[..2] == [0, 0] && down[2] < 0, "{way:?}");
    }
}

#[test]
fn an_abort_says_the_line_to_go_on_with() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 60000\nMOVEABS X300000\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Real);
    let child = sending(&folder, &["job.ncp", "--to", &port]);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 200);
    emulator.hold(Button::EmergencyStop).unwrap();
    let output = child.output_in_time().unwrap();
    let err = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{err}");
    assert!(err.contains("answered 9") && err.contains("--from 4 goes on with that line"), "{err}");
    assert!(err.contains("such as the spindle, is still on"), "{err}");

    let (emulator, port) = listening("imc4", "bench", Clock::Real);
    let child = sending(&folder, &["job.ncp", "--to", &port]);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 200);
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let err = text(&child.output_in_time().unwrap().stderr);
    assert!(err.contains("--from 4 goes on with that line"), "{err}");
    let (out, _) = ends(&folder, &["send", "job.ncp", "--to", &port, "--from", "4", "--no-ref"], 0);
    assert!(out.contains("at X 300.000 mm"), "{out}");
    assert_eq!(x(), 24_000);

    for (from, said) in [("9", "has only 4 lines"), ("5", "has only 4 lines")] {
        let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port, "--from", from], 1);
        assert!(err.contains(said), "{err}");
    }
    fs::write(folder.join("job.ncp"), "IMF_PBL\nREF X\nWPTEACH\nMOVEABS X1\n").unwrap();
    let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port, "--from", "4"], 1);
    assert!(err.contains("found by hand in line 3") && err.contains("--zero"), "{err}");
}

/// A `vimc4 send` with somebody at the terminal, who reads before they type.
struct Typist {
    process: Process,
    terminal: fs::File,
    said: Receiver<String>,
    all: String,
}

impl Typist {
    fn new(folder: &Path, arguments: &[&str]) -> Typist {
        Typist::at(&mut vimc4(folder, &[&["send"], arguments].concat()))
    }

    /// Somebody at the terminal of any command.
    fn at(command: &mut Command) -> Typist {
        let (terminal, end) = terminal();
        let mut process = Process::of(command.stdin(end).start().unwrap());
        Typist { said: process.errors(), process, terminal, all: String::new() }
    }

    /// Waits for something to be said, and types a line.
    fn types(&mut self, asked: &str, typed: &str) {
        self.hears(asked);
        // In one piece: of lines that come at once only the first answers.
        self.terminal.write_all(format!("{typed}\n").as_bytes()).unwrap();
    }

    /// Waits for something to be said.
    fn hears(&mut self, asked: &str) {
        loop {
            let said = self.said.recv_timeout(LIMIT);
            assert!(said.is_ok(), "{asked}: {}", self.all);
            let said = said.unwrap();
            self.all += &said;
            self.all += "\n";
            if said.contains(asked) {
                return;
            }
        }
    }

    /// How it ended, and everything that was said.
    fn ends(mut self, code: i32) -> (String, String) {
        let mut out = String::new();
        self.process.output.as_mut().unwrap().read_to_string(&mut out).unwrap();
        let status = self.process.ended();
        self.all += &rest_of(&self.said);
        assert_eq!(status.code(), Some(code), "{}", self.all);
        (out, self.all)
    }
}

#[test]
fn a_halt_offers_to_go_line_by_line() {
    let moves = "MOVEABS X1000\nMOVEABS X2000\nMOVEABS X3000\nMOVEABS X4000\n";
    let folder = Folder::with(format!("IMF_PBL\nREF XYZ\nHALT ; look\n{moves}"));
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
    typist.types("s goes on line by line", "s");
    typist.types("Enter does it, c goes on without a halt", "");
    assert!(typist.all.contains("line 4: MOVEABS X1000"), "{}", typist.all);
    typist.types("line 5: MOVEABS X2000", "");
    typist.types("line 6: MOVEABS X3000", "q");
    let (out, _) = typist.ends(3);
    assert_eq!(emulator.position().unwrap()[0], 160);
    assert!(out.contains("--from 6 goes on with that line"), "{out}");

    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
    typist.types("s goes on line by line", "s");
    typist.types("line 4", "");
    typist.types("line 5", "c");
    let (_, err) = typist.ends(0);
    assert!(!err.contains("line 6: MOVEABS"), "{err}");
    assert_eq!(emulator.position().unwrap()[0], 320);
}

#[test]
fn the_zero_is_taught_before_the_start() {
    let folder = Folder::new();
    // On this mill it goes nowhere from the machine's zero: Z ends there.
    let job = "IMF_PBL\nREF XYZ\nFASTABS Z5000\nMOVEABS X1000 Y1000 Z0\n";
    fs::write(folder.join("job.ncp"), job).unwrap();
    let (emulator, port) = listening("imc4", "mill", Clock::Instant);
    let send = ["job.ncp", "--to", &port, "--machine", "mill"];
    let (_, err) = ends(&folder, &[&["send"], &send[..]].concat(), 1);
    assert!(err.contains("beyond-travel"), "{err}");
    assert!(emulator.commands().unwrap().is_empty());
    let mut typist = Typist::new(&folder, &[&send[..], &["--teach"]].concat());
    typist.types("Enter makes this place the zero", "MOVEREL X20000 Y30000");
    typist.types("Enter makes this place the zero", "MOVEREL Z-10000");
    typist.types("Enter makes this place the zero", "");
    let (_, err) = typist.ends(0);
    assert!(err.contains("next time, --zero 20000,30000,-10000,0 says the same"), "{err}");
    let taught = emulator.position().unwrap();

    let (emulator, port) = listening("imc4", "mill", Clock::Instant);
    let zero = ["--zero", "20000,30000,-10000"];
    let said = ["send", "job.ncp", "--to", &port, "--machine", "mill"];
    ends(&folder, &[&said[..], &zero].concat(), 0);
    assert_eq!(emulator.position().unwrap(), taught);
    // Nobody is there to find it.
    let (_, err) = ends(&folder, &[&said[..], &["--teach"]].concat(), 2);
    assert!(err.contains("say with --zero"), "{err}");
    // It is not found for a job that is wrong wherever it is; only that is told then.
    fs::write(folder.join("job.ncp"), format!("{job}MOVEABS Q5\n")).unwrap();
    let (_, err) = ends(&folder, &[&said[..], &["--teach"]].concat(), 1);
    assert!(err.contains("MOVEABS takes no `Q`") && !err.contains("beyond-travel"), "{err}");
}

#[test]
fn a_refused_line_leaves_the_place_as_it_was() {
    let job = "IMF_PBL\nREF XYZ\nFASTABS X1000 Y1000 Z-5000\nMOVEABS Z-6000\n";
    let folder = Folder::with(job);
    let (emulator, port) = listening("imc4", "mill", Clock::Instant);
    let send = ["job.ncp", "--to", &port, "--machine", "mill", "--teach"];
    let mut typist = Typist::new(&folder, &send);
    let asked = "Enter makes this place the zero";
    typist.types(asked, "MOVEREL X20000 Y20000 Z-60000");
    typist.types(asked, "MOVEREL Z-50000");
    typist.types(asked, "");
    assert!(typist.all.contains("Z would go to"), "{}", typist.all);
    let (_, err) = typist.ends(0);
    assert!(err.contains("--zero 20000,20000,-60000"), "{err}");
    // The mill has 80 steps to the mm across and 100 in Z.
    assert_eq!(emulator.position().unwrap()[..3], [21 * 80, 21 * 80, -66 * 100]);

    // At WPTEACH, with a line that is half understood, and one that a LIMIT forbids.
    let job = "IMF_PBL\nREF XYZ\nLIMIT X0,30000\nWPTEACH\nMOVEABS X1000\n";
    let typed = "MOVEREL X2000\nMOVEREL X3000 Q5\nMOVEREL X400000\nMOVEREL Z-900000\n\n";
    for job in [job.to_owned(), job.replace("LIMIT X0,30000\n", "")] {
        fs::write(folder.join("job.ncp"), job).unwrap();
        let (json, err) = run_with(&folder, "mill", typed);
        assert_eq!(json["ended"], "done", "{err}");
        let place = ["X", "Z"].map(|axis| json["axes"][axis]["position"].as_i64().unwrap());
        assert_eq!(place, [3 * 80, 0], "{err}");
    }
}

#[test]
fn line_by_line_only_enter_does_a_line() {
    let moves = "MOVEABS X1000\nMOVEABS X2000\nMOVEABS X3000\n";
    let folder = Folder::with(format!("IMF_PBL\nREF XYZ\nHALT\n{moves}"));
    let prompt = "Enter does it, c goes on without a halt";
    for end in ["q", "Q", "quit", "Stop"] {
        let (emulator, port) = listening("imc4", "bench", Clock::Instant);
        let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
        typist.types("s goes on line by line", "S");
        let refused = ["no", "what is it", "k", "MOVEREL X5", " "];
        for typed in refused {
            typist.types(prompt, typed);
        }
        typist.types(prompt, "");
        for typed in refused {
            let said = format!("`{typed}` is not an answer here; Enter does the line");
            assert!(typist.all.contains(&said), "{}", typist.all);
        }
        typist.types("line 5: MOVEABS X2000", end);
        typist.ends(3);
        assert_eq!(emulator.position().unwrap()[0], 80, "{end}");
    }
}

#[test]
fn a_halt_that_nobody_can_answer_ends_the_job() {
    let moves = "MOVEABS X1000\nMOVEABS X2000\n";
    let job = format!("IMF_PBL\nREF XYZ\nSETBIT A1.4\nHALT\n{moves}");
    let folder = Folder::with(job);
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let (out, err) = ends(&folder, &["send", "job.ncp", "--to", &port], 3);
    assert!(err.contains("line 4 waits for somebody, and nobody is at the terminal"), "{err}");
    assert!(out.contains("ended in line 4") && out.contains("the spindle, is still on"), "{out}");
    assert_eq!(emulator.position().unwrap()[0], 0);

    // Who goes away at the question, or in the midst of going line by line.
    for steps in [false, true] {
        let (emulator, port) = listening("imc4", "bench", Clock::Instant);
        let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
        if steps {
            typist.types("s goes on line by line", "s");
            typist.types("line 5: MOVEABS X1000", "");
            typist.types("line 6: MOVEABS X2000", "\u{4}");
        } else {
            typist.types("s goes on line by line", "\u{4}");
        }
        let (out, err) = typist.ends(3);
        assert!(err.contains("nobody is at the terminal"), "{err}");
        assert!(out.contains("is still on"), "{out}");
        assert_eq!(emulator.position().unwrap()[0], if steps { 80 } else { 0 });
    }
}

/// The command with which an ended job goes on, as it was said.
fn onward(err: &str) -> Vec<String> {
    let line = err.lines().find_map(|line| line.strip_prefix("  vimc4 "));
    assert!(line.is_some(), "{err}");
    line.unwrap().split(' ').map(|word| word.trim_matches('\'').to_owned()).collect()
}

/// Whoever is asked, and presses Ctrl-C, ends the job there.
#[test]
fn a_question_in_virtual_time_is_ended_like_the_job() {
    let folder = Folder::with("IMF_PBL\nMOVEREL X9000\nHALT\nMOVEREL X-9000\n");
    let run = ["ncp", "run", "job.ncp", "--machine", "mill", "--no-ref", "--record", "job.jsonl"];
    let mut typist = Typist::at(&mut vimc4(&folder, &run));
    typist.hears("q ends the job");
    typist.process.signal(Signal::INT);
    let (out, _) = typist.ends(130);
    assert!(out.ends_with("ended     line 3: it was interrupted\n"), "{out}");
    let recording = fs::read_to_string(folder.join("job.jsonl")).unwrap();
    assert!(recording.ends_with("\"end\":\"the run was interrupted\"}\n"), "{recording}");
}

#[test]
fn what_goes_on_with_a_job_is_said_whole() {
    let folder = Folder::new();
    // What was found by hand counts as what was said.
    let rest = "MOVEABS Z-1000\nWPREG2\nMOVEREL X500\n";
    for (job, options) in [
        ("IMF_PBL\nREF XYZ\nFASTABS X1000 Y1000 Z5000\nHALT\n", true),
        ("IMF_PBL\nREF XYZ\nWPTEACH\nFASTABS X1000 Y1000\nHALT\n", false),
    ] {
        let rest = if options { rest } else { "MOVEABS Z-1000\nMOVEREL X500\n" };
        fs::write(folder.join("a job.ncp"), format!("{job}{rest}")).unwrap();
        let (emulator, port) = listening("imc4", "mill", Clock::Instant);
        let mut send = vec!["a job.ncp", "--to", &port, "--machine", "mill"];
        if options {
            send.extend(["--zero", "20mm,30mm,-40mm", "--wpreg", "2=5mm,5mm,-20mm"]);
            send.extend(["--drilldef-unit", "mm"]);
        }
        let run = |end: &str| {
            let mut typist = Typist::new(&folder, &send);
            if !options {
                typist.types("find the work-piece zero", "MOVEREL X20000 Y30000 Z-40000");
                typist.types("find the work-piece zero", "");
            }
            typist.types("HALT", end);
            typist.ends(if end.is_empty() { 0 } else { 3 }).1
        };
        run("");
        let whole = emulator.position().unwrap();
        let err = run("q");
        let command = onward(&err.replace("'a job.ncp'", "job.ncp"));
        fs::copy(folder.join("a job.ncp"), folder.join("job.ncp")).unwrap();
        assert!(err.contains("'a job.ncp'"), "{err}");
        assert_eq!(command.iter().any(|word| word == "--drilldef-unit"), options, "{err}");
        let mut command: Vec<&str> = command.iter().map(String::as_str).collect();
        command.push("--yes");
        ends(&folder, &command, 0);
        assert_eq!(emulator.position().unwrap(), whole, "{command:?}");
    }
}

/// A square with the head down, an arc, and the modes that `send` keeps for itself.
const PLOT: &str = "IN;!CT0;IW0,0,20000,20000;\nVS20000;!VU50000;\nPA1000,1000;PD;\n\
                    PA3000,1000,3000,3000;PR-2000,0;PA1000,1000;PU;\nAA2000,2000,90;PA0,0;\n";

#[test]
fn plot_files_are_sent_to_both_models() {
    let folder = Folder::new();
    // The head and its speeds are the SMCU's.
    let slow = PLOT.replace("VS20000;!VU50000;", "").replace("PD;", "").replace("PU;", "");
    for (model, plot) in [("smcu", PLOT), ("motionsystem", slow.as_str())] {
        fs::write(folder.join("plot.plt"), plot).unwrap();
        let (emulator, port) = listening(model, "board-plotter", Clock::Instant);
        let send = ["send", "plot.plt", "--to", &port, "--model", model];
        let (out, _) =
            ends(&folder, &[&send[..], &["--machine", "board-plotter", "-v"]].concat(), 0);
        assert!(out.contains("at X 0.000 mm, Y 0.000 mm"), "{out}");
        // Each is answered before the next is sent, also behind IN.
        for command in ["PA3000,1000,3000,3000", "AA2000,2000,90"] {
            let line = out.lines().find(|line| line.contains(command));
            assert!(line.is_some_and(|line| line.ends_with("C\\r")), "{out}");
        }
        assert!(!out.contains("!CT0"), "{out}");
        // A quarter of a circle around 2000,2000 from below left to below right.
        let places = recorded(&emulator);
        assert_eq!(places.iter().map(|place| place[0]).max(), Some(3_000));
        assert!(places.contains(&[3_000, 3_000, 0, 0]) && places.contains(&[2_000, 586, 0, 0]));
    }
}

#[test]
fn a_plot_halts_behind_its_command_and_goes_on() {
    let folder = Folder::new();
    fs::write(folder.join("plot.plt"), "IN;\n!VU20000;\nPA3000,0;\nPA6000,0;\n").unwrap();
    let (emulator, port) = listening("smcu", "board-plotter", Clock::Real);
    let (mut typed, end) = terminal();
    let plot = ["plot.plt", "--to", &port, "--model", "smcu", "--machine", "board-plotter"];
    let child = sending_from(&folder, &plot, end);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 100);
    typed.write_all(b"\n").unwrap();
    until("its command ends", || x() == 3_000);
    thread::sleep(Duration::from_millis(300));
    assert_eq!(x(), 3_000);
    typed.write_all(b"\n").unwrap();
    let output = child.output_in_time().unwrap();
    let err = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{err}");
    assert!(err.contains("line 3: stopped; Enter goes on, q ends the job"), "{err}");
    assert_eq!(x(), 6_000);
}

#[test]
fn a_plot_ends_with_its_error_and_the_next_is_taken() {
    let folder = Folder::new();
    fs::write(folder.join("plot.plt"), "IN;\n\nPA9000,0;\nPA12000,0;\n").unwrap();
    for model in ["smcu", "motionsystem"] {
        let (emulator, port) = listening(model, "board-plotter", Clock::Real);
        let plot = ["plot.plt", "--to", &port, "--model", model, "--machine", "board-plotter"];
        let child = sending(&folder, &plot);
        let x = || emulator.position().unwrap()[0];
        until("it moves", || x() > 100);
        emulator.press(Button::Stop).unwrap();
        let output = child.output_in_time().unwrap();
        let err = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{err}");
        assert!(err.contains("was answered E") && err.contains("--> plot.plt:3:1"), "{err}");
        // Whatever state that has left, the next one is taken.
        let (_, err) = ends(&folder, &[&["send"], &plot[..]].concat(), 0);
        assert_eq!(x(), 12_000, "{err}");
    }
}

#[test]
fn a_plot_without_its_model_is_told_so() {
    let folder = Folder::new();
    let said = |arguments: &[&str]| {
        let (_, err) = ends(&folder, arguments, 2);
        err.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    for before in ["", "\u{feff}; a board\n", "\x1BE\x1B%0B", "@PJL ENTER LANGUAGE=HPGL2\n"] {
        let plot = format!("{before}{PLOT}");
        fs::write(folder.join("plot.plt"), plot).unwrap();
        let err = said(&["send", "plot.plt", "--to", "nowhere"]);
        assert!(
            err.contains("plot.plt is a plot file, and the imc4 speaks isel's @-format"),
            "{err}"
        );
        assert!(err.ends_with("choose one of smcu, motionsystem, with --model"), "{err}");
    }
    // What stands behind an escape sequence says what it is.
    fs::write(folder.join("red.txt"), "\x1B[31m@07\n").unwrap();
    let (_, err) = ends(&folder, &["send", "red.txt", "--to", "nowhere"], 1);
    assert!(err.contains("the model imc4 would answer \\x1B[31m@07 with 5"), "{err}");
    let err = said(&["send", "red.txt", "--to", "nowhere", "--model", "smcu"]);
    assert!(err.contains("red.txt is a command list, and the smcu does not speak"), "{err}");
    assert!(err.ends_with("c142, with --model"), "{err}");
    let binary = b"\x7FELF\x02\x01\x01\0\0\0\0\0\0\0\0\0\x03\0>\0";
    fs::write(folder.join("program"), binary).unwrap();
    for arguments in [&["send", "program", "--to", "nowhere"][..], &["run", "program"]] {
        let err = said(arguments);
        assert!(err.contains("program is binary, not text") && err.contains("@07"), "{err}");
    }
    fs::write(folder.join("board.LMD"), b"LMD\0\x01\0\0\0PA1,2;").unwrap();
    let err = said(&["send", "board.LMD", "--to", "nowhere", "--model", "smcu"]);
    assert!(err.contains("board.LMD is binary, LMD, ") && err.contains("plot it"), "{err}");
    fs::write(folder.join("pairs.plt"), "IN;\nPU10,20;PD30,40;\n").unwrap();
    let pairs = ["send", "pairs.plt", "--to", "nowhere", "--model", "smcu"];
    let (_, err) = ends(&folder, &pairs, 1);
    assert!(err.contains("belongs to no command") && err.contains("bare_pairs"), "{err}");
}

#[test]
fn run_knows_a_job_when_it_sees_one() {
    let job = "; made by hand\nN1 REF XYZ\nN2 MOVEABS X1000 Y2000\n";
    let folder = Folder::with(job);
    let (own, _) = ends(&folder, &["ncp", "run", "job.ncp", "--machine", "mill"], 0);
    let (out, _) = ends(&folder, &["run", "job.ncp", "--machine", "mill"], 0);
    assert_eq!(out, own);
    assert!(out.contains("ended     the job is done"), "{out}");
    let mut child = Command::new(VIMC4);
    child.args(["run", "-"]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = child.start().unwrap();
    child.stdin.take().unwrap().write_all(job.as_bytes()).unwrap();
    assert!(child.output_in_time().unwrap().status.success());
}

#[test]
fn json_tells_everything_also_of_a_job_with_errors() {
    let folder = Folder::new();
    let json = |job: &str, code| {
        fs::write(folder.join("job.ncp"), job).unwrap();
        let (out, _) = ends(&folder, &["ncp", "run", "job.ncp", "--json"], code);
        serde_json::from_str::<Value>(&out).unwrap()
    };
    let right = json("IMF_PBL\nREF XYZ\nWAIT 500\nMOVEABS X1000\nWAIT 250\n", 0);
    assert_eq!(right["ended"], "done");
    let lines = right["lines"].as_array().unwrap();
    let took = |number: u64| {
        lines.iter().find(|line| line["line"] == number).unwrap()["takes_ns"].as_u64().unwrap()
    };
    assert_eq!((took(3), took(5)), (500_000_000, 250_000_000));
    let all: u64 = lines.iter().map(|line| line["takes_ns"].as_u64().unwrap()).sum();
    assert_eq!(all, right["time_ns"].as_u64().unwrap());

    let wrong = json("REF XYZ\nWAIT 500\nMOVEABS X1000\nMOVABS X5\nMOVEABS X2000\n", 1);
    assert_eq!((&wrong["ended"], &wrong["line"]), (&"error".into(), &4.into()));
    assert_eq!(wrong["axes"]["X"]["position"], 80, "nothing was done from there on");
    let codes: Vec<_> =
        wrong["diagnostics"].as_array().unwrap().iter().map(|told| &told["code"]).collect();
    assert!(codes.contains(&&"unknown-command".into()) && codes.contains(&&"mark-missing".into()));
    let times = wrong["lines"].as_array().unwrap();
    assert!(times.iter().any(|line| line["line"] == 2 && line["takes_ns"] == 500_000_000_u64));
}

#[test]
fn changes_of_the_tool_can_be_left_out() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nGETTOOL 3\nMOVEABS X1000\n");
    let (_, err) = ends(&folder, &["ncp", "compile", "job.ncp"], 1);
    assert!(err.contains("no-operator") && err.contains("--leave-out-tool-changes"), "{err}");
    let leave = ["ncp", "compile", "job.ncp", "--leave-out-tool-changes"];
    let (out, err) = ends(&folder, &leave, 0);
    assert!(err.contains("tool-left-out") && err.contains("tool 3 is not put in"), "{err}");
    assert!(out.contains("\n; axes: 15 (") && out.ends_with("\n9\n"), "{out}");
    // Nobody else is left out.
    fs::write(folder.join("job.ncp"), "IMF_PBL\nREF XYZ\nHALT\n").unwrap();
    ends(&folder, &leave, 1);
}

/// Nothing but JSON is on standard error, whether it compiles or not.
#[test]
fn what_is_wrong_with_a_program_to_be_stored_is_told_to_programs() {
    let told = |job: &str, code| {
        let folder = Folder::with(job);
        let compile = ["ncp", "compile", "job.ncp", "--format", "json"];
        let (out, err) = ends(&folder, &compile, code);
        let json: Value = serde_json::from_str(&err).unwrap();
        let found = json["diagnostics"].as_array().unwrap().iter();
        let found: Vec<_> = found.map(|found| found["code"].as_str().unwrap().to_owned()).collect();
        (out, found)
    };
    let asks = (String::new(), vec!["no-operator".to_owned(), "mark-missing".to_owned()]);
    assert_eq!(told("REF XYZ\nHALT\nPROGEND\n", 1), asks);
    let (out, found) = told("REF XYZ\nMOVEABS X1000\nPROGEND\n", 0);
    assert!(out.ends_with("\n9\n") && found == ["mark-missing"], "{out} {found:?}");
}

#[test]
fn a_data_field_without_its_axes_is_not_stored() {
    let folder = Folder::new();
    fs::write(folder.join("field.cnc"), "77\n9\n").unwrap();
    let (_, err) = ends(&folder, &["send", "field.cnc", "--to", "nowhere"], 2);
    assert!(err.contains("`; axes: 7`"), "{err}");
}

/// What a peer answers to when it is sent 253.
const STOP: &str = "253";

/// A peer that is not an emulator: what it answers to each line; and what it was sent.
fn peer(
    answers: impl Fn(&str) -> Vec<u8> + Send + 'static,
) -> (String, thread::JoinHandle<String>) {
    stoppable(move |line| if line == STOP { Vec::new() } else { answers(line) })
}

/// The same with what it answers to 253.
fn stoppable(
    answers: impl Fn(&str) -> Vec<u8> + Send + 'static,
) -> (String, thread::JoinHandle<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().to_string();
    let heard = thread::spawn(move || {
        let (mut client, _) = listener.accept().unwrap();
        let (mut all, mut line, mut byte) = (Vec::new(), Vec::new(), [0]);
        while matches!(client.read(&mut byte), Ok(1)) {
            all.push(byte[0]);
            if byte[0] == 253 {
                let _ = client.write_all(&answers(STOP));
                continue;
            }
            line.push(byte[0]);
            if byte[0] == b'\r' {
                let _ = client.write_all(&answers(&text(&line)));
                line.clear();
            }
        }
        text(&all)
    });
    (port, heard)
}

/// What an IMC4 says to `V`, and `0` to everything else, or what is given for a letter.
fn like_an_imc4(line: &str, letter: char, answer: &[u8]) -> Vec<u8> {
    match line.chars().nth(2) {
        Some('V') => b"isel IMC4\r\n0".to_vec(),
        Some('P') if letter != 'P' => [b'0'; 25].to_vec(),
        Some(it) if it == letter => answer.to_vec(),
        _ => b"0".to_vec(),
    }
}

#[test]
fn what_is_no_answer_is_not_believed() {
    let job = "IMF_PBL\nREF XYZ\nVEL 20000\nMOVEABS X900000\n";
    let folder = Folder::with(job);
    for answer in [&b"FooBar 3000\r\n0"[..], b"00000", b"X", b"01F"] {
        let (port, heard) = peer(|_| answer.to_vec());
        let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port], 1);
        assert!(err.contains("which is not an answer of the model imc4"), "{err}");
        let heard = joined("the end of the connection", heard);
        assert!(!heard.contains("@0R") && !heard.contains("@0A"), "{heard}");
    }
    // What looks right comes far too early.
    let (port, heard) = peer(|line| like_an_imc4(line, '-', b""));
    let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port], 1);
    assert!(err.contains("that motion takes 45.") && err.contains("--any-time"), "{err}");
    assert!(joined("the end of the connection", heard).contains("@0A72000,1600"));
    let (port, _heard) = peer(|line| like_an_imc4(line, '-', b""));
    ends(&folder, &["send", "job.ncp", "--to", &port, "--any-time"], 0);
    // One more than it should be, also where it comes later.
    let (port, _heard) = peer(|line| {
        thread::sleep(Duration::from_millis(5));
        like_an_imc4(line, 'R', b"00")
    });
    let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port], 1);
    assert!(err.contains("answered `00`") || err.contains("without being asked"), "{err}");
    // A place is a place.
    fs::write(folder.join("list.txt"), "@07\n@0P\n").unwrap();
    let (port, _heard) = peer(|line| like_an_imc4(line, 'P', b"0"));
    let (_, err) = ends(&folder, &["send", "list.txt", "--to", &port], 1);
    assert!(err.contains("to @0P, which is not an answer"), "{err}");
}

#[test]
fn what_the_virtual_controller_refuses_is_not_sent() {
    let folder = Folder::new();
    fs::write(folder.join("list.txt"), "@07\n@0A500,900,0,21,0,21,0,21\n@0A5,900\n").unwrap();
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let send = ["send", "list.txt", "--to", &port, "--yes"];
    let (_, err) = ends(&folder, &send, 1);
    assert!(err.contains("with 7: ") && err.contains("--refused-too"), "{err}");
    assert!(sent(&emulator).is_empty());
    let (_, err) = ends(&folder, &[&send[..], &["--refused-too"]].concat(), 1);
    assert!(err.contains("it is sent nevertheless"), "{err}");
    assert_eq!(emulator.position().unwrap()[0], 500);
}

#[test]
fn rest_is_not_claimed_without_an_answer() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X500000\n");
    let (sender, moves) = channel();
    let (port, _heard) = peer(move |line| {
        if line.starts_with("@0A") {
            let _ = sender.send(());
        }
        like_an_imc4(line, 'A', b"")
    });
    let child = sending(&folder, &["job.ncp", "--to", &port]);
    moves.recv_timeout(LIMIT).unwrap();
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let err = text(&child.output_in_time().unwrap().stderr);
    assert!(err.contains("may still be moving") && !err.contains("come to rest"), "{err}");
    // What lost its power counts from 0 when it has it again.
    assert!(err.contains("the counters may have been reset") && !err.contains("X 0.000"), "{err}");
    // The machine is halted first, and who waits for it knows.
    let waits = err.find("waiting until it rests; Ctrl-C again does not wait");
    assert!(waits < err.find("to go on with line 3") && waits.is_some(), "{err}");
}

#[test]
fn no_place_is_claimed_after_an_emergency_stop() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X500000\n");
    for (answer, is_known) in [(b"9", false), (b"D", true)] {
        let (port, _heard) = peer(move |line| like_an_imc4(line, 'A', answer));
        let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port, "--any-time"], 1);
        assert_eq!(err.contains("at X 0.000 mm"), is_known, "{err}");
        assert_eq!(err.contains("the counters may have been reset"), !is_known, "{err}");
    }
}

#[test]
fn a_job_of_isel_does_not_go_to_lpkf() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\n");
    for model in ["smcu", "motionsystem"] {
        let (emulator, port) = listening(model, "board-plotter", Clock::Instant);
        let send = ["send", "job.ncp", "--to", &port, "--any-model"];
        let (_, err) = ends(&folder, &send, 2);
        assert!(err.contains("is an LPKF controller"), "{err}");
        assert!(!sent(&emulator).iter().any(|sent| sent.contains("@0R")));
    }
    let (port, _heard) = peer(|line| match line {
        "@0V\r" => [&[b'x'; 3_000][..], b"\r\n0"].concat(),
        line => like_an_imc4(line, '-', b""),
    });
    let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port, "--any-time"], 0);
    assert!(err.contains("xxx ...") && err.len() < 1_000, "{}", err.len());
    let (port, _heard) = peer(|_| vec![b'x'; 200_000]);
    let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port], 1);
    assert!(err.contains("no end of it is in sight") && err.len() < 1_000, "{}", err.len());
}

#[test]
fn what_is_left_on_a_line_does_not_hide_who_is_there() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\n");
    let (port, heard) = peer(|_| b"5".to_vec());
    fs::write(folder.join("plot.plt"), PLOT).unwrap();
    process::run(&folder, &["send", "plot.plt", "--to", &port, "--model", "smcu", "--yes"]);
    assert!(joined("the end of the connection", heard).starts_with("!CC;!CI;!CB;!GO;OS;\r"));

    let first = AtomicBool::new(true);
    let (port, _heard) = peer(move |line| match first.swap(false, Ordering::Relaxed) {
        true => b"5".to_vec(),
        false => like_an_imc4(line, '-', b""),
    });
    let send = ["send", "job.ncp", "--to", &port, "--any-time"];
    let (_, err) = ends(&folder, &send, 0);
    assert!(!err.contains("taken for the model"), "{err}");
}

#[test]
fn a_second_program_needs_the_first_erased() {
    let folder = Folder::new();
    fs::write(folder.join("field.cnc"), "; axes: 7\n71\n9\n").unwrap();
    for (model, remedy) in [
        ("imc4", "press and release the emergency stop, turn the key to test, hold STOP, press ON"),
        ("imc4-m", "--erase"),
    ] {
        let (emulator, port) = listening(model, "bench", Clock::Instant);
        let send = ["send", "field.cnc", "--to", &port, "--model", model];
        ends(&folder, &send, 0);
        let (_, err) = ends(&folder, &send, 1);
        assert!(err.contains("a program stored already") && err.contains(remedy), "{err}");
        let code = if model == "imc4" { 2 } else { 0 };
        ends(&folder, &[&send[..], &["--erase"]].concat(), code);
        if model == "imc4" {
            emulator.press("estop").unwrap();
            emulator.release("estop").unwrap();
            emulator.turn("key", "test").unwrap();
            emulator.hold("stop").unwrap();
            emulator.press("on").unwrap();
            emulator.release("stop").unwrap();
            ends(&folder, &send, 0);
        }
    }
    fs::write(folder.join("list.txt"), "@07\n").unwrap();
    let (_, err) = ends(&folder, &["send", "list.txt", "--to", "nowhere", "--erase"], 2);
    assert!(err.contains("--erase is for data fields"), "{err}");
}

#[test]
fn g_code_is_told_so_before_anything_else() {
    let folder = Folder::new();
    for code in ["G21\nG0 X5 Y5\n", "T1 M6\n", "%\n(part)\nN10 G90\n"] {
        fs::write(folder.join("part.nc"), code).unwrap();
        let check = ["ncp", "check", "part.nc"];
        for what in [&["send", "part.nc", "--to", "nowhere"][..], &["run", "part.nc"], &check] {
            let (out, err) = ends(&folder, what, 1);
            let said = out + &err;
            assert!(said.contains("this is G-code") && said.contains("post-processor"), "{said}");
        }
    }
}

#[test]
fn a_line_that_chatters_is_not_waited_for() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\n");
    // From the beginning, and from the first question on.
    for once_asked in [false, true] {
        let line = Chatter::new(once_asked);
        line.at(|address| {
            let (code, _, err) = process::run(&folder, &["send", "job.ncp", "--to", address]);
            let why = err.contains("never falls silent") || err.contains("no end of it");
            (code == 1 && why).then_some(()).ok_or(err)
        });
        // Nor does it keep anybody waiting who ends it.
        line.at(|address| {
            let mut child = sending(&folder, &["job.ncp", "--to", address]);
            line.comes();
            kill_process(Pid::from_child(&child), Signal::TERM).unwrap();
            let code = child.wait_in_time().unwrap().code();
            (code != Some(1)).then_some(()).ok_or_else(|| "it waited".to_owned())
        });
    }
}

#[test]
fn a_zero_is_not_taught_where_the_present_place_counts() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let (_, err) = ends(&folder, &["send", "job.ncp", "--to", &port, "--teach", "--no-ref"], 2);
    assert!(err.contains("--no-ref takes the present place for it"), "{err}");
    assert!(sent(&emulator).is_empty());
}

#[test]
fn a_job_from_the_present_place_goes_on_where_its_place_is_said() {
    let folder = Folder::with("IMF_PBL\nMOVEABS X1000\nHALT\nMOVEABS X2000\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let send = ["send", "job.ncp", "--to", &port, "--no-ref"];
    let (out, err) = ends(&folder, &send, 3);
    assert!(out.contains("ended in line 3"), "{out}");
    // It is known here that the counters count from there.
    let command = onward(&err);
    assert!(command.windows(2).any(|words| words == ["--zero", "0,0,0,0"]), "{out}{err}");
    // Nothing tells where it began; it might go anywhere.
    let before = sent(&emulator).len();
    let (_, err) = ends(&folder, &[&send[..], &["--from", "3"]].concat(), 2);
    assert!(err.contains("where X, Y, Z, A stood when it began counted as 0"), "{err}");
    assert!(!sent(&emulator)[before..].iter().any(|sent| sent.starts_with("@0A")));
    // Where somebody has said that the counters count, they do.
    let zero = ["--from", "3", "--zero", "0,0,0,0"];
    let (out, err) = ends(&folder, &[&send[..], &zero].concat(), 3);
    assert!(out.contains("--from 3 goes on with that line, where the counters say"), "{out}");
    assert!(err.contains("to go on with line 3:") && err.contains("--no-ref"), "{err}");
}

#[test]
fn what_is_typed_before_a_question_or_is_blank_is_no_answer() {
    let job = "IMF_PBL\nREF XYZ\nWAIT 2000\nHALT\nMOVEABS X1000\n";
    let folder = Folder::with(job);
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
    until("it waits", || sent(&emulator).iter().any(|sent| sent == "@0R7"));
    thread::sleep(Duration::from_millis(300));
    writeln!(typist.terminal, "s").unwrap();
    // Both at once: the second comes before the next question.
    typist.types("line 3: held; Enter goes on, q ends the job", "\ns");
    typist.types("line 4: HALT", " ");
    typist.types("line 4: HALT", "");
    let (_, err) = typist.ends(0);
    assert!(
        err.contains("` ` is not an answer here; Enter goes on, s goes on line by line"),
        "{err}"
    );
    assert!(err.contains("`s` was typed before this was asked, and does not count"), "{err}");
    assert!(!err.contains("Enter does it"), "{err}");
    assert_eq!(emulator.position().unwrap()[0], 80);
}

#[test]
fn q_stops_what_moves_before_it_ends_the_job() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 50000\nMOVEABS X500000\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Real);
    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
    until("it moves", || emulator.position().unwrap()[0] > 400);
    writeln!(typist.terminal, "q").unwrap();
    typist.types("line 4: stopped; Enter goes on, q ends the job", "q");
    let (out, _) = typist.ends(3);
    assert!(out.contains("ended in line 4"), "{out}");
    assert!(emulator.position().unwrap()[0] < 40_000);
}

#[test]
fn a_unit_that_was_typed_does_not_scale_the_file() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nHALT\nMOVEABS X1000\nHALT\nMOVEABS X2000\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
    typist.types("line 3: HALT", "INCH");
    // 254 mm, of which 1 mm is 80 steps.
    typist.types("line 3: HALT", "MOVEREL Y10000");
    typist.types("line 3: HALT", "");
    // What was typed before holds no longer.
    typist.types("line 5: HALT", "MOVEREL Y1000");
    typist.types("line 5: HALT", "");
    typist.ends(0);
    assert_eq!(emulator.position().unwrap()[..2], [160, 254 * 80 + 80]);
}

#[test]
fn what_was_typed_is_told_where_going_on_leaves_it_out() {
    let job = "IMF_PBL\nREF XYZ\nWPTEACH\nHALT\nMOVEABS X1000\nHALT\n";
    let folder = Folder::with(job);
    let (_emulator, port) = listening("imc4", "bench", Clock::Instant);
    let teach = "Enter makes this place the zero";
    let halt = "Enter goes on, s goes on line by line";
    for key in ["", "k"] {
        let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
        typist.types(teach, "MOVEREL X500");
        typist.types(teach, "VEL 5000");
        typist.types(teach, key);
        typist.types(halt, "MOVEREL Y700");
        typist.types(halt, "MOVEREL Q7");
        typist.types(halt, "");
        typist.types("line 6: HALT", "q");
        let (_, err) = typist.ends(3);
        let told =
            "what was typed at the terminal is in no file, so going on with line 6 leaves it out:";
        let (_, lost) = err.split_once(told).unwrap_or_else(|| panic!("{err}"));
        let mut expected = vec!["  line 3: VEL 5000", "  line 4: MOVEREL Y700"];
        // The place of a zero that was taken is known; else the way there is lost too.
        if key == "k" {
            expected.insert(0, "  line 3: MOVEREL X500");
        }
        let lost: Vec<&str> = lost.lines().skip(1).take(expected.len()).collect();
        assert_eq!(lost, expected, "{err}");
        assert!(!err.contains(": MOVEREL Q7\n"), "{err}");
    }
}

#[test]
fn what_was_typed_may_leave_no_line_to_go_on_with() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nHALT\nMOVEABS X1000\nHALT\n");
    let (_emulator, port) = listening("imc4", "bench", Clock::Instant);
    for (typed, goes_on) in [
        ("VEL 5000", true),
        ("MOVEREL Y700", true),
        // The zero is there already.
        ("WPZERO", true),
        ("WPZEROABS X500", false),
        ("WPREG1 X500", false),
        ("PLANE XZ", false),
    ] {
        let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
        typist.types("line 3: HALT", typed);
        typist.types("line 3: HALT", "");
        typist.types("line 5: HALT", "q");
        let (out, err) = typist.ends(3);
        let left_out =
            "--from 5 goes on with that line, after reference runs, and without what was";
        let changed = format!("`{typed}`, typed in line 3, has changed the zero, the plane");
        assert!(err.contains(&format!("\n  line 3: {typed}\n")), "{err}");
        assert_eq!(err.contains("to go on with line 5:"), goes_on, "{typed}\n{err}");
        assert_eq!(out.contains(left_out), goes_on, "{typed}\n{out}");
        assert_eq!(out.contains(&changed), !goes_on, "{typed}\n{out}");
    }
    // A zero that is taken afterwards is known, whatever was the zero before.
    fs::write(folder.join("job.ncp"), "IMF_PBL\nREF XYZ\nWPTEACH\nMOVEABS X1000\nHALT\n").unwrap();
    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
    let teach = "Enter makes this place the zero";
    typist.types(teach, "WPZEROABS X500");
    typist.types(teach, "MOVEABS X0");
    typist.types(teach, "");
    typist.types("line 5: HALT", "q");
    let (_, err) = typist.ends(3);
    assert!(err.contains("to go on with line 5:") && !err.contains("leaves it"), "{err}");
}

#[test]
fn ctrl_c_again_does_not_wait() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X500000\n");
    let (sender, moves) = channel();
    let (port, heard) = peer(move |line| {
        if line.starts_with("@0A") {
            let _ = sender.send(());
        }
        like_an_imc4(line, 'A', b"")
    });
    let mut child = sending(&folder, &["job.ncp", "--to", &port]);
    moves.recv_timeout(LIMIT).unwrap();
    // Signals that are not seen in time become one.
    until("it ends", || {
        kill_process(Pid::from_child(&child), Signal::INT).unwrap();
        child.try_wait().unwrap().is_some()
    });
    let output = child.output_in_time().unwrap();
    let err = text(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert!(err.contains("interrupted again") && err.contains("may still be moving"), "{err}");
    assert!(joined("the end of the connection", heard).contains('\u{FFFD}'), "253 was sent");
}

#[test]
fn who_does_not_name_itself_is_taken_at_its_word() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\n");
    for model in ["imc4", "imc-s8"] {
        for version in [&b"0"[..], b"0\r\n", b"\r\n0"] {
            let (port, _heard) = peer(move |line| match line {
                "@0V\r" => version.to_vec(),
                line => like_an_imc4(line, '-', b""),
            });
            let send = ["send", "job.ncp", "--to", &port, "--any-time", "--model", model];
            let (_, err) = ends(&folder, &send, 0);
            let told =
                format!("does not name itself when it is asked; it is taken for the model {model}");
            assert!(err.contains(&told) && !err.contains("``"), "{err}");
        }
    }
}

#[test]
fn lines_are_counted_as_editors_count_them() {
    let folder = Folder::new();
    for (end, line) in [("\n", 3), ("\r\n", 3), ("\r", 3), ("\r\r\n", 5)] {
        let job = ["IMF_PBL", "REF XYZ", "MOVEABS Q5", "MOVEABS X1"].join(end);
        fs::write(folder.join("job.ncp"), job).unwrap();
        let (out, _) = ends(&folder, &["ncp", "check", "job.ncp", "--format", "short"], 1);
        assert!(out.starts_with(&format!("job.ncp:{line}:9: error")), "{end:?} {out}");
        // The line that is shown with a refusal is the same one.
        let list = ["@03", "@0A500,900,0,21", "@0Q5", "@0P"].join(end);
        fs::write(folder.join("list.txt"), list).unwrap();
        let (_, err) = ends(&folder, &["send", "list.txt", "--to", "nowhere"], 1);
        assert!(err.contains(&format!("--> list.txt:{line}:1")) && err.contains("@0Q5"), "{err}");
    }
}

#[test]
fn escape_sequences_of_a_plot_are_named() {
    let folder = Folder::new();
    for plot in ["\u{1b}.Y\u{1b}.@IN;PA100,100;", "IN;\n\u{1b}.I81;;17:\nPA100,100;"] {
        fs::write(folder.join("plot.plt"), plot).unwrap();
        let (_, err) =
            ends(&folder, &["send", "plot.plt", "--to", "nowhere", "--model", "smcu"], 1);
        assert!(err.contains("escape sequence, ESC and a point"), "{err}");
        assert!(err.contains("nothing was sent"), "{err}");
        let (out, err) = ends(&folder, &["run", "plot.plt", "--model", "smcu"], 1);
        let said = out + &err;
        assert!(
            said.contains("E0D") && said.contains("escape sequence, ESC and a point"),
            "{said}"
        );
    }
    // The sequence is named, not the command that its letter makes with the next.
    fs::write(folder.join("plot.plt"), "\u{1b}.IN;!CT1;PA0,0;").unwrap();
    let (_, err) = ends(&folder, &["send", "plot.plt", "--to", "nowhere", "--model", "smcu"], 1);
    assert!(err.contains(r"the model smcu does not know `\x1B.I`"), "{err}");
    // What only separates commands does no harm, nor do numbers that nobody reads.
    for (plot, said) in [
        ("\u{1b}.(;IN;PA100,100;", "every command was carried out"),
        ("\u{1b}.@;0:IN;PA100,100;", "1 escape sequence that means nothing"),
    ] {
        fs::write(folder.join("plot.plt"), plot).unwrap();
        let (out, _) = ends(&folder, &["run", "plot.plt", "--model", "smcu"], 0);
        assert!(out.contains(said) && !out.contains("bare_pairs"), "{out}");
    }
}

/// Waits until the first reference run of a job on the mill is under way.
fn until_it_looks_for_its_switch(emulator: &Emulator) {
    until("it moves", || emulator.position().unwrap()[2] != 0);
}

#[test]
fn a_stopped_reference_run_is_no_reference() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\n");
    let send =
        |port: &str| ["job.ncp", "--machine", "mill", "--to", port, "--yes"].map(str::to_owned);
    for typed in ["", "q", "what now"] {
        let (emulator, port) = listening("imc4", "mill", Clock::Real);
        let arguments = send(&port);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let mut typist = Typist::new(&folder, &arguments);
        until_it_looks_for_its_switch(&emulator);
        writeln!(typist.terminal, "{typed}").unwrap();
        let (out, err) = typist.ends(1);
        assert!(err.contains("the reference run was stopped, so its reference is false"), "{err}");
        assert!(err.contains("--> job.ncp:2:1") && !err.contains(" at X "), "{err}");
        assert!(err.contains("--from 2 goes on with that line, after reference runs"), "{err}");
        assert!(out.is_empty() && !sent(&emulator).iter().any(|sent| sent.starts_with("@0A")));
    }

    let (emulator, port) = listening("imc4", "mill", Clock::Real);
    let arguments = send(&port);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let child = sending(&folder, &arguments);
    until_it_looks_for_its_switch(&emulator);
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let err = text(&child.output_in_time().unwrap().stderr);
    assert!(
        err.contains("interrupted: the reference run has ended, and its reference is"),
        "{err}"
    );
    assert!(!err.contains(" at X "), "{err}");

    let run = ["ncp", "run", "job.ncp", "--machine", "mill", "--press", "stop@0.1s"];
    let (out, _) = ends(&folder, &run, 1);
    assert!(out.contains("ended     line 2: the reference run was stopped, so its ref"), "{out}");
    assert!(out.contains("the reference of Z is false") || out.contains("FalseReference"), "{out}");
}

#[test]
fn an_enter_in_a_wait_holds_what_moves_next() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nWAIT 1500\nMOVEABS X1000\n");
    for (key, code, x) in [("", 0, 80), ("q", 3, 0)] {
        let (emulator, port) = listening("imc4", "bench", Clock::Instant);
        let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port, "--verbose"]);
        until("it waits", || sent(&emulator).iter().any(|sent| sent == "@0R7"));
        // The answer of the last command is on its way.
        thread::sleep(Duration::from_millis(500));
        writeln!(typist.terminal).unwrap();
        typist.hears("nothing moves now");
        typist.types("line 3: held; Enter goes on, q ends the job", key);
        let (_, err) = typist.ends(code);
        assert_eq!(emulator.position().unwrap()[0], x, "{err}");
    }
}

#[test]
fn what_ends_a_lenient_job_is_said() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\nMOVEABS C5\nMOVEABS X0\n");
    let (_, err) = {
        let (_emulator, port) = listening("imc4", "bench", Clock::Instant);
        ends(&folder, &["send", "job.ncp", "--to", &port, "--lenient"], 1)
    };
    let message =
        err.split("line 4 cannot be carried out: ").nth(1).unwrap_or_else(|| panic!("{err}"));
    assert!(message.starts_with(|c: char| c.is_ascii_alphabetic()), "{err}");
}

#[test]
fn a_turning_axis_without_a_switch_is_not_turned_back() {
    let job = "IMF_PBL\nREF XYZ\nMOVEABS A360000\nMOVEABS X1000\nMOVEABS A720000\n";
    let folder = Folder::with(job);
    let (emulator, port) = listening("imc4", "mill-4axis", Clock::Instant);
    let send = ["send", "job.ncp", "--to", &port, "--machine", "mill-4axis"];
    ends(&folder, &send, 0);
    let turned = emulator.position().unwrap()[3];
    let (_, err) = ends(&folder, &[&send[..], &["--from", "4"]].concat(), 2);
    assert!(err.contains("where A stood when it began counted as 0"), "{err}");
    assert_eq!(emulator.position().unwrap()[3], turned);
    // Before it has moved, where it stands counts as 0, as at the beginning.
    ends(&folder, &[&send[..], &["--from", "3"]].concat(), 2);
    let (_, err) = ends(&folder, &[&send[..], &["--from", "4", "--zero", ",,,0"]].concat(), 0);
    assert!(err.contains("The job goes on with line 4"), "{err}");
    assert_eq!(emulator.position().unwrap()[3], turned);
}

#[test]
fn a_line_typed_after_start_at_the_panel_stops() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 5000\nMOVEABS X30000\nMOVEABS X0\n");
    for model in ["imc-s8", "imc-m"] {
        let (emulator, port) = listening(model, "bench", Clock::Real);
        let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port, "--model", model]);
        let x = || emulator.position().unwrap()[0];
        until("it moves", || x() > 100);
        emulator.press(Button::Stop).unwrap();
        typist.hears("line 4: stopped; Enter goes on, q ends the job; START at the panel goes on");
        for typed in ["", "what now"] {
            until_it_rests(x);
            let before = x();
            emulator.press(Button::Start).unwrap();
            until("START goes on", || x() > before + 50);
            writeln!(typist.terminal, "{typed}").unwrap();
            typist.hears("START at the panel had let it go on");
            typist.hears("line 4: stopped");
            let stopped = x();
            thread::sleep(Duration::from_millis(300));
            assert_eq!(x(), stopped, "it rests");
        }
        // Enter at rest goes on; no `S` has come to an axis that moved.
        writeln!(typist.terminal).unwrap();
        until("Enter goes on", || x() > 2_000);
        assert_eq!(sent(&emulator).iter().filter(|sent| *sent == "@0S").count(), 1);
        // And who ends the job after START leaves no axis moving.
        emulator.press(Button::Stop).unwrap();
        typist.hears("stopped");
        until_it_rests(x);
        let before = x();
        emulator.press(Button::Start).unwrap();
        until("START goes on", || x() != before);
        writeln!(typist.terminal, "q").unwrap();
        let (out, err) = typist.ends(3);
        let stopped = x();
        assert!(out.contains(&format!("at X {:.3} mm", stopped as f64 * 0.0125)), "{out}{err}");
        thread::sleep(Duration::from_millis(300));
        assert_eq!(x(), stopped, "it rests");
    }
}

#[test]
fn ctrl_c_after_start_at_the_panel_waits_until_it_rests() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 5000\nMOVEABS X30000\nMOVEABS X0\n");
    let (emulator, port) = listening("imc-s8", "bench", Clock::Real);
    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port, "--model", "imc-s8"]);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 100);
    emulator.press(Button::Stop).unwrap();
    typist.hears("line 4: stopped");
    until_it_rests(x);
    let before = x();
    emulator.press(Button::Start).unwrap();
    until("START goes on", || x() > before + 50);
    typist.process.signal(Signal::INT);
    let (_, err) = typist.ends(1);
    assert!(err.contains("the motion has come to rest along its ramp, at X "), "{err}");
    let stopped = x();
    thread::sleep(Duration::from_millis(300));
    assert_eq!(x(), stopped, "it rests");
}

#[test]
fn what_is_typed_in_a_wait_holds_what_moves_next_whatever_it_is() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nWAIT 1500\nMOVEABS X1000\n");
    for typed in ["halt!", "foo bar", "MOVEREL Y5"] {
        let (emulator, port) = listening("imc4", "bench", Clock::Instant);
        let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
        until("it waits", || sent(&emulator).iter().any(|sent| sent == "@0P"));
        thread::sleep(Duration::from_millis(200));
        writeln!(typist.terminal, "{typed}").unwrap();
        typist.types("line 3: held; Enter goes on, q ends the job", "q");
        typist.ends(3);
        assert_eq!(emulator.position().unwrap()[..2], [0, 0]);
    }
}

#[test]
fn a_line_typed_when_a_piece_is_about_to_end_stops_before_the_next() {
    // Every move is nothing but ramps, and one that brakes already ends with 0.
    let moves: String = (1..200).map(|n| format!("MOVEABS X{}\n", n * 100)).collect();
    let folder = Folder::with(format!("IMF_PBL\nREF XYZ\nVEL 50000\n{moves}"));
    for wait in 0..6 {
        let (emulator, port) = listening("imc4", "bench", Clock::Real);
        let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
        let x = || emulator.position().unwrap()[0];
        until("it moves", || x() > 20);
        thread::sleep(Duration::from_millis(wait * 7));
        writeln!(typist.terminal).unwrap();
        // Stopped in a move, or held between two.
        typist.hears("; Enter goes on, q ends the job");
        let stopped = x();
        thread::sleep(Duration::from_millis(200));
        assert_eq!(x(), stopped, "it rests");
        writeln!(typist.terminal, "q").unwrap();
        typist.ends(3);
    }
}

#[test]
fn a_reference_run_without_end_is_ended_without_a_reference() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nHALT\nMOVEABS X1000\n");
    let (emulator, port) = listening("imc4", "mill", Clock::Real);
    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port, "--machine", "mill"]);
    typist.types("line 3: HALT", "REF A");
    until("A turns", || emulator.position().unwrap()[3] != 0);
    writeln!(typist.terminal, "that will do").unwrap();
    let (_, err) = typist.ends(1);
    assert!(err.contains("the reference run was stopped, so its reference is false"), "{err}");
    assert!(!err.contains(" at X ") && !err.contains("A 0.000"), "{err}");
}

#[test]
fn where_the_axes_are_is_not_known_once_the_controller_has_forgotten_it() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\nHALT\nWAIT 60000\nMOVEABS X0\n");
    let power = |emulator: &Emulator| {
        emulator.power(false).unwrap();
        emulator.power(true).unwrap();
    };
    let stop = |emulator: &Emulator| {
        emulator.hold(Button::EmergencyStop).unwrap();
        emulator.release(Button::EmergencyStop).unwrap();
        emulator.press(Button::On).unwrap();
    };
    let unknown = "where the axes are is not known, for the counters may have been reset";
    for (model, machine) in [("imc4", "mill"), ("imc-s8", "traverse"), ("imc4", "traverse")] {
        let send = ["job.ncp", "--model", model, "--machine", machine, "--to"];
        for (event, typed) in [
            (&power as &dyn Fn(&Emulator), "q"),
            (&power, "REF X"),
            (&power, "MOVEREL X500"),
            (&stop, "q"),
            (&stop, "MOVEREL X500"),
        ] {
            let (emulator, port) = listening(model, machine, Clock::Instant);
            let mut typist = Typist::new(&folder, &[&send[..], &[&port]].concat());
            typist.hears("line 4: HALT");
            until("it rests", || sent(&emulator).iter().any(|sent| sent == "@0P"));
            thread::sleep(Duration::from_millis(300));
            event(&emulator);
            writeln!(typist.terminal, "{typed}").unwrap();
            let code = if typed == "q" { 3 } else { 1 };
            let (out, err) = typist.ends(code);
            let said = out + &err;
            assert!(said.contains(unknown) && !said.contains(" at X "), "{model} {said}");
        }
        // In a wait, and with Ctrl-C.
        let (emulator, port) = listening(model, machine, Clock::Instant);
        let mut typist = Typist::new(&folder, &[&send[..], &[&port]].concat());
        typist.types("line 4: HALT", "");
        until("it waits", || sent(&emulator).iter().filter(|sent| *sent == "@0P").count() > 0);
        thread::sleep(Duration::from_millis(500));
        power(&emulator);
        typist.process.signal(Signal::INT);
        let (_, err) = typist.ends(1);
        assert!(err.contains(unknown) && !err.contains(" at X "), "{model} {err}");
    }
    // Where nothing has happened the place is told.
    let (_emulator, port) = listening("imc4", "mill", Clock::Instant);
    let send = ["job.ncp", "--machine", "mill", "--to", &port];
    let mut typist = Typist::new(&folder, &send);
    typist.types("line 4: HALT", "MOVEREL X500");
    typist.types("line 4: HALT", "q");
    let (out, err) = typist.ends(3);
    assert!(out.contains("ended in line 4, at X 1.500 mm, Y 0.000 mm"), "{out}{err}");
}

#[test]
fn where_a_stopped_motion_was_is_not_known_after_an_emergency_stop() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 5000\nMOVEABS X30000\n");
    let (emulator, port) = listening("imc4", "mill", Clock::Real);
    let mut typist = Typist::new(&folder, &["job.ncp", "--machine", "mill", "--to", &port]);
    until("it moves", || sent(&emulator).iter().any(|sent| sent.starts_with("@0A")));
    until("it moves", || emulator.position().unwrap()[0] > 100);
    writeln!(typist.terminal).unwrap();
    typist.hears("line 4: stopped");
    until("it rests", || sent(&emulator).iter().any(|sent| sent == "@0P"));
    thread::sleep(Duration::from_millis(300));
    emulator.hold(Button::EmergencyStop).unwrap();
    writeln!(typist.terminal, "q").unwrap();
    let (out, err) = typist.ends(3);
    assert!(out.contains("where the axes are is not known"), "{out}{err}");
}

#[test]
fn stop_at_the_panel_in_a_repeated_reference_run_is_seen() {
    let job =
        "IMF_PBL\nREF XYZ\nVEL 20000\nMOVEABS X20000 Y30000 Z-20000\nREF XYZ\nMOVEABS X5000\n";
    let folder = Folder::with(job);
    let runs = |emulator: &Emulator| sent(emulator).iter().filter(|sent| *sent == "@0R7").count();
    for model in ["imc4", "imc-s8"] {
        let (emulator, port) = listening(model, "mill", Clock::Real);
        let send = ["job.ncp", "--machine", "mill", "--model", model, "--to", &port];
        let child = sending(&folder, &send);
        until("the second run", || runs(&emulator) == 2);
        // Z, which is the first of three, is stopped by and by.
        thread::sleep(Duration::from_millis(100));
        emulator.press(Button::Stop).unwrap();
        let output = child.output_in_time().unwrap();
        let (out, err) = (text(&output.stdout), text(&output.stderr));
        assert_eq!(output.status.code(), Some(1), "{out}{err}");
        assert!(err.contains("STOP at the panel may have stood in for the switch"), "{err}");
        assert!(
            !err.contains(" at X ") && err.contains("--from 5 goes on with that line"),
            "{err}"
        );
    }
    // Nobody is suspected whose time is faster, nor where nothing was pressed.
    for clock in [Clock::Instant, "8x".parse().unwrap(), Clock::Real] {
        let (emulator, port) = listening("imc4", "mill", clock);
        let send = ["send", "job.ncp", "--machine", "mill", "--to", &port];
        ends(&folder, &send, 0);
        assert_eq!(emulator.position().unwrap()[..3], [400, 0, 0]);
    }
}

#[test]
fn what_is_for_files_is_not_done_at_a_prompt() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nHALT\nMOVEABS X1000\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
    for typed in ["PROGEND", "HALT", "GETTOOL 3", "WPTEACH"] {
        typist.types("line 3: HALT", typed);
        let word = typed.split(' ').next().unwrap();
        typist.hears(&format!("{word} is for files, and is not done here"));
    }
    // And the prompts stay in step.
    typist.types("line 3: HALT", "MOVEREL Y500");
    typist.types("line 3: HALT", "");
    let (_, err) = typist.ends(0);
    assert!(err.contains("done here; q ends the job"), "{err}");
    assert_eq!(emulator.position().unwrap()[..2], [80, 40]);
}

#[test]
fn a_hole_in_single_steps_is_warned_of() {
    let folder = Folder::new();
    for (definition, said) in [
        ("C2 D3000 F1000 S1000", "O does not say how deep the steps after the first are"),
        ("C3 D3000 F1000 O0 S1000", "O does not say how deep the steps after the first are"),
        ("C2 D3000 S1000", "neither F nor O say"),
        ("C2 D3000 O500 S1000", ""),
        ("C2 D1000 F1000 S1000", ""),
        ("C1 D3000 F1000 S1000", ""),
    ] {
        let job =
            format!("IMF_PBL\nREF XYZ\nDRILLDEF {definition}\nDRILL X1000\nDRILL X2000\nPROGEND\n");
        fs::write(folder.join("job.ncp"), job).unwrap();
        let (out, _) = ends(&folder, &["ncp", "check", "job.ncp", "--format", "short"], 0);
        assert_eq!(out.lines().count(), if said.is_empty() { 1 } else { 2 }, "{out}");
        assert!(out.contains(said), "{out}");
    }
    fs::write(
        folder.join("job.ncp"),
        "IMF_PBL\nREF XYZ\nDRILLDEF C2 D3000 F-1000 S1000\nDRILL X1\n",
    )
    .unwrap();
    let (out, _) = ends(&folder, &["ncp", "check", "job.ncp", "--format", "short"], 1);
    assert!(out.contains("negative-length") && !out.contains("neither F nor O"), "{out}");
}

#[test]
fn a_job_that_counts_from_where_it_began_goes_on() {
    let job = "IMF_PBL\nVEL 5000\nMOVEREL X30000\nMOVEREL Y5000\n";
    let folder = Folder::with(job);
    let (emulator, port) = listening("imc4", "mill", Clock::Real);
    let send = ["job.ncp", "--machine", "mill", "--no-ref", "--to", &port];
    let child = sending(&folder, &send);
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 100);
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let err = text(&child.output_in_time().unwrap().stderr);
    assert!(err.contains("--from 3 goes on with that line, where the counters say"), "{err}");
    assert!(x() > 100 && x() < 2_400);
    // The first line that moves goes on from where the tool has come to.
    let command = onward(&err);
    assert!(command.windows(2).any(|words| words == ["--zero", "0,0,0"]), "{command:?}");
    let command: Vec<&str> = command.iter().map(String::as_str).collect();
    ends(&folder, &command, 0);
    assert_eq!(emulator.position().unwrap()[..3], [2_400, 400, 0]);

    // Where the counters do not count from there, it is said why there is no command.
    let child = sending(&folder, &send);
    until("it moves", || x() > 2_500);
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let err = text(&child.output_in_time().unwrap().stderr);
    assert!(err.contains("the counters did not count from there"), "{err}");
    assert!(!err.contains("to go on with line"), "{err}");
}

#[test]
fn what_was_typed_is_shown_as_the_file_needs_it() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nHALT\nMOVEABS X3000\nHALT\nMOVEABS X0\n");
    let (emulator, port) = listening("imc4", "bench", Clock::Instant);
    let send = ["job.ncp", "--to", &port];
    let types = ["INCH", "MOVEREL X100", "WPZERO", ""];
    let run = |end: &str| {
        let mut typist = Typist::new(&folder, &send);
        for typed in types {
            typist.types("line 3: HALT", typed);
        }
        typist.types("line 5: HALT", end);
        typist.ends(if end.is_empty() { 0 } else { 3 }).1
    };
    let err = run("q");
    let block = "behind line 3 of the file:\nINCH\nMOVEREL X100\nWPZERO\nMETRIC\n\
                 then --from 9 goes on with what is line 5 now\n";
    assert!(err.contains(block), "{err}");
    run("");
    let whole = emulator.position().unwrap();
    let job = "IMF_PBL\nREF XYZ\nHALT\nINCH\nMOVEREL X100\nWPZERO\nMETRIC\nMOVEABS X3000\nHALT\nMOVEABS X0\n";
    fs::write(folder.join("job.ncp"), job).unwrap();
    ends(&folder, &[&["send"], &send[..], &["--from", "9", "--yes"]].concat(), 0);
    assert_eq!(emulator.position().unwrap(), whole);
}

#[test]
fn a_typed_register_that_changes_nothing_has_changed_nothing() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nHALT\nMOVEABS X1000\nHALT\n");
    let (_emulator, port) = listening("imc4", "bench", Clock::Instant);
    let mut typist = Typist::new(&folder, &["job.ncp", "--to", &port]);
    typist.types("line 3: HALT", "WPREG1ACT");
    typist.types("line 3: HALT", "");
    typist.types("line 5: HALT", "q");
    let (out, err) = typist.ends(3);
    assert!(!out.contains("has changed") && err.contains("to go on with line 5:"), "{out}{err}");
}

#[test]
fn a_plot_for_lpkf_at_a_controller_of_isel_is_told_so() {
    let folder = Folder::new();
    fs::write(folder.join("plot.plt"), PLOT).unwrap();
    let (_emulator, port) = listening("imc4", "bench", Clock::Instant);
    let send = ["send", "plot.plt", "--model", "smcu", "--machine", "board-plotter", "--to", &port];
    let (_, err) = ends(&folder, &send, 2);
    assert!(err.contains("is an isel controller (it says `5`)"), "{err}");
    fs::write(folder.join("job.ncp"), "IMF_PBL\nREF XYZ\n").unwrap();
    let (_, err) = ends(&folder, &["send", "job.ncp", "--model", "smcu", "--to", &port], 2);
    let err = err.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(err.contains("job.ncp is a job file, and the smcu does not speak isel's"), "{err}");
    assert!(err.contains("choose one of imc4, ") && err.ends_with(", with --model"), "{err}");
    let wide: Vec<u8> = "IMF_PBL\nREF XYZ\n".bytes().flat_map(|byte| [byte, 0]).collect();
    fs::write(folder.join("wide.ncp"), wide).unwrap();
    let (_, err) = ends(&folder, &["ncp", "check", "wide.ncp"], 2);
    assert!(err.contains("UTF-16"), "{err}");
}

#[test]
fn a_motion_without_an_answer_is_remarked_soon() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X10000\n");
    let (port, _heard) = peer(|line| like_an_imc4(line, 'A', b""));
    let mut child = sending(&folder, &["job.ncp", "--to", &port]);
    let said = Timed::new("standard error", child.stderr.take().unwrap());
    let mut said = std::io::BufReader::new(said);
    let begun = Instant::now();
    let mut line = String::new();
    while !line.contains("no answer for") {
        line.clear();
        assert!(std::io::BufRead::read_line(&mut said, &mut line).unwrap() > 0);
    }
    assert!(line.contains("s were foreseen: the controller may have lost its power"), "{line}");
    assert!(begun.elapsed() < LIMIT);
    child.kill().unwrap();
    child.wait_in_time().unwrap();
}

#[test]
fn where_the_axes_are_is_not_known_after_a_limit_switch() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\nHALT\nMOVEABS X5000\n");
    let unknown = "where the axes are is not known, for steps may have been lost";
    for model in ["imc4", "imc-s8"] {
        let send = ["job.ncp", "--model", model, "--machine", "mill", "--to"];
        // In a reference run.
        let (emulator, port) = listening(model, "mill", Clock::Instant);
        emulator.set_signal("limit x+", 1).unwrap();
        let (_, err) = Typist::new(&folder, &[&send[..], &[&port]].concat()).ends(1);
        assert!(err.contains("@0R7 was answered 2: limit switch"), "{model} {err}");
        assert!(err.contains(unknown) && !err.contains(" at X "), "{model} {err}");
        // In a move, where going on would believe the counters.
        for no_ref in [false, true] {
            emulator.set_signal("limit x+", 0).unwrap();
            let options: &[&str] = if no_ref { &["--no-ref"] } else { &[] };
            let mut typist = Typist::new(&folder, &[&send[..], &[&port], options].concat());
            typist.hears("line 4: HALT");
            emulator.set_signal("limit x+", 1).unwrap();
            writeln!(typist.terminal).unwrap();
            let (_, err) = typist.ends(1);
            assert!(err.contains("answered 2: limit switch"), "{model} {err}");
            assert!(err.contains(unknown) && !err.contains(" at X "), "{model} {err}");
            // The job has referenced its axes, and does so again.
            assert!(err.contains("--from 5 goes on with that line, after ref"), "{model} {err}");
            assert!(!onward(&err).contains(&"--no-ref".to_owned()), "{model} {err}");
        }
    }
}

#[test]
fn a_code_of_two_meanings_is_told_with_both() {
    let folder = Folder::with("");
    fs::write(folder.join("list.txt"), "@07\n@0M100,1000,0,1000,0,1000,0,300\n").unwrap();
    let (_emulator, port) = listening("imc4", "mill", Clock::Instant);
    let send = ["send", "list.txt", "--to", &port, "--machine", "mill", "--refused-too", "--yes"];
    let (_, err) = ends(&folder, &send, 1);
    let virtual_one = "with 2: X has no reference point: @0R1 finds it";
    assert!(err.contains(virtual_one), "{err}");
    assert!(
        err.contains("was answered 2: limit switch, or no reference point") && err.contains("@0M"),
        "{err}"
    );
}

/// What makes a controller forget where its axes are: a loss of power, or an emergency stop.
const EVENTS: [fn(&Emulator); 2] = [
    |emulator| {
        emulator.power(false).unwrap();
        emulator.power(true).unwrap();
    },
    |emulator| {
        emulator.hold(Button::EmergencyStop).unwrap();
        emulator.release(Button::EmergencyStop).unwrap();
        emulator.press(Button::On).unwrap();
    },
];

const FORGOTTEN: &str = "where the axes are is not known, for the counters may have been reset";

#[test]
fn a_stopped_motion_does_not_go_on_once_the_controller_has_forgotten_it() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 5000\nMOVEABS X30000\nMOVEABS Y30000\n");
    let moves = "@0A3000,500,0,21,0,21,0,21\n@0A0,21,3000,500,0,21,0,21\n";
    fs::write(folder.join("list.txt"), format!("@07\n@0R7\n{moves}")).unwrap();
    fs::write(folder.join("stored.cnc"), "; axes: 7 (X+Y+Z)\n0800,1000,0,900,0,900,0,900\n9\n")
        .unwrap();
    let cases = [
        ("imc-s8", "job.ncp", 0),
        ("imc-s8", "list.txt", 1),
        ("imc4", "job.ncp", 1),
        ("imc4", "list.txt", 0),
    ];
    for (model, file, event) in cases {
        let (emulator, port) = listening(model, "mill", Clock::Real);
        let to = ["--to", &port, "--model", model, "--machine", "mill"];
        if model == "imc-s8" {
            ends(&folder, &[&["send", "stored.cnc"], &to[..]].concat(), 0);
        }
        let mut typist = Typist::new(&folder, &[&[file], &to[..]].concat());
        let x = || emulator.position().unwrap()[0];
        until("it moves", || x() > 100);
        writeln!(typist.terminal).unwrap();
        typist.hears("stopped; Enter goes on");
        until_it_rests(x);
        // It was asked where that is.
        thread::sleep(Duration::from_millis(500));
        EVENTS[event](&emulator);
        writeln!(typist.terminal).unwrap();
        let (_, err) = typist.ends(1);
        let sent = sent(&emulator);
        assert!(!sent.iter().any(|sent| sent == "@0S"), "{model} {file} {sent:?}");
        assert_eq!(sent.iter().filter(|sent| sent.starts_with("@0A")).count(), 1, "{sent:?}");
        assert!(err.contains(FORGOTTEN) && !err.contains(" at X "), "{model} {file} {err}");
        assert_eq!(err.contains("to go on with line 4:"), file == "job.ncp", "{err}");
    }
}

/// What an IMC4 answers that was stopped at the panel where its counters are 0, and that refuses
/// `n` of no axis so.
fn stopped_at_zero(line: &str, refusal: &[u8]) -> Vec<u8> {
    match line {
        "@0P\r" => [b'0'; 19].to_vec(),
        "@0n0\r" => refusal.to_vec(),
        "@0DS0\r" => b"0B0".to_vec(),
        _ => like_an_imc4(line, 'A', b"F"),
    }
}

#[test]
fn what_counts_as_one_just_switched_on_does_is_asked_for_its_axes() {
    // Stopped, and at a HALT.
    for (job, asked) in [
        ("IMF_PBL\nREF XYZ\nMOVEABS X500000\n", "line 3: stopped"),
        ("IMF_PBL\nREF XYZ\nHALT\nSETBIT A1.1=1\n", "line 3: HALT"),
    ] {
        let folder = Folder::with(job);
        let send = ["job.ncp", "--machine", "bench", "--any-time", "--to"];
        for (refusal, knows) in [(b"4", false), (b"3", true), (b"9", false)] {
            let (port, heard) = peer(|line| stopped_at_zero(line, refusal));
            let mut typist = Typist::new(&folder, &[&send[..], &[&port]].concat());
            typist.hears(asked);
            thread::sleep(Duration::from_millis(500));
            writeln!(typist.terminal).unwrap();
            let (_, err) = typist.ends(if knows { 0 } else { 1 });
            let heard = joined("the end of the connection", heard);
            let goes_on = heard.contains("@0S\r") || heard.contains("@0B");
            assert_eq!(goes_on, knows, "{heard} {err}");
            assert_eq!(err.contains(FORGOTTEN), !knows, "{err}");
        }
    }
}

#[test]
fn nothing_is_switched_at_a_halt_once_the_controller_has_forgotten() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\nHALT\nSPINDLE CW\n");
    for event in EVENTS {
        let (emulator, port) = listening("imc4", "mill", Clock::Instant);
        let mut typist = Typist::new(&folder, &["job.ncp", "--machine", "mill", "--to", &port]);
        typist.hears("line 4: HALT");
        until("it rests", || sent(&emulator).iter().filter(|sent| *sent == "@0P").count() > 1);
        thread::sleep(Duration::from_millis(300));
        event(&emulator);
        writeln!(typist.terminal).unwrap();
        let (_, err) = typist.ends(1);
        assert!(err.contains(FORGOTTEN) && err.contains("--from 5 goes on"), "{err}");
        assert!(!sent(&emulator).iter().any(|sent| sent.starts_with("@0B")), "{err}");
    }
}

#[test]
fn an_error_in_answer_to_ctrl_c_is_one() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X500000\n");
    fs::write(folder.join("list.txt"), "@07\n@0R7\n@0A5000,500,0,21,0,21,0,21\n").unwrap();
    fs::write(folder.join("no-ref.ncp"), "IMF_PBL\nVEL 5000\nMOVEABS X500000\n").unwrap();
    let cases = [
        (b"2", "answered 2: limit switch", "for steps may have been lost"),
        (b"9", "answered 9: the plant is not ready", "for the counters may have been reset"),
    ];
    for (answer, said, why) in cases {
        for arguments in [&["job.ncp"][..], &["list.txt"], &["no-ref.ncp", "--no-ref"]] {
            let (sender, moves) = channel();
            let (port, _heard) = stoppable(move |line| match line {
                STOP => answer.to_vec(),
                _ if line.starts_with("@0A") => {
                    let _ = sender.send(());
                    Vec::new()
                }
                _ => like_an_imc4(line, '-', b""),
            });
            let to = ["--any-time", "--to", &port];
            let child = sending(&folder, &[arguments, &to].concat());
            moves.recv_timeout(LIMIT).unwrap();
            kill_process(Pid::from_child(&child), Signal::INT).unwrap();
            let output = child.output_in_time().unwrap();
            let err = text(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{err}");
            assert!(err.contains(said) && err.contains(why), "{arguments:?} {err}");
            assert!(!err.contains(" at X ") && !err.contains("come to rest"), "{err}");
            assert_eq!(err.contains("cannot go on"), arguments[0] == "no-ref.ncp", "{err}");
        }
    }
}

#[test]
fn ctrl_c_in_the_first_motion_behind_a_halt_says_where() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nVEL 5000\nMOVEABS X1000\nHALT\nMOVEABS X30000\n");
    let (emulator, port) = listening("imc4", "mill", Clock::Real);
    let mut typist = Typist::new(&folder, &["job.ncp", "--machine", "mill", "--to", &port]);
    typist.hears("line 5: HALT");
    until("it rests", || sent(&emulator).iter().filter(|sent| *sent == "@0P").count() > 1);
    thread::sleep(Duration::from_millis(300));
    writeln!(typist.terminal).unwrap();
    let x = || emulator.position().unwrap()[0];
    until("it moves", || x() > 150);
    kill_process(Pid::from_child(&typist.process.child), Signal::INT).unwrap();
    let (_, err) = typist.ends(1);
    let place = format!("come to rest along its ramp, at X {:.3} mm", x() as f64 * 0.0125);
    assert!(err.contains(&place) && !err.contains("not known"), "{err}");
}

#[test]
fn a_job_that_has_referenced_its_axes_does_so_again_where_no_ref_would_believe() {
    let job = "IMF_PBL\nREF XYZ\nVEL 5000\nMOVEABS X5000\nHALT\nMOVEABS X9000\n";
    let folder = Folder::with(job);
    for model in ["imc4", "imc-s8"] {
        let (emulator, port) = listening(model, "mill", Clock::Instant);
        let send = ["job.ncp", "--model", model, "--machine", "mill", "--to", &port];
        let mut typist = Typist::new(&folder, &send);
        typist.types("line 5: HALT", "q");
        typist.ends(3);
        emulator.set_signal("limit x+", 1).unwrap();
        let no_ref = [&["send"], &send[..], &["--from", "6", "--no-ref"]].concat();
        let (_, err) = ends(&folder, &no_ref, 1);
        assert!(err.contains("--from 6 goes on with that line, after reference runs"), "{err}");
        assert!(!onward(&err).contains(&"--no-ref".to_owned()), "{err}");
        emulator.set_signal("limit x+", 0).unwrap();
        let again: Vec<String> = onward(&err);
        let again: Vec<&str> = again.iter().map(String::as_str).collect();
        let (_, err) = ends(&folder, &again, 0);
        assert!(err.contains("reference runs come first: Z, Y, X"), "{err}");
        assert_eq!(emulator.position().unwrap()[0], 720);
        // One that was switched on since then counts from elsewhere.
        for event in EVENTS {
            event(&emulator);
            let (_, err) = ends(&folder, &no_ref, 2);
            assert!(err.contains("it was switched on or reset since") && err.contains("--no-ref"));
            let last = emulator.commands().unwrap().last().map(|command| text(&command.bytes));
            assert_eq!(last.as_deref(), Some("@0n0"));
            ends(&folder, &again, 0);
        }
    }
}

#[test]
fn a_poll_that_is_lost_is_no_end_of_what_is_asked() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicUsize;
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X200000\n");
    let rest = |x: u32| format!("0{x:06X}000000000000000000").into_bytes();
    // What `P` answers when the third poll was lost, and what comes of it.
    for (places, code, said) in [
        (rest(0), 1, FORGOTTEN),
        (rest(100), 0, "START at the panel"),
        (Vec::new(), 1, "does not answer any more"),
    ] {
        let (polls, moved) = (Arc::new(AtomicUsize::new(0)), AtomicBool::new(false));
        let counted = Arc::clone(&polls);
        let (port, heard) = peer(move |line| match line {
            "@0DS0\r" => match polls.fetch_add(1, Ordering::SeqCst) {
                2 => Vec::new(),
                // START is held some time later.
                6.. => b"0B2".to_vec(),
                _ => b"0B0".to_vec(),
            },
            "@0P\r" if !moved.load(Ordering::SeqCst) => rest(0),
            "@0P\r" if polls.load(Ordering::SeqCst) > 2 => places.clone(),
            "@0P\r" => rest(100),
            _ => {
                moved.fetch_or(line.starts_with("@0A"), Ordering::SeqCst);
                like_an_imc4(line, 'A', b"F")
            }
        });
        let (out, err) = ends(
            &folder,
            &["send", "job.ncp", "--machine", "mill", "--any-time", "--to", &port],
            code,
        );
        assert!(err.contains(said), "{out}{err}");
        let heard = joined("the end of the connection", heard);
        assert_eq!(heard.contains("@0S\r"), code == 0, "{heard}");
        assert!(counted.load(Ordering::SeqCst) == if code == 0 { 7 } else { 3 }, "{heard}");
    }
}

#[test]
fn what_a_lenient_reading_leaves_out_is_said() {
    let lines = "SETBIT A1.3=1 FOO\nVEL 8000 (slowly)\n(whole)\nMOVEABS X1 FAST\nPROGEND\n";
    let folder = Folder::with(format!("IMF_PBL\nREF XYZ\n{lines}"));
    let check = ["ncp", "check", "job.ncp", "--lenient", "--format"];
    let (out, _) = ends(&folder, &[&check[..], &["short"]].concat(), 1);
    let said: Vec<&str> = out.lines().collect();
    for (said, left_out) in said.iter().zip(["the line", "the comment", "the comment"]) {
        assert!(said.ends_with(&format!("; {left_out} is left out")), "{said}");
    }
    assert!(said[3].contains(":6:") && !said[3].contains("left out"), "{out}");
    let (out, _) = ends(&folder, &[&check[..], &["full"]].concat(), 1);
    assert_eq!(out.matches("is left out").count(), 3, "{out}");
    let (out, _) = ends(&folder, &[&check[..], &["json"]].concat(), 1);
    let json: Value = serde_json::from_str(&out).unwrap();
    let left_out = json["diagnostics"].as_array().unwrap().iter().map(|it| it["left_out"].clone());
    assert_eq!(left_out.collect::<Vec<_>>(), [true, true, true, false]);
    // Nobody who is not lenient leaves anything out.
    let (out, _) = ends(&folder, &["ncp", "check", "job.ncp"], 1);
    assert!(!out.contains("left out"), "{out}");
}

#[test]
fn a_warning_of_the_controller_is_in_words() {
    let folder = Folder::with("IMF_PBL\nREF A\nPROGEND\n");
    let run = ["ncp", "run", "job.ncp", "--machine", "mill", "--press", "stop@2s"];
    let (out, _) = ends(&folder, &run, 0);
    assert!(out.contains("warning   no switch is ahead of A: its reference run"), "{out}");
    assert!(!out.contains(['{', '"']), "{out}");
}

#[test]
fn a_wait_that_nothing_ends_says_what_the_port_reads() {
    let folder = Folder::with("IMF_PBL\nWAITPORT E1==11000101B\nPROGEND\n");
    let (out, err) = ends(&folder, &["ncp", "run", "job.ncp"], 3);
    let waits = "line 2 waits until port 0 reads 11000101B; it reads 11000000B, and the bits \
                 0.0, 0.2 differ";
    assert!(out.contains(waits), "{out}");
    assert!(err.contains("only E1.3 and E1.4 can change"), "{err}");
}

#[test]
fn a_program_that_is_too_large_says_where_to_split_it() {
    let moves = "MOVEREL X1000\nMOVEREL X-1000\n".repeat(600);
    let folder = Folder::with(format!("IMF_PBL\nREF XYZ\n{moves}PROGEND\n"));
    let (_, err) = ends(&folder, &["ncp", "compile", "job.ncp"], 1);
    // z1, 77, z1, 1,200 moves, and the end.
    let needed = 3 * 5 + 1_200 * 33 + 1;
    let says = format!("the program needs {needed} bytes and the controller has 32768");
    assert!(err.contains(&says), "{err}");
    assert!(err.contains("split the job into 2 or more"), "{err}");
    // 992 moves fit behind the first two lines.
    assert!(err.contains("split it at line 995"), "{err}");
}

#[test]
fn a_job_that_was_cut_off_is_refused() {
    let folder = Folder::with("IMF_PBL\nREF XYZ\nMOVEABS X1000\nMOVEABS X1660");
    for command in [&["ncp", "check"][..], &["ncp", "run"], &["ncp", "compile"]] {
        let (out, err) = ends(&folder, &[command, &["job.ncp"]].concat(), 1);
        assert!(format!("{out}{err}").contains("in the middle of this line"), "{out}{err}");
    }
    let (out, _) = ends(&folder, &["ncp", "run", "job.ncp", "--lenient"], 1);
    assert!(out.contains("\nX                   1.000 mm"), "{out}");
    assert!(out.contains("line 4 cannot be carried out: the file ends in"), "{out}");
}

#[test]
fn between_holes_the_path_is_rapid() {
    let folder = Folder::with(
        "IMF_PBL\nREF XYZ\nDRILLDEF C2 D3000 F1000 O1000 V2000 L1000 S5000\nDRILL X1000\nDRILL X9000\n\
         PROGEND\n",
    );
    ends(&folder, &["ncp", "run", "job.ncp", "--as", "dxf", "out.dxf"], 0);
    let drawing = fs::read_to_string(folder.join("out.dxf")).unwrap().replace('\r', "");
    let lines: Vec<&str> = drawing.split("\nLINE\n").skip(1).collect();
    let on = |layer: &str| {
        lines.iter().filter(|line| line.starts_with(&format!("  8\n{layer}\n"))).count()
    };
    // Three depths a hole are fed.
    assert_eq!(on("FEED"), 6, "{drawing}");
    assert!(on("RAPID") >= 10, "{drawing}");
}
