//! Everything there is to measure, and the command that does.

mod alarm;
mod baseline;
mod bench;
mod cores;
mod crowd;
mod failure;
mod groups;
mod launch;
mod machine;
mod numbers;
mod play;
mod port;
mod report;
mod server;
mod stats;
mod usage;

use std::env;
use std::process::ExitCode;

use clap::Parser;

use bench::Bench;
use cores::Cores;
use failure::{Failure, Outcome};
use groups::GROUPS;
use launch::Launcher;
use machine::Machine;
use report::BenchReport;

/// Measure how fast the emulator is, against bare baselines.
#[derive(Parser)]
#[command(name = "vimc4-bench")]
struct Arguments {
    /// The groups of figures to measure; all if none is named
    #[arg(value_name = "NAME", value_parser = GROUPS.map(|group| group.name))]
    names: Vec<String>,
    /// Shorter runs, for a first impression
    #[arg(long)]
    quick: bool,
    /// Put the report between the markers in docs/performance.md as well
    #[arg(long, conflicts_with = "names")]
    write: bool,
}

/// Measures what the command line asks for.
pub(crate) fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    // This program is its own baseline, in a process that does nothing else first.
    let done = match arguments.next().as_deref() {
        Some(baseline::COMMAND) => baseline::run(arguments.next().as_deref()),
        _ => measure(&Arguments::parse()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("vimc4-bench: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn measure(arguments: &Arguments) -> Outcome<()> {
    let bench =
        Bench { launcher: Launcher::build()?, cores: Cores::find()?, quick: arguments.quick };
    let chosen =
        |name: &str| arguments.names.is_empty() || arguments.names.iter().any(|n| n == name);
    let mut report = BenchReport::new(Machine::here(), arguments.quick);
    for group in GROUPS.iter().filter(|group| chosen(group.name)) {
        eprintln!("{}: {}", group.name, group.title);
        let section = (group.measure)(&bench)
            .map_err(|failure| Failure::new(format!("{}: {failure}", group.name)))?;
        report.add(group.title, section);
    }
    print!("{report}");
    if arguments.write { report.write() } else { Ok(()) }
}
