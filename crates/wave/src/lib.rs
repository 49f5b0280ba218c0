//! What a controller does, as a logic analyser draws it.
//!
//! An [`Analyser`] sees everything that goes into a device and comes out of it and draws it while it
//! happens, in order of time and exact to the nanosecond: step, direction and enable of each axis,
//! limit switches, spindle, ports and signals, the bits on the serial line and their text, the state
//! in words. It draws on any number of [`Sheet`]s: [`Vcd`] and [`Fst`] for viewers of waveforms,
//! [`Csv`] for spreadsheets, [`Trace`] for Perfetto. [`layout`] has what a viewer shows first.
//!
//! Nothing here grows with what was drawn. Steps are enumerated by [`vimc4_motion`], and only when
//! their time has come.
#![forbid(unsafe_code)]

mod analyser;
mod csv;
mod fst;
pub mod layout;
mod pens;
mod pulses;
mod scene;
mod sheet;
mod trace;
mod uart;
mod vcd;

pub use analyser::{Analyser, Pacing};
pub use csv::Csv;
pub use fst::Fst;
pub use scene::{Drives, Id, Kind, Scene, Signal, Span, Track, Value};
pub use sheet::{Paper, Sheet};
pub use trace::Trace;
pub use vcd::Vcd;
