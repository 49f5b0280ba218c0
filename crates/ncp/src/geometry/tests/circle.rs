//! Ideal arcs.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use proptest::prelude::*;
use vimc4_isel_wire::Plane;
use vimc4_motion::Turn;

use super::super::{Circle, NoCircle};
use super::{TURNS, USUAL, cases};
use crate::language::Value;

fn values(place: [i64; 2]) -> [Value; 2] {
    place.map(Value::thousandths)
}

fn circle(
    turn: Turn,
    centre: [i64; 2],
    start: [i64; 2],
    end: Option<[i64; 2]>,
) -> Result<Circle, NoCircle> {
    let [centre, start] = [centre, start].map(values);
    Circle::new(Value::ZERO, Plane::Xy, turn, centre, start, end.map(values), [USUAL; 2])
}

#[test]
fn an_end_beside_the_start_is_hardly_any_way_or_nearly_a_turn() {
    use Turn::{Clockwise, Counterclockwise};
    let start = [1_000_000_000_000, 0];
    for (turn, y) in [(Counterclockwise, 1), (Clockwise, -1)] {
        let sweep = |end: [i64; 2]| circle(turn, [0, 0], start, Some(end)).unwrap().sweep();
        let ahead = sweep([start[0], y]);
        assert!((0.999e-12..1.001e-12).contains(&ahead), "{ahead}");
        let behind = TAU - sweep([start[0], -y]);
        assert!((0.0..1.01e-12).contains(&behind), "{behind}");
        assert_eq!(sweep(start), TAU);
        assert_eq!(sweep([start[0] + 1, 0]), TAU);
        assert_eq!(sweep([-start[0], 0]), PI);
        assert!((sweep([0, y * start[0]]) - FRAC_PI_2).abs() < 1e-15);
        assert_eq!(circle(turn, [0, 0], start, None).unwrap().sweep(), TAU);
    }
}

#[test]
fn what_is_no_arc_is_refused() {
    // Half a step is 6,250 thousandths.
    let turn = Turn::Clockwise;
    assert_eq!(circle(turn, [0, 0], [6_249, 0], None), Err(NoCircle::NoRadius));
    assert!(circle(turn, [0, 0], [6_250, 0], None).is_ok());
    assert_eq!(circle(turn, [5, 5], [5, 5], None), Err(NoCircle::NoRadius));
    assert!(circle(turn, [0, 0], [1_000_000, 0], Some([0, 1_025_000])).is_ok());
    assert!(circle(turn, [0, 0], [1_000_000, 0], Some([0, 975_000])).is_ok());
    let apart = circle(turn, [0, 0], [1_000_000, 0], Some([0, 1_025_001])).unwrap_err();
    assert_eq!(
        apart.to_string(),
        "the start is 1000 from the centre, but the end is 1025.001 from it"
    );
    let most = i64::MAX;
    assert!(circle(turn, [-most, most], [most, -most], Some([most, most])).is_err());
    assert!(circle(turn, [-most, most], [most, -most], None).is_ok());
}

#[test]
fn a_quarter_reaches_two_axes_and_the_rest_all() {
    let (start, end) = ([3_000_000, 4_000_000], Some([-4_000_000, 3_000_000]));
    let extent = |turn| circle(turn, [0, 0], start, end).unwrap().extent();
    assert_eq!(extent(Turn::Counterclockwise), [(-4e6, 3e6), (3e6, 5e6)]);
    assert_eq!(extent(Turn::Clockwise), [(-5e6, 5e6), (-5e6, 4e6)]);
    let whole = circle(Turn::Clockwise, [7_000, 0], [5_007_000, 0], None).unwrap();
    assert_eq!(whole.extent(), [(-4_993_000.0, 5_007_000.0), (-5e6, 5e6)]);
}

#[test]
fn the_given_end_counts_for_the_extent() {
    let end = Some([0, 5_020_000]);
    let arc = circle(Turn::Counterclockwise, [0, 0], [5_000_000, 0], end).unwrap();
    assert_eq!(arc.extent()[1], (0.0, 5_020_000.0));
    assert_eq!(arc.radius(), 5e6);
    assert!((arc.length() - FRAC_PI_2 * 5e6).abs() < 1e-6);
}

proptest! {
    #![proptest_config(cases(3_000))]

    /// The extent is that of many points, and they are all on the circle, in order.
    #[test]
    fn the_extent_is_that_of_its_points(
        centre in [-10_000_000..=10_000_000i64, -10_000_000..=10_000_000i64],
        radius in 1e5..1e7f64,
        from in 0..=16i32,
        to in -3.2..3.2f64,
        which in 0..2usize,
    ) {
        let from = f64::from(from) * FRAC_PI_2 / 4.0;
        let at = |angle: f64| {
            let (sine, cosine) = libm::sincos(angle);
            let x = libm::round(radius * cosine) as i64 + centre[0];
            [x, libm::round(radius * sine) as i64 + centre[1]]
        };
        let turn = TURNS[which];
        let arc = circle(turn, centre, at(from), Some(at(to))).unwrap();
        let mut extent = [(f64::MAX, f64::MIN); 2];
        let mut gone = 0.0;
        let mut before = arc.point(0.0);
        for part in 0..=1_000 {
            let point = arc.point(f64::from(part) / 1_000.0);
            for axis in 0..2 {
                extent[axis].0 = extent[axis].0.min(point[axis]);
                extent[axis].1 = extent[axis].1.max(point[axis]);
            }
            gone += libm::hypot(point[0] - before[0], point[1] - before[1]);
            before = point;
        }
        prop_assert!((gone / arc.length() - 1.0).abs() < 1e-4);
        let end = at(to);
        prop_assert!(libm::hypot(before[0] - end[0] as f64, before[1] - end[1] as f64) < 2.0);
        for (seen, said) in extent.into_iter().zip(arc.extent()) {
            // Between two of the points an arc rises by the sagitta of a thousandth.
            let room = 2.0 + radius * 1e-5;
            prop_assert!(said.0 - 2.0 <= seen.0 && seen.0 <= said.0 + room, "{seen:?} {said:?}");
            prop_assert!(said.1 - room <= seen.1 && seen.1 <= said.1 + 2.0, "{seen:?} {said:?}");
        }
    }
}
