//! How long a job file of a million lines takes to check, and to run in virtual time.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use crate::suite::Bench;
use crate::suite::failure::{Doing, Failure, Outcome};
use crate::suite::numbers::{bytes, count, nanos, times};
use crate::suite::report::{Figure, Section};
use crate::suite::usage::peak;

/// How long a process of a job may be looked away from.
const LOOK: Duration = Duration::from_millis(5);

/// A file and what may become of it.
struct JobKind {
    /// What is in it.
    what: &'static str,
    line: fn(usize, &mut Dice) -> String,
    /// Whether it can be run.
    runs: bool,
}

const JOBS: [JobKind; 3] = [
    JobKind { what: "straight moves", line: straight, runs: true },
    JobKind { what: "moves and whole circles", line: mixed, runs: true },
    JobKind { what: "mistakes", line: mistakes, runs: false },
];

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let lines = bench.either(1_000_000, 100_000);
    let share = lines as f64 / 1e6;
    let mut section = Section::default();
    for JobKind { what, line, runs } in JOBS {
        let text = text(lines, line);
        let file = bench.launcher.file("job.ncp", &text)?;
        let began = Instant::now();
        std::hint::black_box(numbers(&text));
        let bare = began.elapsed().as_nanos() as f64;
        let lines = count(lines as f64);
        let (took, memory) = timed(bench, "check", &file)?;
        section.add(
            Figure::new(
                format!("`ncp check` of {lines} lines, {what}"),
                format!("{}, {}", nanos(took), times(took / bare)),
            )
            .baseline(nanos(bare))
            .target(format!("≤ {}", nanos(1e9 * share)), took <= 1e9 * share),
        );
        section.add(
            Figure::new("… memory at most", bytes(memory))
                .target(format!("≤ {}", bytes(200e6)), memory <= 200e6),
        );
        if runs {
            let (took, memory) = timed(bench, "run", &file)?;
            section.add(
                Figure::new(
                    format!("`ncp run` of {lines} lines, {what}"),
                    format!("{}, {}", nanos(took), times(took / bare)),
                )
                .baseline(nanos(bare))
                .target(format!("≤ {}", nanos(1e10 * share)), took <= 1e10 * share),
            );
            section.add(
                Figure::new("… memory at most", bytes(memory))
                    .target(format!("≤ {}", bytes(200e6)), memory <= 200e6),
            );
        }
    }
    section.note(
        "From the start of the program to its end, with its output thrown away. The baseline adds up \
         every number in the file and does nothing else. The circles are 100 to 22,000 µm wide; a \
         line of mistakes has one or two. `ncp run` checks first.",
    );
    Ok(section)
}

/// The time and the memory that a command takes.
fn timed(bench: &Bench, command: &str, file: &PathBuf) -> Outcome<(f64, f64)> {
    let began = Instant::now();
    let mut child = bench
        .launcher
        .command()
        .args(["ncp", command])
        .arg(file)
        .args(if command == "run" { &["--for", "10000h"][..] } else { &["--format", "short"] })
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .doing("start vimc4")?;
    let mut most = 0.0_f64;
    let ended = loop {
        if let Some(ended) = child.try_wait().doing("wait for vimc4")? {
            break ended;
        }
        // The process may be over by now.
        most = most.max(peak(child.id()).unwrap_or(0.0));
        thread::sleep(LOOK);
    };
    let took = began.elapsed().as_nanos() as f64;
    if ended.code().is_none_or(|code| code > 1) {
        return Err(Failure::new(format!("vimc4 ncp {command} has ended with {ended}")));
    }
    Ok((took, most))
}

/// The baseline.
fn numbers(text: &str) -> i64 {
    let words = text.split(|byte: char| !byte.is_ascii_digit() && byte != '-');
    words.filter_map(|word| word.parse::<i64>().ok()).fold(0, i64::wrapping_add)
}

fn text(lines: usize, line: fn(usize, &mut Dice) -> String) -> String {
    let mut dice = Dice(1);
    let mut text = String::from("IMF_PBL_V1.0\nREF XYZ\nVEL 20000\nMOVEABS X100000 Y100000\n");
    for number in 4..lines {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", line(number, &mut dice));
    }
    text
}

fn straight(number: usize, _: &mut Dice) -> String {
    let way = 300 * (number / 400 % 7 + 1);
    match number % 4 {
        0 => format!("N{number:06} MOVEREL X{way}"),
        1 => format!("N{number:06} MOVEREL Y{way}"),
        2 => format!("N{number:06} MOVEREL X-{way}"),
        _ => format!("N{number:06} MOVEREL Y-{way}"),
    }
}

fn mixed(number: usize, dice: &mut Dice) -> String {
    let (x, y) = (dice.up_to(200_000), dice.up_to(200_000));
    match number % 4 {
        0 => format!("N{number:06} FASTABS X{x} Y{y}"),
        1 => format!("N{number:06} CWREL I{} J{} ; round", 100 + x / 10, y / 20),
        2 => format!("N{number:06} MOVEREL X{} Z-{}", x / 10, y / 400),
        _ => format!("N{number:06} MOVEABS X{x} Y{y} Z-500"),
    }
}

fn mistakes(_: usize, dice: &mut Dice) -> String {
    let lines = [
        "FOO X1",
        "MOVEABS X",
        "N1 MOVEREL Q5 X12\u{e4}",
        "(Steps per circle: 64)",
        "CWABS I1 J2 X999999999999999",
        "MOVEREL X300 Y",
    ];
    lines[dice.up_to(lines.len() as u64) as usize].to_owned()
}

/// The same numbers each time, without a pattern that matters (Knuth's MMIX).
struct Dice(u64);

impl Dice {
    fn up_to(&mut self, most: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % most
    }
}
