//! Controllers for a page: they answer the control API without a server, a clock or a thread.
//!
//! A [`Desk`] owns controllers and answers every route of the API in the words of the server, at the time
//! that is passed in; what happens comes as the messages of the WebSocket. Each controller keeps its past,
//! so that the debugger and the history are there from the first moment.
//!
//! As WebAssembly it imports nothing; [`wasm`] is how JavaScript calls it.
//!
//! Without the feature `past` it is the module that answers first: see `later.rs`.

#![cfg_attr(
    not(feature = "past"),
    expect(dead_code, reason = "only the past leads to other states, and out of them")
)]

mod acts;
mod ask;
mod call;
mod desk;
mod live;
mod looks;
mod own;
mod served;
mod snapshots;
pub mod wasm;

#[cfg(feature = "past")]
mod deeds;
#[cfg(feature = "past")]
mod kept;
#[cfg(feature = "past")]
mod opened;
#[cfg(feature = "past")]
mod past;
#[cfg(feature = "past")]
mod profiles;
#[cfg(feature = "past")]
mod recorder;
#[cfg(feature = "past")]
mod walk;
#[cfg(feature = "past")]
mod words;
#[cfg(feature = "past")]
mod work;

#[cfg(not(feature = "past"))]
mod later;
#[cfg(not(feature = "past"))]
mod present;
#[cfg(not(feature = "past"))]
use later::{deeds, kept, opened, past, profiles, recorder, words, work};

pub use ask::Reply;
pub use desk::Desk;
