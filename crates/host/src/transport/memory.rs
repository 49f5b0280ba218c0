//! A line without an operating system, for tests in the same process.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::pin::Pin;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use super::{Received, Sent, Transport, take};

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
/// The line counts as open until the port is dropped. Reading waits for the first byte up to
/// the [timeout](MemoryPort::set_timeout), ten seconds of wall time unless set otherwise, and
/// then fails with [`io::ErrorKind::TimedOut`]; writing does so where a megabyte is waiting to
/// be taken. It can be read and written with the traits of the standard library and with those
/// of tokio, which do not block and know no timeout.
#[derive(Debug)]
pub struct MemoryPort {
    shared: Arc<Shared>,
    timeout: Duration,
}

#[derive(Debug, Default)]
struct Shared {
    lanes: Mutex<Lanes>,
    /// Tells threads of the client that something has arrived or been taken.
    moved: Condvar,
}

#[derive(Debug, Default)]
struct Lanes {
    to_device: VecDeque<u8>,
    from_device: VecDeque<u8>,
    /// The device, which waits for bytes.
    device: Option<Waker>,
    /// Tasks of the client, which wait to read or to write.
    reader: Option<Waker>,
    writer: Option<Waker>,
    client_gone: bool,
    device_gone: bool,
}

impl Shared {
    /// Both queues are whole at any time, so a panic elsewhere is no reason to stop.
    fn lanes(&self) -> MutexGuard<'_, Lanes> {
        self.lanes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes something and wakes the task that may have waited for that.
    fn change<T>(&self, change: impl FnOnce(&mut Lanes) -> (T, Option<Waker>)) -> T {
        let (result, waker) = change(&mut self.lanes());
        if let Some(waker) = waker {
            waker.wake();
        }
        self.moved.notify_all();
        result
    }

    /// Waits for a change that makes `ready` give something, no longer than the timeout.
    fn wait<T>(
        &self,
        timeout: Duration,
        why_not: &'static str,
        mut ready: impl FnMut(&mut Lanes) -> Option<T>,
    ) -> io::Result<T> {
        let deadline = Instant::now().checked_add(timeout);
        let mut lanes = self.lanes();
        loop {
            if let Some(result) = ready(&mut lanes) {
                return Ok(result);
            }
            let left = match deadline {
                Some(deadline) => deadline.saturating_duration_since(Instant::now()),
                None => Duration::from_secs(3_600),
            };
            if left.is_zero() {
                return Err(io::Error::new(io::ErrorKind::TimedOut, why_not));
            }
            lanes = self.moved.wait_timeout(lanes, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Lanes {
    /// What has arrived for the client; nothing when the device is gone; `None` as long as
    /// something may come.
    fn read(&mut self, buffer: &mut [u8]) -> Option<usize> {
        let n = take(&mut self.from_device, buffer);
        (n > 0 || buffer.is_empty() || self.device_gone).then_some(n)
    }

    /// Takes what there is room for, and says how much that was; `None` if there is none.
    fn write(&mut self, bytes: &[u8]) -> Option<io::Result<usize>> {
        if self.device_gone {
            let gone = io::Error::new(io::ErrorKind::BrokenPipe, "the emulator has ended");
            return Some(Err(gone));
        }
        let n = bytes.len().min(LIMIT.saturating_sub(self.to_device.len()));
        self.to_device.extend(&bytes[..n]);
        (n > 0 || bytes.is_empty()).then_some(Ok(n))
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
        let n = self.shared.change(|lanes| {
            let n = take(&mut lanes.to_device, buffer);
            if n == 0 {
                lanes.device = Some(cx.waker().clone());
                return (0, None);
            }
            (n, lanes.writer.take())
        });
        if n > 0 { Poll::Ready(Received::Bytes(n)) } else { Poll::Pending }
    }

    fn poll_send(&mut self, _cx: &mut Context<'_>) {}

    fn send(&mut self, bytes: &[u8]) -> Sent {
        self.shared.change(|lanes| {
            if lanes.client_gone {
                return (Sent::Nobody, None);
            }
            if lanes.from_device.len() + bytes.len() > LIMIT {
                return (Sent::Lost(u64::try_from(bytes.len()).unwrap_or(u64::MAX)), None);
            }
            lanes.from_device.extend(bytes);
            (Sent::Accepted, lanes.reader.take())
        })
    }

    fn is_finished(&self) -> bool {
        let lanes = self.shared.lanes();
        lanes.client_gone && lanes.to_device.is_empty()
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.shared.change(|lanes| {
            lanes.device_gone = true;
            ((), lanes.reader.take())
        });
        self.shared.change(|lanes| ((), lanes.writer.take()));
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
        let why_not =
            "the controller has sent nothing; it may still be busy, or its time stands still";
        self.shared.wait(self.timeout, why_not, |lanes| lanes.read(buffer))
    }
}

impl Write for MemoryPort {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let why_not = "the controller has taken nothing; its time may stand still with a full line";
        let written = self.shared.wait(self.timeout, why_not, |lanes| lanes.write(bytes));
        let device = self.shared.lanes().device.take();
        if let Some(device) = device {
            device.wake();
        }
        written?
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl AsyncRead for MemoryPort {
    fn poll_read(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let mut lanes = self.shared.lanes();
        match lanes.read(buffer.initialize_unfilled()) {
            Some(n) => {
                buffer.advance(n);
                Poll::Ready(Ok(()))
            }
            None => {
                lanes.reader = Some(cx.waker().clone());
                Poll::Pending
            }
        }
    }
}

impl AsyncWrite for MemoryPort {
    fn poll_write(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.shared.change(|lanes| match lanes.write(bytes) {
            Some(written) => (Poll::Ready(written), lanes.device.take()),
            None => {
                lanes.writer = Some(cx.waker().clone());
                (Poll::Pending, None)
            }
        })
    }

    fn poll_flush(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}

impl Drop for MemoryPort {
    fn drop(&mut self) {
        self.shared.change(|lanes| {
            lanes.client_gone = true;
            ((), lanes.device.take())
        });
    }
}
