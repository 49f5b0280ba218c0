//! Arcs of any registers, garbage included.

use std::collections::BTreeSet;

use proptest::prelude::*;
use vimc4_motion::{Arc, ArcState, Helix, Path};

use crate::{arcs, cases, closed_forms_match, point, registers};

/// The loop, written down once more.
fn engine(state: &mut ArcState) {
    let ArcState { x, y, d, rx, ry } = state;
    if *d > 0 {
        *x += i64::from(*rx);
        *d -= x.abs();
        if *x == 0 {
            *ry = -*ry;
        }
    } else {
        *y += i64::from(*ry);
        *d += y.abs();
        if *y == 0 {
            *rx = -*rx;
        }
    }
}

/// All registers in closed form against the loop, from the start to the end.
fn registers_match(start: ArcState, steps: u64) {
    let arc = Arc::new(0, 1, steps, start);
    let mut state = start;
    for k in 0..=steps {
        assert_eq!(arc.state_at(k), state, "after {k} steps from {start:?}");
        engine(&mut state);
    }
}

#[test]
fn small_registers_exhaustively() {
    let range = if cfg!(debug_assertions) { 3 } else { 6i64 };
    for (x, y) in (-range..=range).flat_map(|x| (-range..=range).map(move |y| (x, y))) {
        for d in -25..=25 {
            for (rx, ry) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
                let start = ArcState { x, y, d, rx, ry };
                registers_match(start, 80);
                if d % 5 == 0 {
                    closed_forms_match(&Path::Arc(Arc::new(0, 1, 60, start)), 17, true);
                }
            }
        }
    }
}

#[test]
fn a_zero_difference_steps_in_the_second_axis() {
    let mut state = ArcState { x: 7, y: 3, d: 0, rx: -1, ry: 1 };
    let arc = Arc::new(0, 1, 1, state);
    state.step();
    assert_eq!(state, ArcState { x: 7, y: 4, d: 4, rx: -1, ry: 1 });
    assert_eq!(arc.state_at(1), state);
    assert_eq!(Path::Arc(arc).at(1), point([0, 1]));
}

#[test]
fn the_largest_garbage_settles_first() {
    for d in [-8_388_608, 8_388_607] {
        for (x, y) in [(0, 0), (5, -7), (-3_000, 2), (1, 1_500), (-900, -900)] {
            for (rx, ry) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
                registers_match(ArcState { x, y, d, rx, ry }, 12_000);
            }
        }
    }
}

#[test]
fn millions_of_steps() {
    // Turns of every length, and a spiral out of the centre that never closes.
    let starts = [(1, 0, 0), (0, 2, 1), (3, 4, -1), (1_000, -7, 33), (0, 0, 8_388_607)];
    for (x, y, d) in starts {
        for (rx, ry) in [(1, 1), (-1, 1)] {
            let start = ArcState { x, y, d, rx, ry };
            let arc = Arc::new(0, 1, 8_388_607, start);
            let mut state = start;
            let last = if cfg!(debug_assertions) { 500_000 } else { 8_388_607u64 };
            for k in 1..=last {
                engine(&mut state);
                if k % 99_991 == 0 || k == last {
                    assert_eq!(arc.state_at(k), state, "after {k} steps from {start:?}");
                }
            }
        }
    }
}

#[test]
fn wild_values_are_cut_and_do_no_harm() {
    let ends = [i64::MIN, 0, i64::MAX];
    for (x, y) in ends.iter().flat_map(|&x| ends.iter().map(move |&y| (x, y))) {
        for (d, direction) in ends.iter().flat_map(|&d| [(d, 0), (d, i8::MIN)]) {
            for ry in [-1, 1] {
                let wild = ArcState { x, y, d, rx: direction, ry };
                let arc = Path::Arc(Arc::new(0, usize::MAX, u64::MAX, wild));
                assert_eq!((arc.length(), arc.first_at(1, 5)), (1 << 28, None));
                for far in [i64::MIN, -(1 << 29), 1 << 29, i64::MAX] {
                    let _ = arc.first_at(0, far);
                }
                assert_eq!(
                    arc.after(1 << 27).at(1 << 27)[0],
                    arc.at(u64::MAX)[0] - arc.at(1 << 27)[0]
                );
                let (low, high) = arc.extent(u64::MAX);
                assert!(low[0] <= arc.at(99)[0] && arc.at(99)[0] <= high[0]);
                assert!(arc.steps().next().is_some());
            }
        }
    }
    let wild = ArcState { x: i64::MIN, y: i64::MAX, d: i64::MIN, rx: 0, ry: i8::MIN };
    let helix = Path::Helix(Helix::new(Arc::new(0, 1, 0, wild), 2, i64::MIN));
    assert_eq!(helix.length(), 1 << 40);
    assert_eq!(helix.at(u64::MAX), point([0, 0, -(1 << 40)]));
}

proptest! {
    #![proptest_config(cases(2_000))]

    #[test]
    fn any_registers(start in registers(), steps in 0..6_000u64) {
        registers_match(start, steps);
    }

    #[test]
    fn any_arc((arc, _) in arcs(), split in 0..8_000u64) {
        closed_forms_match(&Path::Arc(arc), split, false);
    }

    /// The path of an arc is that of its registers.
    #[test]
    fn an_arc_ends_where_its_registers_do(start in registers(), steps in 0..100_000u64) {
        let arc = Arc::new(1, 2, steps, start);
        let end = arc.state_at(steps);
        prop_assert_eq!(Path::Arc(arc).at(steps), point([0, end.x - start.x, end.y - start.y]));
    }

    #[test]
    fn any_helix(
        (arc, axis) in arcs(),
        steps in prop_oneof![-9..=9i64, -700..=700i64, -12_000..=12_000i64],
        split in 0..12_000u64,
    ) {
        let circle = Path::Arc(arc.clone());
        let b = circle.length();
        let helix = Path::Helix(Helix::new(arc, axis, steps));
        closed_forms_match(&helix, split, false);
        // The end is the arc's and the whole third axis.
        prop_assert_eq!(helix.length(), b.max(steps.unsigned_abs()));
        let mut end = circle.at(b);
        end[axis] = steps;
        prop_assert_eq!(helix.at(helix.length()), end);
    }
}

/// The floor formulas of the behaviour page, on both sides of |S3| = B.
#[test]
fn a_helix_spreads_the_shorter_over_the_longer() {
    let start = ArcState { x: 40, y: 0, d: -20, rx: -1, ry: 1 };
    for s3 in [-1_000, -321, -320, -319, -100, -1, 0, 1, 7, 319, 320, 321, 640, 5_000i64] {
        let arc = Arc::new(0, 1, 320, start);
        let helix = Path::Helix(Helix::new(arc.clone(), 2, s3));
        let (b, third) = (320, s3.unsigned_abs());
        let n = third.max(b);
        for (j, place) in (1..).zip(helix.steps()) {
            let circle = arc.state_at((2 * j * b + n) / (2 * n));
            let z = s3.signum() * ((2 * j * third + n) / (2 * n)) as i64;
            assert_eq!(place, point([circle.x - 40, circle.y, z]));
        }
        closed_forms_match(&helix, 123, true);
        assert_eq!(helix.at(n), point([0, 0, s3]));
    }
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn what_comes_round_visits_no_new_place((arc, _) in arcs()) {
        let path = Path::Arc(arc);
        let seen = path.new_places();
        let visited = |steps: u64| -> BTreeSet<_> { path.steps().take(steps as usize).collect() };
        prop_assert_eq!(visited(seen), visited(path.length()));
    }
}
