//! Diagnostics of lines.

use crate::Severity;
use crate::job;
use crate::language::{self, Span};

/// A remark about a place in a job file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diagnostic {
    /// The line, from 1.
    pub line: u32,
    /// The part of the line.
    pub span: Span,
    /// The message.
    pub problem: Problem,
    /// Whether a lenient reading leaves the line out, because nothing that the tool does depends on
    /// it. Any other error ends the job.
    pub left_out: bool,
}

/// A problem: with how a line is written, or with what it asks for.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    /// The line cannot be read, or only with an assumption.
    #[error(transparent)]
    Written(#[from] language::Problem),
    /// What it asks for cannot be done, or only with a change.
    #[error(transparent)]
    Asked(#[from] job::Problem),
}

impl Problem {
    /// Its severity.
    #[must_use]
    pub fn severity(self) -> Severity {
        match self {
            Problem::Written(problem) => problem.severity(),
            Problem::Asked(problem) => problem.severity(),
        }
    }

    /// A name that programs and people can search for, such as `beyond-limit`.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            Problem::Written(problem) => problem.code(),
            Problem::Asked(problem) => problem.code(),
        }
    }

    /// What would be right, if that is known.
    #[must_use]
    pub fn help(self) -> Option<String> {
        match self {
            Problem::Written(problem) => problem.help(),
            Problem::Asked(problem) => problem.help(),
        }
    }
}
