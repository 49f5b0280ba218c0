//! The world around a session: transports, timers, flash files, and the tokio loop that drives it.
//!
//! Everything is generic over [`Device`](vimc4_device::Device) and knows no model. A [`Runner`] drives the
//! session of a device; a [`Handle`] controls it from elsewhere.
#![forbid(unsafe_code)]

mod advance;
mod connections;
mod flash;
mod handle;
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
mod wake_flag;
mod wire;
mod worker;

pub use advance::{Progress, TimeAdvance};
pub use flash::{FlashFile, FlashFileError, is_at, unix_lines};
pub use handle::Handle;
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
    BreakpointId, BreakpointView, Clock, ClockError, ControlError, Deed, Effect, EventFilter,
    LineEvent, Pause, Rate, Report, ReportKind, Sink, SinkId, Source, Step, Verbosity,
};
pub use worker::Worker;
