//! What is left without any feature: a controller of isel in memory, without a pseudo-terminal, a
//! serial port and the other family. It is all that a test of a driver needs.

use std::io::{Read, Write};

use vimc4::{Clock, Emulator, Family};

#[test]
fn an_isel_controller_in_memory_needs_no_feature() {
    let emulator = Emulator::builder().model("imc4").time(Clock::Instant).start().unwrap();
    let mut port = emulator.connect().unwrap();
    let mut ask = |line: &str| {
        port.write_all(line.as_bytes()).unwrap();
        let mut answer = [0];
        port.read_exact(&mut answer).unwrap();
        answer[0]
    };
    assert_eq!([ask("@01\r"), ask("@0A1000,900\r")], *b"00");
    assert_eq!(emulator.position().unwrap()[0], 1_000);
    assert!(Family::ALL.iter().any(|family| family.models().contains(&"imc4")));
}

/// What such a test has to build.
#[test]
fn without_features_no_serial_port_and_no_other_family_is_built() {
    let built = |features: &[&str]| {
        let mut cargo = std::process::Command::new(env!("CARGO"));
        cargo.args(["tree", "--package", "vimc4", "--edges", "normal", "--prefix", "none"]);
        let output = cargo.args(features).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let tree = String::from_utf8(output.stdout).unwrap();
        let big = ["serialport", "tokio-serial", "vimc4-lines", "vimc4-lpkf"];
        let is_in = |name: &&str| tree.lines().any(|line| line.split(' ').next() == Some(*name));
        big.into_iter().filter(is_in).collect::<Vec<_>>()
    };
    assert_eq!(built(&["--no-default-features"]), [""; 0]);
    assert!(built(&[]).contains(&"vimc4-lpkf"));
}
