//! How a loop of asyncio hears that something it awaits is there.

use std::io::{Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex};
use std::task::{Wake, Waker};

use pyo3::prelude::*;

use crate::waiting::lock;

/// A pair of sockets: an emulator rings at one end, the loop watches the other. Each who waits has a
/// key.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Bell(Arc<Shared>);

struct Shared {
    /// For whom it has rung.
    keys: Mutex<Vec<u64>>,
    outside: UnixStream,
    inside: UnixStream,
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
            // If nobody watches any more, nobody waits any more.
            let _ = (&self.bell.outside).write(&[1]);
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
    fn new() -> PyResult<Bell> {
        let (outside, inside) = UnixStream::pair()?;
        outside.set_nonblocking(true)?;
        inside.set_nonblocking(true)?;
        Ok(Bell(Arc::new(Shared { keys: Mutex::default(), outside, inside })))
    }

    /// What the loop watches.
    fn fileno(&self) -> i32 {
        self.0.inside.as_raw_fd()
    }

    /// For whom it has rung since.
    fn take(&self) -> Vec<u64> {
        // First the byte, then the keys: one that comes in between is among them, and rings in vain.
        let _ = (&self.0.inside).read(&mut [0; 16]);
        std::mem::take(&mut *lock(&self.0.keys))
    }
}
