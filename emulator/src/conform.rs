//! `vimc4 conform`: plays the fixture sessions against any port and reports what differs.

pub(crate) mod announce;
mod arguments;
mod chosen;
mod client;
mod play;
mod report;
mod sources;

use std::process::ExitCode;

use vimc4_catalogue::Handling;
use vimc4_conform::choice::Chooser;
use vimc4_conform::explain;
use vimc4_conform::player::Timing;

use crate::endings;
use crate::failure::Failure;
use crate::here::here;
use crate::port::{Port, speed};
pub(crate) use arguments::Arguments;
use chosen::{allowed, choose};
use client::Client;
use play::Conductor;
use report::ConformReport;

pub(crate) fn run(arguments: Arguments) -> Result<ExitCode, Failure> {
    let allowed = allowed(&arguments)?;
    let model = vimc4::model(&arguments.model)?;
    let sessions = sources::sessions(arguments.sessions.as_deref())?;
    let timing = Timing { tolerance: arguments.tolerance, ..Timing::default() };
    let chooser = Chooser::new(&model, timing).map_err(Failure::usage)?;
    let choices = choose(&arguments, &sessions, &chooser, &allowed)?;
    let (handling, axes) = (Handling::of(&model), model.axis_names());
    if arguments.list {
        announce::list(&choices, axes, &arguments)?;
        return Ok(ExitCode::SUCCESS);
    }
    let Some(name) = &arguments.port else {
        return Err(Failure::usage(concat!(
            "no port is named; name one as in `vimc4 conform ",
            here!("./vimc4.pty", "COM7"),
            "`, or add --list"
        )));
    };
    if !choices.iter().any(|choice| choice.plan.is_ok()) {
        announce::list(&choices, axes, &arguments)?;
        return Err(Failure::usage(
            "none of these sessions can be played; the list says why, and what would allow them",
        ));
    }
    if !arguments.allow.is_empty() {
        announce::dangers(name, &choices, &handling, &arguments);
        if !arguments.yes {
            announce::confirm()?;
        }
    }
    let port =
        Port::open(name, speed(name, arguments.baud, model.baud())?).map_err(Failure::usage)?;
    endings::interrupt(&port, handling.halt)?;
    let candidates = explain::candidates(&model).map_err(Failure::usage)?;
    let mut report = ConformReport::new(&arguments, name, choices.len());
    let client = Client::new(port, handling, timing, arguments.verbose);
    let mut conductor = Conductor::new(client, &chooser, candidates, timing, allowed);
    let played = conductor.play(&choices, &mut report);
    let failure = played.err().map(|(error, last)| {
        conductor.halt();
        error.failure(conductor.client(), last.as_deref())
    });
    let passed = report.finish(conductor.port(), failure.as_ref());
    match failure {
        Some(failure) => Err(failure),
        None if passed? => Ok(ExitCode::SUCCESS),
        None => Ok(ExitCode::FAILURE),
    }
}
