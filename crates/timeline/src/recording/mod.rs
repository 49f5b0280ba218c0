//! Recordings: what happened to a controller, written line by line, and played again.
//!
//! A recording is text, one JSON object a line: a [`Head`] that says which controller was recorded,
//! and then an [`Entry`] for each thing that went in or came out, with its exact time. That is
//! enough to repeat everything: a device that starts from the recorded state and gets the recorded
//! inputs at their times sends the recorded bytes.
//!
//! ```
//! use vimc4_timeline::recording::{Given, Recording, What};
//!
//! let text = concat!(
//!     r#"{"recording":1,"program":"vimc4","family":"isel","model":{},"machine":{},"clock":"real","line":"ideal","from":"serve"}"#, "\n",
//!     r#"{"at":0,"in":"@07\r","by":"tcp: 127.0.0.1:40000"}"#, "\n",
//!     r#"{"at":0,"out":"0"}"#, "\n",
//! );
//! let recording = Recording::read(text.as_bytes())?;
//! let What::Given { given: Given::Bytes(bytes), .. } = &recording.entries[0].what else { panic!() };
//! assert_eq!(&bytes[..], b"@07\r");
//!
//! // What is written is what was read.
//! assert_eq!(recording.write(), text.as_bytes());
//! # Ok::<(), vimc4_timeline::recording::ReadError>(())
//! ```

mod compare;
mod comparison;
mod entry;
mod play;
mod read;
mod reply;
mod shorten;
mod text;

pub use compare::{
    Aside, Difference, Divergence, FieldDifference, Said, SaidDifference, Side, SoFar, Tolerance,
    alike, first_field, given_apart, part, said_apart, say_otherwise, states_apart,
};
pub use comparison::{Comparison, Mismatch, MismatchKind, check, first_mismatch};
pub use entry::{Entry, Given, Head, LineSort, VERSION, WALL, What};
pub use play::{Player, Seen, StateError, Told, exchange};
pub use read::{ReadError, Reader, Recording};
pub use reply::Reply;
pub use shorten::{cut, minimise, rerecord};
