//! A port as its client has it: TCP, a pseudo-terminal, or a serial port of this computer.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use serialport::{DataBits, FlowControl, Parity, SerialPort, StopBits};
use thiserror::Error;
use vimc4_device::escape;

use crate::failure::Failure;
use crate::here::here;

/// How long a TCP connection may take to come about.
const CONNECT: Duration = Duration::from_secs(5);
/// How often the reader of a serial port checks whether it is still wanted. Windows has whoever writes wait
/// until a read has ended, so that one lasts no longer than a few characters.
const LOOK: Duration = Duration::from_millis(if cfg!(windows) { 2 } else { 50 });
/// How long a port may refuse to take bytes before it counts as broken.
const WRITE: Duration = Duration::from_secs(5);
/// How many pieces wait until they are fetched. Beyond that the other end has to wait.
const WAITING: usize = 256;

/// An open port. A thread of its own reads it, so that bytes have the time of their arrival.
pub(crate) struct Port {
    name: String,
    link: Connection,
    news: Receiver<News>,
    sender: SyncSender<News>,
    /// An end was requested.
    interrupted: Arc<AtomicBool>,
    closed: Arc<AtomicBool>,
}

enum Connection {
    Tcp(TcpStream),
    Serial {
        port: Box<dyn SerialPort>,
        /// Bits per second; a pseudo-terminal takes any and knows none.
        baud: Option<u32>,
    },
}

/// The lines that the other end switches.
pub(crate) enum ModemLines {
    /// There is none.
    None,
    /// They are so.
    Are([(&'static str, bool); 4]),
    /// TCP has no place for them.
    Unasked,
}

/// What happens at a port.
enum News {
    Bytes(Instant, Vec<u8>),
    Gone(String),
    Woken,
}

/// Why a port cannot be opened.
#[derive(Debug, Error)]
#[error("cannot open {name}: {what}; {remedy}")]
pub(crate) struct OpenError {
    name: String,
    what: String,
    remedy: &'static str,
}

/// Why nothing more can be done at a port.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(crate) enum PortError {
    /// The other end, or the adapter, is not there any more.
    #[error("{0}")]
    Gone(String),
    /// An end was requested.
    #[error("interrupted")]
    Interrupted,
}

/// The speed of a port: the given one, or else this one. A TCP connection has none.
///
/// # Errors
///
/// If a speed is given for a TCP connection.
pub(crate) fn speed(name: &str, given: Option<u32>, usual: u32) -> Result<u32, Failure> {
    match (tcp_address(name), given) {
        (Some(_), Some(_)) => Err(Failure::usage(format!(
            "--baud has no effect on {name}, which is TCP; leave it out"
        ))),
        _ => Ok(given.unwrap_or(usual)),
    }
}

impl Port {
    /// Opens `tcp:HOST:PORT`, `HOST:PORT`, a pseudo-terminal or a serial port. A serial port
    /// gets this speed, 8N1 and no flow control.
    pub(crate) fn open(name: &str, baud: u32) -> Result<Port, OpenError> {
        let (sender, news) = sync_channel(WAITING);
        let interrupted = Arc::new(AtomicBool::new(false));
        let closed = Arc::new(AtomicBool::new(false));
        let error = |what: String, remedy| OpenError { name: name.to_owned(), what, remedy };
        let no_thread = |e: io::Error| error(e.to_string(), "the limit of threads may be too low");
        let link = match tcp_address(name) {
            Some(address) => {
                let stream =
                    connect(address).map_err(|(e, remedy)| error(e.to_string(), remedy))?;
                let reader = stream.try_clone().map_err(no_thread)?;
                read(reader, &sender, &closed).map_err(no_thread)?;
                Connection::Tcp(stream)
            }
            None => {
                let port = serialport::new(name, baud)
                    .data_bits(DataBits::Eight)
                    .parity(Parity::None)
                    .stop_bits(StopBits::One)
                    .flow_control(FlowControl::None)
                    .timeout(LOOK)
                    .open();
                let wrong = |e: &serialport::Error| match names_port(name) {
                    true if !may_be_there(name) => "this is not an address".to_owned(),
                    _ => e.to_string(),
                };
                let port = port.map_err(|e| error(wrong(&e), remedy(name, &e)))?;
                let reader = port.try_clone();
                let reader = reader.map_err(|e| error(e.to_string(), remedy(name, &e)))?;
                read(reader, &sender, &closed).map_err(no_thread)?;
                Connection::Serial { port, baud: (!is_pseudo(name)).then_some(baud) }
            }
        };
        Ok(Port { name: name.to_owned(), link, news, sender, interrupted, closed })
    }

    /// The name it was opened by.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Its speed, if it is a line that has one.
    pub(crate) fn baud(&self) -> Option<u32> {
        match &self.link {
            Connection::Serial { baud, .. } => *baud,
            Connection::Tcp(_) => None,
        }
    }

    /// How its modem lines are.
    pub(crate) fn modem_lines(&mut self) -> ModemLines {
        let Connection::Serial { port, .. } = &mut self.link else { return ModemLines::Unasked };
        let mut lines = || -> serialport::Result<[(&'static str, bool); 4]> {
            Ok([
                ("CTS", port.read_clear_to_send()?),
                ("DSR", port.read_data_set_ready()?),
                ("DCD", port.read_carrier_detect()?),
                ("RI", port.read_ring_indicator()?),
            ])
        };
        lines().map_or(ModemLines::None, ModemLines::Are)
    }

    /// Gives a line that has a speed another one.
    pub(crate) fn set_baud(&mut self, new: u32) -> Result<(), PortError> {
        if let Connection::Serial { port, baud: baud @ Some(_) } = &mut self.link {
            port.set_baud_rate(new).map_err(|error| PortError::Gone(error.to_string()))?;
            *baud = Some(new);
        }
        Ok(())
    }

    /// What makes [`next`](Port::next) end with [`PortError::Interrupted`] when it is called,
    /// from any thread.
    pub(crate) fn interrupter(&self) -> impl Fn() + Send + 'static {
        let (interrupted, wake) = (Arc::clone(&self.interrupted), self.waker());
        move || {
            interrupted.store(true, Ordering::Relaxed);
            wake();
        }
    }

    /// What makes [`next`](Port::next) return at once, without anything, when it is called from
    /// any thread.
    pub(crate) fn waker(&self) -> impl Fn() + Send + 'static {
        let sender = self.sender.clone();
        // If the queue is full, the reader is awake anyway.
        move || drop(sender.try_send(News::Woken))
    }

    /// What writes to it from another thread, as much as it takes at a time.
    pub(crate) fn writer(&self) -> Option<Box<dyn Write + Send>> {
        Some(match &self.link {
            Connection::Tcp(stream) => Box::new(stream.try_clone().ok()?),
            Connection::Serial { port, .. } => Box::new(port.try_clone().ok()?),
        })
    }

    /// What sends bytes from another thread, beside what is sent here.
    pub(crate) fn sideways(&self) -> Option<impl FnMut(&[u8]) + Send + 'static> {
        let mut writer = self.writer()?;
        Some(move |bytes: &[u8]| drop(writer.write_all(bytes)))
    }

    /// Whether what is behind it is surely virtual: a pseudo-terminal, or this computer.
    pub(crate) fn is_virtual(&self) -> bool {
        match &self.link {
            Connection::Tcp(stream) => stream.peer_addr().is_ok_and(|peer| peer.ip().is_loopback()),
            Connection::Serial { baud, .. } => baud.is_none(),
        }
    }

    /// Sends all of these bytes.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> Result<(), PortError> {
        let gone = |error: io::Error| PortError::Gone(error.to_string());
        let port = match &mut self.link {
            Connection::Tcp(stream) => return stream.write_all(bytes).map_err(gone),
            Connection::Serial { port, .. } => port,
        };
        let begun = Instant::now();
        let mut rest = bytes;
        while !rest.is_empty() {
            match port.write(rest) {
                Ok(written) => rest = &rest[written..],
                Err(error) if waits(&error) && begun.elapsed() < WRITE => {}
                Err(error) => return Err(gone(error)),
            }
        }
        Ok(())
    }

    /// What arrives next, and when; `None` if nothing does until then, or if it is woken.
    pub(crate) fn next(&mut self, until: Instant) -> Result<Option<(Instant, Vec<u8>)>, PortError> {
        if self.interrupted.swap(false, Ordering::Relaxed) {
            return Err(PortError::Interrupted);
        }
        let left = until.saturating_duration_since(Instant::now());
        match self.news.recv_timeout(left) {
            Ok(News::Bytes(at, bytes)) => Ok(Some((at, bytes))),
            Ok(News::Gone(why)) => Err(PortError::Gone(why)),
            Ok(News::Woken) if self.interrupted.swap(false, Ordering::Relaxed) => {
                Err(PortError::Interrupted)
            }
            Ok(News::Woken) => Ok(None),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            // The port holds a sender of its own.
            Err(RecvTimeoutError::Disconnected) => Err(PortError::Gone("closed".to_owned())),
        }
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        self.closed.store(true, Ordering::Relaxed);
        if let Connection::Tcp(stream) = &self.link {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
}

/// Whether a name means TCP.
pub(crate) fn is_tcp(name: &str) -> bool {
    tcp_address(name).is_some()
}

/// Whether a name is most likely that of a port, whether or not it can be opened.
pub(crate) fn looks_like_one(name: &str) -> bool {
    let is_com = |(com, number): (&str, &str)| {
        let digits = number.bytes().all(|byte| byte.is_ascii_digit());
        com.eq_ignore_ascii_case("COM") && digits && !number.is_empty()
    };
    is_tcp(name)
        || name.starts_with(['.', '/', '~', '\\'])
        || name.split_at_checked(3).is_some_and(is_com)
        || Path::new(name).exists()
}

/// The address behind a name that means TCP.
fn tcp_address(name: &str) -> Option<&str> {
    if let Some(address) = name.strip_prefix("tcp:") {
        return Some(address);
    }
    let (host, port) = name.rsplit_once(':')?;
    let is_path = name.contains(['/', '\\']) || Path::new(name).exists();
    (!is_path && !host.is_empty() && port.parse::<u16>().is_ok()).then_some(name)
}

fn connect(address: &str) -> Result<TcpStream, (io::Error, &'static str)> {
    let help = "write host:port, as in 127.0.0.1:4004";
    let mut last = (io::Error::new(ErrorKind::NotFound, "the host has no address"), help);
    for address in address.to_socket_addrs().map_err(|error| (error, help))? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => {
                let ready = stream.set_nodelay(true);
                let ready = ready.and_then(|()| stream.set_write_timeout(Some(WRITE)));
                return ready.map(|()| stream).map_err(|error| (error, "try again"));
            }
            Err(error) => {
                let nobody = error.kind() == ErrorKind::ConnectionRefused;
                let remedy = match nobody {
                    true => "nothing listens there: start `vimc4 serve`, or check the port number",
                    false => "check the address, and that the network leads there",
                };
                last = (error, remedy);
            }
        }
    }
    Err(last)
}

/// What to do about a serial port that does not open.
fn remedy(name: &str, error: &serialport::Error) -> &'static str {
    let exists = may_be_there(name);
    match error.kind() {
        serialport::ErrorKind::Io(ErrorKind::PermissionDenied) if is_pseudo(name) => {
            "you may not use it: start the emulator, or this, as the same user"
        }
        serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
            "you may not use it: on Linux, join the group `dialout` and log in again"
        }
        _ if !exists && Path::new(name).is_symlink() => {
            "the link leads nowhere: the emulator that made it has ended"
        }
        _ if !exists && name.contains("://") => {
            "write host:port alone, as in 127.0.0.1:4004: the line is raw TCP"
        }
        _ if !exists && names_port(name) => {
            "write HOST:PORT, the port from 1 to 65535, as in 127.0.0.1:4004"
        }
        _ if !exists => here!(
            "name a serial port such as /dev/ttyUSB0 or COM3, the link of a pseudo-terminal such \
             as ./vimc4.pty, or host:port",
            "name a serial port such as COM3, or host:port"
        ),
        serialport::ErrorKind::NoDevice if cfg!(windows) => {
            "`mode` lists the serial ports; one that another program has open cannot be opened: close \
             that program"
        }
        serialport::ErrorKind::NoDevice | serialport::ErrorKind::Io(_) => {
            "another program may have it open: close that one; or it is not a serial port"
        }
        _ => "check that it is a serial port",
    }
}

/// Whether there may be a port of this name. Those of Windows are no files.
fn may_be_there(name: &str) -> bool {
    Path::new(name).exists() || cfg!(windows) && !name.contains(':')
}

/// Whether a name is more like an address than like a path, although it is none.
fn names_port(name: &str) -> bool {
    name.contains(':') && !name.contains(['/', '\\'])
}

/// Whether a path is a pseudo-terminal, where the speed means nothing.
fn is_pseudo(name: &str) -> bool {
    let path = Path::new(name).canonicalize();
    let names = ["/dev/pts/", "/dev/ttys"];
    path.is_ok_and(|path| names.iter().any(|name| path.to_string_lossy().starts_with(name)))
}

/// Whether an error only says that it takes longer.
fn waits(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// How a controller of `vimc4 serve` begins to tell a client that another one holds its line.
const REFUSAL: &[u8] = b"refused: ";

/// Reads in a thread of its own until the port is closed or gone.
fn read(
    mut source: impl Read + Send + 'static,
    sender: &SyncSender<News>,
    closed: &Arc<AtomicBool>,
) -> io::Result<()> {
    let (sender, closed) = (sender.clone(), Arc::clone(closed));
    let reader = move || {
        let mut buffer = [0; 1_024];
        let mut is_first = true;
        while !closed.load(Ordering::Relaxed) {
            let news = match source.read(&mut buffer) {
                Ok(0) => News::Gone("the other end has closed it".to_owned()),
                Ok(count) if is_first && buffer[..count].starts_with(REFUSAL) => {
                    News::Gone(escape(buffer[..count].trim_ascii()))
                }
                Ok(count) => {
                    is_first = false;
                    News::Bytes(Instant::now(), buffer[..count].to_vec())
                }
                Err(error) if waits(&error) => continue,
                Err(error) => News::Gone(error.to_string()),
            };
            let over = matches!(news, News::Gone(_));
            if sender.send(news).is_err() || over {
                return;
            }
        }
    };
    thread::Builder::new().name("port".to_owned()).spawn(reader).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_ports() {
        assert_eq!(tcp_address("tcp:localhost:4004"), Some("localhost:4004"));
        assert_eq!(tcp_address("127.0.0.1:4004"), Some("127.0.0.1:4004"));
        assert_eq!(tcp_address("[::1]:4004"), Some("[::1]:4004"));
        for serial in ["/dev/ttyUSB0", "COM3", "./vimc4.pty", "./a:1", r"\\.\COM12", ":4004"] {
            assert_eq!(tcp_address(serial), None, "{serial}");
        }
    }
}
