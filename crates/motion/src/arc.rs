//! The circle engine: a difference register decides, step by step, which of two axes moves.

use serde::{Deserialize, Serialize};

/// The registers of the circle engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ArcState {
    /// Position on the first axis relative to the centre, steps.
    pub x: i64,
    /// Position on the second axis relative to the centre, steps.
    pub y: i64,
    /// The difference register.
    pub d: i64,
    /// Direction of the first axis, +1 or -1.
    pub rx: i8,
    /// Direction of the second axis, +1 or -1.
    pub ry: i8,
}

/// A circular arc of a number of single-axis steps.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Arc {
    /// Index of the first and of the second axis of the plane.
    plane: (u8, u8),
    /// Number of clock steps.
    steps: u64,
    /// The registers at the start.
    start: ArcState,
}

impl Arc {
    /// An arc of `steps` steps in the plane of axis `first` and axis `second` that begins with
    /// the registers `start`. Any register values are allowed, also such that no circle has.
    #[must_use]
    pub fn new(_first: usize, _second: usize, _steps: u64, _start: ArcState) -> Arc {
        todo!()
    }

    /// The registers after `k` steps, in closed form.
    #[must_use]
    pub fn state_at(&self, _k: u64) -> ArcState {
        todo!()
    }
}
