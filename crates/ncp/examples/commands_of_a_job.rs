//! What a job file says to a controller, line by line, and what is wrong with it.
//!
//! `cargo run -p vimc4-ncp --example commands_of_a_job`

use std::collections::BTreeMap;
use std::error::Error;

use vimc4_isel_wire::Dialect;
use vimc4_motion::Ramp;
use vimc4_ncp::job::{Controller, Job, Options, Target, check};
use vimc4_plant::Machine;

const JOB: &str = "IMF_PBL_V1.0
REF XYZ
VEL 8000
FASTABS X20000 Y30000
MOVEABS Z-12000
CWABS I30000 J30000
MOVEABS X900000
";

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let machine = Machine::builtin("mill").ok_or("there is no machine mill")?;
    // Those of an IMC4 that matter to a job.
    let controller = Controller {
        dialect: Dialect::Imc4,
        speeds: 20..=20_000,
        ramp: Ramp { start_stop: 300, acceleration: 100 },
        inputs: BTreeMap::new(),
        outputs: BTreeMap::new(),
        memory: 32_768,
        command_bytes: 1,
        parameter_bytes: 4,
        branch_from_next: true,
    };
    let target = Target::new(controller, &machine);

    let summary = check(JOB, &target, Options::default(), &mut |diagnostic| {
        println!("line {}: {}", diagnostic.line, diagnostic.problem);
    });
    println!("{} errors; what would be sent:", summary.errors);

    let mut job = Job::new(JOB, &target, Options::default());
    while let Some(order) = job.next(&mut |_| {}) {
        match order.step.line(Dialect::Imc4) {
            Some(line) => {
                println!("line {:>3}  {}", order.line, line.trim_ascii_end().escape_ascii())
            }
            None => println!("line {:>3}  {:?}", order.line, order.step),
        }
    }
    Ok(())
}
