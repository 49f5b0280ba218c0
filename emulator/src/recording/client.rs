//! Where host software finds the tap: a pseudo-terminal, or an address.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::Duration;

use bytes::Bytes;

use super::bridge::{Place, Tap};
use crate::failure::Failure;

#[cfg(unix)]
pub(super) use terminal::Terminal;

/// How much is read at once.
const PIECE: usize = 4_096;

/// How long a newcomer waits for the end of the client that holds the line before it is refused: one
/// that closes and connects again at once overtakes its own end.
const GRACE: Duration = Duration::from_millis(100);

/// Listens at an address.
pub(super) fn listen(address: &str) -> Result<TcpListener, Failure> {
    TcpListener::bind(address).map_err(|error| {
        Failure::usage(format!(
            "cannot listen on {address}: {error}; name another address, or port 0 for a free one"
        ))
    })
}

/// Serves one client after the other, and refuses every other while there is one.
pub(super) fn serve(listener: TcpListener, tap: &Arc<Tap>) -> io::Result<()> {
    let tap = Arc::clone(tap);
    let transport: Arc<str> = Arc::from(format!("tcp {}", listener.local_addr()?));
    let serve = move || {
        for client in listener.incoming().flatten() {
            let name = client.peer_addr().map_or_else(|_| String::new(), |peer| peer.to_string());
            let place = Place { transport: Arc::clone(&transport), client: Arc::from(name) };
            let tap = Arc::clone(&tap);
            // An error of one client does not affect others.
            let _ = thread::Builder::new().name("tcp".to_owned()).spawn(move || {
                let _ = attend(&tap, &place, client);
            });
        }
    };
    thread::Builder::new().name("tcp".to_owned()).spawn(serve).map(drop)
}

fn attend(tap: &Tap, place: &Place, mut client: TcpStream) -> io::Result<()> {
    client.set_nodelay(true)?;
    let waits = tap.is_held();
    let Some(said) = tap.hold(place, GRACE) else { return Ok(()) };
    let first = if waits { read_all(&mut client) } else { Ok(Some(Vec::new())) };
    let done = match first {
        Ok(Some(first)) => {
            tap.client_says(place, &first);
            converse(tap, place, client, said)
        }
        // Nothing is passed on of a client that has left before its turn came.
        Ok(None) => Ok(()),
        Err(error) => Err(error),
    };
    tap.release();
    done
}

/// What a client has sent so far; `None` if it has left.
fn read_all(client: &mut TcpStream) -> io::Result<Option<Vec<u8>>> {
    let mut first = Vec::new();
    client.set_nonblocking(true)?;
    let read = client.take(PIECE as u64).read_to_end(&mut first);
    client.set_nonblocking(false)?;
    match read {
        Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(Some(first)),
        Err(error) => Err(error),
        // It has sent more than any client sends before the first answer.
        Ok(count) => Ok((count == PIECE).then_some(first)),
    }
}

fn converse(
    tap: &Tap,
    place: &Place,
    mut client: TcpStream,
    said: Receiver<Bytes>,
) -> io::Result<()> {
    let mut writer = client.try_clone()?;
    thread::Builder::new().name("tcp".to_owned()).spawn(move || {
        while let Ok(bytes) = said.recv() {
            if writer.write_all(&bytes).is_err() {
                return;
            }
        }
    })?;
    let mut buffer = [0; PIECE];
    loop {
        match client.read(&mut buffer)? {
            0 => return Ok(()),
            count => tap.client_says(place, buffer.get(..count).unwrap_or_default()),
        }
    }
}

#[cfg(not(unix))]
/// There are no pseudo-terminals on this system.
pub(super) enum Terminal {}

#[cfg(not(unix))]
impl Terminal {
    pub(super) fn place(&self) -> &std::path::Path {
        match *self {}
    }

    pub(super) fn serve(&self, _tap: &Arc<Tap>) -> io::Result<()> {
        match *self {}
    }
}

#[cfg(unix)]
mod terminal {
    use std::fs::File;
    use std::io::{self, Read, Write};
    use std::os::fd::AsFd;
    use std::path::{Path, PathBuf};
    use std::sync::Arc;
    use std::thread;
    use std::time::Duration;

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::fs::{Mode, OFlags, open};
    use rustix::io::{FdFlags, fcntl_setfd};
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
    use vimc4::PtyLink;

    use super::super::bridge::{Place, Tap};
    use super::PIECE;
    use crate::failure::Failure;

    /// How often to check whether the terminal has been opened. Nothing is lost until then.
    const LOOK: Duration = Duration::from_millis(5);

    /// A pseudo-terminal with a link that leads to it, removed when it is dropped.
    pub(crate) struct Terminal {
        near: File,
        link: PtyLink,
        place: PathBuf,
    }

    impl Terminal {
        /// Makes a raw terminal and a link to it.
        pub(crate) fn open(path: &Path, baud: u32) -> Result<Terminal, Failure> {
            PtyLink::check(path, false).map_err(Failure::usage)?;
            let made = pair(baud).map_err(|error| {
                Failure::usage(format!(
                    "cannot make a pseudo-terminal: {error}; is /dev/pts mounted?"
                ))
            });
            let (near, far) = made?;
            let link = PtyLink::create(path, &far, false).map_err(Failure::usage)?;
            let place = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
            Ok(Terminal { near, link, place })
        }

        /// Where it is found.
        pub(crate) fn place(&self) -> &Path {
            let _ = &self.link;
            &self.place
        }

        /// Passes bytes in threads of its own.
        pub(crate) fn serve(&self, tap: &Arc<Tap>) -> io::Result<()> {
            let (mut reader, tap) = (self.near.try_clone()?, Arc::clone(tap));
            let near = self.near.try_clone()?;
            let transport: Arc<str> = Arc::from(format!("pty {}", self.place.display()));
            let place = Place { transport, client: Arc::from("whoever has opened it") };
            let serve = move || {
                let mut buffer = [0; PIECE];
                let mut there = false;
                loop {
                    match reader.read(&mut buffer) {
                        Ok(count) if count > 0 => {
                            if !there && !tap.is_held() {
                                there = attend(&tap, &place, &near).is_ok_and(|holds| holds);
                            }
                            match there {
                                true => {
                                    let bytes = buffer.get(..count).unwrap_or_default();
                                    tap.client_says(&place, bytes);
                                }
                                false => tap.unsent(&place, count),
                            }
                        }
                        // No program has it open.
                        _ => {
                            if there {
                                tap.release();
                            }
                            while is_closed(&near) {
                                thread::sleep(LOOK);
                            }
                            there = attend(&tap, &place, &near).is_ok_and(|holds| holds);
                        }
                    }
                }
            };
            thread::Builder::new().name("pty".to_owned()).spawn(serve).map(drop)
        }
    }

    /// A program has it open, and gets the device's output, unless another client holds the line.
    fn attend(tap: &Tap, place: &Place, near: &File) -> io::Result<bool> {
        let mut writer = near.try_clone()?;
        let Some(said) = tap.hold(place, Duration::ZERO) else { return Ok(false) };
        let write = move || {
            while let Ok(bytes) = said.recv() {
                // An unplugged cable keeps nothing for the next client.
                if is_closed(&writer) || writer.write_all(&bytes).is_err() {
                    return;
                }
            }
        };
        thread::Builder::new().name("pty".to_owned()).spawn(write).map(|_| true)
    }

    fn is_closed(near: &File) -> bool {
        let mut looked = [PollFd::new(near, PollFlags::OUT)];
        let now = Timespec { tv_sec: 0, tv_nsec: 0 };
        poll(&mut looked, Some(&now)).is_ok() && looked[0].revents().contains(PollFlags::HUP)
    }

    fn pair(baud: u32) -> io::Result<(File, PathBuf)> {
        // Not every system takes CLOEXEC here.
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        fcntl_setfd(&near, FdFlags::CLOEXEC)?;
        grantpt(&near)?;
        unlockpt(&near)?;
        let name = ptsname(&near, Vec::new())?;
        let far = PathBuf::from(name.to_string_lossy().into_owned());
        // Raw, as a cable is; it stays so as long as the near end is open.
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let opened = open(&far, flags, Mode::empty())?;
        let mut settings = tcgetattr(opened.as_fd())?;
        settings.make_raw();
        // A speed that the system does not know makes no difference here.
        let _ = settings.set_speed(baud);
        tcsetattr(opened.as_fd(), OptionalActions::Now, &settings)?;
        Ok((File::from(near), far))
    }
}
