//! A server in a process of its own.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use super::failure::{Doing, Failure, Outcome};
use super::port::{Terminal, Wire};
use super::usage::{Memory, Usage};

/// A running server, killed when it is dropped.
pub(crate) struct Server {
    child: Child,
    tcp: Vec<SocketAddr>,
    pty: Vec<PathBuf>,
}

impl Server {
    /// Starts a server and waits until it says that it is ready. Its standard input stays open, as
    /// in a terminal without input.
    pub(crate) fn start(mut command: Command) -> Outcome<Server> {
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let program = Path::new(command.get_program()).display().to_string();
        let mut child = command.spawn().doing(format!("start {program}"))?;
        let out = child.stdout.take().doing("read what the server says")?;
        let mut server = Server { child, tcp: Vec::new(), pty: Vec::new() };
        for line in BufReader::new(out).lines() {
            let line = line.doing("read what the server says")?;
            if line == "ready" {
                return Ok(server);
            }
            // `tcp 127.0.0.1:4004`, with a number in front if there are several.
            let mut words = line.rsplit(' ');
            match (words.next(), words.next()) {
                (Some(place), Some("tcp")) => {
                    server.tcp.push(place.parse().doing(format!("understand `{line}`"))?);
                }
                (Some(place), Some("pty")) => server.pty.push(PathBuf::from(place)),
                _ => {
                    return Err(Failure::new(format!(
                        "{program} says `{line}` before it is ready"
                    )));
                }
            }
        }
        Err(Failure::new(format!("{program} ends before it is ready")))
    }

    /// Connects to the first TCP port.
    pub(crate) fn connect(&self) -> Outcome<Wire> {
        Wire::connect(self.address()?)
    }

    /// Where the first TCP port is.
    pub(crate) fn address(&self) -> Outcome<SocketAddr> {
        self.tcp.first().copied().doing("connect: the server has no TCP port")
    }

    /// Where all TCP ports are, in the order of the controllers.
    pub(crate) fn addresses(&self) -> &[SocketAddr] {
        &self.tcp
    }

    /// Opens the first pseudo-terminal.
    pub(crate) fn open(&self) -> Outcome<Terminal> {
        Terminal::open(self.pty.first().doing("open: the server has no pseudo-terminal")?)
    }

    /// The links to all pseudo-terminals.
    pub(crate) fn links(&self) -> &[PathBuf] {
        &self.pty
    }

    /// What it has used so far.
    pub(crate) fn usage(&self) -> Outcome<Usage> {
        Usage::of(self.child.id())
    }

    /// The memory it has.
    pub(crate) fn memory(&self) -> Outcome<Memory> {
        Memory::of(self.child.id())
    }

    /// Asks it to end with SIGTERM, and says how long that took.
    pub(crate) fn terminate(mut self) -> Outcome<Duration> {
        let process = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        let process = process.doing("find the server's process")?;
        let began = Instant::now();
        kill_process(process, Signal::TERM).doing("end the server")?;
        self.child.wait().doing("wait for the server's end")?;
        Ok(began.elapsed())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // One that has ended already is only waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
