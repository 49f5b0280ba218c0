//! Asks controllers of both families, in virtual time, and says what their answers mean.
//!
//! `cargo run -p vimc4-catalogue --example ask`

use std::error::Error;

use vimc4_catalogue::{Handling, bare, machine, model};
use vimc4_device::{Device, Harness};

/// A model, a machine, and commands.
const CONVERSATIONS: [(&str, &str, &[&str]); 2] = [
    ("imc4", "mill", &["@01", "@0M100,900", "@0R1", "@0M100,900", "@0P"]),
    ("smcu", "board-plotter", &["IN", "!CT1", "PU", "PA1000,2000", "PA1000,999999", "!VU9999"]),
];

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    for (name, machine_name, commands) in CONVERSATIONS {
        println!("{name}");
        let (model, machine) = (model(name)?, machine(machine_name)?);
        // What an answer means is asked of the catalogue, so this works with every family.
        let handling = Handling::of(&model);
        let mut controller = Harness::new(bare(&model, &machine, &[])?);
        for command in commands {
            let line = format!("{command}\r");
            let answer = controller.ask(line.as_bytes())?;
            println!("  {command}: {}", controller.device().explain(command.as_bytes()));
            println!("    {} at {}", answer.escape_ascii(), controller.now());
            if let Some(refusal) = handling.refusal(command.as_bytes(), &answer) {
                println!("    {refusal}");
            }
        }
    }
    Ok(())
}
