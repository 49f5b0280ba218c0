//! `vimc4 lines`

use std::ffi::OsString;
use std::io;
use std::process::{Command, ExitCode};
use std::sync::mpsc;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use clap_complete::engine::ArgValueCompleter;
use tokio::runtime;
use tokio::sync::oneshot;
use vimc4::{Control, HostLines, LineEvent, ModemLine, Report, ReportKind, Sink, Time, Verbosity};
use vimc4_lines::{Far, HostLine, LaunchError, Lines, Peer, Port};

use crate::completions;
use crate::failure::Failure;
use crate::log::Log;
use crate::places::link;
use crate::serve;
use crate::typed_options::TypedOptions;

/// How long a controller has to say whether it takes more, before what it said last counts.
const ANSWER: Duration = Duration::from_millis(100);

const EXAMPLES: &str = "\
Examples:
  vimc4 lines --serve -- python3 examples/tour.py
  vimc4 lines -- picocom ./vimc4.pty
  vimc4 lines --serve --model smcu --machine board-plotter -- python3 examples/plot.py ./vimc4.pty
  vimc4 lines --pty ~/.wine/dosdevices/com11 -- wine driver.exe

The program may be of any kind, and so may what it starts; setuid programs run without their
privileges. Wine asks its server to open ports: end one that already runs with `wineserver -k`.
It needs Linux 5.5, on x86-64 or aarch64, and cannot be nested.

Exit codes: the program's; 127 if there is no such program, 126 if it cannot be run, 2 if it was
not tried.";

/// Runs a program and everything that it starts so that requests for modem lines on one
/// pseudo-terminal are answered: CTS, DSR and DCD can be read and waited for, DTR and RTS set. On every
/// other terminal and file nothing changes.
#[derive(clap::Args)]
// Both structures have the same name, and clap would make a group of each.
#[group(skip)]
#[command(
    after_help = EXAMPLES,
    after_long_help = EXAMPLES,
    mut_arg("pty", |arg| arg
        .num_args(1)
        .help("The pseudo-terminal, or the link to it: what `vimc4 serve` prints, and what \
               --serve makes [default: ./vimc4.pty]")),
    mut_arg("tcp", |arg| arg.default_value("none").requires("serve")),
    mut_arg("rfc2217", |arg| arg.requires("serve")),
    mut_arg("model", |arg| arg.requires("serve")),
    mut_arg("machine", |arg| arg.requires("serve")),
    mut_arg("time", |arg| arg.requires("serve")),
    mut_arg("line_pacing", |arg| arg.requires("serve")),
    mut_arg("line_physics", |arg| arg.requires("serve")),
    mut_arg("flash", |arg| arg.requires("serve")),
    mut_arg("record", |arg| arg.requires("serve")),
    mut_arg("coverage", |arg| arg.requires("serve")),
    mut_arg("scenario", |arg| arg.requires("serve")),
    mut_arg("vcd", |arg| arg.requires("serve")),
    mut_arg("fst", |arg| arg.requires("serve")),
    mut_arg("csv", |arg| arg.requires("serve")),
    mut_arg("perfetto", |arg| arg.requires("serve")),
    mut_arg("tcp_clients", |arg| arg.requires("serve")),
    mut_arg("fresh_clients", |arg| arg.requires("serve")),
    mut_arg("replace", |arg| arg.requires("serve")),
    mut_arg("until_stdin_closes", |arg| arg.hide(true).conflicts_with("program")),
    mut_arg("serial", |arg| arg.hide(true).conflicts_with("program")),
    mut_arg("count", |arg| arg.hide(true).conflicts_with("program")),
    mut_arg("dap", |arg| arg.hide(true).conflicts_with("program")),
    mut_arg("json", |arg| arg.hide(true).conflicts_with("program")),
    mut_arg("verbose", |arg| arg
        .help("Show on standard error what the program does to DTR and RTS, and with --serve the \
               conversation")),
)]
#[cfg_attr(feature = "api", command(
    mut_arg("http", |arg| arg.hide(true).conflicts_with("program")),
    mut_arg("web", |arg| arg.hide(true).conflicts_with("program")),
    mut_arg("http_token", |arg| arg.hide(true).conflicts_with("program")),
))]
pub(crate) struct Arguments {
    /// What is at the far end of the handshake lines
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = FarEnd::On)]
    lines: FarEnd,
    /// Connect DCD too. DOS programs take it for a caller, so it is off otherwise
    #[arg(long)]
    dcd: bool,
    /// Start a controller for the program, and end it afterwards
    #[arg(long)]
    serve: bool,
    #[command(flatten)]
    controller: serve::Arguments,
    /// The program and its arguments
    #[arg(
        value_name = "PROGRAM",
        required = true,
        trailing_var_arg = true,
        allow_hyphen_values = true,
        add = ArgValueCompleter::new(completions::Program)
    )]
    program: Vec<OsString>,
}

#[derive(Clone, Copy, ValueEnum)]
enum FarEnd {
    /// A device: DSR is on, and CTS while it takes more; with --serve, as its controller drives them
    On,
    /// A plug: CTS follows RTS, DSR follows DTR
    Loop,
    /// Nothing, as with a cable of three wires
    None,
}

impl From<FarEnd> for Far {
    fn from(end: FarEnd) -> Far {
        match end {
            FarEnd::On => Far::On,
            FarEnd::Loop => Far::Loop,
            FarEnd::None => Far::None,
        }
    }
}

pub(crate) fn run(arguments: Arguments, typed: &TypedOptions) -> Result<ExitCode, Failure> {
    let is_cut = matches!(arguments.lines, FarEnd::None);
    typed.refuse_if(is_cut, &["dcd"], "with --lines none")?;
    if arguments.serve {
        arguments.controller.check(typed)?;
    }
    let Arguments { lines, dcd, serve, controller, program } = arguments;
    let Some((program, rest)) = program.split_first() else {
        return Err(Failure::usage("no program is given; name it after `--`"));
    };
    let Some(terminal) = link(controller.pty.as_deref(), controller.replace) else {
        return Err(Failure::usage(
            "without a pseudo-terminal no lines are needed; leave --pty out",
        ));
    };
    let log = serve::open_log(&controller)?;
    // Before anything starts a thread.
    let launcher = vimc4_lines::prepare().map_err(refused)?;
    let verbose = controller.verbose;
    let to_file = controller.log.is_some();
    let port = Arc::<LatePort>::default();
    let served = match serve {
        true => Some(Served::start(controller, &log, Arc::clone(&port))?),
        false => None,
    };
    let peer: Box<dyn Peer> = match &served {
        Some(served) => Box::new(served.peer()),
        None => Box::new(Diary::new(&log, verbose, to_file)),
    };
    warn_of_wineserver(program);
    warn_of_yama();
    let mut command = Command::new(program);
    command.args(rest);
    let lines = Lines::new(lines.into(), dcd);
    let running = launcher.launch(command, &terminal, lines, peer).map_err(refused)?;
    port.arrive(running.port());
    let shown = program.display().to_string();
    let ending = running.attend(|| {
        eprintln!(
            "{shown} has ended; what it has started goes on and keeps its modem lines until \
             Ctrl-C"
        );
    });
    // The controller ends before the parent learns of the program's end.
    drop(served);
    log.flush();
    ending.map_err(refused)?.pass_on()
}

fn name(line: HostLine) -> &'static str {
    match line {
        HostLine::Dtr => "DTR",
        HostLine::Rts => "RTS",
    }
}

fn refused(error: LaunchError) -> Failure {
    match &error {
        LaunchError::Program { source, .. } if source.kind() == io::ErrorKind::NotFound => {
            Failure::of_program(error, 127)
        }
        LaunchError::Program { .. } => Failure::of_program(error, 126),
        _ => Failure::usage(error),
    }
}

/// Logs what the program does to its lines, in the form that a controller of this process uses.
struct Diary {
    began: Instant,
    sinks: Vec<Box<dyn Sink>>,
}

impl Diary {
    fn new(log: &Log, verbose: bool, to_file: bool) -> Diary {
        let mut sinks: Vec<Box<dyn Sink>> = Vec::new();
        if verbose {
            sinks.push(Box::new(log.terminal(Verbosity::Conversation, String::new())));
        }
        if to_file {
            sinks.push(Box::new(log.file(String::new())));
        }
        Diary { began: Instant::now(), sinks }
    }
}

impl Peer for Diary {
    fn hears(&mut self, line: HostLine, on: bool) {
        let at = Time::ZERO + self.began.elapsed();
        let news = LineEvent::HostLine { transport: Arc::from("pty"), line: name(line).into(), on };
        let report = Report { controller: Arc::from(""), at, what: ReportKind::News(news) };
        for sink in &mut self.sinks {
            sink.report(&report, &|_| String::new());
        }
    }
}

// --- our own controller ---

/// The port of a program that is yet to be started, for a controller whose lines may change before.
#[derive(Default)]
struct LatePort(Mutex<LateLines>);

#[derive(Default)]
struct LateLines {
    port: Option<Port>,
    /// The lines that have changed, as they are now.
    changed: Vec<(ModemLine, bool)>,
}

impl LatePort {
    fn switch(&self, line: ModemLine, on: bool) {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        state.changed.retain(|(other, _)| *other != line);
        state.changed.push((line, on));
        state.show((line, on));
    }

    fn arrive(&self, port: Port) {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        state.port = Some(port);
        state.changed.iter().for_each(|change| state.show(*change));
    }
}

impl LateLines {
    fn show(&self, (line, on): (ModemLine, bool)) {
        let Some(port) = &self.port else { return };
        match line {
            ModemLine::Cts => port.set_ready(on),
            ModemLine::Dsr => port.set_line(vimc4_lines::DSR, on),
            ModemLine::Dcd => port.set_line(vimc4_lines::DCD, on),
            ModemLine::Ri => port.set_line(vimc4_lines::RI, on),
        }
    }
}

/// A controller in a thread of its own, which ends when this is dropped.
struct Served {
    control: Control,
    host: HostLines,
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    fn start(
        arguments: serve::Arguments,
        log: &Log,
        port: Arc<LatePort>,
    ) -> Result<Served, Failure> {
        let (end, ended) = oneshot::channel();
        let (ready, started) = mpsc::channel();
        let log = log.clone();
        let thread = thread::Builder::new().name("controller".to_owned());
        let failed = |error| Failure::usage(format!("cannot start a controller: {error}"));
        let run = move || Served::run(&arguments, &log, &ready, ended);
        let thread = thread.spawn(run).map_err(failed)?;
        let control = started.recv().unwrap_or_else(|_| {
            Err(Failure::usage("the controller has ended before it could be used"))
        })?;
        let host = control.handshake_lines(move |line, on| port.switch(line, on)).wait();
        let host = host.map_err(Failure::usage)?;
        Ok(Served { control, host, end: Some(end), thread: Some(thread) })
    }

    /// What a program finds at the far side of its lines.
    fn peer(&self) -> Controller {
        let (control, host) = (self.control.clone(), self.host.clone());
        Controller { heeds: control.model().has_handshake_lines(), control, host }
    }

    /// The thread.
    fn run(
        arguments: &serve::Arguments,
        log: &Log,
        ready: &mpsc::Sender<Result<Control, Failure>>,
        ended: oneshot::Receiver<()>,
    ) {
        // The program that waits for it hears of everything that goes wrong.
        let say = |outcome| drop(ready.send(outcome));
        let runtime = match runtime::Builder::new_current_thread().enable_all().build() {
            Ok(runtime) => runtime,
            Err(error) => {
                return say(Err(Failure::usage(format!("cannot wait for events: {error}"))));
            }
        };
        runtime.block_on(async {
            let (mut emulators, mut drawn) = (Vec::new(), Vec::new());
            let started = serve::start(arguments, log, &mut emulators, &mut drawn).await;
            if let Err(failure) = started {
                let _ = serve::finish(arguments, emulators, drawn, log).await;
                return say(Err(failure));
            }
            if let Some(emulator) = emulators.first() {
                say(Ok(emulator.control().clone()));
            }
            let mut running = serve::RunningControllers::of(&emulators);
            tokio::select! {
                _ = ended => {}
                () = running.all_end(log) => {}
            }
            // The program has found its terminal gone; the cause is reported here.
            if let Err(failure) = running.outcome() {
                let _ = failure.report();
            }
            if let Err(failure) = serve::finish(arguments, emulators, drawn, log).await {
                let _ = failure.report();
            }
        });
    }
}

struct Controller {
    control: Control,
    host: HostLines,
    /// CTS has a meaning.
    heeds: bool,
}

impl Peer for Controller {
    fn hears(&mut self, line: HostLine, on: bool) {
        self.host.switched(name(line), on);
    }

    /// A host that has filled the buffer must not see the CTS of a moment before.
    fn takes_more(&mut self) -> Option<bool> {
        if !self.heeds {
            return None;
        }
        self.control.takes_more().wait_within(ANSWER).ok()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

// --- possible obstacles ---

#[cfg(not(target_os = "linux"))]
fn warn_of_yama() {}

/// A hardened system lets only root look into another program's memory, where arguments are.
#[cfg(target_os = "linux")]
fn warn_of_yama() {
    if rustix::process::geteuid().is_root() {
        return;
    }
    let scope = std::fs::read_to_string("/proc/sys/kernel/yama/ptrace_scope");
    if scope.is_ok_and(|scope| matches!(scope.trim(), "2" | "3")) {
        eprintln!(
            "kernel.yama.ptrace_scope of this system is 2 or more, so that only root may answer \
             for a program; set it to 1"
        );
    }
}

/// Wine's ports are opened by its server, which may have been started without modem lines.
fn warn_of_wineserver(program: &std::ffi::OsStr) {
    let name = std::path::Path::new(program).file_name().unwrap_or_default();
    if !name.as_encoded_bytes().starts_with(b"wine") || name == "wineserver" {
        return;
    }
    let Ok(processes) = std::fs::read_dir("/proc") else { return };
    let is_server = |process: std::fs::DirEntry| {
        std::fs::read_to_string(process.path().join("comm"))
            .is_ok_and(|name| name.starts_with("wineserver"))
    };
    if processes.flatten().any(is_server) {
        eprintln!(
            "a wineserver runs already, and what it opens has no modem lines; end it first with \
             `wineserver -k`"
        );
    }
}

#[cfg(test)]
mod tests {
    use clap::{Args as _, Command, Parser};

    use super::serve;

    #[derive(Parser)]
    struct Lines {
        #[command(flatten)]
        arguments: super::Arguments,
    }

    /// What is about a controller means nothing without one of our own.
    #[test]
    fn no_option_of_a_controller_is_ignored() {
        let own = ["pty", "log", "verbose"];
        let command = serve::Arguments::augment_args(Command::new("serve"));
        let options =
            command.get_arguments().filter(|option| !own.contains(&option.get_id().as_str()));
        for option in options {
            let name = format!("--{}", option.get_long().unwrap_or_default());
            let value = match name.as_str() {
                "--time" => "8x",
                "--count" => "2",
                "--tcp-clients" => "observe",
                _ => "1",
            };
            let given = match option.get_action().takes_values() {
                true => format!("{name}={value}"),
                false => name,
            };
            let parsed = Lines::try_parse_from(["lines", given.as_str(), "--", "true"]);
            let error = parsed.err().map(|error| error.kind());
            let refused = [
                clap::error::ErrorKind::MissingRequiredArgument,
                clap::error::ErrorKind::ArgumentConflict,
            ];
            assert!(error.is_some_and(|kind| refused.contains(&kind)), "{given}: {error:?}");
        }
        assert!(Lines::try_parse_from(["lines", "--serve", "--tcp=1", "--", "true"]).is_ok());
    }
}
