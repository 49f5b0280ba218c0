//! `vimc4 send`: a job or a command list to a controller, virtual or real.

mod beginning;
mod plot;
mod progress;
mod rehearsal;
mod whereabouts;
mod wire;

use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use vimc4_catalogue::{Handling, Machine, Model};
use vimc4_device::{Erasing, Identity, Point};
use vimc4_ncp::job::{Job, NoResumption, Zero};
use vimc4_ncp::language::Value;

use crate::completions;
use crate::conform::announce::confirm;
use crate::endings;
use crate::failure::Failure;
use crate::here::here;
use crate::job::channel::Ending;
use crate::job::file;
use crate::job::operator::{Entered, Operator};
use crate::job::perform::{FALSE_REFERENCE, Work, perform, refusal, refused, shown};
use crate::job::source::{JOB_OPTIONS, JobArguments, Site, Unit, Zeros};
use crate::ncp::check;
use crate::port::{Port, PortError, speed};
use crate::recording::history;
use crate::run::report::seconds;
use vimc4_script::{Kind, Script, ScriptLine, is_job, readable, suits};

use rehearsal::{Nevertheless, Rehearsal, rehearse};
use whereabouts::Doubt;
use wire::{Broken, Halted, Wire};

#[derive(clap::Args)]
#[command(
    long_about = "\
Send a job, a plot file, a command list or a stored program to a controller, virtual or real

A job is a file in the isel NC intermediate format; a command list is a file whose first command
begins with @; a data field, as `vimc4 ncp compile` writes it, is stored and not started. A plot file
goes to one of LPKF's models. Each command is sent when the one before was answered. The same job is
carried out in virtual time first: what the virtual controller refuses is not sent, and it gives
the time that remains.

The controller is asked for its name first, and a job for another model is refused. If the port leads
to a real machine, the travel is shown and you have to agree.

Enter, and any other line, stops a motion along its ramp; then Enter goes on with it, as does START
at the panel, and q ends the job; a plot halts behind the command that runs. In a wait it holds what
comes next. At a HALT, s goes on line by line. A line typed before a question does not answer it. An error
reply, and anything that is not an answer of such a controller, ends the job, as does a HALT, a GETTOOL and a
WPTEACH if nobody is at the terminal. Ctrl-C sends 253, which brakes, and ends the job when it
rests; Ctrl-C again does not wait. What is switched on stays on. If it ends early, it names the line
with which --from goes on.",
    after_long_help = concat!("\
Examples:
  vimc4 send examples/plate.ncp --to ", here!("./vimc4.pty", "COM7"), " --machine mill
  vimc4 send examples/plate.ncp --to ", here!("/dev/ttyUSB0", "COM3"), " --model imc-s8 --machine examples/machine.toml --teach
  vimc4 send examples/plate.ncp --to ", here!("/dev/ttyUSB0", "COM3"), " --model imc-s8 --machine mill --from 12
  vimc4 send examples/board.plt --to ", here!("/dev/ttyUSB0", "COM3"), " --model smcu --machine board-plotter
  vimc4 send examples/commands.txt --to tcp:127.0.0.1:4004 --machine mill --yes

Exit codes: 0 all was done, 1 an error in the file, an error reply, no answer, or a stop by Ctrl-C, 2 wrong
usage, 3 it was ended before its end.")
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    job: JobArguments,
    #[arg(long, value_name = "PORT", add = completions::ports(), help = here!(
        "Where the controller is: a serial port, a pseudo-terminal, or host:port",
        "Where the controller is: a serial port, or host:port"
    ))]
    to: String,
    /// The speed of a serial port; by default the model's
    #[arg(long, value_name = "RATE")]
    baud: Option<u32>,
    /// Go on with this line of a job: after reference runs its settings are restored,
    /// and the tool approaches from above
    #[arg(long, value_name = "LINE", value_parser = clap::value_parser!(u32).range(1..))]
    from: Option<u32>,
    /// Find the work-piece zero first, with lines such as MOVEREL X500 at the terminal
    #[arg(long, conflicts_with = "from")]
    teach: bool,
    /// Send it even if the controller names another model
    #[arg(long)]
    any_model: bool,
    /// Send a command list even if the virtual controller refuses part of it: the real
    /// one may be set up differently
    #[arg(long)]
    refused_too: bool,
    /// Accept answers that come sooner than a machine can move; for virtual controllers whose
    /// time runs faster
    #[arg(long)]
    any_time: bool,
    /// Erase the stored program before a data field is stored, on models with a command for it
    #[arg(long)]
    erase: bool,
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

pub(crate) fn run(mut arguments: Arguments) -> Result<ExitCode, Failure> {
    let bytes = arguments.job.bytes()?;
    history::no_recording(&arguments.job.file, &bytes)?;
    arguments.job.setup.heed(&arguments.job.file, &bytes)?;
    let name = arguments.job.name();
    let model = vimc4::model(arguments.job.setup.model())?;
    file::no_g_code(&name, &bytes)?;
    let handling = Handling::of(&model);
    // Who named no model may have the right controller.
    suits(&name, &bytes, &handling)
        .map_err(|why| Failure::usage(format!("{why}, with --model")))?;
    readable(&name, &bytes, &handling).map_err(Failure::usage)?;
    let text = file::decoded(&bytes);
    SentFile { arguments: &arguments, bytes: &bytes, text: &text, name, model, handling }.send()
}

/// The file to send, and the model it is for.
struct SentFile<'a> {
    arguments: &'a Arguments,
    bytes: &'a [u8],
    text: &'a str,
    name: String,
    model: Model,
    handling: Handling,
}

impl SentFile<'_> {
    fn send(&self) -> Result<ExitCode, Failure> {
        let SentFile { arguments, bytes, text, name, handling, .. } = self;
        if handling.takes_stream {
            not_for(job_options(arguments), name, "plot file")?;
            let machine = vimc4::machine(arguments.job.setup.machine())?;
            return self.send_whole(plot::work(name, bytes, text, handling)?, What::Plot, &machine);
        }
        let (site, found) = self.site()?;
        let list = command_list(arguments, bytes, handling)?;
        let stores = matches!(list, Some((_, What::Stored)));
        if arguments.erase && !stores {
            return Err(Failure::usage(format!(
                "--erase is for data fields, and {name} is none; leave it out"
            )));
        }
        let Some((mut list, what)) = list else { return self.send_job(site, found) };
        if arguments.erase {
            list.insert(0, (0, self.erasing()?));
        }
        self.send_whole(Work::List(list.into_iter()), what, &site.machine)
    }

    /// Sends something that needs nothing from the controller first.
    fn send_whole(
        &self,
        work: Work<'_>,
        what: What,
        machine: &Arc<Machine>,
    ) -> Result<ExitCode, Failure> {
        let rehearsal = self.rehearse(&work, machine, Point::default())?;
        let mut sending = Sending::open(self.arguments, &self.model, machine, self.text)?;
        sending.what = what;
        sending.agree(&rehearsal, None)?;
        sending.run(work, rehearsal)
    }

    /// Sends a job, from its beginning or from a later line.
    fn send_job(&self, mut site: Site, found: Option<Zero>) -> Result<ExitCode, Failure> {
        let Arguments { job, teach, from, .. } = self.arguments;
        let machine = Arc::clone(&site.machine);
        if *teach && job.options.reading.no_ref {
            return Err(Failure::usage(
                "--teach finds the zero from the reference point, and --no-ref takes the present \
                 place for it; leave one of them out",
            ));
        }
        match teach {
            true => check::before_zero(job, &site, self.text)?,
            false => check::before(job, &site, self.text)?,
        }
        let options = job.options.reading.options();
        if from.is_none() && !teach {
            let work = Work::Job(Box::new(Job::new(self.text, &site.target, options)));
            return self.send_whole(work, What::Job, &machine);
        }
        let mut sending = Sending::open(self.arguments, &self.model, &machine, self.text)?;
        if *teach {
            sending.teach(&mut site)?;
            check::before(job, &site, self.text)?;
        }
        let (work, here, told) = match from {
            Some(line) => self.resume(&mut sending, &site, *line, found)?,
            None => (Job::new(self.text, &site.target, options), Point::default(), None),
        };
        let work = Work::Job(Box::new(work));
        let rehearsal = self.rehearse(&work, &machine, here)?;
        sending.agree(&rehearsal, told.as_deref())?;
        sending.run(work, rehearsal)
    }

    /// A job from a later line on, where its axes are then, and what is to be said of it.
    fn resume<'t>(
        &'t self,
        sending: &mut Sending<'_>,
        site: &'t Site,
        line: u32,
        found: Option<Zero>,
    ) -> Result<(Job<'t>, Point, Option<String>), Failure> {
        let (options, model, machine) = (&self.arguments.job.options, &self.model, &site.machine);
        let no_ref = options.reading.no_ref;
        let mut here = sending.counters()?;
        // Without a reference run the counters count only if the operator says so.
        let named = |axis: usize| {
            options.zeros.zero.is_some_and(|zero| matches!(zero.0.get(axis), Some(Some(_))))
        };
        let mut from = here;
        let untold = (0..from.len()).filter(|axis| !machine.has_reference(*axis) && !named(*axis));
        untold.for_each(|axis| from[axis] = 0);
        let resume = |from| {
            beginning::resumed(
                self.text,
                &site.target,
                options.reading.options(),
                line,
                from,
                found,
            )
            .map_err(|why| no_resumption(line, &why, &self.name, self.text))
        };
        let (mut work, mut resumption) = resume(from)?;
        // Where only the present place counts, axes without further information stay.
        if no_ref && resumption.referenced.is_empty() && !resumption.told {
            let unnamed = (0..from.len()).filter(|axis| !named(*axis));
            unnamed.for_each(|axis| from[axis] = 0);
            (work, resumption) = resume(from)?;
        }
        let unknown = resumption.unknown.iter().filter(|axis| !named(*axis));
        let unknown: Vec<&str> = unknown.map(|axis| model.axis_names()[axis]).collect();
        if !unknown.is_empty() {
            return Err(Failure::usage(unknown_place(line, &unknown, model)));
        }
        if no_ref && resumption.told && sending.knows_no_axes()? {
            return Err(Failure::usage(format!(
                "the controller knows of no axes: it was switched on or reset since the job has \
                 referenced them, and does not count from there any more; nothing has moved: \
                 without --no-ref, --from {line} references them again"
            )));
        }
        let told = beginning::describe(&resumption, model, machine);
        // Where reference runs come first, they are what brings a machine to its counters.
        resumption.referenced.iter().for_each(|axis| here[axis] = 0);
        Ok((work, here, Some(told)))
    }

    /// Where the file is sent, and the work-piece zero that is set for a WPTEACH before the line to
    /// go on with: the one found there.
    fn site(&self) -> Result<(Site, Option<Zero>), Failure> {
        let job = &self.arguments.job;
        let mut site = job.site()?;
        let found = match self.arguments.from {
            Some(line) if beginning::is_taught(self.text, line) => job.options.zeros.zero,
            _ => None,
        };
        if found.is_some() {
            site = Site::new(job.setup.model(), job.setup.machine())?;
            Zeros { zero: None, ..job.options.zeros.clone() }.set(&mut site)?;
        }
        Ok((site, found))
    }

    /// The command that erases a stored program.
    fn erasing(&self) -> Result<Vec<u8>, Failure> {
        let how = match self.handling.erasing {
            Erasing::Command(line) => return Ok(format!("{line}\r").into_bytes()),
            Erasing::Panel(how) => format!("; {how}"),
            Erasing::Nothing => String::new(),
        };
        let model = self.model.name();
        Err(Failure::usage(format!("the model {model} has no command that erases{how}")))
    }

    /// What a job does on a virtual controller; an error if it would not carry it out.
    fn rehearse(
        &self,
        work: &Work<'_>,
        machine: &Arc<Machine>,
        here: Point,
    ) -> Result<Rehearsal, Failure> {
        let rehearsal = rehearse(work, &self.model, machine, here)?;
        let Arguments { job, refused_too, .. } = self.arguments;
        let list = matches!(work, Work::List(_)).then_some(Nevertheless(*refused_too));
        if let Some(failure) = rehearsal.objection(&self.name, self.text, list) {
            let goes_on = list.map_or(job.options.reading.lenient, |Nevertheless(goes_on)| goes_on);
            if !goes_on {
                return Err(failure);
            }
            failure.report();
        }
        Ok(rehearsal)
    }
}

/// The options that only jobs have.
fn job_options(arguments: &Arguments) -> bool {
    arguments.job.options.are_given() || arguments.from.is_some() || arguments.teach
}

/// Refuses options that mean nothing.
fn not_for(given: bool, name: &str, what: &str) -> Result<(), Failure> {
    match given {
        true => Err(Failure::usage(format!(
            "{name} is a {what}, which is sent as it is; {JOB_OPTIONS}, --from and --teach are for \
             job files"
        ))),
        false => Ok(()),
    }
}

/// Why a job that began at an unknown place cannot be resumed.
fn unknown_place(line: u32, axes: &[&str], model: &Model) -> String {
    let names = model.axis_names().iter();
    let zero: Vec<&str> = names.map(|name| if axes.contains(name) { "0" } else { "" }).collect();
    format!(
        "the job cannot go on with line {line}: where {} stood when it began counted as 0, without a \
         reference run, and the counters do not tell that place; nothing has moved: if they count \
         from there, as after switching on, say so with --zero {}, or with the work-piece zero that \
         the job had there in place of a 0",
        axes.join(", "),
        zero.join(",").trim_end_matches(',')
    )
}

fn no_resumption(line: u32, why: &NoResumption, name: &str, text: &str) -> Failure {
    let place = match why {
        NoResumption::Taught(place) | NoResumption::Impossible(place) => *place,
        NoResumption::Beyond(_) => line,
    };
    Failure::at_line(format!("the job cannot go on with line {line}: {why}"), name, text, place)
}

/// A controller's own identification, for people: a clause.
fn says(said: &str) -> String {
    match said.is_empty() {
        true => "it answers without naming itself".to_owned(),
        false => format!("it says `{said}`"),
    }
}

/// A word of a command line, as shells take it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_./:,=@%+-".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// Commands as they are sent, each with its line in the file.
type List = Vec<(u32, Vec<u8>)>;

/// The commands of a command list, or those that store a data field, and what it is then; `None` if
/// it is a job file.
fn command_list(
    arguments: &Arguments,
    bytes: &[u8],
    handling: &Handling,
) -> Result<Option<(List, What)>, Failure> {
    let name = arguments.job.name();
    if is_job(bytes) {
        return Ok(None);
    }
    let script = Script::of(&name, bytes, handling).map_err(Failure::usage)?;
    let number = |line: &ScriptLine| {
        line.number.and_then(|number| u32::try_from(number).ok()).unwrap_or_default()
    };
    let lines = script.lines.iter().map(|line| (number(line), line.whole()));
    match script.kind {
        Kind::Commands => {
            not_for(job_options(arguments), &name, "command list")?;
            Ok(Some((lines.collect(), What::List)))
        }
        Kind::DataField if script.looks_stored() => {
            not_for(job_options(arguments), &name, "data field")?;
            let Some(axes) = script.axes else {
                return Err(Failure::usage(format!(
                    "{name} is a data field and does not say for which axes; write them into its \
                     first line, as in `; axes: 7` for X+Y+Z, and 8 more with A"
                )));
            };
            let text = |text: String| (0, format!("{text}\r").into_bytes());
            let set = [axes & 7, axes & 8].into_iter().filter(|axes| *axes != 0);
            let mut list: List = set.map(|axes| text(format!("@0{axes}"))).collect();
            list.push(text("@0i".to_owned()));
            list.extend(lines);
            if !script.lines.last().is_some_and(|line| line.is("9")) {
                list.push(text("9".to_owned()));
            }
            Ok(Some((list, What::Stored)))
        }
        _ => Ok(None),
    }
}

/// What holds wherever a job ends before its end, and has to be known at the machine.
const STILL_ON: &str = "what is switched on, such as the spindle, is still on";

/// What is right where a reference is false.
const REPEATED: &str = ": only reference runs that come to their end make it true again, and --no-ref would believe it";

/// What is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    Job,
    Plot,
    List,
    Stored,
}

/// A job on its way to a controller.
struct Sending<'a> {
    arguments: &'a Arguments,
    model: &'a Model,
    machine: &'a Machine,
    text: &'a str,
    link: Wire,
    operator: Operator<'a>,
    handling: Handling,
    what: What,
    /// Whether Ctrl-C is heard here, and what is typed.
    listens: bool,
    /// The work-piece zero that the operator has found.
    found: Option<Zero>,
    /// The line of a WPTEACH behind which the zero was kept.
    kept: Option<u32>,
}

/// How a job goes on with a line.
struct Onward {
    /// The work-piece zero that must be said.
    zero: Option<Zero>,
    /// Whether the counters are believed.
    no_ref: bool,
}

impl<'a> Sending<'a> {
    /// Opens the port and identifies the controller.
    fn open(
        arguments: &'a Arguments,
        model: &'a Model,
        machine: &'a Machine,
        text: &'a str,
    ) -> Result<Sending<'a>, Failure> {
        let baud = speed(&arguments.to, arguments.baud, model.baud())?;
        let port = Port::open(&arguments.to, baud).map_err(Failure::usage)?;
        let handling = Handling::of(model);
        let operator = Operator::new(text, arguments.yes, arguments.skip_waits, arguments.verbose);
        let mut sending = Sending {
            arguments,
            model,
            machine,
            text,
            link: Wire::new(port, handling.clone()),
            operator,
            handling,
            what: What::Job,
            listens: false,
            found: None,
            kept: None,
        };
        sending.identify()?;
        Ok(sending)
    }

    /// A job for another model may do anything.
    fn identify(&mut self) -> Result<(), Failure> {
        let port = self.link.name().to_owned();
        let model = self.model.name();
        let asked = self.link.quiet().and_then(|()| self.link.identify());
        let is_virtual = asked.as_ref().is_ok_and(Identity::is_virtual);
        (self.link.any_time, self.link.says_virtual) = (self.arguments.any_time, is_virtual);
        match asked {
            Ok(Identity::Same(_)) => Ok(()),
            Ok(Identity::Unknown(said)) => {
                let says = match said.is_empty() {
                    true => "does not name itself when it is asked".to_owned(),
                    false => format!("says `{said}`, which names no model known here"),
                };
                let _ = writeln!(
                    io::stderr(),
                    "the controller at {port} {says}; it is taken for the model {model}"
                );
                Ok(())
            }
            Ok(Identity::Other { .. }) if self.arguments.any_model => Ok(()),
            Ok(Identity::Other { what, said }) => Err(Failure::usage(format!(
                "the controller at {port} is {what} ({}), and the job is for the model {model}; \
                 nothing has moved: name its model with --model, or add --any-model to send the \
                 job nevertheless",
                says(&said)
            ))),
            Ok(Identity::Foreign { what, said }) => Err(Failure::usage(format!(
                "what answers at {port} is {what} ({}), and the job is for the model {model}; \
                 nothing was sent: name its model with --model, and a file for it",
                says(&said)
            ))),
            Ok(Identity::Silent) => Err(self.broken(Broken::Silent)),
            Err(error) => Err(self.broken(error.into())),
        }
    }

    /// Says what is going to happen, and asks the operator if it happens to a real machine.
    fn agree(&mut self, rehearsal: &Rehearsal, told: Option<&str>) -> Result<(), Failure> {
        if let Some(told) = told {
            let _ = io::stderr().write_all(told.as_bytes());
        }
        if self.link.is_virtual() {
            return Ok(());
        }
        rehearsal.announce(&self.arguments.to);
        if self.arguments.yes {
            return Ok(());
        }
        match self.listens {
            false => confirm(),
            true if self.operator.agrees() => Ok(()),
            true => Err(Failure::usage("not begun; the job was not sent")),
        }
    }

    /// From here on Ctrl-C halts the machine; before that it just ends the program.
    fn listen(&mut self) -> Result<(), Failure> {
        if !self.listens {
            self.listens = true;
            endings::interrupt(self.link.port(), self.handling.halt)?;
            let (stop, woken) = (self.link.stop_key(), self.link.port().waker());
            self.operator.listen(self.handling.stop.map(|stop| stop.start), stop, woken);
        }
        Ok(())
    }

    /// Lets the operator find the work-piece zero.
    fn teach(&mut self, site: &mut Site) -> Result<(), Failure> {
        if !io::stdin().is_terminal() {
            return Err(Failure::usage(
                "nobody is at the terminal to find the work-piece zero; say with --zero where it is",
            ));
        }
        if !self.link.is_virtual() && !self.arguments.yes {
            let _ = writeln!(
                io::stderr(),
                "The axes of what is at {} will make reference runs, and then go where you say.",
                self.arguments.to
            );
            confirm()?;
        }
        self.listen()?;
        // Only a person can accept it.
        self.operator.yes = false;
        let mut work = Work::Job(Box::new(Job::teach(
            &site.target,
            self.arguments.job.options.reading.options(),
        )));
        let ending = perform(&mut work, &mut self.link, &mut self.operator);
        self.operator.yes = self.arguments.yes;
        let (Work::Job(job), ending) = (&work, self.ended(ending)?) else {
            return Err(Failure::midway("the work-piece zero was not found"));
        };
        if ending != Ending::Done {
            return Err(Failure::usage("the work-piece zero was not found; the job was not sent"));
        }
        let zero = job.zero();
        let _ = writeln!(io::stderr(), "work-piece zero: next time, --zero {zero} says the same");
        site.target.set_zero(zero);
        self.found = Some(zero);
        Ok(())
    }

    /// Where the counters are.
    fn counters(&mut self) -> Result<Point, Failure> {
        let answer = match self.link.position() {
            Ok(answer) => answer,
            Err(error) => return Err(self.broken(error.into())),
        };
        let mut point = Point::default();
        let places = self.handling.read_position(&answer).ok_or_else(|| {
            let said = vimc4_device::escape(&answer);
            Failure::midway(format!("the controller does not say where it is: `{said}`"))
        })?;
        point.iter_mut().zip(places).for_each(|(axis, place)| *axis = place);
        Ok(point)
    }

    /// Whether the controller says that no axes were configured since it was switched on or reset.
    fn knows_no_axes(&mut self) -> Result<bool, Failure> {
        match self.link.knows_no_axes() {
            Ok(knows_none) => Ok(knows_none),
            Err(error) => Err(self.broken(error.into())),
        }
    }

    fn run(mut self, mut work: Work<'_>, rehearsal: Rehearsal) -> Result<ExitCode, Failure> {
        let bar = (io::stderr().is_terminal() && !self.arguments.verbose).then(|| {
            let bar = ProgressBar::new(rehearsal.link.elapsed().as_millis() as u64);
            let style = ProgressStyle::with_template("{bar:30} {msg}");
            style.into_iter().for_each(|style| bar.set_style(style));
            bar
        });
        self.operator.bar = bar.clone();
        self.listen()?;
        self.link.begin(rehearsal.link.did, bar);
        let name = self.arguments.job.name();
        let began = Instant::now();
        let ending = perform(&mut work, &mut self.link, &mut self.operator);
        if let Work::Job(job) = &work {
            self.found = job.found().or(self.found);
            self.kept = job.kept();
        }
        match self.ended(ending)? {
            Ending::Ended { line } | Ending::Unattended { line } => {
                let place = self.place();
                let onward = self.onward(line).map(|onward| format!("\n{onward}"));
                let onward = onward.unwrap_or_default();
                let _ = writeln!(
                    io::stdout(),
                    "{name}: ended in line {line}{place}; {STILL_ON}, unless STOP at the panel has \
                     switched it off{onward}"
                );
                self.tell_onward(line);
                Ok(ExitCode::from(3))
            }
            _ if self.what == What::Stored => {
                let _ = writeln!(io::stdout(), "{name}: stored; START at the machine runs it");
                Ok(ExitCode::SUCCESS)
            }
            _ => {
                let took = Duration::from_millis(began.elapsed().as_millis() as u64);
                let _ = writeln!(io::stdout(), "{name}: done in {}{}", seconds(took), self.place());
                Ok(ExitCode::SUCCESS)
            }
        }
    }

    /// How it ended, if that is not a failure.
    fn ended(&mut self, ending: Result<Ending, Broken>) -> Result<Ending, Failure> {
        let ending = match ending {
            Ok(ending) => ending,
            Err(broken) => return Err(self.broken(broken)),
        };
        self.clear();
        let name = self.arguments.job.name();
        // An emergency stop may cut more than the controller knows.
        let help = format!("the job has ended there; {STILL_ON}, unless the machine has cut it");
        let (message, line) = match ending {
            ending @ (Ending::Done | Ending::Ended { .. }) => return Ok(ending),
            ending @ Ending::Unattended { line } => {
                let _ = writeln!(
                    io::stderr(),
                    "line {line} waits for somebody, and nobody is at the terminal; start it from \
                     one, or accept everything beforehand with --yes"
                );
                return Ok(ending);
            }
            Ending::Impossible { line, why } => {
                (format!("line {line} cannot be carried out: {why}{}", self.place()), line)
            }
            Ending::FalseReference { line } => {
                self.link.axes().distrust(Doubt::FalseReference);
                let failure =
                    format!("{FALSE_REFERENCE}, and where the axes are is not known{REPEATED}");
                let onward = self.onward(line).map(|onward| format!("; {onward}"));
                self.tell_onward(line);
                let message = format!("{failure}; {STILL_ON}{}", onward.unwrap_or_default());
                return Err(Failure::at_line(message, &name, self.text, line));
            }
            Ending::Refused { sent, answer, .. }
                if self.what == What::Stored && sent == b"@0i\r" && answer == b"G" =>
            {
                let how = match self.handling.erasing {
                    Erasing::Command(line) => {
                        format!(
                            "; to erase it, add --erase, which sends {line} before, or erase it"
                        )
                    }
                    Erasing::Panel(how) => format!("; to erase it, {how}"),
                    Erasing::Nothing => String::new(),
                };
                return Err(Failure::midway(format!(
                    "the controller has a program stored already, and takes no other (it answered \
                     G); nothing was stored{how}"
                )));
            }
            Ending::Refused { line, sent, answer } => {
                // The part after a semicolon would be taken for the remedy.
                let refusal = refusal(&self.handling, &sent, &answer).replace("; ", ", ");
                let refused = refused(&sent, &answer, &refusal);
                (format!("{refused}{}", self.place()), line)
            }
        };
        self.tell_onward(line);
        let help = match self.onward(line) {
            Some(onward) => format!("{help}; {onward}"),
            None => help,
        };
        Err(Failure::at_line(format!("{message}; {help}"), &name, self.text, line))
    }

    /// How to go on with a job that has ended in a line.
    fn onward(&mut self, line: u32) -> Option<String> {
        let is_job = self.what == What::Job;
        if !is_job || line == 0 {
            return None;
        }
        let no_ref = match self.way_onward(line) {
            Ok(Onward { no_ref, .. }) => no_ref,
            Err(why) => return Some(why),
        };
        if let Some(Entered { line: at, typed, .. }) = self.lost().find(|lost| lost.changes_frame) {
            let typed = crate::text::shown_in_line(typed);
            return Some(format!(
                "--from {line} would go elsewhere, for `{typed}`, typed in line {at}, has changed the \
                 zero, the plane or the cylinder, and is in no file: write what was typed behind line \
                 {at} of the file, as it is shown, and go on with the number that line {line} has then"
            ));
        }
        let how = match no_ref {
            true => "where the counters say that the axes are",
            false => "after reference runs",
        };
        let without = match self.lost().next() {
            Some(_) => ", and without what was typed at the terminal",
            None => "",
        };
        Some(format!("--from {line} goes on with that line, {how}{without}"))
    }

    /// What was typed on the way and is in no file, so that going on does not know of it.
    fn lost(&self) -> impl Iterator<Item = &Entered> {
        // What is typed before the start counts for nothing but the zero, and the way to a zero is
        // known by the zero, if it was taken.
        let is_known = |entered: &&Entered| {
            entered.line == 0 || entered.finds_zero && self.kept != Some(entered.line)
        };
        self.operator.entered.iter().filter(move |entered| !is_known(entered))
    }

    /// How a job goes on with a line, or why it cannot.
    fn way_onward(&mut self, line: u32) -> Result<Onward, String> {
        let job = &self.arguments.job;
        let said = self.found.or(job.options.zeros.zero);
        let doubts = self.link.axes().doubt().is_some();
        let as_it_is = Onward { zero: said, no_ref: job.options.reading.no_ref && !doubts };
        let Ok(site) = job.site() else { return Ok(as_it_is) };
        let (options, here) = (job.options.reading.options(), Point::default());
        let resumed = beginning::resumed(
            self.text,
            &site.target,
            options,
            line,
            here,
            said.or(Some(Zero::default())),
        );
        let Ok((_, resumption)) = resumed else { return Ok(as_it_is) };
        let untold: Vec<usize> = resumption.unknown.iter().collect();
        let names = |axes: &[usize]| {
            axes.iter().map(|axis| self.model.axis_names()[*axis]).collect::<Vec<_>>().join(", ")
        };
        // Where reference runs have told all places, they do so again.
        let is_told = resumption.told
            || !resumption.has_begun && beginning::is_reference(self.text, line)
            || !job.options.reading.no_ref;
        if doubts && !(is_told && untold.is_empty()) {
            let axes = if untold.is_empty() { "the axes".to_owned() } else { names(&untold) };
            return Err(format!(
                "--from {line} cannot go on with that line: it would believe the counters, and where \
                 {axes} began is not known any more"
            ));
        }
        // An earlier resumption has established where the counters count from.
        if untold.is_empty() || self.arguments.from.is_some() {
            return Ok(as_it_is);
        }
        let began = self.link.axes().began().map(<[i64]>::to_vec).unwrap_or_default();
        let began = |axis: &usize| began.get(*axis).copied();
        if untold.iter().any(|axis| began(axis) != Some(0)) {
            return Err(format!(
                "--from {line} cannot go on with that line: where {} stood when the job began counted \
                 as 0, without a reference run, and the counters did not count from there",
                names(&untold)
            ));
        }
        let mut zero = said.unwrap_or_default();
        for axis in untold {
            if let Some(place) = zero.0.get_mut(axis) {
                place.get_or_insert(Value::ZERO);
            }
        }
        Ok(Onward { zero: Some(zero), ..as_it_is })
    }

    /// The whole command that goes on, in lines of their own, so that it can be copied.
    fn tell_onward(&mut self, line: u32) {
        if self.onward(line).is_none() {
            return;
        }
        let Ok(Onward { zero, no_ref }) = self.way_onward(line) else { return };
        self.tell_entered(line);
        if self.lost().any(|lost| lost.changes_frame) {
            self.tell_blocks(line);
            return;
        }
        let Arguments { job, .. } = self.arguments;
        let (file, model, machine) =
            (job.file.to_string_lossy(), job.setup.model(), job.setup.machine());
        let mut words: Vec<String> = vec!["vimc4".into(), "send".into(), file.into_owned()];
        let mut add = |option: &str, value: &str| {
            words.extend([option, value].map(str::to_owned));
        };
        add("--to", &self.arguments.to);
        add("--model", model);
        add("--machine", machine);
        if let Some(rate) = self.arguments.baud {
            add("--baud", &rate.to_string());
        }
        if job.options.reading.drilldef_unit == Unit::Mm {
            add("--drilldef-unit", "mm");
        }
        if let Some(zero) = zero {
            add("--zero", &zero.to_string());
        }
        for register in &job.options.zeros.wpreg {
            add("--wpreg", &format!("{}={}", register.number, register.zero));
        }
        let flags = [
            (no_ref, "--no-ref"),
            (job.options.reading.lenient, "--lenient"),
            (self.arguments.any_model, "--any-model"),
            (self.arguments.any_time, "--any-time"),
            (self.arguments.yes, "--yes"),
            (self.arguments.skip_waits, "--skip-waits"),
            (self.arguments.verbose, "--verbose"),
        ];
        add("--from", &line.to_string());
        words.extend(flags.iter().filter(|(given, _)| *given).map(|(_, flag)| (*flag).to_owned()));
        let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
        if let Some(kept) = self.kept.filter(|kept| *kept < line) {
            let _ = writeln!(
                io::stderr(),
                "the zero was kept in line {kept}; make that WPTEACH a comment before going on, for \
                 --zero would count as found there"
            );
        }
        let _ = writeln!(io::stderr(), "to go on with line {line}:\n  {}", words.join(" "));
    }

    /// Lists what was typed and is in no file.
    fn tell_entered(&self, line: u32) {
        let mut lost = self.lost().peekable();
        if lost.peek().is_none() {
            return;
        }
        let mut text = format!(
            "what was typed at the terminal is in no file, so going on with line {line} leaves it \
             out:"
        );
        for Entered { line, typed, .. } in lost {
            text += &format!("\n  line {line}: {}", crate::text::shown_in_line(typed));
        }
        let _ = writeln!(io::stderr(), "{text}");
    }

    /// What was typed as it must stand in the file, so that the job goes on with a line behind it.
    fn tell_blocks(&self, line: u32) {
        let mut places: Vec<u32> = self.lost().map(|lost| lost.line).collect();
        places.dedup();
        let (mut text, mut added) = (String::new(), 0);
        for place in places {
            let typed =
                self.lost().filter(|lost| lost.line == place).map(|lost| lost.typed.as_str());
            let mut block: Vec<&str> = typed.collect();
            // A unit that was typed has held for what was typed only.
            block.extend(beginning::unit_to_restore(self.text, place, &block));
            if place < line {
                added += block.len();
            }
            text += &format!("behind line {place} of the file:\n{}\n", block.join("\n"));
        }
        let _ = writeln!(
            io::stderr(),
            "{text}then --from {} goes on with what is line {line} now",
            line as usize + added
        );
    }

    /// Where the axes are, as far as the controller says.
    fn place(&mut self) -> String {
        let places = match self.link.axes().doubt() {
            None => self.link.places(),
            Some(_) => None,
        };
        let why = match self.link.axes().doubt() {
            None => "",
            Some(Doubt::FalseReference) => return String::new(),
            Some(Doubt::Reset) => "the counters may have been reset",
            Some(Doubt::LimitSwitch) => "steps may have been lost",
        };
        if !why.is_empty() {
            return format!(", and where the axes are is not known, for {why}");
        }
        let Some(places) = places else { return String::new() };
        // One that tells of configured axes only does not say which they are.
        if !self.handling.names_axes(places.len()) {
            return String::new();
        }
        let units = self.machine.measures();
        let axes = self.model.axis_names().iter().zip(places).enumerate();
        let fitted = axes.filter(|(axis, _)| self.machine.fits(*axis));
        let places = fitted.map(|(axis, (name, steps))| {
            format!("{name} {:.3} {}", steps as f64 * units[axis].per_step, units[axis].name)
        });
        format!(", at {}", places.collect::<Vec<_>>().join(", "))
    }

    /// What showed how far it was is over.
    fn clear(&self) {
        if let Some(bar) = self.link.bar() {
            bar.finish_and_clear();
        }
    }

    fn broken(&mut self, broken: Broken) -> Failure {
        // A terminal may be paused; the machine is halted before anything is printed.
        if self.link.is_referencing() || matches!(broken, Broken::Early { is_reference: true, .. })
        {
            self.link.axes().distrust(Doubt::FalseReference);
        }
        let halted = match broken {
            Broken::Port(PortError::Interrupted) => self.link.halt(),
            Broken::Strange { .. } | Broken::Early { .. } => {
                self.link.brake();
                Halted::NothingMoved
            }
            Broken::Restless => Halted::NoAnswer,
            _ => Halted::NothingMoved,
        };
        if self.handling.stop.is_some() && halted == Halted::NoAnswer {
            self.link.axes().distrust(Doubt::Reset);
        }
        self.clear();
        if matches!(broken, Broken::Silent) {
            return Failure::usage(format!(
                "nothing answers at {}; check that it is the right port, that the controller is on, \
                 and the speed of the line",
                self.link.name()
            ));
        }
        let place = match broken {
            Broken::Port(PortError::Gone(_)) | Broken::Strange { .. } | Broken::Early { .. } => {
                String::new()
            }
            _ => self.place(),
        };
        let line = self.link.line();
        let onward = self.onward(line).map(|onward| format!("; {onward}")).unwrap_or_default();
        self.tell_onward(line);
        let message = match broken {
            Broken::Port(PortError::Interrupted) => {
                format!("interrupted: {}{place}; {STILL_ON}", self.halted(&halted))
            }
            Broken::Restless => format!("ended: {}{place}; {STILL_ON}", self.halted(&halted)),
            _ => {
                let (cause, remedy) = self.break_off(&broken);
                format!("{cause}{place}; the job has ended there{remedy}")
            }
        };
        let name = self.arguments.job.name();
        Failure::at_line(format!("{message}{onward}"), &name, self.text, line)
    }

    /// What has ended a job, and what follows from it at the machine.
    fn break_off(&self, broken: &Broken) -> (String, String) {
        let stop = self.handling.stop.map(|stop| format!(", and {} was sent", stop.name));
        let and_stop = stop.unwrap_or_default();
        let cut = format!("; {STILL_ON}, unless the machine has cut it");
        match broken {
            Broken::Forgotten => (
                "the controller does not count as it did when the axes came to rest: it has lost its \
                 power, or met an emergency stop"
                    .to_owned(),
                cut,
            ),
            Broken::Strange { sent, said } => {
                let answered = match vimc4_device::said(said) {
                    answered if answered.is_empty() => vimc4_device::escape(said),
                    answered => answered,
                };
                let to = match sent.is_empty() {
                    true => "without being asked".to_owned(),
                    false => format!("to {}", shown(sent)),
                };
                let model = self.model.name();
                (
                    format!(
                        "the controller answered `{answered}` {to}, which is not an answer of the \
                         model {model}"
                    ),
                    format!(
                        "{and_stop}, but what moves may still be moving: use the emergency stop if it \
                         does; {STILL_ON}"
                    ),
                )
            }
            Broken::Early { sent, took, takes, is_reference } => {
                let (sent, took, takes) = (shown(sent), took.as_secs_f64(), takes.as_secs_f64());
                let done = format!("the controller says that {sent} is done after {took:.1} s, and");
                match is_reference {
                    true => (
                        format!(
                            "{done} from where the axes were that run takes {takes:.1} s: STOP at the \
                             panel may have stood in for the switch, and then the reference is false, \
                             and where the axes are is not known"
                        ),
                        format!(
                            "{and_stop}; where it is another speed of the axes, there is --any-time; \
                             {STILL_ON}"
                        ),
                    ),
                    false => (
                        format!("{done} that motion takes {takes:.1} s"),
                        format!(
                            "{and_stop}: this is another controller, or another speed of its line or \
                             its axes, or a virtual one in faster time, for which there is --any-time"
                        ),
                    ),
                }
            }
            Broken::Port(PortError::Gone(why)) => {
                (format!("{} is gone: {why}", self.link.name()), format!("; {STILL_ON}"))
            }
            _ => (
                "the controller does not answer any more: it may have lost its power, or its line"
                    .to_owned(),
                cut,
            ),
        }
    }

    /// What came of halting the machine.
    fn halted(&mut self, halted: &Halted) -> String {
        let text = match (self.handling.stop, halted) {
            (None, _) => self.handling.halting.to_owned(),
            (Some(stop), Halted::Refused(answer)) => {
                let sent = self.link.sent();
                let refusal = refusal(&self.handling, sent, answer).replace("; ", ", ");
                format!("{} was sent, and {}", stop.name, refused(sent, answer, &refusal))
            }
            (Some(stop), halted) => {
                let what = match halted {
                    Halted::Rests => "the motion has come to rest along its ramp",
                    Halted::NothingMoved => "nothing was moving",
                    _ => "there is no answer: it may still be moving, so use the emergency stop",
                };
                format!("{} was sent, and {what}", stop.name)
            }
        };
        match (self.link.axes().doubt(), halted) {
            (Some(Doubt::FalseReference), Halted::Rests) => {
                format!("the reference run has ended, and its reference is false{REPEATED}")
            }
            (Some(Doubt::FalseReference), _) => {
                format!("{text}; the reference of this run is false{REPEATED}")
            }
            _ => text,
        }
    }
}
