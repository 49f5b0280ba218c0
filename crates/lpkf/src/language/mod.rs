//! The language of the LPKF controllers: from bytes to meaning and back.
//!
//! The SMCU and the MotionSystem understand HPGL and commands of their own, which begin with `!`.
//! The language has two [`Dialect`]s, and a [`Grammar`] holds the further differences between
//! machines that speak one.
//!
//! 1. A [`Reader`] takes the bytes of the line and hands out [`Item`]s: commands, and what is
//!    for the unit on the second channel.
//! 2. [`parse`] says what one command means: it is a [`Command`], or the [`Status`] that refuses
//!    it. The order of its checks is fixed.
//! 3. [`Command::check`] checks what depends on the machine: axes that are not fitted, speeds,
//!    accelerations and resolutions.
//! 4. [`Command::print`] goes all the way back, and [`Command::describe`] puts it into words.
//!
//! [`forms`] lists every form of every command with what it takes and who has it, [`Status::ALL`]
//! everything that can go wrong.
//!
//! The manual is cited by the headings of its chapters. Where it is silent, the comments say what
//! is assumed and what has been seen in the field.
//!
//! ```
//! use vimc4_lpkf::language::{Dialect, Item, Reader, Status};
//!
//! let mut reader = Reader::new(Dialect::Smcu);
//! let mut items = Vec::new();
//! for &byte in b"PA 1000,2000PD!VZ;" {
//!     reader.feed(byte, |item| items.push(item));
//! }
//!
//! let [Item::Command { command: Ok(command), .. }, pen_down, too_few] = &items[..] else {
//!     panic!("three commands");
//! };
//! assert_eq!(command.describe(), "move to X 1,000 Y 2,000");
//! let mut printed = Vec::new();
//! command.print(&mut printed);
//! assert_eq!(printed, b"PA1000,2000;");
//!
//! assert!(matches!(pen_down, Item::Command { raw, .. } if raw == b"PD"));
//! let Item::Command { command: Err(status), .. } = too_few else { panic!("it has no speed") };
//! assert_eq!(*status, Status::MissingParameter);
//! assert_eq!(status.written(Dialect::Smcu, false).as_deref(), Some("E07"));
//! ```

mod check;
mod command;
mod describe;
mod dialect;
mod grammar;
mod number;
mod parameter;
mod parse;
mod print;
mod read;
mod refusal;
mod status;
mod table;
#[cfg(test)]
mod tests;

pub use check::{AxisLimits, Limits, Misfit, Value};
pub use command::{Axis, Command, Mode, Trackball, Turn, Vector};
pub use dialect::Dialect;
pub use grammar::Grammar;
pub use number::{Number, numbers};
pub use parameter::{Kind, Parameter};
pub(crate) use parse::TURN;
pub use parse::{VECTORS_MAX, letters, parse};
pub use read::{COMMAND_MAX, Item, Reader};
pub use refusal::{remarks, why_ignored, why_refused};
pub use status::{Side, Status};
pub use table::{Answer, Count, Form, Op, forms};
