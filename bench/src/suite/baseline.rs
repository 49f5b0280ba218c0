//! The bare servers that the emulator is compared with: an echo over TCP and an echo over a
//! pseudo-terminal, with nothing between the reading and the writing.
//!
//! They answer what they have read, the least that a server can do, and say where they are in
//! the words of `vimc4 serve`.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::runtime;
use tokio_serial::{SerialPort, SerialStream};

use super::failure::{Doing, Failure, Outcome};

/// The first argument that makes this program a baseline; the second says which.
pub(crate) const COMMAND: &str = "baseline";

/// How much is read at once, more than the emulator reads.
const CHUNK: usize = 4_096;

/// Runs a baseline until its process is killed.
pub(crate) fn run(which: Option<&str>) -> Outcome<()> {
    let runtime = runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.doing("wait for events")?;
    match which {
        Some("tcp") => runtime.block_on(echo_over_tcp()).doing("echo over TCP"),
        Some("pty") => runtime.block_on(echo_over_pty()).doing("echo over a pseudo-terminal"),
        _ => Err(Failure::new("there is no such baseline; there are tcp and pty")),
    }
}

async fn echo_over_tcp() -> io::Result<()> {
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    announce(&format!("tcp {}", listener.local_addr()?))?;
    loop {
        let (stream, _) = listener.accept().await?;
        stream.set_nodelay(true)?;
        // A client that leaves, however it does so, is no reason to end.
        drop(tokio::spawn(echo(stream)));
    }
}

async fn echo_over_pty() -> io::Result<()> {
    const O_NOCTTY: i32 = 0o400;
    let (near, far) = SerialStream::pair()?;
    let path = far.name().unwrap_or_default();
    // Held open, so that the near end never ends, but not by the reactor, which would wake up
    // for everything that arrives at the client's end.
    let _kept = OpenOptions::new().read(true).write(true).custom_flags(O_NOCTTY).open(&path)?;
    drop(far);
    announce(&format!("pty {path}"))?;
    echo(near).await
}

/// Answers what it reads until the client leaves.
async fn echo(mut line: impl AsyncRead + AsyncWrite + Unpin) -> io::Result<()> {
    let mut buffer = [0; CHUNK];
    loop {
        let count = line.read(&mut buffer).await?;
        if count == 0 {
            return Ok(());
        }
        line.write_all(&buffer[..count]).await?;
    }
}

/// Says where the server is, in one write.
fn announce(place: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(format!("{place}\nready\n").as_bytes())?;
    out.flush()
}
