//! What can go wrong, each with its remedy.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use thiserror::Error;
use vimc4_catalogue::{MemoryError, ProfileError, Unknown};
use vimc4_device::ScenarioError;
use vimc4_host::{ControlError, FlashFileError, RunError, TcpError};
#[cfg(all(unix, feature = "pty"))]
use vimc4_host::{LinkError, PtyError};

use vimc4_journal::expect::{Failure, Mistake};
use vimc4_language::SyntaxError;

use crate::recording::RecordingError;

/// Why an emulator does not start, or does not do what it is told.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// No built-in model or machine has this name.
    #[error("there is no {what} `{name}`; built in are {known}, or name a profile file")]
    Unknown {
        /// `model` or `machine`.
        what: &'static str,
        /// The name.
        name: String,
        /// The names that would be right.
        known: String,
    },
    /// A profile cannot be read.
    #[error(
        "cannot read the {what} profile {path}: {source}; check the name of the file, or use a \
         built-in {what}",
        path = .path.display()
    )]
    File {
        /// `model` or `machine`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// A file holds no profile.
    #[error(transparent)]
    Profile(#[from] Box<ProfileFileError>),
    /// The words describe no fault.
    #[error(transparent)]
    Fault(SyntaxError),
    /// A scenario cannot be read.
    #[error("cannot read the scenario {path}: {source}; check the name of the file", path = .path.display())]
    ScenarioFile {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The words describe no rule.
    #[error(transparent)]
    Rule(SyntaxError),
    /// The rules of a scenario do not go together.
    #[error("rule {place} is wrong: {0}; {right}", place = .0.rule() + 1, right = .0.right())]
    Scenario(#[from] ScenarioError),
    /// The given text is not an address.
    #[error(
        "`{address}` is not an address: {source}; write host:port, as in 127.0.0.1:4004 or \
         localhost:0"
    )]
    Address {
        /// What was given.
        address: String,
        /// What is wrong with it.
        source: io::Error,
    },
    /// Listening at an address is not possible.
    #[error(transparent)]
    Tcp(#[from] TcpError),
    /// A serial port cannot be opened.
    #[cfg(feature = "serial")]
    #[error(transparent)]
    Serial(#[from] vimc4_host::SerialError),
    /// No pseudo-terminal can be opened.
    #[cfg(all(unix, feature = "pty"))]
    #[error(transparent)]
    Pty(#[from] PtyError),
    /// A pseudo-terminal cannot be given its name.
    #[cfg(all(unix, feature = "pty"))]
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The system has no pseudo-terminals, or they were left out by the feature `pty`.
    #[error("there are no pseudo-terminals on this system; use TCP or a serial port")]
    NoPty,
    /// The flash file cannot be used.
    #[error(transparent)]
    FlashFile(#[from] FlashFileError),
    /// The flash file holds something other than this model's memory.
    #[error(
        "{path}, {source}; it may belong to another model, or have been edited: name another \
         file, or remove this one to begin with an empty memory",
        path = .path.display()
    )]
    Flash {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: MemoryError,
    },
    /// The recording cannot be begun.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// An expectation could never be met.
    #[error(transparent)]
    Mistake(#[from] Mistake),
    /// An expectation was not met.
    #[error(transparent)]
    Unmet(#[from] Box<Failure>),
    /// A running controller refused.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// A running controller ended by itself.
    #[error(transparent)]
    Run(Arc<RunError>),
    /// The system provides no thread or no event queue.
    #[error("cannot start a controller: {0}; the limit of threads or open files may be too low")]
    Start(io::Error),
}

/// What is wrong with a profile, and where.
#[derive(Clone, Debug, Error)]
#[error("{path}, line {line}: {error}; {help}", path = .path.display(), help = .error.help)]
pub struct ProfileFileError {
    /// `model` or `machine`.
    pub what: &'static str,
    /// The file.
    pub path: PathBuf,
    /// The line, from 1.
    pub line: usize,
    /// The whole text, for a picture of the place.
    pub text: String,
    /// What is wrong, where, and what would be right.
    pub error: ProfileError,
}

impl From<Unknown> for Error {
    fn from(Unknown { what, name, known }: Unknown) -> Error {
        Error::Unknown { what, name, known: known.join(", ") }
    }
}
