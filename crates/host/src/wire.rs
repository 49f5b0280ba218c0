//! All the ways to a controller's line as one wire.

use std::cell::RefCell;
use std::sync::Arc;
use std::task::{Context, Poll};

use vimc4_device::ModemLine;

use crate::LineEvent;
use crate::transport::{Received, Sent, Transport};

/// How much is read at once. The controllers of a thread take turns after each piece, and a
/// client may fill every piece with the shortest commands there are.
pub(crate) const CHUNK: usize = 1_024;

thread_local! {
    /// What is being read. Nothing is read while the bytes read before are being taken in.
    static BUFFER: RefCell<[u8; CHUNK]> = const { RefCell::new([0; CHUNK]) };
}

/// Lends the buffer of the thread to read into: a controller that waits keeps none.
pub(crate) fn with_buffer<T>(read: impl FnOnce(&mut [u8; CHUNK]) -> T) -> T {
    BUFFER.with_borrow_mut(read)
}

/// The transports of a controller: what arrives is merged, what leaves goes to all of them.
pub(crate) struct Wire {
    transports: Vec<Box<dyn Transport>>,
    /// The transport that is asked first, so that one client's flood leaves room for others.
    first: usize,
    /// The speed of the device's line, in bits per second.
    baud: u32,
    /// Whether clients may send, as the handshake lines say.
    ready: bool,
    /// What the device shows on a line of its own.
    line: Option<(ModemLine, bool)>,
}

/// What became of bytes that were sent.
#[derive(Default)]
pub(crate) struct Delivery {
    /// Somebody has the line open.
    pub(crate) heard: bool,
    /// What clients that do not read have lost.
    pub(crate) losses: Vec<LineEvent>,
}

impl Wire {
    pub(crate) fn new(baud: u32) -> Wire {
        Wire { transports: Vec::new(), first: 0, baud, ready: true, line: None }
    }

    pub(crate) fn attach(&mut self, mut transport: Box<dyn Transport>) {
        transport.set_baud(self.baud);
        if !self.ready {
            transport.set_ready(false);
        }
        if let Some((line, on)) = self.line {
            transport.set_line(line, on);
        }
        self.transports.push(transport);
    }

    /// The speed of the client that speaks on a transport, if that is known.
    pub(crate) fn client_baud(&mut self, transport: usize) -> Option<u32> {
        self.transports.get_mut(transport)?.client_baud()
    }

    /// What a transport is called.
    pub(crate) fn label(&self, transport: usize) -> Arc<str> {
        self.transports.get(transport).map_or_else(|| Arc::from(""), |of| Arc::clone(of.label()))
    }

    /// Asks the transports for what has arrived, beginning after the one that spoke last. `room` is
    /// how much the device takes, of a transport with a handshake or without: what it does not take
    /// now stays with the client, whose operating system holds it back.
    pub(crate) fn poll(
        &mut self,
        cx: &mut Context<'_>,
        room: impl Fn(bool) -> usize,
        buffer: &mut [u8; CHUNK],
    ) -> Poll<(usize, Received)> {
        let count = self.transports.len();
        for offset in 0..count {
            let index = (self.first + offset) % count;
            let transport = &mut self.transports[index];
            let room = room(transport.has_handshake()).min(buffer.len());
            if let Poll::Ready(received) = transport.poll_receive(cx, &mut buffer[..room]) {
                self.first = index + 1;
                return Poll::Ready((index, received));
            }
        }
        Poll::Pending
    }

    /// Passes on what could not be sent at once.
    pub(crate) fn poll_send(&mut self, cx: &mut Context<'_>) {
        for transport in &mut self.transports {
            transport.poll_send(cx);
        }
    }

    /// Sends to every client that has the line open.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> Delivery {
        let mut delivery = Delivery::default();
        for transport in &mut self.transports {
            match transport.send(bytes) {
                Sent::Nobody => {}
                Sent::Accepted => delivery.heard = true,
                Sent::Lost(bytes) => {
                    delivery.heard = true;
                    let transport = Arc::clone(transport.label());
                    delivery.losses.push(LineEvent::Lost { transport, bytes });
                }
            }
        }
        delivery
    }

    /// What has arrived is to be received next time although the system has not told of it yet.
    pub(crate) fn look_closely(&mut self) {
        for transport in &mut self.transports {
            transport.look_closely();
        }
    }

    /// Lets go of clients that have closed their side of the line, once they have every answer.
    pub(crate) fn dismiss_listeners(&mut self, is_idle: impl Fn() -> bool) {
        for transport in &mut self.transports {
            if transport.has_listener() && is_idle() {
                transport.dismiss_listener();
            }
        }
    }

    /// Lets go of transports from which nothing will come any more.
    pub(crate) fn drop_finished(&mut self) {
        self.transports.retain(|transport| !transport.is_finished());
    }

    /// The device's line now runs at this speed.
    pub(crate) fn set_baud(&mut self, baud: u32) {
        if baud != self.baud {
            self.baud = baud;
            for transport in &mut self.transports {
                transport.set_baud(baud);
            }
        }
    }

    /// What the device shows on a line of its own.
    pub(crate) fn set_line(&mut self, line: Option<(ModemLine, bool)>) {
        if let Some((name, on)) = line.filter(|_| line != self.line) {
            self.line = line;
            for transport in &mut self.transports {
                transport.set_line(name, on);
            }
        }
    }

    /// Whether clients may send.
    pub(crate) fn set_ready(&mut self, ready: bool) {
        if ready != self.ready {
            self.ready = ready;
            for transport in &mut self.transports {
                transport.set_ready(ready);
            }
        }
    }
}
