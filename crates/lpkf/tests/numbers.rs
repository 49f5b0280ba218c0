//! Which command what happens belongs to.
#![expect(clippy::expect_used, reason = "a test without a controller has failed")]

use vimc4_device::{Event, Harness, Input, Kinds, Motion, Output, Stamp, Time};
use vimc4_lpkf::{Controller, Model};
use vimc4_plant::{Machine, PlantSignal};

#[test]
fn commands_are_numbered_as_they_come_whenever_they_begin() {
    let model = Model::builtin("motionsystem").expect("built in");
    let machine = Machine::builtin("bench").expect("built in");
    let mut controller = Harness::new(Controller::new(model, machine)).watching(Kinds::ALL);
    controller.send(b"!ES1;PA1000,0;PR5,5;");
    controller.run_to(Time::from_millis(50));
    controller.input(Input::Signal(PlantSignal::Stop.id(), 1));
    controller.run_to(Time::from_millis(900));
    controller.send(b"!CS;PA9,9;!GO;!RP;");
    controller.run_to(Time::from_millis(4_000));
    let of = |stamp: Stamp, event: Event| {
        let what = match event {
            Event::Command { mnemonic, .. } => mnemonic.to_string(),
            Event::Answer { mnemonic, bytes, .. } => {
                format!("{mnemonic} {}", String::from_utf8_lossy(&bytes).trim_end())
            }
            Event::Motion(Motion::Begins { .. }) => "begins".to_owned(),
            Event::Motion(Motion::Changes { .. }) => "brakes".to_owned(),
            Event::Motion(Motion::Ends { .. }) => "ends".to_owned(),
            Event::Signal { .. } => "STOP".to_owned(),
            other => format!("{other:?}"),
        };
        format!("{} {what}", stamp.command.map_or("-".to_owned(), |number| number.to_string()))
    };
    let events = controller.drain().filter_map(|output| match output {
        Output::Event(stamp, event) => Some(of(stamp, event)),
        Output::Bytes(..) | Output::Flash(..) => None,
    });
    let told: Vec<String> = events.collect();
    #[rustfmt::skip]
    let expected = [
        "1 !ES", "1 !ES C", "2 PA", "2 begins", "- STOP", "2 brakes", "2 ends", "2 PA E110",
        // !CS goes on with what was broken off, before what waits. Direct commands wait for nothing.
        "4 !CS", "4 begins", "6 !GO", "6 !GO C", "7 !RP", "4 ends", "4 PA C",
        // What !RP repeats comes first, and is what had been executed last when it came.
        "7 !ES", "7 !ES C", "3 PR", "3 begins", "3 ends", "3 PR C", "5 PA", "5 begins", "5 ends", "5 PA C",
    ];
    assert_eq!(told, expected);
}

/// What `!GO` says it drops, after STOP has broken off these commands.
fn dropped(model: &str, commands: &str, resume: &[u8]) -> Vec<String> {
    let model = Model::builtin(model).expect("built in");
    let machine = Machine::builtin("bench").expect("built in");
    let mut controller = Harness::new(Controller::new(model, machine)).watching(Kinds::ANSWER);
    controller.send(format!("!ES1;{commands};").as_bytes());
    controller.run_to(Time::from_millis(50));
    controller.input(Input::Signal(PlantSignal::Stop.id(), 1));
    controller.run_to(Time::from_millis(900));
    controller.send(resume);
    let why = |output| match output {
        Output::Event(_, Event::CutShort { why, .. }) => Some(why.to_string()),
        _ => None,
    };
    controller.drain().filter_map(why).collect()
}

#[test]
fn going_on_says_which_command_it_drops() {
    let head = "!CM1;!TM1000,1000,1000,1000";
    assert_eq!(
        dropped("smcu", &format!("{head};PD"), b"!GO;"),
        ["!GO drops what was left of PD; the head is still up"]
    );
    assert_eq!(dropped("motionsystem", "PA1000,0", b"!GO;"), ["!GO drops what was left of PA"]);
    assert_eq!(dropped("motionsystem", "PA1000,0", b"!CS;!GO;"), [""; 0]);
    // Nothing of it was left.
    assert_eq!(dropped("motionsystem", "PA10,0", b"!GO;"), [""; 0]);
}
