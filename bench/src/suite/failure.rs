//! Why something could not be measured.

use std::fmt::{self, Display};

/// What a measurement gives, or why there is none.
pub(crate) type Outcome<T> = Result<T, Failure>;

/// Why something could not be measured, in words for people.
#[derive(Debug)]
pub(crate) struct Failure(String);

impl Failure {
    /// A failure that is described by these words.
    pub(crate) fn new(words: impl Into<String>) -> Failure {
        Failure(words.into())
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Errors that are told with what was being done.
pub(crate) trait Doing<T> {
    /// `cannot {what}: {error}`.
    fn doing(self, what: impl Display) -> Outcome<T>;
}

impl<T, E: Display> Doing<T> for Result<T, E> {
    fn doing(self, what: impl Display) -> Outcome<T> {
        self.map_err(|error| Failure(format!("cannot {what}: {error}")))
    }
}

impl<T> Doing<T> for Option<T> {
    fn doing(self, what: impl Display) -> Outcome<T> {
        self.ok_or_else(|| Failure(format!("cannot {what}")))
    }
}
