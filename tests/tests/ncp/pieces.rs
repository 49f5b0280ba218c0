//! What is said to be lost by movements in pieces is what the controllers lose.

use libtest_mimic::{Failed, Trial};
use vimc4_ncp::job::{self, Job, Options};
use vimc4_tests::jobs;
use vimc4_tests::pieces::{MACHINES, MOVEMENTS, cost, job};

use crate::player::Player;

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials = Vec::new();
    for (what, movement) in MOVEMENTS {
        for machine in MACHINES {
            for model in ["imc4", "imc-s8"] {
                let name = format!("time lost to pieces: {what}, {machine}::{model}");
                trials.push(Trial::test(name, move || check(movement, machine, model)));
            }
        }
    }
    trials
}

/// The controller takes as long as is reckoned, and what takes more than a tenth longer than it
/// could is warned of, and nothing else.
fn check(movement: &str, machine: &str, model: &str) -> Result<(), Failed> {
    let machine = vimc4::machine(machine).map_err(|error| error.to_string())?;
    let model = vimc4::model(model).map_err(|error| error.to_string())?;
    let target = jobs::target(&model, &machine)?;
    let text = job(movement, &target);
    let last = text.lines().count() as u32;

    let device = vimc4::bare(&model, &machine, &[]).map_err(|error| error.to_string())?;
    let mut player = Player::new(device, &[])?;
    let mut job = Job::new(&text, &target, Options::default());
    let (mut pieces, mut took) = (0, 0.0);
    while let Some(order) = job.next(&mut |_| {}) {
        let before = player.now();
        if let Some(line) = order.step.line(target.controller.dialect) {
            player.send(&line)?;
        }
        if order.line == last && !player.take_motions().is_empty() {
            pieces += 1;
            took += (player.now() - before).as_secs_f64();
        }
        player.take_motions();
    }

    let mut warned = false;
    job::check(&text, &target, Options::default(), &mut |diagnostic| {
        warned |= diagnostic.problem.code() == "slow-pieces";
    });
    let Some(delay) = cost(&text, &target) else {
        // A line to the exact end may follow a circle.
        return match pieces <= 2 && !warned {
            true => Ok(()),
            false => Err(format!("{pieces} pieces, of which nobody knows").into()),
        };
    };
    // The controller rounds each step to a nanosecond, and the last few lead to the exact end.
    if (took - delay.takes).abs() > 0.02 * took {
        return Err(format!("it takes {took} s, not {delay:?}").into());
    }
    match warned == (took > 1.1 * delay.could_take) || (delay.share() - 0.1).abs() < 0.02 {
        true => Ok(()),
        false => Err(format!("it takes {took} s, {delay:?}, and warned is {warned}").into()),
    }
}
