//! What is said while sessions are played, and in the end.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use vimc4_conform::choice::Plan;
use vimc4_conform::explain::Cause;
use vimc4_conform::format::Session;
use vimc4_conform::play::excerpt;
use vimc4_conform::player::Miss;
use vimc4_device::escape;

use super::announce::tally;
use super::arguments::{Arguments, watched};
use crate::failure::Failure;
use crate::output;
use crate::port::Port;

/// The outcome of a session.
pub(super) enum Outcome {
    Passed,
    Failed(Miss, Vec<Cause>),
    /// It could not be played safely, for this reason.
    Skipped(&'static str),
}

/// Tells a person, or collects for a program.
pub(super) struct ConformReport {
    json: bool,
    verbose: bool,
    model: String,
    port: String,
    bar: Option<ProgressBar>,
    passed: usize,
    failed: usize,
    /// Times that a port cannot check.
    unchecked: usize,
    /// Sessions that were not played, by reason: how many.
    left_out: BTreeMap<String, usize>,
    /// How many differences each cause explains.
    causes: BTreeMap<Cause, usize>,
    explained: usize,
    sessions: Vec<Value>,
    notes: BTreeSet<String>,
}

impl ConformReport {
    pub(super) fn new(arguments: &Arguments, port: &str, sessions: usize) -> ConformReport {
        let bar = watched(arguments).then(|| {
            let bar = ProgressBar::new(sessions as u64);
            let style = ProgressStyle::with_template("{bar:30} {pos}/{len}  {msg}");
            style.into_iter().for_each(|style| bar.set_style(style));
            bar
        });
        ConformReport {
            json: arguments.json,
            verbose: arguments.verbose,
            model: arguments.model.clone(),
            port: port.to_owned(),
            bar,
            passed: 0,
            failed: 0,
            unchecked: 0,
            left_out: BTreeMap::new(),
            causes: BTreeMap::new(),
            explained: 0,
            sessions: Vec::new(),
            notes: BTreeSet::new(),
        }
    }

    /// Something a person should know.
    pub(super) fn note(&mut self, text: &str) {
        self.say(&format!("{text}\n"));
        self.notes.insert(text.to_owned());
    }

    /// A session was not played.
    pub(super) fn not_played(
        &mut self,
        session: &Session,
        key: &str,
        in_general: &str,
        detail: &str,
    ) {
        *self.left_out.entry(in_general.to_owned()).or_default() += 1;
        self.add(session, "not-played", json!({ "reason": key, "detail": detail }));
    }

    /// A session was played, or should have been.
    pub(super) fn played(&mut self, session: &Session, plan: &Plan, outcome: &Outcome) {
        match outcome {
            Outcome::Passed => {
                self.passed += 1;
                self.unchecked += plan.unchecked;
                if self.verbose {
                    self.say(&format!("passed  {}\n", session.id));
                }
                self.add(session, "passed", json!({}));
            }
            Outcome::Failed(miss, causes) => {
                self.failed += 1;
                self.explained += usize::from(!causes.is_empty());
                for cause in causes {
                    *self.causes.entry(cause.clone()).or_default() += 1;
                }
                self.say(&difference(session, miss, causes));
                let explanations: Vec<Value> = causes
                    .iter()
                    .map(|cause| json!({ "cause": cause, "text": cause.to_string() }))
                    .collect();
                let details = json!({
                    "line": line(session, miss),
                    "expected": miss.expected,
                    "got": miss.got,
                    "received": escape(&miss.bytes),
                    "explanations": explanations,
                });
                self.add(session, "failed", details);
            }
            Outcome::Skipped(why) => {
                self.not_played(session, "unsafe", &format!("were left out: {why}"), why);
            }
        }
    }

    /// Says how it ended; whether all that was played passed.
    pub(super) fn finish(
        mut self,
        port: &Port,
        failure: Option<&Failure>,
    ) -> Result<bool, Failure> {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        if self.json {
            let report = json!({
                "model": self.model,
                "port": self.port,
                "baud": port.baud(),
                "passed": self.passed,
                "failed": self.failed,
                "not_played": self.left_out.values().sum::<usize>(),
                "times_not_checked": self.unchecked,
                "ended_early": failure.map(ToString::to_string),
                "notes": self.notes,
                "sessions": self.sessions,
            });
            output::print(&format!("{report}\n"))?;
        } else {
            output::print(&self.summary(failure.is_some()))?;
        }
        Ok(self.failed == 0)
    }

    fn summary(&self, early: bool) -> String {
        let mut text = String::new();
        if early {
            text += "This is not the end: ";
        }
        text += &format!("{} passed, {} failed", self.passed, self.failed);
        let left_out: usize = self.left_out.values().sum();
        text += &format!(", {left_out} not played\n");
        let mut causes: Vec<_> = self.causes.iter().collect();
        causes.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
        for (cause, count) in causes {
            text += &format!("{cause} would explain {count} of {} failures\n", self.failed);
        }
        let unexplained = self.failed - self.explained;
        if unexplained > 0 {
            text += &format!("{unexplained} of the failures no value of the profile explains\n");
        }
        if left_out > 0 {
            text += "Of the sessions that were not played\n";
            text += &tally(&self.left_out);
        }
        if self.unchecked > 0 {
            text += &format!("{} times were too exact to be checked at a port\n", self.unchecked);
        }
        text
    }

    fn add(&mut self, session: &Session, result: &str, mut details: Value) {
        if let Some(bar) = &self.bar {
            bar.set_message(session.id.clone());
            bar.inc(1);
        }
        if !self.json {
            return;
        }
        if let Some(object) = details.as_object_mut() {
            object.insert("id".to_owned(), json!(session.id));
            object.insert("title".to_owned(), json!(session.title));
            object.insert("evidence".to_owned(), json!(session.source.evidence().to_string()));
            object.insert("source".to_owned(), json!(session.source.to_string()));
            object.insert("result".to_owned(), json!(result));
        }
        self.sessions.push(details);
    }

    /// To a person. A program gets everything in the end.
    fn say(&self, text: &str) {
        if self.json {
            let _ = io::stderr().lock().write_all(text.as_bytes());
            return;
        }
        match &self.bar {
            Some(bar) => bar.suspend(|| self.print(text)),
            None => self.print(text),
        }
    }

    /// A failure to write now recurs at the end, where it is reported.
    fn print(&self, text: &str) {
        let mut out = io::stdout().lock();
        let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    }
}

/// One difference, as a person can act on it.
fn difference(session: &Session, miss: &Miss, causes: &[Cause]) -> String {
    let Session { id, path, title, source, .. } = session;
    let mut text = format!("FAILED  {id}  ({}:{})\n", path.display(), line(session, miss));
    text += &format!("  {title}\n  evidence {}: {source}\n\n", source.evidence());
    text += &excerpt(session, miss.step);
    text += &format!("  expected  {}\n  got       {}\n", miss.expected, miss.got);
    for cause in causes {
        text += &format!("  {cause} would explain it\n");
    }
    text + "\n"
}

/// The line of its file at which a session failed.
fn line(session: &Session, miss: &Miss) -> usize {
    session.steps.get(miss.step).map_or(1, |step| step.line)
}
