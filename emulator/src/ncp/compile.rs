//! `vimc4 ncp compile`: a job as a data field.

use std::io::{self, Write};
use std::iter;
use std::path::PathBuf;
use std::process::ExitCode;

use vimc4_ncp::Problem;
use vimc4_ncp::job::{self, Options, compile};

use super::problems::{Format, Problems};
use crate::failure::Failure;
use crate::identity::none_twice;
use crate::job::source::JobArguments;
use crate::output;

#[derive(clap::Args)]
#[command(
    long_about = "\
Turn a job into a data field, which a controller stores and runs by itself

The data field goes to standard output or to --output: the lines of a program as they stand between
@0i and its final 9, after comments that say what it is for, as in `; model: imc4`, `; machine: mill` and
`; axes: 7`. `vimc4 run` and `vimc4 send` heed them, and no option has to be given again; leave them out
when you send the lines by other means. A stored program cannot ask anybody, so a HALT, a GETTOOL or a WPTEACH
is an error here. A program that does not fit into the controller is an error too.",
    after_long_help = "\
Examples:
  vimc4 ncp compile examples/plate.ncp --machine mill --output plate.cnc
  vimc4 run plate.cnc

Exit codes: 0 compiled, 1 the job cannot be stored as a program, 2 wrong usage."
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    job: JobArguments,
    /// Leave every GETTOOL out, where one tool does it all or the changer is not the controller's
    #[arg(long)]
    leave_out_tool_changes: bool,
    /// How the problems are shown, on standard error; with json nothing else is said there
    #[arg(long, value_enum, default_value = "full")]
    format: Format,
    /// Where the data field goes, instead of standard output
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let job = &arguments.job;
    let inputs = iter::once(job.file.as_path()).chain(job.setup.files());
    none_twice(inputs, arguments.output.as_deref())?;
    let site = job.site()?;
    let text = job.text()?;
    let name = job.name();
    let mut problems = Problems::new(job, &text, arguments.format, Box::new(anstream::stderr()));
    let options = Options {
        leave_out_tools: arguments.leave_out_tool_changes,
        ..job.options.reading.options()
    };
    let mut too_large = None;
    let field = compile(&text, &site.target, options, &mut |diagnostic| {
        if let Problem::Asked(job::Problem::TooLarge { .. }) = diagnostic.problem {
            too_large = Some(diagnostic.line);
        }
        problems.show(diagnostic);
    });
    let end = problems.end();
    let summary = problems.finish()?;
    let is_for_people = arguments.format != Format::Json;
    if let Some(end) = end.filter(|_| is_for_people) {
        let _ = writeln!(io::stderr(), "{end}");
    }
    let Some(field) = field.filter(|_| summary.errors == 0 || job.options.reading.lenient) else {
        if !is_for_people {
            return Ok(ExitCode::FAILURE);
        }
        return Err(Failure::midway(match too_large {
            Some(line) if summary.errors == 1 => format!(
                "{name} is too large to be stored as one program; split it at line {line}, or \
                 send it with `vimc4 send`"
            ),
            _ => format!(
                "{name} cannot be stored as a program; correct the errors, or send it with \
                 `vimc4 send`"
            ),
        }));
    };
    // It must be run on the same controller and machine, with the same axes. A controller
    // never sees the comments.
    let axes = format!("; axes: {} ({})\n", field.axes.bits(), field.axes);
    let whole = job.setup.comments() + &axes + &field.text;
    let written = match &arguments.output {
        Some(path) => output::write(path, whole.as_bytes()),
        None => output::print(&whole),
    };
    written?;
    if is_for_people {
        let _ = writeln!(
            io::stderr(),
            "{name}: {} lines, {} of {} bytes, for the axes {} (--axes {})",
            field.lines,
            field.bytes,
            site.target.controller.memory,
            field.axes,
            field.axes.bits(),
        );
    }
    Ok(ExitCode::SUCCESS)
}
