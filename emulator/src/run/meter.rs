//! How far the axes travel.

use vimc4::{Machine, Motion, Point, Time};
use vimc4_motion::{Path, Segment};

/// A stretch of this many steps is not looked at more closely.
const SHORT: u64 = 16;

/// Adds up motions.
#[derive(Debug, Default)]
pub(super) struct Meter {
    /// Steps per axis, forth and back alike.
    pub(super) steps: [u64; 4],
    /// The length of the path of the linear axes in mm.
    pub(super) path_mm: f64,
    scale: [f64; 4],
    running: Option<(Time, Box<Segment>)>,
}

/// What a step of an axis is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unit {
    pub(super) name: &'static str,
    /// How much of it.
    pub(super) per_step: f64,
}

/// What a step of each axis of a machine is.
pub(super) fn units(machine: &Machine) -> [Unit; 4] {
    machine.axes().map(|axis| {
        let turn = f64::from(axis.steps_per_turn);
        match axis.lead_um {
            Some(lead) => Unit { name: "mm", per_step: f64::from(lead) / 1_000.0 / turn },
            None => Unit { name: "°", per_step: 360.0 / turn },
        }
    })
}

impl Meter {
    pub(super) fn new(machine: &Machine) -> Meter {
        // A turning table has no way in mm.
        let scale = units(machine).map(|unit| if unit.name == "mm" { unit.per_step } else { 0.0 });
        Meter { scale, ..Meter::default() }
    }

    /// Takes note of a motion.
    pub(super) fn watch(&mut self, at: Time, motion: Motion) {
        match motion {
            Motion::Begins { segment, .. } => self.running = Some((at, segment)),
            Motion::Changes { segment } => {
                if let Some((_, running)) = &mut self.running {
                    *running = segment;
                }
            }
            Motion::Ends { steps } => {
                if let Some((_, segment)) = self.running.take() {
                    self.add(&segment.path, steps);
                }
            }
        }
    }

    /// Takes note of what the running motion has done up to now.
    pub(super) fn stop(&mut self, now: Time) {
        if let Some((began, segment)) = self.running.take() {
            self.add(&segment.path, segment.profile.steps_at(now.nanos_since(began)));
        }
    }

    fn add(&mut self, path: &Path, steps: u64) {
        let travelled = match path {
            Path::Line(_) => path.at(steps).map(i64::unsigned_abs),
            // Where a circle turns round is not to be seen from its ends.
            _ => travelled(path, steps),
        };
        for (sum, travelled) in self.steps.iter_mut().zip(travelled) {
            *sum += travelled;
        }
        self.path_mm += length(path, &self.scale, 0, steps);
    }
}

/// Steps per axis in the first clock steps of a path, counted one by one.
fn travelled(path: &Path, steps: u64) -> [u64; 4] {
    let mut sums = [0; 4];
    let mut last = [0; 4];
    for place in path.steps().take(usize::try_from(steps).unwrap_or(usize::MAX)) {
        for axis in 0..4 {
            sums[axis] += place[axis].abs_diff(last[axis]);
        }
        last = place;
    }
    sums
}

/// The length of the curve that a path follows from one clock step to another.
///
/// The steps zigzag around the curve, so they cannot be added up. Two chords over a stretch are
/// longer than one by three quarters of what still lacks (Huygens), if the stretch turns little;
/// if it turns much it is divided.
fn length(path: &Path, scale: &[f64; 4], from: u64, to: u64) -> f64 {
    let middle = u64::midpoint(from, to);
    let [start, half, end] = [from, middle, to].map(|step| path.at(step));
    let chords = |scale| {
        (distance(&start, &end, scale), distance(&start, &half, scale) + distance(&half, &end, scale))
    };
    let (one, two) = chords(&[1.0; 4]);
    // The places of whole turns coincide, which looks straight, but is no way at all.
    let straight = two - one < 0.02 * two && two > 0.6 * (to - from) as f64;
    if straight || to - from <= SHORT {
        let (one, two) = chords(scale);
        return two + (two - one) / 3.0;
    }
    length(path, scale, from, middle) + length(path, scale, middle, to)
}

fn distance(a: &Point, b: &Point, scale: &[f64; 4]) -> f64 {
    let squares = (0..4).map(|axis| ((b[axis] - a[axis]) as f64 * scale[axis]).powi(2));
    squares.sum::<f64>().sqrt()
}
