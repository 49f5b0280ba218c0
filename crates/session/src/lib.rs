//! A device in its run loop: a clock, breakpoints, waiting callers, reports, and operator actions.
//!
//! A server, a page, or a test has the ports and the clock, and drives a [`Session`] from outside.
//!
//! Architecture invariant: nothing here knows a clock, a thread, a port, or a file. Time is passed in,
//! and outputs are polled.
#![forbid(unsafe_code)]

mod actions;
mod advance;
mod breakpoints;
mod clients;
mod clock;
mod effect;
mod engine;
mod error;
mod line_feeds;
pub mod order;
mod pace;
mod partial_line;
mod pause;
mod replay;
mod report;
mod request;
mod requests;
mod session;
mod sinks;
mod talk;
mod transmission;
mod waiters;

pub use breakpoints::{BreakpointView, Breakpoints, Met};
pub use clock::{Clock, ClockError, Rate};
pub use effect::{Effect, NO_MORE_FAULTS, NO_MORE_RULES, why_without_effect};
pub use engine::SessionOutput;
pub use error::ControlError;
pub use pause::{Pause, Step};
pub use report::{BreakpointId, Deed, EventFilter, LineEvent, Report, ReportKind, Sink, Source};
pub use request::{AdvanceRequest, Completion, Destination, Progress, RequestId, Work};
pub use session::Session;
pub use sinks::{SinkId, Sinks};
pub use talk::{Talk, Teller, Verbosity};
