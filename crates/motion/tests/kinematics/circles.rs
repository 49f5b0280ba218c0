//! Circles as the manuals have them.

use vimc4_motion::{Arc, ArcState, Helix, Path};

use crate::point;

/// `Summe` of the 1999 manual, appendix A.
fn summe(i: i64) -> i64 {
    if i > 0 { i * (i + 1) } else { -i * (i - 1) }
}

/// Twice the difference register by the manual's formula for a circle of radius `r` at the place
/// and directions of `state`.
fn twice_difference(state: &ArcState, r: i64, counter_clockwise: bool) -> i64 {
    let (rx, ry) = (i64::from(state.rx), i64::from(state.ry));
    let circle = rx * ry * r + rx * ry * summe(r - 1);
    if counter_clockwise {
        circle - rx * summe(state.x + (rx - ry) / 2) + ry * summe(state.y + (rx + ry) / 2)
    } else {
        -circle - rx * summe(state.x + (rx + ry) / 2) + ry * summe(state.y + (ry - rx) / 2)
    }
}

/// The directions in which a circle goes on from a place; on an axis, into the next quadrant.
pub(crate) fn directions(x: i64, y: i64, counter_clockwise: bool) -> (i8, i8) {
    let turn = if counter_clockwise { 1 } else { -1 };
    let (dx, dy) = match (x.signum(), y.signum()) {
        // On an axis one coordinate leaves zero across the circle, the other comes in.
        (sign, 0) => (-sign, sign * turn),
        (0, sign) => (-sign * turn, -sign),
        (sx, sy) => (-sy * turn, sx * turn),
    };
    (dx as i8, dy as i8)
}

/// The radii to try: all in a release build.
fn radii() -> impl Iterator<Item = i64> {
    let sparse = cfg!(debug_assertions);
    (2..=3_000).filter(move |r| !sparse || *r <= 150 || r % 487 == 0)
}

#[test]
fn full_circles_close_and_stay_within_0_84_steps() {
    for r in radii() {
        // 0.84 of a step in squares of hundredths of a step.
        let (inner, outer) = ((100 * r - 84).pow(2), (100 * r + 84).pow(2));
        for counter_clockwise in [true, false] {
            for (x, y) in [(r, 0), (-r, 0), (0, r), (0, -r)] {
                let (rx, ry) = directions(x, y, counter_clockwise);
                // D is -R/2 on the first axis and R/2 on the second, halves away from zero.
                let d = if y == 0 { -(r + 1) / 2 } else { (r + 1) / 2 };
                let start = ArcState { x, y, d, rx, ry };
                let from_manual = twice_difference(&start, r, counter_clockwise);
                assert!((2 * d - from_manual).abs() <= 1, "D of the manual for {start:?}");

                let arc = Arc::new(0, 1, 8 * r as u64, start);
                let mut state = start;
                for _ in 0..8 * r {
                    state.step();
                    let square = 10_000 * (state.x.pow(2) + state.y.pow(2));
                    assert!(inner < square && square < outer, "{state:?} of radius {r}");
                }
                assert_eq!(state, start);
                assert_eq!(arc.state_at(8 * r as u64), start);
                // The first turn shows all there is, in the right sense.
                let quarter = arc.state_at(2 * r as u64);
                let turned = if counter_clockwise { (-y, x) } else { (y, -x) };
                assert_eq!((quarter.x, quarter.y), turned);
                let (low, high) = Path::Arc(arc).extent(u64::MAX);
                assert_eq!((low[0] + x, low[1] + y, high[0] + x, high[1] + y), (-r, -r, r, r));
            }
        }
    }
}

#[test]
fn the_difference_register_is_that_of_the_manual_everywhere() {
    let limit = if cfg!(debug_assertions) { 25 } else { 70i64 };
    for r in (2..=limit).chain([200, 1_000]) {
        for counter_clockwise in [true, false] {
            // Start at the point of the circle nearest to every column, above and below.
            let stride = if r > limit { 97 } else { 1 };
            for x in (-r..=r).step_by(stride) {
                let square = r * r - x * x;
                let root = square.isqrt();
                let nearest = if square > root * root + root { root + 1 } else { root };
                for y in [nearest, -nearest] {
                    if x == 0 || y == 0 {
                        continue;
                    }
                    let (rx, ry) = directions(x, y, counter_clockwise);
                    let mut state = ArcState { x, y, d: 0, rx, ry };
                    state.d = twice_difference(&state, r, counter_clockwise).div_euclid(2);
                    for _ in 0..17 * r {
                        if state.x != 0 && state.y != 0 {
                            let formula = twice_difference(&state, r, counter_clockwise);
                            let error = (2 * state.d - formula).abs();
                            assert!(error <= 1, "{state:?} of radius {r} from ({x}, {y})");
                        }
                        state.step();
                    }
                }
            }
        }
    }
}

#[test]
fn the_quarter_circle_of_the_manual() {
    // y400,1500,119,-141,141,-1,-1
    let start = ArcState { x: -141, y: 141, d: 119, rx: -1, ry: -1 };
    let end = Arc::new(0, 1, 400, start).state_at(400);
    assert_eq!((end.x, end.y, end.d), (-141, -141, -119));
    assert_eq!((end.rx, end.ry), (1, -1));
    assert_eq!(Path::Arc(Arc::new(0, 1, 400, start)).at(400), point([0, -282]));
}

#[test]
fn the_half_circles() {
    // y1600,1000,-200,±400,0 in both senses
    for (x, ry) in [(400, 1), (400, -1), (-400, 1), (-400, -1)] {
        let rx = if x > 0 { -1 } else { 1 };
        let end = Arc::new(0, 1, 1_600, ArcState { x, y: 0, d: -200, rx, ry }).state_at(1_600);
        assert_eq!((end.x, end.y), (-x, 0));
    }
}

#[test]
fn the_helix_of_the_manual() {
    // w32000,600,-1000,-2000,0,1,-1,6000: two turns
    let start = ArcState { x: -2_000, y: 0, d: -1_000, rx: 1, ry: -1 };
    let helix = Path::Helix(Helix::new(Arc::new(0, 1, 32_000, start), 2, 6_000));
    assert_eq!(helix.length(), 32_000);
    assert_eq!(helix.at(16_000), point([0, 0, 3_000]));
    assert_eq!(helix.at(32_000), point([0, 0, 6_000]));
    assert_eq!(helix.extent(32_000), (point([0, -2_000]), point([4_000, 2_000, 6_000])));
    assert_eq!(helix.steps().last(), Some(point([0, 0, 6_000])));
    // The far side is reached in the middle of the flat part, which is 2·45 steps long.
    assert_eq!(helix.first_at(0, 4_000), Some(8_000 - 45));
    assert_eq!(helix.first_at(2, 3_000), Some(15_998));
}
