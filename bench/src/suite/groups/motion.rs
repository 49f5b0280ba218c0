//! How fast every step of a motion can be enumerated for a watcher.

use std::hint::black_box;

use vimc4_motion::{Arc, ArcState, Path, Profile, Ramp, Segment, StraightLine};

use crate::suite::Bench;
use crate::suite::failure::Outcome;
use crate::suite::numbers::{count, rate};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::{ROUNDS, Sample};
use crate::suite::usage::processor_time;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let steps: u64 = bench.either(8_000_000, 1_000_000);
    let mut section = Section::default();
    let mut add = |what: &str, least: f64, work: &dyn Fn()| {
        let rounds = (0..ROUNDS).map(|_| steps as f64 / processor_time(work) * 1e9);
        let median = rounds.collect::<Sample>().median();
        section.add(
            Figure::new(what, rate(median))
                .target(format!("≥ {} /s", count(least)), median >= least),
        );
    };

    let long = steps as i64;
    let line = Path::Line(StraightLine::new([long, -long / 3, long / 7, long / 2, 0, 0]));
    add("positions of a line on four axes", 1e8, &|| walk(&line));

    let start = ArcState { x: 10_000, y: 0, d: -5_000, rx: -1, ry: -1 };
    let arc = Path::Arc(Arc::new(0, 1, steps, start));
    add("positions of an arc of radius 10,000", 5e7, &|| walk(&arc));

    let timed = |path: &Path, speed: u32, acceleration: u32| Segment {
        path: path.clone(),
        profile: Profile::new(steps, speed, Ramp { start_stop: 300, acceleration }),
    };
    let constant = timed(&line, 10_000, 100);
    add("positions and exact times, almost all at the same speed", 5e6, &|| time(&constant));
    let ramps = timed(&arc, 1_000_000, 1);
    add("positions and exact times, nothing but ramps", 5e6, &|| time(&ramps));
    section.note("Steps for each second of processor time.");
    Ok(section)
}

fn walk(path: &Path) {
    for point in black_box(path).steps() {
        black_box(point);
    }
}

fn time(segment: &Segment) {
    for step in black_box(segment).steps() {
        black_box(step);
    }
}
