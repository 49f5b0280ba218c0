//! What was met, from the events of a controller.

use std::collections::{BTreeMap, BTreeSet};

use vimc4_catalogue::{Family, Model};
use vimc4_device::{Course, Event, Kinds};

use crate::coverage::{Command, Coverage, Point};

/// Collects what a controller's host has met.
#[derive(Clone, Debug)]
pub struct Collector {
    family: Family,
    coverage: Coverage,
    /// The places of the commands by their mnemonics.
    places: BTreeMap<String, usize>,
    strange: BTreeSet<String>,
}

impl Collector {
    /// The kinds of events that it looks at.
    pub const KINDS: Kinds = Kinds::ANSWER.and(Kinds::COURSE);

    /// For controllers of a model; nothing was met yet.
    #[must_use]
    pub fn new(model: &Model) -> Collector {
        let coverage = Coverage::of(model);
        let places = (0..).zip(&coverage.commands);
        let places = places.map(|(place, command)| (command.mnemonic.clone(), place)).collect();
        Collector { family: model.family(), coverage, places, strange: BTreeSet::new() }
    }

    /// Something has happened.
    pub fn see(&mut self, event: &Event) {
        match event {
            Event::Answer { mnemonic, bytes, .. } => {
                let kind = self.family.kind_of(bytes).unwrap_or_default();
                self.meet(mnemonic, "answered", &kind, "", |command| &mut command.answers);
            }
            Event::Course(Course::Finds { mnemonic, situation }) => {
                let state = situation.to_string();
                self.meet(mnemonic, "in state", &state, "", |command| &mut command.states);
            }
            Event::Course(Course::Stops { mnemonic, cause, situation }) => {
                let (cause, during) = (cause.to_string(), situation.to_string());
                self.meet(mnemonic, "stopped by", &cause, &during, |command| &mut command.stops);
            }
            _ => {}
        }
    }

    /// A point was met. What an answer means was not met with it.
    fn meet(
        &mut self,
        mnemonic: &str,
        how: &str,
        name: &str,
        during: &str,
        points: impl FnOnce(&mut Command) -> &mut Vec<Point>,
    ) {
        let command = self.places.get(mnemonic).and_then(|at| self.coverage.commands.get_mut(*at));
        let mut points = command.map(points).into_iter().flatten();
        let is_it =
            |point: &&mut Point| point.name == name && (during.is_empty() || point.about == during);
        match points.find(is_it) {
            Some(point) => point.met = point.met.saturating_add(1),
            None => {
                self.strange.insert(format!("{mnemonic} {how} {name} {during}").trim().to_owned());
            }
        }
    }

    /// What can be met, and how often it was.
    #[must_use]
    pub fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    /// What was met although the tables do not have it: there is nothing here unless they are wrong.
    pub fn not_listed(&self) -> impl Iterator<Item = &str> {
        self.strange.iter().map(String::as_str)
    }
}
