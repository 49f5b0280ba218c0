//! An arc with a third axis that follows.

use serde::{Deserialize, Serialize};

use crate::Arc;

/// An arc of B steps with |S3| steps of a third axis spread over it, or, where |S3| is larger,
/// a line of |S3| steps over which the arc is spread; by the same Bresenham as a line.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Helix {
    arc: Arc,
    axis: u8,
    steps: i64,
    /// How many clock steps of the whole helix were already made before this path begins.
    done: u64,
}

impl Helix {
    /// `arc` with `steps` (signed) steps of `axis` spread over it.
    #[must_use]
    pub fn new(_arc: Arc, _axis: usize, _steps: i64) -> Helix {
        todo!()
    }
}
