//! A line without an operating system, for tests in the same process.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use super::{Received, Sent, Transport};

/// How much waits for a client that does not read.
const LIMIT: usize = 1024 * 1024;

/// The controller's end. See [`Memory::pair`].
#[derive(Debug)]
pub struct Memory {
    label: Arc<str>,
    shared: Arc<Shared>,
}

/// The client's end: a serial port to read from and write to.
///
/// The line counts as open until the port is dropped. Writing never blocks; reading waits for
/// the first byte up to the [timeout](MemoryPort::set_timeout), ten seconds of wall time unless
/// set otherwise, and then fails with [`io::ErrorKind::TimedOut`].
#[derive(Debug)]
pub struct MemoryPort {
    shared: Arc<Shared>,
    timeout: Duration,
}

#[derive(Debug, Default)]
struct Shared {
    lanes: Mutex<Lanes>,
    arrived: Condvar,
}

#[derive(Debug, Default)]
struct Lanes {
    to_device: VecDeque<u8>,
    from_device: VecDeque<u8>,
    waker: Option<Waker>,
    client_gone: bool,
    device_gone: bool,
}

impl Shared {
    /// Both queues are whole at any time, so a panic elsewhere is no reason to stop.
    fn lanes(&self) -> MutexGuard<'_, Lanes> {
        self.lanes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Memory {
    /// Both ends of a line.
    #[must_use]
    pub fn pair() -> (Memory, MemoryPort) {
        let shared = Arc::new(Shared::default());
        let port = MemoryPort { shared: Arc::clone(&shared), timeout: Duration::from_secs(10) };
        (Memory { label: Arc::from("memory"), shared }, port)
    }
}

impl Transport for Memory {
    fn label(&self) -> &Arc<str> {
        &self.label
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<Received> {
        let mut lanes = self.shared.lanes();
        let n = lanes.to_device.len().min(buffer.len());
        if n == 0 {
            lanes.waker = Some(cx.waker().clone());
            return Poll::Pending;
        }
        for (to, from) in buffer.iter_mut().zip(lanes.to_device.drain(..n)) {
            *to = from;
        }
        Poll::Ready(Received::Bytes(n))
    }

    fn poll_send(&mut self, _cx: &mut Context<'_>) {}

    fn send(&mut self, bytes: &[u8]) -> Sent {
        let mut lanes = self.shared.lanes();
        if lanes.client_gone {
            return Sent::Nobody;
        }
        if lanes.from_device.len() + bytes.len() > LIMIT {
            return Sent::Lost(u64::try_from(bytes.len()).unwrap_or(u64::MAX));
        }
        lanes.from_device.extend(bytes);
        drop(lanes);
        self.shared.arrived.notify_all();
        Sent::Accepted
    }

    fn is_finished(&self) -> bool {
        let lanes = self.shared.lanes();
        lanes.client_gone && lanes.to_device.is_empty()
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.shared.lanes().device_gone = true;
        self.shared.arrived.notify_all();
    }
}

impl MemoryPort {
    /// How long reading waits for the first byte.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// Everything that has arrived, without waiting.
    #[must_use]
    pub fn drain(&mut self) -> Vec<u8> {
        self.shared.lanes().from_device.drain(..).collect()
    }
}

impl Read for MemoryPort {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let deadline = Instant::now().checked_add(self.timeout);
        let mut lanes = self.shared.lanes();
        loop {
            let n = lanes.from_device.len().min(buffer.len());
            if n > 0 || buffer.is_empty() {
                for (to, from) in buffer.iter_mut().zip(lanes.from_device.drain(..n)) {
                    *to = from;
                }
                return Ok(n);
            }
            if lanes.device_gone {
                return Ok(0);
            }
            let left = match deadline {
                Some(deadline) => deadline.saturating_duration_since(Instant::now()),
                None => Duration::from_secs(3_600),
            };
            if left.is_zero() {
                return Err(io::Error::new(
                    io::ErrorKind::TimedOut,
                    "the controller has sent nothing; it may still be busy, or its time stands still",
                ));
            }
            lanes = self
                .shared
                .arrived
                .wait_timeout(lanes, left)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }
}

impl Write for MemoryPort {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut lanes = self.shared.lanes();
        if lanes.device_gone {
            return Err(io::Error::new(io::ErrorKind::BrokenPipe, "the emulator has ended"));
        }
        lanes.to_device.extend(bytes);
        let waker = lanes.waker.take();
        drop(lanes);
        if let Some(waker) = waker {
            waker.wake();
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for MemoryPort {
    fn drop(&mut self) {
        let mut lanes = self.shared.lanes();
        lanes.client_gone = true;
        if let Some(waker) = lanes.waker.take() {
            drop(lanes);
            waker.wake();
        }
    }
}
