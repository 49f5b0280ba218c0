//! The isel NC intermediate format (NCP).
#![forbid(unsafe_code)]

mod diagnostic;
pub mod geometry;
pub mod job;
pub mod language;

pub use diagnostic::{Diagnostic, Problem, Severity};
