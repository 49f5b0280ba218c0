//! Parts of a motion in which something stays the same.

/// A part of a motion in which the frequency goes one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Phase {
    /// The last clock step of it.
    pub(crate) to: u64,
    /// Hz/s, of the clock.
    pub(crate) acceleration: u128,
    pub(crate) trend: Trend,
}

/// Which way a frequency goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trend {
    Rises,
    Stays,
    Falls,
}

/// How many of the clock steps of a part of a path an axis makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Share {
    /// The last clock step of the part.
    pub(crate) to: u64,
    /// So many of `of`.
    pub(crate) steps: u64,
    pub(crate) of: u64,
}
