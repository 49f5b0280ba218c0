//! A custom device and what can be done with it: a lamp that is switched over a serial line.
//!
//! `cargo run -p vimc4-device --example lamp`

use std::error::Error;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use vimc4_device::{
    Activity, Condition, Device, Fact, Fill, Harness, Input, Kinds, Outbox, Output, PortView,
    Signal, Time, View,
};

/// A lamp at bit 0 of port 0. `1` switches it on for three seconds and `0` off; either is answered
/// `k` when it is dark again.
#[derive(Clone, Debug, Default)]
struct Lamp {
    state: State,
    outbox: Outbox,
}

/// Everything that decides what the lamp will do, and nothing that can be computed from it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct State {
    now: Time,
    /// When it will go out, while it is on.
    until: Option<Time>,
}

impl Lamp {
    fn go_out(&mut self) {
        self.state.until = None;
        self.outbox.send(self.state.now, "k".into());
    }
}

impl Device for Lamp {
    type State = State;
    type Details = ();

    // What it does by itself: one thing, at one time.

    fn wake(&self) -> Option<Time> {
        self.state.until
    }

    fn perform(&mut self, at: Time) -> bool {
        let due = self.state.until.filter(|due| *due <= at);
        if let Some(due) = due {
            self.state.now = due;
            self.go_out();
        }
        due.is_some()
    }

    // What is done to it.

    fn accept(&mut self, input: Input<'_>, at: Time) {
        self.state.now = self.state.now.max(at);
        match input {
            Input::Bytes(bytes) => {
                for byte in bytes {
                    match byte {
                        b'1' => self.state.until = Some(self.state.now + Duration::from_secs(3)),
                        b'0' => self.go_out(),
                        _ => {}
                    }
                }
            }
            Input::Power(_) => self.state.until = None,
            Input::Signal(..) | Input::Fault(_) | Input::Rule(_) | Input::Wake => {}
        }
    }

    // What comes out.

    fn poll_output(&mut self) -> Option<Output> {
        self.outbox.poll()
    }

    fn watch(&mut self, kinds: Kinds) -> Kinds {
        self.outbox.watch(kinds)
    }

    // What it is.

    fn state(&self) -> State {
        self.state.clone()
    }

    fn restore(&mut self, state: State) {
        self.state = state;
        self.outbox.clear();
    }

    fn now(&self) -> Time {
        self.state.now
    }

    fn is_idle(&self) -> bool {
        self.state.until.is_none()
    }

    fn activity(&self) -> Activity {
        if self.is_idle() { Activity::Idle } else { Activity::Waiting }
    }

    fn details(&self) {}

    fn view(&self, at: Time) -> View<()> {
        let on = self.state.until.is_some_and(|until| at < until);
        View {
            at,
            model: "lamp".to_owned(),
            machine: "none".to_owned(),
            powered: true,
            activity: self.activity(),
            waits_for: None,
            baud: self.baud(),
            received: Fill { used: 0, size: 0 },
            axes: Vec::new(),
            ports: vec![PortView { port: 0, value: u8::from(on), input: false }],
            signals: Vec::new(),
            timers: Vec::new(),
            details: (),
        }
    }

    /// Nothing changes in between, so a condition that does not hold now can begin to hold only
    /// when something is due.
    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        let holds = match fact {
            Fact::PortBit { port: 0, bit: 0, level } => *level != self.is_idle(),
            _ => false,
        };
        holds.then_some(from)
    }

    fn explain(&self, command: &[u8]) -> String {
        match command {
            b"1" => "on for three seconds".to_owned(),
            b"0" => "off".to_owned(),
            _ => "nothing".to_owned(),
        }
    }

    fn signals(&self) -> Vec<Signal> {
        Vec::new()
    }

    fn baud(&self) -> u32 {
        9_600
    }

    fn flash_image(&self) -> Vec<u8> {
        Vec::new()
    }
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let mut lamp = Harness::new(Lamp::default());
    lamp.send(b"1");
    lamp.advance(Duration::from_secs(1));
    println!("{} {:?}", lamp.now(), lamp.device().activity());

    // The forecast needs no knowledge of lamps.
    let rests = lamp.device().when(&Condition::Idle).ok_or("it never rests")?;
    println!("it will rest at {rests}");

    // A state can be saved and resumed.
    let kept = lamp.device().state();
    assert_eq!(lamp.ask(b"0")?, b"k");
    lamp.restore(kept);
    assert_eq!(lamp.ask(b"")?, b"k");
    println!("{} {:?}", lamp.now(), lamp.device().activity());
    Ok(())
}
