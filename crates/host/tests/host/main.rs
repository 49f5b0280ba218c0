//! The host around a small device of its own, over every transport.

mod clocks;
mod fake;
mod pacing;
#[cfg(target_os = "linux")]
mod pty;
mod tcp;
mod wire;
