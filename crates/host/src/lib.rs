//! What stands between a simulated device and the world: clocks, transports, flash files and
//! the task that runs it all.
//!
//! Everything is generic over [`Device`](vimc4_device::Device) and knows no model. A
//! [`Runner`] owns a device, usually at the end of a [`Line`](vimc4_device::Line), and calls it
//! directly; a [`Handle`] controls it from elsewhere.
#![forbid(unsafe_code)]

mod bell;
mod connections;
mod flash;
mod handle;
mod journey;
mod pending;
mod reports;
mod runner;
mod storage;
mod timer;
#[cfg(feature = "tracing")]
mod traces;
mod traffic;
mod transport;
mod turn;
mod wire;
mod worker;

pub use flash::{FlashFile, FlashFileError, is_at, unix_lines};
pub use handle::Handle;
pub use journey::{Journey, Progress};
pub use pending::{Pending, block_on};
pub use reports::{Reports, Tap};
pub use runner::{RunError, Runner};
#[cfg(feature = "tracing")]
pub use traces::Traces;
pub use traffic::{SuppressedWarnings, Traffic};
pub use transport::{
    Clients, HostLines, Memory, MemoryPort, Modem, Received, Sent, Tcp, TcpError, Transport,
};
#[cfg(all(unix, feature = "pty"))]
pub use transport::{LinkError, Pty, PtyError, PtyLink, User, Users};
#[cfg(feature = "serial")]
pub use transport::{Serial, SerialError};
pub use vimc4_session::{
    BreakpointId, BreakpointView, Clock, ClockError, ControlError, Deed, Effect, News, Pause, Rate,
    Report, Sink, SinkId, Source, Step, Verbosity, Wants, What,
};
pub use worker::Worker;
