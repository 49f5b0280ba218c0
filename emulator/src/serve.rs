//! `vimc4 serve`

use std::future::{Future, poll_fn};
use std::io::{self, Write};
use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::process::ExitCode;
use std::sync::Arc;
use std::task::Poll;
use std::thread;
use std::time::Duration;

use clap::ArgAction;
use serde::Serialize;
use tokio::runtime;
use tokio::task::{spawn_blocking, yield_now};
use tokio::time::timeout;
use vimc4::{Builder, Clients, Clock, Control, Emulator, Names, Verbosity, Worker};
use vimc4_timeline::recording::LineSort;

use crate::answers::Answers;
use crate::completions;
use crate::coverage;
use crate::dap::{self, Served};
use crate::endings::Endings;
use crate::failure::Failure;
use crate::here::here;
use crate::identity::{none_twice, profile_files};
use crate::limits;
use crate::log::Log;
use crate::orders::{self, Desk, Next, Typed};
use crate::places::{LISTENS, PTY, counted_up, in_name, link, numbered, of_flash};
use crate::recording::served::ServedDrawing;
use crate::traces;
use crate::typed_options::TypedOptions;
use crate::values::size;
use crate::waves::{Drawn, Sheets};

/// How long the controllers have to end before the program ends without them.
const FAREWELL: Duration = Duration::from_millis(10);

/// How long to wait at the end for answers that are still to be written: they may have no reader.
const STANDSTILL: Duration = Duration::from_millis(500);

/// Exit codes of serving, and how it is begun.
const EXAMPLES: &str = concat!(
    "\
Examples:
  vimc4 serve -v
  vimc4 serve --model imc-s8 --machine mill --flash program.flash
  vimc4 serve --model smcu --machine board-plotter --time 8x
  vimc4 serve --record session.jsonl
  vimc4 serve --time instant --coverage coverage.json
  vimc4 serve --json --time instant --count 8 --until-stdin-closes
  vimc4 serve --web
",
    here!("  VIMC4_LOG=info vimc4 serve\n", "  vimc4 serve --serial COM7\n"),
    "
It answers orders on standard input, such as press stop, position and quit; help lists them.
VIMC4_LOG=warn, info, debug or trace writes what happens to standard error, as structured events.

",
    here!(
        "\
Exit codes: 0 it was ended by quit, by a signal or with standard input, 1 it ended by itself or a file that
it writes is not complete, 2 it could not begin, 131 it was ended by SIGQUIT (Ctrl-\\).",
        "\
Exit codes: 0 it was ended by quit, by Ctrl-C, Ctrl-Break or the end of its window, or with standard
input, 1 it ended by itself or a file that it writes is not complete, 2 it could not begin."
    )
);

#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The model of controller: a name from `vimc4 models`, or a profile file
    #[arg(long, value_name = "NAME|FILE", default_value = "imc4", add = completions::models())]
    pub(crate) model: String,
    /// The machine: a name from `vimc4 machines`, or a profile file
    #[arg(long, value_name = "NAME|FILE", default_value = "bench", add = completions::machines())]
    pub(crate) machine: String,
    /// A pseudo-terminal and a link to it of this name; `none` for no pseudo-terminal. Several controllers get
    /// ./vimc4-1.pty, ./vimc4-2.pty …
    #[arg(long, value_name = "LINK", num_args = 0..=1, default_missing_value = PTY, hide = cfg!(not(unix)))]
    pub(crate) pty: Option<PathBuf>,
    /// Take the link of that name even from an emulator that is still running
    #[arg(long, hide = cfg!(not(unix)))]
    pub(crate) replace: bool,
    /// Listen on this address; `none` for no TCP port, port 0 for a free one. Several controllers
    /// get this port and the following ones
    #[arg(long, value_name = "ADDR", default_value = LISTENS, add = completions::words(&[LISTENS, "127.0.0.1:0", "0.0.0.0:4004", "none"]))]
    pub(crate) tcp: String,
    /// Listen at this address for programs that speak RFC 2217: a serial port with its settings and
    /// modem lines over the network. Several controllers get this port and the following ones
    #[arg(long, value_name = "ADDR", add = completions::words(&["127.0.0.1:2217", "127.0.0.1:0"]))]
    pub(crate) rfc2217: Option<String>,
    /// A real serial port; once for each controller
    #[arg(long, value_name = "DEV")]
    pub(crate) serial: Vec<String>,
    /// How time passes: real, a factor such as 8x or 0.5x, manual (only by `advance` and `run
    /// until …`), or instant (no waiting; a program without an end then uses a whole core)
    #[arg(long, value_name = "CLOCK", default_value_t = Clock::Real, add = completions::words(&["real", "instant", "manual", "8x"]))]
    pub(crate) time: Clock,
    /// Make every character take as long as on a serial line
    #[arg(long)]
    pub(crate) line_pacing: bool,
    #[arg(long, help = concat!(
        "Read bytes as the speeds of both ends of the line have it: a client whose port has the wrong \
         speed hears and sends noise. Its port is ",
        here!("a pseudo-terminal or one of RFC 2217", "one of RFC 2217"),
        ". Includes --line-pacing"
    ))]
    pub(crate) line_physics: bool,
    /// Keep the flash memory in this file, which is created if it does not exist. Several controllers get
    /// NAME-1.EXT, NAME-2.EXT …
    #[arg(long, value_name = "FILE")]
    pub(crate) flash: Option<PathBuf>,
    /// Record everything into this file, which `vimc4 replay` plays; .gz and .zst are compressed when
    /// it ends. Several controllers get NAME-1.EXT, NAME-2.EXT …
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// At the end, add what of the controllers' commands, answers, states and stops was met to this file,
    /// which `vimc4 coverage` shows
    #[arg(long, value_name = "FILE")]
    pub(crate) coverage: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) drawn: Drawn,
    /// Begin another file of the recording, NAME.2.EXT, when one reaches this size, such as 64M
    #[arg(long, value_name = "SIZE", requires = "record", value_parser = size)]
    pub(crate) record_size: Option<u64>,
    /// How many controllers
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    pub(crate) count: u16,
    /// What happens to a second TCP client: refuse it, let it take over, or let it observe
    #[arg(long, value_name = "POLICY", default_value_t = Clients::Refuse, add = completions::words(&["refuse", "takeover", "observe"]))]
    pub(crate) tcp_clients: Clients,
    /// Add the conversation to this file
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<PathBuf>,
    /// Show the conversation as people read it
    #[arg(short, long, action = ArgAction::SetTrue)]
    pub(crate) verbose: bool,
    /// Forget the half line of a client that has left; otherwise it spoils the next client's first
    /// command, as on a real cable
    #[arg(long)]
    pub(crate) fresh_clients: bool,
    /// Wait for an editor at this port of this computer, which attaches to the controllers with the Debug
    /// Adapter Protocol; 0 picks a free one and prints it
    #[arg(long, value_name = "PORT")]
    pub(crate) dap: Option<u16>,
    #[cfg(feature = "api")]
    #[command(flatten)]
    pub(crate) api: crate::api::Arguments,
    /// Print one line of JSON for scripts when ready
    #[arg(long)]
    pub(crate) json: bool,
    /// Let happen what the rules of this file say, as docs/scenarios.md shows; at every controller
    #[arg(long, value_name = "FILE")]
    pub(crate) scenario: Option<PathBuf>,
    /// End when standard input does: a script that starts it and is killed then leaves nothing
    /// behind
    #[arg(long)]
    pub(crate) until_stdin_closes: bool,
}

#[cfg(feature = "api")]
impl Arguments {
    /// Whether requests can be given a debugger: its history follows a controller whose time goes by itself,
    /// and no editor leads the same.
    fn can_be_debugged(&self) -> bool {
        self.dap.is_none() && self.time != Clock::Manual
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Places<'a> {
    ready: bool,
    controllers: Vec<ControllerPlaces<'a>>,
    control: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    dap: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    http: Option<String>,
}

/// Where programs find the controllers as a whole, and what comes from there.
#[derive(Default)]
struct Doors {
    dap: Option<String>,
    #[cfg(feature = "api")]
    api: Option<vimc4_api::Server>,
}

impl Doors {
    fn http(&self) -> Option<String> {
        #[cfg(feature = "api")]
        return self.api.as_ref().map(vimc4_api::Server::url);
        #[cfg(not(feature = "api"))]
        None
    }

    /// Resolves when the end is ordered from there.
    async fn told_to_quit(&self) {
        #[cfg(feature = "api")]
        if let Some(api) = &self.api {
            return api.told_to_quit().await;
        }
        std::future::pending().await
    }
}

#[derive(Serialize)]
struct ControllerPlaces<'a> {
    model: &'a str,
    pty: Option<String>,
    tcp: Option<String>,
    rfc2217: Option<String>,
    serial: Option<&'a str>,
}

impl Arguments {
    /// Refuses options that have no effect beside the others, and files that would replace each other.
    ///
    /// # Errors
    ///
    /// If there is one.
    pub(crate) fn check(&self, typed: &TypedOptions) -> Result<(), Failure> {
        let has_pty = link(self.pty.as_deref(), self.replace).is_some();
        let has_tcp = self.tcp != "none";
        typed.refuse_if(!has_pty, &["replace"], "without a pseudo-terminal")?;
        typed.refuse_if(!has_tcp, &["tcp-clients"], "with --tcp none")?;
        let has_clients = has_pty || has_tcp || self.rfc2217.is_some();
        typed.refuse_if(!has_clients, &["fresh-clients"], "without clients")?;
        self.none_twice()
    }

    /// Refuses files that would replace each other, or what is read.
    fn none_twice(&self) -> Result<(), Failure> {
        let Arguments { record, coverage, flash, log, scenario, drawn, .. } = self;
        let outputs = [record, coverage, flash, log].into_iter().flatten().map(PathBuf::as_path);
        let profiles = profile_files(Some(&self.model), Some(&self.machine));
        let inputs = profiles.chain(scenario.as_deref());
        #[cfg(feature = "api")]
        let inputs = inputs.chain(self.api.token_file());
        none_twice(inputs, outputs.chain(drawn.files()))
    }

    /// Refuses controllers that nothing can reach.
    fn must_be_reachable(&self) -> Result<(), Failure> {
        #[cfg(feature = "api")]
        let has_api = self.api.is_meant();
        #[cfg(not(feature = "api"))]
        let has_api = false;
        let has_port = self.tcp != "none" || self.rfc2217.is_some() || !self.serial.is_empty();
        let has_pty = link(self.pty.as_deref(), self.replace).is_some();
        if has_pty || has_port || has_api || self.dap.is_some() {
            return Ok(());
        }
        Err(Failure::usage(concat!(
            "no program can reach the controller; give ",
            here!("--pty, --tcp, ", "--tcp, "),
            "--rfc2217, --serial, --http or --dap"
        )))
    }
}

pub(crate) fn run(arguments: Arguments, typed: &TypedOptions) -> Result<ExitCode, Failure> {
    arguments.check(typed)?;
    arguments.must_be_reachable()?;
    let log = open_log(&arguments)?;
    if arguments.dap.is_some() && arguments.time == Clock::Manual {
        return Err(Failure::usage(
            "time that is moved by hand has nothing to be paused: --dap goes with --time real, instant or 8x",
        ));
    }
    let debugger = arguments.dap.map(dap::bind).transpose()?;
    #[cfg(feature = "api")]
    let place = crate::api::place(&arguments.api)?;
    let runtime = runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|error| Failure::usage(format!("cannot wait for events: {error}")))?;
    let answers = Answers::begin();
    let end = runtime.block_on(async {
        // From here on the program cannot be ended without its links being removed.
        let mut endings = Endings::listen();
        let (mut emulators, mut drawn) = (Vec::new(), Vec::new());
        let started = tokio::select! {
            biased;
            code = endings.told() => Err(code),
            started = start(&arguments, &log, &mut emulators, &mut drawn) => Ok(started),
        };
        let end = match started {
            Ok(Ok(())) => {
                let open = async {
                    Ok(Doors {
                        dap: debugger
                            .map(|on| let_attach(on, &emulators, log.clone()))
                            .transpose()?,
                        #[cfg(feature = "api")]
                        api: match place {
                            Some(place) => {
                                let can = arguments.can_be_debugged();
                                Some(crate::api::start(place, &emulators, can).await?)
                            }
                            None => None,
                        },
                    })
                };
                match open.await {
                    Ok(doors) => {
                        let ready = announce(&arguments, &emulators, &doors);
                        answers.give(answers.room().await, ready);
                        let waits = arguments.until_stdin_closes;
                        attend(&emulators, &mut endings, &answers, waits, &doors, &log).await
                    }
                    Err(failure) => Err(failure),
                }
            }
            Ok(Err(failure)) => Err(failure),
            Err(code) => Ok(code),
        };
        let names = ServedDrawing::names(&drawn);
        let counted = Counted::of(&arguments, &emulators);
        end_all(emulators, &log, Control::stop_and_leave).await;
        let finish = async {
            let drawn = ServedDrawing::finish_all(drawn).await;
            let kept = counted.keep().and(drawn).and(log.recorded());
            let end = end.and_then(|code| kept.map(|()| code));
            let _ = timeout(STANDSTILL, answers.written()).await;
            end
        };
        tokio::select! {
            biased;
            end = finish => end,
            _ = endings.told() => Err(Failure::midway(format!(
                "ended at once, at the second request{names}"
            ))),
        }
    });
    // Dropping it would drop every controller that has not ended. They leave nothing behind, and
    // the system is quicker.
    std::mem::forget(runtime);
    end
}

/// Lets editors attach to the controllers, and says where.
fn let_attach(listener: TcpListener, emulators: &[Emulator], log: Log) -> Result<String, Failure> {
    let (address, served) = (dap::address(&listener)?, Served::new(emulators));
    thread::Builder::new()
        .name("editors".to_owned())
        .spawn(move || dap::listen(&listener, Some(&served), &move |text| log.say(text)))
        .map_err(|error| Failure::usage(format!("cannot start a thread: {error}")))?;
    Ok(address.to_string())
}

/// The log that the arguments ask for, and the traces that the environment does.
pub(crate) fn open_log(arguments: &Arguments) -> Result<Log, Failure> {
    let log = Log::open(arguments.log.as_deref()).map_err(|error| {
        let path = arguments.log.as_deref().unwrap_or(Path::new("")).display();
        Failure::usage(format!(
            "cannot write the log {path}: {error}; name a file in a folder that can be written to"
        ))
    })?;
    traces::install(&log)?;
    Ok(log)
}

/// Ends all controllers, those that are ready and those of a start that has failed, and leaves
/// nothing behind.
#[cfg(unix)]
pub(crate) async fn finish(
    arguments: &Arguments,
    emulators: Vec<Emulator>,
    drawn: Vec<ServedDrawing>,
    log: &Log,
) -> Result<(), Failure> {
    let counted = Counted::of(arguments, &emulators);
    end_all(emulators, log, Control::stop).await;
    let drawn = ServedDrawing::finish_all(drawn).await;
    counted.keep().and(drawn).and(log.recorded())
}

/// The controllers whose coverage is kept when they have ended, and where.
struct Counted<'a> {
    path: Option<&'a Path>,
    controls: Vec<Control>,
}

impl Counted<'_> {
    fn of<'a>(arguments: &'a Arguments, emulators: &[Emulator]) -> Counted<'a> {
        let path = arguments.coverage.as_deref();
        let controls = emulators.iter().filter(|_| path.is_some());
        Counted { path, controls: controls.map(|emulator| emulator.control().clone()).collect() }
    }

    fn keep(&self) -> Result<(), Failure> {
        let Some(path) = self.path else { return Ok(()) };
        let met = self.controls.iter().filter_map(Control::coverage_so_far);
        coverage::keep(path, met).map_err(Failure::at_the_end)
    }
}

async fn end_all(mut emulators: Vec<Emulator>, log: &Log, stop: fn(&Control)) {
    // A program that looks for a controller must not find one that is about to go.
    for emulator in &mut emulators {
        emulator.unlink();
        stop(emulator.control());
    }
    let _ = timeout(FAREWELL, async {
        for emulator in &emulators {
            let _ = emulator.ended().await;
        }
    })
    .await;
    // Whether or not they have come to an end.
    emulators.into_iter().for_each(Emulator::abandon);
    log.flush();
}

/// Starts all controllers. On an error or a cancellation, those that were started are left to the
/// caller, and so is what draws them.
pub(crate) async fn start(
    arguments: &Arguments,
    log: &Log,
    emulators: &mut Vec<Emulator>,
    drawn: &mut Vec<ServedDrawing>,
) -> Result<(), Failure> {
    let count = arguments.count;
    if !arguments.serial.is_empty() && arguments.serial.len() != usize::from(count) {
        return Err(Failure::usage(format!(
            "{count} controllers cannot share {} serial ports; give --serial once for each",
            arguments.serial.len()
        )));
    }
    limits::allow_open_files(count, threads(count))?;
    limits::check_memory(count)?;
    let workers = workers(count)?;
    let model = vimc4::model(&arguments.model)?;
    let machine = vimc4::machine(&arguments.machine)?;
    // A file that is wrong is found before anything else is touched.
    let scenario = match &arguments.scenario {
        Some(file) => {
            let builder = Emulator::builder().with_model(model.clone());
            let controller = builder.with_machine(Arc::clone(&machine)).record(false).start()?;
            let names = controller.control().names().await.map_err(Failure::midway)?;
            Some(vimc4::scenario_file(file, &names)?)
        }
        None => None,
    };
    if let Some(path) = &arguments.coverage {
        coverage::begin(path, &model)?;
    }
    for (number, worker) in (1..=count).zip(workers.iter().cycle()) {
        let several = (count > 1).then_some(number);
        let mut builder = builder(arguments, number, log)?
            .with_model(model.clone())
            .with_machine(Arc::clone(&machine))
            .on(worker);
        if let Some(sheets) = sheets(&arguments.drawn, several).await? {
            let paced = arguments.line_pacing || arguments.line_physics;
            let sort = if paced { LineSort::Paced } else { LineSort::Ideal };
            let (live, watcher) =
                ServedDrawing::new(&model, &machine, arguments.time, sort, sheets, log)?;
            drawn.push(live);
            builder = builder.sink(watcher);
        }
        let emulator = builder.start()?;
        let control = emulator.control().by("--scenario");
        emulators.push(emulator);
        if let Some(scenario) = &scenario {
            control.scenario(scenario.clone()).await.map_err(Failure::midway)?;
        }
        // Thousands take a while, during which the user may cancel.
        yield_now().await;
    }
    Ok(())
}

/// One of several controllers as the arguments want it, with its ports and files.
fn builder(arguments: &Arguments, number: u16, log: &Log) -> Result<Builder, Failure> {
    let several = (arguments.count > 1).then_some(number);
    let prefix = several.map_or_else(String::new, |number| format!("{number}: "));
    let verbosity = if arguments.verbose { Verbosity::Conversation } else { Verbosity::Warnings };
    let mut builder = Emulator::builder()
        .time(arguments.time)
        .tcp_clients(arguments.tcp_clients)
        .line_pacing(arguments.line_pacing)
        .line_physics(arguments.line_physics)
        .fresh_clients(arguments.fresh_clients)
        .record(false)
        .coverage(arguments.coverage.is_some())
        .name(number.to_string())
        .sink(log.terminal(verbosity, prefix.clone()));
    if arguments.log.is_some() {
        builder = builder.sink(log.file(prefix));
    }
    if let Some(link) = link(arguments.pty.as_deref(), arguments.replace) {
        builder = builder.pty(numbered(&link, several)).replace_link(arguments.replace);
    }
    if arguments.tcp != "none" {
        builder = builder.tcp(counted_up(&arguments.tcp, number - 1)?);
    }
    if let Some(address) = &arguments.rfc2217 {
        builder = builder.rfc2217(counted_up(address, number - 1)?);
    }
    if let Some(device) = arguments.serial.get(usize::from(number) - 1) {
        builder = builder.serial(device);
    }
    if let Some(file) = &arguments.flash {
        builder = builder.flash(of_flash(file, several)?);
    }
    if let Some(file) = &arguments.record {
        let file = recording(file, in_name(file, several)?);
        builder = builder.record(file).recorded_by("serve");
        let log = log.clone();
        builder = builder.on_recording_error(move |error| log.recording_failed(error));
        if let Some(size) = arguments.record_size {
            builder = builder.record_size(size);
        }
    }
    Ok(builder)
}

/// Opens what a controller is drawn on, which may wait for whoever reads a pipe: meanwhile the user may cancel.
async fn sheets(drawn: &Drawn, number: Option<u16>) -> Result<Option<Sheets>, Failure> {
    if drawn.files().next().is_none() {
        return Ok(None);
    }
    let drawn = drawn.clone();
    spawn_blocking(move || drawn.open(number)).await.map_err(Failure::midway)?
}

/// The threads that the controllers share, this one first: no more than there are processors to
/// run them.
fn workers(controllers: u16) -> Result<Vec<Worker>, Failure> {
    let mut workers = vec![Worker::here()];
    for _ in 1..threads(controllers) {
        workers.push(Worker::start("vimc4").map_err(|error| {
            Failure::usage(format!(
                "cannot start a thread: {error}; end other programs, or raise the limit of \
                 processes"
            ))
        })?);
    }
    Ok(workers)
}

fn threads(controllers: u16) -> usize {
    let processors = thread::available_parallelism().map_or(1, usize::from);
    processors.min(usize::from(controllers))
}

/// `rec.jsonl.gz` becomes `rec-2.jsonl.gz` for the second of several.
fn recording(path: &Path, number: Option<u16>) -> PathBuf {
    let (Some(number), Some(name)) = (number, path.file_name()) else { return path.to_owned() };
    let name = name.to_string_lossy();
    // A name that begins with a point has no ending.
    let dot = name.char_indices().skip(1).find(|(_, c)| *c == '.').map_or(name.len(), |(at, _)| at);
    let (stem, ending) = name.split_at(dot);
    path.with_file_name(format!("{stem}-{number}{ending}"))
}

/// Where the controllers are, and that they are ready; what is to be known besides is said.
fn announce(arguments: &Arguments, emulators: &[Emulator], doors: &Doors) -> String {
    let pty = |emulator: &Emulator| emulator.port().map(|path| path.display().to_string());
    let tcp = |emulator: &Emulator| emulator.tcp_addr().map(|address| address.to_string());
    let rfc2217 = |emulator: &Emulator| emulator.rfc2217_addr().map(|address| address.to_string());
    let mut text = String::new();
    if arguments.json {
        let controllers = emulators.iter().map(|emulator| ControllerPlaces {
            model: emulator.model().name(),
            pty: pty(emulator),
            tcp: tcp(emulator),
            rfc2217: rfc2217(emulator),
            serial: emulator.serial(),
        });
        let controllers = controllers.collect();
        let (dap, http) = (doors.dap.clone(), doors.http());
        let places = Places { ready: true, controllers, control: None, dap, http };
        // A structure of strings can always be written.
        text.push_str(&serde_json::to_string(&places).unwrap_or_default());
        text.push('\n');
    } else {
        for (number, emulator) in (1..).zip(emulators) {
            let prefix = if emulators.len() > 1 { format!("{number} ") } else { String::new() };
            let serial = emulator.serial().map(str::to_owned);
            let places = [
                ("pty", pty(emulator)),
                ("tcp", tcp(emulator)),
                ("rfc2217", rfc2217(emulator)),
                ("serial", serial),
            ];
            for (kind, place) in places {
                if let Some(place) = place {
                    text.push_str(&format!("{prefix}{kind} {place}\n"));
                }
            }
        }
        if let Some(address) = &doors.dap {
            text.push_str(&format!("dap {address}\n"));
        }
        if let Some(url) = doors.http() {
            text.push_str(&format!("http {url}\n"));
        }
        text.push_str("ready\n");
    }
    let waits =
        |emulator: &&Emulator| emulator.port().is_some() && emulator.model().has_handshake_lines();
    if let Some(emulator) = emulators.iter().find(waits) {
        let _ = writeln!(
            io::stderr(),
            "The pseudo-terminal has no modem lines. A program that waits for CTS of the {} needs TCP, \
             a serial port, or `vimc4 lines --serve`.",
            emulator.model().name()
        );
    }
    let addresses = |emulator: &Emulator| [emulator.tcp_addr(), emulator.rfc2217_addr()];
    let mut addresses = emulators.iter().flat_map(addresses).flatten();
    if let Some(address) = addresses.find(is_open_to_others) {
        let _ = writeln!(
            io::stderr(),
            "{address} is open to everybody who reaches this computer over a network, and whoever \
             connects drives the machine; 127.0.0.1 is open to this computer only"
        );
    }
    text
}

/// Whether other computers can connect.
fn is_open_to_others(address: &SocketAddr) -> bool {
    !address.ip().to_canonical().is_loopback()
}

/// Carries out typed orders until the end is requested.
async fn attend(
    emulators: &[Emulator],
    endings: &mut Endings,
    answers: &Answers,
    until_stdin_closes: bool,
    doors: &Doors,
    log: &Log,
) -> Result<ExitCode, Failure> {
    let names = match emulators.first() {
        Some(emulator) => emulator.control().names().await.map_err(Failure::midway)?,
        None => Names::default(),
    };
    let mut lines = orders::read();
    let mut desk = Desk::new(emulators, &names);
    let (mut typing, mut ending) = (true, false);
    let mut running = RunningControllers::of(emulators);
    loop {
        tokio::select! {
            code = endings.told() => return running.outcome().map(|()| code),
            () = doors.told_to_quit(), if !ending => ending = true,
            () = running.all_end(log) => return running.outcome().map(|()| ExitCode::SUCCESS),
            // Where there is no room for another answer it stays with the desk.
            (room, answer) = async { (answers.room().await, desk.answer().await) }, if !desk.is_empty() => {
                answers.give(room, answer);
            }
            () = answers.written(), if ending && desk.is_empty() => {
                return running.outcome().map(|()| ExitCode::SUCCESS);
            }
            line = lines.recv(), if typing && desk.has_room() => match line {
                // The end of the input is not the end of the controllers, unless it is to be.
                None => {
                    typing = false;
                    if until_stdin_closes {
                        ending = true;
                        desk.leave();
                    }
                }
                Some(Typed::TooLong(beginning)) => desk.refuse(&beginning),
                Some(Typed::Line(line)) => match desk.take(&line) {
                    Next::Continue => {}
                    Next::Quit => {
                        // A second request leaves no time for pending work.
                        if ending {
                            desk.give_up();
                        }
                        ending = true;
                    }
                },
            },
        }
    }
}

/// The controllers that run. One ends by itself only if its flash file can no longer be written; the
/// others go on.
pub(crate) struct RunningControllers {
    ends: Vec<(usize, End)>,
    count: usize,
    failure: Option<Failure>,
}

/// Resolves when a controller has ended.
type End = Pin<Box<dyn Future<Output = Result<(), vimc4::Error>> + Send>>;

impl RunningControllers {
    pub(crate) fn of(emulators: &[Emulator]) -> RunningControllers {
        let ends = (1..).zip(emulators).map(|(number, of)| (number, Box::pin(of.end()) as End));
        RunningControllers { ends: ends.collect(), count: emulators.len(), failure: None }
    }

    /// Says which controllers end, and resolves when the last one has.
    pub(crate) async fn all_end(&mut self, log: &Log) {
        poll_fn(|cx| {
            let before = self.ends.len();
            self.ends.retain_mut(|(number, end)| {
                let Poll::Ready(end) = end.as_mut().poll(cx) else { return true };
                if let Err(error) = end {
                    if self.count > 1 {
                        log.say(&format!(
                            "controller {number} has ended, the others go on: {error}"
                        ));
                    }
                    self.failure.get_or_insert_with(|| Failure::midway(error));
                }
                false
            });
            if self.ends.is_empty() && before > 0 { Poll::Ready(()) } else { Poll::Pending }
        })
        .await;
    }

    /// Why a controller has ended by itself, if one has.
    pub(crate) fn outcome(&mut self) -> Result<(), Failure> {
        self.failure.take().map_or(Ok(()), Err)
    }
}
