//! A picture of a device: what it is doing, and every value that can be seen of it.
//!
//! People and programs see the same values: an enum has a stable name in kebab-case for programs
//! (serde) and a few words for people (`Display`). No program has to parse a text.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{SignalId, Time};

/// What can be asked of any device without knowing the model, and the `details` that only its
/// family has. It is made on request; nothing of it is kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View<D> {
    /// The time of the picture.
    pub at: Time,
    /// The model's name.
    pub model: String,
    /// The machine's name.
    pub machine: String,
    /// Whether it has power.
    pub powered: bool,
    /// What it is doing.
    pub activity: Activity,
    /// What it waits for, if it does nothing more by itself.
    pub waits_for: Option<WaitsFor>,
    /// Bits per second of its serial line.
    pub baud: u32,
    /// How full the buffer is in which received bytes wait while something else is done: isel's
    /// receive buffer, with the bytes as they came, and LPKF's command buffer, which holds commands
    /// without the `;` or CR that ends them. A line or command that is only begun is not in it, but
    /// [`Device::room`](crate::Device::room), and with it CTS, allows for one.
    pub received: Fill,
    /// The axes, configured or not.
    pub axes: Vec<AxisView>,
    /// The things of the outside world with their present values, in the order of
    /// [`Device::signals`](crate::Device::signals).
    pub signals: Vec<SignalView>,
    /// The ports.
    pub ports: Vec<PortView>,
    /// What it will do by itself and when, soonest first.
    pub timers: Vec<TimerView>,
    /// What only devices of its family show.
    pub details: D,
}

impl<D> View<D> {
    /// The same picture with other details: those of a family among those of all.
    pub fn with<T>(self, details: impl FnOnce(D) -> T) -> View<T> {
        let View { at, model, machine, powered, activity, waits_for, baud, received, .. } = self;
        let View { axes, signals, ports, timers, .. } = self;
        let details = details(self.details);
        View {
            at,
            model,
            machine,
            powered,
            activity,
            waits_for,
            baud,
            received,
            axes,
            signals,
            ports,
            timers,
            details,
        }
    }

    /// The present value of a signal, by its name; `None` for one that is not there and for one
    /// that has no lasting value.
    #[must_use]
    pub fn signal(&self, name: &str) -> Option<i32> {
        self.signals.iter().find(|signal| signal.name == name)?.value
    }
}

/// What a device is doing, in the words of all families.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Activity {
    /// It has no power.
    Off,
    /// Nothing: it takes the next command.
    Idle,
    /// Nothing, and it refuses moves: an axis has run onto a limit switch, and that error still holds.
    LimitError,
    /// Nothing, and it refuses moves until the axes that have left their limit switches have made a
    /// reference run.
    NeedsReference,
    /// Nothing, and it refuses moves: the power stages are off, the cover is open, or something has
    /// failed.
    CannotMove,
    /// It starts up after a reset or after it was switched on.
    StartingUp,

    /// A straight or circular move, or several in one command.
    Move,
    /// An arc.
    Arc,
    /// Vectors, one after the other without a halt.
    FollowingVectors,
    /// A move of the stored program.
    ProgramMove,
    /// An axis follows the trackball.
    FollowingTrackball,
    /// The moves of the self-test.
    SelfTest,

    /// A reference run: towards the switch.
    ReferenceTowardsSwitch,
    /// A reference run: out of the switch.
    ReferenceOutOfSwitch,
    /// A reference run: by a few more steps.
    ReferenceFreeSteps,
    /// An axis leaves the limit switch it is on, by command.
    LeavingLimitSwitch,

    /// The head goes down or up.
    WaitingForHead,
    /// Everything comes to rest after a move.
    Settling,
    /// A command waits for a time.
    Waiting,
    /// A line of the stored program waits for a time.
    ProgramDelay,
    /// A line of the stored program takes its time.
    ProgramLine,
    /// A line of the stored program waits for a port.
    ProgramWaitsForPort,
    /// A line of the stored program waits for a character.
    ProgramWaitsForCharacter,
    /// A line of the stored program branches to itself and always will.
    ProgramHaltedOnItself,
    /// The stored program was stopped and can go on.
    ProgramStopped,
    /// The memory of the stored program is erased.
    Erasing,
    /// It takes the lines of a program to be stored.
    Storing,
    /// It sends back what it receives, as it does at the end of the self-test.
    Echo,

    /// It was stopped: no command is executed until one resumes execution.
    Stopped,
    /// The trackball is open.
    Trackball,
}

impl Activity {
    /// Whether it rests for a reason that a command or a person must remove first.
    #[must_use]
    pub fn is_held_up(self) -> bool {
        use Activity::{CannotMove, LimitError, NeedsReference, Off, ProgramStopped, Stopped};
        matches!(self, Off | LimitError | NeedsReference | CannotMove | ProgramStopped | Stopped)
    }
}

/// In a few words, for people.
impl fmt::Display for Activity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Activity::Off => "off",
            Activity::Idle => "idle",
            Activity::LimitError => "limit error",
            Activity::NeedsReference => "needs a reference run",
            Activity::CannotMove => "cannot move",
            Activity::StartingUp => "starting up",
            Activity::Move => "move",
            Activity::Arc => "arc",
            Activity::FollowingVectors => "following vectors",
            Activity::ProgramMove => "program move",
            Activity::FollowingTrackball => "following the trackball",
            Activity::SelfTest => "self-test",
            Activity::ReferenceTowardsSwitch => "reference run, towards the switch",
            Activity::ReferenceOutOfSwitch => "reference run, out of the switch",
            Activity::ReferenceFreeSteps => "reference run, free steps",
            Activity::LeavingLimitSwitch => "leaving a limit switch",
            Activity::WaitingForHead => "waiting for the head",
            Activity::Settling => "settling",
            Activity::Waiting => "waiting",
            Activity::ProgramDelay => "program delay",
            Activity::ProgramLine => "program line",
            Activity::ProgramWaitsForPort => "program waits for a port",
            Activity::ProgramWaitsForCharacter => "program waits for a character",
            Activity::ProgramHaltedOnItself => "program halted on itself",
            Activity::ProgramStopped => "program stopped",
            Activity::Erasing => "erasing the program",
            Activity::Storing => "storing a program",
            Activity::Echo => "self-test echo",
            Activity::Stopped => "stopped",
            Activity::Trackball => "trackball",
        })
    }
}

/// What a device at rest waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum WaitsFor {
    /// Power.
    Power,
    /// A command.
    Command,
    /// A command that goes on with the motion that was stopped, or any other, which gives it up.
    StoppedMotion,
    /// The command that clears a limit error.
    LimitErrorCleared,
    /// A reference run.
    Reference,
    /// The cause that prevents motion to be removed.
    MotionAllowed,
    /// START, or the command that is as good.
    Start,
    /// The command that lets commands be executed again after a stop.
    GoOn,
    /// The command that closes the trackball.
    TrackballClosed,
    /// A port whose value must change, or a bit of it.
    Port {
        /// The port.
        port: u16,
        /// The bit; `None` for the whole value.
        bit: Option<u8>,
        /// What it must no longer be.
        from: u8,
    },
    /// A character on the line.
    Character {
        /// The character that the program branches on.
        code: u8,
    },
    /// The next line of the program that is being stored, or its end.
    ProgramLine,
    /// To be ended from outside: nothing else will end it.
    Ending,
}

/// In a few words, for people: what comes after "waits for".
impl fmt::Display for WaitsFor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WaitsFor::Power => f.write_str("power"),
            WaitsFor::Command => f.write_str("a command"),
            WaitsFor::StoppedMotion => {
                f.write_str("a command, such as the one that goes on with the stopped motion")
            }
            WaitsFor::LimitErrorCleared => {
                f.write_str("the limit error to be cleared, such as by a reference run")
            }
            WaitsFor::Reference => f.write_str("a reference run"),
            WaitsFor::MotionAllowed => f.write_str("motion to be possible again"),
            WaitsFor::Start => f.write_str("START or the start command"),
            WaitsFor::GoOn => f.write_str("the command that goes on after a stop"),
            WaitsFor::TrackballClosed => f.write_str("the trackball to be closed"),
            WaitsFor::Port { port, bit: Some(bit), from } => {
                write!(f, "bit {bit} of port {port} to be {}", u8::from(*from == 0))
            }
            WaitsFor::Port { port, bit: None, from } => {
                write!(f, "port {port} to be something else than {from}")
            }
            WaitsFor::Character { code } => {
                write!(f, "the character `{}`", char::from(*code).escape_default())
            }
            WaitsFor::ProgramLine => f.write_str("the next line of the program to be stored"),
            WaitsFor::Ending => f.write_str("nothing, until it is ended from outside"),
        }
    }
}

/// How full something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fill {
    /// The bytes that are in it.
    pub used: usize,
    /// The bytes that it takes.
    pub size: usize,
}

/// One axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisView {
    /// Its place in every [`Point`](crate::Point), 0 for X.
    pub index: u8,
    /// What the controller calls it, such as `X`.
    pub name: String,
    /// Whether the host has configured it.
    pub configured: bool,
    /// The step counter.
    pub position: i64,
    /// Where the carriage really is, steps of the machine.
    pub carriage: i64,
    /// Whether its reference point is known.
    pub referenced: bool,
    /// Its virtual zero, steps.
    pub zero: i64,
    /// Its share of the present step frequency, µHz, with the sign of its direction.
    pub speed: i64,
    /// Whether its negative and its positive limit switch are active, as the controller sees them.
    #[serde(default)]
    pub limits: [bool; 2],
}

impl AxisView {
    /// Whether its counter does not tell where its carriage is, and a reference run would.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        !self.referenced && self.carriage != self.position
    }

    /// What its counter lacks, for people: what follows the place it shows.
    #[must_use]
    pub fn reference_in_words(&self) -> &'static str {
        match (self.referenced, self.is_lost()) {
            (true, _) => "",
            (false, false) => ", not referenced",
            (false, true) => ", not referenced: a reference run finds where it is",
        }
    }
}

/// A signal and what it is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SignalView {
    /// Its number.
    pub id: SignalId,
    /// Its name, as in [`Signal`](crate::Signal).
    pub name: String,
    /// Its present value: what it was set to last. `None` for what has no lasting value because it
    /// acts in the moment it is set.
    pub value: Option<i32>,
}

/// One thing that will happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimerView {
    /// What.
    pub cause: Cause,
    /// When.
    pub due: Time,
}

/// What can happen by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Cause {
    /// The present activity ends or reaches its next part.
    Activity,
    /// The spindle reaches its speed, or has failed to.
    SpindleSpeed,
    /// The position of the trackball's axis is sent.
    TrackballReport,
    /// A contact bounces, or is pressed and begins to bounce.
    Contact,
    /// A carriage presses a limit switch or releases it.
    LimitSwitch,
}

/// In a few words, for people.
impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Cause::Activity => "what it is doing ends or goes on",
            Cause::SpindleSpeed => "spindle reaches its speed",
            Cause::Contact => "a contact that bounces changes",
            Cause::LimitSwitch => "a limit switch changes",
            Cause::TrackballReport => "position of the trackball's axis",
        })
    }
}

/// One port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PortView {
    /// Its number.
    pub port: u16,
    /// Whether the host reads it (otherwise it writes it).
    pub input: bool,
    /// Its value.
    pub value: u8,
}
