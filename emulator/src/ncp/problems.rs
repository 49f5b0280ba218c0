//! Showing the problems of a job file.

use std::io::{self, BufWriter, Write};

use annotate_snippets::Level;
use serde_json::{Value, json};
use vimc4_ncp::job::Summary;
use vimc4_ncp::language::{self, Lines, lines};
use vimc4_ncp::{Diagnostic, Problem, Severity};

use crate::excerpt::{self, Excerpt};
use crate::failure::Failure;
use crate::job::source::{JobArguments, Reading};
use crate::output;
use crate::text::{shortened, shown_in_line};

/// How many are shown with a picture of the line; the others get one line each.
const PICTURES: u64 = 20;

/// How many different problems are remembered with their help.
const KNOWN: usize = 16;

/// How problems are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Format {
    /// The line, the place, and what would be right
    #[default]
    Full,
    /// One line each: file:line:column: severity[code]: message; what would be right
    Short,
    /// One JSON object
    Json,
}

/// Shows the problems of a file.
pub(crate) struct Problems<'t> {
    name: String,
    format: Format,
    reading: Reading,
    /// The lines from the last one mentioned.
    lines: Lines<'t>,
    text: &'t str,
    current: (u32, &'t str),
    shown: u64,
    helps: Vec<(Problem, Option<String>)>,
    pub(crate) summary: Summary,
    /// The first line with an error, and what it is.
    first_error: Option<(u32, Problem)>,
    out: BufWriter<Box<dyn Write>>,
    written: io::Result<()>,
}

impl<'t> Problems<'t> {
    /// Shows them on standard output, if they are the requested result, or on standard error.
    pub(crate) fn new(
        job: &JobArguments,
        text: &'t str,
        format: Format,
        out: Box<dyn Write>,
    ) -> Problems<'t> {
        let mut problems = Problems {
            name: match format {
                Format::Json => job.file.display().to_string(),
                Format::Full | Format::Short => job.name(),
            },
            format,
            reading: job.options.reading,
            lines: lines(text),
            text,
            current: (0, ""),
            shown: 0,
            helps: Vec::new(),
            summary: Summary::default(),
            first_error: None,
            out: BufWriter::with_capacity(1 << 16, out),
            written: Ok(()),
        };
        if format == Format::Json {
            let file = json!(problems.name);
            problems.write(&format!("{{\"file\":{file},\"diagnostics\":["));
        }
        problems
    }

    pub(crate) fn show(&mut self, diagnostic: Diagnostic) {
        let severity = self.reading.severity(&diagnostic);
        self.summary.count(severity);
        let is_first = self.first_error.is_none_or(|(line, _)| diagnostic.line < line);
        if severity == Severity::Error && is_first {
            self.first_error = Some((diagnostic.line, diagnostic.problem));
        }
        let line = self.line(diagnostic.line);
        if self.written.is_ok() {
            self.written = match self.format {
                Format::Full if self.shown < PICTURES => self.picture(&diagnostic, severity, line),
                Format::Full | Format::Short => self.short(&diagnostic, severity, line),
                Format::Json => self.json(&diagnostic, severity, line),
            };
        }
        self.shown += 1;
    }

    /// The text of a line; they are mostly asked for in order.
    fn line(&mut self, number: u32) -> &'t str {
        if number < self.current.0 {
            self.lines = lines(self.text);
            self.current = (0, "");
        }
        while self.current.0 < number {
            let Some(line) = self.lines.next() else { break };
            self.current = (line.number, line.text);
        }
        if self.current.0 == number { self.current.1 } else { "" }
    }

    fn picture(
        &mut self,
        diagnostic: &Diagnostic,
        severity: Severity,
        line: &str,
    ) -> io::Result<()> {
        let level = match severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
            Severity::Note => Level::NOTE,
        };
        let problem = diagnostic.problem;
        let left_out = left_out(diagnostic, severity).map(str::to_owned);
        let help: Vec<String> = problem.help().into_iter().chain(left_out).collect();
        let help = (!help.is_empty()).then(|| help.join("; "));
        let place = excerpt_of_line(self.name.clone(), diagnostic, line);
        let (code, text) = (problem.code(), problem.to_string());
        let message = excerpt::message(level, Some(code), &text, Some(&place), help.as_deref());
        writeln!(self.out, "{message}\n")
    }

    fn short(&mut self, diagnostic: &Diagnostic, severity: Severity, line: &str) -> io::Result<()> {
        let problem = diagnostic.problem;
        let (number, column) = (diagnostic.line, column(diagnostic, line));
        let left_out = left_out(diagnostic, severity).map(|what| format!("; {what}"));
        let help = self.help(problem);
        let Problems { out, name, helps, .. } = self;
        let (word, code) = (word(severity), problem.code());
        write!(out, "{name}:{number}:{column}: {word}[{code}]: {problem}")?;
        if let Some((_, Some(help))) = helps.get(help) {
            write!(out, "; {help}")?;
        }
        writeln!(out, "{}", left_out.unwrap_or_default())
    }

    /// Where the help for a problem is. A file full of mistakes repeats the same ones, and finding
    /// what was meant takes a while.
    fn help(&mut self, problem: Problem) -> usize {
        if let Some(known) = self.helps.iter().position(|(known, _)| *known == problem) {
            return known;
        }
        if self.helps.len() >= KNOWN {
            self.helps.clear();
        }
        self.helps.push((problem, problem.help()));
        self.helps.len() - 1
    }

    fn json(&mut self, diagnostic: &Diagnostic, severity: Severity, line: &str) -> io::Result<()> {
        let object = as_json(diagnostic, severity, line);
        let comma = if self.shown > 0 { "," } else { "" };
        write!(self.out, "{comma}\n{object}")
    }

    /// Where the job ends in a lenient reading: a sentence.
    pub(crate) fn end(&self) -> Option<String> {
        let (line, problem) = self.first_error.filter(|_| self.reading.lenient)?;
        Some(format!("{}: the job ends at line {line}: {problem}", self.name))
    }

    /// Says how many there were.
    pub(crate) fn finish(mut self) -> Result<Summary, Failure> {
        let Summary { lines, errors, warnings, notes } = self.summary;
        if self.format == Format::Json {
            let ends = match (self.reading.lenient, self.first_error) {
                (false, _) => String::new(),
                (true, None) => ",\"ends_in_line\":null".to_owned(),
                (true, Some((line, _))) => format!(",\"ends_in_line\":{line}"),
            };
            let counts = format!(
                "\n],\"lines\":{lines},\"errors\":{errors},\"warnings\":{warnings},\"notes\":{notes}{ends}}}\n"
            );
            self.write(&counts);
        }
        let written = self.written.and_then(|()| self.out.flush());
        output::written(written)?;
        Ok(self.summary)
    }

    fn write(&mut self, text: &str) {
        if self.written.is_ok() {
            self.written = self.out.write_all(text.as_bytes());
        }
    }
}

/// A diagnostic about a line, for tools.
pub(crate) fn as_json(diagnostic: &Diagnostic, severity: Severity, line: &str) -> Value {
    let problem = diagnostic.problem;
    let range = diagnostic.span.range();
    json!({
        "line": diagnostic.line,
        "column": column(diagnostic, line),
        "end_column": line.get(..range.end).map_or(1, |before| before.chars().count() + 1),
        "text": line.get(range).unwrap_or_default(),
        "severity": severity,
        "code": problem.code(),
        "message": problem.to_string(),
        "help": problem.help(),
        "left_out": left_out(diagnostic, severity).is_some(),
    })
}

/// What a reading that finds a problem so severe leaves out for it, for people: a clause.
fn left_out(diagnostic: &Diagnostic, severity: Severity) -> Option<&'static str> {
    let is_left_out = diagnostic.left_out && severity < diagnostic.problem.severity();
    is_left_out.then_some(match diagnostic.problem {
        Problem::Written(language::Problem::BracketComment) => "the comment is left out",
        _ => "the line is left out",
    })
}

/// `2 errors, 1 warning`
pub(crate) fn counts(summary: &Summary) -> String {
    let Summary { errors, warnings, notes, .. } = *summary;
    let count = |number: u64, what: &str| match number {
        0 => None,
        1 => Some(format!("1 {what}")),
        _ => Some(format!("{number} {what}s")),
    };
    let counts = [count(errors, "error"), count(warnings, "warning"), count(notes, "note")];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    if counts.is_empty() { "nothing to be said".to_owned() } else { counts.join(", ") }
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    }
}

/// The column in characters, from 1.
fn column(diagnostic: &Diagnostic, line: &str) -> usize {
    let before = line.get(..diagnostic.span.range().start).unwrap_or_default();
    1 + if before.is_ascii() { before.len() } else { before.chars().count() }
}

/// How many characters of a line are shown before and behind a place, and how many of the place.
const AROUND: usize = 80;
const INSIDE: usize = 60;

/// The place of a problem and what is around it, in characters that a terminal shows.
fn excerpt_of_line(name: String, diagnostic: &Diagnostic, line: &str) -> Excerpt {
    let range = diagnostic.span.range();
    let before = line.get(..range.start).unwrap_or(line);
    let inside = line.get(range.start..range.end).unwrap_or_default();
    let behind = line.get(range.end.max(range.start)..).unwrap_or_default();
    let skipped = before.chars().count().saturating_sub(AROUND);
    let ellipsis = if skipped > 0 { "…" } else { "" };
    let before: String = before.chars().skip(skipped).collect();
    let mut text = format!("{ellipsis}{}", shown_in_line(&before));
    let start = text.len();
    text += &shown_in_line(&shortened(inside, INSIDE));
    let end = text.len();
    text += &shown_in_line(&shortened(behind, AROUND));
    Excerpt { name, text, line: diagnostic.line as usize, span: start..end }
}
