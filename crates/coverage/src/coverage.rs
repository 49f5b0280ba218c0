//! Points that can be met, and how often they were.

use serde::{Deserialize, Serialize};
use thiserror::Error;
use vimc4_catalogue::Model;
use vimc4_device::Ability;

/// The format of the file. It goes up when an older program could not read what this one writes.
const FORMAT: u32 = 1;

/// All that a controller of one model can do, and how often each of it was met.
///
/// It is plain data: it can be kept, merged with that of other runs, and written as JSON.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coverage {
    #[serde(rename = "vimc4-coverage")]
    format: u32,
    /// The model.
    pub model: String,
    /// Every form of every command, in the order of the model's tables.
    pub commands: Vec<Command>,
}

/// One form of a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Command {
    /// The stable mnemonic; `?` for what is no command, and empty for what comes unasked.
    pub mnemonic: String,
    /// What it is, for people, in lower case.
    pub title: String,
    /// Where the manual describes it; empty where no manual does.
    pub section: String,
    /// Its answers, by the code.
    pub answers: Vec<Point>,
    /// What the controller can be doing when it takes the command, or executes it as a line of a program.
    pub states: Vec<Point>,
    /// What can stop it, and during what.
    pub stops: Vec<Point>,
}

/// One thing that can be met.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// What: the code of an answer, a state, or what stops a command.
    pub name: String,
    /// More about it, for people: what an answer means; during what something stops a command. It may be
    /// empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
    /// How often it was met.
    pub met: u64,
}

/// How much of something was met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Total {
    /// So many were met at least once.
    pub met: usize,
    /// So many are possible.
    pub possible: usize,
}

/// How much was met of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Totals {
    /// Of the forms of commands, those that were sent or executed.
    pub commands: Total,
    /// Of the answers.
    pub answers: Total,
    /// Of the states.
    pub states: Total,
    /// Of what stops commands.
    pub stops: Total,
}

/// Why a text is no coverage, or two of them do not go together.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CoverageError {
    /// It is not what this program writes.
    #[error("it is no coverage that `--coverage` has written: {why}")]
    Unreadable {
        /// What is wrong.
        why: String,
    },
    /// It has another format.
    #[error(
        "it has format {found} of coverage, and this program reads format {FORMAT}: measure anew into another file"
    )]
    Format {
        /// Its format.
        found: u64,
    },
    /// It is of another model.
    #[error("it covers the model {found}, and this is {own}: use a file for each model")]
    Model {
        /// The model that it covers.
        found: String,
        /// The model that it should.
        own: String,
    },
    /// It lists other things for the same model.
    #[error(
        "it lists other commands and answers for the model {model}, as another version or another profile has them: measure anew into another file"
    )]
    Tables {
        /// The model.
        model: String,
    },
}

impl Total {
    pub(crate) fn of<'p>(points: impl IntoIterator<Item = &'p Point>) -> Total {
        points.into_iter().fold(Total::default(), |total, point| total.with(point.met > 0))
    }

    fn with(self, met: bool) -> Total {
        Total { met: self.met + usize::from(met), possible: self.possible + 1 }
    }

    /// The share that was met, in per cent; 100 where nothing is possible.
    #[must_use]
    pub fn percent(self) -> f64 {
        if self.possible == 0 { 100.0 } else { 100.0 * self.met as f64 / self.possible as f64 }
    }
}

impl Point {
    fn new(name: impl Into<String>, about: impl Into<String>) -> Point {
        Point { name: name.into(), about: about.into(), met: 0 }
    }
}

impl Command {
    fn of(ability: &Ability) -> Command {
        let Ability { mnemonic, title, section, answers, finds, stops } = ability;
        let answers = answers.iter().map(|(kind, means)| Point::new(kind, *means));
        let states = finds.iter().map(|situation| Point::new(situation.to_string(), ""));
        let stops =
            stops.iter().map(|(cause, during)| Point::new(cause.to_string(), during.to_string()));
        Command {
            mnemonic: (*mnemonic).to_owned(),
            title: (*title).to_owned(),
            section: (*section).to_owned(),
            answers: answers.collect(),
            states: states.collect(),
            stops: stops.collect(),
        }
    }

    /// All its points.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.answers.iter().chain(&self.states).chain(&self.stops)
    }

    fn points_mut(&mut self) -> impl Iterator<Item = &mut Point> {
        self.answers.iter_mut().chain(&mut self.states).chain(&mut self.stops)
    }

    /// Whether anything of it was met.
    #[must_use]
    pub fn is_met(&self) -> bool {
        self.points().any(|point| point.met > 0)
    }

    /// How often it was taken from the line, or executed as a line of a program. What no line brings is
    /// counted by its answers.
    #[must_use]
    pub fn times(&self) -> u64 {
        let points = if self.states.is_empty() { &self.answers } else { &self.states };
        points.iter().fold(0, |times, point| times.saturating_add(point.met))
    }

    /// Whether the other lists the same.
    fn lists_as(&self, other: &Command) -> bool {
        let same = |one: &Vec<Point>, other: &Vec<Point>| {
            one.len() == other.len()
                && one
                    .iter()
                    .zip(other)
                    .all(|(one, other)| (&one.name, &one.about) == (&other.name, &other.about))
        };
        self.mnemonic == other.mnemonic
            && same(&self.answers, &other.answers)
            && same(&self.states, &other.states)
            && same(&self.stops, &other.stops)
    }
}

impl Coverage {
    /// All that controllers of a model can do, of which nothing was met yet.
    #[must_use]
    pub fn of(model: &Model) -> Coverage {
        let commands = model.abilities().iter().map(Command::of).collect();
        Coverage { format: FORMAT, model: model.name().to_owned(), commands }
    }

    /// The form of a command with this mnemonic.
    #[must_use]
    pub fn command(&self, mnemonic: &str) -> Option<&Command> {
        self.commands.iter().find(|command| command.mnemonic == mnemonic)
    }

    /// Adds what was met in other runs.
    ///
    /// # Errors
    ///
    /// If it covers another model, or lists other things for it. Nothing is added then.
    pub fn merge(&mut self, other: &Coverage) -> Result<(), CoverageError> {
        if self.model != other.model {
            let (found, own) = (other.model.clone(), self.model.clone());
            return Err(CoverageError::Model { found, own });
        }
        let pairs = || self.commands.iter().zip(&other.commands);
        if self.commands.len() != other.commands.len()
            || !pairs().all(|(one, other)| one.lists_as(other))
        {
            return Err(CoverageError::Tables { model: self.model.clone() });
        }
        for (own, other) in self.commands.iter_mut().zip(&other.commands) {
            for (own, other) in own.points_mut().zip(other.points()) {
                own.met = own.met.saturating_add(other.met);
            }
        }
        Ok(())
    }

    /// How much was met.
    #[must_use]
    pub fn totals(&self) -> Totals {
        let of =
            |points: fn(&Command) -> &Vec<Point>| Total::of(self.commands.iter().flat_map(points));
        let commands = self.commands.iter();
        Totals {
            commands: commands.fold(Total::default(), |total, c| total.with(c.is_met())),
            answers: of(|command| &command.answers),
            states: of(|command| &command.states),
            stops: of(|command| &command.stops),
        }
    }

    // --- as a file ---

    /// As JSON, a line for each command.
    #[must_use]
    pub fn to_json(&self) -> String {
        let mut json = format!(
            "{{\"vimc4-coverage\":{},\"model\":{},\"commands\":[\n",
            self.format,
            serde_json::json!(self.model)
        );
        for (number, command) in self.commands.iter().enumerate() {
            if number > 0 {
                json.push_str(",\n");
            }
            // A structure of texts and numbers can always be written.
            json.push_str(&serde_json::to_string(command).unwrap_or_default());
        }
        json.push_str("\n]}\n");
        json
    }

    /// What [`to_json`](Coverage::to_json) has written.
    ///
    /// # Errors
    ///
    /// If it is something else, or has another format.
    pub fn from_json(text: &str) -> Result<Coverage, CoverageError> {
        let unreadable =
            |error: serde_json::Error| CoverageError::Unreadable { why: error.to_string() };
        let value: serde_json::Value = serde_json::from_str(text).map_err(unreadable)?;
        match value.get("vimc4-coverage").and_then(serde_json::Value::as_u64) {
            Some(found) if found != u64::from(FORMAT) => Err(CoverageError::Format { found }),
            Some(_) => serde_json::from_value(value).map_err(unreadable),
            None => Err(CoverageError::Unreadable { why: "its format is not in it".to_owned() }),
        }
    }
}
