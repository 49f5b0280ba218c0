//! A host talks to a controller in simulated time.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use vimc4_device::{
    Condition, Device, Event, Harness, Input, Kinds, Motion, Output, Time, Warning,
};
use vimc4_isel::{Controller, Model};
use vimc4_plant::{Machine, PlantSignal};

fn controller(model: &str) -> Harness<Controller> {
    let model = Model::builtin(model).unwrap();
    let machine = Machine::builtin("bench").unwrap();
    Harness::new(Controller::new(model, machine, b"").unwrap())
}

/// Sends a line and says what is answered until the controller is at rest.
fn ask(controller: &mut Harness<Controller>, line: &str) -> String {
    String::from_utf8(controller.ask(format!("{line}\r").as_bytes()).unwrap()).unwrap()
}

#[test]
fn a_forecast_names_the_exact_step() {
    let mut imc = controller("imc4");
    assert_eq!(ask(&mut imc, "@01"), "0");
    imc.send(b"@0A5000,10000\r");
    let half = Condition::AxisAt { axis: 0, position: 2_500 };
    let at = imc.device().when(&half).unwrap();
    assert_eq!(imc.device().view(at).axes[0].position, 2_500);
    let before = Time::from_nanos(at.as_nanos() - 1);
    assert_eq!(imc.device().view(before).axes[0].position, 2_499);
    let idle = imc.device().when(&Condition::Idle).unwrap();
    assert_eq!(idle, Time::from_nanos(594_090_000));
    let beyond = Condition::AxisAt { axis: 0, position: 5_001 };
    assert_eq!(imc.device().when(&beyond), None);
    // The forecast is where a run stops.
    assert_eq!((imc.run_until(&half), imc.now()), (Some(at), at));
    assert_eq!(
        (imc.clone().run_until(&beyond), imc.run_until(&Condition::Idle)),
        (None, Some(idle))
    );
}

#[test]
fn a_counter_that_has_gone_round_often_is_forecast_too() {
    // The A axis of this machine has no switch: its reference run goes on until somebody ends it.
    let (model, mill) = (Model::builtin("imc4").unwrap(), Machine::builtin("mill").unwrap());
    let mut imc = Harness::new(Controller::new(model, mill, b"").unwrap());
    assert_eq!(ask(&mut imc, "@08"), "0");
    imc.send(b"@0R8\r");
    imc.run_to(Time::from_secs(100_000));
    let here = imc.device().position(imc.now())[3];
    for position in [here + 1, here - 1, here + 5_000] {
        let at = imc.device().crossing(&Condition::AxisAt { axis: 3, position });
        assert_eq!(at.map(|at| imc.device().position(at)[3]), Some(position));
    }
}

#[test]
fn what_never_holds_together_is_known_after_a_turn() {
    let mut imc = controller("imc4");
    // A million turns around a circle with a radius of one step, whose centre is never visited.
    imc.send(b"@03\r@0y8388607,20,0,1,0,-1,1\r");
    let both = |x, y| {
        let at = |axis, position| Condition::AxisAt { axis, position };
        Condition::All(vec![at(0, x), at(1, y)])
    };
    assert_eq!(imc.device().when(&both(-1, 0)), None);
    assert!(imc.device().when(&both(-2, 0)).is_some());
    // A time that is named may be many turns ahead.
    let late = Time::from_secs(300_000);
    let condition = Condition::All(vec![both(-2, 0), Condition::At(late)]);
    assert!(imc.device().when(&condition).is_some_and(|at| at >= late));
}

#[test]
fn what_waited_for_the_end_of_a_motion_happens_line_by_line() {
    let mut imc = controller("imc4");
    imc.send(b"@01\r@0A5000,10000\r@0n1\r@0P\r@0A5,900\r@0P\r");
    assert_eq!(imc.take_bytes(), b"0");
    let end = imc.step().unwrap();
    assert_eq!(imc.take_bytes(), b"0");
    let mut told = Vec::new();
    while imc.due() == Some(end) {
        assert!(!imc.device().is_idle());
        imc.step();
        told.push(String::from_utf8(imc.take_bytes()).unwrap());
    }
    assert_eq!(told, ["0", "0001388000000000000", ""]);
    assert_eq!(imc.ask(b"").unwrap(), b"0000138D000000000000");
}

#[test]
fn what_is_so_between_two_lines_of_one_instant_is_seen() {
    let mut imc = controller("imc-s8");
    imc.send(b"@01\r@0A500,1000\r@0B2,1\r@0B2,0\r@0P\r");
    assert_eq!(imc.take_bytes(), b"0");
    let on = Condition::PortBit { port: 2, bit: 0, level: true };
    let seen = imc.device().when(&on);
    assert!(seen.is_some());
    assert_eq!(imc.run_until(&on), seen);
    assert_eq!((imc.now(), imc.due()), (seen.unwrap(), seen));
    assert_eq!(imc.take_bytes(), b"00");
    assert_eq!(imc.ask(b"").unwrap(), b"000001F4000000000000");
}

#[test]
fn what_happens_has_the_number_of_its_command() {
    let mut imc = controller("imc-s8").watching(Kinds::ALL);
    imc.send(b"@01\r@0B0,1\r@0i\r0500,1000\rp0,2,1\r9\r@0S\r");
    imc.run_to(Time::from_millis(100));
    imc.input(Input::Signal(PlantSignal::Stop.id(), 1));
    imc.input(Input::Signal(PlantSignal::Stop.id(), 0));
    imc.run_to_rest().unwrap();
    imc.input(Input::Signal(PlantSignal::Start.id(), 1));
    imc.run_to_rest().unwrap();
    imc.send(b"@0P\r");
    let mut told = Vec::new();
    for output in imc.drain() {
        let Output::Event(stamp, event) = output else { continue };
        let what = match event {
            Event::Command { mnemonic, .. } => format!("command {mnemonic}"),
            Event::Answer { bytes, .. } => format!("answer {}", bytes.escape_ascii()),
            Event::Line { line, .. } => format!("line {line}"),
            Event::Port { port, value } => format!("port {port} {value}"),
            Event::Flash { what } => what.to_string(),
            Event::Motion(Motion::Begins { .. }) => "begins".to_owned(),
            Event::Motion(Motion::Changes { .. }) => "brakes".to_owned(),
            Event::Motion(Motion::Ends { .. }) => "ends".to_owned(),
            Event::Signal { value, .. } => format!("signal {value}"),
            _ => continue,
        };
        let number = stamp.command.map_or_else(|| "-".to_owned(), |number| number.to_string());
        told.push(format!("{number} {what}"));
    }
    let expected = [
        "1 command @axes",
        "1 answer 0",
        "2 command @B",
        "2 port 0 1",
        "2 answer 0",
        "3 command @i",
        "3 program begun",
        "3 answer 0",
        "4 command 0",
        "4 program line",
        "4 answer 0",
        "5 command p",
        "5 program line",
        "5 answer 0",
        "6 command 9",
        "6 program valid",
        "6 answer 0",
        "7 command @S",
        "7 line 1",
        "7 begins",
        "- signal 1",
        "7 brakes",
        "- signal 0",
        "7 ends",
        "7 answer F",
        // START goes on with it, and the host, which has had an answer, hears of the end.
        "- signal 1",
        "- begins",
        "- ends",
        "- line 2",
        "- port 0 5",
        "- answer 0",
        "8 command @P",
        "8 answer 00001F4000000000000",
    ];
    assert_eq!(told, expected);
}

#[test]
fn lines_of_a_program_count_from_1() {
    let wanted = Kinds::COMMAND.and(Kinds::WARNING);
    let mut imc = controller("imc-s8").watching(wanted);
    imc.send(b"@03\r@0i\re1\r05,300,5,300\ry8,300,0,5,5,1,1\r9\r@0S\r");
    imc.run_to_rest().unwrap();
    let mut lines = Vec::new();
    let mut errors = Vec::new();
    for output in imc.drain() {
        match output {
            Output::Event(_, Event::Line { line, .. }) => lines.push(line),
            Output::Event(_, Event::Warning(Warning::ProgramError { code, line, .. })) => {
                errors.push((code, line));
            }
            _ => {}
        }
    }
    assert_eq!((lines, errors), (vec![1, 2, 3], vec![('3', 3)]));
}
