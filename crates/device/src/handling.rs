//! How a client handles a controller besides sending it commands.

use std::ops::Range;
use std::time::Duration;

/// What a client of a controller knows to send when it must stop, reset, erase or find one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Handling {
    /// Bytes after which nothing remains of what was begun before: those that end a line or a
    /// command, and the control codes.
    pub ends: &'static [u8],
    /// Where LF is not among them: the bytes that a client can end its lines with instead, and a
    /// text for people that names them and how to send them.
    pub instead_of_line_feed: Option<(&'static [u8], &'static str)>,
    /// Stops as much as possible: motions halt, as far as the line can make them.
    pub halt: &'static [u8],
    /// What `halt` does, for people: a clause after "interrupted".
    pub halting: &'static str,
    /// What stops a motion and goes on with it, where the line can do that.
    pub stop: Option<Stop>,
    /// What Ctrl-C does, for people: a sentence.
    pub warning: &'static str,
    /// Ends a motion, as far as the line can, and forgets the rest of it.
    pub abandon: &'static [u8],
    /// Resets the controller to its state after power-on; the answer does not matter.
    pub reset: &'static [u8],
    /// Lines that restore what the reset leaves as it was.
    pub ready: &'static [&'static str],
    /// If the reset leaves things as they were, above all the counters: how to bring those to 0,
    /// for people.
    pub homing: Option<&'static str>,
    /// How long it may be unresponsive after that.
    pub boot: Duration,
    /// How long a running motion may go on before the reset takes effect.
    pub running: Duration,
    /// Asks where the axes are; it is never refused at rest and changes nothing.
    pub position: &'static str,
    /// A line that changes nothing and that every controller refuses. A controller without
    /// configured axes refuses it in a particular way
    /// ([`Model::has_forgotten`](crate::Model::has_forgotten)), which shows that it was switched on
    /// or reset since axes were configured.
    pub needs_axes: Option<&'static str>,
    /// Lines that ask for its name and version; a model knows one of them, and none changes
    /// anything.
    pub names: &'static [&'static str],
    /// The answer to a command that was carried out, with nothing else in it.
    pub done: &'static [u8],
    /// The speeds that such controllers are set to, baud, the most common first.
    pub speeds: &'static [u32],
    /// Lines that erase the stored program and restore the factory settings. A model answers
    /// [`done`](Handling::done) to those that it has; one that has none erases at its panel only,
    /// or has nothing to erase.
    pub erase: &'static [&'static str],
    /// How the stored program alone is erased.
    pub erasing: Erasing,
    /// Lines, as far as a model has them, that store a program and settings with effects other than
    /// the factory's.
    pub fill: &'static [&'static str],
    /// Lines that start the stored program on models with a command for it.
    pub start: &'static [&'static str],
    /// Whether a file for it is a stream of commands regardless of line ends, rather than a list of
    /// lines.
    pub takes_stream: bool,
    /// Whether it sends things unasked.
    pub volunteers: bool,
}

/// How a motion is stopped so that it can go on, and how it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// Stops what moves along its ramp.
    pub motion: &'static [u8],
    /// Ends a reference run, where `motion` could act in place of the switch.
    pub reference: &'static [u8],
    /// `motion`, for people.
    pub name: &'static str,
    /// This line goes on with it.
    pub resume: &'static str,
    /// What START at the panel does to it.
    pub start: StartButton,
}

/// What START at the panel does to a motion that was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartButton {
    /// The controller goes on with it.
    Resumes,
    /// The controller does nothing, but shows whether it is held.
    IsSeen {
        /// This line asks for a byte.
        question: &'static str,
        /// This bit of it is set while it is held.
        bit: u8,
    },
}

/// How a stored program is erased.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Erasing {
    /// By this line.
    Command(&'static str),
    /// At the panel: how, for people.
    Panel(&'static str),
    /// There is nothing to erase, or nothing that erases it.
    Nothing,
}

/// What sending something may do to the machine, whatever its parameters are, and even if the
/// controller should refuse it: a real one may accept it.
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

/// A piece of a stream of commands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Which bytes of the file, with its end if it has one.
    pub bytes: Range<usize>,
    /// Whether it is a command; otherwise it passes through the controller to what is behind it, or
    /// consists of numbers only.
    pub command: bool,
    /// How many stray numbers it has that belong to no command.
    pub numbers: usize,
    /// Whether it would be a command in capital letters. As it is, the controller ignores it.
    pub lower_case: bool,
}

/// When a command is executed that is sent while others wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// It waits until the one before it is done.
    InOrder,
    /// It overtakes those that wait.
    Overtakes,
    /// The controller does not know it.
    Unknown,
}

/// How far an answer has come, given that every command is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// More is to come, when the command is done.
    Waits,
    /// More is to come at once: if it does not, this is not an answer.
    Part,
    /// This may be all: it is, if nothing follows at once.
    Perhaps,
    /// This is all.
    Whole,
    /// This is not an answer to that command.
    Strange,
}

/// What lasting effect a command has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Travel {
    /// It asks for something and does nothing.
    Question,
    /// No motion: it takes no time.
    None,
    /// A motion whose time follows from the numbers of the command alone.
    Relative,
    /// A motion whose time also depends on where the axes were.
    Absolute,
    /// A reference run of these axes, X in bit 0: it takes as long as the way to their switches.
    Reference(u8),
    /// It may move; how long that takes is not known from it.
    Unknown,
}

/// What a controller says of itself, compared with the expected model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Identity {
    /// It is that model, or has the same commands.
    Same(String),
    /// It names no known model.
    Unknown(String),
    /// It is another.
    Other {
        /// What it is.
        what: String,
        /// Its answer.
        said: String,
    },
    /// It is of another family, and the conversation ended at once.
    Foreign {
        /// What it is.
        what: String,
        /// Its answer.
        said: String,
    },
    /// It says nothing.
    Silent,
}

impl Identity {
    /// Whether it says that it is not a real machine.
    #[must_use]
    pub fn is_virtual(&self) -> bool {
        match self {
            Identity::Same(said)
            | Identity::Unknown(said)
            | Identity::Other { said, .. }
            | Identity::Foreign { said, .. } => said.contains("(virtual)"),
            Identity::Silent => false,
        }
    }
}

/// A question for a controller's name.
#[derive(Clone, Copy, Debug)]
pub struct Question {
    /// What is sent.
    pub send: &'static [u8],
    /// When its answer is over.
    pub until: Until,
}

/// When an answer is over.
#[derive(Clone, Copy, Debug)]
pub enum Until {
    /// When the line falls silent after it.
    Pause,
    /// When this function says so, or nothing comes.
    Whole(fn(&[u8]) -> bool),
    /// No answer is needed; any that comes is ignored.
    Silence,
}
