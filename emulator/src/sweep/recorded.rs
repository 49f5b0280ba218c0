//! A sweep over a recorded session.

use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread;

use vimc4::sweep::{Found, Profile, Results, Session};
use vimc4_catalogue::Handling;
use vimc4_device::{Device, Names, Time, TimedInput};
use vimc4_timeline::recording::{Head, What};

use super::arguments::Arguments;
use super::folder::Folder;
use super::{reel, report};
use crate::failure::Failure;
use crate::recording::controller::{PlayedDevice, Site};
use crate::recording::file;
use crate::text;
use vimc4_answers::profiles::known;

/// So many points are done at a time. A sweep that is killed repeats no more than these, for each job.
const CHUNK: usize = 256;

pub(super) fn run(arguments: &Arguments, path: &Path) -> Result<ExitCode, Failure> {
    let (head, site, session) = session(arguments, path).map_err(Failure::begins_nothing)?;
    if session.plan().is_empty() {
        return Err(Failure::usage(format!(
            "{} has nothing that could go wrong: no input of a host; name a recording of a whole session",
            text::name(path)
        )));
    }
    let model = Profile::new(site.model.name(), &head.model);
    let machine = Profile::new(&site.machine.name, &head.machine);
    // Where it lies differs from computer to computer.
    let name = path.file_name().map_or(path, Path::new);
    let results = Results::of(session.subject(text::name(name), model, machine));
    let mut folder = Folder::open(&arguments.out, arguments.shard, results, arguments.resume)?;
    let numbers = arguments.shard.numbers(session.plan().len());
    let open: Vec<u64> = numbers.filter(|number| !folder.results.has(*number)).collect();
    let chunks: Vec<&[u64]> = open.chunks(CHUNK).collect();
    let progress = report::progress(open.len() as u64);
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    thread::scope(|scope| {
        let (done, found) = sync_channel::<Vec<Found>>(arguments.jobs(1));
        for _ in 0..arguments.jobs(1) {
            let (done, next, failed, chunks, session) =
                (done.clone(), &next, &failed, &chunks, &session);
            scope.spawn(move || {
                while let Some(chunk) = chunks.get(next.fetch_add(1, Ordering::Relaxed))
                    && !failed.load(Ordering::Relaxed)
                {
                    let found = chunk.iter().filter_map(|number| session.run_point(*number));
                    if done.send(found.collect()).is_err() {
                        return;
                    }
                }
            });
        }
        drop(done);
        for chunk in found {
            progress.inc(chunk.len() as u64);
            if let Err(failure) = take(&mut folder, &session, &head, chunk) {
                failed.store(true, Ordering::Relaxed);
                return Err(failure);
            }
        }
        Ok(())
    })?;
    progress.finish_and_clear();
    let results = folder.finish()?;
    report::print(&results, &report::About { out: &arguments.out, json: arguments.json })
}

/// Takes note of what was found.
fn take(
    folder: &mut Folder,
    session: &Session<PlayedDevice>,
    head: &Head,
    chunk: Vec<Found>,
) -> Result<(), Failure> {
    let mut rows = Vec::new();
    for Found { point: number, outcome, size } in chunk {
        let mut smallest = None;
        let case = || {
            smallest = session.case(number, size);
            smallest.clone()
        };
        rows.extend(folder.results.add(number, &outcome, size, case));
        if let (Some(case), Some(point)) = (smallest, session.plan().point(number)) {
            let inputs = session.with_faults(&point);
            let recording = reel::record(head.clone(), session.device(), &inputs, &case.broken);
            folder.keep(&case, &recording.write(), b"")?;
        }
    }
    folder.write(&rows)
}

/// The session in a file.
fn session(
    arguments: &Arguments,
    path: &Path,
) -> Result<(Head, Site, Session<PlayedDevice>), Failure> {
    let recording = file::read(path)?;
    if let Some(line) = recording.torn {
        // Where nobody can be told there are the results.
        let _ = writeln!(io::stderr(), "{}", file::torn_off(line));
    }
    let site = Site::recorded(&recording);
    let site = site.map_err(|error| file::unplayable(path, &recording, error))?;
    let mut device = site.fresh()?;
    let names = Names::of(&device);
    let (mut inputs, mut end, mut has_begun) = (Vec::new(), Time::ZERO, false);
    for entry in &recording.entries {
        let wrong = |why: String| {
            let why = format!("line {}: {why}", entry.line);
            file::unplayable(path, &recording, why)
        };
        end = end.max(entry.at);
        match &entry.what {
            What::State { by: None, state } if !has_begun && inputs.is_empty() => {
                device.restore(site.read(state).map_err(wrong)?);
                has_begun = true;
            }
            What::State { by: Some(_), .. } | What::Stands(_) => {
                return Err(Failure::usage(format!(
                    "{}, line {}: somebody has led the controller through its time there, and no fault \
                     can be tried on that; cut the part before it with `vimc4 cut`",
                    text::name(path),
                    entry.line
                )));
            }
            What::Given { given, .. } => {
                let input = known(&names, given).map_err(wrong)?;
                inputs.push(TimedInput { at: entry.at, input });
            }
            _ => {}
        }
    }
    let mut head = recording.head.clone();
    head.from = "sweep".to_owned();
    let ends = Handling::of(&site.model).ends;
    let session = Session::new(device, &inputs, end, ends, &arguments.choice(false));
    Ok((head, site, session))
}
