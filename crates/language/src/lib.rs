//! The texts that people type: conditions, faults, rules and orders.
//!
//! One [lexer](Lexer) serves all grammars, each grammar has one recursive-descent parser, and each
//! error is a [`SyntaxError`] with the place, what is expected there, and help. Completion and the help
//! texts of orders come from the same tables.
//!
//! # Architecture invariant
//!
//! This crate turns text into the data types of `device` and never runs a device. It knows no
//! controller family, clock, file or thread. Any crate above `device` may use it.
#![forbid(unsafe_code)]

mod complete;
mod condition;
mod damage;
mod deed;
mod error;
mod fault;
mod help;
mod lexer;
mod mishap;
mod order;
mod panel;
mod rule;
#[cfg(test)]
mod tests;
mod verb;
mod when;

pub use complete::{Completion, complete, completions, orders_of};
pub use condition::{known_command, known_error, read_condition};
pub use error::SyntaxError;
pub use fault::{read_fault, read_faulting};
pub use help::{help, help_on, list_signals};
pub use lexer::Lexer;
pub use order::Order;
pub use rule::{RulePart, read_rule, read_rule_of, read_ruling};
pub use verb::{Form, Sort, Verb};
