//! Virtual stepper controllers for programs in C, and in whatever can call C.
//!
//! `include/vimc4.h` is the way in and says what each function does; it is made from this crate. What is
//! here turns texts and pointers into calls of [`vimc4`] and back, and nothing else.
#![expect(
    unsafe_code,
    reason = "pointers come from C; each function says what it asks of its caller, and each block why that \
              is enough"
)]

mod emulator;
mod error;
mod line;
mod options;
mod text;

pub use emulator::*;
pub use error::vimc4_last_error;
pub use line::{Port, vimc4_connect, vimc4_line_close, vimc4_line_read, vimc4_line_write};
pub use text::vimc4_free;
