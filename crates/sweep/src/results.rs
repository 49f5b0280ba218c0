//! What was found, line by line, and put together from anywhere.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::key::key;
use crate::outcome::Outcome;
use crate::subject::Subject;

/// A line of a file of results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Row {
    /// The first line: of which sweep it is a part.
    Sweep(Box<Subject>),
    /// The host was seen to do now this and now that after it had heard the same.
    Unsteady,
    /// An outcome that was not seen before.
    Outcome {
        /// Its key.
        key: String,
        /// What it is.
        is: Box<Outcome>,
    },
    /// A case of an outcome that is smaller than those before.
    Case(Box<Case>),
    /// What came of a point.
    Point(u64, String),
}

/// A case of an outcome, for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Case {
    /// The key of the outcome.
    pub outcome: String,
    /// The number of the point.
    pub point: u64,
    /// How many lines a recording of it has, about.
    pub size: u64,
    /// What was broken.
    pub broken: String,
    /// How the machine stood in the end.
    pub machine: String,
    /// What the host should have noticed and done, if it did something wrong.
    pub should: Option<String>,
}

impl Case {
    /// The smallest of several is the one with the fewest lines, and of those the first.
    fn rank(&self) -> (u64, u64) {
        (self.size, self.point)
    }
}

/// Results that were put together: equal for the same points, whoever has found them in which order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Results {
    of: Option<Subject>,
    unsteady: bool,
    outcomes: BTreeMap<String, Outcome>,
    cases: BTreeMap<String, Case>,
    points: BTreeMap<u64, String>,
}

/// A file that cannot be taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ResultsError {
    /// A line is none of results, or the first is not the one that says what was swept.
    Unreadable {
        /// The line of the file, from 1.
        line: usize,
    },
    /// They are those of another sweep.
    Another {
        /// The line of the file, from 1.
        line: usize,
        /// In what it differs, in words.
        difference: String,
    },
}

impl fmt::Display for ResultsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ResultsError::Unreadable { line: 1 } => {
                write!(f, "line 1: it does not say which sweep these are the results of")
            }
            ResultsError::Unreadable { line } => write!(f, "line {line}: it is no line of results"),
            ResultsError::Another { line, difference } => {
                write!(f, "line {line}: these are the results of another sweep: {difference}")
            }
        }
    }
}

impl std::error::Error for ResultsError {}

/// An outcome, how often it was found, and the smallest case of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Group<'a> {
    /// The outcome.
    pub outcome: &'a Outcome,
    /// How many points have led to it.
    pub points: u64,
    /// Its smallest case.
    pub case: Option<&'a Case>,
}

impl Results {
    /// Results of a sweep, none yet.
    #[must_use]
    pub fn of(subject: Subject) -> Results {
        Results { of: Some(subject), ..Results::default() }
    }

    /// What was swept, for people; empty if that is not known.
    #[must_use]
    pub fn name(&self) -> &str {
        self.of.as_ref().map_or("", |subject| subject.of.as_str())
    }

    /// The first row of a file of them.
    #[must_use]
    pub fn head(&self) -> Option<Row> {
        self.of.clone().map(|subject| Row::Sweep(Box::new(subject)))
    }

    /// Whether the host was seen to do now this and now that after it had heard the same.
    #[must_use]
    pub fn is_unsteady(&self) -> bool {
        self.unsteady
    }

    /// A point is done again, because what shows it is lost.
    pub fn forget(&mut self, point: u64) {
        self.points.remove(&point);
        self.cases.retain(|_, case| case.point != point);
    }

    /// Adds what was found, and says which lines a file needs because of it. `case` is asked for if it is
    /// the smallest.
    pub fn add(
        &mut self,
        point: u64,
        outcome: &Outcome,
        size: u64,
        case: impl FnOnce() -> Option<Case>,
    ) -> Vec<Row> {
        let mut lines = Vec::new();
        let key = key_of(outcome);
        if !self.outcomes.contains_key(&key) {
            let is = Box::new(outcome.clone());
            lines.push(Row::Outcome { key: key.clone(), is });
        }
        if self.is_smallest(point, outcome, size)
            && let Some(case) = case()
        {
            lines.push(Row::Case(Box::new(case)));
        }
        lines.push(Row::Point(point, key));
        for line in &lines {
            self.take(line.clone());
        }
        lines
    }

    /// Whether what was found would be the smallest case of its outcome.
    #[must_use]
    pub fn is_smallest(&self, point: u64, outcome: &Outcome, size: u64) -> bool {
        let known = self.cases.get(&key_of(outcome)).map(Case::rank);
        known.is_none_or(|known| (size, point) < known)
    }

    /// Takes a line. One that does not belong here is left out, and the difference is returned.
    pub fn take(&mut self, line: Row) -> Option<String> {
        match line {
            Row::Sweep(subject) => match &self.of {
                Some(of) => return of.difference(&subject),
                None => self.of = Some(*subject),
            },
            Row::Unsteady => self.unsteady = true,
            Row::Outcome { key, is } => drop(self.outcomes.entry(key).or_insert(*is)),
            Row::Case(case) => {
                let known = self.cases.get(&case.outcome).map(Case::rank);
                if known.is_none_or(|known| case.rank() < known) {
                    self.cases.insert(case.outcome.clone(), *case);
                }
            }
            Row::Point(point, key) => drop(self.points.insert(point, key)),
        }
        None
    }

    /// Takes a file of results. A last line that was torn off is left out. Returns the length of what is
    /// whole.
    ///
    /// # Errors
    ///
    /// If the file is of another sweep, or no such file.
    pub fn read(&mut self, text: &str) -> Result<usize, ResultsError> {
        let mut whole = 0;
        for (number, line) in (1..).zip(text.split_inclusive('\n')) {
            if !line.ends_with('\n') {
                break;
            }
            let unreadable = ResultsError::Unreadable { line: number };
            let row = serde_json::from_str(line).map_err(|_| unreadable.clone())?;
            if number == 1 && !matches!(row, Row::Sweep(_)) {
                return Err(unreadable);
            }
            if let Some(difference) = self.take(row) {
                return Err(ResultsError::Another { line: number, difference });
            }
            whole += line.len();
        }
        Ok(whole)
    }

    /// How many points there are.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.of.as_ref().map_or(0, |subject| subject.points)
    }

    /// How many of them are done.
    #[must_use]
    pub fn done(&self) -> u64 {
        self.points.len() as u64
    }

    /// Whether a point is done.
    #[must_use]
    pub fn has(&self, point: u64) -> bool {
        self.points.contains_key(&point)
    }

    /// The smallest case of each outcome, by the key of the outcome.
    #[must_use]
    pub fn cases(&self) -> &BTreeMap<String, Case> {
        &self.cases
    }

    /// The outcomes, those with something wrong first, the more frequent ones before the others.
    #[must_use]
    pub fn groups(&self) -> Vec<Group<'_>> {
        let mut points: BTreeMap<&str, u64> = BTreeMap::new();
        for key in self.points.values() {
            *points.entry(key).or_default() += 1;
        }
        let group = |(key, outcome): (&'_ String, _)| {
            let points = points.get(key.as_str()).copied().unwrap_or_default();
            Group { outcome, points, case: self.cases.get(key) }
        };
        let mut groups: Vec<Group<'_>> = self.outcomes.iter().map(group).collect();
        groups.sort_by_key(|group| {
            let is_good = group.outcome.verdicts.is_empty();
            (is_good, group.outcome.verdicts.first().copied(), u64::MAX - group.points)
        });
        groups
    }

    /// Everything, in an order that only depends on what was found.
    #[must_use]
    pub fn lines(&self) -> Vec<Row> {
        let mut lines: Vec<Row> = self.head().into_iter().collect();
        lines.extend(self.unsteady.then_some(Row::Unsteady));
        let outcomes = self.outcomes.iter();
        lines.extend(
            outcomes.map(|(key, is)| Row::Outcome { key: key.clone(), is: Box::new(is.clone()) }),
        );
        lines.extend(self.cases.values().map(|case| Row::Case(Box::new(case.clone()))));
        lines.extend(self.points.iter().map(|(point, key)| Row::Point(*point, key.clone())));
        lines
    }
}

/// The short name of an outcome.
pub(crate) fn key_of(outcome: &Outcome) -> String {
    // Every outcome can be written down.
    key(&serde_json::to_vec(outcome).unwrap_or_default())
}
