//! The LPKF controllers SMCU and MotionSystem.
//!
//! A [`Controller`] is a [`Device`](vimc4_device::Device): bytes, signals and times go in,
//! bytes, events and times come out. Inside, data flows one way, and so do these modules:
//!
//! * [`language`] turns bytes into commands and statuses into words;
//! * `receive` puts commands into the buffer, or past it, and takes them out in order;
//! * `execute` says what each of them does, `job` does it stage by stage;
//! * `moves` and `reference` run the axes, `stop` is everything that breaks them off;
//! * `ports`, `channel` and `interface` are what else is connected;
//! * `signals` is the outside world, `view` and `forecast` show what is and what will be.
//!
//! A model of controller is data, see [`Model`].
#![forbid(unsafe_code)]

mod channel;
mod controller;
mod effects;
mod execute;
mod forecast;
mod interface;
mod job;
mod knowledge;
pub mod language;
mod model;
mod moves;
mod ports;
mod receive;
mod reference;
mod settings;
mod signals;
mod state;
mod stop;
mod text;
mod view;
mod why;

pub use controller::Controller;
pub use model::{
    AfterStatus, BarePairs, Buffer, CommandSet, DecimalSpeed, Defaults, InitEcho, InitReply,
    Interface, Io, Language, Limits, LineFeed, LineProfile, Model, Quirks, Reference,
    ResolutionUnit, SpindleUnit, StatusDigits, Ta, Texts, UnknownCommand, UnknownPairs,
};
pub use state::State;
pub use view::{AxisSettings, Details, Head, StoppedBy};
