//! Several controllers in one time, and a simulation in Python of what they drive.
//!
//! A group has no thread: a simulation is called in the thread that lets time pass.

use std::cell::RefCell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, TryLockError};

use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyInt, PyList, PyString};
use vimc4::device::Device as _;
use vimc4::{GroupError, Names, Simulation, Time};

use crate::convert::{kinds, level, plain, span};
use crate::harness::told;
use crate::waiting::lock;
use crate::{error, profiles};

thread_local! {
    /// What a simulation has raised in this thread, for the end of what has called it.
    static FAILED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// The number of the next group; its copies have the same.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// Several controllers in one time, which passes only when it is told to, and for all together. The
/// earliest of all that will happen happens next; at the same instant whoever joined first, and the
/// simulation last.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct Group {
    number: u64,
    inner: Mutex<Inner>,
}

#[derive(Clone)]
struct Inner {
    group: vimc4::Group<Plant>,
    members: Vec<(vimc4::Member, Names)>,
}

/// A controller of a group, and of its copies.
#[pyclass(frozen, eq, hash, from_py_object, module = "vimc4._vimc4")]
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Member {
    group: u64,
    place: usize,
}

/// A state of a group, with its simulation.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct GroupState {
    group: u64,
    state: vimc4::GroupState<Plant>,
}

/// The controllers of a group as its simulation sees them, at one instant.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct World {
    group: u64,
    now: Time,
    views: Vec<vimc4::View>,
    signals: Vec<Vec<vimc4::Signal>>,
    /// None when the simulation has done what it does.
    set: Mutex<Option<Vec<(usize, String, i32)>>>,
}

/// A simulation in Python, if there is one.
struct Plant {
    group: u64,
    object: Option<Py<PyAny>>,
}

fn failed() -> bool {
    FAILED.with_borrow(Option::is_some)
}

fn fail(error: PyErr) {
    FAILED.with_borrow_mut(|failed| {
        failed.get_or_insert(error);
    });
}

/// Another one in the same state, as `copy.deepcopy` makes it.
impl Clone for Plant {
    fn clone(&self) -> Plant {
        let object = self.object.as_ref().map(|object| {
            Python::attach(|py| {
                let copy = py.import("copy").and_then(|copy| copy.getattr("deepcopy"));
                match copy.and_then(|copy| copy.call1((object,))) {
                    Ok(copy) => copy.unbind(),
                    Err(error) => {
                        fail(error);
                        object.clone_ref(py)
                    }
                }
            })
        });
        Plant { group: self.group, object }
    }
}

impl Plant {
    /// Calls a method with what it sees, and passes on what it has set. After a failure nothing is
    /// called any more: the failure is on its way to whoever lets time pass.
    fn call(&self, name: &str, of: Option<(vimc4::Member, u16, u8)>, world: &mut vimc4::World<'_>) {
        if failed() {
            return world.fail(RAISED);
        }
        let Some(object) = &self.object else { return };
        let members: Vec<vimc4::Member> = world.members().collect();
        let called = Python::attach(|py| {
            let object = object.bind(py);
            if of.is_some() && !object.hasattr(name)? {
                return Ok(Vec::new());
            }
            let views = members.iter().map(|member| world.view(*member)).collect();
            let signals = members.iter().map(|member| world.signals(*member)).collect();
            let set = Mutex::new(Some(Vec::new()));
            let (group, now) = (self.group, world.now());
            let seen = Bound::new(py, World { group, now, views, signals, set })?;
            let done = match of {
                None => object.call_method1(name, (&seen,)),
                Some((of, port, value)) => {
                    let place = members.iter().position(|member| *member == of).unwrap_or_default();
                    object.call_method1(name, (Member { group, place }, port, value, &seen))
                }
            };
            let set = lock(&seen.get().set).take();
            done.map(|_| set.unwrap_or_default())
        });
        match called {
            Ok(set) => set.into_iter().for_each(|(place, signal, value)| {
                world.set(members[place], &signal, value);
            }),
            Err(error) => {
                fail(error);
                world.fail(RAISED);
            }
        }
    }
}

/// What the library is told of a failure, which is raised as it is.
const RAISED: &str = "it has raised an error";

/// What `due` has returned, as a time.
fn due_of(due: &Bound<'_, PyAny>) -> PyResult<Option<Time>> {
    let due = due.extract::<Option<u64>>().map_err(|_| {
        let text = format!(
            "`due` of the simulation is a time in nanoseconds, a whole number from 0 to 2^64 - 1, or None, and \
             not {due:?}"
        );
        match due.is_instance_of::<PyInt>() {
            true => PyValueError::new_err(text),
            false => PyTypeError::new_err(text),
        }
    })?;
    Ok(due.map(Time::from_nanos))
}

impl Simulation for Plant {
    fn due(&self) -> Option<Time> {
        let object = self.object.as_ref()?;
        if !failed() {
            match Python::attach(|py| due_of(&object.bind(py).call_method0("due")?)) {
                Ok(due) => return due,
                Err(error) => fail(error),
            }
        }
        // After a failure it is due at once: `act` tells of it before any time passes.
        Some(Time::ZERO)
    }

    fn act(&mut self, world: &mut vimc4::World<'_>) {
        self.call("act", None, world);
    }

    fn output(&mut self, of: vimc4::Member, port: u16, value: u8, world: &mut vimc4::World<'_>) {
        self.call("output", Some((of, port, value)), world);
    }
}

fn of_group(py: Python<'_>, error: &GroupError) -> PyErr {
    let name = match error {
        GroupError::Endless { .. } | GroupError::Insistent { .. } | GroupError::Restless { .. } => {
            "Endless"
        }
        GroupError::Deed(_) | GroupError::NoOutput { .. } => "DeedError",
        _ => "ControlError",
    };
    error::raise(py, name, error.to_string())
}

fn place(group: u64, count: usize, member: Member) -> PyResult<usize> {
    if member.group == group && member.place < count {
        return Ok(member.place);
    }
    Err(PyValueError::new_err("this is a controller of another group"))
}

impl Group {
    fn of(number: u64, inner: Inner) -> Group {
        Group { number, inner: Mutex::new(inner) }
    }

    /// It is never waited for: whoever has it may be waiting for Python, or be the simulation itself.
    fn inner(&self) -> PyResult<MutexGuard<'_, Inner>> {
        match self.inner.try_lock() {
            Ok(inner) => Ok(inner),
            Err(TryLockError::Poisoned(inner)) => Ok(inner.into_inner()),
            Err(TryLockError::WouldBlock) => Err(PyRuntimeError::new_err(
                "the group is at work: a simulation uses the world that it is given, and threads take turns",
            )),
        }
    }

    /// Does something with the group while other threads run, and raises what its simulation has raised.
    fn work<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Inner) -> Result<T, GroupError> + Send,
    ) -> PyResult<T> {
        let mut inner = self.inner()?;
        FAILED.take();
        let inner = &mut *inner;
        let done = py.detach(|| work(inner));
        match FAILED.take() {
            Some(error) => Err(error),
            None => done.map_err(|error| of_group(py, &error)),
        }
    }

    fn member(&self, inner: &Inner, member: Member) -> PyResult<vimc4::Member> {
        Ok(inner.members[place(self.number, inner.members.len(), member)?].0)
    }

    fn the(&self, member: Member) -> PyResult<vimc4::Member> {
        self.member(&*self.inner()?, member)
    }
}

#[pymethods]
impl Group {
    #[new]
    #[pyo3(signature = (simulation=None))]
    fn new(py: Python<'_>, simulation: Option<Py<PyAny>>) -> PyResult<Group> {
        for method in ["due", "act"] {
            if simulation
                .as_ref()
                .is_some_and(|object| !object.bind(py).hasattr(method).unwrap_or(false))
            {
                let text = format!("this is no simulation: it has no method `{method}`");
                return Err(PyTypeError::new_err(text));
            }
        }
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let group = vimc4::Group::with(Plant { group: number, object: simulation });
        Ok(Group::of(number, Inner { group, members: Vec::new() }))
    }

    /// A controller joins, which has just been switched on. `watching` are the kinds of events that
    /// `drain` has besides the bytes.
    #[pyo3(signature = (model=None, machine=None, *, watching=Vec::new()))]
    fn join(
        &self,
        py: Python<'_>,
        model: Option<&Bound<'_, PyAny>>,
        machine: Option<&Bound<'_, PyAny>>,
        watching: Vec<String>,
    ) -> PyResult<Member> {
        let default = |name: &str| PyString::new(py, name).into_any();
        let model = profiles::the_model(model.unwrap_or(&default("imc4")))?;
        let machine = profiles::the_machine(machine.unwrap_or(&default("bench")))?;
        let kept = kinds(&watching)?;
        let controller = vimc4::bare(&model, &machine, &[])
            .map_err(|error| error::raise(py, "FlashError", error.to_string()))?;
        let names = model.names(controller.signals());
        let place = self.work(py, |inner| {
            let member = inner.group.join_watched(&model, &machine, kept)?;
            inner.members.push((member, names));
            Ok(inner.members.len() - 1)
        })?;
        Ok(Member { group: self.number, place })
    }

    /// Leads an output of one controller, as in `(feeder, 0, 3)` for bit 3 of its port 0, to a signal of
    /// the same or another one, as in `(mill, "input 0.3")`.
    fn wire(
        &self,
        py: Python<'_>,
        output: (Member, u16, u8),
        signal: (Member, String),
    ) -> PyResult<()> {
        let (from, to) = (self.the(output.0)?, self.the(signal.0)?);
        self.work(py, |inner| inner.group.wire((from, output.1, output.2), (to, &signal.1)))
    }

    /// Bytes arrive at a controller's line, now.
    fn send(&self, py: Python<'_>, member: Member, data: &[u8]) -> PyResult<()> {
        let member = self.the(member)?;
        self.work(py, |inner| inner.group.send(member, data))
    }

    /// A signal of a controller takes a value, now.
    fn set(
        &self,
        py: Python<'_>,
        member: Member,
        signal: &str,
        #[pyo3(from_py_with = level)] value: i32,
    ) -> PyResult<()> {
        let member = self.the(member)?;
        self.work(py, |inner| inner.group.set(member, signal, value))
    }

    // --- how time passes ---

    /// The present, in nanoseconds.
    #[getter]
    fn now(&self) -> PyResult<u64> {
        Ok(self.inner()?.group.now().as_nanos())
    }

    /// When something happens next by itself; None if everybody waits for an input.
    #[getter]
    fn due(&self, py: Python<'_>) -> PyResult<Option<u64>> {
        self.work(py, |inner| Ok(inner.group.due().map(Time::as_nanos)))
    }

    /// Lets happen the one thing that happens next, and says when that was; None if nothing does.
    fn step(&self, py: Python<'_>) -> PyResult<Option<u64>> {
        self.work(py, |inner| Ok(inner.group.step()?.map(Time::as_nanos)))
    }

    /// Lets so much time pass, with everything that happens in it, and says what time it is then.
    fn advance(&self, by: &Bound<'_, PyAny>) -> PyResult<u64> {
        let span = span(by)?;
        self.work(by.py(), |inner| Ok(inner.group.advance(span)?.as_nanos()))
    }

    /// Lets time pass up to the next thing that happens, but no more than a span.
    fn advance_to_next(&self, most: &Bound<'_, PyAny>) -> PyResult<u64> {
        let span = span(most)?;
        self.work(most.py(), |inner| Ok(inner.group.advance_to_next(span)?.as_nanos()))
    }

    /// Lets time pass up to a time in nanoseconds.
    fn run_to(&self, py: Python<'_>, at: u64) -> PyResult<()> {
        self.work(py, |inner| inner.group.run_to(Time::from_nanos(at)))
    }

    /// Lets time pass until everybody waits for an input, and says what time it is then.
    fn run_until_idle(&self, py: Python<'_>) -> PyResult<u64> {
        self.work(py, |inner| Ok(inner.group.run_until_idle()?.as_nanos()))
    }

    /// Lets time pass up to the first instant at which the condition holds of a controller, and says when
    /// that is; None if everything comes to rest before.
    fn run_until(&self, py: Python<'_>, member: Member, condition: &str) -> PyResult<Option<u64>> {
        let (member, condition) = {
            let inner = self.inner()?;
            let (member, names) = &inner.members[place(self.number, inner.members.len(), member)?];
            let condition = vimc4::read_condition(condition, names);
            let wrong =
                |error: vimc4::SyntaxError| error::raise(py, "ConditionError", error.to_string());
            (*member, condition.map_err(wrong)?)
        };
        self.work(py, |inner| Ok(inner.group.run_until(member, &condition)?.map(Time::as_nanos)))
    }

    // --- what comes out ---

    /// Takes the bytes that a controller has sent.
    fn take_bytes<'py>(&self, py: Python<'py>, member: Member) -> PyResult<Bound<'py, PyBytes>> {
        let member = self.the(member)?;
        Ok(PyBytes::new(py, &self.inner()?.group.take_bytes(member)))
    }

    /// Takes everything that has come out of a controller, in the order in which it happened, each with
    /// its time: `bytes`, and the events that are watched.
    fn drain<'py>(&self, py: Python<'py>, member: Member) -> PyResult<Bound<'py, PyList>> {
        let member = self.the(member)?;
        let outputs = self.inner()?.group.take_outputs(member);
        told(py, outputs)
    }

    /// The step counters of a controller's axes, X first.
    fn position(&self, member: Member) -> PyResult<Vec<i64>> {
        let member = self.the(member)?;
        Ok(self.inner()?.group.position(member))
    }

    /// A picture of a controller.
    fn view<'py>(&self, py: Python<'py>, member: Member) -> PyResult<Bound<'py, PyAny>> {
        let member = self.the(member)?;
        let view = self.inner()?.group.view(member);
        plain(py, &view)
    }

    /// The simulation as it is now: after `restore` it is another object.
    #[getter]
    fn simulation(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        Ok(self.inner()?.group.simulation().object.as_ref().map(|object| object.clone_ref(py)))
    }

    // --- back and forth ---

    /// The present state, with a deep copy of the simulation.
    fn snapshot(&self, py: Python<'_>) -> PyResult<GroupState> {
        let state = self.work(py, |inner| Ok(inner.group.state()))?;
        Ok(GroupState { group: self.number, state })
    }

    /// Goes back to a state of this group or of a copy of it. What has come out and was not taken is
    /// dropped.
    fn restore(&self, py: Python<'_>, state: &Bound<'_, GroupState>) -> PyResult<()> {
        let GroupState { group, state } = state.get();
        if *group != self.number {
            let text = "this is the state of another group: restore it where it was taken";
            return Err(error::raise(py, "ControlError", text.to_owned()));
        }
        self.work(py, |inner| inner.group.restore(state))
    }

    /// Another one in the same state, with a deep copy of the simulation, that goes its own way from here.
    fn copy(&self, py: Python<'_>) -> PyResult<Group> {
        Ok(Group::of(self.number, self.work(py, |inner| Ok(inner.clone()))?))
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Group> {
        self.copy(py)
    }

    fn __repr__(&self) -> String {
        match self.inner.try_lock() {
            Ok(inner) => {
                format!("<vimc4.Group of {} at {}>", inner.members.len(), inner.group.now())
            }
            Err(_) => "<vimc4.Group at work>".to_owned(),
        }
    }
}

#[pymethods]
impl Member {
    // It is a name: what remembers it and is copied means the same controller.
    fn __copy__(&self) -> Member {
        *self
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Member {
        *self
    }

    fn __repr__(&self) -> String {
        format!("<vimc4.Member {}>", self.place + 1)
    }
}

#[pymethods]
impl World {
    /// The present, in nanoseconds.
    #[getter]
    fn now(&self) -> u64 {
        self.now.as_nanos()
    }

    /// The step counters of a controller's axes, X first.
    fn position(&self, member: Member) -> PyResult<Vec<i64>> {
        let view = &self.views[place(self.group, self.views.len(), member)?];
        Ok(view.axes.iter().map(|axis| axis.position).collect())
    }

    /// What an output port of a controller shows.
    fn output(&self, py: Python<'_>, member: Member, port: u16) -> PyResult<u8> {
        let view = &self.views[place(self.group, self.views.len(), member)?];
        let outputs = || view.ports.iter().filter(|port| !port.input);
        outputs().find(|found| found.port == port).map(|found| found.value).ok_or_else(|| {
            let known: Vec<String> = outputs().map(|port| port.port.to_string()).collect();
            let text = format!("there is no output port {port}; there are {}", known.join(", "));
            error::raise(py, "DeedError", text)
        })
    }

    /// Sets a signal of a controller, when the simulation has done what it does.
    fn set(
        &self,
        py: Python<'_>,
        member: Member,
        signal: &str,
        #[pyo3(from_py_with = level)] value: i32,
    ) -> PyResult<()> {
        let place = place(self.group, self.views.len(), member)?;
        vimc4::settable(&self.signals[place], signal, value)
            .map_err(|error| error::raise(py, "DeedError", error.to_string()))?;
        match &mut *lock(&self.set) {
            Some(set) => set.push((place, signal.to_owned(), value)),
            None => {
                let text = "this world is over, for its simulation has returned; set signals in the world that \
                            the next call gives";
                return Err(error::raise(py, "ControlError", text.to_owned()));
            }
        }
        Ok(())
    }
}
