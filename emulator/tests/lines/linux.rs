//! The tests.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Output, Stdio};
use std::thread;
use std::time::Duration;

use libtest_mimic::{Arguments, Failed, Trial};
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;
use vimc4::{Clock, Emulator};

use crate::process::limits::{EndsInTime, InTime, Timed, joined, until};

type Outcome = Result<(), Failed>;

/// With this the test binary is itself a host program.
const CLIENT: &str = "VIMC4_LINES_CLIENT";

/// A folder with a terminal in it, behind which a controller answers.
struct Bench {
    folder: TempDir,
    emulator: Option<Emulator>,
}

impl Bench {
    fn new() -> Result<Bench, Failed> {
        let folder = tempfile::tempdir()?;
        let mut bench = Bench { folder, emulator: None };
        bench.serve()?;
        Ok(bench)
    }

    fn serve(&mut self) -> Outcome {
        let builder = Emulator::builder().time(Clock::Instant);
        self.emulator = Some(builder.pty(self.link()).start()?);
        Ok(())
    }

    fn link(&self) -> PathBuf {
        self.folder.path().join("vimc4.pty")
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `vimc4 lines` in the folder.
    fn lines(&self, options: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
        command.current_dir(self.folder.path()).arg("lines").args(options).arg("--");
        command
    }

    /// A program of this test, made from its C source.
    fn made(&self, name: &str, options: &[&str]) -> Result<PathBuf, Failed> {
        let program = self.path(name);
        let mut cc = Command::new("cc");
        cc.args(["-O1", "-Wall", "-Werror", "-pthread"]).args(options);
        succeeds(cc.arg("-o").arg(&program).arg(source(&format!("{name}.c"))))?;
        Ok(program)
    }
}

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/lines").join(name)
}

/// Runs it to its end.
fn output(command: &mut Command) -> Result<Output, Failed> {
    command.output_in_time().map_err(|error| format!("{command:?}: {error}").into())
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// What it prints, if it ends well.
fn succeeds(command: &mut Command) -> Result<String, Failed> {
    let Output { status, stdout, stderr } = output(command)?;
    if !status.success() {
        let (out, err) = (text(&stdout), text(&stderr));
        return Err(format!("{command:?} ended with {status}:\n{out}\n{err}").into());
    }
    Ok(text(&stdout))
}

/// It fails, and says this.
fn fails(command: &mut Command, why: &str) -> Outcome {
    let Output { status, stdout, stderr } = output(command)?;
    let said = text(&stdout) + &text(&stderr);
    if status.success() || !said.contains(why) {
        return Err(format!("{command:?} ended with {status}:\n{said}").into());
    }
    Ok(())
}

fn same<T: PartialEq + std::fmt::Debug>(what: &str, is: T, should: T) -> Outcome {
    if is == should { Ok(()) } else { Err(format!("{what}: {is:?} instead of {should:?}").into()) }
}

/// The error of a terminal without lines.
const ENOTTY: &str = "Inappropriate ioctl for device";

/// A program that fails on the terminal as it is, and what it prints with lines.
fn shows(bench: &Bench, options: &[&str], program: &[&Path], printed: &str) -> Outcome {
    let link = bench.link();
    let (first, rest) = program.split_first().ok_or("no program")?;
    let mut plain = Command::new(first);
    fails(plain.args(rest).arg(&link).current_dir(bench.folder.path()), ENOTTY)?;
    let mut lines = bench.lines(options);
    let is = succeeds(lines.args(program).arg(&link))?;
    same("printed", is.as_str(), printed)
}

// --- what is at the far end ---

fn pyserial() -> Outcome {
    let bench = Bench::new()?;
    let program = [Path::new("python3"), &source("six.py")];
    let with = |options: &[&str], levels: [&str; 3]| {
        let printed: String = levels.iter().map(|levels| format!("{levels}\n")).collect();
        shows(&bench, options, &program, &(printed + "0\n"))
    };
    let on = "cts True dsr True ri False cd False";
    let carrier = "cts True dsr True ri False cd True";
    let off = "cts False dsr False ri False cd False";
    with(&[], [on; 3])?;
    with(&["--dcd"], [carrier; 3])?;
    with(&["--lines", "loop"], [on, off, on])?;
    with(&["--lines", "loop", "--dcd"], [carrier, off, carrier])?;
    with(&["--lines", "none"], [off; 3])
}

/// What it asks for a port says, and a pseudo-terminal alone does not.
fn setserial() -> Outcome {
    let bench = Bench::new()?;
    // It fails without an exit code that says so.
    let plain = output(Command::new("setserial").arg("-a").arg(bench.link()))?;
    same("without lines it says why", text(&plain.stderr).contains(ENOTTY), true)?;
    let script =
        "setserial ./vimc4.pty spd_cust divisor 12 low_latency && setserial -a ./vimc4.pty";
    let said = succeeds(bench.lines(&[]).args(["sh", "-c", script]))?;
    for words in ["UART: 16550A", "divisor: 12", "spd_cust low_latency"] {
        if !said.contains(words) {
            return Err(format!("{words} is missing: {said}").into());
        }
    }
    Ok(())
}

// --- every request, in every kind of program ---

/// What `requests` prints with `--lines loop`.
const ANSWERS: &str = "\
TIOCMGET 126
TIOCMBIC done
TIOCMGET 102
TIOCMBIS done
TIOCMSET done
TIOCMGET 102
TIOCGICOUNT 4
changes of DSR 1
errors 0
TIOCGSERIAL 4
baud base 1c200
TIOCSSERIAL done
TIOCGSERIAL 2000
divisor 30
TIOCSERGETLSR 1
null: Bad address
beyond: Bad address
constant: Bad address
counts nowhere: Bad address
settings nowhere: Bad address
none: Bad file descriptor
huge: Bad file descriptor
closed: Bad file descriptor
by name only: Bad file descriptor
for requests only 102
copy 102
null device: Inappropriate ioctl for device
pipe: Inappropriate ioctl for device
other terminal: Inappropriate ioctl for device
another request: Inappropriate ioctl for device
another process done
another thread done
";

fn requests(options: &[&str]) -> Outcome {
    let bench = Bench::new()?;
    let program = bench.made("requests", options)?;
    shows(&bench, &["--lines", "loop"], &[&program], ANSWERS)
}

fn waits() -> Outcome {
    let bench = Bench::new()?;
    let program = bench.made("wait", &[])?;
    let said = |what: &str| {
        succeeds(bench.lines(&["--lines", "loop"]).arg(&program).arg(what).arg(bench.link()))
    };
    same("wake", said("wake")?.as_str(), "waiting\nchanged, signals 0\n")?;
    same("handler", said("handler")?.as_str(), "waiting\nInterrupted system call, signals 1\n")?;
    same("restart", said("restart")?.as_str(), "waiting\nchanged, signals 1\n")?;
    // By another name, and by the next opening, with all lines on again.
    same("controlling terminal", said("ctty")?.as_str(), "0 126\n")?;
    same("opened again", said("close")?.as_str(), "0 126\n")
}

fn a_storm() -> Outcome {
    let bench = Bench::new()?;
    let program = bench.made("storm", &[])?;
    // It sends signals to its group.
    let mut command = Command::new("setsid");
    command.arg("--wait").arg(env!("CARGO_BIN_EXE_vimc4")).args(["lines", "--pty"]);
    let said = succeeds(command.arg(bench.link()).arg(program).arg(bench.link()))?;
    let should = "\
fifty threads: 0 wrong
closed in a call: 0 wrong
killed in a call: 250, 0 wrong
interrupted: 0 wrong
anything: 0 wrong
of those who wait killed: 200
";
    same("said", said.as_str(), should)
}

// --- ends ---

/// Starts a program that waits in a request, and returns when it does.
fn parked(
    bench: &Bench,
    what: &str,
) -> Result<(Child, BufReader<Timed<std::process::ChildStdout>>), Failed> {
    let program = bench.made("wait", &[])?;
    let mut command = bench.lines(&[]);
    command.arg(program).arg(what).arg(bench.link());
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).start()?;
    let said = Timed::new("standard output", child.stdout.take().ok_or("no output")?);
    let mut said = BufReader::new(said);
    let mut line = String::new();
    said.read_line(&mut line)?;
    same("said", line.as_str(), "waiting\n")?;
    // It says so just before it does.
    thread::sleep(Duration::from_millis(200));
    Ok((child, said))
}

fn rest(mut said: impl Read) -> Result<String, Failed> {
    let mut text = String::new();
    said.read_to_string(&mut text)?;
    Ok(text)
}

fn nobody_hangs() -> Outcome {
    // The program is ended; the signal is sent to us and passed on.
    for signal in [Signal::TERM, Signal::INT, Signal::HUP, Signal::USR1] {
        let bench = Bench::new()?;
        let (mut child, said) = parked(&bench, "parked")?;
        kill_process(Pid::from_child(&child), signal)?;
        same("ended", child.wait_in_time()?.signal(), Some(signal.as_raw()))?;
        same("said", rest(said)?.as_str(), "")?;
    }
    // The supervisor is killed: its program learns that nobody answers any more.
    let bench = Bench::new()?;
    let (mut child, said) = parked(&bench, "park")?;
    child.kill()?;
    same("ended", child.wait_in_time()?.signal(), Some(9))?;
    same("said", rest(said)?.as_str(), "Function not implemented, signals 0\n")?;
    // The terminal goes.
    let mut bench = Bench::new()?;
    let (mut child, said) = parked(&bench, "park")?;
    bench.emulator = None;
    same("ended", child.wait_in_time()?.code(), Some(0))?;
    same("said", rest(said)?.as_str(), "Input/output error, signals 0\n")
}

fn exit_codes() -> Outcome {
    let bench = Bench::new()?;
    let ended = |options: &[&str],
                 program: &[&str]|
     -> Result<(Option<i32>, Option<i32>, String), Failed> {
        let Output { status, stderr, .. } = output(bench.lines(options).args(program))?;
        Ok((status.code(), status.signal(), text(&stderr)))
    };
    let said = |(code, _, said): (Option<i32>, Option<i32>, String), should: i32, what: &str| {
        if code == Some(should) && said.contains(what) {
            return Ok(());
        }
        Err(Failed::from(format!("ended with {code:?} and said {said}")))
    };
    same("code", ended(&[], &["sh", "-c", "exit 7"])?.0, Some(7))?;
    same("signal", ended(&[], &["sh", "-c", "kill -9 $$"])?.1, Some(9))?;
    same("signal", ended(&[], &["sh", "-c", "kill -SEGV $$"])?.1, Some(11))?;
    said(ended(&[], &["./nothing"])?, 127, "there is no program ./nothing")?;
    said(ended(&[], &["/"])?, 126, "cannot run /")?;
    said(ended(&["--pty", "none.pty"], &["true"])?, 2, "there is no terminal none.pty")?;
    said(ended(&["--pty", "/dev/null"], &["true"])?, 2, "is not a pseudo-terminal")?;
    said(ended(&["--pty", "none"], &["true"])?, 2, "leave --pty out")?;
    said(ended(&["--model", "smcu"], &["true"])?, 2, "--serve")?;
    said(ended(&["--serve", "--count", "2"], &["true"])?, 2, "--count")?;
    let pty = bench.path("another.pty").display().to_string();
    let model = ["--serve", "--pty", &pty, "--model", "none"];
    said(ended(&model, &["touch", "started"])?, 2, "there is no model `none`")?;
    same("nothing was started", bench.path("started").exists(), false)?;
    let vimc4 = env!("CARGO_BIN_EXE_vimc4");
    said(ended(&[], &[vimc4, "lines", "true"])?, 2, "there can be only one")
}

/// What the program has started keeps its lines when it has ended.
fn the_last_one_puts_the_light_out() -> Outcome {
    let bench = Bench::new()?;
    let program = bench.made("requests", &[])?;
    let script = format!("(sleep 5.5; {} vimc4.pty > late.txt) & exit 4", program.display());
    let Output { status, stderr, .. } =
        output(bench.lines(&["--lines", "loop"]).args(["sh", "-c", &script]))?;
    same("ended", status.code(), Some(4))?;
    same("late", fs::read_to_string(bench.path("late.txt"))?.as_str(), ANSWERS)?;
    let said = text(&stderr);
    if !said.contains("sh has ended; what it has started goes on") {
        return Err(format!("it said {said:?}").into());
    }
    Ok(())
}

/// The controller is started anew under the same name while the program runs.
fn the_link_leads_elsewhere() -> Outcome {
    let mut bench = Bench::new()?;
    let program = bench.made("requests", &[])?;
    let script = format!(
        "{0} vimc4.pty && touch first && while ! [ -e again ]; do sleep 0.05; done; {0} vimc4.pty",
        program.display()
    );
    let mut command = bench.lines(&["--lines", "loop"]);
    command.args(["sh", "-c", &script]).stdin(Stdio::null()).stdout(Stdio::piped());
    let mut child = command.start()?;
    until("the first conversation", || bench.path("first").exists());
    // Another terminal takes the number of the old one.
    bench.emulator = None;
    let _other = Emulator::builder().pty(true).start()?;
    bench.serve()?;
    fs::write(bench.path("again"), "")?;
    let said = rest(Timed::new("standard output", child.stdout.take().ok_or("no output")?))?;
    same("ended", child.wait_in_time()?.code(), Some(0))?;
    // The settings of the port are those of the name, and stay.
    let second = said.strip_prefix(ANSWERS).ok_or("the first conversation is wrong")?;
    same("second", second.lines().next(), ANSWERS.lines().next())
}

// --- with a controller of its own ---

/// A host that polls CTS fills the command buffer and loses nothing.
fn a_buffer_shows_on_cts() -> Outcome {
    let folder = tempfile::tempdir()?;
    let run = |client: &str| -> Result<Output, Failed> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
        command.args(["lines", "--serve", "--model", "smcu", "--time", "8x", "-v", "--"]);
        command.arg(std::env::current_exe()?).arg("./vimc4.pty").env(CLIENT, client);
        let output = output(command.current_dir(folder.path()))?;
        same("what is left", fs::read_dir(folder.path())?.count(), 0)?;
        Ok(output)
    };
    let heeding = run("heeds CTS")?;
    let (said, told) = (text(&heeding.stdout), text(&heeding.stderr));
    same("said", said.as_str(), "held back true, answered 500\n")?;
    if told.contains("lost") || !told.contains("pty: the host has switched RTS off") {
        return Err(told.into());
    }
    // What was lost is not answered.
    let blind = text(&run("heeds nothing")?.stdout);
    same("without a look at CTS", blind.starts_with("held back false, answered "), true)?;
    same("something is lost", blind.ends_with(" 500\n"), false)
}

/// The program of [`a_buffer_shows_on_cts`].
fn filling_client(link: &str, heeds: bool) -> serialport::Result<()> {
    const COMMANDS: usize = 500;
    let mut port = serialport::new(link, 9_600)
        .timeout(Duration::from_secs(if heeds { 10 } else { 1 }))
        .open()?;
    port.write_data_terminal_ready(true)?;
    let mut reader = port.try_clone()?;
    let answers = thread::spawn(move || {
        let (mut count, mut byte) = (0, [0]);
        while count < COMMANDS && reader.read_exact(&mut byte).is_ok() {
            count += usize::from(byte == *b"C");
        }
        count
    });
    let mut held_back = false;
    for _ in 0..COMMANDS {
        while heeds && !port.read_clear_to_send()? {
            held_back = true;
            thread::sleep(Duration::from_millis(1));
        }
        port.write_all(b"PR10,0;")?;
    }
    port.write_request_to_send(false)?;
    println!("held back {held_back}, answered {}", joined("the end of the answers", answers));
    Ok(())
}

/// START at the panel of an IMC4-M arrives at the line that its profile names.
fn start_shows_on_a_line() -> Outcome {
    let folder = tempfile::tempdir()?;
    let model = vimc4::model_profile("imc4-m").map_err(|error| error.to_string())?;
    let wired = model.replace("[line]", "[line]\nstart_line = \"dsr\"");
    fs::write(folder.path().join("wired.toml"), wired)?;
    let hand = "[[rule]]\nevery = \"20ms\"\ndo = \"hold start for 10ms\"\n";
    fs::write(folder.path().join("hand.toml"), hand)?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
    command.args(["lines", "--serve", "--model", "wired.toml", "--scenario", "hand.toml", "--"]);
    command.arg(std::env::current_exe()?).arg("./vimc4.pty").env(CLIENT, "watches START");
    let output = output(command.current_dir(folder.path()))?;
    eprint!("{}", text(&output.stderr));
    same("said", text(&output.stdout).as_str(), "START pressed, released, pressed\n")
}

/// The program of [`start_shows_on_a_line`]: it ends when DSR has changed often enough.
fn watching_client(link: &str) -> serialport::Result<()> {
    let mut port = serialport::new(link, 19_200).open()?;
    let mut see = |on: bool| -> serialport::Result<()> {
        while port.read_data_set_ready()? != on {
            thread::yield_now();
        }
        Ok(())
    };
    see(false)?;
    see(true)?;
    see(false)?;
    see(true)?;
    println!("START pressed, released, pressed");
    Ok(())
}

// --- jobs ---

fn jobs() -> Outcome {
    let bench = Bench::new()?;
    let vimc4 = env!("CARGO_BIN_EXE_vimc4");
    for script in ["jobs.py", "again.py"] {
        succeeds(Command::new("python3").arg(source(script)).arg(vimc4).arg(bench.link()))?;
    }
    Ok(())
}

fn has(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status_in_time().is_ok_and(|status| status.success())
}

/// Whether programs of this kind can be made.
fn makes(options: &[&str]) -> bool {
    let Ok(folder) = tempfile::tempdir() else { return false };
    let (source, program) = (folder.path().join("x.c"), folder.path().join("x"));
    let mut cc = Command::new("cc");
    cc.args(options).arg("-o").arg(program).arg(&source).stderr(Stdio::null());
    fs::write(&source, "#include <stdio.h>\nint main(void) { return puts(\"\") < 0; }\n").is_ok()
        && cc.status_in_time().is_ok_and(|status| status.success())
}

pub(super) fn main() -> ExitCode {
    if let Ok(client) = std::env::var(CLIENT) {
        let link = std::env::args().nth(1).unwrap_or_default();
        let done = match client.as_str() {
            "watches START" => watching_client(&link),
            client => filling_client(&link, client == "heeds CTS"),
        };
        return done.map_or_else(
            |error| {
                eprintln!("{error}");
                ExitCode::FAILURE
            },
            |()| ExitCode::SUCCESS,
        );
    }
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    let with = |there: bool, reason: &str, name: &str, body: fn() -> Outcome| {
        let name = if there { name.to_owned() } else { format!("{name} ({reason})") };
        Trial::test(name, body).with_ignored_flag(!there && !required)
    };
    let cc = makes(&[]);
    let python = has("python3", &["--version"])
        && has("bash", &["--version"])
        && has("pkill", &["--version"]);
    // 32-bit programs are those of x86.
    let narrow = cfg!(target_arch = "x86_64");
    let mut trials = vec![
        with(has("python3", &["-c", "import serial"]), "needs pyserial", "pyserial", pyserial),
        with(has("sh", &["-c", "command -v setserial"]), "needs setserial", "setserial", setserial),
        with(cc, "needs cc", "every request", || requests(&[])),
        with(
            makes(&["-static"]),
            "needs a static C library",
            "every request of a static program",
            || requests(&["-static"]),
        ),
        with(cc, "needs cc", "waiting for a line", waits),
        with(cc, "needs cc", "a storm", a_storm),
        with(cc, "needs cc", "nobody hangs", nobody_hangs),
        with(cc, "needs cc", "the last one puts the light out", the_last_one_puts_the_light_out),
        with(cc, "needs cc", "the link leads elsewhere", the_link_leads_elsewhere),
        Trial::test("exit codes", exit_codes),
        Trial::test("a buffer shows on CTS", a_buffer_shows_on_cts),
        Trial::test("START shows on a line", start_shows_on_a_line),
        with(python, "needs python3, bash and procps", "jobs", jobs),
    ];
    if narrow {
        let there = makes(&["-m32"]);
        trials.push(with(there, "needs gcc-multilib", "every request of a 32-bit program", || {
            requests(&["-m32"])
        }));
    }
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}
