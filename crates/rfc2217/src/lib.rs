//! RFC 2217, the serving side: a serial port with its settings and lines over Telnet.
//!
//! It knows no socket. What a client has sent goes into [`Server::receive`], which leaves the bytes
//! that were meant for the device; what a device says is made ready for the client by
//! [`Server::send`]. What Telnet itself has to answer is collected in between and fetched by
//! [`Server::take_replies`], what the client wants of the port by [`Server::next_request`].
//!
//! ```
//! use vimc4_rfc2217::{Request, Server};
//!
//! let mut server = Server::new("a controller", 19_200);
//! assert!(!server.take_replies().is_empty(), "it begins with what it offers");
//!
//! // IAC SB COM-PORT-OPTION SET-BAUDRATE 9600 IAC SE, and a byte for the device behind it.
//! let mut bytes = *b"\xff\xfa\x2c\x01\x00\x00\x25\x80\xff\xf0@";
//! let count = server.receive(&mut bytes);
//! assert_eq!(&bytes[..count], b"@");
//! assert_eq!(server.next_request(), Some(Request::Baud(9_600)));
//! assert_eq!(server.take_replies(), b"\xff\xfa\x2c\x65\x00\x00\x25\x80\xff\xf0");
//! ```
#![forbid(unsafe_code)]

mod negotiation;
mod port;
mod server;
mod telnet;

pub use port::{CTS, DCD, DSR, Parity, RI, Request, StopBits};
pub use server::Server;
