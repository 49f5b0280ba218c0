//! Every step of a run in a file.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use vimc4_device::{Point, Time};
use vimc4_motion::Segment;

use crate::failure::Failure;
use crate::output;

/// A table with a row for each step: the time in seconds and the counters, separated by commas.
pub(crate) struct Trace {
    path: PathBuf,
    out: BufWriter<File>,
    axes: usize,
    written: io::Result<()>,
}

impl Trace {
    /// Begins a table of these axes in a file, if one is named. What was in it is gone.
    pub(crate) fn wanted(path: Option<&Path>, axes: &[&str]) -> Result<Option<Trace>, Failure> {
        path.map(|path| Trace::new(path, axes)).transpose()
    }

    fn new(path: &Path, axes: &[&str]) -> Result<Trace, Failure> {
        let mut out = BufWriter::new(output::create(path)?);
        let written = writeln!(out, "seconds,{}", axes.join(","));
        Ok(Trace { path: path.to_owned(), out, axes: axes.len(), written })
    }

    /// Adds the steps of a segment that began at a time and a place, as far as it was made.
    pub(crate) fn add(&mut self, began: Time, origin: &Point, segment: &Segment, made: u64) {
        for step in segment.steps().take(usize::try_from(made).unwrap_or(usize::MAX)) {
            let at = began.after_nanos(step.nanos) - Time::ZERO;
            let mut row = format!("{}.{:09}", at.as_secs(), at.subsec_nanos());
            for (origin, offset) in origin.iter().zip(step.offset).take(self.axes) {
                row += &format!(",{}", origin + offset);
            }
            if self.written.is_ok() {
                self.written = writeln!(self.out, "{row}");
            }
        }
    }

    /// Ends the table.
    pub(crate) fn finish(mut self) -> Result<(), Failure> {
        output::written_to(&self.path, self.written.and_then(|()| self.out.flush()))
    }
}
