//! What a controller did, and what is expected of it.
//!
//! A [`Journal`] keeps what happened, entry by entry: commands with what they mean, answers,
//! motions, ports, switches, program lines, warnings, and what people did at the machine, each at
//! its exact time and with the number of the command it belongs to. It gives them in
//! [words](Journal::story), as in the log of a conversation, or as [lines of
//! JSON](Journal::json_lines).
//!
//! An [`Expectation`](expect::Expectation) is a sentence about what has to happen, in order, how
//! often, never or always. It is checked against a journal, or followed while things happen, with
//! the same outcome; a [`Failure`](expect::Failure) says what was expected, what came closest, and
//! what happened around it.
//!
//! Nothing here knows a clock, a file or a thread.
#![forbid(unsafe_code)]

mod begun;
mod entry;
pub mod expect;
mod journal;
mod moves;
mod picture;
pub mod words;

pub use entry::{Entry, What};
pub use journal::Journal;
pub use moves::Move;
pub use picture::Picture;
