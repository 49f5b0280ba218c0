//! A limit switch that a carriage presses or releases is an event at the instant of the step, whatever
//! moves the carriage, and whether a switch is watched changes nothing else.

#![expect(clippy::expect_used, clippy::unwrap_used, reason = "what is wrong fails the test")]

use serde_json::Value;
use vimc4::device::{Controller, Device as _, Harness, Input, Output};
use vimc4::{Activity, Condition, Time, WaitsFor};
use vimc4_device::{Event, Kinds, Names};
use vimc4_language::read_faulting;

fn controller(model: &str, machine: &str) -> Harness<Controller> {
    let model = vimc4::model(model).expect(model);
    let machine = vimc4::machine(machine).expect(machine);
    Harness::new(Controller::new(&model, machine, b"").expect("an empty memory"))
}

fn set(of: &mut Harness<Controller>, name: &str, value: i32) {
    let signals = of.device().signals();
    let signal = signals.iter().find(|signal| signal.name == name).expect(name);
    of.input(Input::Signal(signal.id, value));
}

/// The changes of limit switches among the outputs, which are taken: when, which, whether it is active.
fn changes(of: &mut Harness<Controller>) -> Vec<(Time, String, bool)> {
    let change = |output| match output {
        Output::Event(stamp, Event::Switch { axis, positive, active }) => {
            let end = if positive { '+' } else { '-' };
            Some((
                stamp.at,
                format!("{}{end}", ["X", "Y", "Z", "A", "Z2", "Z3"][usize::from(axis)]),
                active,
            ))
        }
        _ => None,
    };
    of.drain().filter_map(change).collect()
}

fn names(changes: &[(Time, String, bool)]) -> Vec<(&str, bool)> {
    changes.iter().map(|(_, name, active)| (name.as_str(), *active)).collect()
}

/// Sends lines to an isel controller, each of which is answered `0`.
fn tell(imc: &mut Harness<Controller>, lines: &[&str]) {
    for line in lines {
        assert_eq!(imc.ask(format!("{line}\r").as_bytes()).unwrap(), b"0", "{line}");
    }
}

#[test]
fn a_move_onto_a_switch_is_told_when_it_is_pressed_and_before_its_answer() {
    let mut imc = controller("imc4", "mill").watching(Kinds::ALL);
    tell(&mut imc, &["@07", "@0R7"]);
    changes(&mut imc);
    imc.send(b"@0A30000,3000,0,900,0,900,0,900\r");
    let foreseen =
        imc.clone().run_until(&Condition::Limit { axis: 0, positive: true, active: true });
    imc.run_to_rest().unwrap();
    let place = |wanted: &dyn Fn(&Output) -> bool| imc.outputs().iter().position(wanted).unwrap();
    let pressed = place(&|output| matches!(output.event(), Some(Event::Switch { .. })));
    assert!(pressed < place(&|output| matches!(output, Output::Bytes(..))));
    assert_eq!(imc.take_bytes(), b"2");
    let told = changes(&mut imc);
    assert_eq!(names(&told), [("X+", true)]);
    assert_eq!(Some(told[0].0), foreseen);
    assert_eq!(imc.device().position(imc.now())[0], 24_001);
}

#[test]
fn a_reference_run_presses_and_releases_the_switch_of_each_axis() {
    for (model, machine, command) in
        [("imc-s8", "mill", "@07\r@0R7\r"), ("motionsystem", "positioner", "!IS;")]
    {
        let mut device = controller(model, machine).watching(Kinds::SWITCH);
        device.ask(command.as_bytes()).unwrap();
        let told = changes(&mut device);
        let mut names = names(&told);
        names.sort_unstable();
        names.truncate(4);
        let both = [("X-", false), ("X-", true), ("Y-", false), ("Y-", true)];
        assert_eq!(names, both, "{model}");
        assert!(told.is_sorted_by_key(|(at, ..)| *at), "{told:?}");
    }
}

#[test]
fn the_trackball_a_push_and_the_program_are_no_exceptions() {
    let mut plotter = controller("motionsystem", "positioner").watching(Kinds::SWITCH);
    plotter.ask(b"!OI2;").unwrap();
    set(&mut plotter, "ball x", -3_000);
    plotter.run_to_rest().unwrap();
    assert_eq!(names(&changes(&mut plotter)), [("X-", true)]);

    let mut imc = controller("imc4", "mill").watching(Kinds::SWITCH);
    let push = read_faulting("push x -100000", &Names::of(imc.device())).expect("a fault");
    imc.input(Input::Fault(&push));
    assert_eq!(names(&changes(&mut imc)), [("X-", true)]);

    tell(&mut imc, &["@07", "@0R7", "@0i", "0-900,900,0,30,0,30,0,30", "9"]);
    changes(&mut imc);
    set(&mut imc, "start", 1);
    imc.run_to_rest().unwrap();
    assert_eq!(names(&changes(&mut imc)), [("X-", true)]);
}

#[test]
fn a_circle_in_test_mode_crosses_a_switch_twice_a_turn() {
    let mut imc = controller("imc-s8", "mill").watching(Kinds::SWITCH);
    tell(&mut imc, &["@07", "@0R7", "@0A0,900,500,900,0,900,0,900", "@0T1"]);
    changes(&mut imc);
    let answer = imc.ask(b"@0y2400,900,-50,100,0,-1,-1\r").unwrap();
    assert_eq!(answer, b"0");
    let told = changes(&mut imc);
    assert_eq!(names(&told), [("X-", true), ("X-", false)].repeat(3));
}

#[test]
fn a_hand_on_a_switch_that_the_carriage_presses_changes_nothing() {
    let mut imc = controller("imc4", "mill").watching(Kinds::SWITCH);
    tell(&mut imc, &["@07", "@0R7"]);
    changes(&mut imc);
    set(&mut imc, "limit x-", 1);
    assert_eq!(names(&changes(&mut imc)), [("X-", true)]);
    set(&mut imc, "limit x-", 0);
    assert_eq!(names(&changes(&mut imc)), [("X-", false)]);
    imc.ask(b"@0A-900,900,0,30,0,30,0,30\r").unwrap();
    assert_eq!(names(&changes(&mut imc)), [("X-", true)]);
    for value in [1, 0] {
        set(&mut imc, "limit x-", value);
        assert_eq!(changes(&mut imc), []);
    }
}

#[test]
fn watching_switches_changes_nothing_else() {
    let session = b"@07\r@0R7\r@0A30000,3000,0,900,0,900,0,900\r@0R7\r@0A5000,900,0,30,0,30,0,30\r";
    let mut one = controller("imc4", "mill");
    let mut other = controller("imc4", "mill").watching(Kinds::SWITCH);
    one.send(session);
    other.send(session);
    while let Some(at) = one.step() {
        assert_eq!(other.step(), Some(at));
        assert_eq!(one.device().state(), other.device().state());
    }
    assert!(!changes(&mut other).is_empty());
}

/// A state from before the next change of a switch was kept.
#[test]
fn a_motion_of_an_older_state_presses_its_switch_too() {
    let mut imc = controller("imc4", "mill").watching(Kinds::SWITCH);
    tell(&mut imc, &["@07", "@0R7"]);
    imc.send(b"@0A30000,3000,0,900,0,900,0,900\r");
    imc.run_to(imc.now().after_nanos(1_000_000_000));
    changes(&mut imc);
    let mut state = serde_json::to_value(imc.device().state()).unwrap();
    let left_out = leave_out(&mut state, "next_switch");
    assert_eq!(left_out, 1, "{state}");
    imc.restore(serde_json::from_value(state).unwrap());
    imc.run_to_rest().unwrap();
    assert_eq!(names(&changes(&mut imc)), [("X+", true)]);
}

fn leave_out(value: &mut Value, name: &str) -> usize {
    match value {
        Value::Object(fields) => {
            let here = usize::from(fields.remove(name).is_some());
            here + fields.values_mut().map(|value| leave_out(value, name)).sum::<usize>()
        }
        Value::Array(values) => values.iter_mut().map(|value| leave_out(value, name)).sum(),
        _ => 0,
    }
}

#[test]
fn only_a_controller_that_takes_the_next_move_is_idle() {
    let shown = |imc: &Harness<Controller>| {
        let view = imc.device().view(imc.now());
        assert_eq!(view.activity, imc.device().activity());
        (view.activity, view.waits_for)
    };
    let refuses = |imc: &Harness<Controller>| {
        let mut imc = imc.clone();
        imc.ask(b"@0A1,900,0,30,0,30,0,30\r").unwrap() != b"0"
    };
    let idle = (Activity::Idle, Some(WaitsFor::Command));

    let mut imc = controller("imc-s8", "mill");
    tell(&mut imc, &["@07", "@0R7"]);
    assert_eq!(shown(&imc), idle);
    imc.ask(b"@0A-900,900,0,30,0,30,0,30\r").unwrap();
    assert_eq!(shown(&imc), (Activity::LimitError, Some(WaitsFor::LimitErrorCleared)));
    assert!(refuses(&imc));
    tell(&mut imc, &["@0F1"]);
    assert_eq!(shown(&imc), (Activity::NeedsReference, Some(WaitsFor::Reference)));
    assert!(refuses(&imc));
    tell(&mut imc, &["@0R1"]);
    assert_eq!(shown(&imc), idle);
    set(&mut imc, "cover", 0);
    assert_eq!(shown(&imc), (Activity::CannotMove, Some(WaitsFor::MotionAllowed)));
    assert!(refuses(&imc));
    set(&mut imc, "cover", 1);
    assert_eq!(shown(&imc), idle);
    assert!(!refuses(&imc));

    let mut smcu = controller("smcu", "board-plotter");
    smcu.run_to_rest().unwrap();
    assert_eq!(shown(&smcu), idle);
}
