//! The groups of figures, in the order of the report.

mod api;
mod clock;
mod commands;
mod endings;
mod forward;
mod history;
mod idle;
mod jobs;
mod memory;
mod motion;
mod moves;
mod neighbour;
mod opening;
mod pacing;
mod ping;
mod recording;
mod startup;
mod sweep;
mod watching;

use super::Bench;
use super::failure::Outcome;
use super::report::Section;

/// Figures that belong together.
pub(crate) struct Group {
    /// What it is called on the command line.
    pub(crate) name: &'static str,
    /// Its title in the report.
    pub(crate) title: &'static str,
    /// Measures them.
    pub(crate) measure: fn(&Bench) -> Outcome<Section>,
}

const fn group(
    name: &'static str,
    title: &'static str,
    measure: fn(&Bench) -> Outcome<Section>,
) -> Group {
    Group { name, title, measure }
}

/// All groups.
pub(crate) const GROUPS: [Group; 19] = [
    group("ping", "Question and answer", ping::measure),
    group("recording", "Recording", recording::measure),
    group("opening", "Opening a long recording", opening::measure),
    group("watching", "Being watched", watching::measure),
    group("api", "Seen over HTTP", api::measure),
    group("startup", "Start", startup::measure),
    group("memory", "Memory", memory::measure),
    group("idle", "Idling", idle::measure),
    group("commands", "Commands in virtual time", commands::measure),
    group("moves", "Long moves in virtual time", moves::measure),
    group("motion", "Enumerated steps", motion::measure),
    group("forward", "Fast-forward", forward::measure),
    group("history", "A history of a million commands", history::measure),
    group("sweep", "A sweep over a recorded session", sweep::measure),
    group("jobs", "Job files of a million lines", jobs::measure),
    group("clock", "Real time", clock::measure),
    group("pacing", "Line pacing", pacing::measure),
    group("neighbour", "A flooded neighbour", neighbour::measure),
    group("endings", "Coming and going", endings::measure),
];
