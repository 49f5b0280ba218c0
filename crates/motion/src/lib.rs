//! Exact integer kinematics.
//!
//! A motion is a [`Path`] (where the machine is after `k` steps of the step clock) run with a
//! [`Profile`] (when step `k` happens); both together are a [`Segment`]. Nothing here knows the
//! current time: a running motion is a segment and the [`Time`] at which it began, and its
//! position at any later time is computed, never accumulated.
//!
//! Paths are lines, arcs and helices as a step interrupt makes them, a [`Sweep`] finds the arc
//! that is nearest to an ideal circle, and a [`Chain`] is any number of paths one after the other.
//! Profiles are of two kinds: ramps of the step frequency ([`Profile::new`]), and speeds along the
//! real way ([`Profile::trapezoid`], [`Profile::vectors`]), for which every [`Stretch`] of the
//! path says how long it is.
//!
//! Everything exists twice: stepwise, as an iterator that does what a controller's step
//! interrupt does, and in closed form. The stepwise version is the definition; the tests hold
//! the two equal.
//!
//! Units: positions in steps, times in nanoseconds; of ramps, frequencies in Hz (steps per second)
//! and accelerations in Hz/ms; of the real way, lengths in picometres, speeds in nm/s and
//! accelerations in nm/s².
#![forbid(unsafe_code)]

mod arc;
mod bresenham;
mod course;
mod demand;
mod fit;
mod helix;
mod line;
mod off_circle;
mod path;
mod phase;
mod point;
mod profile;
mod ramps;
mod running;
mod runs;
mod segment;
mod sweep;
mod time;
mod trig;
mod wide;

pub use arc::{Arc, ArcState};
pub use course::{Stretch, chord};
pub use demand::Pull;
pub use fit::{CircleFit, Turn};
pub use helix::Helix;
pub use line::StraightLine;
pub use off_circle::OffCircle;
pub use path::{Chain, Path, PathSteps};
pub use point::{AXES, Point};
pub use profile::{Profile, ProfileTimes};
pub use ramps::Ramp;
pub use running::Running;
pub use runs::Run;
pub use segment::{Segment, SegmentSteps, Step};
pub use sweep::Sweep;
pub use time::Time;
