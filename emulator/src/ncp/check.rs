//! `vimc4 ncp check`: everything that is wrong with a job file.

use std::io::{self, Write};
use std::process::ExitCode;

use vimc4_ncp::job::{self, check};
use vimc4_ncp::{Diagnostic, Problem, Severity};

use super::problems::{Format, Problems, counts};
use crate::failure::Failure;
use crate::job::source::{JobArguments, Site};
use crate::output;

#[derive(clap::Args)]
#[command(
    long_about = "\
Say everything that is wrong with a job file, line by line

Nothing is carried out. Every line is read to the end of the file, and every movement is checked
against the job's LIMIT, the machine's travel and the controller's speeds. With --lenient it names the
line at which the job would end.",
    after_long_help = "\
Examples:
  vimc4 ncp check examples/plate.ncp --machine mill
  vimc4 ncp check examples/plate.ncp --model imc-s8 --format json

Exit codes: 0 no errors, 1 errors, 2 wrong usage."
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    job: JobArguments,
    /// How the problems are shown
    #[arg(long, value_enum, default_value = "full")]
    format: Format,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let job = &arguments.job;
    let site = job.site()?;
    let text = job.text()?;
    let mut problems = Problems::new(job, &text, arguments.format, Box::new(anstream::stdout()));
    let summary = check(&text, &site.target, job.options.reading.options(), &mut |diagnostic| {
        problems.show(diagnostic);
    });
    problems.summary.lines = summary.lines;
    let end = problems.end();
    let summary = problems.finish()?;
    if arguments.format != Format::Json {
        let (name, lines) = (job.name(), summary.lines);
        let end = end.map(|end| end + "\n").unwrap_or_default();
        output::print(&format!("{end}{name}: {lines} lines, {}\n", counts(&summary)))?;
    }
    Ok(if summary.errors > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Checks a job before anything of it is done: what is wrong goes to standard error.
///
/// # Errors
///
/// If there are errors and the reading is not lenient; nothing may be done then.
pub(crate) fn before(job: &JobArguments, site: &Site, text: &str) -> Result<(), Failure> {
    judge(job, site, text, &|_| true)
}

/// The same before the place of the work-piece is known: only errors that occur at any place count,
/// so that the operator does not look for the zero of an impossible job.
///
/// # Errors
///
/// As above.
pub(crate) fn before_zero(job: &JobArguments, site: &Site, text: &str) -> Result<(), Failure> {
    judge(job, site, text, &|diagnostic| {
        let depends = matches!(
            diagnostic.problem,
            Problem::Asked(
                job::Problem::BeyondTravel { .. }
                    | job::Problem::BeyondLimit { .. }
                    | job::Problem::BeyondCounter { .. }
            )
        );
        job.options.reading.severity(diagnostic) == Severity::Error
            && !depends
            && !job.options.reading.lenient
    })
}

fn judge(
    job: &JobArguments,
    site: &Site,
    text: &str,
    counts: &dyn Fn(&Diagnostic) -> bool,
) -> Result<(), Failure> {
    let name = job.name();
    let mut problems = Problems::new(job, text, Format::Full, Box::new(anstream::stderr()));
    check(text, &site.target, job.options.reading.options(), &mut |diagnostic| {
        if counts(&diagnostic) {
            problems.show(diagnostic);
        }
    });
    let end = problems.end();
    let summary = problems.finish()?;
    if let Some(end) = end {
        let _ = writeln!(io::stderr(), "{end}");
    }
    match summary.errors {
        0 => Ok(()),
        // It ends where it cannot be carried out.
        _ if job.options.reading.lenient => Ok(()),
        1 => Err(Failure::midway(format!("{name} has an error; correct it, and begin again"))),
        errors => Err(Failure::midway(format!(
            "{name} has {errors} errors; correct them, and begin again"
        ))),
    }
}
