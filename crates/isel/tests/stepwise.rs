//! The controller computes where motions end; here every step is walked instead. Random lines,
//! arcs and helices on a machine with switches, ended by nothing, by a switch, 253, 255, a port,
//! or a power loss, must end at the same step, at the same time and in the same place.
//!
//! `VIMC4_CASES=100000 cargo test --release -p vimc4-isel --test stepwise` tries as many cases.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

#[path = "../../plant/tests/support/mod.rs"]
mod support;

use std::sync::Arc;

use support::walk::Walk;
use support::{Random, mechanics, run_out, text, try_all};
use vimc4_device::{Device, Harness, Input, Kinds, Time};
use vimc4_isel::{Controller, Model};
use vimc4_plant::{Machine, PlantSignal};

/// A machine with switches around where the carriages stand, with ends and play.
fn machine(random: &mut Random) -> Machine {
    let mut machine = Machine::clone(&Machine::builtin("mill-4axis").expect("built in"));
    let axes = &mut machine.axes;
    let further = [axes.z.as_mut(), axes.a.as_mut()];
    for axis in [&mut axes.x, &mut axes.y].into_iter().chain(further.into_iter().flatten()) {
        mechanics(axis, random);
    }
    machine
}

fn controller(machine: &Arc<Machine>) -> Harness<Controller> {
    let mut model = Model::builtin("imc-s8").expect("a built-in model");
    // A carriage that runs on when it is halted without a ramp goes further than the counter.
    Arc::make_mut(&mut model).quirks.lost_steps = false;
    let controller = Controller::new(model, Arc::clone(machine), b"");
    Harness::new(controller.expect("an erased flash memory"))
}

fn positions(controller: &Harness<Controller>) -> Vec<i64> {
    let view = controller.device().view(controller.now());
    view.axes.iter().map(|axis| axis.position).collect()
}

fn carriages(controller: &Harness<Controller>) -> Vec<i64> {
    let view = controller.device().view(controller.now());
    view.axes.iter().map(|axis| axis.carriage).collect()
}

fn command(random: &mut Random, axes: u8) -> String {
    let speed = |random: &mut Random| match random.range(0, 2) {
        0 => random.range(20, 400),
        1 => random.range(300, 5_000),
        _ => random.range(5_000, 40_000),
    };
    let way = |random: &mut Random| match random.range(0, 3) {
        0 => 0,
        1 => random.range(-20, 20),
        _ => random.range(-1_500, 1_500),
    };
    let pairs = match axes {
        1 => 1,
        3 => 2,
        _ => 4,
    };
    match random.range(0, 4) {
        0 | 1 => {
            let pairs: Vec<String> =
                (0..pairs).map(|_| format!("{},{}", way(random), speed(random))).collect();
            format!("@0A{}", pairs.join(","))
        }
        2 if axes >= 3 => {
            let (d, x, y) = match random.one_in(3) {
                true => {
                    (random.range(-9_000, 9_000), random.range(-300, 300), random.range(-300, 300))
                }
                false => {
                    let radius = random.range(1, 300);
                    (-radius / 2, radius, 0)
                }
            };
            let sign = |random: &mut Random| if random.one_in(2) { 1 } else { -1 };
            let (rx, ry) = (sign(random), sign(random));
            let arc = format!("{},{},{d},{x},{y},{rx},{ry}", random.range(1, 3_000), speed(random));
            match random.one_in(2) && axes >= 7 {
                true => format!("@0w{arc},{}", random.range(-4_000, 4_000)),
                false => format!("@0y{arc}"),
            }
        }
        _ => {
            let count = axes.count_ones();
            let ways: Vec<String> = (0..count).map(|_| way(random).to_string()).collect();
            format!("@0Z0,1,1,{},{}", speed(random), ways.join(","))
        }
    }
}

fn try_case(seed: u64) {
    let mut random = Random(seed);
    let machine = Arc::new(machine(&mut random));
    let mut tried = controller(&machine).watching(Kinds::ALL);
    let axes = *random.pick(&[1u8, 3, 7, 15]);
    let mut setup = match axes {
        15 => "@07\r@08\r".to_owned(),
        axes => format!("@0{axes}\r"),
    };
    for (letter, low, high) in [("j", 20, 1_000), ("J", 1, 400)] {
        if random.one_in(2) {
            setup.push_str(&format!("@0{letter}{}\r", random.range(low, high)));
        }
    }
    setup.push_str(&format!(
        "@0e{}\r@0z{}\r",
        if axes >= 7 { random.range(0, 2) } else { 0 },
        random.range(0, 1)
    ));
    tried.send(setup.as_bytes());
    let answers = text(&mut tried);
    assert!(answers.chars().all(|answer| answer == '0'), "{setup:?}: {answers}");
    tried.drain();

    let command = command(&mut random, axes);
    let start = Time::from_nanos(random.range(0, 3_000_000_000) as u64);
    tried.run_to(start);
    tried.send(format!("{command}\r").as_bytes());

    let ended_by = random.range(0, 5);
    let at = start.after_nanos(random.range(0, 700_000_000) as u64);
    let power_lost = ended_by == 3;
    if ended_by > 0 {
        tried.run_to(at);
        match ended_by {
            1 => tried.send(&[253]),
            2 => tried.send(&[255]),
            3 => tried.input(Input::Power(false)),
            4 => tried.input(Input::Signal(PlantSignal::Input(0).id(), 1)),
            _ => {}
        }
    }
    run_out(&mut tried, 100);

    let answer = text(&mut tried);
    let walk = Walk::all(Arc::clone(&machine), tried.outputs(), power_lost);
    if !power_lost {
        assert_eq!(positions(&tried), walk.counter[..4], "{command}");
    }
    assert_eq!(carriages(&tried), walk.carriages()[..4], "{command}");
    let expected: &[&str] = match ended_by {
        1 => &["0", "F", "2"],
        3 => &["", "0", "2"],
        _ => &["0", "2"],
    };
    assert!(expected.contains(&answer.as_str()), "{command} answered {answer:?}");

    // What was stopped is finished by `S`, in the same place as if it had not been stopped.
    if answer == "F" {
        tried.send(b"@0S\r");
        run_out(&mut tried, 100);
        let answer = text(&mut tried);
        assert!(["0", "2"].contains(&answer.as_str()), "{command}: S answered {answer}");
        let mut whole = controller(&machine);
        whole.send(format!("{setup}{command}\r").as_bytes());
        run_out(&mut whole, 100);
        assert_eq!(positions(&tried), positions(&whole), "{command}");
    }
}

#[test]
fn motions_end_where_a_walk_of_every_step_ends() {
    try_all(400, try_case);
}
