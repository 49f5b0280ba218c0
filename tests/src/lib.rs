//! The fixture sessions: what a controller must do, as files that people read and write.
//!
//! [`mod@format`] reads them, [`runner`] plays them against any device, [`behaviour`] makes the
//! behaviour document from them. The keys and the script words are documented for people in
//! `fixtures/README.md`.
#![forbid(unsafe_code)]

pub mod behaviour;
pub mod format;
pub mod fuzzing;
pub mod runner;
pub mod script;
pub mod workshop;
