//! How far the axes travel.

use std::time::Duration;

use vimc4_catalogue::{Machine, Measure};
use vimc4_device::{AXES, Motion, Point, Time};
use vimc4_motion::{Path, Segment};

use super::trace::Trace;
use crate::failure::Failure;

/// A stretch of this many steps is not looked at more closely.
const SHORT: u64 = 16;

/// Adds up motions.
#[derive(Default)]
pub(crate) struct Meter {
    /// Whether what moves is a reference run, which belongs to no job: it is not added.
    pub(crate) references: bool,
    /// Where every step is told.
    pub(crate) trace: Option<Trace>,
    /// Steps per axis, forth and back alike.
    pub(crate) steps: [u64; AXES],
    /// The length of the path of the linear axes in mm.
    pub(crate) path_mm: f64,
    /// How much of that was made with the head down, and how long it took.
    pub(crate) down: (f64, Duration),
    /// The greatest frequency, in µHz, if that is wanted.
    pub(crate) top: Option<u64>,
    /// The lowest and the highest counters.
    pub(crate) extent: Option<(Point, Point)>,
    /// The axes whose counters do not tell where they are, when everything is over.
    pub(crate) lost: Vec<usize>,
    scale: [f64; AXES],
    running: Option<Running>,
}

/// A motion that has begun.
#[derive(Debug)]
struct Running {
    began: Time,
    origin: Point,
    segment: Box<Segment>,
    /// Whether the head is down.
    down: bool,
}

impl Meter {
    pub(crate) fn new(machine: &Machine) -> Meter {
        // A turning table has no way in mm.
        let in_mm = |unit: Measure| if unit.name == "mm" { unit.per_step } else { 0.0 };
        let scale = machine.measures().map(in_mm);
        Meter { scale, ..Meter::default() }
    }

    /// Takes note of a motion, and of whether it begins with the head down.
    pub(crate) fn watch(&mut self, at: Time, motion: Motion, down: bool) {
        match motion {
            Motion::Begins { origin, segment } => {
                self.running = Some(Running { began: at, origin, segment, down });
            }
            Motion::Changes { segment } => {
                if let Some(running) = &mut self.running {
                    running.segment = segment;
                }
            }
            Motion::Ends { steps } => self.end(at, |_| steps),
        }
    }

    /// Says which axes are at an unknown place, and what finds it; nothing if there is none.
    pub(crate) fn lost_in_words(&self, name: impl Fn(usize) -> String) -> Option<String> {
        let names: Vec<String> = self.lost.iter().map(|axis| name(*axis)).collect();
        let (places, it) = match names.len() {
            0 => return None,
            1 => ("place", "it"),
            _ => ("places", "them"),
        };
        let names = names.join(", ");
        Some(format!("the {places} of {names}; a reference run finds {it}"))
    }

    /// Ends the table of the steps, if there is one.
    pub(crate) fn end_trace(&mut self) -> Result<(), Failure> {
        self.trace.take().map_or(Ok(()), Trace::finish)
    }

    /// Takes note of what the running motion has done up to now.
    pub(crate) fn stop(&mut self, now: Time) {
        self.end(now, |running| running.segment.profile.steps_at(now.nanos_since(running.began)));
    }

    /// The running motion has made this many steps.
    fn end(&mut self, now: Time, steps: impl FnOnce(&Running) -> u64) {
        let Some(running) = self.running.take() else { return };
        let before = self.path_mm;
        let steps = steps(&running);
        if let Some(trace) = &mut self.trace {
            trace.add(running.began, &running.origin, &running.segment, steps);
        }
        if self.references {
            return;
        }
        if let Some(top) = &mut self.top {
            let profile = &running.segment.profile;
            *top = profile.speed_at(profile.duration() / 2).max(*top);
        }
        self.add(&running.segment.path, steps);
        self.include(&running.origin, &running.segment.path, steps);
        if running.down {
            let (path, time) = self.down;
            self.down = (path + self.path_mm - before, time + (now - running.began));
        }
    }

    /// A path from a place belongs to where the axes have been.
    fn include(&mut self, origin: &Point, path: &Path, steps: u64) {
        let (low, high) = path.extent(steps);
        let (lowest, highest) = self.extent.get_or_insert((*origin, *origin));
        for axis in 0..AXES {
            lowest[axis] = lowest[axis].min(origin[axis] + low[axis]);
            highest[axis] = highest[axis].max(origin[axis] + high[axis]);
        }
    }

    fn add(&mut self, path: &Path, steps: u64) {
        let end = path.at(steps);
        let (travelled, length) = match path {
            Path::Line(_) => (end, norm(&end, &self.scale)),
            _ => (path.travel(steps), length(path, &self.scale, steps, &end)),
        };
        for (sum, travelled) in self.steps.iter_mut().zip(travelled) {
            *sum += travelled.unsigned_abs();
        }
        self.path_mm += length;
    }
}

/// The length of the curve that a path follows in its first clock steps, which lead to `end`.
///
/// The steps zigzag around the curve, so they cannot be added up; chords are compared. Three places
/// on a circle give the circle. Elsewhere two chords over a stretch are longer than one by three
/// quarters of what still lacks (Huygens), if the stretch turns little. What turns much is divided.
fn length(path: &Path, scale: &[f64; AXES], steps: u64, end: &Point) -> f64 {
    let middle = steps / 2;
    let half = path.at(middle);
    let rest = std::array::from_fn(|axis| end[axis] - half[axis]);
    let chords = |scale| (norm(end, scale), norm(&half, scale), norm(&rest, scale));
    let (one, first, second) = chords(&[1.0; AXES]);
    let two = first + second;
    let round = matches!(path, Path::Arc(_)) && is_even(&half, &rest, scale);
    let most = if round { 0.3 } else { 0.005 };
    // The places of whole turns coincide, which looks straight, but is no way at all.
    let turns_little = two - one < most * two && two > 0.6 * steps as f64;
    if turns_little || steps <= SHORT {
        let bent = two - one > 0.005 * two;
        let (one, first, second) = chords(scale);
        let two = first + second;
        if round && bent && turns_little {
            // The sides of a triangle by its area, which Heron's formula gives.
            let half = (one + two) / 2.0;
            let area = (half * (half - one) * (half - first) * (half - second)).sqrt();
            let diameter = one * first * second / (2.0 * area);
            return diameter * ((first / diameter).asin() + (second / diameter).asin());
        }
        return two + (two - one) / 3.0;
    }
    length(path, scale, middle, &half) + length(&path.after(middle), scale, steps - middle, &rest)
}

/// Whether a step is as long on every axis that moves, so that circles are circles.
fn is_even(half: &Point, rest: &Point, scale: &[f64; AXES]) -> bool {
    let mut moving = (0..AXES).filter(|&axis| half[axis] != 0 || rest[axis] != 0);
    let Some(first) = moving.next() else { return false };
    moving.all(|axis| scale[axis] == scale[first])
}

fn norm(way: &Point, scale: &[f64; AXES]) -> f64 {
    (0..AXES).map(|axis| (way[axis] as f64 * scale[axis]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use vimc4_motion::{Arc, CircleFit, Helix, StraightLine, Turn};

    use super::*;

    /// What a path of whole steps measures with a hundredth of a mm a step.
    fn measured(path: &Path) -> ([u64; AXES], f64) {
        let mut meter = Meter { scale: [0.01, 0.01, 0.01, 0.0, 0.0, 0.0], ..Meter::default() };
        meter.add(path, path.length());
        (meter.steps, meter.path_mm)
    }

    fn circle(radius: i64, steps: u64) -> Arc {
        let start = CircleFit::new(radius, 0, radius * radius, Turn::Counterclockwise).unwrap();
        Arc::new(0, 1, steps, start.start())
    }

    #[test]
    fn a_line_is_as_long_as_its_axes_say() {
        let (steps, length) = measured(&Path::Line(StraightLine::new([300, -400, 1_200, 7, 0, 0])));
        assert_eq!(steps, [300, 400, 1_200, 7, 0, 0]);
        assert!((length - 13.0).abs() < 1e-9, "{length}");
        assert_eq!(
            measured(&Path::Line(StraightLine::new([0, 0, 0, 500, 0, 0]))),
            ([0, 0, 0, 500, 0, 0], 0.0)
        );
        assert_eq!(measured(&Path::Line(StraightLine::new([0; AXES]))), ([0; AXES], 0.0));
    }

    #[test]
    fn circles_are_as_long_as_their_curves() {
        // Radius, turns in quarters, and how exact it is: small circles are ragged.
        for (radius, quarters, exact) in
            [(10, 4, 0.05), (100, 1, 0.01), (400, 4, 0.002), (400, 40, 0.002), (50_000, 3, 2e-5)]
        {
            let (steps, length) =
                measured(&Path::Arc(circle(radius, 2 * radius as u64 * quarters)));
            assert_eq!(steps[..3], [radius as u64 * quarters, radius as u64 * quarters, 0]);
            let curve = 0.01 * TAU * radius as f64 * quarters as f64 / 4.0;
            assert!((length / curve - 1.0).abs() < exact, "{length} for {curve}");
        }
    }

    #[test]
    fn a_helix_is_longer_than_its_circle() {
        let (steps, length) = measured(&Path::Helix(Helix::new(circle(2_000, 32_000), 2, -6_000)));
        assert_eq!(steps[..4], [16_000, 16_000, 6_000, 0]);
        let curve = (2.0 * TAU * 20.0).hypot(60.0);
        assert!((length / curve - 1.0).abs() < 1e-3, "{length} for {curve}");
    }
}
