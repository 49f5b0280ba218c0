//! The ways to a controller's line.
//!
//! All transports of a controller are one wire. What arrives on any of them reaches the device
//! in the order of arrival; what the device sends goes to every one that somebody has open. A
//! client that does not read loses its own copy and nobody else's.

mod memory;
mod modem;
mod outbox;
mod tcp;
mod telnet;

#[cfg(feature = "serial")]
mod returning;
#[cfg(feature = "serial")]
mod serial;

#[cfg(all(unix, feature = "pty"))]
mod link;
#[cfg(all(unix, feature = "pty"))]
mod near;
#[cfg(all(unix, feature = "pty"))]
mod pty;
#[cfg(all(unix, feature = "pty"))]
mod terminal;
#[cfg(all(unix, feature = "pty"))]
mod users;
#[cfg(target_os = "linux")]
mod vigil;
#[cfg(all(target_os = "linux", feature = "pty"))]
#[path = "watch_linux.rs"]
mod watch;
#[cfg(all(unix, feature = "pty", not(target_os = "linux")))]
#[path = "watch_other.rs"]
mod watch;
#[cfg(all(target_os = "linux", feature = "pty"))]
#[path = "writes_linux.rs"]
mod writes;
#[cfg(all(unix, feature = "pty", not(target_os = "linux")))]
#[path = "writes_other.rs"]
mod writes;

use std::collections::VecDeque;
use std::sync::Arc;
use std::task::{Context, Poll};

#[cfg(all(unix, feature = "pty"))]
pub use link::{LinkError, PtyLink};
pub use memory::{Memory, MemoryPort};
pub use modem::{HostLines, Modem};
#[cfg(all(unix, feature = "pty"))]
pub use pty::{Pty, PtyError};
#[cfg(feature = "serial")]
pub use serial::{Serial, SerialError};
pub use tcp::{Clients, Tcp, TcpError};
#[cfg(all(unix, feature = "pty"))]
pub use users::{User, Users};

use vimc4_device::ModemLine;

use crate::LineEvent;

/// One way to a controller's line.
///
/// Everything is polled by the task that runs the controller, so nothing here may block.
pub trait Transport: Send {
    /// What it is called in messages: `pty`, `tcp 127.0.0.1:4004`.
    fn label(&self) -> &Arc<str>;

    /// Takes what has arrived, or arranges to be woken when something does. With an empty buffer
    /// nothing is read: the sender has to wait.
    fn poll_receive(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<Received>;

    /// Somebody wants to know what has happened up to now: what has arrived is to be received
    /// next time although the system has not told of it yet.
    fn look_closely(&mut self) {}

    /// Passes on what could not be sent at once, and arranges to be woken when more can be.
    fn poll_send(&mut self, cx: &mut Context<'_>);

    /// Sends without waiting.
    fn send(&mut self, bytes: &[u8]) -> Sent;

    /// The device's line now runs at this speed.
    fn set_baud(&mut self, _baud: u32) {}

    /// The speed to which the client that speaks has set its port, in bits per second, if that is
    /// known.
    fn client_baud(&mut self) -> Option<u32> {
        None
    }

    /// Whether a client can be told to wait, so that nothing that it sends is lost.
    fn has_handshake(&self) -> bool {
        true
    }

    /// Tells the client whether it may send, where there is a line for that. Where there is none
    /// it learns it from what is no longer taken.
    fn set_ready(&mut self, _ready: bool) {}

    /// The device switches a line of its own, which clients with modem lines see.
    fn set_line(&mut self, _line: ModemLine, _on: bool) {}

    /// Whether a client has said all it will say and may still wait for answers.
    fn has_listener(&self) -> bool {
        false
    }

    /// The device is at rest, so that no more answers will come: a client that only listened
    /// for them is let go as soon as it has them.
    fn dismiss_listener(&mut self) {}

    /// Whether nothing will ever come from it again.
    fn is_finished(&self) -> bool {
        false
    }
}

/// What a transport has to say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Received {
    /// So many bytes are in the buffer.
    Bytes(usize),
    /// A client has said all it will say, and listens.
    Finished,
    /// Something happened.
    News(LineEvent),
}

/// What became of bytes that were sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sent {
    /// Somebody has it open, so they are on their way.
    Accepted,
    /// Nobody has it open; they are gone.
    Nobody,
    /// Some clients that do not read lost their copies, so many bytes in all.
    Lost(u64),
}

/// Moves what fits from the front of a queue into a buffer.
fn take(queue: &mut VecDeque<u8>, buffer: &mut [u8]) -> usize {
    let n = queue.len().min(buffer.len());
    for (to, from) in buffer.iter_mut().zip(queue.drain(..n)) {
        *to = from;
    }
    n
}
