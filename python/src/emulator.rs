//! The emulator: what is asked of it comes back as a [`Pending`].

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::{Arc, Mutex, OnceLock};

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use vimc4::device::Device;
use vimc4::{
    BreakpointId, Clock, Condition, Control, Effect, Emulator, HostCommand, HostLines, Names,
    Order, Pause, Signal, SignalKind, SinkId, Step, Terminal, Time, Traffic, Verbosity,
};

use crate::convert::{event, plain, span, typed};
use crate::harness::Harness;
use crate::pending::{Journey, Pending};
use crate::port::Port;
use crate::reports::Reports;
use crate::waiting::{answer, lock};
use crate::{error, profiles};

/// How many lines of the conversation are remembered.
const LINES: usize = 10_000;

/// A running emulator; `vimc4.Emulator` is what programmers see of it.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Core {
    emulator: Mutex<Option<Emulator>>,
    control: Control,
    names: OnceLock<Names>,
    conversation: Arc<Mutex<VecDeque<String>>>,
    recording_errors: Arc<Mutex<Vec<String>>>,
    /// The process that it runs in.
    process: u32,
    recording: Option<vimc4::RecordingFile>,
    places: Places,
}

/// Where it can be reached.
struct Places {
    port: Option<PathBuf>,
    tcp: Option<SocketAddr>,
    rfc2217: Option<SocketAddr>,
    serial: Option<String>,
}

/// The state of an emulator at one instant.
#[pyclass(frozen, eq, module = "vimc4._vimc4")]
#[derive(PartialEq)]
pub(crate) struct Snapshot(vimc4::Snapshot);

/// A thread that emulators share.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Worker(vimc4::Worker);

/// The file into which an emulator is recorded.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Recording(vimc4::RecordingFile);

#[pymethods]
impl Core {
    #[new]
    #[pyo3(signature = (
        *, model, machine, time, pty, replace_link, fresh_clients, tcp, rfc2217, tcp_clients,
        serial, flash, line_pacing, paused, record, recording, record_size, recorded_by, name, on,
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are the options of the builder, by name")]
    fn new(
        py: Python<'_>,
        model: &Bound<'_, PyAny>,
        machine: &Bound<'_, PyAny>,
        time: &str,
        pty: &Bound<'_, PyAny>,
        replace_link: bool,
        fresh_clients: bool,
        tcp: Option<String>,
        rfc2217: Option<String>,
        tcp_clients: &str,
        serial: Option<String>,
        flash: Option<PathBuf>,
        line_pacing: bool,
        paused: bool,
        record: bool,
        recording: Option<PathBuf>,
        record_size: Option<u64>,
        recorded_by: &str,
        name: Option<String>,
        on: Option<&Bound<'_, Worker>>,
    ) -> PyResult<Core> {
        let wrong = |error: String| PyValueError::new_err(error);
        let clock = Clock::from_str(time).map_err(|error| wrong(error.to_string()))?;
        let terminal = match pty.extract::<bool>() {
            Ok(wanted) => Terminal::from(wanted),
            Err(_) => Terminal::Link(pty.extract::<PathBuf>()?),
        };
        let mut builder = Emulator::builder()
            .with_model(profiles::the_model(model)?)
            .with_machine(profiles::the_machine(machine)?)
            .time(clock)
            .pty(terminal)
            .replace_link(replace_link)
            .fresh_clients(fresh_clients)
            .tcp_clients(tcp_clients.parse().map_err(wrong)?)
            .line_pacing(line_pacing)
            .paused(paused)
            .record(record);
        if let Some(address) = tcp {
            builder = builder.tcp(address);
        }
        if let Some(address) = rfc2217 {
            builder = builder.rfc2217(address);
        }
        if let Some(device) = serial {
            builder = builder.serial(device);
        }
        if let Some(file) = flash {
            builder = builder.flash(file);
        }
        if let Some(name) = name {
            builder = builder.name(name);
        }
        if let Some(worker) = on {
            builder = builder.on(&worker.get().0);
        }
        let recording_errors = Arc::new(Mutex::new(Vec::new()));
        if let Some(file) = recording {
            let tell = Arc::clone(&recording_errors);
            builder = builder
                .record(file)
                .recorded_by(recorded_by)
                .on_recording_error(move |text: &str| lock(&tell).push(text.to_owned()));
            if let Some(bytes) = record_size {
                builder = builder.record_size(bytes);
            }
        }
        let conversation = Arc::new(Mutex::new(VecDeque::new()));
        if record {
            let lines = Arc::clone(&conversation);
            builder = builder.sink(Traffic::new(Verbosity::Conversation, move |line| {
                let mut lines = lock(&lines);
                if lines.len() == LINES {
                    lines.pop_front();
                }
                lines.push_back(line);
            }));
        }
        let emulator = py.detach(|| builder.start()).map_err(|error| error::of(py, &error))?;
        let places = Places {
            port: emulator.port().map(PathBuf::from),
            tcp: emulator.tcp_addr(),
            rfc2217: emulator.rfc2217_addr(),
            serial: emulator.serial().map(str::to_owned),
        };
        Ok(Core {
            control: emulator.control().clone(),
            recording: emulator.recording().cloned(),
            emulator: Mutex::new(Some(emulator)),
            process: std::process::id(),
            names: OnceLock::new(),
            conversation,
            recording_errors,
            places,
        })
    }

    /// Ends it and waits for that.
    fn close(&self, py: Python<'_>) {
        py.detach(|| self.end());
    }

    #[getter]
    fn closed(&self) -> bool {
        lock(&self.emulator).is_none()
    }

    #[getter]
    fn model(&self) -> &str {
        self.control.model().name()
    }

    #[getter]
    fn baud(&self) -> u32 {
        self.control.model().baud()
    }

    #[getter]
    fn port(&self) -> Option<PathBuf> {
        self.places.port.clone()
    }

    #[getter]
    fn tcp(&self) -> Option<(String, u16)> {
        self.places.tcp.map(host_and_port)
    }

    #[getter]
    fn rfc2217(&self) -> Option<(String, u16)> {
        self.places.rfc2217.map(host_and_port)
    }

    #[getter]
    fn serial(&self) -> Option<&str> {
        self.places.serial.as_deref()
    }

    #[getter]
    fn recording(&self) -> Option<Recording> {
        self.recording.clone().map(Recording)
    }

    /// What went wrong with the recording since this was asked last.
    fn take_recording_errors(&self) -> Vec<String> {
        std::mem::take(&mut lock(&self.recording_errors))
    }

    fn unlink(&self) {
        if let Some(emulator) = &mut *lock(&self.emulator) {
            emulator.unlink();
        }
    }

    fn stop(&self) {
        self.control.stop();
    }

    /// Answers when it has ended, with the error if it has by itself.
    fn ended(&self) -> Pending {
        // What outlives the emulator looks whether it still answers.
        let ended = lock(&self.emulator).as_ref().map(Emulator::end);
        let end = async {
            match ended {
                Some(end) => end.await,
                None => Ok(()),
            }
        };
        Pending::new(end, |py, end| match end {
            Ok(()) => Ok(py.None()),
            Err(error) => Err(error::of(py, &error)),
        })
    }

    fn connect(&self) -> Pending {
        let clear = Arc::new(crate::port::Clear::default());
        let tell = Arc::clone(&clear);
        let control = self.control.clone();
        let ports = self.control.connect_with_lines(move |cts| tell.set(cts));
        Pending::of(ports, move |py, (port, lines): (vimc4::MemoryPort, HostLines)| {
            Ok(Py::new(py, Port::new(port, lines, clear, control))?.into_any())
        })
    }

    // --- time ---

    fn now(&self) -> Pending {
        Pending::of(self.control.now(), time)
    }

    fn advance(&self, py: Python<'_>, by: &Bound<'_, PyAny>) -> PyResult<Py<Journey>> {
        Pending::journey(py, self.control.advance(span(by)?))
    }

    fn run_until(&self, py: Python<'_>, condition: &str) -> PyResult<Py<Journey>> {
        let condition = self.condition(py, condition)?;
        Pending::journey(py, self.control.run_until(condition))
    }

    fn cancel_all(&self) {
        self.control.cancel_all();
    }

    // --- what it sees ---

    fn position(&self) -> Pending {
        Pending::of(self.control.position(), |py, axes| Ok(axes.into_pyobject(py)?.unbind()))
    }

    fn view(&self) -> Pending {
        Pending::of(self.control.view(), |py, view| Ok(plain(py, &view)?.unbind()))
    }

    fn commands(&self) -> Pending {
        Pending::of(self.control.commands(), |py, commands| {
            let list: PyResult<Vec<_>> = commands.into_iter().map(|one| command(py, one)).collect();
            Ok(list?.into_pyobject(py)?.unbind())
        })
    }

    fn next_command(&self, mnemonic: &str) -> Pending {
        Pending::of(self.control.next_command(mnemonic), command)
    }

    fn events(&self) -> Pending {
        Pending::of(self.control.events(), |py, events| {
            let list: PyResult<Vec<_>> =
                events.iter().map(|(stamp, happened)| event(py, *stamp, happened)).collect();
            Ok(list?.into_pyobject(py)?.unbind())
        })
    }

    /// The conversation, when what was sent before has arrived.
    fn conversation(&self) -> Pending {
        let lines = Arc::clone(&self.conversation);
        Pending::of(self.control.now(), move |py, _| {
            let lines = lock(&lines).iter().map(|line| format!("{line}\n")).collect::<String>();
            Ok(lines.into_pyobject(py)?.into_any().unbind())
        })
    }

    /// The conversation so far, also of one that has ended.
    fn conversation_so_far(&self) -> String {
        lock(&self.conversation).iter().map(|line| format!("{line}\n")).collect()
    }

    fn forget(&self) -> Pending {
        lock(&self.conversation).clear();
        Pending::of(self.control.forget(), none)
    }

    fn watch(&self, reports: &Bound<'_, Reports>) -> PyResult<Pending> {
        let tap = reports.get().tap()?;
        Ok(Pending::of(self.control.watch(tap), |py, id: SinkId| {
            Ok(Py::new(py, Sink(id))?.into_any())
        }))
    }

    fn detach(&self, sink: &Bound<'_, Sink>) -> Pending {
        Pending::of(self.control.detach(sink.get().0), |py, was_there| {
            Ok(was_there.into_pyobject(py)?.to_owned().into_any().unbind())
        })
    }

    // --- what happens to it ---

    fn signals(&self) -> Pending {
        Pending::of(self.control.signals(), |py, signals| {
            let list: PyResult<Vec<_>> = signals.iter().map(|one| signal(py, one)).collect();
            Ok(list?.into_pyobject(py)?.unbind())
        })
    }

    /// All ways to go on with an order that has been begun, each with what it is.
    fn complete(&self, py: Python<'_>, begun: &str) -> PyResult<Vec<(String, String)>> {
        let completions = self.names(py)?.complete(begun);
        Ok(completions.into_iter().map(|one| (one.line, one.about)).collect())
    }

    /// The names of the axes, X first.
    #[getter]
    fn axis_names(&self) -> Vec<&'static str> {
        self.control.model().axis_names().to_vec()
    }

    /// Carries out an order as people type it.
    fn order(&self, py: Python<'_>, line: &str) -> PyResult<Pending> {
        let wrong = |error: vimc4::OrderError| error::raise(py, "OrderError", error.to_string());
        let Some(order) = Order::read(line, self.names(py)?).map_err(wrong)? else {
            return Err(error::raise(py, "OrderError", "an empty line is not an order".to_owned()));
        };
        Ok(Pending::new(self.control.give(&order), |py, said| match said {
            Ok(text) => Ok(text.into_pyobject(py)?.into_any().unbind()),
            Err(error) => Err(error::of(py, &error)),
        }))
    }

    fn set_signal(&self, name: &str, value: i32) -> Pending {
        Pending::of(self.control.set_signal(name, value), effect)
    }

    fn press(&self, button: &str) -> Pending {
        Pending::of(self.control.press(button), effect)
    }

    fn hold(&self, button: &str) -> Pending {
        Pending::of(self.control.hold(button), effect)
    }

    fn release(&self, button: &str) -> Pending {
        Pending::of(self.control.release(button), effect)
    }

    fn turn(&self, switch: &str, position: &str) -> Pending {
        Pending::of(self.control.turn(switch, position), effect)
    }

    fn input(&self, port: u16, bit: u8, level: bool) -> Pending {
        Pending::of(self.control.input(port, bit, level), effect)
    }

    fn erase(&self) -> Pending {
        Pending::of(self.control.erase(), effect)
    }

    fn power(&self, on: bool) -> Pending {
        Pending::of(self.control.power(on), effect)
    }

    fn snapshot(&self) -> Pending {
        Pending::of(self.control.snapshot(), |py, snapshot| {
            Ok(Py::new(py, Snapshot(snapshot))?.into_any())
        })
    }

    fn restore(&self, snapshot: &Bound<'_, Snapshot>) -> Pending {
        Pending::of(self.control.restore(&snapshot.get().0), none)
    }

    fn harness(&self, py: Python<'_>) -> PyResult<Pending> {
        let (family, names) = (self.control.model().family(), self.names(py)?.clone());
        Ok(Pending::of(self.control.controller(), move |py, controller| {
            let harness = Harness::of(vimc4::device::Harness::new(controller), family, names);
            Ok(Py::new(py, harness)?.into_any())
        }))
    }

    fn put(&self, py: Python<'_>, harness: &Bound<'_, Harness>) -> PyResult<Pending> {
        let harness = harness.get();
        if harness.family != self.control.model().family() {
            let text = "this is a controller of another family; put it into one of its own";
            return Err(error::raise(py, "ControlError", text.to_owned()));
        }
        Ok(Pending::of(self.control.put(harness.device().state()), none))
    }

    // --- time stands still ---

    fn pause(&self) -> Pending {
        Pending::of(self.control.pause(), time)
    }

    fn resume(&self) -> Pending {
        Pending::of(self.control.resume(), time)
    }

    fn paused(&self) -> Pending {
        Pending::of(self.control.paused(), |py, pause| match pause {
            Some(pause) => paused(py, pause),
            None => Ok(py.None()),
        })
    }

    fn until_paused(&self) -> Pending {
        Pending::of(self.control.until_paused(), paused)
    }

    fn step(&self) -> Pending {
        Pending::of(self.control.step(), |py, step| {
            let word = match step {
                Step::Cause => "cause",
                Step::Input => "input",
                Step::Time => "time",
                Step::Rest => "rest",
            };
            Ok(word.into_pyobject(py)?.into_any().unbind())
        })
    }

    fn hear(&self, bytes: usize) -> Pending {
        Pending::of(self.control.hear(bytes), |py, heard| {
            Ok(heard.into_pyobject(py)?.into_any().unbind())
        })
    }

    fn break_when(&self, py: Python<'_>, condition: &str) -> PyResult<Pending> {
        let condition = self.condition(py, condition)?;
        Ok(Pending::of(self.control.break_when(condition), |py, BreakpointId(number)| {
            Ok(number.into_pyobject(py)?.into_any().unbind())
        }))
    }

    fn remove_breakpoint(&self, breakpoint: u64) -> Pending {
        Pending::of(self.control.remove_breakpoint(BreakpointId(breakpoint)), |py, was_there| {
            Ok(was_there.into_pyobject(py)?.to_owned().into_any().unbind())
        })
    }

    fn breakpoints(&self, py: Python<'_>) -> PyResult<Pending> {
        let names = self.names(py)?.clone();
        Ok(Pending::of(self.control.breakpoints(), move |py, views| {
            let list: PyResult<Vec<_>> = views
                .iter()
                .map(|view| {
                    let condition = names.write(&view.condition).to_string();
                    typed(py, "Breakpoint", (view.id.0, condition, view.met))
                })
                .collect();
            Ok(list?.into_pyobject(py)?.unbind())
        }))
    }
}

impl Drop for Core {
    fn drop(&mut self) {
        self.end();
    }
}

impl Core {
    fn end(&self) {
        let emulator = lock(&self.emulator).take();
        if self.process != std::process::id() {
            // A copy of the process has no threads, and nobody to wait for; ports and links belong
            // to the original.
            std::mem::forget(emulator);
        }
    }

    /// What people call its axes and signals, asked once.
    fn names(&self, py: Python<'_>) -> PyResult<&Names> {
        if let Some(names) = self.names.get() {
            return Ok(names);
        }
        let names = answer(py, self.control.names())?;
        Ok(self.names.get_or_init(|| names))
    }

    fn condition(&self, py: Python<'_>, text: &str) -> PyResult<Condition> {
        self.names(py)?
            .read(text)
            .map_err(|error| error::raise(py, "ConditionError", error.to_string()))
    }
}

/// Who watches an emulator.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Sink(SinkId);

#[pymethods]
impl Snapshot {
    fn __repr__(&self) -> String {
        "<vimc4.Snapshot>".to_owned()
    }
}

#[pymethods]
impl Worker {
    /// Starts a thread of this name.
    #[new]
    #[pyo3(signature = (name="vimc4"))]
    fn new(name: &str) -> PyResult<Worker> {
        Ok(Worker(vimc4::Worker::start(name)?))
    }
}

#[pymethods]
impl Recording {
    /// Whether it is still written.
    #[getter]
    fn is_open(&self) -> bool {
        self.0.is_open()
    }

    /// How many bytes the present file has.
    #[getter]
    fn written(&self) -> u64 {
        self.0.written()
    }

    /// Ends it here, although the emulator may go on, and compresses it if its name says so. Returns
    /// every file of it.
    fn finish(&self, py: Python<'_>) -> PyResult<Vec<PathBuf>> {
        let files = py.detach(|| self.0.finish());
        match files.iter().find(|file| !file.exists()) {
            Some(file) => Err(PyOSError::new_err(format!("{} has been removed", file.display()))),
            None => Ok(files),
        }
    }

    /// Ends it here and removes every file of it.
    fn discard(&self, py: Python<'_>) {
        py.detach(|| self.0.discard());
    }
}

fn host_and_port(address: SocketAddr) -> (String, u16) {
    (address.ip().to_string(), address.port())
}

fn none(py: Python<'_>, (): ()) -> PyResult<Py<PyAny>> {
    Ok(py.None())
}

fn time(py: Python<'_>, at: Time) -> PyResult<Py<PyAny>> {
    Ok(at.as_nanos().into_pyobject(py)?.into_any().unbind())
}

fn effect(py: Python<'_>, effect: Effect) -> PyResult<Py<PyAny>> {
    match effect {
        Effect::Something => typed(py, "Effect", (true, py.None())),
        Effect::Nothing { why } => typed(py, "Effect", (false, why)),
    }
}

fn command(py: Python<'_>, command: HostCommand) -> PyResult<Py<PyAny>> {
    let HostCommand { at, number, mnemonic, bytes, text, .. } = command;
    let bytes = pyo3::types::PyBytes::new(py, &bytes);
    typed(py, "Command", (at.as_nanos(), number.map(|n| n.0), &*mnemonic, bytes, text))
}

fn paused(py: Python<'_>, Pause { at, by, breakpoints }: Pause) -> PyResult<Py<PyAny>> {
    let breakpoints: Vec<u64> = breakpoints.into_iter().map(|BreakpointId(n)| n).collect();
    typed(py, "Pause", (at.as_nanos(), by.map(|by| by.to_string()), breakpoints))
}

fn signal(py: Python<'_>, signal: &Signal) -> PyResult<Py<PyAny>> {
    let keywords = PyDict::new(py);
    keywords.set_item("name", &signal.name)?;
    let (kind, range) = match signal.kind {
        SignalKind::Button => ("button", (0, 1)),
        SignalKind::Switch => ("switch", (0, 1)),
        SignalKind::Input => ("input", (0, 1)),
        SignalKind::Analogue { low, high } => ("analogue", (low, high)),
    };
    keywords.set_item("kind", kind)?;
    keywords.set_item("low", range.0)?;
    keywords.set_item("high", range.1)?;
    keywords.set_item("positions", signal.positions.clone().map(|[off, on]| (off, on)))?;
    keywords.set_item("latches", signal.latches)?;
    keywords.set_item("bits", signal.bits.clone())?;
    keywords.set_item("terminal", signal.terminal.clone())?;
    keywords.set_item("about", &signal.about)?;
    let class = py.import("vimc4._types")?.getattr("Signal")?;
    Ok(class.call((), Some(&keywords))?.unbind())
}
