//! `vimc4 ncp`: job files in the isel NC intermediate format.

pub(crate) mod check;
mod compile;
mod lsp;
mod problems;
pub(crate) mod run;

use std::process::ExitCode;

use crate::failure::Failure;

#[derive(clap::Args)]
#[command(
    long_about = "\
Check, run and compile job files in the isel NC intermediate format (NCP), as CAD/CAM programs
write them. A real or a virtual controller carries them out with `vimc4 send`.",
    after_long_help = "\
Examples:
  vimc4 ncp check examples/plate.ncp --machine mill
  vimc4 ncp run examples/plate.ncp --machine mill
  vimc4 ncp compile examples/plate.ncp --machine mill

Exit codes: 0 all is well, 1 the job is wrong or ended with an error reply, 2 wrong usage, 3 the job did
not come to its end."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Tool,
}

// Not doc comments: those would replace the command's own long description.
#[derive(clap::Subcommand)]
enum Tool {
    #[command(about = "Say everything that is wrong with a job file, line by line")]
    Check(check::Arguments),
    #[command(about = "Carry a job out on a virtual controller, in virtual time")]
    Run(Box<run::Arguments>),
    #[command(about = "Turn a job into a data field, which a controller stores and runs by itself")]
    Compile(compile::Arguments),
    #[command(
        about = "Help editors with job files: a language server on standard input and output"
    )]
    Lsp(lsp::Arguments),
}

pub(crate) fn run(arguments: Arguments) -> Result<ExitCode, Failure> {
    match arguments.command {
        Tool::Check(arguments) => check::run(&arguments),
        Tool::Run(arguments) => run::run(&arguments),
        Tool::Compile(arguments) => compile::run(&arguments),
        Tool::Lsp(arguments) => lsp::run(&arguments),
    }
}
