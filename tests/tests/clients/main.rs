//! Real clients on real ports: Rust, pyserial and socat, over a pseudo-terminal and over TCP.
//!
//! What needs a tool that is missing is shown as ignored, with the reason in its name. With
//! `VIMC4_REQUIRE_TOOLS=1` it fails instead, so that nothing is left out unnoticed.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

#[path = "../../../emulator/tests/process/limits.rs"]
mod limits;
mod lpkf;

use std::fs::OpenOptions;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use libtest_mimic::{Arguments, Trial};
use vimc4::isel::ProgramStatus;
use vimc4::{Clock, Emulator};

use limits::{EndsInTime, InTime, LIMIT, Timed};

fn emulator(clock: Clock) -> Emulator {
    Emulator::builder().time(clock).pty(true).tcp("127.0.0.1:0").start().expect("an emulator")
}

// --- Rust clients ---

trait Port: Read + Write {}
impl<T: Read + Write> Port for T {}

fn tcp(emulator: &Emulator) -> Box<dyn Port> {
    let stream = TcpStream::connect(emulator.tcp_addr().unwrap()).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    Box::new(stream)
}

fn terminal(emulator: &Emulator) -> Box<dyn Port> {
    let path = emulator.port().unwrap();
    let port = OpenOptions::new().read(true).write(true).open(path).unwrap();
    Box::new(Timed::new("the pseudo-terminal", port))
}

fn memory(emulator: &Emulator) -> Box<dyn Port> {
    Box::new(emulator.connect().unwrap())
}

/// Sends a line and reads `count` bytes.
fn ask(port: &mut dyn Port, line: &str, count: usize) -> String {
    write!(port, "{line}\r").unwrap();
    let mut answer = vec![0; count];
    port.read_exact(&mut answer).unwrap();
    String::from_utf8(answer).unwrap()
}

fn reads_positions(open: fn(&Emulator) -> Box<dyn Port>) {
    let emulator = emulator(Clock::Instant);
    let mut port = open(&emulator);
    assert_eq!(ask(&mut *port, "@07", 1), "0");
    assert_eq!(ask(&mut *port, "@0A 256,9000,-2,900,0,900,0,900", 1), "0");
    assert_eq!(ask(&mut *port, "@0P", 19), "0000100FFFFFE000000");
    assert_eq!(ask(&mut *port, "@08", 1), "0");
    assert_eq!(ask(&mut *port, "@0P", 25), "0000100FFFFFE000000000000");
    // Nothing is left over that the next answer would begin with.
    assert_eq!(ask(&mut *port, "@0b0", 3), "0C0");
}

/// A program that never ends answers a reset in every clock, and so does a port that toggles
/// for ever.
fn endless_programs_listen(clock: Clock) {
    let emulator = Emulator::builder().model("imc-s8").time(clock).start().unwrap();
    for program in [&["0900,9000", "0-900,9000", "30,-2"][..], &["p0,1,1", "p0,1,0", "30,-2"]] {
        let mut port = emulator.connect().unwrap();
        for line in ["@01", "@0k", "@0i"].into_iter().chain(program.iter().copied()).chain(["9"]) {
            write!(port, "{line}\r").unwrap();
            if clock == Clock::Manual {
                emulator.run_until_idle().unwrap();
            }
            let mut answer = [0];
            port.read_exact(&mut answer).unwrap();
            assert_eq!(answer, *b"0", "{line}");
        }
        emulator.press("start").unwrap();
        let before = emulator.now().unwrap();
        if clock == Clock::Manual {
            emulator.advance(Duration::from_millis(40)).unwrap();
        } else {
            std::thread::sleep(Duration::from_millis(40));
        }
        assert!(emulator.now().unwrap() > before, "the program does not advance");
        let program = emulator.view().unwrap().details.program().map(|program| program.status);
        assert_eq!(program, Some(ProgramStatus::Running));
        port.write_all(&[254]).unwrap();
        assert_eq!(ask(&mut port, "@0P", 19), "0000000000000000000");
    }
}

/// The same conversation gives the same bytes in every clock, and takes the time it should.
fn clocks_agree() {
    let conversation = |clock: Clock| {
        let emulator = emulator(clock);
        let mut port = terminal(&emulator);
        assert_eq!(ask(&mut *port, "@01", 1), "0");
        let began = Instant::now();
        let answer = ask(&mut *port, "@0A1000,1000", 1) + &ask(&mut *port, "@0P", 19);
        (answer, began.elapsed())
    };
    let (real, wall) = conversation(Clock::Real);
    // With its ramps the move takes 1.0049 s.
    assert!(wall >= Duration::from_millis(1_000), "{wall:?}");
    let (scaled, wall) = conversation("8x".parse().unwrap());
    assert!(wall >= Duration::from_millis(125), "{wall:?}");
    let (instant, _) = conversation(Clock::Instant);
    assert_eq!([&scaled, &instant], [&real, &real]);
}

// --- other people's clients ---

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/clients").join(name)
}

fn has(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status_in_time().is_ok_and(|status| status.success())
}

fn runs(mut command: Command) {
    let output = command.output_in_time().expect("the client runs");
    assert!(
        output.status.success(),
        "{command:?}\n{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

fn python(script: &str, emulator: &Emulator, over_tcp: bool) -> Command {
    let port = match over_tcp {
        true => format!("socket://{}", emulator.tcp_addr().unwrap()),
        false => emulator.port().unwrap().display().to_string(),
    };
    let mut command = Command::new("python3");
    command.arg(file(script)).arg(port);
    command
}

fn pyserial(script: &str, emulator: &Emulator, over_tcp: bool) {
    runs(python(script, emulator, over_tcp));
}

/// Jobs that end in E08, E09 and E0A, each followed by one that must run. Where the client prints
/// the name of a button, that is pressed.
fn next_job(clock: Clock, over_tcp: bool) {
    let emulator = lpkf::plotter(clock);
    let mut client = python("next_job.py", &emulator, over_tcp)
        .stdout(Stdio::piped())
        .start()
        .expect("the client runs");
    for button in BufReader::new(Timed::new("the client", client.stdout.take().unwrap())).lines() {
        emulator.press(button.unwrap()).unwrap();
    }
    assert!(client.wait_in_time().unwrap().success(), "the next job did not run");
}

fn socat(clock: Clock) {
    let emulator = emulator(clock);
    let mut client = Command::new("socat")
        .args(["-t2", "-"])
        .arg(format!("{},rawer", emulator.port().unwrap().display()))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .start()
        .expect("socat runs");
    let mut to = client.stdin.take().unwrap();
    to.write_all(b"@07\r\n@0R7\r\n@0P\r\n").unwrap();
    let mut from = Timed::new("socat", client.stdout.take().unwrap());
    let mut answer = [0; 21];
    from.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"000000000000000000000");
    drop(to);
    let mut rest = Vec::new();
    match from.read_to_end(&mut rest) {
        Ok(_) => assert_eq!(rest, b""),
        Err(error) => assert_eq!(error.kind(), ErrorKind::UnexpectedEof),
    }
    client.wait_in_time().unwrap();
}

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    let test = |name: &str, body: fn()| {
        Trial::test(name, move || {
            body();
            Ok(())
        })
    };
    let with_pyserial = has("python3", &["-c", "import serial"]);
    let with_socat = has("socat", &["-V"]);
    let with = |there: bool, reason: &str, name: &str, body: fn()| {
        let name = if there { name.to_owned() } else { format!("{name} ({reason})") };
        test(&name, body).with_ignored_flag(!there && !required)
    };
    let needs_pyserial = "needs python3 with pyserial";
    let trials = vec![
        test("a Rust client reads positions over TCP", || reads_positions(tcp)),
        test("a Rust client reads positions over a pseudo-terminal", || reads_positions(terminal)),
        test("a Rust client reads positions over an in-memory port", || reads_positions(memory)),
        test("endless programs listen in real time", || endless_programs_listen(Clock::Real)),
        test("endless programs listen in instant time", || endless_programs_listen(Clock::Instant)),
        test("endless programs listen in manual time", || endless_programs_listen(Clock::Manual)),
        test("endless programs listen in scaled time", || {
            endless_programs_listen("8x".parse().unwrap());
        }),
        test("every clock gives the same bytes", clocks_agree),
        with(with_pyserial, needs_pyserial, "pyserial over a pseudo-terminal", || {
            pyserial("position.py", &emulator(Clock::Instant), false);
        }),
        with(with_pyserial, needs_pyserial, "pyserial over TCP", || {
            pyserial("position.py", &emulator(Clock::Instant), true);
        }),
        with(with_pyserial, needs_pyserial, "pyserial stops and goes on in real time", || {
            pyserial("stop_and_go.py", &emulator(Clock::Real), false);
        }),
        with(
            with_pyserial,
            needs_pyserial,
            "pyserial drives a board plotter over a pseudo-terminal",
            || {
                pyserial("board.py", &lpkf::emulator(Clock::Instant), false);
            },
        ),
        with(with_pyserial, needs_pyserial, "pyserial drives a board plotter over TCP", || {
            pyserial("board.py", &lpkf::emulator(Clock::Instant), true);
        }),
        with(with_pyserial, needs_pyserial, "the job after a stop over a pseudo-terminal", || {
            next_job(Clock::Instant, false);
        }),
        with(with_pyserial, needs_pyserial, "the job after a stop over TCP", || {
            next_job(Clock::Instant, true);
        }),
        with(
            with_pyserial,
            needs_pyserial,
            "the job after a stop over a pseudo-terminal in real time",
            || next_job(Clock::Real, false),
        ),
        with(with_pyserial, needs_pyserial, "the job after a stop over TCP in real time", || {
            next_job(Clock::Real, true);
        }),
        test("100,000 commands over a pseudo-terminal are acknowledged once, in order", || {
            lpkf::stream(terminal);
        }),
        test("100,000 commands over TCP are acknowledged once, in order", || lpkf::stream(tcp)),
        test(
            "a full command buffer on a pseudo-terminal says so once",
            lpkf::overrun_on_a_terminal,
        ),
        test("a host on TCP is held back and loses nothing", lpkf::held_back_on_tcp),
        with(with_socat, "needs socat", "socat on a pseudo-terminal", || socat(Clock::Instant)),
    ];
    libtest_mimic::run(&arguments, trials).exit_code()
}
