//! How many commands a controller executes when nothing stands between it and its caller.

use std::io::{Read, Write};
use std::time::Instant;

use vimc4::Emulator;
use vimc4_isel::Controller;

use crate::suite::Bench;
use crate::suite::failure::{Doing, Outcome};
use crate::suite::numbers::{nanos, rate};
use crate::suite::play::{bench as machine, controller, expect, play};
use crate::suite::port::{ANSWER, QUESTION};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::{ROUNDS, Sample};
use crate::suite::usage::processor_time;

/// The least number of commands in a second.
const LEAST: f64 = 1e6;

/// Commands of every kind: settings, queries, ports, moves with ramps, an arc.
const MIX: [&str; 12] = [
    "@07",
    "@0d800,900,700",
    "@0A400,2000,-300,2000,50,900,-50,900",
    "@0P",
    "@0b0",
    "@0z1",
    "@0A-400,9000,300,900,0,900,0,900",
    "@0e0",
    "@0f-1",
    "@0y1200,1500,-150,300,0,-1,1",
    "@0B2,1",
    "@0n7",
];

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let mut section = Section::default();
    let mut device = controller(machine()?)?;
    for line in MIX {
        expect(&mut device, line, b'0')?;
    }
    for (what, lines) in [("`@0P`", &["@0P"][..]), ("a mix of twelve commands", &MIX)] {
        let lines: Vec<Vec<u8>> =
            lines.iter().map(|line| format!("{line}\r").into_bytes()).collect();
        let total = bench.either(1_000_000, 100_000);
        let rounds = (0..ROUNDS).map(|_| commands(&mut device, &lines, total));
        let median = rounds.collect::<Sample>().median();
        section.add(
            Figure::new(format!("{what}, called directly"), rate(median))
                .target("≥ 1,000,000 /s", median >= LEAST),
        );
    }
    let span = memory_port(bench.either(100_000, 10_000))?;
    section.add(Figure::new("round trip of `@0P` on an in-memory port", nanos(span)));
    section.note(
        "Commands are counted for each second of processor time, moves up to their last step \
         included; nobody watches. The in-memory port has the emulator's thread at its other \
         end and costs two changes of thread for every round trip.",
    );
    Ok(section)
}

/// Commands in a second of processor time.
fn commands(device: &mut Controller, lines: &[Vec<u8>], total: usize) -> f64 {
    let spent = processor_time(|| {
        for line in lines.iter().cycle().take(total) {
            play(device, line);
        }
    });
    total as f64 / spent * 1e9
}

/// Nanoseconds of a round trip through a port within the process.
fn memory_port(rounds: u32) -> Outcome<f64> {
    let emulator = Emulator::builder().record(false).start().doing("start an emulator")?;
    let mut port = emulator.connect().doing("connect to the emulator")?;
    let mut answer = [0; ANSWER];
    let began = Instant::now();
    for _ in 0..rounds {
        port.write_all(QUESTION).doing("write to the memory port")?;
        port.read_exact(&mut answer).doing("read from the memory port")?;
    }
    Ok(began.elapsed().as_nanos() as f64 / f64::from(rounds))
}
