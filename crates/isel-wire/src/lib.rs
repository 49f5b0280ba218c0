//! The isel @-format: from bytes to meaning and back.
//!
//! The controllers of the IMC4 family are spoken to in lines. A direct (DNC) line such as
//! `@0A5000,900` is executed when its CR arrives; between `@0i` and `9` lines such as
//! `05000,900` are stored (CNC) as a program. Three [`Dialect`]s of the language exist.
//!
//! A byte becomes meaning in four steps, and each can be taken alone:
//!
//! 1. [`control`] picks out the three bytes that act at once; [`LineBuffer`] collects the rest
//!    into a [`ReceivedLine`].
//! 2. [`parse`] finds the addressee of the line, and splits it into a [`Frame`]: a known operation
//!    and its fields, not yet read.
//! 3. [`Frame::check_count`] and [`Frame::decode`] count, read and check the fields; what comes
//!    out is a [`Command`], or the [`Fault`] that says what is wrong and which [`Reply`] that is.
//! 4. [`Command::print`] goes all the way back.
//!
//! Between these steps the controller asks what only it can know, because the order of errors is
//! fixed: after `5` comes what the plant forbids, then missing axes, then the count, then what
//! the stored program forbids, and only then numbers, speeds and axes.
//!
//! [`table`] lists every command with its section in the manuals and every reply it can get.
//!
//! The manuals are cited by year: 99 is `imc4-1999-en`, 05 is `imc4-m-2005-de`, 12 is
//! `imc-xx-2012-de`. Where they are silent, the comments say what is assumed.
//!
//! ```
//! use vimc4_isel_wire::{
//!     Addressed, AxisSet, Context, Dialect, Fractions, ReceivedLine, LineBuffer, Mode, PortMap, parse,
//! };
//!
//! struct NoPorts;
//! impl PortMap for NoPorts {
//!     fn reads(&self, _port: u16) -> bool { false }
//!     fn writes(&self, _port: u16, _value: u16) -> bool { false }
//!     fn is_logical(&self, _port: u16) -> bool { false }
//! }
//!
//! let context = Context {
//!     axes: AxisSet::X,
//!     speeds: 20..=20_000,
//!     fractions: Fractions::Reject,
//!     ports: &NoPorts,
//!     bit_base_one: false,
//!     any_bit_value: false,
//!     any_axes: false,
//!     two_is_xy: false,
//!     zero_at_rest: false,
//!     line: None,
//! };
//! let mut buffer = LineBuffer::default();
//! let mut lines = b"@0A 5000, 900\r\n".iter().filter_map(|&byte| buffer.push(byte));
//! let Some(ReceivedLine::Text(line)) = lines.next() else { panic!("no line") };
//!
//! match parse(&line, Dialect::Imc4, Mode::Direct, 0) {
//!     Ok(Addressed::Frame(frame)) => {
//!         let command = frame.decode(&context).expect("a correct line");
//!         assert_eq!(command.describe(AxisSet::X), "relative move X +5,000 steps at 900 Hz");
//!
//!         let mut printed = Vec::new();
//!         command.print(Dialect::Imc4, Mode::Direct, 0, &mut printed);
//!         assert_eq!(printed, b"@0A5000,900");
//!     }
//!     Ok(Addressed::OtherDevice) => {}
//!     Err(fault) => println!("answer {}", fault.reply()),
//! }
//! ```
#![forbid(unsafe_code)]

mod axes;
mod command;
mod decode;
mod describe;
mod dialect;
mod fault;
mod frame;
mod number;
mod print;
mod receive;
mod reply;
mod table;
#[cfg(test)]
mod tests;

pub use axes::{AxisSet, NoAxisSet};
pub use command::{
    ArcArgs, Bit, BitTest, Command, Direction, Init, Pair, Pairs, Plane, PortTest, Speeds, Text32,
    WrongLength, WrongText,
};
pub use decode::{Context, PortMap};
pub use dialect::{Dialect, Fractions, Mode};
pub use fault::{Fault, WrongAxes, WrongNumber};
pub use frame::{Addressed, Frame, parse};
pub use receive::{Control, LINE_MAX, LineBuffer, ReceivedLine, control};
pub use reply::Reply;
pub use table::{Class, CommandSpec, Fields, Op, spec, table};
