//! What a job does on a virtual controller, before a real one gets it.

use std::io::{self, Write};
use std::sync::Arc;
use std::time::Duration;

use vimc4_catalogue::{Controller, Handling, Machine, Model};
use vimc4_device::{Grouped, Point};
use vimc4_ncp::Problem;
use vimc4_ncp::job::{InputTest, Question};

use crate::failure::Failure;
use crate::job::channel::{Attendant, Channel, Decision, Ending};
use crate::job::perform::{Work, perform, shown};
use crate::job::virtual_time::Virtual;
use crate::run::driver::{Driver, Halt};
use crate::run::meter::Meter;
use crate::run::report::seconds;

/// How long a rehearsal may take, in virtual time.
const REHEARSAL: Duration = Duration::from_secs(1_000 * 3_600);

/// How fast a virtual machine is brought to where the real one is, in Hz.
const FAST: u64 = 5_000;

/// What a job did on a virtual controller.
pub(super) struct Rehearsal {
    ending: Result<Ending, Halt>,
    pub(super) link: Virtual,
    machine: Arc<Machine>,
}

/// Whether something is sent although the virtual controller refuses it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nevertheless(pub(super) bool);

/// A rehearsal has no attendant, and everything is accepted.
struct Nobody;

impl Attendant for Nobody {
    fn ask(&mut self, _line: u32, _question: Question) -> Decision {
        Decision::GoOn
    }

    fn wait(&mut self, _line: u32, _test: InputTest) -> Decision {
        Decision::Skip
    }

    fn stopped(&mut self, _line: u32) -> Decision {
        Decision::End
    }

    fn answered(&mut self, _line: u32, _sent: &[u8], _answer: &[u8]) {}

    fn object(&mut self, _problem: Problem) {}
}

/// Carries a job out on a virtual controller with the counters `here`.
pub(super) fn rehearse(
    work: &Work<'_>,
    model: &Model,
    machine: &Arc<Machine>,
    here: Point,
) -> Result<Rehearsal, Failure> {
    let controller = Controller::new(model, Arc::clone(machine), b"").map_err(Failure::midway)?;
    let mut driver = Driver::new(controller, Meter::new(machine), None);
    driver.stop_at(driver.now() + REHEARSAL);
    let handling = Handling::of(model);
    let mut link = Virtual::new(driver, handling.clone(), true);
    if here != Point::default() {
        // That way belongs to no job.
        for line in handling.moving(here, FAST) {
            let _ = link.command(format!("{line}\r").as_bytes());
        }
        link.driver.meter = Meter::new(machine);
    }
    link.driver.meter.top = Some(0);
    let ending = perform(&mut work.clone(), &mut link, &mut Nobody);
    Ok(Rehearsal { ending, link, machine: Arc::clone(machine) })
}

impl Rehearsal {
    /// Why a controller would not carry the file of that name out. A command list, of which it is
    /// said whether it is sent nevertheless, may build on what the controller was told before.
    pub(super) fn objection(
        &self,
        name: &str,
        text: &str,
        list: Option<Nevertheless>,
    ) -> Option<Failure> {
        match &self.ending {
            Ok(Ending::Refused { line, sent, answer }) => {
                let refusal = self.link.refusal(sent, answer).replace("; ", ", ");
                let help = match list {
                    Some(Nevertheless(true)) => {
                        "it is sent nevertheless, in case the controller knows more; what is said \
                         of travel and time ends before it"
                    }
                    Some(Nevertheless(false)) => {
                        "nothing was sent; --refused-too sends it nevertheless, where the \
                         controller was told more before"
                    }
                    None => "nothing was sent",
                };
                let (model, sent) = (self.link.handling().model().name(), shown(sent));
                let message =
                    format!("the model {model} would answer {sent} with {refusal}; {help}");
                Some(Failure::at_line(message, name, text, *line))
            }
            Err(_) => Some(Failure::midway(format!(
                "{name} would not come to its end; it waits for something in line {}",
                self.link.line
            ))),
            Ok(_) => None,
        }
    }

    /// Says what is going to happen at the machine.
    pub(super) fn announce(&self, port: &str) {
        let meter = &self.link.driver.meter;
        let handling = self.link.handling();
        let units = self.machine.measures();
        let mut text = format!("What is at {port} will do this:\n");
        if let Some((low, high)) = meter.extent {
            let names = handling.model().axis_names().iter().enumerate();
            for (axis, name) in names.filter(|(axis, _)| self.machine.fits(*axis)) {
                let unit = units[axis];
                let shown = |steps: i64| format!("{:.3}", steps as f64 * unit.per_step);
                text += &format!(
                    "  {name} {} to {} {}\n",
                    shown(low[axis]),
                    shown(high[axis]),
                    unit.name
                );
            }
        }
        let top = (meter.top.unwrap_or_default() + 500_000) / 1_000_000;
        text += &format!(
            "  up to {} Hz, {} in all; places count from the reference points, and runs to these \
             come first\n{}\n",
            Grouped(i64::try_from(top).unwrap_or(i64::MAX)),
            seconds(self.link.elapsed()),
            handling.warning
        );
        let _ = io::stderr().lock().write_all(text.as_bytes());
    }
}
