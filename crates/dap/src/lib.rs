//! The Debug Adapter Protocol for controllers: its messages, and a session that answers them.
//!
//! An editor speaks with a [`Session`]. The threads that it sees are controllers; the frames of a
//! stack are the executed line, the loops around it and the command. It goes forward and back
//! through the history of a controller with the debugger of `vimc4-debug`. The [`REQUESTS`] are one
//! table; any other request is answered with an error.
//!
//! Nothing here knows a clock, a socket or a file: a [`framing::Decoder`] finds the messages in the
//! bytes, and an [`Open`] opens what is to be debugged.
#![forbid(unsafe_code)]

mod arguments;
mod belonging;
mod console;
mod dispatch;
pub mod framing;
mod handles;
mod held;
mod life;
mod live;
mod looking;
mod message;
mod open;
mod points;
mod reading;
mod setting;
mod state;
mod table;
mod texts;
mod walking;

pub use dispatch::request_progress;
pub use live::{Live, Until};
pub use message::{Incoming, LARGEST, Outgoing, Refusal, Request};
pub use open::{ATTRIBUTES, Configuration, Open, Opened};
pub use state::Session;
pub use table::{REQUESTS, Row};
pub use walking::Running;
