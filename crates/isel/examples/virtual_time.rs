//! An IMC4 with a milling machine, driven in virtual time: no port, no thread, no waiting.
//!
//! `cargo run -p vimc4-isel --example virtual_time`

use std::error::Error;
use std::time::Duration;

use vimc4_device::{Condition, Device, Event, Harness, Input, Kinds, Output, Stamp};
use vimc4_isel::{Controller, Model};
use vimc4_plant::{Machine, PlantSignal};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let model = Model::builtin("imc4").ok_or("there is no model imc4")?;
    let machine = Machine::builtin("mill").ok_or("there is no machine mill")?;
    let controller = Controller::new(model, machine, b"")?;
    let mut imc4 = Harness::new(controller).watching(Kinds::COMMAND.and(Kinds::ANSWER));

    // Ask, and the answer is there: here for the axes X, Y and Z, and a reference run.
    for line in ["@07\r", "@0R7\r"] {
        let answer = imc4.ask(line.as_bytes())?;
        println!("{} {} is answered {}", imc4.now(), line.trim_end(), answer.escape_ascii());
    }

    // Or only send, and let time pass as you like.
    imc4.send(b"@0A8000,2000,4000,1000,0,1000,0,1000\r");
    imc4.advance(Duration::from_millis(500));
    println!("{} X is at step {}", imc4.now(), position(&imc4));
    imc4.run_until(&Condition::AxisAt { axis: 0, position: 4_000 });
    println!("{} X is at step {}", imc4.now(), position(&imc4));

    // In half a second STOP is pressed for a moment, and two seconds later the host goes on.
    let stop = imc4.now() + Duration::from_millis(500);
    let button = PlantSignal::Stop.id();
    imc4.plan(stop, Input::Signal(button, 1));
    imc4.plan(stop + Duration::from_millis(100), Input::Signal(button, 0));
    imc4.plan(stop + Duration::from_secs(2), Input::Bytes(b"@0S\r"));
    imc4.run_to_rest()?;
    println!("{} X is at step {}", imc4.now(), position(&imc4));

    // All outputs are there, in order, each with its time.
    for output in imc4.drain() {
        match output {
            Output::Event(Stamp { at, .. }, Event::Command { mnemonic, .. }) => {
                println!("{at} {mnemonic} begins")
            }
            Output::Event(Stamp { at, .. }, Event::Answer { mnemonic, bytes, .. }) => {
                println!("{at} {mnemonic} is answered {}", bytes.escape_ascii());
            }
            _ => {}
        }
    }
    Ok(())
}

fn position(imc4: &Harness<Controller>) -> i64 {
    imc4.device().view(imc4.now()).axes.first().map_or(0, |axis| axis.position)
}
