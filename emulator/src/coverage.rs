//! `vimc4 coverage`, and what `--coverage` of other commands keeps.

use std::path::{Path, PathBuf};

use vimc4::{Coverage, Model, add_coverage, read_coverage};
use vimc4_coverage::Collector;
use vimc4_device::{Event, Kinds};

use crate::failure::Failure;
use crate::identity::none_twice;
use crate::output;

#[derive(clap::Args)]
#[command(
    long_about = "\
Say how much of what a controller can do was met: commands, their answers, the states that they found and
what stopped them

`vimc4 serve --coverage FILE` and `vimc4 run --coverage FILE` write such files, and add to one that is
there. Several files of the same model are read as one.",
    after_long_help = "\
Examples:
  vimc4 run examples/commands.txt --machine mill --coverage coverage.json
  vimc4 coverage coverage.json
  vimc4 coverage coverage.json --missing
  vimc4 coverage coverage.json --html coverage.html --lcov coverage.info

Exit codes: 0 printed and written, 2 wrong usage, or a file cannot be used."
)]
pub(crate) struct Arguments {
    /// Files that `--coverage` has written
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Print what was never met, in sentences, instead of the table
    #[arg(long)]
    missing: bool,
    /// Write a page of HTML, which needs nothing else
    #[arg(long, value_name = "OUT")]
    html: Option<PathBuf>,
    /// Write a tracefile of lcov for viewers of coverage, and beside it OUT.txt, the text of the commands
    /// that it is about, which it names by its absolute path
    #[arg(long, value_name = "OUT")]
    lcov: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut whole: Option<Coverage> = None;
    for path in &arguments.files {
        let read = read_coverage(path).map_err(Failure::usage)?;
        match &mut whole {
            None => whole = Some(read),
            Some(whole) => whole.merge(&read).map_err(|error| {
                Failure::usage(format!("coverage file {}: {error}", path.display()))
            })?,
        }
    }
    let Some(coverage) = whole else { return Err(Failure::usage("no file is given")) };
    let source = arguments.lcov.as_ref().map(|path| {
        let mut source = path.clone().into_os_string();
        source.push(".txt");
        PathBuf::from(source)
    });
    let outputs = [&arguments.html, &arguments.lcov, &source].into_iter().flatten();
    none_twice(arguments.files.iter().map(PathBuf::as_path), outputs.map(PathBuf::as_path))?;
    if let Some(path) = &arguments.lcov {
        output::must_be_file(path, "the text that this is about is put beside it")?;
    }
    if let Some(path) = &arguments.html {
        output::write(path, coverage.html().as_bytes())?;
    }
    if let (Some(path), Some(source)) = (&arguments.lcov, &source) {
        // Viewers read the tracefile in a folder of their own.
        let absolute = std::path::absolute(source).unwrap_or_else(|_| source.clone());
        let lcov = coverage.lcov(&absolute.display().to_string());
        output::write(source, lcov.source.as_bytes())?;
        output::write(path, lcov.tracefile.as_bytes())?;
    }
    if !arguments.missing {
        return output::print(&Coverage::table(&coverage));
    }
    output::print(&coverage.missing().iter().map(|line| format!("{line}\n")).collect::<String>())
}

/// Sees to it before anything begins that a file can be used for this model at the end.
pub(crate) fn begin(path: &Path, model: &Model) -> Result<(), Failure> {
    add_coverage(path, &Coverage::of(model)).map(drop).map_err(Failure::usage)
}

/// Adds what several controllers of one model have met.
pub(crate) fn keep(path: &Path, met: impl IntoIterator<Item = Coverage>) -> Result<(), Failure> {
    let whole = met.into_iter().reduce(|mut whole, more| {
        // They are of one model.
        let _ = whole.merge(&more);
        whole
    });
    whole.map_or(Ok(()), |whole| add_coverage(path, &whole).map(drop).map_err(Failure::usage))
}

/// Counts what a run in virtual time meets.
pub(crate) struct Covering {
    path: PathBuf,
    collector: Collector,
}

impl Covering {
    pub(crate) const KINDS: Kinds = Collector::KINDS;

    pub(crate) fn new(path: &Path, model: &Model) -> Result<Covering, Failure> {
        begin(path, model)?;
        Ok(Covering { path: path.to_owned(), collector: Collector::new(model) })
    }

    pub(crate) fn see(&mut self, event: &Event) {
        self.collector.see(event);
    }

    pub(crate) fn keep(self) -> Result<(), Failure> {
        keep(&self.path, [self.collector.coverage().clone()])
    }
}
