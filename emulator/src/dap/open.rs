//! Opening what is to be debugged: files of commands, programs, plots, jobs and recordings.

use std::fs;
#[cfg(unix)]
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use vimc4_dap::{Configuration, Open, Opened, Refusal};
use vimc4_debug::{Debugger, Feed, Unit};
use vimc4_device::Time;
use vimc4_timeline::Progress;

use super::live::{self, Served};
use crate::failure::Failure;
use crate::job::file::{self, OR_INPUT};
use crate::job::source::JobOptions;
use crate::live::Ring;
use crate::opened::{self, Program, Ways};
use crate::recording::history::{self, Commands};
use crate::setup::Setup;
use crate::text;

/// So many errors of a job are told.
const MOST_ERRORS: usize = 5;

/// Opens files of this computer, and controllers behind its ports.
pub(super) struct Doors {
    /// The controllers that run already, if there are any.
    pub(super) served: Option<Served>,
    /// Is called when one that runs by itself has something to say.
    pub(super) ring: Ring,
}

/// So long is nobody asked whether to go on while something is opened.
const PATIENCE: Duration = Duration::from_millis(5);

impl Open for Doors {
    fn open(
        &mut self,
        configuration: &Configuration,
        progress: &mut Progress<'_>,
    ) -> Result<Vec<Opened>, Refusal> {
        let each = configuration.each();
        if let Some(twice) = named_twice(&each) {
            return Err(Refusal(format!(
                "two controllers are called {twice}; give each a name of its own"
            )));
        }
        let several = each.iter().filter(|each| each.serve).count() > 1;
        let mut numbers = 1..;
        configuration.with_each(|each| {
            let is_of_file = each.program.is_some() || each.recording.is_some();
            only_files(each)?;
            let mut opened = match each.serve {
                false => open(each, progress)?,
                true if is_of_file => {
                    return Err(Refusal::new(
                        "what is behind ports is sent by host software: `serve` goes without \
                         `program` and `recording`",
                    ));
                }
                true => live::start(each, numbers.next().filter(|_| several), &self.ring)?,
            };
            if let Some(name) = &each.name {
                opened.name.clone_from(name);
            }
            Ok(opened)
        })
    }

    fn attach(&mut self, configuration: &Configuration) -> Result<Vec<Opened>, Refusal> {
        let is_list = !configuration.controllers.is_empty();
        configuration.with_each(|each| match &each.name {
            None if is_list && self.served.is_some() => Err(Refusal::new(
                "it says which controller it is, by its `name`, as in `{ \"name\": \"1\" }`; without \
                 `controllers` all are meant",
            )),
            _ => Ok(()),
        })?;
        if let Some(twice) = named_twice(&configuration.each()) {
            return Err(Refusal(format!(
                "two entries are about controller {twice}; leave one out"
            )));
        }
        match &self.served {
            Some(served) => served.attach(configuration, &self.ring),
            None => Err(Refusal::new(
                "no controllers run here to attach to: name a `recording`, or connect to the port of \
                 `vimc4 serve --dap PORT`",
            )),
        }
    }

    fn is_same_file(&self, one: &str, other: &str) -> bool {
        let whole = |path: &str| fs::canonicalize(path).unwrap_or_else(|_| PathBuf::from(path));
        one == other || whole(one) == whole(other)
    }
}

/// The name that two of them have, if two have the same.
fn named_twice(each: &[Configuration]) -> Option<&str> {
    let mut names: Vec<&str> = each.iter().filter_map(|each| each.name.as_deref()).collect();
    names.sort_unstable();
    names.windows(2).find(|two| two.first() == two.last()).and_then(|two| two.first().copied())
}

fn refused(failure: Failure) -> Refusal {
    Refusal(failure.text().replace(OR_INPUT, ""))
}

/// Refuses names of what is no file: whatever is read while the client talks must not wait for anybody,
/// and the adapter reads its client's messages from its input.
fn only_files(configuration: &Configuration) -> Result<(), Refusal> {
    let Configuration { program, recording, model, machine, flash, .. } = configuration;
    let of_folder = [("program", program), ("recording", recording), ("flash", flash)];
    let names = [("model", model), ("machine", machine)];
    for (attribute, name) in of_folder.into_iter().chain(names) {
        let Some(name) = name else { continue };
        // Profiles are found by their names as they are.
        let is_name = attribute == "model" || attribute == "machine";
        let path = match &configuration.cwd {
            Some(folder) if !is_name => Path::new(folder).join(name),
            _ => PathBuf::from(name),
        };
        let wrong = match name == "-" || is_input(&path) {
            true => Err("the adapter reads its client's messages from there"),
            false => file::is_regular(&path),
        };
        if let Err(why) = wrong {
            return Err(Refusal(format!("`{attribute}` cannot be {name}: {why}; name a file")));
        }
    }
    Ok(())
}

/// Whether a path leads to what the adapter reads its client's messages from.
#[cfg(unix)]
fn is_input(path: &Path) -> bool {
    use std::os::fd::AsFd;
    use std::os::unix::fs::MetadataExt;
    let identity = |file: fs::Metadata| (file.dev(), file.ino());
    // What is not at hand is told of when it is opened.
    let at = fs::metadata(path).map(identity).ok();
    let input = io::stdin().as_fd().try_clone_to_owned().map(fs::File::from);
    let input = input.and_then(|input| input.metadata()).map(identity).ok();
    at.is_some() && at == input
}

#[cfg(not(unix))]
fn is_input(_: &Path) -> bool {
    false
}

fn open(configuration: &Configuration, progress: &mut Progress<'_>) -> Result<Opened, Refusal> {
    let path = |name: &str| match &configuration.cwd {
        Some(folder) => Path::new(folder).join(name),
        None => PathBuf::from(name),
    };
    match (&configuration.program, &configuration.recording) {
        (Some(program), None) => read(configuration, path(program), progress)
            .map(|program| opened(program, configuration.keep_going == Some(true))),
        (None, Some(recording)) => of_recording(&path(recording)),
        (Some(_), Some(_)) => Err(Refusal::new("there is a program or a recording, not both")),
        (None, None) => Err(Refusal::new(
            "nothing to debug is named: `program` is a file of commands, a program, a plot or a \
             job, `recording` one that was recorded, `serve` a controller behind ports",
        )),
    }
}

/// Reads a program. It can be of any size, and what is read can take its time, so a thread does it. If it
/// is cancelled nobody waits for that, and it ends where it next looks.
fn read(
    configuration: &Configuration,
    path: PathBuf,
    progress: &mut Progress<'_>,
) -> Result<Program, Refusal> {
    let configuration = configuration.clone();
    let is_wanted = Arc::new(AtomicBool::new(true));
    let wanted = Arc::clone(&is_wanted);
    let (sender, opened) = channel();
    let open = move || {
        let is_wanted = || wanted.load(Ordering::Relaxed);
        drop(sender.send(of_program(&configuration, &path, &is_wanted)));
    };
    thread::Builder::new().name("opening".to_owned()).spawn(open).map_err(Refusal::new)?;
    loop {
        match opened.recv_timeout(PATIENCE) {
            Ok(opened) => return opened,
            Err(RecvTimeoutError::Timeout) if progress(Time::ZERO).is_continue() => {}
            Err(RecvTimeoutError::Timeout) => {
                is_wanted.store(false, Ordering::Relaxed);
                return Err(Refusal::cancelled());
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Refusal::new("it cannot be opened: the adapter has failed"));
            }
        }
    }
}

/// A program for an editor: it is sent as one goes on.
fn opened(program: Program, keeps_going: bool) -> Opened {
    let said = program.ends_early();
    let Program { name, history, mut source, pieces, lines, start, stored, statement, .. } =
        program;
    source.name = absolute(Path::new(&source.name));
    let pieces = pieces.into_iter().chain(start).collect();
    let feed = Feed::new(pieces).of_lines(lines);
    let feed = if keeps_going { feed } else { feed.until_error() };
    let debugger = Debugger::over(history).with_source(source).with_feed(feed);
    let said = said.unwrap_or_default();
    Opened { name, debugger, stored, is_file: true, statement, live: None, said }
}

fn of_program(
    configuration: &Configuration,
    path: &Path,
    wanted: &dyn Fn() -> bool,
) -> Result<Program, Refusal> {
    let Configuration { model, machine, quirks, .. } = configuration;
    let setup = Setup::said(model.clone(), machine.clone());
    let quirks: Vec<(String, String)> =
        quirks.iter().map(|(name, value)| (name.clone(), value.clone())).collect();
    let job = job_options(configuration)?;
    let is_lenient = job.reading.lenient;
    let ways = Ways { quirks, axes: None, job };
    let program = opened::read(path, setup, &ways, wanted).map_err(refused)?;
    let Some(program) = program else { return Err(Refusal::cancelled()) };
    if !program.errors.is_empty() && !is_lenient {
        let more = program.errors.len().saturating_sub(MOST_ERRORS);
        let told = program.errors.get(..MOST_ERRORS).unwrap_or(&program.errors).join(", ");
        let more = if more > 0 { format!(", and {more} more") } else { String::new() };
        let name = text::name(path);
        // The remedy of an error may be an option, as it is called on a command line.
        let where_options_go = match told.contains(" --") {
            true => " (such options stand in `jobOptions`)",
            false => "",
        };
        return Err(Refusal(format!("{name}: {told}{more}{where_options_go}")));
    }
    Ok(program)
}

/// What is said about a job.
fn job_options(configuration: &Configuration) -> Result<JobOptions, Refusal> {
    let words = configuration.job_options.as_deref().unwrap_or_default();
    let options = JobOptions::of_words(words);
    options.map_err(|failure| Refusal(format!("`jobOptions`: {}", failure.text())))
}

/// The path of a file as an editor finds it, wherever it was started.
fn absolute(path: &Path) -> String {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    path.to_string_lossy().into_owned()
}

// --- recordings ---

/// It is read on as somebody comes to its end, and while nothing is asked.
fn of_recording(path: &Path) -> Result<Opened, Refusal> {
    Ok(recorded(history::open(path, Commands::Listed).map_err(refused)?))
}

/// A recording for an editor.
pub(crate) fn recorded(opened: history::Opened) -> Opened {
    let history::Opened { mut debugger, model, machine, controller, .. } = opened;
    debugger.stay_within(true);
    let said = debugger.notice().unwrap_or_default();
    let name = match controller.as_str() {
        "" => format!("{} on {}", model.name(), machine.name),
        controller => controller.to_owned(),
    };
    // Between the lines of a program there are commands, and the other way round.
    Opened {
        name,
        debugger,
        stored: Vec::new(),
        is_file: false,
        statement: Unit::Line,
        live: None,
        said,
    }
}
