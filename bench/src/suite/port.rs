//! The client's end of a line: blocking sockets and terminals, the cheapest way.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::termios::{OptionalActions, SpecialCodeIndex, tcgetattr, tcsetattr};

use super::failure::{Doing, Failure, Outcome};

/// How long an answer may take before the measurement is given up.
pub(crate) const LIMIT: Duration = Duration::from_secs(10);

/// Reads where an isel controller is: the shortest question, 4 bytes, that is asked over and over.
pub(crate) const QUESTION: &[u8] = b"@0P\r";

/// The length of its answer to [`QUESTION`]: `0` and three axes.
pub(crate) const ANSWER: usize = 19;

/// Something that is asked, and how many bytes answer it.
pub(crate) type Question = (&'static [u8], usize);

/// Where an isel controller is.
pub(crate) const ISEL: Question = (QUESTION, ANSWER);

/// Where an LPKF controller at 0 is: `P0,0,0` and `C`, each with a CR.
pub(crate) const LPKF: Question = (b"!ON0;", 9);

/// What an echo says to [`QUESTION`].
pub(crate) const ECHO: Question = (QUESTION, QUESTION.len());

/// A TCP connection.
pub(crate) type Wire = Port<TcpStream>;

/// A pseudo-terminal.
pub(crate) type Terminal = Port<File>;

/// A line with a server at its other end. Reading gives up after [`LIMIT`].
pub(crate) struct Port<T>(T);

impl Wire {
    /// Connects, without delaying small packets.
    pub(crate) fn connect(address: SocketAddr) -> Outcome<Wire> {
        let connect = || {
            let stream = TcpStream::connect(address)?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(LIMIT))?;
            io::Result::Ok(stream)
        };
        connect().map(Port).doing(format!("connect to {address}"))
    }

    /// The connection itself.
    pub(crate) fn into_stream(self) -> TcpStream {
        self.0
    }
}

impl Terminal {
    /// Opens a terminal in raw mode.
    pub(crate) fn open(path: &Path) -> Outcome<Terminal> {
        const O_NOCTTY: i32 = 0o400;
        let open = || {
            let file =
                OpenOptions::new().read(true).write(true).custom_flags(O_NOCTTY).open(path)?;
            let mut settings = tcgetattr(&file)?;
            settings.make_raw();
            // Reading waits for the first byte, in tenths of a second.
            settings.special_codes[SpecialCodeIndex::VMIN] = 0;
            settings.special_codes[SpecialCodeIndex::VTIME] = (LIMIT.as_secs() * 10) as u8;
            tcsetattr(&file, OptionalActions::Now, &settings)?;
            io::Result::Ok(file)
        };
        open().map(Port).doing(format!("open {}", path.display()))
    }
}

impl<T: Read + Write> Port<T> {
    /// Sends bytes.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> Outcome<()> {
        self.0.write_all(bytes).doing("write to the line")
    }

    /// Reads what is there, at least one byte.
    pub(crate) fn receive(&mut self, buffer: &mut [u8]) -> Outcome<usize> {
        match self.0.read(buffer) {
            Ok(0) => Err(Failure::new("the server has closed the line, or does not answer")),
            Ok(count) => Ok(count),
            Err(error) => Err(Failure::new(format!("the server does not answer: {error}"))),
        }
    }

    /// Sends a question and waits until an answer of this length is there.
    pub(crate) fn ask(&mut self, question: &[u8], answer: usize) -> Outcome<()> {
        let mut buffer = [0; 64];
        let mut missing = answer;
        self.send(question)?;
        while missing > 0 {
            missing = missing.saturating_sub(self.receive(&mut buffer)?);
        }
        Ok(())
    }

    /// Asks a question over and over, and says how often in a second.
    pub(crate) fn ping(&mut self, (question, answer): Question, span: Duration) -> Outcome<f64> {
        let began = Instant::now();
        let mut rounds = 0.0;
        while began.elapsed() < span {
            // Looking at the clock less often costs the measurement less.
            for _ in 0..16 {
                self.ask(question, answer)?;
            }
            rounds += 16.0;
        }
        Ok(rounds / began.elapsed().as_secs_f64())
    }
}
