//! What there is to carry out: the file, and the controller and machine it is for.

use std::path::PathBuf;
use std::sync::Arc;

use vimc4_catalogue::{Machine, Model};
use vimc4_ncp::job::{Options, Register, Target, Zero};
use vimc4_ncp::{Diagnostic, Severity};

use super::file::{decoded, read};
use crate::failure::Failure;
use crate::recording::history::no_recording;
use crate::setup::Setup;
use crate::text;

/// A job file and how it is read, the same for every command that takes one.
#[derive(clap::Args)]
pub(crate) struct JobArguments {
    /// The job file; `-` is standard input
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) setup: Setup,
    #[command(flatten)]
    pub(crate) options: JobOptions,
}

/// What is said about a job besides its file, the same for every command and editor.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub(crate) struct JobOptions {
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) zeros: Zeros,
}

/// The names of these options.
pub(crate) const JOB_OPTIONS: &str = "--no-ref, --lenient, --zero, --wpreg, --drilldef-unit";

impl JobOptions {
    /// The options in a list of words, as settings of editors have it.
    ///
    /// # Errors
    ///
    /// What is wrong with a word, and what there is.
    pub(crate) fn of_words(words: &[String]) -> Result<JobOptions, Failure> {
        #[derive(clap::Parser)]
        #[command(no_binary_name = true, disable_help_flag = true)]
        struct Words {
            #[command(flatten)]
            options: JobOptions,
        }
        let read = <Words as clap::Parser>::try_parse_from(words);
        read.map(|words| words.options).map_err(|error| {
            let error = error.to_string();
            // What stands below is how a command line is written.
            let what = error.lines().next().unwrap_or_default();
            let what = what.strip_prefix("error: ").unwrap_or(what);
            Failure::usage(format!(
                "{what}; the options of jobs are {JOB_OPTIONS}, each a word with its value, as in \
                 --zero=100mm,50mm,-20mm"
            ))
        })
    }

    /// Whether any is given.
    pub(crate) fn are_given(&self) -> bool {
        *self != JobOptions::default()
    }

    /// Refuses them for something that is no job.
    ///
    /// # Errors
    ///
    /// If any is given.
    pub(crate) fn only_for_jobs(&self, name: &str) -> Result<(), Failure> {
        match self.are_given() {
            true => Err(Failure::usage(format!(
                "{name} is no job; {JOB_OPTIONS} are for job files, so leave them out"
            ))),
            false => Ok(()),
        }
    }
}

/// Where the work-piece lies, for files that leave it to the machine.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub(crate) struct Zeros {
    /// Where the work-piece zero is before the file says anything: machine coordinates in µm, A in
    /// arc seconds, or with a unit, as in 100mm,50mm,-20mm; an axis may be left out
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) zero: Option<Zero>,
    /// What register N, 1 to 8, holds before the file fills it; may be given several times
    #[arg(long, value_name = "N=X,Y,Z")]
    pub(crate) wpreg: Vec<Register>,
}

impl Zeros {
    /// Takes them instead of those of the machine's profile.
    pub(crate) fn set(&self, site: &mut Site) -> Result<(), Failure> {
        let zeros = self.zero.iter().chain(self.wpreg.iter().map(|register| &register.zero));
        if let Some(axis) = zeros.copied().find_map(|zero| zero.beyond(&site.machine)) {
            let machine = &site.machine.name;
            return Err(Failure::usage(format!(
                "the machine {machine} has no {axis} axis for a work-piece zero; leave it out"
            )));
        }
        let target = &mut site.target;
        target.set_zero(self.zero.unwrap_or_default());
        self.wpreg.iter().for_each(|register| target.fill(*register));
        Ok(())
    }
}

/// How a job file is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::Args)]
pub(crate) struct Reading {
    /// Take the present point as the machine's zero where the file begins without a REF, instead
    /// of referencing all axes first
    #[arg(long)]
    pub(crate) no_ref: bool,
    /// The unit of D F O I R L S in DRILLDEF
    #[arg(long, value_name = "UNIT", value_enum, default_value = "um")]
    pub(crate) drilldef_unit: Unit,
    /// Leave out comments in brackets, unknown words and accessories that cannot be read or
    /// switched, and end the job at any other line that cannot be read or carried out
    #[arg(long)]
    pub(crate) lenient: bool,
}

/// The unit of what DRILLDEF sets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Unit {
    /// Micrometres, as the manual's example and most programs have it
    #[default]
    Um,
    /// Millimetres, as the manual's table and some programs have it
    Mm,
}

impl Reading {
    /// How bad a problem is in such a reading: a line that is left out is no reason not to carry the
    /// others out.
    pub(crate) fn severity(self, diagnostic: &Diagnostic) -> Severity {
        let severity = diagnostic.problem.severity();
        match diagnostic.left_out && self.lenient {
            true => severity.min(Severity::Warning),
            false => severity,
        }
    }

    pub(crate) fn options(self) -> Options {
        Options {
            no_reference: self.no_ref,
            drill_in_mm: self.drilldef_unit == Unit::Mm,
            ..Options::default()
        }
    }
}

/// A controller on a machine, as jobs and virtual controllers see them.
pub(crate) struct Site {
    pub(crate) model: Model,
    pub(crate) machine: Arc<Machine>,
    pub(crate) target: Target,
}

impl Site {
    /// The site of these names or profile files.
    pub(crate) fn new(model: &str, machine: &str) -> Result<Site, Failure> {
        Site::of(vimc4::model(model)?, vimc4::machine(machine)?)
    }

    /// The site of these.
    pub(crate) fn of(model: Model, machine: Arc<Machine>) -> Result<Site, Failure> {
        let target = vimc4_script::target(&model, &machine).map_err(Failure::usage)?;
        Ok(Site { model, machine, target })
    }
}

impl JobArguments {
    /// A job file, read with the default options.
    pub(crate) fn new(file: PathBuf, setup: Setup) -> JobArguments {
        JobArguments { file, setup, options: JobOptions::default() }
    }

    /// The name of the file, for people.
    pub(crate) fn name(&self) -> String {
        text::name(&self.file)
    }

    /// The bytes of the file.
    pub(crate) fn bytes(&self) -> Result<Vec<u8>, Failure> {
        read(&self.file, "a job file")
    }

    /// The text of the file, if it could be a job.
    pub(crate) fn text(&self) -> Result<String, Failure> {
        let bytes = self.bytes()?;
        no_recording(&self.file, &bytes)?;
        vimc4_script::could_be_job(&self.name(), &bytes).map_err(Failure::usage)?;
        Ok(decoded(&bytes))
    }

    /// The controller and the machine.
    pub(crate) fn site(&self) -> Result<Site, Failure> {
        let mut site = Site::new(self.setup.model(), self.setup.machine())?;
        self.options.zeros.set(&mut site)?;
        Ok(site)
    }
}
