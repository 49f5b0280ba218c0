//! Rounding never accumulates, however long a job is.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fmt::Write;

use proptest::prelude::*;
use vimc4_isel_wire::{Command, Dialect};
use vimc4_ncp::Severity;
use vimc4_ncp::job::{Controller, Job, Options, Step, Target};
use vimc4_plant::Machine;

fn target(machine: &str) -> Target {
    let controller = Controller {
        dialect: Dialect::Imc4,
        speeds: 20..=20_000,
        ramp: vimc4_motion::Ramp { start_stop: 300, acceleration: 100 },
        inputs: Default::default(),
        outputs: Default::default(),
        memory: 32_768,
        command_bytes: 1,
        parameter_bytes: 4,
        branch_from_next: true,
    };
    Target::new(controller, &Machine::builtin(machine).unwrap())
}

/// The steps that a job sends to each axis, which must be where it says it is.
fn sent(job: &str, target: &Target) -> [i64; 4] {
    let mut sums = [0; 4];
    let mut job = Job::new(job, target, Options { no_reference: true, ..Options::default() });
    while let Some(order) = job.next(&mut |diagnostic| {
        assert_ne!(diagnostic.problem.severity(), Severity::Error, "{}", diagnostic.problem);
    }) {
        if let Step::Send(Command::RelativeMove(pairs)) = order.step {
            for (sum, pair) in sums.iter_mut().zip(pairs.as_slice()) {
                *sum += i64::from(pair.steps);
            }
        }
    }
    assert_eq!(job.counters(), sums);
    sums
}

/// `sum` thousandths in steps, a half away from zero.
fn rounded(sum: i64, steps_per_turn: i64, thousandths_per_turn: i64) -> i64 {
    let twice = 2 * i128::from(sum) * i128::from(steps_per_turn);
    let per = i128::from(thousandths_per_turn);
    let steps = (twice.abs() + per) / (2 * per);
    i64::try_from(if sum < 0 { -steps } else { steps }).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, ..ProptestConfig::default() })]

    #[test]
    fn ten_thousand_relative_moves_end_where_their_exact_sum_is(
        ways in prop::collection::vec(
            (prop::array::uniform4(-90_000i64..=90_000), prop::sample::select(vec!["MOVEREL", "FASTREL"])),
            10_000,
        ),
    ) {
        let target = target("bench");
        let mut job = String::from("IMF_PBL\n");
        let mut sums = [0; 4];
        for (way, command) in &ways {
            job += command;
            for ((letter, way), sum) in "XYZA".chars().zip(way).zip(&mut sums) {
                // A turns less, or it would take a command for every two of its steps.
                let way = if letter == 'A' { way / 100 } else { *way };
                *sum += way;
                let sign = if way < 0 { "-" } else { "" };
                write!(job, " {letter}{sign}{}.{:03}", way.abs() / 1_000, way.abs() % 1_000).unwrap();
            }
            job.push('\n');
        }
        let [x, y, z] = [0, 1, 2].map(|axis| rounded(sums[axis], 400, 5_000_000));
        prop_assert_eq!(sent(&job, &target), [x, y, z, rounded(sums[3], 24_000, 1_296_000_000)]);
    }

    #[test]
    fn a_cylinder_turns_to_where_its_surface_is(
        radius in 500i64..90_000,
        ways in prop::collection::vec(-2_000_000i64..=2_000_000, 1..200),
    ) {
        let target = target("bench");
        let mut job = format!("IMF_PBL\nMOVEABS Y777\nCYL A{radius} Y\n");
        for way in &ways {
            let sign = if *way < 0 { "-" } else { "" };
            writeln!(job, "MOVEREL Y{sign}{}.{:03}", way.abs() / 1_000, way.abs() % 1_000).unwrap();
        }
        let way = ways.iter().sum::<i64>() as f64 / 1_000.0;
        let turned = way / radius as f64 / std::f64::consts::TAU * 24_000.0;
        let [x, y, z, a] = sent(&job, &target);
        // Y stays where it was when the cylinder began, at 62.16 steps.
        prop_assert_eq!((x, y, z), (0, 62, 0));
        prop_assert!((a as f64 - turned).abs() <= 0.500_001, "{} {}", a, turned);
    }
}
