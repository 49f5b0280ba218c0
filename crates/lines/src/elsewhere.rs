//! A system on which modem lines cannot be answered.

use std::path::Path;
use std::process::Command;

use crate::launch::{Ending, LaunchError};
use crate::state::{Lines, Peer};

/// The far side's hold on the lines; there is none here.
#[derive(Clone, Debug)]
pub struct Port(std::convert::Infallible);

/// A running program; there is none here.
#[derive(Debug)]
pub struct Running(std::convert::Infallible);

/// A process that is ready to run a program; never so here.
#[derive(Debug)]
pub struct Launcher(std::convert::Infallible);

/// Says that this is not possible here.
///
/// # Errors
///
/// Always.
pub fn prepare() -> Result<Launcher, LaunchError> {
    Err(LaunchError::NotHere)
}

/// Puts a terminal back to its default line discipline.
///
/// # Errors
///
/// Always: this takes unsafe code, and the project has none for this system.
#[cfg(unix)]
pub fn use_default_discipline(_terminal: impl std::os::fd::AsFd) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

impl Launcher {
    /// Runs a command.
    ///
    /// # Errors
    ///
    /// Never returns a program; nothing here can run one.
    pub fn launch(
        self,
        _command: Command,
        _terminal: &Path,
        _lines: Lines,
        _peer: Box<dyn Peer>,
    ) -> Result<Running, LaunchError> {
        match self.0 {}
    }
}

impl Running {
    /// The far side's hold on the lines.
    #[must_use]
    pub fn port(&self) -> Port {
        match self.0 {}
    }

    /// Attends the program until it ends.
    ///
    /// # Errors
    ///
    /// Never happens; nothing runs.
    pub fn attend(self, _lingering: impl FnMut()) -> Result<Ending, LaunchError> {
        match self.0 {}
    }
}

impl Port {
    /// The device takes more now, or does not.
    pub fn set_ready(&self, _ready: bool) {
        match self.0 {}
    }

    /// The device switches a line of its own.
    pub fn set_line(&self, _line: u32, _on: bool) {
        match self.0 {}
    }
}

impl Ending {
    /// Ends this process as the program has ended.
    pub fn pass_on(self) -> ! {
        std::process::exit(match self {
            Ending::Code(code) => i32::from(code),
            Ending::Signal(signal) => 128 + signal,
        })
    }
}
