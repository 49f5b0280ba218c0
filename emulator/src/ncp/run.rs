//! `vimc4 ncp run`: a job on a virtual controller, in virtual time.

use std::collections::BTreeMap;
use std::io::{self, IsTerminal};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use serde_json::{Map, Value, json};
use vimc4_catalogue::{Controller, Handling};
use vimc4_device::{Device, Grouped};
use vimc4_ncp::Severity;
use vimc4_ncp::job::{InputTest, Job};
use vimc4_ncp::language::{Instruction, TextLine, lines, parse};

use super::check;
use super::problems::as_json;
use crate::endings::{self, INTERRUPTED};
use crate::failure::Failure;
use crate::job::channel::Ending;
use crate::job::operator::Operator;
use crate::job::perform::{FALSE_REFERENCE, Work, perform, refused};
use crate::job::source::{JobArguments, Site};
use crate::job::virtual_time::Virtual;
use crate::output;
use crate::run::driver::Halt;
use crate::run::report::{nanos, seconds};
use crate::run::world::{Outside, World};
use crate::values::duration;

#[derive(clap::Args)]
#[command(
    long_about = "\
Carry a job out on a virtual controller, in virtual time, as fast as possible

The job is checked first, and nothing is done if there are errors. Then its commands are sent, each
when the one before was answered. A HALT, a GETTOOL and a WPTEACH ask at the terminal; --yes
accepts them. A WAITBIT and a WAITPORT wait for what --input does, or are passed with --skip-waits.

--json prints what `vimc4 ncp check` says of the file and when each line began and how long it took; a
job with errors is carried out up to the first of them.",
    after_long_help = "\
Examples:
  vimc4 ncp run examples/plate.ncp --machine mill --yes
  vimc4 ncp run examples/plate.ncp --input 0.3=1@2s --press stop@5s --press start@8s -v

Exit codes: 0 the job is done, 1 an error in the file or an error reply, 2 wrong usage, 3 the time of
--for is over, or nobody is at the terminal to continue it, 130 it was interrupted."
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    job: JobArguments,
    /// Accept every HALT, GETTOOL and WPTEACH
    #[arg(long)]
    yes: bool,
    /// Pass every WAITBIT and WAITPORT
    #[arg(long)]
    skip_waits: bool,
    /// How much virtual time may pass, such as 90s, 5min or 8h
    #[arg(long = "for", value_name = "DURATION", default_value = "24h", value_parser = duration)]
    time: Duration,
    #[command(flatten)]
    world: World,
    /// Print one line of JSON instead
    #[arg(long)]
    json: bool,
    /// Show every command and its answer
    #[arg(short, long)]
    verbose: bool,
}

impl Arguments {
    /// A job without an attendant.
    pub(crate) fn new(
        job: JobArguments,
        world: World,
        time: Duration,
        json: bool,
        verbose: bool,
    ) -> Arguments {
        Arguments { job, yes: false, skip_waits: false, time, world, json, verbose }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    endings::heed()?;
    arguments.world.none_twice(&arguments.job.file, &arguments.job.setup)?;
    carry_out(arguments, &arguments.job.text()?)
}

/// Carries the job out that is this text.
pub(crate) fn carry_out(arguments: &Arguments, text: &str) -> Result<ExitCode, Failure> {
    let job = &arguments.job;
    let site = job.site()?;
    let checked = match arguments.json {
        true => Checked::of(job, &site, text),
        false => {
            check::before(job, &site, text)?;
            Checked::default()
        }
    };
    // Nothing is done from the first faulty line on.
    let text = &text[..checked.refused.as_ref().map_or(text.len(), |refused| refused.offset)];

    let controller =
        Controller::new(&site.model, Arc::clone(&site.machine), b"").map_err(Failure::midway)?;
    let outside = Outside {
        signals: arguments.world.signals(&controller)?,
        scenario: arguments.world.scenario(&site.model, &controller)?,
        starts: false,
        time: arguments.time,
    };
    let driver = arguments.world.driver(controller, &site.model, &site.machine, &job.file, None)?;
    let mut link = Virtual::new(driver, Handling::of(&site.model), arguments.json);
    if link.driver.drawing.is_some() {
        link.tools = tools(text);
    }
    outside.schedule(&mut link.driver);
    let mut operator = Operator::new(
        text,
        arguments.yes,
        arguments.skip_waits,
        arguments.verbose && !arguments.json,
    );
    if !arguments.yes && io::stdin().is_terminal() {
        operator.listen_at_leisure();
    }
    let mut work = Work::Job(Box::new(Job::new(text, &site.target, job.options.reading.options())));
    let ending = perform(&mut work, &mut link, &mut operator);
    let outcome = Outcome::of(ending, &link).but(checked.refused.as_ref());
    // What shows how far the files are is gone from the terminal before the report comes.
    let closed = link.driver.close();
    let code = outcome.report(arguments, &site, &mut link, checked.told)?;
    closed?;
    link.driver.done();
    Ok(code)
}

/// The tools that lines ask for.
fn tools(text: &str) -> BTreeMap<u32, u32> {
    let tool = |line: TextLine<'_>| match parse(line.text, &mut |_, _| {}).command?.value {
        Instruction::Tool(number) => Some((line.number, number)),
        _ => None,
    };
    lines(text).filter_map(tool).collect()
}

/// The results of a check, for tools.
#[derive(Default)]
struct Checked {
    told: Vec<Value>,
    /// The first line that is wrong.
    refused: Option<Refused>,
}

/// A line that is wrong, and with it everything behind it.
struct Refused {
    line: u32,
    /// Where it begins, in bytes.
    offset: usize,
    problem: String,
}

impl Checked {
    fn of(job: &JobArguments, site: &Site, text: &str) -> Checked {
        let all: Vec<_> = lines(text).collect();
        let mut checked = Checked::default();
        vimc4_ncp::job::check(
            text,
            &site.target,
            job.options.reading.options(),
            &mut |diagnostic| {
                let severity = job.options.reading.severity(&diagnostic);
                let line = all.get(diagnostic.line.saturating_sub(1) as usize);
                checked.told.push(as_json(
                    &diagnostic,
                    severity,
                    line.map_or("", |line| line.text),
                ));
                let first =
                    checked.refused.as_ref().is_none_or(|found| diagnostic.line < found.line);
                // A lenient reading goes as far as possible.
                if severity == Severity::Error && first && !job.options.reading.lenient {
                    checked.refused = Some(Refused {
                        line: diagnostic.line,
                        offset: line.map_or(0, |line| line.offset),
                        problem: diagnostic.problem.to_string(),
                    });
                }
            },
        );
        checked
    }
}

/// How a run ended.
struct Outcome {
    code: u8,
    word: &'static str,
    text: String,
    line: Option<u32>,
}

impl Outcome {
    fn of(ending: Result<Ending, Halt>, link: &Virtual) -> Outcome {
        let place = format!("line {}", link.line);
        // Whoever ends the program ends the job at a question, too.
        let ending = match (ending, link.driver.heed()) {
            (Ok(Ending::Ended { .. }), Err(halt)) => Err(halt),
            (ending, _) => ending,
        };
        let (code, word, text, line) = match ending {
            Ok(Ending::Done) => (0, "done", "the job is done".to_owned(), None),
            Ok(Ending::Refused { line, sent, answer }) => {
                let refused = refused(&sent, &answer, &link.refusal(&sent, &answer));
                (1, "error", format!("line {line}: {refused}"), Some(line))
            }
            Ok(Ending::Ended { line }) => {
                (3, "ended", format!("line {line}: ended by the operator"), Some(line))
            }
            Ok(Ending::FalseReference { line }) => {
                (1, "error", format!("line {line}: {FALSE_REFERENCE}"), Some(line))
            }
            Ok(Ending::Impossible { line, why }) => {
                (1, "error", format!("line {line} cannot be carried out: {why}"), Some(line))
            }
            Err(Halt::Time) => {
                (3, "for", format!("{place}: the time of --for is over"), Some(link.line))
            }
            Err(Halt::Interrupted) => {
                let text = format!("{place}: it was interrupted");
                (INTERRUPTED, "interrupted", text, Some(link.line))
            }
            Ok(Ending::Unattended { .. }) | Err(Halt::Rounds | Halt::Waiting | Halt::Idling) => {
                let what = link.polled.map_or_else(|| "waits".to_owned(), awaited);
                let text = format!(
                    "{place} {what}, and nothing will change that: --yes accepts questions, \
                     --skip-waits passes waits, --input and --press do something"
                );
                (3, "waits", text, Some(link.line))
            }
        };
        Outcome { code, word, text, line }
    }

    /// A job that is wrong ends before the first line that is.
    fn but(self, refused: Option<&Refused>) -> Outcome {
        match refused.filter(|_| self.code == 0) {
            Some(Refused { line, problem, .. }) => Outcome {
                code: 1,
                word: "error",
                text: format!("line {line}: {problem}; nothing was done from there on"),
                line: Some(*line),
            },
            None => self,
        }
    }

    fn report(
        self,
        arguments: &Arguments,
        site: &Site,
        link: &mut Virtual,
        told: Vec<Value>,
    ) -> Result<ExitCode, Failure> {
        let text = match arguments.json {
            true => self.json(site, link, told),
            false => self.table(site, link),
        };
        output::print(&text)?;
        Ok(ExitCode::from(self.code))
    }

    fn json(&self, site: &Site, link: &Virtual, told: Vec<Value>) -> String {
        let view = link.driver.device().view(link.driver.now());
        let meter = &link.driver.meter;
        let units = site.machine.measures();
        let mut axes = Map::new();
        for axis in site.target.axes.iter() {
            let extent = meter.extent.map(|(low, high)| (low[axis], high[axis]));
            let mut value: Value = json!({
                "position": view.axes.get(axis).map(|axis| axis.position),
                "travelled": meter.steps[axis],
                "extent": extent,
                "unit": units[axis].name,
                "unit_per_step": units[axis].per_step,
            });
            if meter.lost.contains(&axis) {
                value["position_known"] = false.into();
            }
            axes.insert(name(site, axis).to_owned(), value);
        }
        let warnings: Vec<&vimc4_device::Warning> =
            link.warnings.iter().map(|(_, warning)| warning).collect();
        let summary = json!({
            "ended": self.word,
            "text": self.text,
            "line": self.line,
            "time_ns": nanos(link.elapsed()),
            "commands": link.commands,
            "axes": axes,
            "path_mm": meter.path_mm,
            "warnings": warnings,
            "diagnostics": told,
            "lines": times(link),
        });
        format!("{summary}\n")
    }

    fn table(&self, site: &Site, link: &Virtual) -> String {
        let view = link.driver.device().view(link.driver.now());
        let meter = &link.driver.meter;
        let units = site.machine.measures();
        let mut text = format!(
            "{:<10}{:>18}{:>18}{:>18}{:>18}\n",
            "axis", "end", "lowest", "highest", "travelled"
        );
        for axis in site.target.axes.iter() {
            let unit = units[axis];
            let shown =
                |steps: i64| format!("{:.3} {:<2}", steps as f64 * unit.per_step, unit.name);
            let position = view.axes.get(axis).map_or(0, |axis| axis.position);
            let (low, high) =
                meter.extent.map_or((position, position), |(low, high)| (low[axis], high[axis]));
            let travelled = i64::try_from(meter.steps[axis]).unwrap_or(i64::MAX);
            let end = match meter.lost.contains(&axis) {
                true => "unknown".to_owned(),
                false => shown(position),
            };
            text += &format!(
                "{:<10}{:>18}{:>18}{:>18}{:>18}\n",
                name(site, axis),
                end,
                shown(low),
                shown(high),
                shown(travelled),
            );
        }
        if let Some(lost) = meter.lost_in_words(|axis| name(site, axis).to_owned()) {
            text += &format!("unknown   {lost}\n");
        }
        text += &format!("path      {:.3} mm\n", meter.path_mm);
        let commands = Grouped(i64::try_from(link.commands).unwrap_or(i64::MAX));
        let bits = link.characters.saturating_mul(10_000_000_000);
        let line = Duration::from_nanos(bits / u64::from(site.model.baud().max(1)));
        text += &format!(
            "time      {}, and {} on the line for {commands} commands at {} baud\n",
            seconds(link.elapsed()),
            seconds(line),
            site.model.baud(),
        );
        for (at, warning) in &link.warnings {
            text +=
                &format!("warning   {warning}, at {}\n", seconds(*at - vimc4_device::Time::ZERO));
        }
        text += &format!("ended     {}\n", self.text);
        text
    }
}

/// What a line waits for, and what the port reads.
fn awaited((InputTest { port, bit, value }, read): (InputTest, u8)) -> String {
    match bit {
        Some(bit) => format!("waits until bit {port}.{bit} reads {value}"),
        None => format!(
            "waits until port {port} reads {value:08b}B; it reads {read:08b}B, and the bits {} differ",
            (0..8)
                .filter(|bit| (value ^ read) >> bit & 1 == 1)
                .map(|bit| format!("{port}.{bit}"))
                .collect::<Vec<_>>()
                .join(", ")
        ),
    }
}

/// When each line began, and how long it took; line 0 is what comes before the first.
fn times(link: &Virtual) -> Vec<Value> {
    let ends = link.lines.iter().skip(1).map(|(_, began)| *began).chain([link.elapsed()]);
    let lines = link.lines.iter().zip(ends);
    let time = |((line, began), end): (&(u32, Duration), Duration)| json!({ "line": line, "begins_ns": nanos(*began), "takes_ns": nanos(end - *began) });
    lines.map(time).collect()
}

fn name(site: &Site, axis: usize) -> &'static str {
    site.model.axis_names().get(axis).copied().unwrap_or("?")
}
