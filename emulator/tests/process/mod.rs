//! The program as a process of its own: started, talked to, waited for, and gone with its test.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::io::{BufRead, BufReader, Cursor, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

pub(crate) mod limits;

use limits::{InTime, LIMIT, Timed, end_of, joined};

pub(crate) const VIMC4: &str = env!("CARGO_BIN_EXE_vimc4");

/// The folder of the project.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// `vimc4` in a folder, with nothing on its standard input.
pub(crate) fn vimc4(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(VIMC4);
    command.args(arguments).current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Runs `vimc4` to its end: exit code, standard output, standard error.
pub(crate) fn run(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    said(vimc4(folder, arguments).output_in_time().unwrap())
}

/// The exit code of a run, its standard output and its standard error.
pub(crate) fn said(output: Output) -> (i32, String, String) {
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// What a page shows: each command line, and what it prints.
pub(crate) fn shown(page: &str) -> Vec<(&str, &str)> {
    let blocks = page.split("```console\n").skip(1);
    let shown = blocks.map(|block| block.split("```").next().unwrap());
    // The first line of a block is a command line.
    let examples = shown.flat_map(|block| block.strip_prefix("$ ").unwrap().split("\n$ "));
    examples.map(|example| example.split_once('\n').unwrap_or((example, ""))).collect()
}

/// Runs a command line in a folder, where `vimc4` is in `bin`.
pub(crate) fn shell(folder: &Path, line: &str) -> Output {
    let path = format!("{}:{}", folder.join("bin").display(), std::env::var("PATH").unwrap());
    Command::new("sh")
        .args(["-c", line])
        .current_dir(folder)
        .env("PATH", &path)
        .output_in_time()
        .unwrap()
}

/// A line that is never silent: it says `0` every few milliseconds to one client after the other.
pub(crate) struct Chatter {
    address: String,
    came: Receiver<()>,
    /// The longest pause in what each client was told.
    pauses: Receiver<Duration>,
}

impl Chatter {
    /// From the beginning, or once it is asked something.
    pub(crate) fn new(once_asked: bool) -> Chatter {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let (comes, came) = channel();
        let (pause, pauses) = channel();
        thread::spawn(move || {
            for mut client in listener.incoming().map(Result::unwrap) {
                let _ = comes.send(());
                if once_asked {
                    let _ = client.read(&mut [0; 9]);
                }
                let (mut longest, mut said) = (Duration::ZERO, Instant::now());
                while client.write_all(b"0").is_ok() {
                    longest = longest.max(said.elapsed());
                    said = Instant::now();
                    thread::sleep(Duration::from_millis(5));
                }
                let _ = pause.send(longest.max(said.elapsed()));
            }
        });
        Chatter { address, came, pauses }
    }

    /// Waits until the next client has come.
    pub(crate) fn comes(&self) {
        self.came.recv_timeout(LIMIT).expect("a client of the line");
    }

    /// Nothing wrong is found by a client. Where the computer had no time for the line, the client may
    /// have heard silence, and it is tried again.
    pub(crate) fn at(&self, mut found: impl FnMut(&str) -> Result<(), String>) {
        const SILENCE: Duration = Duration::from_millis(20);
        let mut is_fine = || {
            while self.came.try_recv().is_ok() {}
            let outcome = found(&self.address);
            let pause = self.pauses.recv_timeout(LIMIT).expect("the client of the line goes");
            outcome.inspect_err(|wrong| assert!(pause > SILENCE, "{wrong}")).is_ok()
        };
        let tried = (0..20).any(|_| is_fine());
        assert!(tried, "the computer is too busy for a line that is never silent");
    }
}

/// A client of a TCP port.
pub(crate) fn connect(address: &str) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    // Otherwise the system keeps back short messages that nothing answers.
    stream.set_nodelay(true).unwrap();
    stream
}

/// A client of a pseudo-terminal.
#[cfg(unix)]
pub(crate) fn terminal(path: impl AsRef<Path>) -> Timed<std::fs::File> {
    use std::os::unix::fs::OpenOptionsExt;
    let path = path.as_ref();
    // The test has no terminal after `setsid`, and would get this one, and SIGHUP when it closes.
    let flags = i32::try_from(rustix::fs::OFlags::NOCTTY.bits()).unwrap();
    let file = std::fs::File::options().read(true).write(true).custom_flags(flags).open(path);
    Timed::new(path.display().to_string(), file.unwrap())
}

/// Sends this and returns so many bytes of what comes back.
pub(crate) fn ask(stream: &mut (impl Read + Write), line: &str, count: usize) -> String {
    stream.write_all(line.as_bytes()).unwrap();
    let mut answer = vec![0; count];
    stream.read_exact(&mut answer).unwrap();
    String::from_utf8(answer).unwrap()
}

/// The TCP address of a controller, counted from 0, in the line that `vimc4 serve --json` prints.
pub(crate) fn tcp(ready: &Value, number: usize) -> &str {
    ready["controllers"][number]["tcp"].as_str().unwrap()
}

/// A process that does not outlive its test.
pub(crate) struct Process {
    pub(crate) child: Child,
    pub(crate) input: Option<Timed<ChildStdin>>,
    /// Taken by whatever reads it to its end.
    pub(crate) output: Option<BufReader<Timed<ChildStdout>>>,
}

impl Process {
    /// Starts it with pipes for standard input and output.
    pub(crate) fn start(command: &mut Command) -> Process {
        Process::of(command.stdin(Stdio::piped()).stdout(Stdio::piped()).start().unwrap())
    }

    /// A process with whatever pipes it has.
    pub(crate) fn of(mut child: Child) -> Process {
        let input = child.stdin.take().map(|pipe| Timed::new("standard input", pipe));
        let output = child.stdout.take().map(|pipe| Timed::new("standard output", pipe));
        let output = output.map(BufReader::new);
        Process { child, input, output }
    }

    /// `vimc4 serve` on a free port, and the line of JSON that says that it is ready.
    pub(crate) fn serve(folder: &Path, arguments: &[&str]) -> (Process, Value) {
        let mut command = vimc4(folder, &["serve", "--json"]);
        if !arguments.contains(&"--tcp") {
            command.args(["--tcp", "127.0.0.1:0"]);
        }
        let mut serve = Process::start(command.args(arguments));
        let ready = serde_json::from_str(&serve.line());
        assert!(ready.is_ok(), "{}", serve.end().1);
        (serve, ready.unwrap())
    }

    /// The next line of its standard output without its end, empty behind the last.
    pub(crate) fn line(&mut self) -> String {
        let mut line = String::new();
        self.output.as_mut().unwrap().read_line(&mut line).unwrap();
        line.trim_end_matches('\n').to_owned()
    }

    pub(crate) fn give(&mut self, text: &str) {
        self.input.as_mut().unwrap().write_all(text.as_bytes()).unwrap();
    }

    /// Gives it a line, and returns the line that it answers with.
    pub(crate) fn order(&mut self, order: &str) -> String {
        self.give(&format!("{order}\n"));
        self.line()
    }

    #[cfg(unix)]
    pub(crate) fn signal(&self, signal: rustix::process::Signal) {
        let process = rustix::process::Pid::from_child(&self.child);
        rustix::process::kill_process(process, signal).unwrap();
    }

    /// What it says on standard error, line by line.
    pub(crate) fn errors(&mut self) -> Receiver<String> {
        let errors = BufReader::new(self.child.stderr.take().unwrap());
        let (said, lines) = channel();
        thread::spawn(move || {
            errors.lines().map_while(Result::ok).try_for_each(|line| said.send(line))
        });
        lines
    }

    /// The messages of an editor's protocol that come on its standard output.
    pub(crate) fn messages(&mut self) -> Receiver<Value> {
        let output = self.output.take().unwrap();
        let begun = Cursor::new(output.buffer().to_vec());
        let mut output = BufReader::new(begun.chain(output.into_inner().into_inner()));
        let (said, messages) = channel();
        thread::spawn(move || {
            while let Some(message) = read_message(&mut output) {
                if said.send(message).is_err() {
                    return;
                }
            }
        });
        messages
    }

    /// Waits for its end.
    pub(crate) fn ended(&mut self) -> ExitStatus {
        end_of(&mut self.child, LIMIT).unwrap()
    }

    /// Waits for its end: the exit code, and what else it said on standard error.
    pub(crate) fn end(&mut self) -> (Option<i32>, String) {
        let lines = self.errors();
        let code = self.ended().code();
        (code, rest_of(&lines))
    }

    /// The same without more input, and with what else it said on standard output in the middle.
    pub(crate) fn finish(&mut self) -> (Option<i32>, String, String) {
        drop(self.input.take());
        let mut output = self.output.take().unwrap();
        let text = thread::spawn(move || {
            let mut text = String::new();
            output.read_to_string(&mut text).map(|_| text).unwrap()
        });
        let (code, errors) = self.end();
        (code, joined("the end of standard output", text), errors)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // What ends with its input may tidy up.
        drop(self.input.take());
        let _ = self.child.kill();
        let _ = end_of(&mut self.child, LIMIT);
    }
}

/// The rest of the lines until the program closes its standard error.
#[track_caller]
pub(crate) fn rest_of(lines: &Receiver<String>) -> String {
    let mut rest = String::new();
    loop {
        match lines.recv_timeout(LIMIT) {
            Ok(line) => rest += &(line + "\n"),
            Err(RecvTimeoutError::Disconnected) => return rest,
            Err(RecvTimeoutError::Timeout) => {
                panic!("waited for the end of standard error: {rest}")
            }
        }
    }
}

/// A message as editors frame it: its length, an empty line, JSON.
pub(crate) fn framed(message: &Value) -> String {
    let text = message.to_string();
    format!("Content-Length: {}\r\n\r\n{text}", text.len())
}

/// The next message; `None` at the end, and where it is framed otherwise.
pub(crate) fn read_message(from: &mut impl BufRead) -> Option<Value> {
    let mut header = String::new();
    from.read_line(&mut header).ok()?;
    from.read_line(&mut header).ok()?;
    let length = header.strip_prefix("Content-Length: ")?.strip_suffix("\r\n\r\n")?;
    let mut body = vec![0; length.parse().ok()?];
    from.read_exact(&mut body).ok()?;
    Some(serde_json::from_slice(&body).unwrap())
}

/// A pseudo-terminal whose far end has not been opened yet: the near end and the far end's name.
#[cfg(unix)]
pub(crate) fn pseudo_terminal() -> (std::os::fd::OwnedFd, String) {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    grantpt(&near).unwrap();
    unlockpt(&near).unwrap();
    let name = ptsname(&near, Vec::new()).unwrap().into_string().unwrap();
    (near, name)
}
