//! What tools that do not speak a family's language can ask about it.

use std::error::Error;
use std::fmt;

use crate::{
    Ability, Effects, Handling, Heard, Identity, Piece, Point, Question, Travel, Turn, Vocabulary,
};

/// A model of controllers of one family: what every tool must know of it and of its family.
///
/// What holds for all models of the family takes no `self`. A default implementation holds for most
/// families.
pub trait Model: Sized {
    /// The name of the family as typed.
    const FAMILY: &'static str;
    /// Its name as its maker writes it.
    const MAKER: &'static str;
    /// The command sets that profiles can name. No other family has one of these names.
    const COMMAND_SETS: &'static [&'static str];
    /// The axes of its models, as each of them that has others calls them, in the order in which points count
    /// them.
    const AXES: &'static [&'static [&'static str]];
    /// Every value that each quirk of a profile can have, as TOML writes it.
    const QUIRKS: &'static [(&'static str, &'static [&'static str])];

    /// The possible effects of sending these bytes to a controller that has just been switched on.
    fn effects_of(sent: &[u8]) -> Effects;

    /// The possible effects of setting the signal of that name.
    fn effects_of_signal(_name: &str) -> Effects {
        Effects::default()
    }

    /// The lasting effect of a command.
    fn travel_of(command: &[u8]) -> Travel;

    /// The kind of an answer, as the command tables name it.
    fn kind_of(answer: &[u8]) -> Option<String>;

    /// Whether this answer is the last one to its command.
    fn completes(answer: &[u8]) -> bool;

    /// The error, if the answer is one: its code and what it means.
    fn refusal(answer: &[u8]) -> Option<String>;

    /// Whether only controllers of this family ever answer so.
    fn is_own_answer(_answer: &[u8]) -> bool {
        false
    }

    /// Whether the counters may have been set to 0 when this was answered.
    fn resets_counters(_answer: &[u8]) -> bool {
        false
    }

    /// Whether the counters may no longer match the axes when this was answered: steps may have
    /// been lost, or the axes had no reference point.
    fn distrusts_counters(_answer: &[u8]) -> bool {
        false
    }

    /// Whether a controller that has moved its axes gives this answer only after it has lost its
    /// settings, through loss of power or an emergency stop.
    fn has_forgotten(_answer: &[u8]) -> bool {
        false
    }

    /// Its name.
    fn name(&self) -> &str;

    /// What it is, in one line.
    fn title(&self) -> &str;

    /// Bits per second of its line after power-on.
    fn baud(&self) -> u32;

    /// The axes that it can have, as it calls them, in the order in which points count them.
    fn axis_names(&self) -> &'static [&'static str];

    /// Whether its line has RTS and CTS, with which it tells the host to wait.
    fn has_handshake_lines(&self) -> bool {
        false
    }

    /// What a person does at its panel to erase the memory: signals and their values, in order.
    /// Switches are put back afterwards.
    ///
    /// # Errors
    ///
    /// If its panel cannot erase: why, for people.
    fn erasing_at_panel(&self) -> Result<&'static [(&'static str, i32)], &'static str>;

    /// How long its panel takes to erase the memory, in ms, if it can.
    fn panel_erase_ms(&self) -> Option<u64> {
        None
    }

    /// Whether its commands are the same.
    fn has_commands_of(&self, other: &Self) -> bool;

    /// How it is handled.
    fn handling(&self) -> Handling;

    /// The positions in an answer to [`Handling::position`], X first; `None` if it is not such an
    /// answer.
    fn read_position(&self, answer: &[u8]) -> Option<Vec<i64>>;

    /// Whether this many positions show which axes they belong to. They do not on a model that
    /// reports configured axes only.
    fn names_axes(&self, _places: usize) -> bool {
        true
    }

    /// How complete the answer to a command is that was sent with its end; with nothing sent, the
    /// answer to something that was caused otherwise.
    fn hear(&self, sent: &[u8], answer: &[u8]) -> Heard;

    /// The lines, each to be answered [`Handling::done`], that make a freshly reset controller move
    /// its axes by this many steps, the fastest of them at `speed` Hz.
    fn moving(&self, by: Point, speed: u64) -> Vec<String>;

    /// When a command is carried out that has others waiting before it.
    fn turn(&self, _command: &[u8]) -> Turn {
        Turn::InOrder
    }

    /// What can happen at one of its controllers, as conditions name it; `None` if that is not
    /// known.
    fn vocabulary(&self) -> Option<Vocabulary> {
        None
    }

    /// What its controllers can do with each form of a command, in the order of the tables. A family
    /// that lists nothing cannot be covered.
    fn abilities(&self) -> Vec<Ability> {
        Vec::new()
    }

    /// The profile value with which a controller would know a command that this one does not know.
    fn known_with(&self, _command: &[u8]) -> Option<&'static str> {
        None
    }

    /// What is wrong with a command, if the answer to it is an error.
    fn refusal_of(&self, _command: &[u8], answer: &[u8]) -> Option<String> {
        Self::refusal(answer)
    }

    /// Whether a command switches the spindle on or off, which STOP at the panel switches off; `None`
    /// if it does neither.
    fn spindle_after(&self, _command: &[u8]) -> Option<bool> {
        None
    }

    /// The input port, and the bit of it, that show the spindle.
    fn spindle_shown(&self) -> Option<(u16, u8)> {
        None
    }

    /// The pieces of a stream of commands, in order. Empty where files are lists of lines.
    fn stream(&self, _file: &[u8]) -> Vec<Piece> {
        Vec::new()
    }

    /// Identifies a controller. That moves nothing.
    ///
    /// # Errors
    ///
    /// If `ask` fails, with its error.
    fn identify<E>(
        &self,
        ask: &mut dyn FnMut(Question) -> Result<Vec<u8>, E>,
    ) -> Result<Identity, E>;
}

/// Why an image does not fit a model's memory.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MemoryError {
    /// This line of it is wrong.
    Line {
        /// The line, from 1.
        line: usize,
        /// What is wrong there, in one lower-case sentence.
        message: String,
    },
    /// The model forgets everything when it is switched off.
    NoMemory,
}

impl fmt::Display for MemoryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MemoryError::Line { line, message } => {
                write!(f, "line {line} of the flash image: {message}")
            }
            MemoryError::NoMemory => {
                f.write_str("it holds something, and this model has no memory that lasts")
            }
        }
    }
}

impl Error for MemoryError {}
