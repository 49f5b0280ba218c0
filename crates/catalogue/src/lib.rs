//! The catalogue: the families of controllers as one [`Controller`], their models and machines, and
//! what a tool must know of a family without speaking its language ([`Handling`]).
//!
//! Nothing here knows a clock, a file or a port. A profile comes as text, a controller is a
//! [`Device`](vimc4_device::Device), and in virtual time a [`Harness`](vimc4_device::Harness)
//! drives it:
//!
//! ```
//! use vimc4_catalogue::{Handling, bare, machine, model};
//! use vimc4_device::Harness;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (model, machine) = (model("imc4")?, machine("bench")?);
//! let mut imc4 = Harness::new(bare(&model, &machine, &[])?);
//! assert_eq!(imc4.ask(b"@01\r")?, b"0");
//! assert_eq!(imc4.ask(b"@0A1000,900\r")?, b"0");
//! let answer = imc4.ask(b"@0X\r")?;
//! let refusal = Handling::of(&model).refusal(b"@0X\r", &answer);
//! assert_eq!(refusal.as_deref(), Some("5: unknown or malformed command"));
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
// With a single family compiled in, nothing belongs to another.
#![cfg_attr(
    not(feature = "lpkf"),
    expect(unreachable_patterns, reason = "what is written for several families")
)]

// Its macro makes what the list names, and the list makes what all other modules use.
#[macro_use]
mod families;

mod axes;
mod controller;
mod family;
mod handling;
mod list;
mod model;
mod names;
mod scenario;

pub use axes::{all_names, axis};
pub use controller::Controller;
pub use handling::Handling;
pub use list::{Details, Family, Model, State};
pub use names::{
    Unknown, bare, machine, machine_profile, machines, model, model_profile, models, models_like,
    quirks,
};
pub use scenario::scenario;
pub use vimc4_device::{Effects, MemoryError, Piece, Turn};
pub use vimc4_plant::{Machine, Measure, ProfileError, profile_text};

/// What only isel's controllers show in their [`Details`].
pub mod isel {
    pub use vimc4_isel::{
        Details, Interpolation, LoopView, NoMotion, Plane, ProgramStatus, ProgramView,
    };
}

/// What only LPKF's controllers show in their [`Details`].
#[cfg(feature = "lpkf")]
pub mod lpkf {
    pub use vimc4_lpkf::language::{Mode, Trackball};
    pub use vimc4_lpkf::{AxisSettings, Details, Head, StoppedBy};
    pub use vimc4_plant::Unit;
}
