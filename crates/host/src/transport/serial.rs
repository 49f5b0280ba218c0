//! A real serial port.

use std::io;
use std::path::PathBuf;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use thiserror::Error;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio_serial::{SerialPort, SerialPortBuilderExt, SerialStream};

use super::outbox::Outbox;
use super::returning::Returning;
use super::{Received, Sent, Transport};
use crate::LineEvent;

/// A serial port of this computer at the device's speed, 8N1 without flow control, as the real
/// controllers have it. Whether somebody is at the other end of the cable cannot be seen. One that
/// is unplugged is opened again when it is back.
#[derive(Debug)]
pub struct Serial {
    label: Arc<str>,
    path: PathBuf,
    baud: u32,
    /// Whether the other end may send.
    ready: bool,
    state: State,
    outbox: Outbox,
    news: Option<LineEvent>,
}

#[derive(Debug)]
enum State {
    Open(SerialStream),
    /// It is not there. `None` if nobody can tell when it is.
    Gone(Option<Returning>),
}

/// What may be the matter with a port that does not open.
const CHECKS: &str = if cfg!(windows) {
    "check its name (`mode` lists the ports), and that no other program has it open"
} else {
    "check its name, that no other program has it open, and that you may use it (on Linux, the group \
     `dialout`)"
};

/// Why a serial port cannot be used.
#[derive(Debug, Error)]
#[error("cannot open serial port {path}: {source}; {CHECKS}")]
pub struct SerialError {
    path: String,
    source: tokio_serial::Error,
}

impl Serial {
    /// Opens the port. It must be called within a tokio runtime.
    pub fn open(path: &str, baud: u32) -> Result<Serial, SerialError> {
        let port =
            open(path, baud).map_err(|source| SerialError { path: path.to_owned(), source })?;
        Ok(Serial {
            label: Arc::from(format!("serial {path}")),
            path: PathBuf::from(path),
            baud,
            ready: true,
            state: State::Open(port),
            outbox: Outbox::default(),
            news: None,
        })
    }

    /// The port is gone, most likely unplugged.
    fn fail(&mut self, error: &dyn std::fmt::Display) {
        self.state = State::Gone(Returning::new(&self.path).ok());
        self.outbox.clear();
        let (transport, error) = (Arc::clone(&self.label), error.to_string());
        self.news = Some(LineEvent::Gone { transport, error });
    }

    /// Looks for a port that is gone, whenever there is a reason to.
    fn poll_return(&mut self, cx: &mut Context<'_>) {
        while let State::Gone(Some(returning)) = &mut self.state {
            if returning.poll(cx).is_pending() {
                return;
            }
            if let Ok(mut port) = open(&returning.path().to_string_lossy(), self.baud) {
                let _ = port.write_request_to_send(self.ready);
                self.state = State::Open(port);
                self.news = Some(LineEvent::Back { transport: Arc::clone(&self.label) });
            }
        }
    }
}

fn open(path: &str, baud: u32) -> tokio_serial::Result<SerialStream> {
    tokio_serial::new(path, baud)
        .data_bits(tokio_serial::DataBits::Eight)
        .parity(tokio_serial::Parity::None)
        .stop_bits(tokio_serial::StopBits::One)
        .flow_control(tokio_serial::FlowControl::None)
        .open_native_async()
}

impl Transport for Serial {
    fn label(&self) -> &Arc<str> {
        &self.label
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<Received> {
        loop {
            if let Some(news) = self.news.take() {
                return Poll::Ready(Received::News(news));
            }
            if buffer.is_empty() {
                return Poll::Pending;
            }
            let State::Open(port) = &mut self.state else {
                self.poll_return(cx);
                if self.news.is_some() {
                    continue;
                }
                return Poll::Pending;
            };
            let mut read = ReadBuf::new(buffer);
            match Pin::new(port).poll_read(cx, &mut read) {
                Poll::Pending => return Poll::Pending,
                Poll::Ready(Ok(())) if !read.filled().is_empty() => {
                    return Poll::Ready(Received::Bytes(read.filled().len()));
                }
                Poll::Ready(Ok(())) => self.fail(&"the device is gone"),
                Poll::Ready(Err(error)) => self.fail(&error),
            }
        }
    }

    fn poll_send(&mut self, cx: &mut Context<'_>) {
        let Serial { state: State::Open(port), outbox, .. } = self else { return };
        let flushed = outbox.flush(|bytes| match Pin::new(&mut *port).poll_write(cx, bytes) {
            Poll::Ready(written) => written,
            Poll::Pending => Err(io::ErrorKind::WouldBlock.into()),
        });
        if let Err(error) = flushed {
            self.fail(&error);
            cx.waker().wake_by_ref();
        }
    }

    fn send(&mut self, bytes: &[u8]) -> Sent {
        let State::Open(port) = &mut self.state else { return Sent::Nobody };
        match self.outbox.send(bytes, |bytes| port.try_write(bytes)) {
            Ok(0) => Sent::Accepted,
            Ok(lost) => Sent::Lost(lost),
            Err(error) => {
                self.fail(&error);
                Sent::Nobody
            }
        }
    }

    fn set_baud(&mut self, baud: u32) {
        self.baud = baud;
        if let State::Open(port) = &mut self.state
            && let Err(error) = port.set_baud_rate(baud)
        {
            self.fail(&error);
        }
    }

    /// What is the request to send here is the clear to send at the other end of the cable. An
    /// adapter without it is none the worse for a host that does not heed it.
    fn set_ready(&mut self, ready: bool) {
        self.ready = ready;
        if let State::Open(port) = &mut self.state {
            let _ = port.write_request_to_send(ready);
        }
    }
}
