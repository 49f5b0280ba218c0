//! Everything that the screen shows, as values. What is drawn is decided by this alone.

use std::sync::Arc;

use vimc4_catalogue::{Details, Machine};
use vimc4_debug::Listing;
use vimc4_device::{CommandNumber, Signal, Time, View};

use super::path::{Gaze, Stroke};

/// Everything that the screen shows.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    pub(crate) view: View<Details>,
    pub(crate) machine: Arc<Machine>,
    /// The things of the panel.
    pub(crate) signals: Vec<Signal>,
    /// What the controller is doing with its time: `held`, `runs at 8x`, `recorded` and so on.
    pub(crate) clock: String,
    /// The command that is executed, or was last.
    pub(crate) command: Option<String>,
    pub(crate) listing: Listing,
    pub(crate) talk: Vec<Talk>,
    pub(crate) strokes: Vec<Stroke>,
    pub(crate) gaze: Gaze,
    pub(crate) line: TimeLine,
    /// What is watched: expressions and their values.
    pub(crate) watches: Vec<String>,
    /// What was answered last, oldest first.
    pub(crate) said: Vec<SaidLine>,
    pub(crate) prompt: Prompt,
    /// What the arrow keys go by.
    pub(crate) unit: String,
    pub(crate) shows_keys: bool,
    /// Whether no line console is behind it, to which `q` comes back.
    pub(crate) is_first: bool,
}

/// Something that came or went on the line, or happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Talk {
    pub(crate) at: Time,
    pub(crate) side: Side,
    /// The bytes, or what happened.
    pub(crate) text: String,
    /// What it means.
    pub(crate) meaning: String,
    /// The command that it is a reply to.
    pub(crate) replies_to: Option<CommandNumber>,
}

/// Where something comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// The software.
    Host,
    /// The controller.
    Controller,
    /// The controller, and it is an error.
    Problem,
    /// The world around it.
    World,
}

/// A line that was typed, and what was answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SaidLine {
    pub(crate) text: String,
    pub(crate) kind: SaidKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SaidKind {
    Typed,
    Answer,
    Wrong,
}

/// The history as a line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct TimeLine {
    pub(crate) begin: Time,
    pub(crate) now: Time,
    pub(crate) end: Time,
    /// How much of a recording is known, in thousandths, while there is more.
    pub(crate) read: Option<u32>,
    /// The branch that one is on.
    pub(crate) branch: String,
    /// How many there are.
    pub(crate) branches: usize,
    /// Where the states are that are kept.
    pub(crate) snapshots: Vec<Time>,
    /// Where branches part.
    pub(crate) partings: Vec<Time>,
    pub(crate) marks: Vec<(String, Time)>,
    /// Where the emulation differs from the recording.
    pub(crate) differences: Vec<Time>,
}

/// The line at the bottom.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Prompt {
    /// Whether somebody types there.
    pub(crate) is_open: bool,
    pub(crate) text: String,
    /// The place of the cursor in characters.
    pub(crate) cursor: usize,
    /// How it could go on.
    pub(crate) hint: String,
    /// What can stand where the cursor is.
    pub(crate) candidates: Vec<String>,
}
