//! The driver meets what a machine rarely does, and never when somebody looks.

use std::io::{self, ErrorKind};
use std::time::Duration;

use example_driver::{Error, Stepper};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use vimc4::{Button, Clock, Condition, Emulator, MemoryPort};

type Result = std::result::Result<(), Box<dyn std::error::Error>>;

#[test]
fn stop_halts_at_step_2500_and_resume_finishes_the_move() -> Result {
    let emulator = Emulator::builder().time(Clock::Manual).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;

    // 300 Hz is the start-stop frequency: without a ramp the axis halts on the step.
    stepper.move_by([5_000, 0, 0], 300)?;
    emulator.run_until(&Condition::AxisAt { axis: 0, position: 2_500 })?;
    emulator.press(Button::Stop)?;
    assert!(matches!(stepper.wait(), Err(Error::Stopped)));
    assert_eq!(stepper.position()?, [2_500, 0, 0]);

    stepper.resume()?;
    emulator.run_until_idle()?;
    stepper.wait()?;
    assert_eq!(stepper.position()?, [5_000, 0, 0]);
    Ok(())
}

#[test]
fn a_limit_switch_is_reported_until_the_next_reference_run() -> Result {
    let emulator = Emulator::builder().machine("mill").time(Clock::Instant).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    stepper.reference()?;
    stepper.wait()?;

    // The switch at the end of X is at step 24,001.
    stepper.move_by([30_000, 0, 0], 4_000)?;
    assert!(matches!(stepper.wait(), Err(Error::LimitSwitch)));
    assert_eq!(stepper.position()?, [24_001, 0, 0]);
    stepper.move_by([-100, 0, 0], 4_000)?;
    assert!(matches!(stepper.wait(), Err(Error::LimitSwitch)));

    stepper.reference()?;
    stepper.wait()?;
    stepper.move_by([100, 0, 0], 4_000)?;
    stepper.wait()?;
    Ok(())
}

#[test]
fn after_a_power_failure_the_controller_knows_no_axes() -> Result {
    let emulator = Emulator::builder().time(Clock::Manual).start()?;
    let mut port = emulator.connect()?;
    port.set_timeout(Duration::from_millis(20));
    let mut stepper = Stepper::open(port)?;

    stepper.move_by([5_000, 0, 0], 900)?;
    emulator.run_until(&Condition::AxisAt { axis: 0, position: 2_500 })?;
    emulator.power(false)?;
    let silence = stepper.wait();
    assert!(matches!(silence, Err(Error::Port(error)) if error.kind() == ErrorKind::TimedOut));

    emulator.power(true)?;
    drop(stepper);
    let mut stepper = Stepper::open(emulator.connect()?)?;
    // It believes to stand at zero, but the carriage is where the power left it, and some
    // steps further: a motor that is switched off in motion runs on.
    assert_eq!(stepper.position()?, [0, 0, 0]);
    assert_eq!(emulator.view()?.axes[0].carriage, 2_503);
    Ok(())
}

#[test]
fn a_power_failure_between_two_moves_is_noticed() -> Result {
    let emulator = Emulator::builder().time(Clock::Instant).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    emulator.power(false)?;
    emulator.power(true)?;
    stepper.move_by([100, 0, 0], 900)?;
    assert!(matches!(stepper.wait(), Err(Error::NoAxes)));
    Ok(())
}

#[test]
fn the_host_sends_what_it_should() -> Result {
    let emulator = Emulator::builder().time(Clock::Instant).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    stepper.move_by([4_000, -250, 0], 900)?;
    stepper.wait()?;

    let commands = emulator.commands()?;
    let lines: Vec<_> = commands.iter().map(|command| &command.bytes[..]).collect();
    assert_eq!(lines, [&b"@07"[..], b"@0A4000,900,-250,900,0,900,0,900"]);
    assert_eq!(commands[1].mnemonic, "@A");
    let text = &commands[1].text;
    assert!(text.starts_with("relative move X +4,000 steps at 900 Hz, Y -250 steps"), "{text}");
    Ok(())
}

#[test]
fn whatever_happens_in_the_middle_is_reported() -> Result {
    let emulator = Emulator::builder().machine("mill").time(Clock::Manual).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    stepper.reference()?;
    emulator.run_until_idle()?;
    stepper.wait()?;
    drop(stepper);
    let referenced = emulator.snapshot()?;

    // Everything is tried from the same point. The snapshot holds the controller and its
    // machine, not the driver: it is taken while no driver waits, and each try has a new one.
    let after = |happens: &dyn Fn() -> std::result::Result<(), vimc4::Error>| {
        emulator.restore(&referenced)?;
        let mut stepper = Stepper::open(emulator.connect()?)?;
        stepper.move_by([5_000, 0, 0], 900)?;
        emulator.run_until(&Condition::AxisAt { axis: 0, position: 1_000 })?;
        happens()?;
        emulator.run_until_idle()?;
        Ok::<_, Box<dyn std::error::Error>>(stepper.wait())
    };
    assert!(matches!(after(&|| Ok(()))?, Ok(())));
    assert!(matches!(after(&|| emulator.press(Button::Stop))?, Err(Error::Stopped)));
    assert!(matches!(after(&|| emulator.turn("cover", "open"))?, Err(Error::CoverOpen)));
    assert!(matches!(after(&|| emulator.set_signal("limit x+", 1))?, Err(Error::LimitSwitch)));
    assert!(matches!(after(&|| emulator.press(Button::EmergencyStop))?, Err(Error::PowerStageOff)));
    Ok(())
}

#[tokio::test]
async fn an_emergency_stop_reaches_a_task_that_waits() -> Result {
    let emulator = Emulator::builder().time(Clock::Manual).start()?;
    let control = emulator.control();
    let mut port = control.connect().await?;
    assert_eq!(ask(&mut port, "@07").await?, '0');

    // What is joined is polled in order: the command is on the line before time moves.
    let driver = ask(&mut port, "@0A5000,900,0,900,0,900,0,900");
    let operator = async {
        control.run_until(Condition::AxisAt { axis: 0, position: 2_500 }).await?;
        control.press(Button::EmergencyStop).await
    };
    let (answer, pressed) = tokio::join!(biased; driver, operator);
    pressed?;
    assert_eq!(answer?, '9');
    assert_eq!(control.position().await?[0], 0, "the counter begins anew, as after power-on");
    Ok(())
}

async fn ask(port: &mut MemoryPort, line: &str) -> io::Result<char> {
    port.write_all(format!("{line}\r").as_bytes()).await?;
    Ok(char::from(port.read_u8().await?))
}
