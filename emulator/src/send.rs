//! `vimc4 send`: a job or a command list to a controller, virtual or real.

mod rehearsal;
mod wire;

use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use vimc4::Handling;
use vimc4_ncp::job::Job;

use crate::conform::announce::confirm;
use crate::endings;
use crate::failure::Failure;
use crate::job::operator::Operator;
use crate::job::perform::{Ending, Link, Work, perform, refusal, shown};
use crate::job::source::{self, JobArguments, Site};
use crate::ncp::check;
use crate::port::{Port, PortError};
use crate::run::report::seconds;
use crate::run::script::{Kind, Script};

use rehearsal::{Rehearsal, rehearse};
use wire::{Broken, Wire};

#[derive(clap::Args)]
#[command(
    long_about = "\
Send a job or a command list to a controller, virtual or real

A job is a file in the isel NC intermediate format; a command list is a file whose first command
begins with @. Each command is sent when the one before was answered. The same job is carried out in
virtual time first: what the virtual controller refuses is not sent, and from it comes the time that
remains.

Enter stops a motion along its ramp, and Enter again goes on with it, as does START at the panel. An
error reply ends the job. Ctrl-C sends 253, which brakes, and ends the job; what is switched on stays
on. Where the port leads to a real machine the travel is shown first, and somebody has to agree.",
    after_long_help = "\
Examples:
  vimc4 send part.ncp --to ./vimc4.pty --machine mill
  vimc4 send part.ncp --to /dev/ttyUSB0 --model imc-s8 --machine mine.toml
  vimc4 send commands.txt --to tcp:127.0.0.1:4004 --yes"
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    job: JobArguments,
    /// Where the controller is: a serial port, a pseudo-terminal, or host:port
    #[arg(long, value_name = "PORT")]
    to: String,
    /// The speed of a serial port; the model's if nothing is said
    #[arg(long, value_name = "RATE")]
    baud: Option<u32>,
    /// Agree beforehand, and accept every HALT, GETTOOL and WPTEACH
    #[arg(long)]
    yes: bool,
    /// Pass every WAITBIT and WAITPORT
    #[arg(long)]
    skip_waits: bool,
    /// Show every command and its answer
    #[arg(short, long)]
    verbose: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let job = &arguments.job;
    let site = job.site()?;
    let bytes = job.bytes()?;
    let list = command_list(job, &bytes)?;
    let text = source::decoded(&bytes);
    let work = match list {
        Some(list) => Work::List(list.into_iter()),
        None => {
            check::before(job, &site, &text)?;
            Work::Job(Box::new(Job::new(&text, &site.target, job.reading.options())))
        }
    };
    let rehearsal = rehearse(&work, &site)?;
    let list = matches!(work, Work::List(_));
    if let Some(failure) = rehearsal.objection(arguments, &text, list) {
        if !list && !job.reading.lenient {
            return Err(failure);
        }
        failure.report();
    }
    let port = Port::open(&arguments.to, arguments.baud.unwrap_or(site.model.baud()))
        .map_err(Failure::usage)?;
    if !port.is_virtual() {
        rehearsal.announce(&arguments.to, &site);
        if !arguments.yes {
            confirm()?;
        }
    }
    // Before that Ctrl-C just ends the program: nothing moves yet.
    endings::interrupt(&port)?;
    Sending::new(arguments, port, rehearsal, &site, &text).run(work, &text)
}

/// Commands as they are sent, each with its line in the file.
type List = Vec<(u32, Vec<u8>)>;

/// The commands of a command list; `None` if it is a job file.
fn command_list(job: &JobArguments, bytes: &[u8]) -> Result<Option<List>, Failure> {
    let first = bytes.iter().copied().find(|byte| !byte.is_ascii_whitespace());
    let script = match first {
        Some(b'@' | b';' | b'#') => Script::parse(bytes).filter(|s| s.kind == Kind::Commands),
        _ => None,
    };
    let Some(script) = script else { return Ok(None) };
    if job.reading.no_ref || job.reading.lenient || !job.zeros.is_empty() {
        return Err(Failure::usage(format!(
            "{} is a command list, which is sent as it is; --no-ref, --lenient, --zero and --wpreg \
             are for job files",
            job.name()
        )));
    }
    let number = |line: &crate::run::script::Line| {
        line.number.and_then(|number| u32::try_from(number).ok()).unwrap_or_default()
    };
    Ok(Some(script.lines.iter().map(|line| (number(line), line.whole())).collect()))
}

/// A job on its way to a controller.
struct Sending<'a> {
    arguments: &'a Arguments,
    link: Wire,
    operator: Operator<'a>,
    handling: Handling,
}

impl<'a> Sending<'a> {
    fn new(
        arguments: &'a Arguments,
        port: Port,
        rehearsal: Rehearsal,
        site: &Site,
        text: &'a str,
    ) -> Sending<'a> {
        let bar = (io::stderr().is_terminal() && !arguments.verbose).then(|| {
            let bar = ProgressBar::new(rehearsal.link.elapsed().as_millis() as u64);
            let style = ProgressStyle::with_template("{bar:30} {msg}");
            style.into_iter().for_each(|style| bar.set_style(style));
            bar
        });
        let link = Wire::new(port, rehearsal.link.times, bar.clone());
        let mut operator =
            Operator::new(text, arguments.yes, arguments.skip_waits, arguments.verbose);
        operator.bar = bar;
        operator.listen(link.stop_key());
        Sending { arguments, link, operator, handling: Handling::of(&site.model) }
    }

    fn run(mut self, mut work: Work<'_>, text: &str) -> Result<ExitCode, Failure> {
        let name = self.arguments.job.name();
        let began = Instant::now();
        let ending = self
            .link
            .quiet()
            .map_err(Broken::from)
            .and_then(|()| perform(&mut work, &mut self.link, &mut self.operator));
        if let Some(bar) = self.link.bar() {
            bar.finish_and_clear();
        }
        match ending {
            Ok(Ending::Done) => {
                let took = Duration::from_millis(began.elapsed().as_millis() as u64);
                let _ = writeln!(io::stdout(), "{name}: done in {}{}", seconds(took), self.place());
                Ok(ExitCode::SUCCESS)
            }
            Ok(Ending::Ended { line }) => {
                let _ = writeln!(io::stdout(), "{name}: ended in line {line}{}", self.place());
                Ok(ExitCode::from(3))
            }
            Ok(Ending::Impossible { line }) => Err(Failure::at_line(
                format!("line {line} cannot be carried out{}", self.place()),
                &name,
                text,
                line,
            )),
            Ok(Ending::Refused { line, sent, answer }) => {
                let message = format!(
                    "the controller answered {} to {}{}; the job has ended there",
                    refusal(&answer),
                    shown(&sent),
                    self.place()
                );
                Err(Failure::at_line(message, &name, text, line))
            }
            Err(broken) => Err(self.broken(broken, &name, text)),
        }
    }

    /// Where the axes are, as far as the controller says.
    fn place(&mut self) -> String {
        let question = format!("{}\r", self.handling.position);
        let answer = self.link.command(question.as_bytes()).unwrap_or_default();
        let Some(places) = self.handling.read_position(&answer) else { return String::new() };
        let axes = self.handling.model().axis_names().iter().zip(places);
        let places: Vec<String> = axes.map(|(axis, steps)| format!("{axis} {steps}")).collect();
        format!(", at {} steps", places.join(", "))
    }

    fn broken(&mut self, broken: Broken, name: &str, text: &str) -> Failure {
        let line = self.link.line();
        match broken {
            Broken::Silent => Failure::usage(format!(
                "nothing answers at {}; check that it is the right port, that the controller is on, \
                 and the speed of the line",
                self.link.name()
            )),
            Broken::Port(PortError::Interrupted) => {
                let halted = self.link.halt();
                let place = self.place();
                let halted = match halted {
                    true => "253 was sent, and the motion has come to rest along its ramp",
                    false => "253 was sent, and nothing was moving",
                };
                let message = format!(
                    "interrupted: {halted}{place}; what is switched on, such as the spindle, is \
                     still on"
                );
                Failure::at_line(message, name, text, line)
            }
            Broken::Port(PortError::Gone(why)) => Failure::at_line(
                format!("{} is gone: {why}; the job has ended there", self.link.name()),
                name,
                text,
                line,
            ),
        }
    }
}
