//! A sweep over a host command.

use std::ffi::{OsStr, OsString};
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek};
#[cfg(unix)]
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Command, ExitCode, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError, RwLock};
use std::thread;
use std::time::{Duration, Instant};

#[cfg(unix)]
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
use vimc4::sweep::{Case, Exit, Foretold, Found, Habits, Point, Results, Row, Session, Stand};
use vimc4_device::{Fault, TimedInput};

use super::arguments::Arguments;
use super::asked::Asked;
use super::folder::Folder;
#[cfg(unix)]
use super::guard::Guard;
use super::limit::Limit;
use super::slots::{Slot, Slots};
use super::{reel, report};
use crate::failure::Failure;
use crate::here::here;
use crate::recording::controller::PlayedDevice;
use crate::text::shown_in_line;

/// So much of what a host prints is kept.
const PRINTED: u64 = 1 << 16;

/// Where a host finds the controller.
const FOUND_IN: &str = here!("VIMC4_PORT, or where {port}", "VIMC4_TCP, or where {tcp}");

/// How long a host may take without a fault.
const PATIENCE: Duration = Duration::from_secs(60);

/// How much longer it may take with one, and how long at least.
const LONGER: u32 = 20;
const SHORTEST: Duration = Duration::from_secs(2);

/// So many hosts run at the same time for each processor, and so many with those that have taken a quarter
/// of their time limit: they seem to wait, and need no processor.
const FEW: usize = 4;
const MANY: usize = 12;

/// What is needed to run a host.
struct Runs<'a> {
    arguments: &'a Arguments,
    limit: Limit,
    stand: Stand,
    slots: Slots,
    /// What the host does after what it has heard, where that can be known.
    habits: Option<RwLock<Habits>>,
    /// What is being found out.
    asked: Asked,
    #[cfg(unix)]
    guard: Guard,
}

/// A run of a host.
struct Ran {
    given: Vec<TimedInput>,
    exit: Exit,
    printed: Vec<u8>,
}

/// What came of a point.
struct Judged {
    found: Found,
    case: Case,
    given: Vec<TimedInput>,
    printed: Vec<u8>,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let names_port = |word: &OsString| word.to_string_lossy().contains("{port}");
    if cfg!(not(unix)) && arguments.command.iter().any(names_port) {
        return Err(Failure::usage(
            "{port} stands for a pseudo-terminal, and this system has none; use {tcp}, which is HOST:PORT",
        ));
    }
    let stand = Stand::new(&arguments.model, &arguments.machine)?;
    let mut runs = Runs {
        arguments,
        limit: Limit::new(arguments.limit.unwrap_or(PATIENCE)),
        stand,
        slots: Slots::new(arguments.jobs(FEW)),
        habits: None,
        asked: Asked::default(),
        #[cfg(unix)]
        guard: Guard::start()
            .map_err(|error| Failure::usage(format!("cannot start a process: {error}")))?,
    };
    let began = Instant::now();
    let (session, given) = runs.clean()?;
    // It was run twice.
    let usual = (began.elapsed() / 2).saturating_mul(LONGER).max(SHORTEST);
    runs.limit = arguments.limit.map_or_else(|| Limit::growing(usual), Limit::new);
    if !arguments.run_all {
        runs.habits = Habits::new(&session, &given, Exit::Code(0)).map(RwLock::new);
    }
    let words: Vec<String> =
        arguments.command.iter().map(|word| shown_in_line(&word.to_string_lossy())).collect();
    let results = Results::of(runs.stand.subject(words.join(" "), &session));
    let folder = Folder::open(&arguments.out, arguments.shard, results, arguments.resume)?;
    let numbers = arguments.shard.numbers(session.plan().len());
    let open: Vec<u64> = numbers.filter(|number| !folder.results.has(*number)).collect();
    let open = mixed(&open);
    let progress = report::progress(open.len() as u64);
    let (next, failed, folder) = (AtomicUsize::new(0), AtomicBool::new(false), Mutex::new(folder));
    let work = || {
        while let Some(number) = open.get(next.fetch_add(1, Ordering::Relaxed))
            && !failed.load(Ordering::Relaxed)
        {
            let Some(point) = session.plan().point(*number) else { continue };
            runs.point(&folder, &session, &point)
                .inspect_err(|_| failed.store(true, Ordering::Relaxed))?;
            progress.inc(1);
        }
        Ok(())
    };
    let workers = arguments.jobs(MANY);
    let ended: Vec<Result<(), Failure>> = thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        let panicked = |panic| std::panic::resume_unwind(panic);
        workers.into_iter().map(|worker| worker.join().unwrap_or_else(panicked)).collect()
    });
    progress.finish_and_clear();
    ended.into_iter().collect::<Result<(), Failure>>()?;
    let results = folder.into_inner().unwrap_or_else(PoisonError::into_inner).finish()?;
    report::print(&results, &report::About { out: &arguments.out, json: arguments.json })
}

impl Runs<'_> {
    /// The host without a fault, twice: it has to succeed, and to do the same again.
    fn clean(&self) -> Result<(Session<PlayedDevice>, Vec<TimedInput>), Failure> {
        let mut sessions = Vec::new();
        for _ in 0..2 {
            let ran = self.host(&[], "without a fault")?;
            if ran.exit != Exit::Code(0) {
                let how = match ran.exit {
                    Exit::Code(code) => format!("ends with exit code {code}"),
                    Exit::Signal(signal) => format!("is ended by signal {signal}"),
                    _ => format!("does not end within {:?}", self.limit.now()),
                };
                let printed = String::from_utf8_lossy(&ran.printed);
                let last = printed.lines().rfind(|line| !line.trim().is_empty());
                let last =
                    last.map_or_else(String::new, |line| format!(", having printed \"{line}\""));
                return Err(Failure::usage(format!(
                    "the host {how} without any fault{last}; make it pass first: it finds the controller \
                     in {FOUND_IN} stands in its arguments"
                )));
            }
            let session = self.stand.session(&ran.given, &self.arguments.choice(true))?;
            if session.clean().to_controller.is_empty() {
                return Err(Failure::usage(format!(
                    "the host has sent nothing to the controller; have it open the port that is named in \
                     {FOUND_IN} stands in its arguments"
                )));
            }
            sessions.push((session, ran.given));
        }
        let (Some(two), Some(one)) = (sessions.pop(), sessions.pop()) else {
            return Err(Failure::midway("the host was not run"));
        };
        if let Some(difference) = one.0.difference(&two.0) {
            return Err(Failure::usage(format!(
                "the host does something else each time it runs: {difference}; points have no meaning then: \
                 make what it sends depend on nothing but what it hears"
            )));
        }
        Ok(one)
    }

    /// What comes of the faults of a point. If the host would hear what it has heard before, that is known;
    /// but what is shown to people was seen.
    fn point(
        &self,
        folder: &Mutex<Folder>,
        session: &Session<PlayedDevice>,
        point: &Point,
    ) -> Result<(), Failure> {
        let folder = || folder.lock().unwrap_or_else(PoisonError::into_inner);
        let mut asking = None;
        while let Some(habits) = self.habits.as_ref().filter(|_| asking.is_none()) {
            let foretold =
                habits.read().unwrap_or_else(PoisonError::into_inner).foretell(session, point);
            match foretold {
                Foretold::Known(given, exit) => {
                    let Some((found, case)) = session.judge(point.number, &given, exit) else {
                        break;
                    };
                    if folder().results.is_smallest(point.number, &found.outcome, found.size) {
                        break;
                    }
                    let known = Judged { found, case, given, printed: Vec::new() };
                    return self.take(&mut folder(), session, known);
                }
                // Another run may tell.
                Foretold::Unknown(moment) => asking = self.asked.begin(moment),
                Foretold::Unclear => break,
            }
        }
        let Ran { given, exit, printed } =
            self.host(&session.plan().faults(session.clean(), point), &point.number.to_string())?;
        if let Some(habits) = &self.habits {
            let mut habits = habits.write().unwrap_or_else(PoisonError::into_inner);
            habits.learn(session, &given, exit);
            let mut folder = folder();
            if habits.are_unsteady() && !folder.results.is_unsteady() {
                folder.results.take(Row::Unsteady);
                folder.write(&[Row::Unsteady])?;
            }
        }
        drop(asking);
        match session.judge(point.number, &given, exit) {
            Some((found, case)) => {
                self.take(&mut folder(), session, Judged { found, case, given, printed })
            }
            None => Ok(()),
        }
    }

    /// Takes note of what came of a point.
    fn take(
        &self,
        folder: &mut Folder,
        session: &Session<PlayedDevice>,
        judged: Judged,
    ) -> Result<(), Failure> {
        let Judged { found, case, given, printed } = judged;
        let mut is_smallest = false;
        let smallest = || {
            is_smallest = true;
            Some(case.clone())
        };
        let rows = folder.results.add(found.point, &found.outcome, found.size, smallest);
        if is_smallest {
            let (model, machine) = (self.stand.model(), self.stand.machine());
            let mut head = vimc4::recording_head(model, machine, "instant", "sweep");
            // Equal sweeps have equal recordings.
            head.began = None;
            let recording = reel::record(head, session.device(), &given, &case.broken);
            folder.keep(&case, &recording.write(), &printed)?;
        }
        folder.write(&rows)
    }

    /// Runs the host once, with a controller of its own.
    fn host(&self, faults: &[Fault], point: &str) -> Result<Ran, Failure> {
        let slot = self.slots.take();
        let trial = self.stand.begin(faults)?;
        let port = trial.emulator().port().map(Path::to_owned);
        let tcp =
            trial.emulator().tcp_addr().map(|address| address.to_string()).unwrap_or_default();
        let filled = |word: &OsString| -> OsString {
            match word.to_str() {
                Some(text) => {
                    let text = text.replace("{tcp}", &tcp);
                    match &port {
                        Some(port) => text.replace("{port}", &port.to_string_lossy()).into(),
                        None => text.into(),
                    }
                }
                None => word.clone(),
            }
        };
        let mut words = self.arguments.command.iter().map(filled);
        let program = words.next().unwrap_or_default();
        let cannot = |error: io::Error| cannot_run(&program, &error);
        let mut printed = scratch().map_err(cannot)?;
        let mut command = Command::new(&program);
        command.args(words).env("VIMC4_TCP", &tcp);
        if let Some(port) = &port {
            command.env("VIMC4_PORT", port);
        }
        command.env("VIMC4_POINT", point).stdin(Stdio::null());
        command.stdout(printed.try_clone().map_err(cannot)?);
        command.stderr(printed.try_clone().map_err(cannot)?);
        let exit = self.wait(&mut command, slot).map_err(cannot)?;
        // Ends the controller last, so that the host finds it as long as it runs.
        let given = trial.end()?;
        let mut text = Vec::new();
        printed
            .rewind()
            .and_then(|()| printed.take(PRINTED).read_to_end(&mut text))
            .map_err(cannot)?;
        Ok(Ran { given, exit, printed: text })
    }

    /// Runs it to its end, or to the time limit. Nothing of it is left then.
    #[cfg(unix)]
    fn wait(&self, command: &mut Command, slot: Slot<'_>) -> io::Result<Exit> {
        self.guard.mark(command);
        let mut child = command.process_group(0).spawn()?;
        let group = Pid::from_child(&child);
        self.guard.begins(group);
        let (ended, ends) = channel();
        let status = thread::scope(|scope| {
            scope.spawn(move || {
                // Not reaped yet, its number is still its own.
                let options = WaitIdOptions::EXITED | WaitIdOptions::NOWAIT;
                let _ = waitid(WaitId::Pid(group), options);
                let _ = ended.send(());
            });
            let in_time = self.limit.wait(&ends, slot) != Err(RecvTimeoutError::Timeout);
            // What it has started goes with it.
            let _ = kill_process_group(group, Signal::KILL);
            in_time
        });
        let exited = child.wait()?;
        self.guard.ends(group);
        Ok(if status { exit(exited) } else { Exit::Hung })
    }

    /// The same where there are no groups of processes: the system ends all that the host has started.
    #[cfg(not(unix))]
    fn wait(&self, command: &mut Command, slot: Slot<'_>) -> io::Result<Exit> {
        let mut child = command.spawn()?;
        let number = child.id().to_string();
        let (ended, ends) = channel();
        thread::scope(|scope| {
            // As long as the child is held there, its number is its own.
            scope.spawn(move || ended.send(child.wait()));
            match self.limit.wait(&ends, slot) {
                Ok(status) => Ok(exit(status?)),
                Err(RecvTimeoutError::Disconnected) => Err(io::ErrorKind::BrokenPipe.into()),
                Err(RecvTimeoutError::Timeout) => {
                    let mut kill = Command::new("taskkill");
                    kill.args(["/F", "/T", "/PID", &number]);
                    kill.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
                    // The host may have ended by itself meanwhile.
                    kill.status()?;
                    Ok(Exit::Hung)
                }
            }
        })
    }
}

/// The same numbers in an order in which neighbours are far apart: what is alike then comes one after the
/// other, and not at the same time.
fn mixed(numbers: &[u64]) -> Vec<u64> {
    let parts = numbers.len().isqrt().max(1);
    let part = |first: usize| numbers.iter().skip(first).step_by(parts).copied();
    (0..parts).flat_map(part).collect()
}

fn exit(status: ExitStatus) -> Exit {
    #[cfg(unix)]
    if let Some(signal) = status.signal() {
        return Exit::Signal(signal);
    }
    Exit::Code(status.code().unwrap_or(1))
}

fn cannot_run(program: &OsStr, error: &io::Error) -> Failure {
    let program = shown_in_line(&program.to_string_lossy());
    Failure::usage(format!(
        "cannot run {program}: {error}; name a program and its arguments behind `--`"
    ))
}

/// A file for what a host prints; where the system allows it, nobody else sees it.
fn scratch() -> io::Result<File> {
    static FILES: AtomicUsize = AtomicUsize::new(0);
    let number = FILES.fetch_add(1, Ordering::Relaxed);
    let name = format!("vimc4-sweep-{}-{number}.txt", std::process::id());
    let path = std::env::temp_dir().join(name);
    let file = OpenOptions::new().read(true).write(true).create_new(true).open(&path)?;
    #[cfg(unix)]
    std::fs::remove_file(&path)?;
    Ok(file)
}
