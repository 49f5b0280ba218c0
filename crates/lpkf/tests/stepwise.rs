//! The controller computes where motions end; here every step is walked instead. Random lines,
//! arcs and following vectors on a machine with switches, ended by nothing, by a switch, the
//! border of a range, the external stop, a message, a fault or a power loss, must end at the
//! same step, at the same time and in the same place.
//!
//! `VIMC4_CASES=100000 cargo test --release -p vimc4-lpkf --test stepwise` tries as many cases.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

#[path = "../../plant/tests/support/mod.rs"]
mod support;

use std::sync::Arc;

use support::walk::Walk;
use support::{Random, mechanics, run_out, text, try_all};
use vimc4_device::{Device, Harness, Input, Kinds, Time};
use vimc4_lpkf::{Controller, Model};
use vimc4_plant::Machine;

/// A machine with switches around where the carriages stand, with ends and play.
fn machine(random: &mut Random) -> Machine {
    let mut machine = Machine::clone(&Machine::builtin("bench").expect("built in"));
    let axes = &mut machine.axes;
    let further = [&mut axes.z, &mut axes.a, &mut axes.z2, &mut axes.z3];
    let further = further.into_iter().filter_map(Option::as_mut);
    for axis in [&mut axes.x, &mut axes.y].into_iter().chain(further) {
        mechanics(axis, random);
    }
    machine
}

fn way(random: &mut Random) -> i64 {
    match random.range(0, 3) {
        0 => 0,
        1 => random.range(-20, 20),
        _ => random.range(-1_500, 1_500),
    }
}

fn command(random: &mut Random, model: &str) -> String {
    match random.range(-4, if model == "smcu" { 2 } else { 4 }) {
        // What only some machines have; an SMCU of these tests does.
        -4 if model == "smcu" => format!("CI{}", random.range(-300, 300)),
        -3 if model == "smcu" => format!("EA{},{}", way(random), way(random)),
        -2 if model == "smcu" => format!("ER{},{}", way(random), way(random)),
        -4..=-1 => {
            let letters = if random.one_in(2) { "!TA" } else { "!TR" };
            format!("{letters}{},{},{}", way(random), way(random), way(random))
        }
        0 => format!("PR{},{}", way(random), way(random)),
        1 => {
            let degrees = random.range(-360_000, 360_000) as f64 / 1_000.0;
            format!("AR{},{},{degrees}", random.range(-300, 300), random.range(-300, 300))
        }
        2 => format!("PA{},{},{},{}", way(random), way(random), way(random), way(random)),
        3 => {
            let ways: Vec<String> = (0..6).map(|_| way(random).to_string()).collect();
            format!("!MR{}", ways.join(","))
        }
        _ => {
            let mut text = "!PH0,1\r".to_owned();
            let mut speed = 0;
            for last in [false, false, true] {
                let change = match last {
                    true => -speed,
                    false => random.range(1, 30_000),
                };
                speed += change;
                let (x, y) = (random.range(1, 400), way(random));
                let turn = random.range(-1, 1);
                let (i, j) = (way(random), random.range(1, 300));
                text.push_str(&format!("X{x}Y{y}I{i}J{j}O{turn}F{change}\r"));
            }
            text
        }
    }
}

fn controller(model: &str, machine: &Arc<Machine>, setup: &str) -> Harness<Controller> {
    let mut model = Model::builtin(model).expect("built in");
    let is_smcu = model.name == "smcu";
    Arc::make_mut(&mut model).language.shapes = is_smcu;
    let mut controller = Harness::new(Controller::new(model, Arc::clone(machine)));
    controller.send(setup.as_bytes());
    let answers = text(&mut controller);
    assert!(!answers.contains('E'), "{setup:?}: {answers}");
    controller.watching(Kinds::ALL)
}

fn set(controller: &mut Harness<Controller>, name: &str, value: i32) {
    let signals = controller.device().signals();
    let signal = signals.iter().find(|signal| signal.name == name).expect(name);
    controller.input(Input::Signal(signal.id, value));
}

fn positions(controller: &Harness<Controller>) -> Vec<i64> {
    let view = controller.device().view(controller.now());
    view.axes.iter().map(|axis| axis.position).collect()
}

fn carriages(controller: &Harness<Controller>) -> Vec<i64> {
    let view = controller.device().view(controller.now());
    view.axes.iter().map(|axis| axis.carriage).collect()
}

fn try_case(seed: u64) {
    let mut random = Random(seed);
    let machine = Arc::new(machine(&mut random));
    let model = *random.pick(&["smcu", "motionsystem"]);
    let mut setup = "!ES1;".to_owned();
    if model == "smcu" {
        setup.push_str(&format!("!VU{};", random.range(100, 200_000)));
        setup.push_str(&format!("!AS{};", random.range(10, 5_000)));
    } else {
        for axis in 0..3 {
            setup.push_str(&format!("!VZ{},{axis};", random.range(100, 200_000)));
            setup.push_str(&format!("!AS{},{axis};", random.range(10, 5_000)));
            if random.one_in(4) {
                let (low, high) = (-random.range(0, 900), random.range(0, 900));
                setup.push_str(&format!("!SR{low},{high},{axis};"));
            }
        }
    }
    let command = command(&mut random, model);
    let mut tried = controller(model, &machine, &setup);
    let start = Time::from_nanos(random.range(0, 3_000_000_000) as u64);
    tried.run_to(start);
    tried.send(format!("{command};").as_bytes());

    let ended_by = random.range(0, 5);
    let at = start.after_nanos(random.range(0, 700_000_000) as u64);
    let messages = model == "motionsystem";
    if ended_by > 0 {
        tried.run_to(at);
        match ended_by {
            1 => set(&mut tried, "stop", 1),
            2 if messages => set(&mut tried, "message 1", 1),
            3 if messages => set(&mut tried, "fault power-stage-fault-x", 1),
            4 => tried.input(Input::Power(false)),
            _ => {}
        }
    }
    run_out(&mut tried, 100);

    let power_lost = ended_by == 4;
    let cut_off = power_lost || (ended_by == 3 && messages);
    let answer = text(&mut tried);
    let walk = Walk::all(Arc::clone(&machine), tried.outputs(), cut_off);
    if !power_lost {
        assert_eq!(positions(&tried), walk.counter[..positions(&tried).len()], "{command}");
    }
    assert_eq!(carriages(&tried), walk.carriages()[..carriages(&tried).len()], "{command}");

    // What was stopped from outside is finished by `!CS`, in the same place as if it had not
    // been stopped.
    if messages && ["E110\r", "E180\r"].contains(&answer.as_str()) {
        tried.send(b"!CS;");
        run_out(&mut tried, 100);
        let mut whole = controller(model, &machine, &setup);
        whole.send(format!("{command};").as_bytes());
        run_out(&mut whole, 100);
        assert_eq!(positions(&tried), positions(&whole), "{command}");
        assert_eq!(text(&mut tried), text(&mut whole), "{command}");
    }
}

#[test]
fn motions_end_where_a_walk_of_every_step_ends() {
    try_all(400, try_case);
}
