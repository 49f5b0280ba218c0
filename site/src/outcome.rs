//! What comes of a part of the work.

/// What went well, or what did not, in words.
pub(crate) type Outcome<T> = Result<T, String>;
