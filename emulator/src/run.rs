//! `vimc4 run`: a command list or a stored program in virtual time.

mod arguments;
pub(crate) mod driver;
pub(crate) mod meter;
pub(crate) mod report;
mod rounds;
mod session;
mod stream;
mod tape;
mod trace;
pub(crate) mod world;

use std::process::ExitCode;
use std::sync::Arc;

use vimc4_catalogue::{Controller, Handling};

use crate::endings;
use crate::failure::Failure;
use crate::job::file;
use crate::job::source::JobArguments;
use crate::ncp::run as job;
use crate::recording::history;
use crate::text;
use crate::typed_options::TypedOptions;
pub(crate) use arguments::{Arguments, axes};
use report::RunReport;
use session::Session;
use vimc4_script::{Kind, Script, is_job, takes_jobs};
use world::Outside;

pub(crate) fn run(mut arguments: Arguments, typed: &TypedOptions) -> Result<ExitCode, Failure> {
    endings::heed()?;
    let bytes = file::read(&arguments.file, "a file of commands")?;
    history::no_recording(&arguments.file, &bytes)?;
    arguments.setup.heed(&arguments.file, &bytes)?;
    arguments.world.none_twice(&arguments.file, &arguments.setup)?;
    let model = vimc4::model(arguments.setup.model())?;
    let machine = vimc4::machine(arguments.setup.machine())?;
    let handling = Handling::of(&model);
    file::no_g_code(&text::name(&arguments.file), &bytes)?;
    if takes_jobs(&model) && is_job(&bytes) {
        typed.refuse(&["axes", "loops", "keep-going", "ignore-numbers"], "with a job")?;
        let Arguments { file, setup, world, json, verbose, time, .. } = arguments;
        let job = JobArguments::new(file, setup);
        let job = job::Arguments::new(job, world, time, json, verbose);
        return job::carry_out(&job, &file::decoded(&bytes));
    }
    let script =
        Script::of(&text::name(&arguments.file), &bytes, &handling).map_err(Failure::usage)?;
    match script.kind {
        Kind::Commands => {
            typed.refuse(&["axes", "keep-going", "ignore-numbers"], "with commands")?
        }
        Kind::DataField => {
            typed.refuse(&["keep-going", "ignore-numbers"], "with a stored program")?;
        }
        Kind::Stream => typed.refuse(&["axes", "loops"], "with a plot file")?,
    }
    let controller = Controller::new(&model, Arc::clone(&machine), b"").map_err(Failure::midway)?;
    let signals = arguments.world.signals(&controller)?;
    let scenario = arguments.world.scenario(&model, &controller)?;
    let Arguments { world, file, loops, .. } = &arguments;
    let driver = world.driver(controller, &model, &machine, file, *loops)?;
    let report = RunReport::new(&arguments, &script);
    let mut session =
        Session { handling, driver, report, stored: Vec::new(), unanswered: Vec::new() };
    let starts = arguments.world.press.iter().any(|(button, _)| button == "start");
    let outside = Outside { signals, starts, scenario, time: arguments.time };
    let axes = arguments.axes.or(script.axes).unwrap_or(7);
    let end = match script.kind {
        Kind::Commands => session.command_list(&script.lines, &outside),
        Kind::DataField => session.data_field(&script.lines, axes, &outside),
        Kind::Stream => session.stream(&script.lines, &outside),
    };
    session.finish(end.unwrap_or_else(|end| end), &machine)
}
