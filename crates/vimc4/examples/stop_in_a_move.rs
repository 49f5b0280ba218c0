//! What does my software do when somebody presses STOP in the midst of a move? A test of that, with
//! time that moves only when it is told to.
//!
//! `cargo run -p vimc4 --example stop_in_a_move`

use std::error::Error;
use std::io::Write;

use vimc4::{Button, Clock, Condition, Emulator};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let emulator = Emulator::builder().machine("mill").time(Clock::Manual).start()?;

    // The software under test opens `emulator.port()` or connects to `emulator.tcp_addr()`; here a
    // port in memory stands in for it.
    let mut port = emulator.connect()?;
    port.write_all(b"@01\r")?;
    port.write_all(b"@0A5000,1000\r")?;

    // At exactly step 2,500 somebody presses STOP.
    let there = emulator.run_until(&Condition::AxisAt { axis: 0, position: 2_500 })?;
    println!("at {there} X is at step {}", emulator.position()?[0]);
    emulator.press(Button::Stop)?;
    let rests = emulator.run_until_idle()?;
    println!("at {rests} it has stopped at step {}", emulator.position()?[0]);
    println!("the software has been answered {}", port.drain().escape_ascii());

    // The same again from here: what if it goes on, and what if it starts anew?
    let stopped = emulator.snapshot()?;
    for line in ["@0S\r", "@0R1\r"] {
        emulator.restore(&stopped)?;
        port.write_all(line.as_bytes())?;
        emulator.run_until_idle()?;
        let answer = port.drain();
        println!("{} is answered {}", line.trim_end(), answer.escape_ascii());
        println!("  X is at step {}", emulator.position()?[0]);
    }
    Ok(())
}
