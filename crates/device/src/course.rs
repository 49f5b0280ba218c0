//! What a command finds and what stops it, for those who count what a host's tests have met.

use std::borrow::Cow;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::Activity;

/// Something in the course of a command that coverage counts. Answers are counted by their own events.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "course", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Course {
    /// A command is taken, or a line of a program is executed, and finds the controller so.
    Finds {
        /// The stable mnemonic, as in [`Event::Command`](crate::Event::Command).
        mnemonic: Cow<'static, str>,
        /// What the controller was doing.
        situation: Situation,
    },
    /// Something strikes a command that is under way, so that it ends before its time.
    Stops {
        /// The mnemonic of the command; that of what begins a program, for a program.
        mnemonic: Cow<'static, str>,
        /// What it is.
        cause: StopCause,
        /// What the command was doing.
        situation: Situation,
    },
}

/// What a controller is doing when a command meets it, or when something stops a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Situation {
    /// This.
    Doing(Activity),
    /// Nothing, and something is left of a motion that was stopped.
    StoppedMotion,
    /// This, in a loop of the stored program that has come round at least once.
    Looping(Activity),
}

/// In a few words, for people: what follows "while".
impl fmt::Display for Situation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Situation::Doing(activity) => activity.fmt(f),
            Situation::StoppedMotion => f.write_str("stopped motion"),
            Situation::Looping(activity) => write!(f, "{activity} in a stored loop"),
        }
    }
}

/// What ends a command before its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum StopCause {
    /// The byte on the line that stops.
    StopByte,
    /// The STOP button or the external stop.
    StopButton,
    /// The byte on the line that breaks off.
    BreakByte,
    /// An input that breaks off a program.
    AbortInput,
    /// The byte on the line that resets.
    ResetByte,
    /// The mains switch.
    PowerLoss,
    /// The emergency stop.
    EmergencyStop,
    /// An input of a program that is as good as the emergency stop.
    EmergencyInput,
    /// The supply of the motors.
    Supply,
    /// The temperature of the power stages.
    Overtemperature,
    /// The power stages, switched off.
    StagesOff,
    /// The cover.
    Cover,
    /// An input of a program that is as good as the cover.
    CoverInput,
    /// A limit switch that a carriage runs onto.
    LimitSwitch,
    /// A limit switch that somebody presses.
    LimitByHand,
    /// In a reference run, the switch at the other end.
    WrongSwitch,
    /// The end of a range, of the window or of a counter.
    Border,
    /// A message interrupt.
    Message,
    /// A failure of the machine.
    Failure,
}

/// In a few words, for people: what follows "stopped by".
impl fmt::Display for StopCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            StopCause::StopByte => "the stop byte",
            StopCause::StopButton => "the stop button",
            StopCause::BreakByte => "the break byte",
            StopCause::AbortInput => "the abort input",
            StopCause::ResetByte => "the reset byte",
            StopCause::PowerLoss => "the loss of power",
            StopCause::EmergencyStop => "the emergency stop",
            StopCause::EmergencyInput => "the emergency input",
            StopCause::Supply => "the motor supply",
            StopCause::Overtemperature => "overtemperature",
            StopCause::StagesOff => "power stages switched off",
            StopCause::Cover => "the cover",
            StopCause::CoverInput => "the cover input",
            StopCause::LimitSwitch => "a limit switch",
            StopCause::LimitByHand => "a limit switch pressed by hand",
            StopCause::WrongSwitch => "the wrong switch",
            StopCause::Border => "the end of a range",
            StopCause::Message => "a message interrupt",
            StopCause::Failure => "a failure of the machine",
        })
    }
}

/// What a controller of a model can do with one form of a command, from the tables of its family: what
/// is not listed cannot happen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ability {
    /// The stable mnemonic, as in [`Event::Command`](crate::Event::Command); empty for what comes
    /// unasked.
    pub mnemonic: &'static str,
    /// What it is, for people, in lower case.
    pub title: &'static str,
    /// Where the manual describes it; empty where no manual does.
    pub section: &'static str,
    /// The kinds of its answers, as [`Model::kind_of`](crate::Model::kind_of) names them, each with what
    /// it means.
    pub answers: Vec<(String, &'static str)>,
    /// What it can find.
    pub finds: Vec<Situation>,
    /// What can stop it, and while it does what.
    pub stops: Vec<(StopCause, Situation)>,
}
