//! How a loop of asyncio hears that something it awaits is there.

use std::io;
use std::sync::{Arc, Mutex};
use std::task::{Wake, Waker};

use pyo3::prelude::*;

use crate::waiting::lock;

/// An emulator rings, the loop hears it. Each who waits has a key.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Bell(Arc<Shared>);

struct Shared {
    /// For whom it has rung.
    keys: Mutex<Vec<u64>>,
    sound: Sound,
}

struct Ring {
    bell: Arc<Shared>,
    key: u64,
}

impl Wake for Ring {
    fn wake(self: Arc<Self>) {
        let mut keys = lock(&self.bell.keys);
        keys.push(self.key);
        if keys.len() == 1 {
            self.bell.sound.make();
        }
    }
}

impl Bell {
    pub(crate) fn waker(&self, key: u64) -> Waker {
        Waker::from(Arc::new(Ring { bell: Arc::clone(&self.0), key }))
    }
}

#[pymethods]
impl Bell {
    #[new]
    fn new() -> io::Result<Bell> {
        Ok(Bell(Arc::new(Shared { keys: Mutex::default(), sound: Sound::new()? })))
    }

    /// What the loop watches.
    #[cfg(unix)]
    fn fileno(&self) -> i32 {
        self.0.sound.fileno()
    }

    /// Waits until it rings; false when it never will again.
    #[cfg(not(unix))]
    fn wait(&self, py: Python<'_>) -> bool {
        py.detach(|| self.0.sound.wait())
    }

    /// Nobody is there any more for whom it could ring.
    #[cfg(not(unix))]
    fn close(&self) {
        self.0.sound.close();
    }

    /// For whom it has rung since.
    fn take(&self) -> Vec<u64> {
        // First the sound, then the keys: one that comes in between is among them, and rings in vain.
        #[cfg(unix)]
        self.0.sound.fade();
        std::mem::take(&mut *lock(&self.0.keys))
    }
}

#[cfg(unix)]
use sockets::Sound;

/// A loop of asyncio watches a socket as it watches all others.
#[cfg(unix)]
mod sockets {
    use std::io::{self, Read, Write};
    use std::os::fd::AsRawFd;
    use std::os::unix::net::UnixStream;

    /// A pair of sockets: an emulator writes into one end, the loop watches the other.
    pub(super) struct Sound {
        outside: UnixStream,
        inside: UnixStream,
    }

    impl Sound {
        pub(super) fn new() -> io::Result<Sound> {
            let (outside, inside) = UnixStream::pair()?;
            outside.set_nonblocking(true)?;
            inside.set_nonblocking(true)?;
            Ok(Sound { outside, inside })
        }

        pub(super) fn make(&self) {
            // If nobody watches any more, nobody waits any more.
            let _ = (&self.outside).write(&[1]);
        }

        pub(super) fn fade(&self) {
            let _ = (&self.inside).read(&mut [0; 16]);
        }

        pub(super) fn fileno(&self) -> i32 {
            self.inside.as_raw_fd()
        }
    }
}

#[cfg(not(unix))]
use thread::Sound;

/// The loop that Windows has watches no sockets: a thread of Python waits, and tells it.
#[cfg(not(unix))]
mod thread {
    use std::io;
    use std::sync::{Condvar, Mutex, PoisonError};

    use crate::waiting::lock;

    #[derive(Default)]
    pub(super) struct Sound {
        heard: Mutex<Heard>,
        changed: Condvar,
    }

    #[derive(Default)]
    struct Heard {
        rings: bool,
        is_closed: bool,
    }

    impl Sound {
        #[expect(clippy::unnecessary_wraps, reason = "a pair of sockets can fail to be made")]
        pub(super) fn new() -> io::Result<Sound> {
            Ok(Sound::default())
        }

        pub(super) fn make(&self) {
            lock(&self.heard).rings = true;
            self.changed.notify_all();
        }

        pub(super) fn close(&self) {
            lock(&self.heard).is_closed = true;
            self.changed.notify_all();
        }

        pub(super) fn wait(&self) -> bool {
            let silent = |heard: &mut Heard| !heard.rings && !heard.is_closed;
            let heard = self.changed.wait_while(lock(&self.heard), silent);
            let mut heard = heard.unwrap_or_else(PoisonError::into_inner);
            heard.rings = false;
            !heard.is_closed
        }
    }
}
