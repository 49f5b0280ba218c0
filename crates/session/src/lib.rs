//! What a running controller tells those who watch it, and what it is told by those who steer it:
//! reports, sources, effects, breakpoints and clocks, and the words for them.
//!
//! Whoever runs a controller, with ports and a clock of the computer or in a page, tells the same of
//! it. Nothing here knows a clock, a thread or a port.
#![forbid(unsafe_code)]

mod breakpoints;
mod clients;
mod clock;
mod effect;
mod error;
mod line_feeds;
pub mod order;
mod pace;
mod partial_line;
mod pause;
mod report;
mod sinks;
mod talk;
mod transmission;

pub use breakpoints::{BreakpointView, Breakpoints, Met};
pub use clients::LineClients;
pub use clock::{Clock, ClockError, Rate};
pub use effect::{Effect, NO_MORE_FAULTS, NO_MORE_RULES, why_without_effect};
pub use error::ControlError;
pub use pace::Pace;
pub use pause::{Pause, Step};
pub use report::{BreakpointId, Deed, News, Report, Sink, Source, Wants, What};
pub use sinks::{SinkId, Sinks};
pub use talk::{Talk, Teller, Verbosity};
pub use transmission::Transmission;
