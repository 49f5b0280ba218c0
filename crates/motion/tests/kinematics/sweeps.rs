//! Arcs about a centre, held against the ideal circle.

use proptest::prelude::*;
use vimc4_motion::{AXES, Path, Stretch, Sweep, Turn};

use crate::circles::directions;
use crate::{cases, closed_forms_match, point};

const DEGREE: i64 = 1_000_000_000;
const TURNS: [Turn; 2] = [Turn::Clockwise, Turn::Counterclockwise];

/// The place after the next step of the ideal circle, by the corner between the two cells that
/// it may pass into. At an axis of coordinates the other coordinate begins to run inward.
fn corner_step((x, y): (i64, i64), square: i64, turn: Turn) -> (i64, i64) {
    let (rx, ry) = directions(x, y, turn == Turn::Counterclockwise);
    let (rx, ry) = (i64::from(rx), i64::from(ry));
    let (corner_x, corner_y) = (i128::from(2 * x + rx), i128::from(2 * y + ry));
    let outside = corner_x.pow(2) + corner_y.pow(2) > 4 * i128::from(square);
    let x_inward = x * rx < 0;
    if outside == x_inward { (x + rx, y) } else { (x, y + ry) }
}

/// Whether the circle comes through the cell of a place: not all of its corners, nor its middle
/// line, are on one side. In half steps.
fn is_crossed((x, y): (i64, i64), square: i64) -> bool {
    let (x, y, square) = (i128::from(2 * x).abs(), i128::from(2 * y).abs(), 4 * i128::from(square));
    let near = (x - 1).max(0).pow(2) + (y - 1).max(0).pow(2);
    let far = (x + 1).pow(2) + (y + 1).pow(2);
    (near..=far).contains(&square)
}

/// Holds a path against the oracle at every step; gives its end, from the centre.
fn follows_the_circle(path: &Path, centre: (i64, i64), turn: Turn) -> (i64, i64) {
    let square = centre.0 * centre.0 + centre.1 * centre.1;
    let mut place = (-centre.0, -centre.1);
    for (k, offset) in (1..).zip(path.steps()) {
        place = corner_step(place, square, turn);
        let there = (offset[0] - centre.0, offset[1] - centre.1);
        assert_eq!(there, place, "step {k} about {centre:?}, {turn:?}");
        assert!(is_crossed(place, square), "{place:?} about {centre:?}");
    }
    place
}

/// A coordinate of the ideal end, from the centre, in floating point.
fn ideal_end(centre: (i64, i64), billionths: i64) -> (f64, f64) {
    // Whole quarters are taken out first: floating point would not get them right.
    let quarters = billionths.div_euclid(90 * DEGREE).rem_euclid(4);
    let rest = (billionths.rem_euclid(90 * DEGREE) as f64 / 1e9).to_radians();
    let (x, y) = (0..quarters).fold((-centre.0, -centre.1), |(x, y), _| (-y, x));
    let (x, y) = (x as f64, y as f64);
    (x * rest.cos() - y * rest.sin(), x * rest.sin() + y * rest.cos())
}

/// Everything there is to hold about an arc by an angle.
fn check_angle(centre: (i64, i64), billionths: i64) {
    let turn = if billionths < 0 { Turn::Clockwise } else { Turn::Counterclockwise };
    let sweep = Sweep::by_angle((0, 1), centre, billionths);
    assert!(sweep.is_some(), "{billionths} about {centre:?}");
    let Some(sweep) = sweep else { return };
    let path = sweep.path();
    let end = follows_the_circle(&path, centre, turn);
    let (x, y) = ideal_end(centre, billionths);
    // Where the ideal end is in the middle between two steps, floating point cannot tell.
    for (there, ideal) in [(end.0, x), (end.1, y)] {
        assert!((there as f64 - ideal).abs() <= 0.5 + 1e-6, "{end:?} for {x}, {y}");
    }
    // As often round the circle as the angle says.
    let radius = (centre.0 as f64).hypot(centre.1 as f64);
    let per_turn = 8.0 * radius.round();
    let expected = billionths.abs() as f64 / 360e9 * per_turn;
    assert!((path.length() as f64 - expected).abs() <= per_turn / 8.0 + 3.0, "{expected}");
    let arc = radius * (billionths.abs() as f64 / 1e9).to_radians() * 7_937_500.0;
    let length = sweep.length(&[7_937_500; AXES]) as f64;
    assert!((length - arc).abs() <= 1e-9 * arc + 1.0, "{length} for {arc}");
}

#[test]
fn every_centre_nearby() {
    let reach = if cfg!(debug_assertions) { 7 } else { 16 };
    for (x, y) in (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| (x, y))) {
        if (x, y) == (0, 0) {
            continue;
        }
        for degrees in [0, 1, 29, 30, 45, 59, 60, 90, 120, 179, 180, 270, 359, 360, 361, 725] {
            check_angle((x, y), degrees * DEGREE);
            check_angle((x, y), -degrees * DEGREE);
        }
    }
}

#[test]
fn every_whole_degree() {
    for centre in [(2_000, 0), (0, -1), (-300, 401), (7, 24), (-999, -1_000)] {
        for degrees in -360..=360 {
            check_angle(centre, degrees * DEGREE);
        }
    }
}

#[test]
fn quarters_are_exact() {
    for (x, y) in [(3, 4), (-70_001, 12), (100_000_000, 1), (0, -5)] {
        for quarters in -9..=9i64 {
            let sweep = Sweep::by_angle((2, 5), (x, y), quarters * 90 * DEGREE).unwrap();
            let (a, b) = (0..quarters.rem_euclid(4)).fold((-x, -y), |(a, b), _| (-b, a));
            let path = sweep.path();
            assert_eq!(path.at(path.length()), point([0, 0, x + a, 0, 0, y + b]));
        }
    }
}

/// Of the circle of radius 1, 60° are just half a step inward: the half is rounded away.
#[test]
fn halves_are_rounded_away_from_the_centre() {
    for sense in [1, -1] {
        let end = |billionths: i64| {
            let path = Sweep::by_angle((0, 1), (-1, 0), sense * billionths).unwrap().path();
            path.at(path.length())
        };
        assert_eq!(end(60 * DEGREE), point([0, sense]));
        assert_eq!(end(60 * DEGREE + 1), point([-1, sense]));
        assert_eq!(end(30 * DEGREE), point([0, sense]));
        assert_eq!(end(30 * DEGREE - 1), point([]));
    }
}

#[test]
fn the_circle_of_radius_root_two() {
    let path = Sweep::by_angle((0, 1), (-1, -1), 360 * DEGREE).unwrap().path();
    let places: Vec<(i64, i64)> = path.steps().map(|place| (place[0], place[1])).collect();
    let around = [(-1, 0), (-2, 0), (-2, -1), (-2, -2), (-1, -2), (0, -2), (0, -1), (0, 0)];
    assert_eq!(places, around);
    closed_forms_match(&path, 3, true);
}

#[test]
fn what_cannot_be() {
    let right = 90 * DEGREE;
    for plane in [(0, 0), (0, AXES), (usize::MAX, 1)] {
        assert_eq!(Sweep::by_angle(plane, (5, 5), right), None);
        assert_eq!(Sweep::to_point(plane, (5, 5), (1, 1), Turn::Clockwise), None);
    }
    for far in [(1 << 27) + 1, i64::MAX, i64::MIN] {
        assert_eq!(Sweep::by_angle((0, 1), (far, 0), right), None);
        assert_eq!(Sweep::by_angle((0, 1), (0, far), right), None);
        assert_eq!(Sweep::to_point((0, 1), (far, 1), (1, 1), Turn::Clockwise), None);
        assert_eq!(
            Sweep::to_point((0, 1), (1, 1), (far.saturating_add(1), 1), Turn::Clockwise),
            None
        );
        assert_eq!(Sweep::to_point((0, 1), (0, 0), (1, far), Turn::Clockwise), None);
    }
    for angle in [360_000 * DEGREE + 1, i64::MIN, i64::MAX] {
        assert_eq!(Sweep::by_angle((0, 1), (5, 5), angle), None);
    }
    // The centre is in no direction from itself.
    assert_eq!(Sweep::to_point((0, 1), (5, 5), (5, 5), Turn::Clockwise), None);
}

#[test]
fn as_large_as_can_be() {
    let (r, whole) = (1 << 27, 360_000 * DEGREE);
    let path = Sweep::by_angle((0, 1), (r, 0), -whole).unwrap().path();
    assert_eq!((path.length(), path.at(u64::MAX)), (8_000 << 27, point([])));
    assert_eq!(path.extent(u64::MAX), (point([0, -r]), point([2 * r, r])));
    // The far side is √(r - ¼) steps wide on either side of its middle.
    let half_width = r.isqrt() as u64;
    assert_eq!(path.first_at(0, 2 * r), Some((4 << 27) - half_width));
}

#[test]
fn no_radius_no_motion() {
    let sweep = Sweep::by_angle((0, 1), (0, 0), 90 * DEGREE).unwrap();
    assert_eq!((sweep.path().length(), sweep.length(&[5; AXES])), (0, 0));
    // To a place there is the line.
    let sweep = Sweep::to_point((0, 1), (0, 0), (3, -4), Turn::Clockwise).unwrap();
    assert_eq!(sweep.path().at(u64::MAX), point([3, -4]));
    assert_eq!(sweep.stretches(&[10; AXES]), [Stretch { steps: 4, length: 50 }]);
}

#[test]
fn ends_on_and_beside_the_circle() {
    // From (1,000, 0) about the origin: straight on to the far side, then out to twice the radius.
    for turn in TURNS {
        let sweep = Sweep::to_point((0, 1), (-1_000, 0), (-3_000, 0), turn).unwrap();
        let path = sweep.path();
        assert_eq!((path.length(), path.at(4_000)), (5_000, point([-2_000])));
        assert_eq!(path.at(5_000), point([-3_000]));
        // π·1,000 + 1,000 steps of 1,000 pm.
        assert_eq!(sweep.length(&[1_000; AXES]), 4_141_592);
        // In the direction of the start there is only the line, but at the start a turn.
        let outward = Sweep::to_point((0, 1), (-1_000, 0), (500, 0), turn).unwrap();
        let line = Stretch { steps: 500, length: 500_000 };
        assert_eq!(outward.stretches(&[1_000; AXES]), [line]);
        let whole = Sweep::to_point((0, 1), (-1_000, 0), (0, 0), turn).unwrap();
        let sectors = whole.stretches(&[1_000; AXES]);
        assert_eq!(sectors.len(), 64);
        assert_eq!(sectors.iter().map(|sector| sector.steps).sum::<u64>(), 8_000);
        assert_eq!(sectors.iter().map(|sector| sector.length).sum::<u64>(), 6_283_185);
        // Just behind the start nearly a turn, just ahead nearly nothing.
        let beside = |y| Sweep::to_point((0, 1), (-1_000, 0), (0, y), turn).unwrap().path();
        assert_eq!(beside(turn.sign()).length(), 1);
        assert_eq!(beside(-turn.sign()).length(), 7_999);
    }
}

#[test]
fn two_scales_make_an_ellipse() {
    let sweep = Sweep::by_angle((0, 1), (1_000, 0), 180 * DEGREE).unwrap();
    // √((300² + 400²)/2) = 353.
    assert_eq!(sweep.length(&[300, 400, 0, 0, 0, 0]), 1_108_982);
    assert_eq!(sweep.length(&[u64::MAX; AXES]), u64::MAX);
}

proptest! {
    #![proptest_config(cases(1_000))]

    #[test]
    fn any_angle(
        x in prop_oneof![-9..=9i64, -600..=600i64],
        y in prop_oneof![-9..=9i64, -600..=600i64],
        billionths in prop_oneof![-1_000 * DEGREE..1_000 * DEGREE, -DEGREE..DEGREE],
    ) {
        prop_assume!((x, y) != (0, 0));
        check_angle((x, y), billionths);
    }

    #[test]
    fn all_forms(
        x in -60..=60i64,
        y in -60..=60i64,
        degrees in -500..500i64,
        split in 0..900u64,
    ) {
        let path = Sweep::by_angle((0, 3), (x, y), degrees * DEGREE).unwrap().path();
        closed_forms_match(&path, split, false);
    }

    /// Radii of a kilometre: the end is the ideal end, rounded.
    #[test]
    fn far_ends(x in -90_000_000..90_000_000i64, y in -90_000_000..90_000_000i64, angle: i64) {
        prop_assume!((x, y) != (0, 0));
        let angle = angle % (720 * DEGREE);
        let path = Sweep::by_angle((0, 1), (x, y), angle).unwrap().path();
        let end = path.at(path.length());
        let ideal = ideal_end((x, y), angle);
        prop_assert!(((end[0] - x) as f64 - ideal.0).abs() <= 0.5 + 1e-6);
        prop_assert!(((end[1] - y) as f64 - ideal.1).abs() <= 0.5 + 1e-6);
    }

    /// To any end: round the circle as far as its direction, then straight on.
    #[test]
    fn any_end(
        x in -300..=300i64,
        y in -300..=300i64,
        end_x in -300..=300i64,
        end_y in -300..=300i64,
        clockwise: bool,
    ) {
        prop_assume!((x, y) != (0, 0) && (end_x, end_y) != (x, y));
        let turn = TURNS[usize::from(!clockwise)];
        let sweep = Sweep::to_point((0, 1), (x, y), (end_x, end_y), turn).unwrap();
        let path = sweep.path();
        prop_assert_eq!(path.at(u64::MAX), point([end_x, end_y]));
        // The angle between start and end, measured in the sense of rotation.
        let angle = |x: i64, y: i64| ((y * turn.sign()) as f64).atan2(x as f64);
        let mut ahead = angle(end_x - x, end_y - y) - angle(-x, -y);
        let across = x * (y - end_y) - y * (x - end_x);
        let same_direction = across == 0 && x * (x - end_x) + y * (y - end_y) > 0;
        if same_direction && (end_x, end_y) == (0, 0) {
            ahead = std::f64::consts::TAU;
        } else if same_direction {
            ahead = 0.0;
        } else {
            ahead = ahead.rem_euclid(std::f64::consts::TAU);
        }
        // The cell of the circle in that direction, and the steps that lead to it.
        let radius = (x as f64).hypot(y as f64);
        let distance = ((end_x - x) as f64).hypot((end_y - y) as f64);
        let ideal = ((end_x - x) as f64 / distance * radius, (end_y - y) as f64 / distance * radius);
        let straight = (1..=2 * path.length()).find_map(|k| {
            let arc = path.length().checked_sub(k - 1)?;
            let place = path.at(arc);
            let (a, b) = ((place[0] - x) as f64, (place[1] - y) as f64);
            let on_circle = (a - ideal.0).abs() <= 0.5 + 1e-9 && (b - ideal.1).abs() <= 0.5 + 1e-9;
            on_circle.then_some(arc)
        });
        let arc = straight.unwrap();
        let mut place = (-x, -y);
        for offset in path.steps().take(arc as usize) {
            place = corner_step(place, x * x + y * y, turn);
            prop_assert_eq!((offset[0] - x, offset[1] - y), place);
        }
        let per_turn = 8.0 * radius.round();
        let steps = ahead / std::f64::consts::TAU * per_turn;
        prop_assert!((arc as f64 - steps).abs() <= per_turn / 16.0 + 3.0, "{arc} for {steps}");
        let rest = ((end_x - x) as f64 - (path.at(arc)[0] - x) as f64)
            .hypot((end_y - y) as f64 - (path.at(arc)[1] - y) as f64);
        let length = sweep.length(&[1_000_000; AXES]) as f64;
        prop_assert!((length / 1e6 - radius * ahead - rest).abs() < 1e-3, "{length}");
    }
}

/// Along the axes a step is a step long, halfway between them 1/√2: the sectors say so, and they
/// add up to the path and to its length, wherever the arc begins and ends.
#[test]
fn sectors_keep_the_pace_of_the_way() {
    let scale = [1_000_000; AXES];
    for (centre, degrees) in
        [((-9_000, 1), 360), ((3_000, 4_000), -200), ((-77, 12), 33), ((1, 1), 720)]
    {
        let sweep = Sweep::by_angle((0, 1), centre, degrees * DEGREE).unwrap();
        let stretches = sweep.stretches(&scale);
        let sum = |of: fn(&Stretch) -> u64| stretches.iter().map(of).sum::<u64>();
        assert_eq!(sum(|stretch| stretch.steps), sweep.path().length());
        assert_eq!(sum(|stretch| stretch.length), sweep.length(&scale));
        assert!(stretches.iter().all(|stretch| stretch.steps > 0));
    }
    let stretches = Sweep::by_angle((0, 1), (-9_000, 0), 90 * DEGREE).unwrap().stretches(&scale);
    assert_eq!(stretches.len(), 16);
    let pace = |sector: &Stretch| sector.length / sector.steps;
    // Seen from the middle of a sector, at the angle φ, a step is 1/(cos φ + sin φ) long: at 2.8°
    // 0.954, at 42.2° 0.708.
    assert!((945_000..965_000).contains(&pace(&stretches[0])), "{}", pace(&stretches[0]));
    assert!((945_000..965_000).contains(&pace(&stretches[15])), "{}", pace(&stretches[15]));
    assert!((700_000..716_000).contains(&pace(&stretches[7])), "{}", pace(&stretches[7]));
}
