//! Modem lines for a terminal that has none.
//!
//! A pseudo-terminal answers `TIOCMGET` and its relatives with `ENOTTY`, and programs that read CTS
//! or set DTR fail on it. This crate runs a program under a filter that makes the kernel ask about
//! these requests; a thread of this process answers them for one terminal and lets the kernel
//! handle all others. The program needs no library and no privilege, may be static or of 32 bits,
//! and so may everything that it starts.
//!
//! [`Lines`] is the port as the program sees it, without a process or a kernel. [`prepare`] makes a
//! process ready to run programs, and [`Running`] attends one until it ends.
//!
//! [`use_default_discipline`] is here because it needs unsafe code too.
//!
//! Unsafe code is in one module, `sys`, and nowhere else in the project.

#[cfg(unix)]
mod ignored;
mod launch;
mod state;

#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod linux;
#[cfg(not(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64"))))]
#[path = "elsewhere.rs"]
mod linux;

#[cfg(unix)]
pub use ignored::ignored_signals;
pub use launch::{Ending, LaunchError};
#[cfg(unix)]
pub use linux::use_default_discipline;
pub use linux::{Launcher, Port, Running, prepare};
pub use state::{
    CTS, Changed, Counts, DCD, DSR, DTR, Far, HostLine, Lines, Peer, RI, RTS, Settings,
};
