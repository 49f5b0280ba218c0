//! `vimc4 send`: a job or a command list to a controller, virtual or real.

use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use vimc4::device::Controller;
use vimc4::{Handling, escape};
use vimc4_ncp::Problem;
use vimc4_ncp::job::{InputTest, Job, Question};

use crate::conform::announce::confirm;
use crate::endings;
use crate::failure::Failure;
use crate::job::operator::Operator;
use crate::job::perform::{Attendant, Decision, Ending, Link, Work, perform, shown};
use crate::job::rehearsal::Virtual;
use crate::job::source::{self, JobArguments, Site};
use crate::ncp::check;
use crate::port::{Port, PortError};
use crate::run::driver::{Driver, Halt};
use crate::run::meter::{Meter, units};
use crate::run::report::{grouped, seconds};
use crate::run::script::{Kind, Script};

/// How long the first answer may take: nothing moves then.
const FIRST: Duration = Duration::from_secs(3);
/// How long a line must be silent before an answer of unknown length is over.
const PAUSE: Duration = Duration::from_millis(100);
/// How long a controller may take to come to rest.
const HALTING: Duration = Duration::from_secs(10);
/// A motion that takes so much longer than in rehearsal is worth a remark.
const LATE: Duration = Duration::from_secs(30);
/// How often the bar moves.
const TICK: Duration = Duration::from_millis(200);
/// How long a rehearsal may take, in virtual time.
const REHEARSAL: Duration = Duration::from_secs(1_000 * 3_600);

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
    let site = Site::new(&job.model, &job.machine)?;
    let bytes = source::read(&job.file)?;
    let list = command_list(job, &bytes)?;
    let text = source::decoded(&job.file, &bytes)?;
    let work = match list {
        Some(list) => Work::List(list.into_iter()),
        None => {
            check::before(job, &site, &text)?;
            let target = &site.target;
            Work::Job { job: Box::new(Job::new(&text, target, job.reading.options())), target }
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
    endings::interrupt(&port)?;
    if !port.is_virtual() {
        rehearsal.announce(&arguments.to, &site);
        if !arguments.yes {
            confirm()?;
        }
    }
    Sending::new(arguments, port, rehearsal, &text).run(work, &site, &text)
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
    if job.reading.no_ref || job.reading.lenient {
        return Err(Failure::usage(format!(
            "{} is a command list, which is sent as it is; --no-ref and --lenient are for job files",
            job.file.display()
        )));
    }
    let number = |line: &crate::run::script::Line| {
        line.number.and_then(|number| u32::try_from(number).ok()).unwrap_or_default()
    };
    Ok(Some(script.lines.iter().map(|line| (number(line), line.whole())).collect()))
}

/// What a job did on a virtual controller.
struct Rehearsal {
    ending: Result<Ending, Halt>,
    link: Virtual,
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

fn rehearse(work: &Work<'_>, site: &Site) -> Result<Rehearsal, Failure> {
    let controller =
        Controller::new(&site.model, Arc::clone(&site.machine), b"").map_err(Failure::midway)?;
    let mut link = Virtual::new(Driver::new(controller, Meter::new(&site.machine), None), true);
    link.driver.stop_at(link.driver.now() + REHEARSAL);
    let ending = perform(&mut work.clone(), &mut link, &mut Nobody);
    Ok(Rehearsal { ending, link })
}

impl Rehearsal {
    /// Why a controller would not carry it out.
    fn objection(&self, arguments: &Arguments, text: &str, list: bool) -> Option<Failure> {
        let name = arguments.job.file.display().to_string();
        match &self.ending {
            Ok(Ending::Refused { line, sent, answer }) => {
                let refusal = vimc4::Family::Isel.refusal(answer).unwrap_or_else(|| escape(answer));
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
    fn announce(&self, port: &str, site: &Site) {
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
            grouped(i64::try_from((meter.top + 500_000) / 1_000_000).unwrap_or(i64::MAX)),
            seconds(self.link.elapsed())
        );
        let _ = io::stderr().lock().write_all(text.as_bytes());
    }
}

/// A job on its way to a controller.
struct Sending<'a> {
    arguments: &'a Arguments,
    link: Wire,
    operator: Operator<'a>,
    handling: Option<Handling>,
}

impl<'a> Sending<'a> {
    fn new(
        arguments: &'a Arguments,
        port: Port,
        rehearsal: Rehearsal,
        text: &'a str,
    ) -> Sending<'a> {
        let mut operator =
            Operator::new(text, arguments.yes, arguments.skip_waits, arguments.verbose);
        let moving = Arc::new(AtomicBool::new(false));
        let (woken, mut halt) = (port.waker(), port.sideways());
        let under_way = Arc::clone(&moving);
        // Enter while something is under way is the stop key.
        operator.listen(move |line| {
            let stops = line.trim().is_empty() && under_way.load(Ordering::Relaxed);
            match &mut halt {
                Some(halt) if stops => halt(&[253]),
                _ => woken(),
            }
            stops
        });
        let bar = (io::stderr().is_terminal() && !arguments.verbose).then(|| {
            let bar = ProgressBar::new(rehearsal.link.elapsed().as_millis() as u64);
            let style = ProgressStyle::with_template("{bar:30} {msg}");
            style.into_iter().for_each(|style| bar.set_style(style));
            bar
        });
        operator.bar = bar.clone();
        let link = Wire {
            port,
            moving,
            times: rehearsal.link.times,
            done: 0,
            answered: false,
            bar,
            line: 0,
        };
        Sending { arguments, link, operator, handling: None }
    }

    fn run(mut self, mut work: Work<'_>, site: &Site, text: &str) -> Result<ExitCode, Failure> {
        self.handling = Some(Handling::of(&site.model));
        let name = self.arguments.job.file.display().to_string();
        let began = Instant::now();
        let ending = self
            .link
            .quiet()
            .map_err(Broken::from)
            .and_then(|()| perform(&mut work, &mut self.link, &mut self.operator));
        if let Some(bar) = &self.link.bar {
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
                let refusal = vimc4::Family::Isel
                    .refusal(&answer)
                    .unwrap_or_else(|| format!("`{}`", escape(&answer)));
                let message = format!(
                    "the controller answered {refusal} to {}{}; the job has ended there",
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
        let answer = self.link.command(b"@0P\r").unwrap_or_default();
        let places = self.handling.as_ref().and_then(|handling| handling.read_position(&answer));
        let Some(places) = places else { return String::new() };
        let axes = ["X", "Y", "Z", "A"].iter().zip(places);
        let places: Vec<String> = axes.map(|(axis, steps)| format!("{axis} {steps}")).collect();
        format!(", at {} steps", places.join(", "))
    }

    fn broken(&mut self, broken: Broken, name: &str, text: &str) -> Failure {
        let line = self.link.line;
        match broken {
            Broken::Silent => Failure::usage(format!(
                "nothing answers at {}; check that it is the right port, that the controller is on, \
                 and the speed of the line",
                self.link.port.name()
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
                format!("{} is gone: {why}; the job has ended there", self.link.port.name()),
                name,
                text,
                line,
            ),
        }
    }
}

/// A controller at a port.
struct Wire {
    port: Port,
    /// Whether an answer is awaited.
    moving: Arc<AtomicBool>,
    /// When each thing was done in rehearsal, in ms.
    times: Vec<u32>,
    /// How many things were done.
    done: usize,
    /// Whether it has ever answered.
    answered: bool,
    bar: Option<ProgressBar>,
    /// The line that is under way.
    line: u32,
}

/// Why a controller does not answer any more.
enum Broken {
    Silent,
    Port(PortError),
}

impl From<PortError> for Broken {
    fn from(error: PortError) -> Broken {
        Broken::Port(error)
    }
}

impl Wire {
    /// Lets everything pass that was sent before.
    fn quiet(&mut self) -> Result<(), PortError> {
        while self.port.next(Instant::now() + PAUSE)?.is_some() {}
        Ok(())
    }

    /// Brakes what moves. Says whether something did.
    fn halt(&mut self) -> bool {
        let moved = self.moving.load(Ordering::Relaxed);
        let _ = self.port.send(&[253]);
        let until = Instant::now() + HALTING;
        while moved && Instant::now() < until {
            match self.port.next(until) {
                Ok(Some(_)) | Err(PortError::Gone(_)) => break,
                Ok(None) | Err(PortError::Interrupted) => {}
            }
        }
        self.moving.store(false, Ordering::Relaxed);
        moved
    }

    /// How long the next thing took in rehearsal, and when it began there.
    fn expected(&self) -> (Duration, Duration) {
        let at = |place: usize| {
            let millis = self.times.get(place).or(self.times.last()).copied().unwrap_or_default();
            Duration::from_millis(millis.into())
        };
        let began = self.done.checked_sub(1).map_or(Duration::ZERO, at);
        (began, at(self.done).saturating_sub(began))
    }

    /// Moves the bar to where it was in rehearsal after so much of the next thing.
    fn show(&self, within: Duration) {
        let Some(bar) = &self.bar else { return };
        let (began, takes) = self.expected();
        let now = (began + within.min(takes)).as_millis() as u64;
        let left = bar.length().unwrap_or_default().saturating_sub(now) / 1_000;
        bar.set_position(now);
        bar.set_message(format!(
            "{}:{:02}:{:02} left, line {}",
            left / 3_600,
            left / 60 % 60,
            left % 60,
            self.line
        ));
    }

    /// Awaits an answer to a line.
    fn answer(&mut self, length: Option<usize>) -> Result<Vec<u8>, Broken> {
        let (begun, (_, takes)) = (Instant::now(), self.expected());
        let mut answer = Vec::new();
        let mut remarked = false;
        loop {
            let until = match (answer.is_empty(), self.bar.is_some()) {
                (false, _) => PAUSE,
                (true, true) => TICK,
                (true, false) if self.answered => LATE,
                (true, false) => FIRST,
            };
            match self.port.next(Instant::now() + until)? {
                Some((_, bytes)) => answer.extend(bytes),
                None if !answer.is_empty() => return Ok(answer),
                None => {}
            }
            let complete = match answer.first() {
                // A stop may be confirmed by a 0 of its own.
                None | Some(b'F') => false,
                Some(b'0') => length.is_some_and(|length| answer.len() >= length),
                Some(_) => length.is_some(),
            };
            if complete {
                return Ok(answer);
            }
            let waited = begun.elapsed();
            if answer.is_empty() && !self.answered && waited >= FIRST {
                return Err(Broken::Silent);
            }
            if answer.is_empty() && waited > takes * 2 + LATE && !remarked {
                remarked = true;
                let _ = writeln!(
                    io::stderr(),
                    "line {}: no answer for {} s; Ctrl-C ends the job",
                    self.line,
                    waited.as_secs()
                );
            }
            self.show(waited);
        }
    }
}

impl Link for Wire {
    type Broken = Broken;

    fn command(&mut self, line: &[u8]) -> Result<Vec<u8>, Broken> {
        self.moving.store(true, Ordering::Relaxed);
        self.port.send(line)?;
        let answer = self.answer(answer_length(line))?;
        self.answered = true;
        self.moving.store(false, Ordering::Relaxed);
        Ok(answer)
    }

    fn wait(&mut self, time: Duration) -> Result<(), Broken> {
        let begun = Instant::now();
        while let Some(left) = time.checked_sub(begun.elapsed()) {
            let step = if self.bar.is_some() { left.min(TICK) } else { left };
            self.port.next(Instant::now() + step)?;
            self.show(begun.elapsed());
        }
        Ok(())
    }

    fn rest(&mut self, longest: Duration) -> Result<(), Broken> {
        self.port.next(Instant::now() + longest)?;
        Ok(())
    }

    fn begins(&mut self, line: u32) {
        self.line = line;
        self.show(Duration::ZERO);
    }

    fn done(&mut self) {
        self.done += 1;
    }
}

/// How long the answer to a command is that is carried out; `None` where that is not known.
fn answer_length(line: &[u8]) -> Option<usize> {
    match line.iter().filter(|byte| **byte != b' ').nth(2)? {
        b'b' | b'D' => Some(3),
        b'P' | b'V' | b'H' | b'h' | b'U' | b'?' => None,
        _ => Some(1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_answers() {
        for (line, length) in [
            ("@0A5,900\r", Some(1)),
            ("@07\r", Some(1)),
            ("@0b0\r", Some(3)),
            ("@ 0 D S0\r", Some(3)),
            ("@0P\r", None),
            ("\r", None),
        ] {
            assert_eq!(answer_length(line.as_bytes()), length, "{line}");
        }
    }
}
