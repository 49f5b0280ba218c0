//! What a view shows is what is: of every model, its signals as they are set, and what it is doing
//! and waits for, as values with stable names.

#![expect(clippy::cognitive_complexity, reason = "one test is one story")]
#![expect(clippy::expect_used, clippy::unwrap_used, reason = "what is wrong fails the test")]

use serde_json::{Value, json};
use vimc4::device::{Controller, Device as _, Harness, Input};
use vimc4::isel::{Interpolation, LoopView, NoMotion, Plane, ProgramStatus};
use vimc4::lpkf::{Head, Mode, StoppedBy, Trackball, Unit};
use vimc4::{Activity, Cause, Condition, Family, Fill, SignalKind, Time, View, WaitsFor};

/// A controller on the machine that goes with its family.
fn controller(model: &str) -> Harness<Controller> {
    let model = vimc4::model(model).expect(model);
    let machine = match model.family() {
        Family::Lpkf => "board-plotter",
        _ => "mill-4axis",
    };
    let machine = vimc4::machine(machine).expect(machine);
    Harness::new(Controller::new(&model, machine, b"").expect("an empty memory"))
}

fn view(of: &Harness<Controller>) -> View {
    of.device().view(of.now())
}

fn set(of: &mut Harness<Controller>, name: &str, value: i32) {
    let signals = of.device().signals();
    let signal = signals.iter().find(|signal| signal.name == name).expect(name);
    of.input(Input::Signal(signal.id, value));
}

/// Sends lines to an isel controller, each of which is answered `0`.
fn tell(imc: &mut Harness<Controller>, lines: &[&str]) {
    for line in lines {
        assert_eq!(imc.ask(format!("{line}\r").as_bytes()).unwrap(), b"0", "{line}");
    }
}

fn is(of: &Harness<Controller>, activity: Activity, waits_for: Option<WaitsFor>) {
    let view = view(of);
    assert_eq!((view.activity, view.waits_for), (activity, waits_for));
    assert_eq!(of.device().activity(), activity);
    assert_eq!(of.device().details(), view.details);
}

#[test]
fn every_signal_of_every_model_shows_what_it_was_set_to() {
    for model in vimc4::models() {
        for powered in [true, false] {
            let mut device = controller(model);
            device.input(Input::Power(powered));
            let signals = device.device().signals();
            let shown = view(&device).signals;
            let listed = signals.iter().map(|signal| (signal.id, &signal.name));
            assert!(shown.iter().map(|shown| (shown.id, &shown.name)).eq(listed), "{model}");
            for signal in &signals {
                let (values, lasts) = match (signal.kind, signal.name.as_str()) {
                    (_, name) if name.starts_with("message") || name == "trigger" => {
                        ([1, 0], false)
                    }
                    (_, "ball x" | "ball y") => ([1_000, -1_000], false),
                    (SignalKind::Analogue { low, high }, _) => ([high, low], true),
                    _ => ([1, 0], true),
                };
                for value in values {
                    device.input(Input::Signal(signal.id, value));
                    let shown = view(&device).signal(&signal.name);
                    assert_eq!(shown, lasts.then_some(value), "{model}: {}", signal.name);
                }
            }
        }
    }
}

#[test]
fn nothing_is_pressed_the_key_is_on_automatic_and_the_cover_closed_at_first() {
    for model in vimc4::models() {
        for signal in view(&controller(model)).signals {
            let on = ["key", "cover", "power-ok"].contains(&signal.name.as_str());
            let wanted = i32::from(on);
            assert!(signal.value.is_none_or(|value| value == wanted), "{model}: {signal:?}");
        }
    }
}

#[test]
fn a_view_is_read_back_as_it_was_written() {
    for model in vimc4::models() {
        let mut device = controller(model);
        let at_rest = view(&device);
        assert_eq!(at_rest.model, model);
        assert!(at_rest.axes.iter().enumerate().all(|(n, axis)| usize::from(axis.index) == n));
        let first: &[u8] = match at_rest.details.isel() {
            Some(_) => b"@07\r@0A9000,900,9000,900,9000,900,0,30\r",
            None => b"PA90000,90000;PD;!TW500;",
        };
        device.send(first);
        for view in [at_rest, view(&device)] {
            let text = serde_json::to_string(&view).unwrap();
            assert_eq!(serde_json::from_str::<View>(&text).unwrap(), view, "{text}");
        }
    }
}

#[test]
fn names_are_stable_and_words_are_for_people() {
    let mut device = controller("imc4");
    let value = serde_json::to_value(view(&device)).unwrap();
    assert_eq!(value["activity"], "idle");
    assert_eq!(value["waits_for"], "command");
    assert_eq!(value["details"]["family"], "isel");
    assert_eq!(value["details"]["interpolation"], "2.5d");
    assert_eq!(value["details"]["plane"], "xy");
    assert_eq!(value["details"]["program"], Value::Null);
    assert_eq!(value["axes"][3]["name"], "A");
    assert_eq!(value["axes"][3]["index"], 3);
    tell(&mut device, &["@07"]);
    device.send(b"@0R1\r");
    let value = serde_json::to_value(view(&device)).unwrap();
    assert_eq!(value["activity"], "reference-towards-switch");
    assert_eq!(value["waits_for"], Value::Null);
    assert_eq!(view(&device).activity.to_string(), "reference run, towards the switch");

    let value = serde_json::to_value(view(&controller("smcu"))).unwrap();
    assert_eq!(value["details"]["family"], "lpkf");
    assert_eq!(value["details"]["head"], "up");
    assert_eq!(value["details"]["mode"], "drilling");
    assert_eq!(value["details"]["axes"][0]["unit"], "linear");
    let port = WaitsFor::Port { port: 65531, bit: None, from: 2 };
    assert_eq!(
        serde_json::to_value(port).unwrap(),
        json!({ "port": { "port": 65531, "bit": null, "from": 2 } })
    );
    assert_eq!(port.to_string(), "port 65531 to be something else than 2");
    // A line of a stored program that branches to itself.
    let mut imc = controller("imc4");
    tell(&mut imc, &["@07", "@0i", "o0,3,0,-1", "9"]);
    set(&mut imc, "start", 1);
    imc.run_to(imc.now().after_nanos(1_000_000_000));
    let waits = view(&imc).waits_for;
    assert_eq!(waits, Some(WaitsFor::Port { port: 0, bit: Some(3), from: 0 }), "{:?}", view(&imc));
    assert_eq!(waits.unwrap().to_string(), "bit 3 of port 0 to be 1");
    assert_eq!(WaitsFor::Character { code: b'!' }.to_string(), "the character `!`");
}

#[test]
fn a_motion_is_shown_with_its_axes_speeds_and_end() {
    let mut imc = controller("imc4");
    tell(&mut imc, &["@07", "@0z1", "@0e2"]);
    imc.send(b"@0A-5000,900,0,30,0,30,0,30\r@0P\r");
    imc.run_to(imc.now().after_nanos(1_000_000_000));
    is(&imc, Activity::Move, None);
    let view = view(&imc);
    let x = &view.axes[0];
    assert!(x.position < 0 && x.speed < 0 && x.configured && !x.referenced, "{x:?}");
    assert!(!view.axes[3].configured);
    // It will end on a limit switch.
    let timers: Vec<_> = view.timers.iter().map(|timer| (timer.cause, Some(timer.due))).collect();
    assert_eq!(timers, [(Cause::Activity, imc.due()), (Cause::LimitSwitch, imc.due())]);
    let details = view.details.isel().unwrap();
    assert_eq!(details.plane, Plane::Yz);
    assert_eq!((details.interpolation, details.motors_on), (Interpolation::Three, true));
    // What is sent meanwhile waits in the receive buffer.
    assert_eq!(view.received, Fill { used: 4, ..view.received });
    assert!(view.received.size >= 4);

    imc.ask(&[253]).unwrap();
    is(&imc, Activity::Idle, Some(WaitsFor::StoppedMotion));
    assert!(imc.device().details().isel().unwrap().stopped_motion);
    imc.run_to_rest().unwrap();
    assert_eq!(imc.ask(b"@0S\r").unwrap(), b"2");
    is(&imc, Activity::LimitError, Some(WaitsFor::LimitErrorCleared));
}

#[test]
fn a_program_is_shown_with_its_line_loops_and_what_it_waits_for() {
    let mut imc = controller("imc4");
    tell(&mut imc, &["@07", "@0i"]);
    let program = || imc_program(&imc);
    assert_eq!(program(), (ProgramStatus::Incomplete, None));
    is(&imc, Activity::Storing, Some(WaitsFor::ProgramLine));
    tell(&mut imc, &["0900,900,0,30,0,30,0,30", "35,-1", "o0,1,1,2", "9"]);
    assert_eq!(imc_program(&imc), (ProgramStatus::Valid, None));
    set(&mut imc, "start", 1);
    set(&mut imc, "start", 0);
    is(&imc, Activity::ProgramMove, None);
    assert_eq!(imc_program(&imc), (ProgramStatus::Running, Some(0)));
    set(&mut imc, "stop", 1);
    set(&mut imc, "stop", 0);
    imc.run_to_rest().unwrap();
    is(&imc, Activity::ProgramStopped, Some(WaitsFor::Start));
    assert_eq!(imc_program(&imc).0, ProgramStatus::Paused);
    set(&mut imc, "start", 1);
    set(&mut imc, "start", 0);
    // Of the five repetitions one goes on and four are still to come.
    assert!(imc.run_until(&Condition::AxisAt { axis: 0, position: 1_000 }).is_some());
    let view = view(&imc);
    let program = view.details.program().unwrap();
    assert_eq!(program.loops, [LoopView { line: 1, left: 4 }]);
    assert_eq!(program.lines.len(), 3);
}

#[test]
fn a_loop_shows_how_often_its_block_will_still_run() {
    let profile = vimc4::model_profile("imc4").unwrap();
    assert!(profile.contains("loop_count = \"extra\""));
    for (value, runs) in [("extra", 6), ("total", 5)] {
        let profile =
            profile.replace("loop_count = \"extra\"", &format!("loop_count = \"{value}\""));
        let model = vimc4::Model::from_toml(&profile).unwrap();
        let machine = vimc4::machine("mill-4axis").unwrap();
        let mut imc = Harness::new(Controller::new(&model, machine, b"").unwrap());
        tell(&mut imc, &["@01", "@0i", "010,300", "35,-1", "9"]);
        set(&mut imc, "start", 1);
        set(&mut imc, "start", 0);
        for run in 0..runs {
            let position = i64::from(run) * 10 + 5;
            assert!(imc.run_until(&Condition::AxisAt { axis: 0, position }).is_some());
            let loops = view(&imc).details.program().unwrap().loops.clone();
            // Only where its line is reached for the first time does the loop begin.
            let open = (run > 0).then(|| LoopView { line: 1, left: runs - 1 - run });
            assert_eq!(loops, Vec::from_iter(open), "{value}: run {run}");
        }
        imc.run_to_rest().unwrap();
        assert_eq!(view(&imc).axes[0].position, i64::from(runs) * 10, "{value}");
        assert_eq!(view(&imc).details.program().unwrap().loops, []);
    }
}

fn imc_program(imc: &Harness<Controller>) -> (ProgramStatus, Option<u32>) {
    let details = imc.device().details();
    let program = details.program().unwrap();
    (program.status, program.marker)
}

#[test]
fn what_forbids_a_motion_is_shown_until_it_is_mended() {
    let mut imc = controller("imc4");
    let no_motion = |imc: &Harness<Controller>| imc.device().details().isel().unwrap().no_motion;
    assert_eq!(no_motion(&imc), None);
    for (signal, bad, why) in [
        ("cover", 0, NoMotion::Cover),
        ("power-ok", 0, NoMotion::Supply),
        ("overtemperature", 1, NoMotion::Overtemperature),
        ("estop", 1, NoMotion::EmergencyStop),
    ] {
        set(&mut imc, signal, bad);
        assert_eq!(no_motion(&imc), Some(why));
        set(&mut imc, signal, 1 - bad);
    }
    assert_eq!(no_motion(&imc), Some(NoMotion::StagesOff));
    set(&mut imc, "on", 1);
    assert_eq!(no_motion(&imc), None);
    imc.input(Input::Power(false));
    assert_eq!(no_motion(&imc), Some(NoMotion::Power));
    is(&imc, Activity::Off, Some(WaitsFor::Power));
}

#[test]
fn head_echo_buffer_and_stop_of_a_plotter_are_shown() {
    let mut smcu = controller("smcu");
    smcu.run_to_rest().unwrap();
    is(&smcu, Activity::Idle, Some(WaitsFor::Command));
    let details = |smcu: &Harness<Controller>| smcu.device().details().lpkf().unwrap().clone();
    assert_eq!((details(&smcu).head, details(&smcu).mode), (Head::Up, Mode::Drilling));
    smcu.send(b"!CM1;!TM100,200,300,400;PD;PA1000,1000;PA2000,2000;");
    assert_eq!(details(&smcu).head_times, [100, 200, 300, 400]);
    is(&smcu, Activity::WaitingForHead, None);
    assert_eq!(details(&smcu).commands_waiting, 2);
    // A command has no end in the buffer. What is only begun is not in it, but CTS allows for it.
    let waiting = b"PA1000,1000PA2000,2000".len();
    let Fill { used, size } = view(&smcu).received;
    assert_eq!((used, size), (waiting, 1_024));
    assert_eq!(smcu.device().room(true), 768 - waiting);
    smcu.send(b"PR0,0");
    assert_eq!(view(&smcu).received.used, waiting);
    assert_eq!(smcu.device().room(true), 768 - waiting - b"PR0,0".len());
    smcu.send(b";");
    assert_eq!(view(&smcu).received.used, waiting + b"PR0,0".len());
    assert_eq!(smcu.device().room(true), 768 - waiting - b"PR0,0".len());
    assert_eq!(details(&smcu).commands_waiting, 3);
    assert!(smcu.run_until(&Condition::AxisAt { axis: 0, position: 500 }).is_some());
    is(&smcu, Activity::Move, None);
    assert_eq!(details(&smcu).head, Head::Down);
    smcu.send(b"!ST;");
    smcu.run_to_rest().unwrap();
    assert_eq!(details(&smcu).stopped, Some(StoppedBy::Command));
    is(&smcu, Activity::Stopped, Some(WaitsFor::GoOn));
    assert_eq!(details(&smcu).commands_waiting, 2);
    smcu.send(b"!GO;");
    smcu.run_to_rest().unwrap();
    assert_eq!((details(&smcu).stopped, details(&smcu).commands_waiting), (None, 0));
    assert_eq!(details(&smcu).axes[0].unit, Unit::Linear);
    let echo = details(&smcu).echo;
    smcu.send(if echo { b"!CT0;" } else { b"!CT1;" });
    assert_eq!(details(&smcu).echo, !echo);
    set(&mut smcu, "ball axis", 2);
    assert_eq!(view(&smcu).signal("ball axis"), Some(2));
    smcu.send(b"!OI1;");
    assert_eq!(details(&smcu).trackball, Some(Trackball::MoveAndReport));
    is(&smcu, Activity::Trackball, Some(WaitsFor::TrackballClosed));
    let due: Vec<_> = view(&smcu).timers.iter().map(|timer| timer.cause).collect();
    assert_eq!(due, [Cause::TrackballReport]);
    assert!(view(&smcu).at > Time::ZERO);
}
