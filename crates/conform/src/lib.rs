//! The fixture sessions: what a controller must do, as files that people read and write.
//!
//! * [`mod@format`] and [`script`] read them, [`source`] reads where each is known from,
//!   [`fixtures`] has the built-in ones;
//! * [`workshop`] makes the controllers that they are about, and [`play`](mod@play) plays them
//!   on such a device, in the model's own time;
//! * [`transcript`] tells step by step how one goes, for people to read;
//! * [`choice`] says which of them can be played through a port, and what that would do to the
//!   machine behind it;
//! * [`player`] plays one through a port without knowing the port or a clock, and [`rehearsal`]
//!   does so with a simulated port;
//! * [`explain`] looks for the value of the profile that explains a difference.
//!
//! Everything here is pure: time is passed in, and nothing knows a clock, a socket or a thread.
//! The keys and the script words are documented for people in `fixtures/README.md`.
#![forbid(unsafe_code)]

pub mod choice;
pub mod explain;
pub mod fixtures;
pub mod format;
pub mod play;
pub mod player;
pub mod rehearsal;
pub mod script;
pub mod source;
pub mod transcript;
pub mod travel;
pub mod workshop;
