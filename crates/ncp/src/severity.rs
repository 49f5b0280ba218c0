//! The severity of diagnostics.

use serde::{Deserialize, Serialize};

/// The severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Something was assumed that nearly every file leaves open.
    Note,
    /// The job runs, perhaps not as it was meant.
    Warning,
    /// The line cannot be carried out.
    Error,
}
