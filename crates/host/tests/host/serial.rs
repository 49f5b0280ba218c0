//! A real serial port, played by one end of a pseudo-terminal.

use std::io::{Read, Write};
use std::time::Duration;

use serialport::{SerialPort, TTYPort};
use vimc4_host::{Clock, LineEvent, Serial};

use crate::fake::{Diary, Fake, Running};

#[test]
fn the_line_is_a_serial_port_of_the_computer() {
    let (mut cable, end) = TTYPort::pair().unwrap();
    cable.set_timeout(Duration::from_secs(60)).unwrap();
    let path = end.name().unwrap();
    let (running, ()) = {
        // Its other end stays open until the emulator has it.
        let path = path.clone();
        Running::with(Fake::new(b""), Clock::Real, move || {
            (Serial::open(&path, 19_200).unwrap(), ())
        })
    };
    cable.write_all(b"ehello\r").unwrap();
    let mut answer = [0; 5];
    cable.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"hello");
    // The device's speed is the port's.
    cable.write_all(b"b9600\r").unwrap();
    cable.read_exact(&mut answer[..1]).unwrap();
    running.handle.now().wait().unwrap();
    assert_eq!(end.baud_rate().unwrap(), 9_600);
    running.end().unwrap();
}

#[test]
fn a_port_that_is_unplugged_is_reported_and_the_controller_lives_on() {
    let diary = Diary::default();
    let (cable, end) = TTYPort::pair().unwrap();
    let path = end.name().unwrap();
    let (running, ()) = Running::with(Fake::new(b""), Clock::Real, move || {
        (Serial::open(&path, 19_200).unwrap(), ())
    });
    running.handle.watch(diary.clone()).wait().unwrap();
    drop(cable);
    diary.wait_for("the failure", |report| matches!(report.news(), Some(LineEvent::Gone { .. })));
    running.handle.now().wait().unwrap();
    running.end().unwrap();
}

#[test]
fn a_port_that_is_not_there_says_so() {
    let (running, error) = Running::start(Fake::new(b""), Clock::Real, |runner| {
        (runner, Serial::open("/dev/nothing", 19_200).unwrap_err().to_string())
    });
    assert!(error.contains("cannot open serial port /dev/nothing"), "{error}");
    running.end().unwrap();
}
