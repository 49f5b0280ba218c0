//! Waiting for a port that was unplugged.

use std::future::Future;
use std::io;
use std::path::{Path, PathBuf, absolute};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::time::{Sleep, sleep};

/// After this time it is looked for once in any case: it may have been back before anybody
/// watched. Where the system does not tell of new names it is looked for again and again.
const PAUSE: Duration = Duration::from_secs(1);

/// Tells when it is worth while to look for a name again.
#[derive(Debug)]
pub(super) struct Returning {
    path: PathBuf,
    pause: Option<Pin<Box<Sleep>>>,
    #[cfg(target_os = "linux")]
    folders: Option<linux::Folders>,
}

impl Returning {
    pub(super) fn new(path: &Path) -> io::Result<Returning> {
        let path = absolute(path)?;
        Ok(Returning {
            #[cfg(target_os = "linux")]
            folders: linux::Folders::watch(&path).ok(),
            pause: Some(Box::pin(sleep(PAUSE))),
            path,
        })
    }

    /// The name to look for.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Is ready when something may have changed.
    pub(super) fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        #[cfg(target_os = "linux")]
        if let Some(folders) = &mut self.folders
            && folders.poll(&self.path, cx).is_ready()
        {
            return Poll::Ready(());
        }
        if self.pause.as_mut().is_some_and(|pause| pause.as_mut().poll(cx).is_ready()) {
            self.pause = if self.is_told() { None } else { Some(Box::pin(sleep(PAUSE))) };
            return Poll::Ready(());
        }
        Poll::Pending
    }

    fn is_told(&self) -> bool {
        #[cfg(target_os = "linux")]
        return self.folders.is_some();
        #[cfg(not(target_os = "linux"))]
        false
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::io;
    use std::path::Path;
    use std::pin::Pin;
    use std::task::{Context, Poll};

    use rustix::fs::inotify::{self, CreateFlags, WatchFlags};
    use tokio::io::{AsyncRead, ReadBuf};
    use tokio::net::unix::pipe;

    /// The folders in which the name, or a folder on the way to it, may appear.
    #[derive(Debug)]
    pub(super) struct Folders {
        /// inotify's descriptor is read like the end of a pipe.
        events: pipe::Receiver,
    }

    impl Folders {
        pub(super) fn watch(path: &Path) -> io::Result<Folders> {
            let inotify = inotify::init(CreateFlags::NONBLOCK | CreateFlags::CLOEXEC)?;
            add(&inotify, path);
            Ok(Folders { events: pipe::Receiver::from_owned_fd_unchecked(inotify)? })
        }

        pub(super) fn poll(&mut self, path: &Path, cx: &mut Context<'_>) -> Poll<()> {
            let mut buffer = [0; 4_096];
            let mut read = ReadBuf::new(&mut buffer);
            match Pin::new(&mut self.events).poll_read(cx, &mut read) {
                Poll::Pending => Poll::Pending,
                Poll::Ready(_) => {
                    // A folder on the way may be a new one.
                    add(&self.events, path);
                    Poll::Ready(())
                }
            }
        }
    }

    /// Watches every folder on the way that there is. Those that are watched already stay so.
    fn add(inotify: &impl std::os::fd::AsFd, path: &Path) {
        // The right to use a device may come after its name.
        let flags = WatchFlags::CREATE | WatchFlags::MOVED_TO | WatchFlags::ATTRIB;
        for folder in path.ancestors().skip(1) {
            let _ = inotify::add_watch(inotify, folder, flags | WatchFlags::ONLYDIR);
        }
    }
}
