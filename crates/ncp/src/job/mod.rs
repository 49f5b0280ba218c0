//! What a job asks for, line by line: checking it, and cutting it into commands.

mod action;
mod drill;
mod emitter;
mod field;
mod interpreter;
mod place;
mod problem;
mod resume;
mod run;
mod target;
mod unmapped;
mod zero;

pub use action::{InputTest, OutputChange, Question};
pub use emitter::Step;
pub use field::{Field, compile};
pub use interpreter::{Options, Standing};
pub use problem::{Accessories, PortName, PortNames, Problem, Why};
pub use resume::{NoResumption, Resumption};
pub use run::{Job, Order, Summary, check, delays};
pub use target::{Controller, Direction, InputPort, OutputPort, Target};
pub use zero::{NoZero, Register, Zero};
