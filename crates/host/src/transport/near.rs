//! The controller's end of a pseudo-terminal.

use std::ffi::OsStr;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::PathBuf;
use std::task::{Context, Poll, ready};

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use tokio::io::unix::AsyncFd;

/// The controller's end of a pseudo-terminal, which a program that is started at the same moment
/// does not inherit.
#[derive(Debug)]
pub(super) struct Near(AsyncFd<OwnedFd>);

impl Near {
    /// A new pair: this end, and the path of the other. It must be called within a tokio runtime.
    pub(super) fn open() -> io::Result<(Near, PathBuf)> {
        let near = open()?;
        grantpt(&near)?;
        unlockpt(&near)?;
        let path = PathBuf::from(OsStr::from_bytes(ptsname(&near, Vec::new())?.as_bytes()));
        fcntl_setfl(&near, fcntl_getfl(&near)? | OFlags::NONBLOCK)?;
        #[expect(deprecated, reason = "an `OwnedFd` has its descriptor as long as it is there")]
        let near = AsyncFd::new(near)?;
        Ok((Near(near), path))
    }

    /// Asks the system, whether or not it has told of anything.
    pub(super) fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(rustix::io::read(&self.0, buffer)?)
    }

    /// As many of them as there is room for.
    pub(super) fn try_write(&self, bytes: &[u8]) -> io::Result<usize> {
        Ok(rustix::io::write(&self.0, bytes)?)
    }

    pub(super) fn poll_read(
        &self,
        cx: &mut Context<'_>,
        buffer: &mut [u8],
    ) -> Poll<io::Result<usize>> {
        loop {
            let mut ready = ready!(self.0.poll_read_ready(cx))?;
            if let Ok(read) = ready.try_io(|_| self.try_read(buffer)) {
                return Poll::Ready(read);
            }
        }
    }

    pub(super) fn poll_write(&self, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        loop {
            let mut ready = ready!(self.0.poll_write_ready(cx))?;
            if let Ok(written) = ready.try_io(|_| self.try_write(bytes)) {
                return Poll::Ready(written);
            }
        }
    }
}

/// Here there is no moment at which another program could inherit it.
#[cfg(any(
    target_os = "linux",
    target_os = "android",
    target_os = "freebsd",
    target_os = "netbsd"
))]
fn open() -> io::Result<OwnedFd> {
    Ok(openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?)
}

#[cfg(not(any(
    target_os = "linux",
    target_os = "android",
    target_os = "freebsd",
    target_os = "netbsd"
)))]
fn open() -> io::Result<OwnedFd> {
    let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    rustix::io::fcntl_setfd(&near, rustix::io::FdFlags::CLOEXEC)?;
    Ok(near)
}
