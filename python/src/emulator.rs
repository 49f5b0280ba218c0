//! The emulator: what is asked of it comes back as a [`Pending`].

use std::collections::{BTreeMap, VecDeque};
use std::future::Future;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread;

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use vimc4::device::Device;
use vimc4::{
    BreakpointId, Builder, Clock, Condition, Control, ControlError, Effect, Emulator, FaultNumber,
    FaultStage, HostCommand, HostLines, Names, Order, Pause, RuleStage, Scenario, ScenarioNumber,
    Signal, SignalKind, SinkId, Step, Terminal, Time, Traffic, Trial, Unmet, Verbosity, Watched,
};

use crate::alarm::Alarms;
use crate::convert::{event, level, plain, span, typed};
use crate::coverage::Coverage;
use crate::expect::{Expect, Expectation};
use crate::harness::Harness;
use crate::journal::Journal;
use crate::pending::{Journey, Pending};
use crate::port::Port;
use crate::reports::Reports;
use crate::sweep::Given;
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
    /// What is expected, by numbers.
    watched: Mutex<BTreeMap<u64, Watched>>,
    /// The number of the next expectation.
    next: AtomicU64,
    alarms: Arc<Alarms>,
    /// Whether there is a journal.
    records: bool,
    /// What it was given, if it is there to try a host.
    given: Option<Given>,
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

impl Places {
    fn of(emulator: &Emulator) -> Places {
        Places {
            port: emulator.port().map(PathBuf::from),
            tcp: emulator.tcp_addr(),
            rfc2217: emulator.rfc2217_addr(),
            serial: emulator.serial().map(str::to_owned),
        }
    }
}

/// Remembers the last lines of the conversation.
fn remember(builder: Builder, conversation: &Arc<Mutex<VecDeque<String>>>) -> Builder {
    let lines = Arc::clone(conversation);
    builder.sink(Traffic::new(Verbosity::Conversation, move |line| {
        let mut lines = lock(&lines);
        if lines.len() == LINES {
            lines.pop_front();
        }
        lines.push_back(line);
    }))
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
        serial, flash, line_pacing, paused, record, coverage, recording, record_size, recorded_by, name,
        on, tried,
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
        coverage: bool,
        recording: Option<PathBuf>,
        record_size: Option<u64>,
        recorded_by: &str,
        name: Option<String>,
        on: Option<&Bound<'_, Worker>>,
        tried: bool,
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
            .record(record)
            .coverage(coverage);
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
        let conversation = Arc::default();
        if record {
            builder = remember(builder, &conversation);
        }
        let given = tried.then(Given::default);
        if let Some(given) = &given {
            builder = builder.sink(given.clone());
        }
        let emulator = py.detach(|| builder.start()).map_err(|error| error::of(py, &error))?;
        Ok(Core {
            control: emulator.control().clone(),
            recording: emulator.recording().cloned(),
            places: Places::of(&emulator),
            emulator: Mutex::new(Some(emulator)),
            watched: Mutex::default(),
            next: AtomicU64::new(1),
            alarms: Arc::default(),
            records: record,
            given,
            process: std::process::id(),
            names: OnceLock::new(),
            conversation,
            recording_errors,
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
        let (control, alarms) = (self.control.clone(), Arc::clone(&self.alarms));
        let leads_time = self.given.is_some();
        let ports = self.control.connect_with_lines(move |line, on| {
            if line == vimc4::ModemLine::Cts {
                tell.set(on);
            }
        });
        self.pending(ports, move |py, (port, lines): (vimc4::MemoryPort, HostLines)| {
            Ok(Py::new(py, Port::new(port, lines, clear, control, alarms, leads_time))?.into_any())
        })
    }

    // --- time ---

    fn now(&self) -> Pending {
        self.pending(self.control.now(), time)
    }

    fn advance(&self, py: Python<'_>, by: &Bound<'_, PyAny>) -> PyResult<Py<Journey>> {
        Pending::journey(py, self.control.advance(span(by)?), self.alarms.ear())
    }

    fn run_until(&self, py: Python<'_>, condition: &str) -> PyResult<Py<Journey>> {
        let condition = self.condition(py, condition)?;
        Pending::journey(py, self.control.run_until(condition), self.alarms.ear())
    }

    fn cancel_all(&self) {
        self.control.cancel_all();
    }

    // --- what it sees ---

    fn position(&self) -> Pending {
        self.pending(self.control.position(), |py, axes| Ok(axes.into_pyobject(py)?.unbind()))
    }

    fn view(&self) -> Pending {
        self.pending(self.control.view(), |py, view| Ok(plain(py, &view)?.unbind()))
    }

    fn commands(&self) -> Pending {
        self.pending(self.control.commands(), |py, commands| {
            let list: PyResult<Vec<_>> = commands.into_iter().map(|one| command(py, one)).collect();
            Ok(list?.into_pyobject(py)?.unbind())
        })
    }

    fn next_command(&self, mnemonic: &str) -> Pending {
        self.pending(self.control.next_command(mnemonic), command)
    }

    fn events(&self) -> Pending {
        self.pending(self.control.events(), |py, events| {
            let list: PyResult<Vec<_>> =
                events.iter().map(|(stamp, happened)| event(py, *stamp, happened)).collect();
            Ok(list?.into_pyobject(py)?.unbind())
        })
    }

    /// The conversation, when what was sent before has arrived.
    fn conversation(&self) -> Pending {
        let lines = Arc::clone(&self.conversation);
        // It is told whatever has failed, for it is part of the report of that.
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
        self.pending(self.control.forget(), none)
    }

    fn watch(&self, reports: &Bound<'_, Reports>) -> PyResult<Pending> {
        let tap = reports.get().tap()?;
        Ok(self.pending(self.control.watch(tap), |py, id: SinkId| {
            Ok(Py::new(py, Sink(id))?.into_any())
        }))
    }

    fn detach(&self, sink: &Bound<'_, Sink>) -> Pending {
        self.pending(self.control.detach(sink.get().0), |py, was_there| {
            Ok(was_there.into_pyobject(py)?.to_owned().into_any().unbind())
        })
    }

    // --- what is expected ---

    /// What happened, as far back as it is kept.
    fn journal(&self, py: Python<'_>) -> PyResult<Pending> {
        let (names, axes) = (self.names(py)?.clone(), self.control.model().axis_names().len());
        Ok(Pending::of(self.control.journal(), move |py, journal| {
            let class = py.import("vimc4._journal")?.getattr("Journal")?;
            Ok(class.call1((Journal::new(journal, names, axes),))?.unbind())
        }))
    }

    /// How much of what it can do the host has met.
    fn coverage(&self) -> Pending {
        self.pending(self.control.coverage(), |py, coverage| {
            Ok(Py::new(py, Coverage(coverage))?.into_any())
        })
    }

    /// The same of one that may have ended; None if nothing is counted.
    fn coverage_so_far(&self) -> Option<Coverage> {
        self.control.coverage_so_far().map(Coverage)
    }

    /// Begins a sentence; `said` is told how it ends.
    fn expect(&self, py: Python<'_>, said: Py<PyAny>) -> PyResult<Py<Expect>> {
        Expect::begin(py, said, self.names(py)?.clone())
    }

    /// Expects something from now on, and returns its number. Ctrl-C does not end this: what is
    /// expected would never be asked for.
    fn watch_for(&self, py: Python<'_>, expected: &Bound<'_, Expectation>) -> PyResult<u64> {
        let (names, expected) = (self.names(py)?, expected.get().0.clone());
        let watched = py.detach(|| self.control.watch_for(expected, names).wait());
        let watched = watched
            .map_err(|error| error::of_control(py, &error))?
            .map_err(|mistake| error::raise(py, "Mistake", mistake.to_string()))?;
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let (recording, alarms) = (self.recording.clone(), Arc::clone(&self.alarms));
        let hearer = thread::current().id();
        let watched = watched.or_tell(move |failure| {
            if let Some(file) = &recording {
                file.cut(failure);
            }
            alarms.raise(number, hearer, failure);
        });
        lock(&self.watched).insert(number, watched);
        Ok(number)
    }

    /// Why the expectation of this number cannot be met any more, if that is clear already.
    fn failure(&self, py: Python<'_>, number: u64) -> Option<Py<PyAny>> {
        let all = lock(&self.watched);
        let failure = all.get(&number)?.failure()?;
        drop(all);
        Some(error::unmet(py, &failure).into_value(py).into_any())
    }

    /// Answers when the expectation of this number is met, or cannot be any more.
    fn met(&self, number: u64) -> PyResult<Pending> {
        let all = lock(&self.watched);
        let Some(watched) = all.get(&number) else {
            return Err(PyValueError::new_err("it is not expected any more"));
        };
        Ok(self.pending(watched.until_met(), none))
    }

    /// The emulator ends as soon as the expectation of this number cannot be met any more.
    fn or_stop(&self, number: u64) {
        let mut all = lock(&self.watched);
        if let Some(watched) = all.remove(&number) {
            all.insert(number, watched.or_stop());
        }
    }

    /// Nothing is expected of this number any more. Says why it is not met, if it is not.
    fn unwatch(&self, py: Python<'_>, number: u64) -> Option<Py<PyAny>> {
        let watched = lock(&self.watched).remove(&number)?;
        let outcome = py.detach(|| watched.check());
        self.alarms.silence(number);
        Some(error::of(py, &outcome.err()?).into_value(py).into_any())
    }

    /// Looks at everything that has happened so far.
    fn so_far(&self, py: Python<'_>, expected: &Bound<'_, Expectation>) -> PyResult<Pending> {
        if !self.records {
            let text =
                "nothing is remembered; do without record=False, or watch from the beginning";
            return Err(error::raise(py, "ControlError", text.to_owned()));
        }
        let (names, expected) = (self.names(py)?.clone(), expected.get().0.clone());
        Ok(self.pending(self.control.journal(), move |py, journal| {
            match py.detach(|| Trial::of(expected, &journal, &names)) {
                Ok(()) => Ok(py.None()),
                Err(Unmet::Failure(failure)) => Err(error::unmet(py, &failure)),
                Err(Unmet::Mistake(mistake)) => {
                    Err(error::raise(py, "Mistake", mistake.to_string()))
                }
            }
        }))
    }

    /// Everything that it was given, once what was written last has arrived.
    fn given(&self) -> PyResult<Pending> {
        let given = self.given.clone().ok_or_else(|| error::broken("it is not tried"))?;
        Ok(Pending::new(self.control.now(), move |py, now| match now {
            // The host may have ended it.
            Ok(_) | Err(vimc4::ControlError::Ended) => {
                Ok(given.told()?.into_pyobject(py)?.into_any().unbind())
            }
            Err(error) => Err(error::of_control(py, &error)),
        }))
    }

    // --- what goes wrong ---

    /// Begins a fault and answers with its number.
    fn fault(&self, py: Python<'_>, words: &str) -> PyResult<Pending> {
        let fault = vimc4::read_fault(words, self.names(py)?);
        let fault = fault.map_err(|error| error::raise(py, "FaultError", error.to_string()))?;
        Ok(self.pending(self.control.fault(fault), |py, number| {
            Ok(number.0.into_pyobject(py)?.into_any().unbind())
        }))
    }

    fn faults(&self, py: Python<'_>) -> PyResult<Pending> {
        let names = self.names(py)?.clone();
        Ok(self.pending(self.control.faults(), move |py, views| {
            let list: PyResult<Vec<_>> = views
                .iter()
                .map(|view| {
                    let what = names.write_fault(&view.fault);
                    let stage = match view.stage {
                        FaultStage::Waits => "waits",
                        FaultStage::Strikes => "strikes",
                        FaultStage::Over => "over",
                    };
                    typed(py, "FaultView", (view.number.0, what, stage, view.struck))
                })
                .collect();
            Ok(list?.into_pyobject(py)?.unbind())
        }))
    }

    fn end_fault(&self, number: u32) -> Pending {
        self.pending(self.control.end_fault(FaultNumber(number)), effect)
    }

    fn end_faults(&self) -> Pending {
        self.pending(self.control.end_faults(), effect)
    }

    /// Begins the rules of a text, one a line, and answers with the number of the scenario.
    fn scenario(&self, py: Python<'_>, words: &str) -> PyResult<Pending> {
        let names = self.names(py)?;
        let several = words.trim().contains('\n');
        let wrong = |place: usize, text: String| {
            let whereabouts = if several { format!("line {}: ", place + 1) } else { String::new() };
            error::raise(py, "ScenarioError", format!("{whereabouts}{text}"))
        };
        let lines = words.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty());
        let lines: Vec<(usize, &str)> = lines.collect();
        let read = |(place, line): &(usize, &str)| {
            vimc4::read_rule(line, names).map_err(|error| wrong(*place, error.to_string()))
        };
        let scenario = Scenario { rules: lines.iter().map(read).collect::<PyResult<_>>()? };
        // A rule may wait for one of another scenario, if that is there.
        let present = answer(py, self.control.rules())?;
        let others = present.iter().filter_map(|view| view.id.name.as_deref());
        scenario.check(others).map_err(|error| {
            let (place, line) = lines.get(error.rule()).copied().unwrap_or_default();
            wrong(place, format!("`{line}` is wrong: {error}; {}", error.right()))
        })?;
        self.begin_scenario(py, scenario)
    }

    /// The same with the rules of a file.
    fn scenario_file(&self, py: Python<'_>, path: PathBuf) -> PyResult<Pending> {
        let scenario = vimc4::scenario_file(path, self.names(py)?)
            .map_err(|error| error::raise(py, "ScenarioError", error.to_string()))?;
        self.begin_scenario(py, scenario)
    }

    fn rules(&self, py: Python<'_>) -> PyResult<Pending> {
        let names = self.names(py)?.clone();
        Ok(self.pending(self.control.rules(), move |py, views| {
            let list: PyResult<Vec<_>> = views
                .into_iter()
                .map(|view| {
                    let what = names.write_rule(&view.rule);
                    let stage = match view.stage {
                        RuleStage::Waits => "waits",
                        RuleStage::Holds => "holds",
                        RuleStage::Over => "over",
                    };
                    let id = view.id;
                    let place = id.place.max(1);
                    let of_it = (id.scenario.0, place, id.name, what, stage, view.acted);
                    typed(py, "RuleView", of_it)
                })
                .collect();
            Ok(list?.into_pyobject(py)?.unbind())
        }))
    }

    fn end_scenario(&self, number: u32) -> Pending {
        self.pending(self.control.end_scenario(ScenarioNumber(number)), effect)
    }

    fn end_scenarios(&self) -> Pending {
        self.pending(self.control.end_scenarios(), effect)
    }

    fn reset(&self) -> Pending {
        self.pending(self.control.reset(), effect)
    }

    // --- what happens to it ---

    fn signals(&self) -> Pending {
        self.pending(self.control.signals(), |py, signals| {
            let list: PyResult<Vec<_>> = signals.iter().map(|one| signal(py, one)).collect();
            Ok(list?.into_pyobject(py)?.unbind())
        })
    }

    /// All ways to go on with an order that has been begun, each with what it is.
    fn complete(&self, py: Python<'_>, begun: &str) -> PyResult<Vec<(String, String)>> {
        let completions = vimc4::complete(begun, self.names(py)?);
        Ok(completions.into_iter().map(|one| (one.line, one.about)).collect())
    }

    /// The names of the axes, X first.
    #[getter]
    fn axis_names(&self) -> Vec<&'static str> {
        self.control.model().axis_names().to_vec()
    }

    /// Carries out an order as people type it.
    fn order(&self, py: Python<'_>, line: &str) -> PyResult<Pending> {
        let wrong = |error: vimc4::SyntaxError| error::raise(py, "OrderError", error.to_string());
        let Some(order) = Order::read(line, self.names(py)?).map_err(wrong)? else {
            return Err(error::raise(py, "OrderError", "an empty line is not an order".to_owned()));
        };
        let given = Pending::new(self.control.give(&order), |py, said| match said {
            Ok(text) => Ok(text.into_pyobject(py)?.into_any().unbind()),
            Err(error) => Err(error::of(py, &error)),
        });
        Ok(given.hearing(self.alarms.ear()))
    }

    fn set_signal(&self, name: &str, #[pyo3(from_py_with = level)] value: i32) -> Pending {
        self.pending(self.control.set_signal(name, value), effect)
    }

    fn press(&self, button: &str) -> Pending {
        self.pending(self.control.press(button), effect)
    }

    fn hold(&self, button: &str) -> Pending {
        self.pending(self.control.hold(button), effect)
    }

    fn release(&self, button: &str) -> Pending {
        self.pending(self.control.release(button), effect)
    }

    fn turn(&self, switch: &str, position: &str) -> Pending {
        self.pending(self.control.turn(switch, position), effect)
    }

    fn input(&self, port: u16, bit: u8, level: bool) -> Pending {
        self.pending(self.control.input(port, bit, level), effect)
    }

    fn erase(&self) -> Pending {
        self.pending(self.control.erase(), effect)
    }

    fn power(&self, on: bool) -> Pending {
        self.pending(self.control.power(on), effect)
    }

    fn snapshot(&self) -> Pending {
        self.pending(self.control.snapshot(), |py, snapshot| {
            Ok(Py::new(py, Snapshot(snapshot))?.into_any())
        })
    }

    fn restore(&self, snapshot: &Bound<'_, Snapshot>) -> Pending {
        self.pending(self.control.restore(&snapshot.get().0), none)
    }

    fn harness(&self, py: Python<'_>) -> PyResult<Pending> {
        let (family, names) = (self.control.model().family(), self.names(py)?.clone());
        Ok(self.pending(self.control.controller(), move |py, controller| {
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
        Ok(self.pending(self.control.put(harness.device().state()), none))
    }

    // --- time stands still ---

    fn pause(&self) -> Pending {
        self.pending(self.control.pause(), time)
    }

    fn resume(&self) -> Pending {
        self.pending(self.control.resume(), time)
    }

    fn paused(&self) -> Pending {
        self.pending(self.control.paused(), |py, pause| match pause {
            Some(pause) => paused(py, pause),
            None => Ok(py.None()),
        })
    }

    fn until_paused(&self) -> Pending {
        self.pending(self.control.until_paused(), paused)
    }

    fn step(&self) -> Pending {
        self.pending(self.control.step(), |py, step| {
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
        self.pending(self.control.hear(bytes), |py, heard| {
            Ok(heard.into_pyobject(py)?.into_any().unbind())
        })
    }

    fn break_when(&self, py: Python<'_>, condition: &str) -> PyResult<Pending> {
        let condition = self.condition(py, condition)?;
        Ok(self.pending(self.control.break_when(condition), |py, BreakpointId(number)| {
            Ok(number.into_pyobject(py)?.into_any().unbind())
        }))
    }

    fn remove_breakpoint(&self, breakpoint: u64) -> Pending {
        self.pending(self.control.remove_breakpoint(BreakpointId(breakpoint)), |py, was_there| {
            Ok(was_there.into_pyobject(py)?.to_owned().into_any().unbind())
        })
    }

    fn breakpoints(&self, py: Python<'_>) -> PyResult<Pending> {
        let names = self.names(py)?.clone();
        Ok(self.pending(self.control.breakpoints(), move |py, views| {
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
        let watched = std::mem::take(&mut *lock(&self.watched));
        if self.process != std::process::id() {
            // A copy of the process has no threads, and nobody to wait for; ports and links belong
            // to the original.
            std::mem::forget((emulator, watched));
            return;
        }
        // Who has not asked by now has given up: the package has asked for all of them before.
        watched.into_values().for_each(Watched::give_up);
    }

    /// An answer of its controller; an expectation that fails meanwhile is raised instead of it.
    fn pending<T: Send + 'static>(
        &self,
        reply: impl Future<Output = Result<T, ControlError>> + Send + 'static,
        tell: impl FnOnce(Python<'_>, T) -> PyResult<Py<PyAny>> + Send + 'static,
    ) -> Pending {
        Pending::of(reply, tell).hearing(self.alarms.ear())
    }

    /// A fault of a sweep, which stays.
    pub(crate) fn begin_fault(&self, py: Python<'_>, fault: vimc4::Fault) -> PyResult<()> {
        let begun = py.detach(|| self.control.fault(fault).wait());
        begun.map(drop).map_err(|error| error::of_control(py, &error))
    }

    /// A scenario without a rule would be a test of nothing.
    fn begin_scenario(&self, py: Python<'_>, scenario: Scenario) -> PyResult<Pending> {
        if scenario.rules.is_empty() {
            let text = "there is no rule; write one, as in `when x > 1000: press stop`";
            return Err(error::raise(py, "ScenarioError", text.to_owned()));
        }
        Ok(self.pending(self.control.scenario(scenario), |py, number| {
            Ok(number.0.into_pyobject(py)?.into_any().unbind())
        }))
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
        vimc4::read_condition(text, self.names(py)?)
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
        let files = py.detach(|| {
            self.0.end_here();
            self.0.finish()
        });
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
