//! The motions walked step by step and held against what was asked for.
//!
//! As in `vimc4-motion`, the environment variable `VIMC4_CASES` sets the number of random cases.

mod circle;
mod curve;
mod straight;

use proptest::prelude::*;
use vimc4_isel_wire::Plane;
use vimc4_motion::{Ramp, Turn};

use super::{Scale, Speeds};

const PLANES: [Plane; 3] = [Plane::Xy, Plane::Xz, Plane::Yz];
const TURNS: [Turn; 2] = [Turn::Clockwise, Turn::Counterclockwise];

/// 80 steps a mm.
const USUAL: Scale = Scale { steps: 80, per: 1_000_000 };

const SPEEDS: Speeds =
    Speeds { lowest: 20, highest: 40_000, ramp: Ramp { start_stop: 300, acceleration: 100 } };

/// How many cases a random test takes.
fn cases(release: u32) -> ProptestConfig {
    #[expect(clippy::disallowed_methods, reason = "the length of a test run is set from outside")]
    let wanted = std::env::var("VIMC4_CASES").ok().and_then(|text| text.parse().ok());
    let usual = if cfg!(debug_assertions) { release / 10 } else { release };
    ProptestConfig {
        cases: wanted.unwrap_or(usual),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}
