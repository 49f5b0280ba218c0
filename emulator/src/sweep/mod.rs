//! `vimc4 sweep`: every fault that can strike host software or a recorded session, one after the other.

mod arguments;
mod asked;
mod folder;
#[cfg(unix)]
mod guard;
mod host;
mod limit;
mod recorded;
mod reel;
mod report;
mod slots;

use std::process::ExitCode;

pub(crate) use arguments::Arguments;
use arguments::Other;

use crate::failure::Failure;

pub(crate) fn run(arguments: Arguments) -> Result<ExitCode, Failure> {
    match &arguments.other {
        Some(Other::Merge { folders, out, json }) => {
            let results = folder::merge(folders, out)?;
            let code = report::print(&results, &report::About { out, json: *json })?;
            match results.total() - results.done() {
                0 => Ok(code),
                missing => Err(Failure::usage(format!(
                    "{missing} of the {} points are in none of these folders; name those of all shards",
                    results.total()
                ))),
            }
        }
        #[cfg(unix)]
        Some(Other::Guard { mark }) => Ok(guard::run(mark)),
        None => match &arguments.session {
            Some(session) => recorded::run(&arguments, session),
            None => host::run(&arguments),
        },
    }
}
