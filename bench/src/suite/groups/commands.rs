//! How many commands a controller executes when nothing stands between it and its caller.

use std::io::{Read, Write};
use std::time::Instant;

use vimc4::Emulator;
use vimc4_device::Device;

use crate::suite::Bench;
use crate::suite::failure::{Doing, Outcome};
use crate::suite::numbers::{nanos, rate};
use crate::suite::play::{bench as machine, board, controller, expect, play};
use crate::suite::port::{ANSWER, QUESTION};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::{ROUNDS, alternate};
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

/// The same for an SMCU.
const BOARD_MIX: [&str; 12] = [
    "VS20000;",
    "!VU40000;",
    "PR400,-300;",
    "!ON0;",
    "OS;",
    "!TD0,1,0,1;",
    "PR-400,300;",
    "!TS0;",
    "!CM0;",
    "AR300,0,120;",
    "!EM1;",
    "!WR1,5;",
];

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let mut section = Section::default();
    let mut device = controller(machine()?)?;
    for line in MIX {
        expect(&mut device, line, b'0')?;
    }
    let mut board = board(machine()?)?;
    for line in BOARD_MIX {
        expect(&mut board, line, b'C')?;
    }
    let total = bench.either(1_000_000, 100_000);
    for (what, lines, ours, our_lines) in [
        ("`@0P`", &["@0P"][..], "`!ON0;` of an SMCU", &["!ON0;"][..]),
        ("a mix of twelve commands", &MIX, "a mix of twelve commands of an SMCU", &BOARD_MIX),
    ] {
        let (lines, our_lines) = (with_end(lines), with_end(our_lines));
        let pair = alternate(
            ROUNDS,
            || Ok(commands(&mut device, &lines, total)),
            || Ok(commands(&mut board, &our_lines, total)),
        )?;
        section.add(
            Figure::new(format!("{what}, called directly"), rate(pair.baseline))
                .target("≥ 1,000,000 /s", pair.baseline >= LEAST),
        );
        section.add(
            Figure::new(format!("{ours}, called directly"), rate(pair.ours))
                .baseline(rate(pair.baseline))
                .target("≥ 0.9 ×", pair.ratio() >= 0.9),
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

/// Lines with their ends.
fn with_end(lines: &[&str]) -> Vec<Vec<u8>> {
    lines.iter().map(|line| format!("{line}\r").into_bytes()).collect()
}

/// Lines of commands in a second of processor time.
fn commands(device: &mut impl Device, lines: &[Vec<u8>], total: usize) -> f64 {
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
