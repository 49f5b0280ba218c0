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
use support::{Random, Record, drain, run_out, run_to, try_all};
use vimc4_device::{Device, Input, Kinds, Time};
use vimc4_isel::{Controller, Model};
use vimc4_plant::{Machine, PlantSignal};

/// A machine with switches around where the carriages stand, and mechanics far beyond.
fn machine(random: &mut Random) -> Machine {
    let mut machine = Machine::clone(&Machine::builtin("mill-4axis").expect("built in"));
    let axes = &mut machine.axes;
    let further = [axes.z.as_mut(), axes.a.as_mut()];
    for axis in [&mut axes.x, &mut axes.y].into_iter().chain(further.into_iter().flatten()) {
        axis.inverted = random.one_in(4);
        axis.start = 0;
        axis.lowest = None;
        axis.highest = None;
        axis.negative_switch = (!random.one_in(3)).then(|| -random.range(1, 900));
        axis.positive_switch = (!random.one_in(3)).then(|| random.range(1, 900));
    }
    machine
}

fn controller(model: &str, machine: Arc<Machine>, watching: Kinds) -> Controller {
    let model = Model::builtin(model).expect("a built-in model");
    let mut controller = Controller::new(model, machine, b"").expect("an erased flash memory");
    controller.watch(watching);
    controller
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
    let mut controller = controller("imc-s8", Arc::clone(&machine), Kinds::ALL);
    let mut record = Record::default();
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
    controller.handle(Input::Bytes(setup.as_bytes()), Time::ZERO);
    drain(&mut controller, &mut record);
    assert!(record.said.iter().all(|&(_, byte)| byte == b'0'), "{setup:?}: {}", record.text());
    record = Record::default();

    let command = command(&mut random, axes);
    let start = Time::from_nanos(random.range(0, 3_000_000_000) as u64);
    run_to(&mut controller, &mut record, start);
    controller.handle(Input::Bytes(format!("{command}\r").as_bytes()), start);

    let ended_by = random.range(0, 5);
    let at = start.after_nanos(random.range(0, 700_000_000) as u64);
    let power_lost = ended_by == 3;
    if ended_by > 0 {
        run_to(&mut controller, &mut record, at);
        match ended_by {
            1 => controller.handle(Input::Bytes(&[253]), at),
            2 => controller.handle(Input::Bytes(&[255]), at),
            3 => controller.handle(Input::Power(false), at),
            4 => controller.handle(Input::Signal(PlantSignal::Input(0).id(), 1), at),
            _ => {}
        }
    }
    run_out(&mut controller, &mut record, 100);

    let walk = Walk::all(machine, &record.events, power_lost);
    let view = controller.view(controller.now());
    if !power_lost {
        let counters: Vec<i64> = view.axes.iter().map(|axis| axis.position).collect();
        assert_eq!(counters, walk.counter[..4], "{command}");
    }
    let answer = record.text();
    let expected: &[&str] = match ended_by {
        1 => &["0", "F", "2"],
        3 => &["", "0", "2"],
        _ => &["0", "2"],
    };
    assert!(expected.contains(&answer.as_str()), "{command} answered {answer:?}");

    // What was stopped is finished by `S`, in the same place as if it had not been stopped.
    if answer == "F" {
        let now = controller.now();
        controller.handle(Input::Bytes(b"@0S\r"), now);
        let mut rest = Record::default();
        run_out(&mut controller, &mut rest, 100);
        let mut whole = controller_for(&walk.machine, &setup, &command);
        assert!(
            ["0", "2"].contains(&rest.text().as_str()),
            "{command}: S answered {}",
            rest.text()
        );
        let end =
            |c: &Controller| c.view(c.now()).axes.iter().map(|a| a.position).collect::<Vec<_>>();
        assert_eq!(end(&controller), end(&whole), "{command}");
        drain(&mut whole, &mut Record::default());
    }
}

/// The same motion from start to end without an interruption.
fn controller_for(machine: &Arc<Machine>, setup: &str, command: &str) -> Controller {
    let mut whole = controller("imc-s8", Arc::clone(machine), Kinds::NONE);
    whole.handle(Input::Bytes(format!("{setup}{command}\r").as_bytes()), Time::ZERO);
    run_out(&mut whole, &mut Record::default(), 100);
    whole
}

#[test]
fn motions_end_where_a_walk_of_every_step_ends() {
    try_all(400, try_case);
}
