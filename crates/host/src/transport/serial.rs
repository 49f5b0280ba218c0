//! A real serial port.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use thiserror::Error;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio_serial::{SerialPort, SerialPortBuilderExt, SerialStream};

use super::outbox::Outbox;
use super::{Received, Sent, Transport};
use crate::report::News;

/// A serial port of this computer at the device's speed, 8N1 without flow control, as the real
/// controllers have it. Whether somebody is at the other end of the cable cannot be seen.
#[derive(Debug)]
pub struct Serial {
    label: Arc<str>,
    port: Option<SerialStream>,
    outbox: Outbox,
    failure: Option<String>,
}

/// Why a serial port cannot be used.
#[derive(Debug, Error)]
#[error(
    "cannot open serial port {path}: {source}; check its name, that no other program has it open, \
     and that you may use it (on Linux, the group `dialout`)"
)]
pub struct SerialError {
    path: String,
    source: tokio_serial::Error,
}

impl Serial {
    /// Opens the port. It must be called within a tokio runtime.
    pub fn open(path: &str, baud: u32) -> Result<Serial, SerialError> {
        let port = tokio_serial::new(path, baud)
            .data_bits(tokio_serial::DataBits::Eight)
            .parity(tokio_serial::Parity::None)
            .stop_bits(tokio_serial::StopBits::One)
            .flow_control(tokio_serial::FlowControl::None)
            .open_native_async()
            .map_err(|source| SerialError { path: path.to_owned(), source })?;
        Ok(Serial {
            label: Arc::from(format!("serial {path}")),
            port: Some(port),
            outbox: Outbox::default(),
            failure: None,
        })
    }

    /// The port is gone, most likely unplugged. Looking for it again and again would be
    /// polling; who plugs it in again starts the emulator again.
    fn fail(&mut self, error: &dyn std::fmt::Display) {
        self.port = None;
        self.failure = Some(error.to_string());
    }
}

impl Transport for Serial {
    fn label(&self) -> &Arc<str> {
        &self.label
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<Received> {
        if let Some(port) = self.port.as_mut().filter(|_| !buffer.is_empty()) {
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
        match self.failure.take() {
            Some(error) => {
                let transport = Arc::clone(&self.label);
                Poll::Ready(Received::News(News::Failed { transport, error }))
            }
            None => Poll::Pending,
        }
    }

    fn poll_send(&mut self, cx: &mut Context<'_>) {
        let Some(port) = &mut self.port else { return };
        let flushed = self.outbox.flush(|bytes| match Pin::new(&mut *port).poll_write(cx, bytes) {
            Poll::Ready(written) => written,
            Poll::Pending => Err(io::ErrorKind::WouldBlock.into()),
        });
        if let Err(error) = flushed {
            self.fail(&error);
        }
    }

    fn send(&mut self, bytes: &[u8]) -> Sent {
        let Some(port) = &mut self.port else { return Sent::Nobody };
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
        if let Some(Err(error)) = self.port.as_mut().map(|port| port.set_baud_rate(baud)) {
            self.fail(&error);
        }
    }

    /// What is the request to send here is the clear to send at the other end of the cable.
    fn set_ready(&mut self, ready: bool) {
        if let Some(Err(error)) = self.port.as_mut().map(|port| port.write_request_to_send(ready)) {
            self.fail(&error);
        }
    }

    fn is_finished(&self) -> bool {
        self.port.is_none() && self.failure.is_none()
    }
}
