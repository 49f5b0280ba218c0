//! Fitted circles, held against the manual and against a walk of every step.

use proptest::prelude::*;
use vimc4_motion::{ArcState, CircleFit, Turn};

use crate::cases;

const TURNS: [Turn; 2] = [Turn::Clockwise, Turn::Counterclockwise];

/// The sum of the manual's formula (99 appendix A).
fn summe(i: i64) -> i64 {
    if i > 0 { i * (i + 1) } else { -i * (i - 1) }
}

/// Twice the difference register by the manual's formulas, with a radius given by its square.
fn twice_difference(state: &ArcState, square: i64, turn: Turn) -> i64 {
    let (rx, ry) = (i64::from(state.rx), i64::from(state.ry));
    let (x, y) = match turn {
        Turn::Counterclockwise => (state.x + (rx - ry) / 2, state.y + (rx + ry) / 2),
        Turn::Clockwise => (state.x + (rx + ry) / 2, state.y + (ry - rx) / 2),
    };
    turn.sign() * rx * ry * square - rx * summe(x) + ry * summe(y)
}

/// Every place whose coordinates are those of a point of the circle, rounded: the places of the
/// grid that the circle comes within half a step of, in both coordinates.
fn places_on(square: i64) -> impl Iterator<Item = (i64, i64)> {
    let radius = square.isqrt() + 1;
    // In half steps, so that the corners of the cell around a place are on the grid.
    (-radius..=radius).flat_map(move |x| {
        (-radius..=radius).filter_map(move |y| {
            let nearest = (2 * x.abs() - 1).max(0).pow(2) + (2 * y.abs() - 1).max(0).pow(2);
            let furthest = (2 * x.abs() + 1).pow(2) + (2 * y.abs() + 1).pow(2);
            let inside = (nearest..=furthest).contains(&(4 * square));
            (inside && (x, y) != (0, 0)).then_some((x, y))
        })
    })
}

#[test]
fn the_circles_of_the_manual() {
    use Turn::{Clockwise, Counterclockwise};
    // Each: start, radius, sense, end; steps, D, directions. First the example of 99 2.3.6, then
    // the half circles of its sample program, then the helix of the manual of 2012, two turns.
    for (start, radius, turn, end, turns, steps, d, rx, ry) in [
        ((-141, 141), 200, Counterclockwise, (-141, -141), 0, 400, 119, -1, -1),
        ((400, 0), 400, Clockwise, (-400, 0), 0, 1_600, -200, -1, -1),
        ((-400, 0), 400, Clockwise, (400, 0), 0, 1_600, -200, 1, 1),
        ((400, 0), 400, Counterclockwise, (-400, 0), 0, 1_600, -200, -1, 1),
        ((-400, 0), 400, Counterclockwise, (400, 0), 0, 1_600, -200, 1, -1),
        ((-2_000, 0), 2_000, Counterclockwise, (-2_000, 0), 2, 32_000, -1_000, 1, -1),
    ] {
        let fit = CircleFit::new(start.0, start.1, radius * radius, turn).unwrap();
        let registers = ArcState { x: start.0, y: start.1, d, rx, ry };
        assert_eq!(fit.start(), registers);
        assert_eq!(fit.steps_to(end, turns), steps);
        let ArcState { x, y, .. } = fit.after(steps);
        assert_eq!((x, y), end);
    }
}

#[test]
fn every_start_gets_the_difference_of_the_manual_and_its_circle_closes() {
    let limit = if cfg!(debug_assertions) { 30 } else { 100i64 };
    let mut clamped = 0;
    // Squares of radii, and between them those of radii that are no whole number.
    for square in (1..limit).flat_map(|r| [r * r, r * r + r / 2, r * r + r]) {
        for (x, y) in places_on(square) {
            for turn in TURNS {
                let fit = CircleFit::new(x, y, square, turn)
                    .unwrap_or_else(|| panic!("({x}, {y}) is on the circle of square {square}"));
                let start = fit.start();
                assert!(-x.abs() < start.d && start.d <= y.abs(), "{start:?}");
                let error = (2 * start.d - twice_difference(&start, square, turn)).abs();
                assert!(error <= 2, "{start:?} of square {square}");
                clamped += i32::from(error == 2);

                let turn_steps = fit.steps_per_turn();
                let (mut inner, mut outer) = (i64::MAX, 0);
                let mut state = start;
                for steps in 1..=turn_steps {
                    state.step();
                    assert!(steps == turn_steps || state != start);
                    inner = inner.min(state.x.pow(2) + state.y.pow(2));
                    outer = outer.max(state.x.pow(2) + state.y.pow(2));
                    assert!(-state.x.abs() < state.d && state.d <= state.y.abs());
                }
                assert_eq!(state, start, "after a turn");
                assert_eq!(fit.steps_to((x, y), 1), turn_steps);
                assert_eq!(fit.steps_to((x, y), 0), 0);
                let radius = (square as f64).sqrt();
                let limit = if square.isqrt().pow(2) == square { 1.0 } else { 2.0 };
                assert!((inner as f64).sqrt() > radius - limit, "{start:?} of square {square}");
                assert!((outer as f64).sqrt() < radius + limit, "{start:?} of square {square}");
            }
        }
    }
    assert!(clamped > 0, "the hair that is cut is rare but there");
}

#[test]
fn what_is_on_no_circle_is_refused() {
    for turn in TURNS {
        assert_eq!(CircleFit::new(0, 0, 0, turn), None);
        assert_eq!(CircleFit::new(0, 0, 1, turn), None);
        assert_eq!(CircleFit::new(200, 3, 198 * 198, turn), None);
        assert_eq!(CircleFit::new(1 << 25, 0, 1 << 50, turn), None);
        assert_eq!(CircleFit::new(i64::MIN, i64::MAX, i64::MAX, turn), None);
        assert_eq!(CircleFit::new(3, 4, -25, turn), None);
        assert!(CircleFit::new(1 << 24, 1 << 24, 1 << 49, turn).is_none());
        assert!(CircleFit::new(1 << 24, 1 << 23, 5 << 46, turn).is_some());
    }
}

#[test]
fn wild_ends_have_an_answer() {
    let fit = CircleFit::new(200, 0, 40_000, Turn::Clockwise).unwrap();
    assert!(fit.steps_to((0, 0), 0) <= fit.steps_per_turn() + 1_000);
    assert_eq!(fit.steps_to((0, -1_000), 3), 3 * 1_600 + 400);
    assert!(fit.steps_near((i64::MIN, i64::MAX), u32::MAX).end() > &0);
    assert!(fit.steps_to((i64::MIN, i64::MAX), u32::MAX) > 0);
    let least = CircleFit::new(1, 0, 0, Turn::Clockwise).unwrap();
    assert_eq!(least.steps_per_turn(), 8);
}

/// A point of the circle of `radius` at an angle, rounded, and then put beside it.
fn place(radius: f64, angle: f64, beside: (i64, i64)) -> (i64, i64) {
    let (x, y) = (radius * angle.cos(), radius * angle.sin());
    (x.round() as i64 + beside.0, y.round() as i64 + beside.1)
}

proptest! {
    #![proptest_config(cases(3_000))]

    /// No place of the walk is nearer to the end, as far as an eighth of a turn around.
    #[test]
    fn the_number_of_steps_is_the_best(
        radius in prop_oneof![1.0..40.0f64, 1.0..900.0f64],
        from in 0.0..std::f64::consts::TAU,
        to in 0.0..std::f64::consts::TAU,
        beside in prop_oneof![3 => Just((0, 0)), 1 => (-3..=3i64, -3..=3i64)],
        turns in 0..3u32,
        clockwise: bool,
    ) {
        let turn = if clockwise { Turn::Clockwise } else { Turn::Counterclockwise };
        let square = (radius * radius).round() as i64;
        let (x, y) = place(radius, from, (0, 0));
        let fit = CircleFit::new(x, y, square, turn).unwrap();
        let end = place(radius, to, if radius < 8.0 { (0, 0) } else { beside });
        let steps = fit.steps_to(end, turns);

        let near = fit.steps_near(end, turns);
        prop_assert!(near.contains(&steps));
        let around = fit.steps_per_turn() / 8;
        let distance = |state: &ArcState| (state.x - end.0).pow(2) + (state.y - end.1).pow(2);
        let mut state = fit.start();
        let mut best = i64::MAX;
        for k in 0..=near.end() + around {
            prop_assert!(k % 97 != 0 || fit.after(k) == state);
            if k + around >= *near.start() {
                best = best.min(distance(&state));
            }
            state.step();
        }
        prop_assert_eq!(distance(&fit.after(steps)), best);
    }
}
