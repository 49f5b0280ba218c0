//! How a client handles a controller besides sending it commands.

use std::ops::Range;
use std::time::Duration;

/// What a client of a controller knows to send when it must stop, reset, erase or find one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Handling {
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
    /// What stops a motion and goes on with it, where the line can do that.
    pub stop: Option<Stop>,
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
    /// A controller that knows of no axes refuses this line as such
    /// ([`Model::has_forgotten`](crate::Model::has_forgotten)), and so tells whether it was switched
    /// on or reset since it was told of them; any other refuses it otherwise. It changes nothing.
    pub needs_axes: Option<&'static str>,
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
    /// How the stored program alone is erased.
    pub erasing: Erasing,
    /// These lines, as far as a model has them, leave a program and saved settings that differ
    /// from the factory's in what they do.
    pub fill: &'static [&'static str],
    /// These lines start the stored program on models that can do so by a command.
    pub start: &'static [&'static str],
    /// Whether a file for it is a stream of commands, wherever its lines end, and not a list of
    /// lines.
    pub takes_stream: bool,
    /// Whether it says things that nobody has asked for.
    pub volunteers: bool,
}

/// How a motion is stopped so that it can go on, and how it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// Stops what moves along its ramp.
    pub motion: &'static [u8],
    /// Ends a reference run, for which `motion` could stand in for the switch.
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

/// What a command does that lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Travel {
    /// It asks for something and does nothing.
    Question,
    /// No motion: it is over at once.
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

/// What a controller says of itself, held against the model that something is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Identity {
    /// It is that model, or at least has its commands.
    Same(String),
    /// What it says names no model that is known.
    Unknown(String),
    /// It is another.
    Other {
        /// What it is.
        what: String,
        /// How it has said so.
        said: String,
    },
    /// It is of another family, with which the conversation has ended at once.
    Foreign {
        /// What it is.
        what: String,
        /// How it has said so.
        said: String,
    },
    /// It says nothing.
    Silent,
}

impl Identity {
    /// Whether it says of itself that it is not a machine.
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

/// Something to ask a controller for its name.
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
    /// When this says so, or nothing comes.
    Whole(fn(&[u8]) -> bool),
    /// It need not come: whatever does is let pass.
    Silence,
}
