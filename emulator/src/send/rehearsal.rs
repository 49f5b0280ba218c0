//! What a job does on a virtual controller, before a real one gets it.

use std::io::{self, Write};
use std::sync::Arc;
use std::time::Duration;

use vimc4::device::Controller;
use vimc4_ncp::Problem;
use vimc4_ncp::job::{InputTest, Question};

use super::Arguments;
use crate::failure::Failure;
use crate::job::perform::{Attendant, Decision, Ending, Work, perform, refusal, shown};
use crate::job::source::Site;
use crate::job::virtual_time::Virtual;
use crate::run::driver::{Driver, Halt};
use crate::run::meter::{Meter, units};
use crate::run::report::{grouped, seconds};

/// How long a rehearsal may take, in virtual time.
const REHEARSAL: Duration = Duration::from_secs(1_000 * 3_600);

/// What a job did on a virtual controller.
pub(super) struct Rehearsal {
    ending: Result<Ending, Halt>,
    pub(super) link: Virtual,
}

/// Nobody stands by in a rehearsal, and everything is accepted.
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

/// Carries a job out on a virtual controller.
pub(super) fn rehearse(work: &Work<'_>, site: &Site) -> Result<Rehearsal, Failure> {
    let controller =
        Controller::new(&site.model, Arc::clone(&site.machine), b"").map_err(Failure::midway)?;
    let mut meter = Meter::new(&site.machine);
    meter.top = Some(0);
    let mut link = Virtual::new(Driver::new(controller, meter, None), true);
    link.driver.stop_at(link.driver.now() + REHEARSAL);
    let ending = perform(&mut work.clone(), &mut link, &mut Nobody);
    Ok(Rehearsal { ending, link })
}

impl Rehearsal {
    /// Why a controller would not carry it out.
    pub(super) fn objection(
        &self,
        arguments: &Arguments,
        text: &str,
        list: bool,
    ) -> Option<Failure> {
        let name = arguments.job.name();
        match &self.ending {
            Ok(Ending::Refused { line, sent, answer }) => {
                let refusal = refusal(answer);
                // A command list may build on what the controller was told before.
                let help = match list {
                    true => "it is sent nevertheless, in case the controller knows more",
                    false => "nothing was sent",
                };
                let (model, sent) = (&arguments.job.model, shown(sent));
                let message = format!("the model {model} would answer {refusal} to {sent}; {help}");
                Some(Failure::at_line(message, &name, text, *line))
            }
            Err(_) => Some(Failure::midway(format!(
                "{name} would not come to its end; it waits for something in line {}",
                self.link.line
            ))),
            Ok(_) => None,
        }
    }

    /// Says what is going to happen at the machine.
    pub(super) fn announce(&self, port: &str, site: &Site) {
        let meter = &self.link.driver.meter;
        let units = units(&site.machine);
        let mut text = format!("What is at {port} will do this:\n");
        if let Some((low, high)) = meter.extent {
            for axis in site.target.axes.iter() {
                let (name, unit) = (site.model.axis_names()[axis], units[axis]);
                let shown = |steps: i64| format!("{:.3}", steps as f64 * unit.per_step);
                text += &format!(
                    "  {name} {} to {} {}\n",
                    shown(low[axis]),
                    shown(high[axis]),
                    unit.name
                );
            }
        }
        text += &format!(
            "  up to {} Hz, {} in all; places count from the reference points, and runs to these \
             come first\n\
             Ctrl-C halts a motion along its ramp and ends the job.\n",
            grouped(
                i64::try_from((meter.top.unwrap_or_default() + 500_000) / 1_000_000)
                    .unwrap_or(i64::MAX)
            ),
            seconds(self.link.elapsed())
        );
        let _ = io::stderr().lock().write_all(text.as_bytes());
    }
}
