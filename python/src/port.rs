//! The line from within the process: a serial port that no operating system knows.

use std::future::Future;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Waker};
use std::time::Instant;

use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use vimc4::{Condition, Control, HostLines, MemoryPort};

use crate::alarm::Alarms;
use crate::error;
use crate::pending::Pending;
use crate::waiting::{answer, deadline, lock, wait};

/// A serial port that leads to an emulator in this process. It is read and written by as many
/// threads as like to.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Port {
    line: Arc<Mutex<Line>>,
    clear: Arc<Clear>,
    lines: Mutex<Option<HostLines>>,
    control: Control,
    alarms: Arc<Alarms>,
    /// Whether time passes only while this is read.
    leads_time: bool,
    /// The process that it is of.
    process: u32,
}

struct Line {
    /// `None` once it is closed.
    port: Option<MemoryPort>,
    /// What has come and nobody has read.
    kept: Vec<u8>,
    /// The emulator has ended.
    ended: bool,
    /// Somebody has given up the reading, or the writing, that is waited for.
    no_reading: bool,
    no_writing: bool,
    /// Who waits: only one of them is known to the port.
    waiting: Vec<Waker>,
}

/// CTS, and who waits for it.
#[derive(Default)]
pub(crate) struct Clear {
    held: AtomicBool,
    waiting: Mutex<Vec<Waker>>,
}

impl Clear {
    pub(crate) fn set(&self, cts: bool) {
        self.held.store(!cts, Ordering::Release);
        lock(&self.waiting).drain(..).for_each(Waker::wake);
    }
}

impl Line {
    /// Takes in what has come.
    fn fill(&mut self, cx: &mut Context<'_>) {
        let mut room = [0; 4096];
        while let Some(port) = &mut self.port {
            let mut buffer = ReadBuf::new(&mut room);
            match Pin::new(port).poll_read(cx, &mut buffer) {
                Poll::Ready(Ok(())) if !buffer.filled().is_empty() => {
                    self.kept.extend_from_slice(buffer.filled());
                }
                Poll::Ready(_) => {
                    self.ended = true;
                    break;
                }
                Poll::Pending => break,
            }
        }
    }

    fn take(&mut self, size: usize) -> Vec<u8> {
        let rest = self.kept.split_off(size.min(self.kept.len()));
        std::mem::replace(&mut self.kept, rest)
    }

    /// Takes `size` bytes, or fewer if nothing more will come. Whoever waits takes them at once, before
    /// somebody else who waits, too, can.
    fn poll_read(&mut self, size: usize, cx: &mut Context<'_>) -> Poll<Vec<u8>> {
        self.fill(cx);
        let given_up = std::mem::take(&mut self.no_reading);
        if self.kept.len() >= size || self.ended || self.port.is_none() || given_up {
            self.wake();
            return Poll::Ready(self.take(size));
        }
        self.waiting.push(cx.waker().clone());
        Poll::Pending
    }

    /// Writes what there is room for, and says how much that was.
    fn poll_write(&mut self, bytes: &[u8], cx: &mut Context<'_>) -> Poll<Option<usize>> {
        let Some(port) = &mut self.port else { return Poll::Ready(None) };
        if self.no_writing {
            return Poll::Ready(Some(0));
        }
        match Pin::new(port).poll_write(cx, bytes) {
            Poll::Ready(Ok(written)) => Poll::Ready(Some(written)),
            Poll::Ready(Err(_)) => {
                self.ended = true;
                Poll::Ready(None)
            }
            Poll::Pending => {
                self.waiting.push(cx.waker().clone());
                Poll::Pending
            }
        }
    }

    fn wake(&mut self) {
        self.waiting.drain(..).for_each(Waker::wake);
    }
}

impl Port {
    pub(crate) fn new(
        port: MemoryPort,
        lines: HostLines,
        clear: Arc<Clear>,
        control: Control,
        alarms: Arc<Alarms>,
        leads_time: bool,
    ) -> Port {
        let line = Line {
            port: Some(port),
            kept: Vec::new(),
            ended: false,
            no_reading: false,
            no_writing: false,
            waiting: Vec::new(),
        };
        let (line, lines) = (Arc::new(Mutex::new(line)), Mutex::new(Some(lines)));
        let process = std::process::id();
        Port { line, clear, lines, control, alarms, leads_time, process }
    }

    fn is_open(&self, py: Python<'_>) -> PyResult<()> {
        if self.is_elsewhere() {
            let text = py.import("vimc4._errors")?.getattr("ELSEWHERE")?.extract()?;
            return Err(error::raise(py, "Ended", text));
        }
        match lock(&self.line).port {
            Some(_) => Ok(()),
            None => Err(PyOSError::new_err("the port is closed; open another one")),
        }
    }

    /// Whether this is a copy of the process, which has neither the emulator nor the threads that could
    /// let go of a lock.
    fn is_elsewhere(&self) -> bool {
        self.process != std::process::id()
    }

    /// Reads where time stands still but for this: it passes up to the answer, or until nothing moves any
    /// more and nothing else can come. A time-out that would pass in vain is over at once, and whoever
    /// would wait for ever has given up. So equal hosts have equal conversations.
    fn read_by_itself(
        &self,
        py: Python<'_>,
        size: usize,
        timeout: Option<f64>,
    ) -> PyResult<Vec<u8>> {
        let until = deadline(timeout);
        loop {
            let before = match self.look(size) {
                Ok(read) => return Ok(read),
                Err(kept) => kept,
            };
            let answered = Condition::Answered { like: None };
            self.pass(py, Condition::Any(vec![answered, Condition::Idle]), until)?;
            match self.look(size) {
                Ok(read) => return Ok(read),
                Err(kept) if kept > before => continue,
                Err(_) => {}
            }
            self.pass(py, Condition::Idle, until)?;
            return match (self.look(size), timeout) {
                (Ok(read), _) => Ok(read),
                (Err(_), Some(_)) => Ok(lock(&self.line).take(size)),
                (Err(_), None) => {
                    let class = py.import("vimc4._sweep")?.getattr("GivenUp")?;
                    Err(PyErr::from_value(class.call0()?))
                }
            };
        }
    }

    /// Takes so many bytes; if they are not there, says how many are.
    fn look(&self, size: usize) -> Result<Vec<u8>, usize> {
        let mut line = lock(&self.line);
        match line.poll_read(size, &mut Context::from_waker(Waker::noop())) {
            Poll::Ready(read) => Ok(read),
            Poll::Pending => {
                line.waiting.pop();
                Err(line.kept.len())
            }
        }
    }

    /// Lets time pass. What never comes about has been waited for; an emulator that has ended says so when
    /// it is read.
    fn pass(&self, py: Python<'_>, to: Condition, until: Option<Instant>) -> PyResult<()> {
        let mut journey = self.control.run_until(to);
        wait(py, until, |cx| Pin::new(&mut journey).poll(cx).map(drop)).map(drop)
    }

    /// Waits until a host that heeds CTS may send, with all that was sent so far taken in, or the port is
    /// closed, or writing is given up.
    fn wait_for_cts(&self, py: Python<'_>, until: Option<Instant>) -> PyResult<bool> {
        loop {
            {
                let line = lock(&self.line);
                if line.no_writing || line.port.is_none() {
                    return Ok(true);
                }
            }
            if answer(py, self.control.takes_more())? {
                return Ok(true);
            }
            let changed = wait(py, until, |cx| {
                let mut line = lock(&self.line);
                if line.no_writing || line.port.is_none() {
                    return Poll::Ready(());
                }
                line.waiting.push(cx.waker().clone());
                lock(&self.clear.waiting).push(cx.waker().clone());
                match self.clear.held.load(Ordering::Acquire) {
                    true => Poll::Pending,
                    false => Poll::Ready(()),
                }
            })?;
            if changed.is_none() {
                return Ok(false);
            }
        }
    }
}

#[pymethods]
impl Port {
    /// Reads `size` bytes; fewer if they do not come within so many seconds, or reading is given up, or
    /// the emulator has ended.
    #[pyo3(signature = (size=1, timeout=None))]
    fn read<'py>(
        &self,
        py: Python<'py>,
        size: usize,
        timeout: Option<f64>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        self.is_open(py)?;
        if self.leads_time && size > 0 {
            return Ok(PyBytes::new(py, &self.read_by_itself(py, size, timeout)?));
        }
        let ear = self.alarms.ear();
        let read = wait(py, deadline(timeout), |cx| match ear.hears(cx) {
            true => Poll::Ready(Vec::new()),
            false => lock(&self.line).poll_read(size, cx),
        })?;
        ear.check(py)?;
        let read = read.unwrap_or_else(|| lock(&self.line).take(size));
        Ok(PyBytes::new(py, &read))
    }

    /// Writes, and says how many bytes the line has taken within so many seconds: all of them, unless a
    /// megabyte waits there, or CTS, if it is heeded, holds them back. Also says whether writing was given
    /// up meanwhile.
    #[pyo3(signature = (data, timeout=None, heeds_cts=false))]
    fn write(
        &self,
        py: Python<'_>,
        data: &[u8],
        timeout: Option<f64>,
        heeds_cts: bool,
    ) -> PyResult<(usize, bool)> {
        self.is_open(py)?;
        self.alarms.ear().check(py)?;
        lock(&self.line).no_writing = false;
        let until = deadline(timeout);
        let mut written = 0;
        while written < data.len() {
            if heeds_cts && !self.wait_for_cts(py, until)? {
                break;
            }
            let end = if heeds_cts { written + 1 } else { data.len() };
            let part = &data[written..end];
            match wait(py, until, |cx| lock(&self.line).poll_write(part, cx))? {
                Some(Some(0)) | None => break,
                Some(Some(count)) => written += count,
                Some(None) => {
                    self.is_open(py)?;
                    return Err(error::ended(py, "the emulator has ended".to_owned()));
                }
            }
        }
        Ok((written, lock(&self.line).no_writing))
    }

    /// What has come, at least a byte, to be awaited; nothing when nothing will come any more.
    fn arrived(&self) -> Pending {
        let line = Arc::clone(&self.line);
        let bytes = std::future::poll_fn(move |cx| {
            let mut line = lock(&line);
            line.poll_read(1, cx).map(|mut bytes| {
                bytes.append(&mut line.take(usize::MAX));
                bytes
            })
        });
        Pending::new(bytes, |py, bytes| Ok(PyBytes::new(py, &bytes).into_any().unbind()))
    }

    /// How many bytes have come and are not read.
    #[getter]
    fn in_waiting(&self, py: Python<'_>) -> PyResult<usize> {
        self.is_open(py)?;
        self.alarms.ear().check(py)?;
        if self.leads_time && self.look(usize::MAX) == Err(0) {
            let answered = Condition::Answered { like: None };
            self.pass(py, Condition::Any(vec![answered, Condition::Idle]), deadline(Some(1.0)))?;
        }
        let mut line = lock(&self.line);
        // Who waits is known to the port; it is told that it may look again.
        line.fill(&mut Context::from_waker(Waker::noop()));
        line.wake();
        Ok(line.kept.len())
    }

    /// Whether the emulator has ended, and everything that it has sent is read.
    #[getter]
    fn ended(&self) -> bool {
        if self.is_elsewhere() {
            return true;
        }
        let line = lock(&self.line);
        line.ended && line.kept.is_empty()
    }

    /// Raises that the emulator has ended, if it has, and everything that it has sent is read.
    fn check(&self, py: Python<'_>) -> PyResult<()> {
        match self.ended() {
            true => Err(error::ended(py, "the emulator has ended".to_owned())),
            false => Ok(()),
        }
    }

    /// Forgets what has come.
    fn reset_input_buffer(&self, py: Python<'_>) -> PyResult<()> {
        self.in_waiting(py)?;
        lock(&self.line).kept.clear();
        Ok(())
    }

    /// Whoever waits in `read` gets what has come so far.
    fn cancel_read(&self) {
        if self.is_elsewhere() {
            return;
        }
        let mut line = lock(&self.line);
        line.no_reading = true;
        line.wake();
    }

    /// Whoever waits in `write` goes on.
    fn cancel_write(&self) {
        if self.is_elsewhere() {
            return;
        }
        let mut line = lock(&self.line);
        line.no_writing = true;
        line.wake();
    }

    /// Whether a host may send now, with all that it has sent so far taken in.
    #[getter]
    fn cts(&self, py: Python<'_>) -> PyResult<bool> {
        self.is_open(py)?;
        answer(py, self.control.takes_more())
    }

    /// Switches one of the host's lines, `DTR` or `RTS`, or begins or ends a `BREAK`.
    fn switch(&self, py: Python<'_>, line: &str, on: bool) -> PyResult<()> {
        self.is_open(py)?;
        let line = ["DTR", "RTS", "BREAK"].into_iter().find(|name| *name == line);
        if let (Some(line), Some(lines)) = (line, &*lock(&self.lines)) {
            lines.switched(line, on);
        }
        Ok(())
    }

    #[getter]
    fn closed(&self) -> bool {
        !self.is_elsewhere() && lock(&self.line).port.is_none()
    }

    /// Closes the line. Whoever waits for it goes on.
    fn close(&self) {
        if self.is_elsewhere() {
            return;
        }
        let mut line = lock(&self.line);
        drop(line.port.take());
        line.kept.clear();
        line.wake();
        drop(line);
        drop(lock(&self.lines).take());
        self.clear.set(true);
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        if self.is_elsewhere() {
            // It belongs to the original, and who holds its locks is not here.
            std::mem::forget((Arc::clone(&self.line), Arc::clone(&self.clear)));
            std::mem::forget(std::mem::take(&mut self.lines));
        }
    }
}
