//! Straight lines.

use proptest::prelude::*;
use vimc4_motion::{AXES, Path, Point, StraightLine};

use crate::{cases, closed_forms_match, point};

fn way() -> impl Strategy<Value = i64> {
    prop_oneof![1 => Just(0), 3 => -9..=9i64, 3 => -4_000..=4_000i64]
}

fn deltas() -> impl Strategy<Value = Point> {
    [(); AXES].map(|()| way())
}

proptest! {
    #![proptest_config(cases(2_000))]

    #[test]
    fn any_line(delta in deltas(), split in 0..4_000u64) {
        let line = Path::Line(StraightLine::new(delta));
        closed_forms_match(&line, split, true);
        prop_assert_eq!(line.at(line.length()), delta);
    }

    /// Every axis makes the steps of the formula, and mirrored ways make mirrored lines.
    #[test]
    fn the_formula(delta in deltas()) {
        let line = Path::Line(StraightLine::new(delta));
        let mirrored = Path::Line(StraightLine::new(delta.map(|way| -way)));
        let n = i128::from(line.length());
        for (k, (place, mirror)) in (1..).zip(line.steps().zip(mirrored.steps())) {
            for axis in 0..AXES {
                let m = i128::from(delta[axis].abs());
                let made = ((2 * k * m + n) / (2 * n)) as i64;
                prop_assert_eq!(place[axis], delta[axis].signum() * made);
                prop_assert_eq!(mirror[axis], -place[axis]);
            }
        }
    }

    /// Lines too long to walk: the ends, the inverse, and a walk of a stretch of it.
    #[test]
    fn long_lines(
        delta in [0..1i64 << 40, -(1i64 << 40)..1 << 40, -(1i64 << 33)..1 << 33, -9..9i64].prop_map(point),
        at in 0.0..1.0f64,
    ) {
        let line = Path::Line(StraightLine::new(delta));
        let n = line.length();
        prop_assert_eq!(line.at(n), delta);
        let k = (n as f64 * at) as u64;
        let rest = line.after(k);
        for (j, place) in (1..).zip(rest.steps().take(200)) {
            prop_assert_eq!(rest.at(j), place);
        }
        let here = line.at(k);
        for (axis, &offset) in here.iter().enumerate() {
            let first = line.first_at(axis, offset).unwrap();
            prop_assert!(first <= k);
            prop_assert_eq!(line.at(first)[axis], offset);
            prop_assert!(first == 0 || line.at(first - 1)[axis] != offset);
        }
    }
}

#[test]
fn halves_are_rounded_away_from_the_start() {
    let places: Vec<Point> = Path::Line(StraightLine::new(point([4, -2, 1]))).steps().collect();
    assert_eq!(places, [[1, -1, 0], [2, -1, 1], [3, -2, 1], [4, -2, 1]].map(point));
}

#[test]
fn no_way_at_all() {
    let line = Path::Line(StraightLine::new([0; AXES]));
    closed_forms_match(&line, 0, true);
    assert_eq!((line.length(), line.first_at(2, 0), line.first_at(2, 1)), (0, Some(0), None));
    assert_eq!(line.first_at(AXES, 1), None);
}

#[test]
fn too_long_lines_are_cut() {
    let line = Path::Line(StraightLine::new(point([i64::MAX, i64::MIN, 0, 1])));
    assert_eq!(line.length(), 1 << 40);
    assert_eq!(line.at(u64::MAX), point([1 << 40, -(1 << 40), 0, 1]));
}
