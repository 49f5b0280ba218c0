//! Why a command of the debugger was not carried out.

use std::error::Error;
use std::fmt;

/// What was wrong, where, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DebugError {
    message: String,
    failed: bool,
}

impl DebugError {
    /// A sentence without its full stop, which begins in lower case.
    pub(crate) fn new(message: impl Into<String>) -> DebugError {
        DebugError { message: message.into(), failed: false }
    }

    /// An assertion does not hold.
    pub(crate) fn failed(message: impl Into<String>) -> DebugError {
        DebugError { message: message.into(), failed: true }
    }

    /// Whether it is an `assert` that does not hold, and not a mistyped command.
    #[must_use]
    pub fn is_failed_assertion(&self) -> bool {
        self.failed
    }
}

impl fmt::Display for DebugError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for DebugError {}
