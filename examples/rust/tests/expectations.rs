//! What a driver has to do, said in sentences.

use std::time::Duration;

use example_driver::{Error, Stepper};
use vimc4::{Clock, Emulator};

type Result = std::result::Result<(), Box<dyn std::error::Error>>;

#[test]
fn the_spindle_turns_before_the_first_cut() -> Result {
    let emulator = Emulator::builder().machine("mill").time(Clock::Instant).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    stepper.reference()?;
    stepper.wait()?;

    // From now on: each part of it fails in the moment in which it is clear.
    let order = emulator
        .expect()
        .command("@B")
        .answered("0")
        .once()
        .then()
        .command("@A")
        .answered("0")
        .at_least(2)
        .watch()?;
    let inside = emulator.expect().never("z < -20mm or z < 0mm and x < 5mm").watch()?;
    let spindle = emulator
        .expect()
        .whenever("z < 0mm")
        .must_have_been("port 2 bit 0 on")
        .for_at_least(Duration::from_millis(500))
        .watch()?;

    stepper.spindle(true)?;
    stepper.move_by([800, 0, 0], 900)?;
    stepper.wait()?;
    stepper.move_by([0, 0, -500], 900)?;
    stepper.wait()?;

    order.check()?;
    inside.check()?;
    spindle.check()?;
    Ok(())
}

#[test]
fn what_happened_is_asked_afterwards() -> Result {
    let emulator = Emulator::builder().machine("mill").time(Clock::Instant).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    stepper.move_by([30_000, 0, 0], 4_000)?;
    assert!(matches!(stepper.wait(), Err(Error::LimitSwitch)));

    emulator.expect().command("@A").refused_with("2").once().so_far()?;
    emulator.expect().command("@R").never().so_far()?;

    // Each motion has its box, and the number of the command that it belongs to.
    let journal = emulator.journal()?;
    let last = journal.moves().pop().ok_or("it has moved")?;
    assert_eq!((last.from[0], last.to[0]), (0, 20_001));
    Ok(())
}

#[test]
fn what_is_not_met_says_what_came_closest() -> Result {
    let emulator = Emulator::builder().machine("mill").time(Clock::Instant).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    stepper.move_by([30_000, 0, 0], 4_000)?;
    assert!(matches!(stepper.wait(), Err(Error::LimitSwitch)));

    let unmet = emulator.expect().command("@A").answered("0").once().so_far();
    let text = unmet.err().ok_or("it is not met")?.to_string();
    assert_eq!(text, UNMET.trim_end());
    Ok(())
}

/// What it says.
const UNMET: &str = include_str!("unmet.txt");
