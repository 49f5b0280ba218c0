//! How much of a controller's protocol a host's tests have met, out of all that the controller can do.
//!
//! What is possible is enumerated from the tables of the families
//! ([`Model::abilities`](vimc4_catalogue::Model::abilities)): every form of every command, the answers it
//! can give, the states it can find, and what can stop it while it does what. What is not listed there
//! cannot happen and is not counted. What was met is collected from the events of a controller.
//!
//! ```
//! use vimc4_catalogue::{bare, machine, model};
//! use vimc4_coverage::Collector;
//! use vimc4_device::Harness;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (model, machine) = (model("imc4")?, machine("bench")?);
//! let mut collector = Collector::new(&model);
//! let mut imc4 = Harness::new(bare(&model, &machine, &[])?).watching(Collector::KINDS);
//! imc4.ask(b"@01\r")?;
//! imc4.ask(b"@0A1000,900\r")?;
//! for event in imc4.outputs().iter().filter_map(|output| output.event()) {
//!     collector.see(event);
//! }
//! let coverage = collector.coverage();
//! let moves = coverage.command("@A").ok_or("the model has it")?;
//! assert!(moves.answers.iter().any(|answer| answer.name == "0" && answer.met == 1));
//! assert!(coverage.missing().iter().any(|line| line.starts_with("`@A`: during “move” you never met the stop byte")));
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]

mod collector;
mod coverage;
mod html;
mod lcov;
mod table;

pub use collector::Collector;
pub use coverage::{Command, Coverage, CoverageError, Point, Total, Totals};
pub use lcov::Lcov;
