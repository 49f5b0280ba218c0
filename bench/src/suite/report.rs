//! The report, as Markdown.

use std::fmt;
use std::fs;
use std::path::Path;

use super::failure::{Doing, Failure, Outcome};
use super::machine::Machine;
use super::numbers::{rate, times};
use super::stats::Pair;

/// The page that carries the report, from the folder of this package.
const PAGE: &str = "../docs/performance.md";

/// Where the report begins and ends there.
const BEGIN: &str = "<!-- figures: begin -->\n";
const END: &str = "<!-- figures: end -->\n";

/// One line of the report.
pub(crate) struct Figure {
    what: String,
    measured: String,
    baseline: String,
    target: String,
    met: Option<bool>,
}

impl Figure {
    /// What was measured, and what came out.
    pub(crate) fn new(what: impl Into<String>, measured: impl Into<String>) -> Figure {
        Figure {
            what: what.into(),
            measured: measured.into(),
            baseline: String::new(),
            target: String::new(),
            met: None,
        }
    }

    /// Rates that are compared; ours should be at least so many times the baseline.
    pub(crate) fn rates(what: impl Into<String>, rates: Pair<f64>, least: f64) -> Figure {
        let ratio = rates.ratio();
        Figure::new(what, format!("{}, {}", rate(rates.ours), times(ratio)))
            .baseline(rate(rates.baseline))
            .target(format!("≥ {least} ×"), ratio >= least)
    }

    /// The same of the baseline.
    pub(crate) fn baseline(mut self, baseline: impl Into<String>) -> Figure {
        self.baseline = baseline.into();
        self
    }

    /// What it should be, and whether it is.
    pub(crate) fn target(mut self, target: impl Into<String>, met: bool) -> Figure {
        self.target = target.into();
        self.met = Some(met);
        self
    }
}

/// The figures of a group.
#[derive(Default)]
pub(crate) struct Section {
    figures: Vec<Figure>,
    notes: Vec<String>,
}

impl Section {
    /// Adds a figure.
    pub(crate) fn add(&mut self, figure: Figure) {
        self.figures.push(figure);
    }

    /// Adds something that was seen on the way.
    pub(crate) fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }
}

/// All sections, and what they were measured on.
pub(crate) struct BenchReport {
    machine: Machine,
    quick: bool,
    sections: Vec<(&'static str, Section)>,
}

impl BenchReport {
    /// An empty one.
    pub(crate) fn new(machine: Machine, quick: bool) -> BenchReport {
        BenchReport { machine, quick, sections: Vec::new() }
    }

    /// Adds the figures of a group.
    pub(crate) fn add(&mut self, title: &'static str, section: Section) {
        self.sections.push((title, section));
    }

    /// Puts the report into its page.
    pub(crate) fn write(&self) -> Outcome<()> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE);
        let page = fs::read_to_string(&path).doing(format!("read {}", path.display()))?;
        let page = replaced(&page, &self.to_string()).ok_or_else(|| {
            Failure::new(format!("there are no markers for the figures in {}", path.display()))
        })?;
        fs::write(&path, page).doing(format!("write {}", path.display()))
    }

    /// How many figures have a target, and how many of them meet it.
    fn score(&self) -> (usize, usize) {
        let figures = self.sections.iter().flat_map(|(_, section)| &section.figures);
        let verdicts: Vec<bool> = figures.filter_map(|figure| figure.met).collect();
        (verdicts.len(), verdicts.iter().filter(|met| **met).count())
    }
}

impl fmt::Display for BenchReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Measured on {}.", self.machine)?;
        if self.quick {
            writeln!(f, "A quick run: shorter, and less certain.")?;
        }
        let (targets, met) = self.score();
        writeln!(f, "{met} of {targets} targets are met.")?;
        for (title, section) in &self.sections {
            writeln!(f, "\n### {title}\n")?;
            writeln!(f, "| | measured | baseline | target | |")?;
            writeln!(f, "|---|---|---|---|---|")?;
            for Figure { what, measured, baseline, target, met } in &section.figures {
                let verdict = match met {
                    Some(true) => "met",
                    Some(false) => "**missed**",
                    None => "",
                };
                writeln!(f, "| {what} | {measured} | {baseline} | {target} | {verdict} |")?;
            }
            for note in &section.notes {
                writeln!(f, "\n{note}")?;
            }
        }
        Ok(())
    }
}

/// The page with another report between its markers; `None` if it has none.
fn replaced(page: &str, report: &str) -> Option<String> {
    let (before, rest) = page.split_once(BEGIN)?;
    let (_, after) = rest.split_once(END)?;
    Some(format!("{before}{BEGIN}\n{report}\n{END}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_between_the_markers_is_replaced() {
        let page = format!("before\n{BEGIN}old\n{END}after\n");
        let new = replaced(&page, "new\n").unwrap();
        assert_eq!(new, format!("before\n{BEGIN}\nnew\n\n{END}after\n"));
        assert_eq!(replaced(&new, "new\n").unwrap(), new);
        assert_eq!(replaced("no markers\n", "new\n"), None);
    }

    #[test]
    fn the_page_has_its_markers() {
        let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE)).unwrap();
        assert!(replaced(&page, "").is_some());
    }

    #[test]
    fn a_report_counts_its_targets() {
        let mut section = Section::default();
        section.add(Figure::new("speed", "9 /s").baseline("10 /s").target("0.8 ×", true));
        section.add(Figure::new("memory", "9 MB").target("5 MB", false));
        section.add(Figure::new("colour", "blue"));
        let mut report = BenchReport::new(Machine::here(), true);
        report.add("Things", section);
        let text = report.to_string();
        assert!(text.contains("1 of 2 targets are met"), "{text}");
        assert!(text.contains("| speed | 9 /s | 10 /s | 0.8 × | met |"), "{text}");
        assert!(text.contains("| memory | 9 MB |  | 5 MB | **missed** |"), "{text}");
        assert!(text.contains("| colour | blue |  |  |  |"), "{text}");
    }
}
