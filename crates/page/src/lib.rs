//! Controllers for a page: they answer the control API without a server, a clock or a thread.
//!
//! A [`Desk`] owns controllers and answers every route of the API in the words of the server, at the time
//! that is passed in; what happens comes as the messages of the WebSocket. Each controller keeps its past,
//! so that the debugger and the history are there from the first moment.
//!
//! As WebAssembly it imports nothing; [`wasm`] is how JavaScript calls it.

mod acts;
mod ask;
mod call;
mod desk;
mod kept;
mod live;
mod own;
mod pace;
mod past;
mod recorder;
mod served;
mod snapshots;
pub mod wasm;
mod work;

pub use ask::Reply;
pub use desk::Desk;
