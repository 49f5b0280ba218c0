//! The LPKF controllers SMCU and MotionSystem.
//!
//! A [`Controller`] is a [`Device`](vimc4_device::Device): bytes, signals and times go in, bytes,
//! events and times come out. Inside, data flows one way: no file uses one that leads back to it.
//! [`State`] decides, and one place, `controller`, carries out what its methods return; there is
//! the whole life of a command, from the line to its answer:
//!
//! * [`language`] turns bytes into commands and statuses into words;
//! * `admission` says which of them begin at once, wait in the `buffer` or are refused;
//! * `execute` says what each of them does, `job` begins it stage by stage;
//! * `moves` and `reference` make motions, `halting` has everything that aborts them;
//! * `ports`, `channel` and `trackball` are the other connections;
//! * `signals` is the outside world, `cause` says what happens by itself, and when;
//! * `why` has the reasons of statuses, `words` puts them into words for people;
//! * `view` and `forecast` show the present and the future;
//! * `device` is the contract, `knowledge` what a tool must know of the family.
//!
//! A model of controller is data, see [`Model`].
#![forbid(unsafe_code)]

mod admission;
mod buffer;
mod cause;
mod channel;
mod controller;
mod device;
mod effects;
mod execute;
mod forecast;
mod halting;
mod job;
mod knowledge;
pub mod language;
mod mishaps;
mod model;
mod moves;
mod ports;
mod reference;
mod settings;
mod signals;
mod state;
mod text;
mod trackball;
mod view;
mod why;
mod words;

pub use controller::Controller;
pub use model::{
    AfterStatus, BarePairs, Buffer, DecimalSpeed, Defaults, InitEcho, InitReply, Interface, Io,
    Language, Limits, LineFeed, LineProfile, Model, Quirks, Reference, ResolutionUnit, SpindleUnit,
    StatusDigits, Ta, Texts, UnknownCommand, UnknownPairs,
};
pub use state::State;
pub use view::{AxisSettings, Details, Head, StoppedBy};
