//! A host talks to a controller in simulated time.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use vimc4_device::{Device, Input, Output, Time};
use vimc4_lpkf::{Controller, Model};
use vimc4_plant::Machine;

/// A controller, what it has said, and when.
struct Pair {
    controller: Controller,
    said: Vec<(Time, u8)>,
}

impl Pair {
    fn new(model: &str, machine: &str) -> Pair {
        let model = Model::builtin(model).unwrap();
        let machine = Machine::builtin(machine).unwrap();
        Pair { controller: Controller::new(model, machine), said: Vec::new() }
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

    fn send(&mut self, text: &str) {
        let now = self.controller.now();
        self.controller.handle(Input::Bytes(text.as_bytes()), now);
        self.drain();
    }

    fn set(&mut self, name: &str, value: i32) {
        let signals = self.controller.signals();
        let signal = signals.iter().find(|signal| signal.name == name).unwrap();
        let now = self.controller.now();
        self.controller.handle(Input::Signal(signal.id, value), now);
        self.drain();
    }

    fn run_to(&mut self, at: Time) -> String {
        while let Some(wake) = self.drain().filter(|wake| *wake <= at) {
            self.controller.handle(Input::Wake, wake);
        }
        self.controller.handle(Input::Wake, at);
        self.heard()
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
        let said = self.said.drain(..).map(|(_, byte)| char::from(byte)).collect::<String>();
        said.replace('\r', "|")
    }

    fn ask(&mut self, text: &str) -> String {
        self.send(text);
        self.run()
    }
}

#[test]
fn a_board_is_drawn() {
    let mut pair = Pair::new("smcu", "board-plotter");
    assert_eq!(pair.ask("!IS;"), "C|");
    assert_eq!(pair.ask("OH;"), "W42267,25088,0|C|");
    assert_eq!(pair.ask("PA19100,9000;!ON0;"), "C|P19100,9000,0|C|");
    assert_eq!(pair.ask("IN"), "Z");
    assert_eq!(pair.ask("VS0.005;PD;AR0,100,360;PU;!CT1;"), "C|");
    assert_eq!(pair.ask("!ON0"), "");
    assert_eq!(pair.ask("\r"), "P19100,9000,0|C|");
    println!("{:#?}", pair.controller.view(pair.controller.now()));
}

#[test]
fn six_axes_move_and_are_stopped() {
    let mut pair = Pair::new("motionsystem", "positioner");
    assert_eq!(pair.ask("!IS;"), "C|");
    assert_eq!(pair.ask("!MA1000,2000,300,400,500,0;!ON0;"), "C|P1000,2000,300,400,500,0|C|");
    assert_eq!(pair.ask("!ES1;"), "C|");
    pair.send("PA20000,2000;PA0,0;");
    let now = pair.controller.now();
    assert_eq!(pair.run_to(now.after_nanos(1_000_000_000)), "");
    pair.set("stop", 1);
    pair.set("stop", 0);
    assert_eq!(pair.run(), "E110|");
    assert_eq!(pair.ask("PA5,5;"), "E176|");
    println!("{}", pair.ask("!ON0;"));
    assert_eq!(pair.ask("!CS;"), "C|C|");
    assert_eq!(pair.ask("!ON0;"), "P0,0,300,400,500,0|C|");
    assert_eq!(pair.ask("PA-300,0;"), "E137|");
    assert_eq!(
        pair.ask("!GO;!PH0,1\rX1000Y0F20000\rX1000Y1000I0J1000O1\rX0Y500F-20000\r;!ON0;"),
        "C|C|P1999,1500,300,400,500,0|C|"
    );
}
