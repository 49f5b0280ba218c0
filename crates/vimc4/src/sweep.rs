//! Every fault that can strike what a host does, one after the other.
//!
//! A [`Stand`] is the controller that a host is tried with. It is tried once without a fault, which gives
//! a [`Session`] with all its points; then once for each point, and the session judges what came of it.
//!
//! ```
//! use std::io::{Read, Write};
//! use vimc4::sweep::{Choice, Exit, Stand, Trial};
//!
//! /// Moves, and does not heed the answer.
//! fn host(trial: &Trial) -> std::io::Result<()> {
//!     let mut port = trial.emulator().connect().map_err(std::io::Error::other)?;
//!     for line in ["@07\r", "@0R7\r", "@0A800,900,0,900,0,900,0,900\r"] {
//!         port.write_all(line.as_bytes())?;
//!         port.set_timeout(std::time::Duration::from_millis(200));
//!         let _ = port.read(&mut [0; 8]);
//!     }
//!     Ok(())
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let stand = Stand::new("imc-s8", "mill")?;
//! let trial = stand.begin(&[])?;
//! host(&trial)?;
//! let choice = Choice { live: true, ..Choice::default() };
//! let session = stand.session(&trial.end()?, &choice)?;
//!
//! // A quarter into the last motion somebody presses STOP, and the host does not notice.
//! let points = (0..session.plan().len()).filter_map(|number| session.plan().point(number));
//! let point = points.filter(|point| session.plan().describe(session.clean(), point)
//!     .starts_with("STOP was pressed when X was at 200")).next().unwrap();
//! let trial = stand.begin(&session.plan().faults(session.clean(), &point))?;
//! host(&trial)?;
//! let (found, case) = session.judge(point.number, &trial.end()?, Exit::Code(0)).unwrap();
//! assert_eq!(found.outcome.title(), "it reports success, but the machine is not where it should be");
//! assert!(case.machine.starts_with("X at 2"), "{}", case.machine);
//! # Ok(())
//! # }
//! ```

use std::sync::{Arc, Mutex, PoisonError};

use vimc4_catalogue::{Controller, Handling, Machine, Model};
use vimc4_device::{Fault, Line, TimedInput};
use vimc4_host::{Clock, EventFilter, Report, ReportKind, Sink};

pub use vimc4_sweep::*;

use crate::emulator::Emulator;
use crate::error::Error;
use crate::profiles;

/// The controller that a host is tried with, again and again.
#[derive(Clone, Debug)]
pub struct Stand {
    model: Model,
    machine: Arc<Machine>,
}

/// A host with a controller of its own, for one run. Time passes whenever nobody is busy.
#[derive(Debug)]
pub struct Trial {
    emulator: Emulator,
    given: Given,
}

/// What was given to a controller.
#[derive(Clone, Debug, Default)]
struct Given(Arc<Mutex<Vec<TimedInput>>>);

impl Sink for Given {
    fn wants(&self) -> EventFilter {
        EventFilter::INPUTS
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        if let ReportKind::Input { input, .. } = &report.what {
            let given = TimedInput { at: report.at, input: input.clone() };
            // Every entry is whole at any time.
            self.0.lock().unwrap_or_else(PoisonError::into_inner).push(given);
        }
    }
}

impl Stand {
    /// A controller of this model on this machine: built-in names, or profile files.
    ///
    /// # Errors
    ///
    /// If there is no such profile.
    pub fn new(model: &str, machine: &str) -> Result<Stand, Error> {
        Ok(Stand { model: profiles::model(model)?, machine: profiles::machine(machine)? })
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The machine.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Starts a controller with these faults: a port within the process, a pseudo-terminal where there are
    /// any, and a TCP port.
    ///
    /// # Errors
    ///
    /// If it cannot be started.
    pub fn begin(&self, faults: &[Fault]) -> Result<Trial, Error> {
        let given = Given::default();
        let builder = Emulator::builder()
            .with_model(self.model.clone())
            .with_machine(Arc::clone(&self.machine))
            .time(Clock::Instant)
            .record(false)
            .sink(given.clone())
            .tcp("127.0.0.1:0");
        #[cfg(all(unix, feature = "pty"))]
        let builder = builder.pty(true);
        let emulator = builder.start()?;
        for fault in faults {
            // It stays.
            emulator.fault(fault.clone())?.keep();
        }
        Ok(Trial { emulator, given })
    }

    /// The session of a host without a fault.
    ///
    /// # Errors
    ///
    /// If there can be no such controller.
    pub fn session(
        &self,
        given: &[TimedInput],
        choice: &Choice,
    ) -> Result<Session<Line<Controller>>, Error> {
        let controller = Controller::new(&self.model, Arc::clone(&self.machine), b"");
        let controller = controller
            .map_err(|source| Error::Flash { path: std::path::PathBuf::new(), source })?;
        let end = given.last().map(|given| given.at).unwrap_or_default();
        let ends = Handling::of(&self.model).ends;
        Ok(Session::new(Line::ideal(controller), given, end, ends, choice))
    }

    /// What a sweep of this session is of: with the same host, model, machine and choice it is another part
    /// of the same.
    #[must_use]
    pub fn subject(&self, of: String, session: &Session<Line<Controller>>) -> Subject {
        let model = Profile::new(self.model.name(), &self.model);
        session.subject(of, model, Profile::new(&self.machine.name, &*self.machine))
    }
}

impl Trial {
    /// The controller, for the host to find.
    #[must_use]
    pub fn emulator(&self) -> &Emulator {
        &self.emulator
    }

    /// Ends the run: everything that was given to the controller, with its time.
    ///
    /// # Errors
    ///
    /// If the controller has ended already.
    pub fn end(self) -> Result<Vec<TimedInput>, Error> {
        // What the host has written last has arrived then.
        self.emulator.now()?;
        let mut given = self.given.0.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(std::mem::take(&mut *given))
    }
}
