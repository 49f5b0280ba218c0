//! The command `vimc4`: wiring only. Each subcommand has a file of its own.
#![forbid(unsafe_code)]

mod answers;
#[cfg(feature = "api")]
mod api;
mod circle;
mod completions;
mod conform;
mod console;
mod coverage;
#[cfg(feature = "api")]
mod ctl;
mod dap;
mod deferred;
mod doctor;
mod drawing;
mod endings;
mod excerpt;
mod failure;
mod framing;
mod here;
mod identity;
mod job;
mod limits;
#[cfg_attr(not(unix), path = "lines_elsewhere.rs")]
mod lines;
mod live;
mod log;
mod manual;
mod ncp;
mod opened;
mod orders;
mod output;
mod places;
mod port;
mod profiles;
mod recording;
mod run;
mod send;
mod serve;
mod setup;
mod streams;
mod sweep;
mod text;
mod traces;
mod typed_options;
mod values;
mod waves;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use deferred::Deferred;
use failure::Failure;
use here::here;

/// Virtual stepper controllers of isel and LPKF: firmware-equivalent, behind real ports.
#[derive(Parser)]
#[command(name = "vimc4", version = VERSION, long_version = LONG_VERSION, subcommand_required = true, arg_required_else_help = true, after_long_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Tool,
}

const EXAMPLES: &str = concat!(
    "\
Examples:
  vimc4 serve -v
  vimc4 run examples/commands.txt --machine mill
  vimc4 ncp run examples/plate.ncp --machine mill
  vimc4 models

`vimc4 COMMAND --help` says more of each, with examples and exit codes. The files in examples/ are beside the
program in its archive, ",
    here!("in /usr/share/doc/vimc4, ", ""),
    "or in the folder that it was built from.

Exit codes: 0 all went well, 1 something is wrong with the input or the answers, 2 wrong usage: nothing
was done. Some commands have more."
);

const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (commit ", env!("VIMC4_COMMIT"), ")");

/// What a report of something wrong should name.
const LONG_VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    " (commit ",
    env!("VIMC4_COMMIT"),
    ")\ntarget: ",
    env!("VIMC4_TARGET"),
    "\nfeatures: ",
    env!("VIMC4_FEATURES")
);

// Not doc comments: those would replace the command's own long description.
#[derive(Subcommand)]
enum Tool {
    #[command(about = here!(
        "Run controllers behind pseudo-terminals, TCP and real serial ports",
        "Run controllers behind TCP and serial ports"
    ))]
    Serve(Deferred<serve::Arguments>),
    #[cfg(feature = "api")]
    #[command(about = "See and steer controllers that are served elsewhere")]
    Ctl(Deferred<ctl::Arguments>),
    #[cfg_attr(not(unix), command(hide = true))]
    #[command(about = "Run a program that needs modem lines on a controller's pseudo-terminal")]
    Lines(Deferred<lines::Arguments>),
    #[command(about = "Run a command list, a stored program or a plot file in virtual time")]
    Run(Deferred<run::Arguments>),
    #[command(about = "Step through what a controller does, forward and back, and ask why")]
    Console(Deferred<console::Arguments>),
    #[command(about = "Check, run and compile job files in the isel NC intermediate format")]
    Ncp(Deferred<ncp::Arguments>),
    #[command(about = "Send a job or a command list to a controller, virtual or real")]
    Send(Deferred<send::Arguments>),
    #[command(
        about = "Play the fixture sessions against any port, including real hardware, and report what differs"
    )]
    Conform(Deferred<conform::Arguments>),
    #[command(about = "Record what passes between host software and a real controller")]
    Record(Deferred<recording::tap::Arguments>),
    #[command(about = "Play a recording again and compare every byte and time")]
    Replay(Deferred<recording::replay::Arguments>),
    #[command(about = "Show where two recordings differ")]
    Diff(Deferred<recording::diff::Arguments>),
    #[command(about = "Cut a part of the time out of a recording")]
    Cut(Deferred<recording::less::CutArguments>),
    #[command(
        about = "Find the shortest input of a recording that still shows a difference or an error"
    )]
    Minimise(Deferred<recording::less::MinimiseArguments>),
    #[command(about = "Say how much of what a controller can do was met by tests")]
    Coverage(Deferred<coverage::Arguments>),
    #[command(
        about = "Try every fault on host software or a recorded session, and report what comes of it"
    )]
    Sweep(Deferred<sweep::Arguments>),
    #[command(about = "Debug programs, jobs and recordings in an editor: a debug adapter")]
    Dap(Deferred<dap::Arguments>),
    #[command(about = "Say what a program will find at a port, and the remedy")]
    Doctor(Deferred<doctor::Arguments>),
    #[command(about = "Print isel's commands for a circle, a part of one, or a helix")]
    Circle(Deferred<circle::Arguments>),
    #[command(about = "List the built-in models, or show the profile of one")]
    Models(Deferred<profiles::Arguments>),
    #[command(about = "List the built-in machines, or show the profile of one")]
    Machines(Deferred<profiles::Arguments>),
    #[command(about = "Print completions for a shell")]
    Completions(Deferred<completions::Arguments>),
    #[cfg_attr(windows, command(hide = true))]
    #[command(about = "Write the manual pages into a folder")]
    Man(Deferred<manual::Arguments>),
}

fn main() -> ExitCode {
    completions::answer(Arguments::command);
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(said) => return output::said(said),
    };
    // An invalid level is reported at once, even where nothing would be logged.
    if let Err(failure) = traces::level() {
        return failure.report();
    }
    let done = match arguments.command {
        Tool::Serve(Deferred(arguments, given)) => {
            return serve::run(arguments, &given).unwrap_or_else(Failure::report);
        }
        #[cfg(feature = "api")]
        Tool::Ctl(Deferred(arguments, _)) => ctl::run(&arguments),
        Tool::Lines(Deferred(arguments, given)) => {
            return lines::run(arguments, &given).unwrap_or_else(Failure::report);
        }
        // Its exit codes are part of what it says.
        Tool::Run(Deferred(arguments, given)) => {
            return run::run(arguments, &given).unwrap_or_else(Failure::report);
        }
        Tool::Console(Deferred(arguments, given)) => {
            return console::run(arguments, &given).unwrap_or_else(Failure::report);
        }
        Tool::Ncp(Deferred(arguments, _)) => {
            return ncp::run(arguments).unwrap_or_else(Failure::report);
        }
        Tool::Send(Deferred(arguments, _)) => {
            return send::run(arguments).unwrap_or_else(Failure::report);
        }
        Tool::Conform(Deferred(arguments, _)) => {
            return conform::run(arguments).unwrap_or_else(Failure::report);
        }
        Tool::Record(Deferred(arguments, _)) => {
            return recording::tap::run(&arguments).unwrap_or_else(Failure::report);
        }
        Tool::Replay(Deferred(arguments, _)) => {
            return recording::guarded(|| recording::replay::run(&arguments))
                .unwrap_or_else(Failure::report);
        }
        Tool::Diff(Deferred(arguments, _)) => {
            return recording::guarded(|| recording::diff::run(&arguments))
                .unwrap_or_else(Failure::report);
        }
        Tool::Cut(Deferred(arguments, _)) => {
            recording::guarded(|| recording::less::cut(&arguments))
        }
        Tool::Minimise(Deferred(arguments, _)) => {
            recording::guarded(|| recording::less::minimise(&arguments))
        }
        Tool::Coverage(Deferred(arguments, _)) => coverage::run(&arguments),
        Tool::Sweep(Deferred(arguments, _)) => {
            return sweep::run(arguments).unwrap_or_else(Failure::report);
        }
        Tool::Dap(Deferred(arguments, _)) => {
            return dap::run(&arguments).unwrap_or_else(Failure::report);
        }
        Tool::Doctor(Deferred(arguments, _)) => {
            return doctor::run(&arguments).unwrap_or_else(Failure::report);
        }
        Tool::Circle(Deferred(arguments, typed)) => circle::run(arguments, &typed),
        Tool::Models(Deferred(arguments, _)) => profiles::models(arguments),
        Tool::Machines(Deferred(arguments, _)) => profiles::machines(arguments),
        Tool::Completions(Deferred(arguments, _)) => completions::run(arguments),
        Tool::Man(Deferred(arguments, _)) => manual::run(&arguments, Arguments::command()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
