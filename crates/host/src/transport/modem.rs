//! The handshake lines of a terminal that has none, answered by somebody else.

use std::fmt;
use std::sync::Arc;
use std::task::{Context, Poll};

use tokio::sync::mpsc;
use vimc4_device::ModemLine;

use super::{Received, Sent, Transport};
use crate::LineEvent;

/// Modem lines without the bytes, which take their own way. The client's side is told of the device's
/// lines and tells of DTR and RTS.
pub struct Modem {
    label: Arc<str>,
    lines: Box<dyn FnMut(ModemLine, bool) + Send>,
    news: mpsc::UnboundedReceiver<LineEvent>,
    finished: bool,
}

/// The client's side of a [`Modem`]: what the host does to its lines.
#[derive(Clone, Debug)]
pub struct HostLines {
    label: Arc<str>,
    news: mpsc::UnboundedSender<LineEvent>,
}

impl Modem {
    /// The lines that belong to the transport of this label. `lines` is called by the task that
    /// runs the controller whenever a line of the device changes. CTS and DSR are on at first.
    #[must_use]
    pub fn pair(
        label: &str,
        lines: impl FnMut(ModemLine, bool) + Send + 'static,
    ) -> (Modem, HostLines) {
        let (sender, news) = mpsc::unbounded_channel();
        let label = Arc::<str>::from(label);
        let host = HostLines { label: Arc::clone(&label), news: sender };
        (Modem { label, lines: Box::new(lines), news, finished: false }, host)
    }
}

impl HostLines {
    /// The host has switched one of its lines, such as `RTS`, on or off.
    pub fn switched(&self, line: &'static str, on: bool) {
        // Once the controller has ended nobody wants to know.
        let (transport, line) = (Arc::clone(&self.label), line.into());
        let _ = self.news.send(LineEvent::HostLine { transport, line, on });
    }
}

impl Transport for Modem {
    fn label(&self) -> &Arc<str> {
        &self.label
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, _buffer: &mut [u8]) -> Poll<Received> {
        if self.finished {
            return Poll::Pending;
        }
        match self.news.poll_recv(cx) {
            Poll::Ready(Some(news)) => Poll::Ready(Received::News(news)),
            Poll::Ready(None) => {
                self.finished = true;
                Poll::Ready(Received::Finished)
            }
            Poll::Pending => Poll::Pending,
        }
    }

    fn poll_send(&mut self, _cx: &mut Context<'_>) {}

    fn send(&mut self, _bytes: &[u8]) -> Sent {
        Sent::Nobody
    }

    fn set_ready(&mut self, ready: bool) {
        (self.lines)(ModemLine::Cts, ready);
    }

    fn set_line(&mut self, line: ModemLine, on: bool) {
        (self.lines)(line, on);
    }

    fn is_finished(&self) -> bool {
        self.finished
    }
}

impl fmt::Debug for Modem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Modem").field("label", &self.label).finish_non_exhaustive()
    }
}
