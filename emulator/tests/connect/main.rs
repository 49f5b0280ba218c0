//! What `docs/connect.md` says of other people's programs is so: each cell of its table is a test
//! here or was tried by hand, and what its recipes print is what is run.
//!
//! What needs a program that is missing is shown as ignored, with the reason in its name. With
//! `VIMC4_REQUIRE_TOOLS=1` it fails instead, so that nothing is left out unnoticed; Wine alone is
//! only ever asked for by name.
#![cfg(unix)]

mod bench;
#[expect(dead_code, reason = "each test uses its part of it")]
#[path = "../process/mod.rs"]
mod process;
mod programs;

use std::process::ExitCode;

use libtest_mimic::{Arguments, Trial};

use bench::Way;
use programs::{Proof, lines_lack, programs};

/// What comes of a failed attempt.
type Outcome = Result<(), Box<dyn std::error::Error>>;

const GUIDE: &str = include_str!("../../../docs/connect.md");

/// The table as the guide has to print it.
fn table() -> String {
    let mut table = String::from("| program |");
    for way in Way::ALL {
        table += &format!(" {} |", way.title());
    }
    table += "\n|---|";
    table += &"---|".repeat(Way::ALL.len());
    for program in programs() {
        table += &format!("\n| {} |", program.name);
        for way in Way::ALL {
            table += &format!(" {} |", program.says(way));
        }
    }
    table
}

fn the_guide_has_the_table() -> Outcome {
    let table = table();
    match GUIDE.contains(&format!("\n\n{table}\n\n")) {
        true => Ok(()),
        false => Err(format!("docs/connect.md must have this table:\n\n{table}\n").into()),
    }
}

fn main() -> ExitCode {
    if let Some(port) = std::env::var_os(programs::CLIENT) {
        return programs::rust_client(&port.to_string_lossy());
    }
    let arguments = Arguments::from_args();
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    let mut trials =
        vec![Trial::test("the guide has the table", || Ok(the_guide_has_the_table()?))];
    let lines_lack = lines_lack();
    for program in programs() {
        let lacks = program.lacks();
        for way in Way::ALL {
            let (run, by_hand) = match program.cell(way) {
                Proof::Test(_, run) => (run, false),
                Proof::ByHand(_, _, run) => (run, true),
                Proof::None => continue,
            };
            let lacks = lacks.or(if way == Way::Lines { lines_lack } else { None });
            let name = format!("{}: {}", program.name, way.title());
            let name = lacks.map_or(name.clone(), |what| format!("{name} (needs {what})"));
            let ignored = by_hand || (lacks.is_some() && !required);
            trials.push(Trial::test(name, move || Ok(run(way)?)).with_ignored_flag(ignored));
        }
    }
    libtest_mimic::run(&arguments, trials).exit_code()
}
