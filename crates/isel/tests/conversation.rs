//! A host talks to a controller in simulated time.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use vimc4_device::{Condition, Device, Event, Input, Kinds, Output, Time, Warning};
use vimc4_isel::{Controller, Model};
use vimc4_plant::{Machine, PlantSignal};

/// A controller, what it has said, and when.
struct Pair {
    controller: Controller,
    said: Vec<(Time, u8)>,
}

impl Pair {
    fn new(model: &str, machine: &str) -> Pair {
        let model = Model::builtin(model).unwrap();
        let machine = Machine::builtin(machine).unwrap();
        Pair { controller: Controller::new(model, machine, b"").unwrap(), said: Vec::new() }
    }

    fn drain(&mut self) -> Option<Time> {
        loop {
            match self.controller.poll_output() {
                Output::Bytes(at, bytes) => self.said.extend(bytes.iter().map(|&b| (at, b))),
                Output::Wake(wake) => return wake,
                _ => {}
            }
        }
    }

    /// Sends a line at a time.
    fn send_at(&mut self, line: &str, at: Time) {
        self.input(Input::Bytes(format!("{line}\r").as_bytes()), at);
    }

    fn input(&mut self, input: Input<'_>, at: Time) {
        self.controller.handle(input, at);
        self.drain();
    }

    fn signal(&mut self, signal: PlantSignal, level: bool) {
        let now = self.controller.now();
        self.input(Input::Signal(signal.id(), i32::from(level)), now);
    }

    /// Runs until nothing is due, and returns what was said since the last time.
    fn run(&mut self) -> String {
        while let Some(wake) = self.drain() {
            self.controller.handle(Input::Wake, wake);
        }
        self.heard()
    }

    fn heard(&mut self) -> String {
        self.drain();
        self.said.drain(..).map(|(_, byte)| char::from(byte)).collect()
    }

    /// Sends a line now and runs until it is answered.
    fn ask(&mut self, line: &str) -> String {
        let now = self.controller.now();
        self.send_at(line, now);
        self.run()
    }
}

#[test]
fn a_move_is_answered_when_it_ends() {
    let mut pair = Pair::new("imc4", "bench");
    assert_eq!(pair.ask("@01"), "0");
    pair.send_at("@0A5000,10000", Time::ZERO);
    while let Some(wake) = pair.drain() {
        pair.controller.handle(Input::Wake, wake);
    }
    assert_eq!(pair.said, [(Time::from_nanos(594_090_000), b'0')]);
    pair.said.clear();
    assert_eq!(pair.ask("@0P"), "0001388000000000000");
}

#[test]
fn a_stopped_move_answers_f_and_goes_on_with_s() {
    let mut pair = Pair::new("imc4", "bench");
    assert_eq!(pair.ask("@01"), "0");
    pair.send_at("@0A5000,10000", Time::ZERO);
    pair.input(Input::Bytes(&[253]), Time::from_millis(50));
    assert_eq!(pair.run(), "F");
    assert_eq!(pair.controller.now(), Time::from_millis(100));
    assert_eq!(pair.ask("@0P"), "0000118000000000000");
    assert_eq!(pair.ask("@0S"), "0");
    assert_eq!(pair.ask("@0P"), "0001388000000000000");
    assert_eq!(pair.ask("@0S"), "G");
    pair.send_at("@0A-5000,10000", Time::from_secs(10));
    pair.input(Input::Bytes(&[255]), Time::from_millis(10_200));
    assert_eq!(pair.run(), "0");
    assert_eq!(pair.ask("@0S"), "G");
}

#[test]
fn a_reference_run_finds_the_switches_of_a_mill() {
    let mut pair = Pair::new("imc-s8", "mill");
    assert_eq!(pair.ask("@07"), "0");
    assert_eq!(pair.ask("@0M0,1000,0,1000,-10,1000,0,1000"), "R");
    assert_eq!(pair.ask("@0R7"), "0");
    let view = pair.controller.view(pair.controller.now());
    assert_eq!(view.axes.iter().take(3).map(|axis| axis.carriage).collect::<Vec<_>>(), [0, 0, 0]);
    assert_eq!(pair.ask("@0M100,1000,100,1000,-50,1000,0,1000"), "0");
    assert_eq!(pair.ask("@0P"), "0000064000064FFFFCE");
    assert_eq!(pair.ask("@0A-200,200,0,200,0,200,0,200"), "2");
    assert_eq!(pair.ask("@0P"), "0FFFFFF000064FFFFCE");
    assert_eq!(pair.ask("@0A200,200,0,200,0,200,0,200"), "2");
    assert_eq!(pair.ask("@0F1"), "0");
    assert_eq!(pair.ask("@0A200,200,0,200,0,200,0,200"), "R");
    assert_eq!(pair.ask("@0R1"), "0");
    assert_eq!(pair.ask("@0A200,200,0,200,0,200,0,200"), "0");
}

#[test]
fn a_program_loops_and_stops_and_goes_on() {
    let mut pair = Pair::new("imc-s8", "bench");
    for line in ["@01", "@0i", "0100,1000", "3 4,-1", "9"] {
        assert_eq!(pair.ask(line), "0", "{line}");
    }
    assert_eq!(pair.ask("@0i"), "G");
    assert_eq!(pair.ask("@0S"), "0");
    assert_eq!(pair.ask("@0P"), "00001F4000000000000");
    assert_eq!(pair.ask("@0k"), "0");
    for line in ["@0i", "p0,1,1", "p0,1,0", "30,-2", "9"] {
        assert_eq!(pair.ask(line), "0", "{line}");
    }
    pair.signal(PlantSignal::Start, true);
    let later = pair.controller.now() + std::time::Duration::from_secs(5);
    pair.input(Input::Bytes(b"@0P\r"), later);
    assert_eq!(pair.heard(), "");
    pair.input(Input::Bytes(&[254]), later);
    assert_eq!(pair.run(), "");
    assert_eq!(pair.ask("@0P"), "0000000000000000000");
}

#[test]
fn a_forecast_names_the_exact_step() {
    let mut pair = Pair::new("imc4", "bench");
    assert_eq!(pair.ask("@01"), "0");
    pair.send_at("@0A5000,10000", Time::ZERO);
    let at = pair.controller.when(&Condition::AxisAt { axis: 0, position: 2_500 }).unwrap();
    assert_eq!(pair.controller.view(at).axes[0].position, 2_500);
    let before = Time::from_nanos(at.as_nanos() - 1);
    assert_eq!(pair.controller.view(before).axes[0].position, 2_499);
    let idle = pair.controller.when(&Condition::Idle).unwrap();
    assert_eq!(idle, Time::from_nanos(594_090_000));
    assert_eq!(pair.controller.when(&Condition::AxisAt { axis: 0, position: 5_001 }), None);
}

#[test]
fn a_snapshot_is_small_and_continues_anywhere() {
    let mut pair = Pair::new("imc4", "bench");
    assert_eq!(pair.ask("@03"), "0");
    pair.send_at("@0A5000,10000,-77,300", Time::ZERO);
    let snapshot = pair.controller.state().clone();
    let first = pair.run();
    let end = pair.controller.state().clone();
    pair.controller.restore(snapshot);
    assert_eq!(pair.run(), first);
    assert_eq!(*pair.controller.state(), end);
}

#[test]
fn lines_of_a_program_count_from_1() {
    let mut pair = Pair::new("imc-s8", "bench");
    pair.controller.watch(Kinds::COMMAND.and(Kinds::WARNING));
    let program = b"@03\r@0i\re1\r05,300,5,300\ry8,300,0,5,5,1,1\r9\r@0S\r";
    pair.controller.handle(Input::Bytes(program), Time::ZERO);
    let mut lines = Vec::new();
    let mut errors = Vec::new();
    loop {
        match pair.controller.poll_output() {
            Output::Event(_, Event::Line { line, .. }) => lines.push(line),
            Output::Event(_, Event::Warning(Warning::ProgramError { code, line })) => {
                errors.push((code, line));
            }
            Output::Wake(Some(wake)) => pair.controller.handle(Input::Wake, wake),
            Output::Wake(None) => break,
            _ => {}
        }
    }
    assert_eq!((lines, errors), (vec![1, 2, 3], vec![('3', 3)]));
}
