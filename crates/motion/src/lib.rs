//! Exact integer kinematics.
//!
//! A motion is a [`Path`] (where the machine is after `k` steps of the step clock) run with a
//! [`Profile`] (when step `k` happens); both together are a [`Segment`]. Nothing here knows the
//! current time: a running motion is a segment and the [`Time`] at which it began, and its
//! position at any later time is computed, never accumulated.
//!
//! Everything exists twice: stepwise, as an iterator that does what a controller's step
//! interrupt does, and in closed form. The stepwise version is the definition; the tests hold
//! the two equal.
//!
//! Units: positions in steps, frequencies in Hz (steps per second), accelerations in Hz/ms,
//! times in nanoseconds.
#![forbid(unsafe_code)]

mod arc;
mod bresenham;
mod fit;
mod helix;
mod line;
mod path;
mod profile;
mod segment;
mod time;

pub use arc::{Arc, ArcState};
pub use fit::{CircleFit, Turn};
pub use helix::Helix;
pub use line::Line;
pub use path::{AXES, Path, PathSteps, Point};
pub use profile::{Profile, ProfileTimes, Ramp};
pub use segment::{Segment, SegmentSteps, Step};
pub use time::Time;
