//! A controller, a folder, and programs that are run beside them.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use vimc4::{Emulator, Snapshot};

use super::process::limits::{EndsInTime, InTime};
use super::{GUIDE, Outcome};

/// What every client prints that has set the axes, moved 20,000 steps, stopped in between with
/// 253, gone on with `S` and read the position.
pub(crate) const CONVERSATION: &str = "0F00004E20000000000000";

const VIMC4: &str = env!("CARGO_BIN_EXE_vimc4");

/// Whether `vimc4 lines` can do here what it does.
pub(crate) fn has_lines() -> bool {
    has(&format!("cd \"$(mktemp -d)\" && {VIMC4} lines --serve -- true"))
}

/// How a program is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// To the pseudo-terminal.
    Terminal,
    /// To the pseudo-terminal, under `vimc4 lines`.
    Lines,
    /// By TCP.
    Tcp,
    /// By TCP as RFC 2217 has it, with settings and modem lines.
    Rfc2217,
}

impl Way {
    pub(crate) const ALL: [Way; 4] = [Way::Terminal, Way::Lines, Way::Tcp, Way::Rfc2217];

    /// The head of the column.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Way::Terminal => "terminal",
            Way::Lines => "`vimc4 lines`",
            Way::Tcp => "TCP",
            Way::Rfc2217 => "RFC 2217",
        }
    }
}

/// How long a program may take, all in all.
const LIMIT: Duration = Duration::from_secs(60);

/// How long something may take that happens at once.
const MOMENT: Duration = Duration::from_secs(20);

/// The folder with the programs of these tests.
pub(crate) fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/connect").join(name)
}

/// A controller in real time, on a pseudo-terminal and TCP, and a folder for everything else.
pub(crate) struct Bench {
    pub(crate) way: Way,
    /// Options of `vimc4 lines`.
    pub(crate) options: &'static str,
    emulator: Emulator,
    fresh: Snapshot,
    folder: tempfile::TempDir,
}

/// How a program ended.
pub(crate) struct Ended {
    pub(crate) success: bool,
    pub(crate) printed: String,
    /// What was said on standard error.
    pub(crate) said: String,
}

impl Bench {
    pub(crate) fn new(way: Way) -> Result<Bench, Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let link = folder.path().canonicalize()?.join("vimc4.pty");
        let builder = Emulator::builder().pty(link).tcp("127.0.0.1:0").rfc2217("127.0.0.1:0");
        let emulator = builder.start()?;
        let fresh = emulator.snapshot()?;
        Ok(Bench { way, options: "", emulator, fresh, folder })
    }

    /// The controller is again as it was before the first conversation.
    pub(crate) fn anew(&self) -> Outcome {
        Ok(self.emulator.restore(&self.fresh)?)
    }

    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The link of the pseudo-terminal.
    pub(crate) fn link(&self) -> String {
        self.folder().join("vimc4.pty").display().to_string()
    }

    /// Where TCP listens, with the settings of a port or without: `127.0.0.1:PORT`.
    pub(crate) fn address(&self) -> String {
        let address = match self.way {
            Way::Rfc2217 => self.emulator.rfc2217_addr(),
            _ => self.emulator.tcp_addr(),
        };
        address.map(|address| address.to_string()).unwrap_or_default()
    }

    /// Where a program connects to that takes either: the terminal's link or the address.
    pub(crate) fn place(&self) -> String {
        match self.way {
            Way::Terminal | Way::Lines => self.link(),
            Way::Tcp | Way::Rfc2217 => self.address(),
        }
    }

    /// A line of the shell that starts a program so that it is connected in this way.
    pub(crate) fn by_way(&self, line: &str) -> String {
        match self.way {
            Way::Lines => format!("{VIMC4} lines {} --pty {} -- {line}", self.options, self.link()),
            Way::Terminal | Way::Tcp | Way::Rfc2217 => line.to_owned(),
        }
    }

    /// What the guide prints, with this controller's link and port.
    pub(crate) fn here(&self, text: &str) -> String {
        let address = self.address();
        let port = address.rsplit(':').next().unwrap_or_default();
        let text = text.replace("/home/you/vimc4/vimc4.pty", &self.link()).replace("4004", port);
        // The only one that is not a part of its own name.
        text.replace(":2217", &format!(":{port}")).replace(",2217", &format!(",{port}"))
    }

    /// The only line of the guide that begins so, for this controller.
    pub(crate) fn recipe(&self, begins: &str) -> Result<String, String> {
        let mut lines = GUIDE.lines().filter(|line| line.starts_with(begins));
        match (lines.next(), lines.next()) {
            (Some(line), None) => Ok(self.here(line)),
            (None, _) => Err(format!("docs/connect.md has no line that begins with {begins}")),
            _ => Err(format!("docs/connect.md has several lines that begin with {begins}")),
        }
    }

    /// A command in the folder, with nothing of the user's settings.
    pub(crate) fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.current_dir(self.folder()).env("HOME", self.folder());
        command.env("TERM", "vt100").env("LC_ALL", "C").env_remove("PYTHONPATH");
        command
    }

    /// A command of the shell in the folder.
    pub(crate) fn shell(&self, line: &str) -> Command {
        let mut command = self.command("sh");
        command.arg("-c").arg(format!("exec {line}"));
        command
    }

    /// A program that connects, as the shell starts it.
    pub(crate) fn host(&self, line: &str) -> Command {
        self.shell(&self.by_way(line))
    }

    /// Runs a program to its end.
    pub(crate) fn run(&self, command: &mut Command) -> Result<Ended, Box<dyn std::error::Error>> {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut program =
            Program(command.start().map_err(|error| format!("{command:?}: {error}"))?);
        let printed = collect(program.0.stdout.take());
        let said = collect(program.0.stderr.take());
        let began = Instant::now();
        let status = loop {
            match program.0.try_wait()? {
                Some(status) => break status,
                None if began.elapsed() > LIMIT => {
                    let (printed, said) = (heard(&printed), heard(&said));
                    return Err(format!("{command:?} does not end:\n{printed}\n{said}").into());
                }
                None => thread::sleep(Duration::from_millis(10)),
            }
        };
        // What a program printed is complete when its pipes are closed.
        let closed = || Arc::strong_count(&printed) == 1 && Arc::strong_count(&said) == 1;
        until("the pipes of a program that has ended close", closed)?;
        let printed = heard(&printed).replace("\r\n", "\n");
        Ok(Ended { success: status.success(), printed, said: heard(&said) })
    }
}

impl Ended {
    /// It held the conversation, did what else was asked, and ended well.
    pub(crate) fn held(&self, and: &str) -> Outcome {
        let expected = format!("{CONVERSATION}\n{and}");
        match self.success && self.printed.trim_end() == expected.trim_end() {
            true => Ok(()),
            false => Err(format!("instead of {expected}\n{self}").into()),
        }
    }

    /// It held the conversation (or not), and failed for this reason.
    pub(crate) fn failed(&self, printed: &str, reason: &str) -> Outcome {
        let why = self.said.contains(reason) || self.printed.contains(reason);
        match !self.success && why && self.printed.trim_end().starts_with(printed) {
            true => Ok(()),
            false => Err(format!("instead of {printed} and {reason}\n{self}").into()),
        }
    }
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ended = if self.success { "well" } else { "badly" };
        write!(f, "it ended {ended} and printed:\n{}\n{}", self.printed, self.said)
    }
}

/// A program that does not outlive the test.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait_in_time();
    }
}

type Heard = Arc<Mutex<Vec<u8>>>;

fn heard(bytes: &Heard) -> String {
    let bytes = bytes.lock().map(|bytes| bytes.clone()).unwrap_or_default();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Collects what comes, until it ends.
fn collect(from: Option<impl Read + Send + 'static>) -> Heard {
    let bytes = Heard::default();
    let to = Arc::clone(&bytes);
    thread::spawn(move || {
        let mut piece = [0; 4096];
        let Some(mut from) = from else { return };
        while let Ok(count @ 1..) = from.read(&mut piece) {
            if let Ok(mut to) = to.lock() {
                to.extend_from_slice(&piece[..count]);
            }
        }
    });
    bytes
}

/// Waits until something is so.
pub(crate) fn until(what: &str, so: impl Fn() -> bool) -> Outcome {
    let began = Instant::now();
    while !so() {
        if began.elapsed() > MOMENT {
            return Err(format!("in vain: {what}").into());
        }
        thread::sleep(Duration::from_millis(10));
    }
    Ok(())
}

/// A program that someone types at.
pub(crate) struct Typed {
    // In this order: without its input a program ends by itself.
    keys: ChildStdin,
    shown: Heard,
    program: Program,
}

impl Typed {
    /// A program with pipes.
    pub(crate) fn at(command: &mut Command) -> Result<Typed, Box<dyn std::error::Error>> {
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut program =
            Program(command.start().map_err(|error| format!("{command:?}: {error}"))?);
        let keys = program.0.stdin.take().ok_or("no input")?;
        let shown = collect(program.0.stdout.take());
        Ok(Typed { keys, shown, program })
    }

    /// A program that wants a terminal of its own.
    pub(crate) fn on_a_screen(
        bench: &Bench,
        line: &str,
    ) -> Result<Typed, Box<dyn std::error::Error>> {
        Typed::at(bench.command("script").args(["-qefc", line, "/dev/null"]))
    }

    pub(crate) fn types(&mut self, keys: &[u8]) -> Outcome {
        self.keys.write_all(keys)?;
        Ok(self.keys.flush()?)
    }

    pub(crate) fn shown(&self) -> String {
        heard(&self.shown)
    }

    /// Waits until the program shows something.
    pub(crate) fn shows(&self, text: &str) -> Outcome {
        let so = || self.shown().contains(text);
        until(text, so).map_err(|_| format!("instead of {text}: {:?}", self.shown()).into())
    }

    /// Waits until the program has ended, and says whether it ended well.
    pub(crate) fn ends(mut self) -> Result<bool, Box<dyn std::error::Error>> {
        drop(self.keys);
        let began = Instant::now();
        while began.elapsed() < MOMENT {
            if let Some(status) = self.program.0.try_wait()? {
                return Ok(status.success());
            }
            thread::sleep(Duration::from_millis(10));
        }
        Err(format!("it does not end: {:?}", heard(&self.shown)).into())
    }

    /// Holds the conversation; what was shown before does not count.
    pub(crate) fn converses(&mut self) -> Outcome {
        let before = self.shown().len();
        // What is typed, after how many milliseconds, and how many bytes have come then.
        for (keys, pause, answers) in [
            (&b"@01\r"[..], 0, 1),
            (b"@0A20000,10000\r", 0, 1),
            (b"\xfd", 300, 2),
            (b"@0S\r", 0, 3),
            (b"@0P\r", 0, CONVERSATION.len()),
        ] {
            thread::sleep(Duration::from_millis(pause));
            self.types(keys)?;
            let so = || self.shown().len() >= before + answers;
            until("answer", so).map_err(|_| format!("{keys:?}: {:?}", self.shown()))?;
        }
        let shown = self.shown().split_off(before);
        if shown != CONVERSATION {
            return Err(format!("instead of {CONVERSATION}: {shown:?}").into());
        }
        Ok(())
    }
}

/// Whether a command of the shell succeeds.
pub(crate) fn has(command: &str) -> bool {
    let mut shell = Command::new("sh");
    shell.args(["-c", command]).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    shell.status_in_time().is_ok_and(|status| status.success())
}

/// Writes a file into the folder.
pub(crate) fn write(bench: &Bench, name: &str, text: &str) -> Outcome {
    Ok(fs::write(bench.folder().join(name), text)?)
}
