//! Reads, plays and compiles every job of `fixtures/ncp` on every model it is about, each as a
//! test of its own, named `topic/file/name::model`. `cargo test -p vimc4-tests --test ncp arcs/`
//! plays some.

mod bench;
mod circle;
mod coverage;
mod damage;
mod expect;
mod gerbv;
#[path = "../../../emulator/tests/process/limits.rs"]
mod limits;
mod pieces;
mod player;

use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial};
use vimc4_tests::jobs::{self, JobCase};

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let jobs = match jobs::jobs() {
        Ok(jobs) => jobs,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::FAILURE;
        }
    };
    let mut trials = coverage::trials(&jobs);
    trials.extend(gerbv::trials());
    trials.extend(damage::trials());
    trials.extend(pieces::trials());
    trials.extend(jobs.into_iter().map(trial));
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn trial(job: JobCase) -> Trial {
    Trial::test(format!("{}::{}", job.id, job.model), move || {
        bench::check(&job).map_err(|error| {
            let program = String::from_utf8_lossy(&job.program);
            Failed::from(format!("{}\n{error}\n--- the job\n{program}", job.title))
        })
    })
}
