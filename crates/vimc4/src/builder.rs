//! Setting an emulator up.

use std::fmt;
use std::io::{self, Write};
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::sync::watch;
use vimc4_catalogue::{Controller, Handling, Machine, Model};
use vimc4_device::{Line, Names};
#[cfg(feature = "serial")]
use vimc4_host::Serial;
use vimc4_host::{
    Clients, Clock, FlashFile, Handle, Runner, Sink, Tcp, TcpError, Worker, unix_lines,
};
#[cfg(all(unix, feature = "pty"))]
use vimc4_host::{Pty, PtyLink};

use vimc4_journal::Picture;

use crate::control::Control;
use crate::coverage::Tally;
use crate::emulator::{Emulator, Kept, Places};
use crate::error::Error;
use crate::profiles;
use crate::record::Record;
use crate::recording::{About, OnError, Order, Recorder, RecordingFile};

/// Sets an [`Emulator`] up; see there.
#[must_use = "an emulator runs when it is started"]
pub struct Builder {
    model: Profile<Model>,
    machine: Profile<Arc<Machine>>,
    time: Clock,
    pty: Terminal,
    replace: bool,
    fresh_clients: bool,
    tcp: Option<String>,
    rfc2217: Option<String>,
    clients: Clients,
    serial: Option<String>,
    flash: Option<PathBuf>,
    line_pacing: bool,
    line_physics: bool,
    paused: bool,
    record: bool,
    coverage: bool,
    recording: Option<Recording>,
    name: Option<String>,
    sinks: Vec<Box<dyn Sink>>,
    worker: Option<Worker>,
}

/// A profile by name or file, or the thing itself.
enum Profile<T> {
    Named(String),
    Given(T),
}

/// Whether an emulator has a pseudo-terminal, and under which name. See [`Builder::pty`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Terminal {
    /// It has none.
    #[default]
    Off,
    /// It has one, whose name the system chooses.
    Unnamed,
    /// It has one, and this link leads to it.
    Link(PathBuf),
}

/// Which record is kept. See [`Builder::record`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Records {
    /// Whether commands and events are remembered.
    Memory(bool),
    /// A file into which everything is recorded.
    File(PathBuf),
}

impl From<bool> for Records {
    fn from(on: bool) -> Records {
        Records::Memory(on)
    }
}

impl From<&str> for Records {
    fn from(file: &str) -> Records {
        Records::File(PathBuf::from(file))
    }
}

impl From<&Path> for Records {
    fn from(file: &Path) -> Records {
        Records::File(file.to_owned())
    }
}

impl From<PathBuf> for Records {
    fn from(file: PathBuf) -> Records {
        Records::File(file)
    }
}

/// The requested recording.
#[derive(Default)]
struct Recording {
    path: PathBuf,
    size: Option<u64>,
    /// Empty for the library.
    from: String,
    failed_only: bool,
    tell: Option<OnError>,
}

impl Recording {
    fn begin(self, about: &About<'_>, names: Names) -> Result<Kept, Error> {
        let Recording { path, size, from, failed_only, tell } = self;
        let from = if from.is_empty() { "library".to_owned() } else { from };
        let tell =
            tell.unwrap_or_else(|| Box::new(|error: &str| drop(writeln!(io::stderr(), "{error}"))));
        let file = RecordingFile::begin(Order { path, size, from, tell }, about, names)?;
        Ok(Kept { file, failed_only })
    }
}

impl From<bool> for Terminal {
    fn from(on: bool) -> Terminal {
        if on { Terminal::Unnamed } else { Terminal::Off }
    }
}

impl From<&str> for Terminal {
    fn from(link: &str) -> Terminal {
        Terminal::Link(PathBuf::from(link))
    }
}

impl From<&Path> for Terminal {
    fn from(link: &Path) -> Terminal {
        Terminal::Link(link.to_owned())
    }
}

impl From<PathBuf> for Terminal {
    fn from(link: PathBuf) -> Terminal {
        Terminal::Link(link)
    }
}

impl Emulator {
    /// Sets one up. By default it is an IMC4 on the machine `bench` in real time, reachable from
    /// within the process only.
    pub fn builder() -> Builder {
        Builder::new()
    }
}

impl Builder {
    fn new() -> Builder {
        Builder {
            model: Profile::Named("imc4".to_owned()),
            machine: Profile::Named("bench".to_owned()),
            time: Clock::Real,
            pty: Terminal::Off,
            replace: false,
            fresh_clients: false,
            tcp: None,
            rfc2217: None,
            clients: Clients::Refuse,
            serial: None,
            flash: None,
            line_pacing: false,
            line_physics: false,
            paused: false,
            record: true,
            coverage: false,
            recording: None,
            name: None,
            sinks: Vec::new(),
            worker: None,
        }
    }

    /// The model of controller: a built-in name or a profile file. The default is `imc4`.
    pub fn model(mut self, name_or_file: impl Into<String>) -> Builder {
        self.model = Profile::Named(name_or_file.into());
        self
    }

    /// The machine: a built-in name or a profile file. The default is `bench`, a machine without
    /// ends.
    pub fn machine(mut self, name_or_file: impl Into<String>) -> Builder {
        self.machine = Profile::Named(name_or_file.into());
        self
    }

    /// A model that was made or changed in the program.
    pub fn with_model(mut self, model: Model) -> Builder {
        self.model = Profile::Given(model);
        self
    }

    /// A machine that was made or changed in the program.
    pub fn with_machine(mut self, machine: Arc<Machine>) -> Builder {
        self.machine = Profile::Given(machine);
        self
    }

    /// How time passes. The default is [`Clock::Real`].
    pub fn time(mut self, clock: Clock) -> Builder {
        self.time = clock;
        self
    }

    /// A pseudo-terminal: `true` for one of any name, a path for a link that leads to it.
    pub fn pty(mut self, terminal: impl Into<Terminal>) -> Builder {
        self.pty = terminal.into();
        self
    }

    /// Whether the link to the pseudo-terminal may be taken from an emulator that is still running.
    /// By default it may not.
    pub fn replace_link(mut self, on: bool) -> Builder {
        self.replace = on;
        self
    }

    /// Whether the half line of a client that has left is forgotten, so that it does not spoil the
    /// first command of the next client. By default it is kept, as on a real cable.
    pub fn fresh_clients(mut self, on: bool) -> Builder {
        self.fresh_clients = on;
        self
    }

    /// An address to listen on, such as `127.0.0.1:4004`; port 0 picks a free one.
    pub fn tcp(mut self, address: impl Into<String>) -> Builder {
        self.tcp = Some(address.into());
        self
    }

    /// Listens at this address for clients that speak RFC 2217: a serial port with its settings and
    /// modem lines over the network, as `rfc2217://` of pyserial. Port 0 picks a free one.
    pub fn rfc2217(mut self, address: impl Into<String>) -> Builder {
        self.rfc2217 = Some(address.into());
        self
    }

    /// What happens to a second TCP client. By default it is refused.
    pub fn tcp_clients(mut self, policy: Clients) -> Builder {
        self.clients = policy;
        self
    }

    /// A real serial port, such as `/dev/ttyUSB0`.
    #[cfg(feature = "serial")]
    pub fn serial(mut self, device: impl Into<String>) -> Builder {
        self.serial = Some(device.into());
        self
    }

    /// A file for the flash memory, created if it does not exist. Without one the memory is lost
    /// when the emulator ends.
    pub fn flash(mut self, file: impl Into<PathBuf>) -> Builder {
        self.flash = Some(file.into());
        self
    }

    /// Whether a character takes its time on the line, in model time.
    pub fn line_pacing(mut self, on: bool) -> Builder {
        self.line_pacing = on;
        self
    }

    /// Whether bytes are read as the speeds of both ends of the line have it: what a client sends with
    /// its port at 9,600 baud is read at the controller's speed bit by bit, and so is what comes back. By
    /// default every client is understood, and a warning says that a real controller would hear noise.
    /// The port of a client is a pseudo-terminal or one of RFC 2217; its speed is looked at when it opens
    /// the line and whenever it sends. Includes [`line_pacing`](Builder::line_pacing).
    pub fn line_physics(mut self, on: bool) -> Builder {
        self.line_physics = on;
        self
    }

    /// Whether its time is paused from the first moment on, until [`Emulator::resume`]. Clients can
    /// connect; what they send waits on the line. If it is paused only later, a client may be
    /// quicker.
    pub fn paused(mut self, on: bool) -> Builder {
        self.paused = on;
        self
    }

    /// Which record is kept. With `true` or `false`, whether [`Emulator::commands`] and
    /// [`Emulator::events`] remember anything: they do by default; an emulator that runs for days
    /// may do without. With a path, everything is recorded into that file besides, as
    /// `docs/recordings.md` says: `vimc4 replay` plays it. An existing file is not overwritten.
    pub fn record(mut self, what: impl Into<Records>) -> Builder {
        match what.into() {
            Records::Memory(on) => self.record = on,
            Records::File(path) => self.recording().path = path,
        }
        self
    }

    /// Whether it counts what of its protocol the host meets, for [`Emulator::coverage`]. By default it
    /// does not, and costs nothing.
    pub fn coverage(mut self, on: bool) -> Builder {
        self.coverage = on;
        self
    }

    /// Records everything into a file that stays only if the test fails: if the thread that drops the
    /// emulator is panicking. Otherwise it is removed then.
    pub fn record_failure(mut self, path: impl Into<PathBuf>) -> Builder {
        let recording = self.recording();
        (recording.path, recording.failed_only) = (path.into(), true);
        self
    }

    /// The approximate maximum size of a file of the recording, in bytes; beyond it another file is
    /// started, which has a number in its name and can be played on its own. Without it there is no
    /// limit.
    pub fn record_size(mut self, bytes: u64) -> Builder {
        self.recording().size = Some(bytes);
        self
    }

    /// What the recording names as its maker; `library` unless it is set.
    pub fn recorded_by(mut self, who: impl Into<String>) -> Builder {
        self.recording().from = who.into();
        self
    }

    /// Calls `tell` with a message for people when the recording can no longer be written. Unless
    /// it is set, the message goes to standard error.
    pub fn on_recording_error(mut self, tell: impl FnMut(&str) + Send + 'static) -> Builder {
        self.recording().tell = Some(Box::new(tell));
        self
    }

    fn recording(&mut self) -> &mut Recording {
        self.recording.get_or_insert_with(Recording::default)
    }

    /// Its name in its [reports](crate::Report). Without a name it has a number, which is unique
    /// within the process.
    pub fn name(mut self, name: impl Into<String>) -> Builder {
        self.name = Some(name.into());
        self
    }

    /// A sink that watches from the first moment.
    pub fn sink(mut self, sink: impl Sink + 'static) -> Builder {
        self.sinks.push(Box::new(sink));
        self
    }

    /// A thread that it shares with other emulators. By default it has its own, so that other
    /// emulators cannot delay it; hundreds of quiet ones had better share one.
    pub fn on(mut self, worker: &Worker) -> Builder {
        self.worker = Some(worker.clone());
        self
    }

    /// Starts the emulator.
    ///
    /// # Errors
    ///
    /// If a name, an address or a file is wrong or taken. In that case nothing has changed.
    pub fn start(self) -> Result<Emulator, Error> {
        let model = match &self.model {
            Profile::Named(name) => profiles::model(name)?,
            Profile::Given(model) => model.clone(),
        };
        let machine = match &self.machine {
            Profile::Named(name) => profiles::machine(name)?,
            Profile::Given(machine) => Arc::clone(machine),
        };
        #[cfg(all(unix, feature = "pty"))]
        if let Terminal::Link(path) = &self.pty {
            PtyLink::check(path, self.replace)?;
        }
        #[cfg(not(all(unix, feature = "pty")))]
        if self.pty != Terminal::Off {
            return Err(Error::NoPty);
        }
        let addresses = |name: &Option<String>| match name {
            Some(name) => resolve(name),
            None => Ok(Vec::new()),
        };
        let addresses = [addresses(&self.tcp)?, addresses(&self.rfc2217)?];
        #[cfg(all(unix, feature = "pty"))]
        let (pty, replace) = (self.pty.clone(), self.replace);

        let worker = match &self.worker {
            Some(worker) => worker.clone(),
            None => Worker::start(&format!("vimc4 {}", model.name())).map_err(Error::Start)?,
        };
        let tally = self.coverage.then(|| Tally::new(&model));
        let (made, record, recording) = {
            let _inside = worker.enter();
            self.assemble(&model, Arc::clone(&machine), &addresses, tally.as_ref())?
        };
        let (runner, handle, places) = made;
        let (over, ended) = watch::channel(None);
        // Boxed, because a task is made room for as what it begins with and as what it becomes.
        let life = Box::pin(runner.run());
        worker.spawn(async move {
            let end = life.await;
            // Nobody may be interested.
            let _ = over.send(Some(end.map_err(Arc::new)));
        });
        let control = Control::new(model, machine, handle, record, tally);
        #[cfg_attr(
            not(all(unix, feature = "pty")),
            expect(unused_mut, reason = "there are no links")
        )]
        let mut emulator = Emulator::new(control, places, ended, worker, recording);
        #[cfg(all(unix, feature = "pty"))]
        if let Terminal::Link(path) = &pty {
            emulator.link_to(path, replace)?;
        }
        Ok(emulator)
    }

    /// Opens everything and puts it together, in an order in which a failure leaves nothing
    /// behind: what others could miss first, what creates files last.
    fn assemble(
        self,
        model: &Model,
        machine: Arc<Machine>,
        [tcp, rfc2217]: &[Vec<SocketAddr>; 2],
        tally: Option<&Tally>,
    ) -> Result<(Made, Option<Record>, Option<Kept>), Error> {
        let mut places = Places::default();
        let tcp = listen(tcp, |address| Tcp::bind(address, self.clients))?;
        places.tcp = tcp.as_ref().map(Tcp::address);
        let rfc2217 = listen(rfc2217, |address| Tcp::bind_rfc2217(address, self.clients))?;
        places.rfc2217 = rfc2217.as_ref().map(Tcp::address);
        #[cfg(feature = "serial")]
        let serial =
            self.serial.as_deref().map(|path| Serial::open(path, model.baud())).transpose()?;
        places.serial = self.serial;
        #[cfg(all(unix, feature = "pty"))]
        let pty = match self.pty {
            Terminal::Off => None,
            _ => Some(Pty::open(model.baud())?),
        };
        #[cfg(all(unix, feature = "pty"))]
        {
            places.pty = pty.as_ref().map(|pty| pty.path().to_owned());
        }
        let flash = self.flash.map(FlashFile::open).transpose()?;
        let image = flash.as_ref().map_or(&[] as &[u8], |(_, image)| image);
        let controller =
            Controller::new(model, Arc::clone(&machine), &unix_lines(image)).map_err(|source| {
                let path = flash.as_ref().map(|(file, _)| file.path().to_owned());
                Error::Flash { path: path.unwrap_or_default(), source }
            })?;
        let paced = self.line_pacing || self.line_physics;
        let line = if paced { Line::paced(controller) } else { Line::ideal(controller) };
        let (runner, handle) = Handle::pair(line, self.time);
        let handling = Handling::of(model);
        let name = self.name.unwrap_or_else(next_number);
        let mut runner = runner.named(&name).with_lines(handling.ends, self.fresh_clients);
        runner = runner.with_line_physics(self.line_physics);
        if let Some((ends, right)) = handling.instead_of_line_feed {
            runner = runner.with_line_feeds(ends, right);
        }
        if let Some((file, image)) = flash {
            runner = runner.with_flash(file, &image)?;
        }
        // In this order it is sent to them. A pseudo-terminal can be opened at any moment, also
        // by a client that has just heard the answer on TCP and must not hear it again there.
        #[cfg(all(unix, feature = "pty"))]
        if let Some(pty) = pty {
            runner.attach(Box::new(pty));
        }
        #[cfg(feature = "serial")]
        if let Some(serial) = serial {
            runner.attach(Box::new(serial));
        }
        for tcp in [tcp, rfc2217].into_iter().flatten() {
            runner.attach(Box::new(tcp));
        }
        #[cfg(feature = "tracing")]
        if let Some(traces) = vimc4_host::Traces::new(&name) {
            traces.begin(model.name(), &machine.name, &self.time);
            places.trace(&traces);
            runner.watch(Box::new(traces));
        }
        let record = self.record.then(|| Record::new(Picture::of(runner.device())));
        if let Some(record) = &record {
            runner.watch(Box::new(record.recorder()));
        }
        if let Some(tally) = tally {
            runner.watch(Box::new(tally.counter()));
        }
        for sink in self.sinks {
            runner.watch(sink);
        }
        let recording = self.recording.filter(|asked| !asked.path.as_os_str().is_empty());
        let kept = recording
            .map(|recording| {
                let clock = self.time.to_string();
                let about = About { model, machine: &machine, clock, paced, controller: name };
                recording.begin(&about, Names::of(runner.device()))
            })
            .transpose()?;
        if let Some(kept) = &kept {
            runner.watch(Box::new(Recorder(kept.file.clone())));
        }
        if self.paused {
            runner.begin_paused("the library");
        }
        Ok(((runner, handle, places), record, kept))
    }
}

type Made = (Runner<Line<Controller>>, Handle<Line<Controller>>, Places);

/// The name of an emulator without one.
fn next_number() -> String {
    static STARTED: AtomicU64 = AtomicU64::new(1);
    STARTED.fetch_add(1, Ordering::Relaxed).to_string()
}

fn resolve(address: &str) -> Result<Vec<SocketAddr>, Error> {
    let failed = |source| Error::Address { address: address.to_owned(), source };
    let addresses: Vec<_> = address.to_socket_addrs().map_err(failed)?.collect();
    if addresses.is_empty() {
        return Err(failed(std::io::Error::other("no address belongs to this name")));
    }
    Ok(addresses)
}

/// Listens at the first address of a name that can be listened on.
fn listen(
    addresses: &[SocketAddr],
    bind: impl Fn(SocketAddr) -> Result<Tcp, TcpError>,
) -> Result<Option<Tcp>, Error> {
    let mut failure = None;
    for &address in addresses {
        match bind(address) {
            Ok(tcp) => return Ok(Some(tcp)),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    failure.map_or(Ok(None), |error| Err(error.into()))
}

impl fmt::Debug for Builder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Builder")
            .field("time", &self.time)
            .field("pty", &self.pty)
            .field("tcp", &self.tcp)
            .field("rfc2217", &self.rfc2217)
            .field("serial", &self.serial)
            .field("flash", &self.flash)
            .finish_non_exhaustive()
    }
}
