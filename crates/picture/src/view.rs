//! What of a run is drawn.

/// From where the path is seen, or what else is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum View {
    /// From above: X to the right, Y up.
    Top,
    /// From the front: X to the right, Z up.
    Front,
    /// From the right: Y to the right, Z up.
    Side,
    /// From above, between front and right: X to the lower right, Y to the upper right, Z up.
    Isometric,
    /// Position, speed and acceleration of each axis over time.
    Time,
}

/// What the colours of a path mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Colouring {
    /// What a motion is for.
    #[default]
    Kind,
    /// How fast it is.
    Speed,
}
