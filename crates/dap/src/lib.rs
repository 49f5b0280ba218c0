//! The Debug Adapter Protocol for controllers: its messages, and a session that answers them.
#![forbid(unsafe_code)]

pub mod framing;
