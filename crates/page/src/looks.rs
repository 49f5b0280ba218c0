//! What somebody looks at.

#[cfg(feature = "past")]
use vimc4_timeline::Place;

/// Somebody looks at the past; the controller's time stands still.
#[cfg(feature = "past")]
#[derive(Debug)]
pub(crate) struct Looks {
    /// Where the controller itself is.
    pub(crate) live: Place,
    /// Where was looked while something was done to the controller itself.
    pub(crate) away: Option<Place>,
    /// Somebody else has paused it, and nobody has let it go on since.
    pub(crate) stays_paused: bool,
}

/// Nobody does: there is no past yet.
#[cfg(not(feature = "past"))]
#[derive(Debug)]
pub(crate) enum Looks {}
