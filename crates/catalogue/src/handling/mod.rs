//! How a client handles a controller besides sending it commands, and what it knows of the
//! language without speaking it.

mod isel;
mod lpkf;

use std::ops::Range;
use std::time::Duration;

use vimc4_device::Point;

use crate::{Family, Model};

/// What a client of a controller knows to send when it must stop, reset, erase or find one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Handling {
    model: Model,
    /// After one of these bytes nothing is left of what was begun before it: what ends a line or a
    /// command, and the control codes.
    pub ends: &'static [u8],
    /// Where LF is none of them: those that a client can end its lines with instead, and for people
    /// which those are and how they are sent.
    pub instead_of_line_feed: Option<(&'static [u8], &'static str)>,
    /// Lets nothing more happen than must: what moves halts, as far as the line can make it.
    pub halt: &'static [u8],
    /// What `halt` does, for people: a clause after "interrupted".
    pub halting: &'static str,
    /// What Ctrl-C does, for people: a sentence.
    pub warning: &'static str,
    /// Ends a motion, as far as the line can, and forgets the rest of it.
    pub abandon: &'static [u8],
    /// Makes the controller as it is after power-on, without an answer that counts.
    pub reset: &'static [u8],
    /// These lines make up for what the reset does not bring back.
    pub ready: &'static [&'static str],
    /// If the reset does not make everything as after power-on, and the counters above all go on
    /// from where they were: what brings those to 0, for people.
    pub homing: Option<&'static str>,
    /// How long it may be deaf after that.
    pub boot: Duration,
    /// How long what runs may go on before the reset takes effect.
    pub running: Duration,
    /// Asks where the axes are; it is never refused at rest and changes nothing.
    pub position: &'static str,
    /// These lines ask what it is called and which version it has; a model knows one of them, and
    /// none changes anything.
    pub names: &'static [&'static str],
    /// Answers a command that was carried out and says nothing else.
    pub done: &'static [u8],
    /// The speeds that such controllers are set to, baud, the commonest first.
    pub speeds: &'static [u32],
    /// These lines erase the stored program and bring the saved settings back to the factory's.
    /// A model answers [`done`](Handling::done) to those that it has; one that has none erases
    /// at its panel only, or has nothing to erase.
    pub erase: &'static [&'static str],
    /// These lines, as far as a model has them, leave a program and saved settings that differ
    /// from the factory's in what they do.
    pub fill: &'static [&'static str],
    /// Whether START at the panel goes on with a motion that was stopped; else the host does.
    pub start_resumes: bool,
    /// These lines start the stored program on models that can do so by a command.
    pub start: &'static [&'static str],
}

/// What sending something may do to the machine, whatever its parameters are and whether or not
/// the controller should refuse it: a real one may not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effects {
    /// It may set axes or the head in motion.
    pub moves: bool,
    /// It may drive axes to their switches, wherever those are.
    pub reference: bool,
    /// It may switch outputs: the spindle, the brake, the motor currents, whatever is connected.
    pub outputs: bool,
    /// It may write the controller's flash memory.
    pub writes_flash: bool,
    /// It may start whatever program is stored.
    pub starts: bool,
    /// It changes where the controller expects its switches.
    pub switches: bool,
}

/// A piece of a stream of commands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Which bytes of the file, with its end if it has one.
    pub bytes: Range<usize>,
    /// Whether it is a command; else it passes through the controller to what is behind it, or is
    /// nothing but numbers.
    pub command: bool,
    /// How many numbers it has that belong to no command and mean nothing.
    pub numbers: usize,
    /// Whether it would be a command in capital letters. As it is, the controller ignores it.
    pub lower_case: bool,
}

/// When the turn of a command comes that is sent while others wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// It waits until the one before it is done.
    InOrder,
    /// It overtakes those that wait.
    Overtakes,
    /// It is none that the controller knows.
    Unknown,
}

impl Effects {
    /// These and those.
    #[must_use]
    pub fn and(self, other: Effects) -> Effects {
        Effects {
            moves: self.moves | other.moves,
            reference: self.reference | other.reference,
            outputs: self.outputs | other.outputs,
            writes_flash: self.writes_flash | other.writes_flash,
            starts: self.starts | other.starts,
            switches: self.switches | other.switches,
        }
    }
}

impl Handling {
    /// How this model is handled.
    #[must_use]
    pub fn of(model: &Model) -> Handling {
        match model {
            Model::Isel(inner) => isel::handling(model.clone(), inner),
            Model::Lpkf(inner) => lpkf::handling(model.clone(), inner),
        }
    }

    /// The model that is handled so.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The places in an answer to [`position`](Handling::position), X first; `None` if it is no
    /// such answer. A model that tells of configured axes only has fewer places, or none, and does
    /// not say of which axes they are.
    #[must_use]
    pub fn read_position(&self, answer: &[u8]) -> Option<Vec<i64>> {
        match &self.model {
            Model::Isel(inner) => isel::read_position(inner, answer),
            Model::Lpkf(_) => lpkf::read_position(answer),
        }
    }

    /// Whether this is all that is answered to a line that was sent with its end, given that
    /// every command is answered: text of isel's controllers is known to be whole only by what
    /// does not follow it.
    #[must_use]
    pub fn is_whole(&self, sent: &[u8], answer: &[u8]) -> bool {
        match self.model.family() {
            Family::Isel => !answer.is_empty(),
            Family::Lpkf => lpkf::is_whole(sent, answer),
        }
    }

    /// The lines, each to be answered [`done`](Handling::done), with which a controller that has
    /// just been reset moves its axes by so many steps, the fastest of them at `speed` Hz.
    #[must_use]
    pub fn moving(&self, by: Point, speed: u64) -> Vec<String> {
        match &self.model {
            Model::Isel(_) => isel::moving(by, speed),
            Model::Lpkf(model) => lpkf::moving(model, by, speed),
        }
    }

    /// When a command is carried out that others wait before.
    #[must_use]
    pub fn turn(&self, command: &[u8]) -> Turn {
        match &self.model {
            Model::Isel(_) => Turn::InOrder,
            Model::Lpkf(model) => lpkf::turn(model, command),
        }
    }

    /// The value of a profile with which a controller would know a command that this one does not.
    #[must_use]
    pub fn known_with(&self, command: &[u8]) -> Option<&'static str> {
        match &self.model {
            Model::Isel(_) => None,
            Model::Lpkf(model) => lpkf::known_with(model, command),
        }
    }

    /// What is wrong with a command, if the answer to it says that something is.
    #[must_use]
    pub fn refusal(&self, command: &[u8], answer: &[u8]) -> Option<String> {
        match &self.model {
            Model::Isel(_) => isel::refusal(answer),
            Model::Lpkf(model) => lpkf::refusal_of(model, command, answer),
        }
    }

    /// The pieces of a file, in order, if it is a stream of commands and not a list of lines.
    #[must_use]
    pub fn stream(&self, file: &[u8]) -> Option<Vec<Piece>> {
        match &self.model {
            Model::Isel(_) => None,
            Model::Lpkf(model) => Some(lpkf::stream(model, file)),
        }
    }
}

impl Family {
    /// What sending these bytes to a controller that has just been switched on may do.
    #[must_use]
    pub fn effects_of(self, sent: &[u8]) -> Effects {
        match self {
            Family::Isel => isel::effects_of(sent),
            Family::Lpkf => lpkf::effects_of(sent),
        }
    }

    /// What setting the signal of that name may do.
    #[must_use]
    pub fn effects_of_signal(self, name: &str) -> Effects {
        match self {
            Family::Isel => isel::effects_of_signal(name),
            // What the trackball moves it moves because a command has opened it.
            Family::Lpkf => Effects::default(),
        }
    }

    /// What kind of answer it is: `0`, `C`, `E0D`, as the tables of the commands name them.
    #[must_use]
    pub fn kind_of(self, answer: &[u8]) -> Option<String> {
        match self {
            Family::Isel => isel::kind_of(answer),
            Family::Lpkf => lpkf::kind_of(answer),
        }
    }

    /// Whether a command that has answered this has nothing more to answer.
    #[must_use]
    pub fn completes(self, answer: &[u8]) -> bool {
        match self {
            Family::Isel => true,
            Family::Lpkf => matches!(answer.first(), Some(b'C' | b'E' | b'Z')),
        }
    }

    /// What is wrong, if the answer says that something is: `5: unknown or malformed command`.
    #[must_use]
    pub fn refusal(self, answer: &[u8]) -> Option<String> {
        match self {
            Family::Isel => isel::refusal(answer),
            Family::Lpkf => lpkf::refusal(answer),
        }
    }
}
