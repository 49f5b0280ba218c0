//! The control API: see and steer running controllers over HTTP, with JSON and a WebSocket.
//!
//! Every [route](https://spec.openapis.org/oas/v3.1.0) is a method of the library, or an order of
//! standard input in the same words: there is no second language. The table of the routes is the
//! one source of the router, of the OpenAPI document and of the page that people read. It is in
//! `vimc4-answers`, with all that is asked and answered elsewhere, too.
//!
//! A [`Server`] has a thread of its own. What happens at a controller is put into words and JSON
//! there, and only when somebody asks; the controller's thread keeps it and no more.
//!
//! ```
//! use std::io::{Read, Write};
//! use std::net::TcpStream;
//! use vimc4::{Clock, Emulator};
//! use vimc4_api::{Place, Server};
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let emulators = [Emulator::builder().time(Clock::Manual).start()?];
//! let server = Server::start(Place::take("127.0.0.1:0", None)?, &emulators, None).await?;
//!
//! let mut client = TcpStream::connect(server.address())?;
//! let host = server.address();
//! write!(client, "GET /v1 HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")?;
//! let mut answer = String::new();
//! client.read_to_string(&mut answer)?;
//! assert!(answer.starts_with("HTTP/1.1 200 OK"), "{answer}");
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]

mod acts;
mod bell;
mod call;
mod debugger;
mod document;
mod events;
mod expectations;
mod expecting;
mod files;
mod film;
mod guard;
mod holding;
mod limits;
mod past;
mod reading;
mod recordings;
mod refusal;
mod served;
mod server;
mod table;

pub use debugger::{Debugging, Open, Reined, Reins};
pub use film::Film;
pub use guard::Token;
pub use past::{Memory, Past};
pub use server::{Place, Server, ServerError};
pub use vimc4_answers::entry::KINDS;
pub use vimc4_answers::past::{Goal, line_remedy};
