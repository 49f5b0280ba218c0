//! How job files are written: lines, commands, words, and what people are told about them.

mod command;
mod lenient;
mod parse;
mod ports;
mod print;
mod problem;
mod reader;
pub mod reference;
pub mod service;
mod text;
mod token;
mod value;
mod words;

pub use command::*;
pub use lenient::g_code;
pub use parse::parse;
pub use problem::{Excerpt, Problem, meant};
pub use text::{BYTE_ORDER_MARK, Lines, TextLine, decode, lines};
pub use value::{NotAValue, Value};

#[cfg(test)]
mod tests;
