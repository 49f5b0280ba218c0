//! The closed forms held against the stepwise definitions, and both against the manuals.
//!
//! The random tests take few cases in a debug build and more in a release build. The environment
//! variable `VIMC4_CASES` sets their number, for example the long run
//! `VIMC4_CASES=100000 cargo test --release -p vimc4-motion`.

#![expect(clippy::cognitive_complexity, reason = "one test is one story")]

mod arcs;
mod chains;
mod circles;
mod courses;
mod demands;
mod fits;
mod lines;
mod profiles;
mod segments;
mod sweeps;

use std::ops::ControlFlow;

use proptest::prelude::*;
use vimc4_motion::{AXES, Arc, ArcState, Path, Point};

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

/// Registers, usually such as a circle has, often such as none has.
fn registers() -> impl Strategy<Value = ArcState> {
    let coordinate = || prop_oneof![-3..=3i64, -60..=60i64, -1_500..=1_500i64];
    let difference = prop_oneof![
        3 => -2..=2i64,
        5 => -1_000..=1_000i64,
        2 => -100_000..=100_000i64,
        1 => -8_388_608..=8_388_607i64,
    ];
    let direction = || prop_oneof![Just(1i8), Just(-1i8)];
    (coordinate(), coordinate(), difference, direction(), direction())
        .prop_map(|(x, y, d, rx, ry)| ArcState { x, y, d, rx, ry })
}

/// Any arc in any plane, and an axis that is not in the plane.
fn arcs() -> impl Strategy<Value = (Arc, usize)> {
    let plane = prop_oneof![
        Just((0, 1, 2)),
        Just((0, 2, 1)),
        Just((1, 2, 3)),
        Just((3, 1, 0)),
        Just((5, 0, 4))
    ];
    let steps = prop_oneof![0..=8u64, 0..=500u64, 0..=8_000u64];
    (plane, steps, registers()).prop_map(|((first, second, third), steps, start)| {
        (Arc::new(first, second, steps, start), third)
    })
}

/// A point whose first coordinates are given and whose others are 0.
fn point<const N: usize>(given: [i64; N]) -> Point {
    let mut point = [0; AXES];
    point[..N].copy_from_slice(&given);
    point
}

/// Every place of a path by walking it, the start included.
fn walked(path: &Path) -> Vec<Point> {
    std::iter::once([0; AXES]).chain(path.steps()).collect()
}

fn difference(a: Point, b: Point) -> Point {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

/// Holds every closed form of `path` against the walk, from all places if `thorough`, else from
/// a few.
fn closed_forms_match(path: &Path, split: u64, thorough: bool) {
    let places = walked(path);
    let length = path.length();
    assert_eq!(places.len() as u64, length + 1);
    let (mut low, mut high, mut travel) = ([0; AXES], [0; AXES], [0; AXES]);
    let mut first = [const { Vec::new() }; AXES];
    for (k, &place) in places.iter().enumerate() {
        let k = k as u64;
        if k > 0 {
            let step = difference(place, places[k as usize - 1]);
            assert!(step.iter().all(|steps| steps.abs() <= 1), "{step:?} at {k}");
            travel = std::array::from_fn(|axis| travel[axis] + step[axis].abs());
        }
        assert_eq!(path.at(k), place, "at {k}");
        for axis in 0..AXES {
            if k == 0 || !(low[axis]..=high[axis]).contains(&place[axis]) {
                first[axis].push((place[axis], k));
            }
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
        if thorough || k == split || k == length {
            assert_eq!(path.extent(k), (low, high), "extent {k}");
            assert_eq!(path.travel(k), travel, "travel {k}");
        }
    }
    assert_eq!(path.at(length + 7), path.at(length));
    assert_eq!(path.at(u64::MAX), path.at(length));
    for axis in 0..AXES {
        let stride = if thorough { 1 } else { 1 + first[axis].len() / 40 };
        for &(offset, k) in first[axis].iter().step_by(stride) {
            assert_eq!(path.first_at(axis, offset), Some(k), "axis {axis} at {offset}");
        }
        for beyond in [low[axis] - 1, high[axis] + 1, i64::MIN, i64::MAX] {
            assert_eq!(path.first_at(axis, beyond), None, "axis {axis} at {beyond}");
        }
    }
    // What is left after some steps is the rest of the walk, in both forms.
    let rest = path.after(split);
    let split = split.min(length);
    let expected: Vec<_> =
        places[split as usize..].iter().map(|&p| difference(p, places[split as usize])).collect();
    assert_eq!(walked(&rest), expected);
    assert!(expected.iter().zip(0..).all(|(&place, j)| rest.at(j) == place));
    if split < length {
        let next = (length - split) / 2;
        assert_eq!(rest.after(next), path.after(split + next));
    }
    runs_match(path, &places, split);
}

/// Holds the runs of every axis up to `k` against the walk: they follow each other without a gap, the
/// axis keeps its direction in each, and what follows it with play ends where it does step by step,
/// turns left out or not.
fn runs_match(path: &Path, places: &[Point], k: u64) {
    let play = |(gap, place): &mut (i64, i64), way: i64| {
        let wanted = *gap + way;
        let moved = if wanted < 0 { wanted } else { (wanted - 7).max(0) };
        (*gap, *place) = (wanted - moved, *place + moved);
    };
    for axis in 0..AXES {
        let (mut visited, mut behind) = (0, 0);
        let _: ControlFlow<()> = path.runs(axis, k, &mut visited, &mut |visited, run| {
            *visited += 1;
            assert_eq!(run.from, behind, "run {visited}");
            behind = run.to;
            let way = places[run.from as usize..=run.to as usize].windows(2);
            let mut steps = way.map(|pair| pair[1][axis] - pair[0][axis]);
            assert!(steps.clone().all(|step| step * run.way >= 0), "{run:?} turns");
            assert_eq!(steps.by_ref().sum::<i64>(), run.way, "{run:?}");
            ControlFlow::Continue(())
        });
        assert_eq!(behind, k, "the runs of axis {axis} end before");
        let (mut by_runs, mut by_steps) = ((3, 0), (3, 0));
        let _: ControlFlow<()> = path.runs(axis, k, &mut by_runs, &mut |state, run| {
            play(state, run.way);
            ControlFlow::Continue(())
        });
        for pair in places[..=k as usize].windows(2) {
            play(&mut by_steps, pair[1][axis] - pair[0][axis]);
        }
        assert_eq!(by_runs, by_steps, "play of axis {axis}");
    }
}
