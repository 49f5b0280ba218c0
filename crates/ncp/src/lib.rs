//! The isel NC intermediate format (NCP): job files, from their text to the commands of an isel
//! controller.
//!
//! A job goes through four stages, and each can be used alone:
//!
//! 1. [`language`] reads: bytes become text, text lines, a line a
//!    [`Instruction`](language::Instruction) with its words and their places. Its
//!    [`reference`](language::reference) is the table of all commands, which also feeds the
//!    [`service`](language::service) for editors.
//! 2. [`job`] interprets: it knows where the tool is, exactly, and the machine and controller it is
//!    for, a [`Target`](job::Target). It checks every line before any of it is done.
//! 3. [`geometry`] turns real ways into motions of a controller: arcs become circles of whole
//!    numbers or chords, moves with a rotary axis become pieces.
//! 4. [`job`] hands the result out: as [`Step`](job::Step)s, one at a time, for the code that runs the
//!    job, or as a [`Field`](job::Field) that a controller stores.
//!
//! Remarks about a line are [`Diagnostic`]s: place, severity, message, and what would be right.
//! Nothing here knows a clock, a port or a file.
//!
//! ```
//! use vimc4_ncp::job::{Controller, Options, Target, check};
//! use vimc4_isel_wire::Dialect;
//! use vimc4_motion::Ramp;
//! use vimc4_plant::Machine;
//!
//! let machine = Machine::builtin("mill").expect("a built-in machine");
//! let controller = Controller {
//!     dialect: Dialect::Imc4,
//!     speeds: 20..=20_000,
//!     ramp: Ramp { start_stop: 300, acceleration: 100 },
//!     inputs: Default::default(),
//!     outputs: Default::default(),
//!     memory: 32_768,
//!     command_bytes: 1,
//!     parameter_bytes: 4,
//!     branch_from_next: true,
//! };
//! let target = Target::new(controller, &machine);
//! let mut said = Vec::new();
//! let job = "IMF_PBL_V1.0\nREF XYZ\nMOVEABS X400000\nPROGEND\n";
//! let summary = check(job, &target, Options::default(), &mut |diagnostic| {
//!     said.push(format!("line {}: {}", diagnostic.line, diagnostic.problem));
//! });
//! assert_eq!(summary.errors, 1);
//! assert_eq!(
//!     said,
//!     ["line 3: X would go to 400000 in machine coordinates; its travel ends at 300000"]
//! );
//! ```
#![forbid(unsafe_code)]

mod diagnostic;
pub mod geometry;
pub mod job;
pub mod language;
mod severity;

pub use diagnostic::{Diagnostic, Problem};
pub use severity::Severity;
