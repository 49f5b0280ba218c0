//! Ways to set up, to watch and to wait.

use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use example_driver::{Error, Stepper};
use vimc4::{Button, Clock, Condition, Emulator, Event, Time, Warning, Worker};

type Result = std::result::Result<(), Box<dyn std::error::Error>>;

#[test]
fn ten_minutes_pass_at_once() -> Result {
    let emulator = Emulator::builder().model("imc-s8").time(Clock::Instant).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    stepper.move_by([600_000, 0, 0], 1_000)?;
    stepper.wait()?;
    assert!(emulator.now()? > Time::from_secs(600));
    Ok(())
}

#[test]
fn real_time_is_real() -> Result {
    let emulator = Emulator::builder().time(Clock::Real).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    let began = Instant::now();
    stepper.move_by([90, 0, 0], 300)?;
    stepper.wait()?;
    assert!(began.elapsed() >= Duration::from_millis(300));
    Ok(())
}

#[test]
fn every_kind_of_port_is_the_same_line() -> Result {
    let emulator = Emulator::builder().time(Clock::Instant).pty(true).tcp("127.0.0.1:0").start()?;

    let tcp = TcpStream::connect(emulator.tcp_addr().ok_or("it has TCP")?)?;
    let mut stepper = Stepper::open(tcp)?;
    stepper.move_by([-1, 2, -3], 900)?;
    assert_eq!(stepper.position()?, [-1, 2, -3]);
    drop(stepper);

    // A serial library takes the path; where no baud rate matters, so does a plain file.
    let path = emulator.port().ok_or("it has a pseudo-terminal")?;
    let mut stepper = Stepper::open(OpenOptions::new().read(true).write(true).open(path)?)?;
    assert_eq!(stepper.position()?, [-1, 2, -3]);
    Ok(())
}

#[test]
fn a_command_over_tcp_has_arrived_before_time_moves() -> Result {
    let emulator = Emulator::builder().time(Clock::Manual).tcp("127.0.0.1:0").start()?;
    let tcp = TcpStream::connect(emulator.tcp_addr().ok_or("it has TCP")?)?;
    tcp.set_read_timeout(Some(Duration::from_secs(1)))?;
    let mut stepper = Stepper::open(tcp)?;
    for _ in 0..500 {
        stepper.position()?;
        stepper.move_by([10, 0, 0], 250)?;
        emulator.run_until_idle()?;
        stepper.wait()?;
    }
    Ok(())
}

#[test]
fn two_hundred_controllers_share_a_thread() -> Result {
    let worker = Worker::start("controllers")?;
    let mut emulators = Vec::new();
    for _ in 0..200 {
        emulators.push(Emulator::builder().time(Clock::Instant).on(&worker).start()?);
    }
    for (number, emulator) in (1..).zip(&emulators) {
        let mut stepper = Stepper::open(emulator.connect()?)?;
        stepper.move_by([number, 0, 0], 900)?;
        assert_eq!(stepper.position()?, [number, 0, 0]);
    }
    Ok(())
}

#[test]
fn a_driver_that_blocks_runs_in_a_thread() -> Result {
    let emulator = Emulator::builder().time(Clock::Manual).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    let driver = thread::spawn(move || {
        stepper.move_by([5_000, 0, 0], 300)?;
        stepper.wait()
    });

    // Before the command is there nothing moves, and there is nothing to run until.
    emulator.next_command("@A")?;
    emulator.run_until(&Condition::AxisAt { axis: 0, position: 2_500 })?;
    emulator.press(Button::Stop)?;
    assert!(matches!(driver.join(), Ok(Err(Error::Stopped))));
    Ok(())
}

#[test]
fn a_breakpoint_holds_the_controller_and_not_the_driver() -> Result {
    let emulator = Emulator::builder().time("8x".parse()?).start()?;
    let below = emulator.break_when(&Condition::AxisBelow { axis: 2, position: -500 })?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    let driver = thread::spawn(move || {
        for _ in 0..2 {
            stepper.move_by([0, 0, -1_000], 900)?;
            stepper.wait()?;
            stepper.move_by([0, 0, 1_000], 900)?;
            stepper.wait()?;
        }
        Ok::<_, Error>(())
    });

    for met in 1..=2 {
        assert_eq!(emulator.until_paused()?.breakpoints, [below]);
        assert_eq!(emulator.position()?, [0, 0, -501, 0]);
        assert_eq!(emulator.breakpoints()?[0].met, met);
        emulator.resume()?;
    }
    assert!(matches!(driver.join(), Ok(Ok(()))));
    Ok(())
}

#[test]
fn lost_steps_are_among_the_events() -> Result {
    let emulator = Emulator::builder().machine("mill").time(Clock::Instant).start()?;
    let mut stepper = Stepper::open(emulator.connect()?)?;
    stepper.reference()?;
    stepper.move_by([30_000, 0, 0], 4_000)?;
    assert!(matches!(stepper.wait(), Err(Error::LimitSwitch)));

    let lost = emulator.events()?.into_iter().find_map(|(_, event)| match event {
        Event::Warning(Warning::StepsLost { axis: 0, steps, .. }) => Some(steps),
        _ => None,
    });
    let x = &emulator.view()?.axes[0];
    assert_eq!(Some(x.carriage - x.position), lost);
    assert!(!x.referenced);
    Ok(())
}

#[test]
fn a_stored_program_survives_in_its_file() -> Result {
    let folder = tempfile::tempdir()?;
    let start =
        || Emulator::builder().time(Clock::Instant).flash(folder.path().join("flash")).start();
    let emulator = start()?;
    let mut port = emulator.connect()?;
    for line in ["@01", "@0i", "0100,900", "9"] {
        port.write_all(format!("{line}\r").as_bytes())?;
        let mut answer = [0];
        port.read_exact(&mut answer)?;
        assert_eq!(&answer, b"0", "{line}");
    }
    drop(emulator);

    let emulator = start()?;
    emulator.press(Button::Start)?;
    emulator.run_until_idle()?;
    assert_eq!(emulator.position()?, [100, 0, 0, 0]);
    Ok(())
}
