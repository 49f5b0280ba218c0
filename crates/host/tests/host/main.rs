//! The host around a small device of its own, over every transport.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod clocks;
mod fake;
mod inputs;
mod journeys;
mod pacing;
mod pauses;
#[cfg(target_os = "linux")]
mod pty;
mod reports;
mod rfc2217;
#[cfg(unix)]
mod serial;
mod tcp;
mod wire;
