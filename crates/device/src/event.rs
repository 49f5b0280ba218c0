//! What can be watched.

use std::borrow::Cow;
use std::fmt;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_motion::OffCircle;

use crate::{Course, FaultNews, FaultNumber, Grouped, Point, RuleId, RuleNews, Segment, SignalId};

/// Something that happened inside a device. It comes with the model time at which it happened.
///
/// A stable, small word identifies each command and warning; texts for people are made on
/// request by [`Device::explain`](crate::Device::explain).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Event {
    // --- command ---
    /// A command was taken from the line and is being executed.
    Command {
        /// The stable mnemonic, such as `@A` or `0`; `?` for a line that no command matches.
        mnemonic: Cow<'static, str>,
        /// The line as it was received, without its end. A line longer than any command is
        /// shortened to its beginning and three dots.
        bytes: Bytes,
    },
    /// Something came that the device ignores silently.
    Ignored {
        /// What, as it was received, without its end.
        bytes: Bytes,
        /// Why, for people: a lower-case fragment.
        why: Cow<'static, str>,
    },
    /// A line of a stored program is being executed.
    Line {
        /// Its number, from 1.
        line: u32,
        /// The stable mnemonic.
        mnemonic: Cow<'static, str>,
    },
    // --- answer ---
    /// The device answered.
    Answer {
        /// The mnemonic of the command that is answered.
        mnemonic: Cow<'static, str>,
        /// What it answered, whole.
        bytes: Bytes,
        /// Why it is an error, for people: which switch, value or person caused it, and where. A
        /// lower-case fragment.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        why: Option<Box<str>>,
    },
    /// A command or a program was ended early, or a program was stopped, and no error answer says so:
    /// its answer follows, or never comes.
    CutShort {
        /// The mnemonic of the command; that of what begins a program, for a program.
        mnemonic: Cow<'static, str>,
        /// What ended it, and what is lost with it, for people: a lower-case fragment.
        why: Cow<'static, str>,
    },
    // --- segment ---
    /// A motion begins, changes its course or ends.
    Motion(Motion),
    // --- switch ---
    /// A limit or reference switch as the controller sees it changed.
    Switch {
        /// The axis, 0 for X.
        axis: u8,
        /// Whether it is the switch at the positive end.
        positive: bool,
        /// Whether it is now active.
        active: bool,
    },
    // --- signal ---
    /// A signal of the outside world has taken another value; or a signal without a lasting value,
    /// which acts the moment it is set, was set.
    Signal {
        /// The signal, a number of the device that lists it.
        signal: SignalId,
        /// Its value now.
        value: i32,
    },
    // --- port ---
    /// An output port changed.
    Port {
        /// The port.
        port: u16,
        /// Its value now.
        value: u8,
    },
    // --- flash ---
    /// The non-volatile memory changed.
    Flash {
        /// What changed, such as `program line`, `erased`, `defaults`.
        what: Cow<'static, str>,
    },
    // --- line ---
    /// The line's speed changed.
    Baud {
        /// Bits per second.
        baud: u32,
    },
    // --- fault ---
    /// A fault has begun, struck or ended.
    Fault {
        /// Its number.
        number: FaultNumber,
        /// What happened to it.
        news: FaultNews,
    },
    /// A rule of a scenario has begun, acted or ended.
    Rule {
        /// Which.
        rule: RuleId,
        /// What there is to tell of it.
        news: RuleNews,
    },
    // --- warning ---
    /// Something was lost or assumed.
    Warning(Warning),
    // --- course ---
    /// What a command finds, or what stops it.
    Course(Course),
}

impl Event {
    /// The kind under which it must be watched.
    #[must_use]
    pub fn kind(&self) -> Kinds {
        match self {
            Event::Command { .. } | Event::Ignored { .. } | Event::Line { .. } => Kinds::COMMAND,
            Event::Answer { .. } | Event::CutShort { .. } => Kinds::ANSWER,
            Event::Motion(_) => Kinds::MOTION,
            Event::Switch { .. } => Kinds::SWITCH,
            Event::Signal { .. } => Kinds::SIGNAL,
            Event::Port { .. } => Kinds::PORT,
            Event::Flash { .. } => Kinds::FLASH,
            Event::Baud { .. } => Kinds::LINE,
            Event::Fault { .. } | Event::Rule { .. } => Kinds::FAULT,
            Event::Warning(_) => Kinds::WARNING,
            Event::Course(_) => Kinds::COURSE,
        }
    }
}

/// The course of one motion. A watcher that wants every step keeps the segment, enumerates it,
/// and replaces or cuts it when told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "motion", rename_all = "kebab-case")]
pub enum Motion {
    /// A segment begins at the time of the event.
    Begins {
        /// Where the counters are at its start.
        origin: Point,
        /// Path and times.
        segment: Box<Segment>,
    },
    /// The running segment, which keeps its start, goes on with other times (it brakes).
    Changes {
        /// The segment as it will now run. Steps already made keep their times.
        segment: Box<Segment>,
    },
    /// The running segment ends after this many steps.
    Ends {
        /// Clock steps made.
        steps: u64,
    },
}

/// Something worth knowing although nothing is wrong with the device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "warning", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Warning {
    /// The receive buffer was full: bytes from the line were lost.
    ReceiveOverflow {
        /// How many bytes.
        lost: u64,
    },
    /// Bytes left the device while no client was on the line.
    NobodyListens {
        /// How many bytes.
        lost: u64,
    },
    /// A command was accepted that has no effect here.
    NoEffect {
        /// Which, and why, in a few words.
        what: Cow<'static, str>,
    },
    /// The carriage and the step counter no longer agree.
    StepsLost {
        /// The axis, 0 for X.
        axis: u8,
        /// What the controller calls the axis.
        name: Cow<'static, str>,
        /// Carriage minus counter has changed by this many steps.
        steps: i64,
        /// How far that is in µm, without a sign, on an axis that has a length.
        um: Option<u64>,
        /// How that came.
        how: Loss,
    },
    /// STOP ended a reference run although the axis has a reference switch: the place where the
    /// axis was stopped counts as its reference point, but is not.
    FalseReference {
        /// The axis, 0 for X.
        axis: u8,
        /// What the controller calls the axis.
        name: Cow<'static, str>,
    },
    /// Nothing on the way ahead will end the reference run of an axis.
    EndlessReference {
        /// The axis, 0 for X.
        axis: u8,
        /// What the controller calls the axis.
        name: Cow<'static, str>,
    },
    /// A step counter has overflowed and wrapped around.
    CounterWrapped {
        /// The axis, 0 for X.
        axis: u8,
        /// What the controller calls the axis.
        name: Cow<'static, str>,
        /// What it reads now, in steps.
        reads: i64,
    },
    /// An arc ends beside its circle, or after whole turns beside its start: its parameters are not
    /// those of the circle.
    OffCircle {
        /// From its end to the circle, or to its start, in steps.
        steps: u64,
        /// How many whole turns long it is, if it should end at its start.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        turns: Option<u64>,
        /// Which parameters would end there, for people: a fragment.
        remedy: Cow<'static, str>,
    },
    /// STOP at the panel has switched the spindle off.
    SpindleOff,
    /// A program ended with an error.
    ProgramError {
        /// The reply code that names the error.
        code: char,
        /// The number of its line, from 1.
        line: u32,
        /// Why, for people: a lower-case fragment.
        why: Box<str>,
    },
}

/// How a carriage and its counter come to disagree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Loss {
    /// The carriage was blocked at the end of the mechanics while the counter went on.
    AtEnd,
    /// It overshot when its motor was halted without a ramp.
    Overran,
    /// Its motor was overloaded and stalled until the motion was over.
    Stalled,
    /// Something other than its motor moved it.
    Pushed,
}

/// In a few words, for people: what follows "the carriage".
impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Loss::AtEnd => "stood at its end while the counter went on",
            Loss::Overran => "ran on when its motor was halted without a ramp",
            Loss::Stalled => "stood still, because its motor could not follow",
            Loss::Pushed => "was moved, and not by its motor",
        })
    }
}

impl From<OffCircle> for Warning {
    fn from(off: OffCircle) -> Warning {
        let OffCircle { steps, turns, .. } = off;
        Warning::OffCircle { steps, turns, remedy: off.remedy_in_words().into() }
    }
}

/// In words, for people.
impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes = |count: u64| match count {
            1 => "1 byte was".to_owned(),
            _ => format!("{count} bytes were"),
        };
        match self {
            Warning::ReceiveOverflow { lost } => {
                write!(f, "the receive buffer was full, {} lost", bytes(*lost))
            }
            Warning::NobodyListens { lost } => {
                write!(f, "nobody has the line open, {} lost", bytes(*lost))
            }
            Warning::NoEffect { what } => write!(f, "no effect: {what}"),
            Warning::StepsLost { name, steps, um, how, .. } => {
                let count = Grouped(steps.saturating_abs());
                let steps = if count == Grouped(1) { "step" } else { "steps" };
                write!(f, "the {name} carriage {how}: {count} {steps}")?;
                if let Some(um) = um {
                    let mm = format!("{}.{:03}", Grouped((um / 1_000) as i64), um % 1_000);
                    write!(f, " ({} mm)", mm.trim_end_matches('0').trim_end_matches('.'))?;
                }
                f.write_str(" lost; a reference run makes the two agree again")
            }
            Warning::FalseReference { name, .. } => write!(
                f,
                "the reference of {name} is false: STOP ended its reference run in place of the \
                 switch, and where it stopped counts as 0; a complete reference run corrects it"
            ),
            Warning::EndlessReference { name, .. } => write!(
                f,
                "no switch is ahead of {name}: its reference run goes on until STOP or 253 \
                 ends it"
            ),
            Warning::CounterWrapped { name, reads, .. } => write!(
                f,
                "the {name} counter came to its end and went on from the other one: it reads {}",
                Grouped(*reads)
            ),
            Warning::OffCircle { steps, turns, remedy } => {
                let steps = Grouped(*steps as i64);
                match turns {
                    None => write!(f, "ends {steps} steps off the circle; {remedy}"),
                    Some(turns) => {
                        let s = if *turns == 1 { "" } else { "s" };
                        let turns = Grouped(*turns as i64);
                        write!(
                            f,
                            "the arc is {turns} turn{s} long and ends {steps} steps from its start; {remedy}"
                        )
                    }
                }
            }
            Warning::SpindleOff => f.write_str(
                "STOP at the panel has switched the spindle off; going on does not switch it on",
            ),
            Warning::ProgramError { code, line, why } => {
                write!(f, "the program ended in line {line} with error {code}: {why}")
            }
        }
    }
}

/// A set of kinds of events. Events of other kinds are not produced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kinds(u16);

impl Kinds {
    /// Nothing.
    pub const NONE: Kinds = Kinds(0);
    /// Commands, and the lines of a running program.
    pub const COMMAND: Kinds = Kinds(1);
    /// Answers, why they are errors, and what ended without an answer.
    pub const ANSWER: Kinds = Kinds(1 << 1);
    /// Motions.
    pub const MOTION: Kinds = Kinds(1 << 2);
    /// Switches.
    pub const SWITCH: Kinds = Kinds(1 << 3);
    /// Ports.
    pub const PORT: Kinds = Kinds(1 << 4);
    /// Flash memory.
    pub const FLASH: Kinds = Kinds(1 << 5);
    /// The line.
    pub const LINE: Kinds = Kinds(1 << 6);
    /// Warnings.
    pub const WARNING: Kinds = Kinds(1 << 7);
    /// Signals of the outside world.
    pub const SIGNAL: Kinds = Kinds(1 << 8);
    /// Faults, and the rules of scenarios.
    pub const FAULT: Kinds = Kinds(1 << 9);
    /// What commands find and what stops them, for coverage. It adds nothing to what the other events
    /// tell people, so it is not in [`ALL`](Kinds::ALL).
    pub const COURSE: Kinds = Kinds(1 << 10);
    /// Everything that people are told.
    pub const ALL: Kinds = Kinds(0x3FF);

    /// Whether all of `kinds` are in this set.
    #[must_use]
    pub const fn contain(self, kinds: Kinds) -> bool {
        self.0 & kinds.0 == kinds.0
    }

    /// What is in this set and in `kinds`.
    #[must_use]
    pub const fn also_in(self, kinds: Kinds) -> Kinds {
        Kinds(self.0 & kinds.0)
    }

    /// This set and `kinds`.
    #[must_use]
    pub const fn and(self, kinds: Kinds) -> Kinds {
        Kinds(self.0 | kinds.0)
    }
}

#[cfg(test)]
mod tests;
