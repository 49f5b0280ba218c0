//! Every fault that can strike what a host does, one after the other.

use std::sync::{Arc, Mutex};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use vimc4::device::TimedInput;
use vimc4::device::{Controller, Line};
use vimc4::{EventFilter, Faulting, Report, ReportKind, Sink};
use vimc4_sweep::{Case, Choice, Exit, Profile, Results, Row, Session};

use crate::convert::plain;
use crate::emulator::Core;
use crate::waiting::lock;
use crate::{error, profiles};

/// What was given to a controller.
#[derive(Clone, Debug, Default)]
pub(crate) struct Given(Arc<Mutex<Vec<TimedInput>>>);

impl Given {
    /// All of it so far, as text.
    pub(crate) fn told(&self) -> PyResult<String> {
        told(&*lock(&self.0))
    }
}

impl Sink for Given {
    fn wants(&self) -> EventFilter {
        EventFilter::INPUTS
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        if let ReportKind::Input { input, .. } = &report.what {
            lock(&self.0).push(TimedInput { at: report.at, input: input.clone() });
        }
    }
}

/// What a host has done without a fault, and all the points at which one can strike it.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct SweepSession {
    session: Session<Line<Controller>>,
    model: Profile,
    machine: Profile,
}

#[pymethods]
impl SweepSession {
    #[new]
    fn new(
        py: Python<'_>,
        model: &Bound<'_, PyAny>,
        machine: &Bound<'_, PyAny>,
        given: &str,
        choice: &str,
    ) -> PyResult<SweepSession> {
        let (model, site) = (profiles::the_model(model)?, profiles::the_machine(machine)?);
        let controller = Controller::new(&model, Arc::clone(&site), b"")
            .map_err(|error| error::raise(py, "Error", error.to_string()))?;
        let given: Vec<TimedInput> = read(given)?;
        let choice: Choice = read(choice)?;
        let end = given.last().map(|given| given.at).unwrap_or_default();
        let ends = vimc4::Handling::of(&model).ends;
        let line = Line::ideal(controller);
        let session = py.detach(|| Session::new(line, &given, end, ends, &choice));
        let (model, machine) =
            (Profile::new(model.name(), &model), Profile::new(&site.name, &*site));
        Ok(SweepSession { session, model, machine })
    }

    /// How many points there are.
    #[getter]
    fn points(&self) -> u64 {
        self.session.plan().len()
    }

    /// In what another run without a fault differs first, in words; None if a sweep can build on it.
    fn difference(&self, again: &SweepSession) -> Option<String> {
        self.session.difference(&again.session)
    }

    /// What is broken at a point.
    fn describe(&self, number: u64) -> PyResult<String> {
        let plan = self.session.plan();
        let point = plan.point(number).ok_or_else(|| no_point(number))?;
        Ok(plan.describe(self.session.clean(), &point))
    }

    /// Begins the faults of a point in a controller that has just been started.
    fn begin(&self, py: Python<'_>, core: &Bound<'_, Core>, number: u64) -> PyResult<()> {
        let point = self.session.plan().point(number).ok_or_else(|| no_point(number))?;
        for input in self.session.begin(&point) {
            if let vimc4::device::OwnedInput::Fault(Faulting::Begin(_, fault)) = input {
                core.get().begin_fault(py, fault)?;
            }
        }
        Ok(())
    }

    /// What came of a point with a host that has given this and ended so, as a text for `SweepResults`.
    /// `ending` is `returned`, `raised`, `asserted` if an assertion of the test failed, `unmet` if an expectation
    /// was not met, or `hung`.
    fn judge(&self, py: Python<'_>, number: u64, given: &str, ending: &str) -> PyResult<String> {
        let given: Vec<TimedInput> = read(given)?;
        let exit = match ending {
            "returned" => Exit::Code(0),
            "raised" => Exit::Code(1),
            "asserted" => Exit::Asserted,
            "unmet" => Exit::Unmet,
            "hung" => Exit::Hung,
            _ => return Err(PyValueError::new_err(format!("`{ending}` is not an ending"))),
        };
        let judged = py.detach(|| self.session.judge(number, &given, exit));
        let (found, case) = judged.ok_or_else(|| no_point(number))?;
        told(&(found.point, found.outcome, found.size, case))
    }
}

/// What came of the points that were tried, wherever and in whatever order.
#[pyclass(frozen, module = "vimc4._vimc4")]
pub(crate) struct SweepResults(Mutex<Results>);

#[pymethods]
impl SweepResults {
    #[new]
    fn new(session: &SweepSession, of: String) -> SweepResults {
        let SweepSession { session, model, machine } = session;
        let subject = session.subject(of, model.clone(), machine.clone());
        SweepResults(Mutex::new(Results::of(subject)))
    }

    /// Adds what `judge` has said, and returns the lines that a file needs because of it.
    fn add(&self, judged: &str) -> PyResult<String> {
        let (point, outcome, size, case): (u64, _, u64, Case) = read(judged)?;
        lines(lock(&self.0).add(point, &outcome, size, || Some(case)))
    }

    /// Takes what such a file has.
    fn read(&self, text: &str) -> PyResult<()> {
        let read = lock(&self.0).read(text);
        read.map(drop).map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// Everything, as lines of JSON in an order that only depends on what was found.
    fn lines(&self) -> PyResult<String> {
        lines(lock(&self.0).lines())
    }

    /// The first line of a file of it.
    fn head(&self) -> PyResult<String> {
        lines(lock(&self.0).head())
    }

    /// Whether a point is done.
    fn has(&self, number: u64) -> bool {
        lock(&self.0).has(number)
    }

    /// The outcomes, the worst first.
    fn groups<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let results = lock(&self.0);
        let groups: Vec<Told<'_>> = results
            .groups()
            .into_iter()
            .map(|group| Told {
                title: group.outcome.title(),
                bad: !group.outcome.verdicts.is_empty(),
                points: group.points,
                point: group.case.map(|case| case.point),
                broken: group.case.map(|case| case.broken.as_str()),
                heard: group.outcome.heard(),
                did: group.outcome.did(),
                machine: group.case.map(|case| case.machine.as_str()),
                should: group.case.and_then(|case| case.should.as_deref()),
            })
            .collect();
        plain(py, &groups)
    }
}

/// An outcome and its smallest case, in words.
#[derive(Serialize)]
struct Told<'a> {
    title: &'a str,
    bad: bool,
    points: u64,
    point: Option<u64>,
    broken: Option<&'a str>,
    heard: String,
    did: String,
    machine: Option<&'a str>,
    should: Option<&'a str>,
}

fn no_point(number: u64) -> PyErr {
    PyValueError::new_err(format!("there is no point {number}"))
}

fn read<T: DeserializeOwned>(text: &str) -> PyResult<T> {
    serde_json::from_str(text).map_err(|error| PyValueError::new_err(error.to_string()))
}

fn told<T: Serialize + ?Sized>(value: &T) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| PyValueError::new_err(error.to_string()))
}

fn lines(rows: impl IntoIterator<Item = Row>) -> PyResult<String> {
    rows.into_iter().map(|row| Ok(told(&row)? + "\n")).collect()
}
