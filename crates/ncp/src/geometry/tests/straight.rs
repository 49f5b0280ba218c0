//! Straight moves.

use proptest::prelude::*;

use super::super::{MOST_STEPS, Motion, Steps, Straight, StraightParameters};
use super::{SPEEDS, cases};

const SPEED: u32 = 1_000;
const A_SPEED: u32 = 300;

fn straight(by: Steps) -> Straight {
    Straight::new(StraightParameters {
        by,
        speed: SPEED,
        a_speed: A_SPEED,
        is_rapid: false,
        apart: 1,
    })
}

fn lines(by: Steps) -> Vec<Motion> {
    straight(by).collect()
}

/// How many of `m` steps are made at the `k`-th of `n`, as a controller rounds.
fn made(k: i64, m: i64, n: i64) -> i64 {
    m.signum() * ((2 * k * m.abs() + n) / (2 * n))
}

/// Walks a move and holds it against all axes moving together.
fn check(by: Steps) -> Result<(), TestCaseError> {
    let linear = by[..3].iter().map(|steps| steps.abs()).max().unwrap();
    let (a, fewer) = (by[3].abs(), linear.min(by[3].abs()));
    let motions = lines(by);
    let expected = if fewer == 0 { usize::from(linear + a > 0) } else { fewer as usize + 1 };
    prop_assert_eq!(motions.len(), expected);

    let mut at = [0; 4];
    for motion in motions {
        let Motion::Line { by: piece, speed } = motion else { panic!("{motion:?}") };
        let moves_a = piece[3] != 0;
        prop_assert!(moves_a != piece[..3].iter().any(|steps| *steps != 0), "{piece:?}");
        prop_assert_eq!(speed, if moves_a { A_SPEED } else { SPEED });
        prop_assert_eq!(motion.speed(), speed);
        prop_assert_eq!(motion.path().length() as i64, piece.iter().fold(0, |n, s| s.abs().max(n)));
        for way in motion.path().steps() {
            let place: Steps = std::array::from_fn(|axis| at[axis] + way[axis]);
            let longest = place[..3].iter().map(|steps| steps.abs()).max().unwrap();
            // The one with more steps says how far all are.
            if a <= linear {
                let together = made(longest, by[3], linear);
                prop_assert!((place[3] - together).abs() <= 1, "{place:?}");
            } else {
                let together = made(place[3].abs(), linear, a);
                prop_assert!((longest - together).abs() <= 1, "{place:?}");
            }
            for axis in 0..3 {
                let on_line = made(longest, by[axis], linear.max(1));
                prop_assert!((place[axis] - on_line).abs() <= 1, "{place:?}");
            }
        }
        let end = motion.path().at(u64::MAX);
        for (at, by) in at.iter_mut().zip(end) {
            *at += by;
        }
        // Where a piece ends, X, Y and Z are on the line.
        let longest = at[..3].iter().map(|steps| steps.abs()).max().unwrap();
        for axis in 0..3 {
            prop_assert_eq!(at[axis], made(longest, by[axis], linear.max(1)));
        }
    }
    prop_assert_eq!(at, by);
    Ok(())
}

proptest! {
    #![proptest_config(cases(5_000))]

    #[test]
    fn nothing_is_ever_more_than_a_step_behind(
        by in [-60..=60i64, -60..=60i64, -60..=60i64, -60..=60i64],
    ) {
        check(by)?;
    }

    #[test]
    fn nor_where_one_is_much_longer(
        by in [-2_000..=2_000i64, -40..=40i64, -40..=40i64, -2_000..=2_000i64],
        short: bool,
    ) {
        let [x, y, z, a] = by;
        check(if short { [x, y, z, a / 90] } else { [x / 90, y, z, a] })?;
    }
}

proptest! {
    #![proptest_config(cases(2_000))]

    /// What it costs is known without making the pieces.
    #[test]
    fn the_delay_is_that_of_all_pieces(
        x in -900..=900i64,
        y in -9..=9i64,
        a in -900..=900i64,
        apart in 1..=9u32,
    ) {
        let by = [x, y, 0, a];
        let straight =
            Straight::new(StraightParameters { by, speed: 4_000, a_speed: 700, is_rapid: false, apart });
        let seconds = |motion: &Motion| {
            SPEEDS.seconds(motion.path().length() as f64, f64::from(motion.speed()))
        };
        let motions: Vec<Motion> = straight.clone().collect();
        match straight.delay(SPEEDS) {
            None => prop_assert!(motions.len() <= 1),
            Some(delay) => {
                let takes: f64 = motions.iter().map(seconds).sum();
                prop_assert!((delay.takes - takes).abs() < 1e-9, "{delay:?} {takes}");
                prop_assert_eq!(delay.pieces, motions.len() as u64);
            }
        }
    }

    /// And neither is further from where it would be than is allowed.
    #[test]
    fn a_is_as_far_apart_as_is_allowed(
        linear in 1..=900i64,
        a in 1..=900i64,
        apart in 1..=9u32,
    ) {
        let by = [linear, 0, 0, -a];
        let pieces = Straight::new(StraightParameters { by, speed: SPEED, a_speed: A_SPEED, is_rapid: false, apart });
        let (most, fewer) = (linear.max(a), linear.min(a));
        let mut at = [0; 2];
        let mut number = 0;
        for motion in pieces {
            let Motion::Line { by, .. } = motion else { panic!("{motion:?}") };
            at = [at[0] + by[0], at[1] - by[3]];
            number += 1;
            let (major, minor) = if a <= linear { (at[0], at[1]) } else { (at[1], at[0]) };
            prop_assert!((minor - made(major, fewer, most)).abs() <= i64::from(apart), "{at:?}");
        }
        prop_assert_eq!(at, [linear, a]);
        prop_assert!(number <= fewer / i64::from(apart) + 2, "{}", number);
    }
}

#[test]
fn every_small_move() {
    for linear in 0..=12 {
        for a in -12..=12 {
            check([linear, 0, -linear / 2, a]).unwrap();
        }
    }
}

#[test]
fn what_is_alone_is_one_line() {
    assert_eq!(lines([0; 4]), []);
    assert_eq!(lines([3, -9, 4, 0]), [Motion::Line { by: [3, -9, 4, 0], speed: SPEED }]);
    assert_eq!(lines([0, 0, 0, -7]), [Motion::Line { by: [0, 0, 0, -7], speed: A_SPEED }]);
}

#[test]
fn a_makes_two_steps_at_a_time() {
    let along = |x| Motion::Line { by: [x, 0, 0, 0], speed: SPEED };
    let turned = |a| Motion::Line { by: [0, 0, 0, a], speed: A_SPEED };
    let expected = [along(100), turned(-2), along(200), turned(-2), along(200), turned(-1)];
    assert_eq!(lines([500, 0, 0, -5]), expected);
}

#[test]
fn what_no_command_holds_is_divided() {
    let way = 2 * MOST_STEPS + 5;
    let pieces = lines([way, way / 2, 0, 0]);
    let ways: Vec<Steps> = pieces
        .iter()
        .map(|piece| match piece {
            Motion::Line { by, .. } => *by,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(ways.iter().map(|by| by[0]).collect::<Vec<_>>(), [MOST_STEPS, MOST_STEPS, 5]);
    assert_eq!(ways.iter().map(|by| by[1]).sum::<i64>(), way / 2);
    let turned: Vec<Motion> = lines([0, 0, 0, -way]);
    assert_eq!(turned.len(), 3);
    // A single step of A in the middle of it.
    assert_eq!(lines([0, way, 0, 1]).len(), 4);
}

#[test]
fn millions_of_pieces_are_made_one_by_one() {
    let way = MOST_STEPS;
    let mut pieces = straight([way, 0, 0, way]);
    let first: Vec<Motion> = pieces.by_ref().take(3).collect();
    let line = |by| Motion::Line { by, speed: SPEED };
    let turned = Motion::Line { by: [0, 0, 0, 2], speed: A_SPEED };
    assert_eq!(first, [line([1, 0, 0, 0]), turned, line([2, 0, 0, 0])]);
    assert_ne!(pieces, straight([way, 0, 0, way]));
}
