//! The outcome of running a program: how it ended, or why it did not start.

use std::error::Error;
use std::fmt;
use std::io;
use std::path::PathBuf;

/// How a program has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// By itself, with this code.
    Code(u8),
    /// By this signal.
    Signal(i32),
}

/// Why a program cannot be run. Nothing has been started then.
#[derive(Debug)]
#[non_exhaustive]
pub enum LaunchError {
    /// Modem lines cannot be answered on this system.
    NotHere,
    /// The kernel is too old; its release.
    OldKernel(String),
    /// This process is itself run in this way, or in another that answers for the kernel, and
    /// there can be only one.
    Nested,
    /// The system does not allow the filter.
    Filter(io::Error),
    /// There is no terminal of this name.
    NoTerminal(PathBuf),
    /// The port has modem lines of its own.
    RealPort(PathBuf),
    /// The program cannot be executed.
    Program {
        /// Its name, as it was given.
        name: String,
        /// What the system says.
        source: io::Error,
    },
    /// Something else that is needed is missing.
    System(io::Error),
}

impl fmt::Display for LaunchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LaunchError::NotHere => f.write_str(
                "modem lines can be answered on Linux with x86-64 or aarch64 only; use TCP or a \
                 real serial port",
            ),
            LaunchError::OldKernel(release) => write!(
                f,
                "the kernel is {release}, and answering for it takes 5.5 or later; use TCP or a \
                 real serial port"
            ),
            LaunchError::Nested => f.write_str(
                "somebody answers system calls for the kernel here already, and there can be only \
                 one; start the program outside of `vimc4 lines` or the container that does it",
            ),
            LaunchError::Filter(error) => write!(
                f,
                "the system does not allow a filter for system calls: {error}; a container may \
                 have to allow seccomp"
            ),
            LaunchError::NoTerminal(path) => write!(
                f,
                "there is no terminal {path}; start `vimc4 serve`, or let this command do it with \
                 --serve",
                path = path.display()
            ),
            LaunchError::RealPort(path) => write!(
                f,
                "{path} is not a pseudo-terminal and has lines of its own; give the link that `vimc4 \
                 serve` prints",
                path = path.display()
            ),
            LaunchError::Program { name, source } => match source.kind() {
                io::ErrorKind::NotFound => {
                    write!(f, "there is no program {name}; check its name, or give its path")
                }
                _ => write!(f, "cannot run {name}: {source}"),
            },
            LaunchError::System(error) => write!(f, "cannot watch a program: {error}"),
        }
    }
}

impl Error for LaunchError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            LaunchError::Filter(error)
            | LaunchError::System(error)
            | LaunchError::Program { source: error, .. } => Some(error),
            LaunchError::NotHere
            | LaunchError::OldKernel(_)
            | LaunchError::Nested
            | LaunchError::NoTerminal(_)
            | LaunchError::RealPort(_) => None,
        }
    }
}
