//! The simulated machine behind a controller: axes and carriages, limit and reference
//! switches, the operating panel, the outside of the input ports.
//!
//! The plant knows where things really are; a controller only counts steps. The two diverge where
//! steps are lost, and only a reference run reconciles them. What a machine is like comes from a
//! profile, see [`Machine`].
#![forbid(unsafe_code)]

mod faults;
mod job;
mod machine;
mod plant;
mod profile;
mod signal;
mod slide;

pub use job::{
    Accessory, Analogue, JobPorts, JobRegisters, JobSetup, JobZero, Output, Spindle, Up,
};
pub use machine::{Axes, Axis, End, Machine, Measure, Motor, Reference, Unit};
pub use plant::{Contact, Followed, Jams, Panel, Plant};
pub use profile::{Builtins, ProfileError, parse_profile, profile_text, with_all_missing};
pub use signal::PlantSignal;
pub use slide::{Slide, Way};
