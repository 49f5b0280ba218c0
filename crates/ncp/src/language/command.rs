//! The contents of lines of a job file: commands and their words, with their places.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use vimc4_isel_wire::Plane;
use vimc4_motion::Turn;
pub use vimc4_plant::Accessory;

use super::value::Value;

/// The letters of the axes there can be, by index.
pub const LETTERS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];

/// A part of a line, in bytes from its beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Span {
    /// Where it begins.
    pub start: u32,
    /// Behind its last byte.
    pub end: u32,
}

impl Span {
    /// Where it is in its line.
    #[must_use]
    pub fn range(self) -> Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// A value, and its place in the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Placed<T> {
    /// What it is.
    pub value: T,
    /// Where it stands.
    pub span: Span,
}

/// A number and its place, including the letter before it.
pub type Word = Placed<Value>;

/// A word for each axis that has one: X, Y, Z, A, B, C.
pub type Words = [Option<Word>; 6];

/// A line of a job file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JobLine<'t> {
    /// The number that it is given by `N`, if any.
    pub number: Option<u64>,
    /// Its instruction; `None` if there is only a comment, or if it cannot be read.
    pub command: Option<Placed<Instruction>>,
    /// The text after the semicolon, without blanks around it.
    pub comment: Option<&'t str>,
    /// Whether nothing that the tool does depends on the unreadable part of it.
    pub harmless: bool,
}

/// Whether coordinates count from the work-piece zero or from where the tool is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Frame {
    /// From the work-piece zero.
    Absolute,
    /// From where the tool is.
    Relative,
}

/// At which speed an axis moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rate {
    /// That of VEL.
    Normal,
    /// That of FASTVEL.
    Rapid,
}

/// The groups of axes of a reference run, each a set of bits, X the lowest; unused ones are 0.
pub type Groups = [u8; 6];

/// A bit of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct PortBit {
    /// The number of the port, 1 to 4.
    pub port: u8,
    /// The number of the bit, 1 to 8.
    pub bit: u8,
}

/// What DRILLDEF sets. Each value stays as it was if it is not given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DrillWords {
    /// C: 1 drills, 2 drills and clears the chips, 3 drills and breaks them.
    pub cycle: Option<Word>,
    /// P: the height of the reference plane above the work-piece zero.
    pub plane: Option<Word>,
    /// D: the depth below the reference plane.
    pub depth: Option<Word>,
    /// T: how long the drill stays at the bottom, in ms.
    pub dwell: Option<Word>,
    /// V: the speed of drilling.
    pub speed: Option<Word>,
    /// F: how deep the first step is.
    pub first: Option<Word>,
    /// O: how deep the second is.
    pub other: Option<Word>,
    /// I: how much shallower each following one is than the one before.
    pub decrease: Option<Word>,
    /// R: how far the drill is lifted, or how far above the last depth it slows down.
    pub retreat: Option<Word>,
    /// L: the height it is lifted to between steps, above the reference plane.
    pub lift: Option<Word>,
    /// S: the height it goes to before and after, above the reference plane.
    pub safety: Option<Word>,
}

/// What SPINDLE sets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SpindleWords {
    /// Whether OFF is given; everything else means on.
    pub off: bool,
    /// CW or CCW.
    pub turn: Option<Placed<Turn>>,
    /// RPM: turns a minute.
    pub rpm: Option<Word>,
    /// TIME: how long to wait until it turns, in ms.
    pub time: Option<Word>,
}

/// The unit of lengths and speeds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Units {
    /// µm.
    #[default]
    Metric,
    /// Thousandths of an inch, 25.4 µm.
    Inch,
}

impl Units {
    /// A length or a speed of the file in µm or µm/s.
    #[must_use]
    pub(crate) fn in_um(self, value: Value) -> Value {
        match self {
            Units::Metric => value,
            Units::Inch => {
                let tenths = value.in_thousandths().saturating_mul(254);
                Value::thousandths((tenths + 5 * tenths.signum()) / 10)
            }
        }
    }
}

impl Instruction {
    /// Whether it only switches something besides the tool, or does nothing: the tool does the same
    /// without it.
    #[must_use]
    pub(crate) fn is_accessory(&self) -> bool {
        use Instruction::{Path, PathEnd, SetBit, SetPort, Switch, ToolDefinition, ToolInit, Type};
        matches!(
            self,
            Switch(..)
                | SetPort(..)
                | SetBit(..)
                | ToolDefinition
                | ToolInit
                | Type
                | Path
                | PathEnd
        )
    }
}

/// An instruction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Instruction {
    /// `IMF_PBL…`: this is a job file.
    Mark,
    /// `REF`: reference runs.
    Reference(Groups),
    /// `LIMIT`: the lowest and the highest place of axes.
    Limit([Option<(Word, Word)>; 6]),
    /// `VEL`.
    Velocity(Word),
    /// `FASTVEL`.
    RapidVelocity(Word),
    /// `MOVEABS`, `MOVEREL`, `FASTABS`, `FASTREL`.
    Move(Frame, Rate, Words),
    /// `PLANE`.
    Plane(Plane),
    /// `CWABS`, `CCWABS`, `CWREL`, `CCWREL`, and with `HLX` before the frame a helix.
    Arc {
        /// What the words count from.
        frame: Frame,
        /// Which way round.
        turn: Turn,
        /// Whether the third axis moves too.
        helix: bool,
        /// I, J and K.
        centre: [Option<Word>; 3],
        /// W of a helix: how far it goes round, in degrees.
        sweep: Option<Word>,
        /// Where it ends.
        to: Words,
    },
    /// `WAIT`, in ms.
    Wait(Word),
    /// `WPZERO`: the work-piece zero is here.
    ZeroHere,
    /// `WPZERO STANDARD`: the work-piece zero is where it was before the job.
    ZeroStandard,
    /// `WPZEROABS`: the work-piece zero is there.
    ZeroAt(Words),
    /// `WPCLEAR`: the work-piece zero is the machine's.
    ZeroClear,
    /// `WPREGn`: keeps a work-piece zero, 1 to 8.
    Store(u8, Words),
    /// `WPREGnACT`: takes a kept one.
    Recall(u8),
    /// `WPTEACH`: the operator finds it.
    Teach,
    /// `SETPORT`: the port, 1 to 4, and its value.
    SetPort(u8, u8),
    /// `SETBIT`, and with `false` `RESBIT`.
    SetBit(PortBit, bool),
    /// `WAITBIT`: until the bit is so.
    WaitBit(PortBit, bool),
    /// `WAITPORT`: until the port, 1 to 4, has the value.
    WaitPort(u8, u8),
    /// `PATH`.
    Path,
    /// `PATHEND`.
    PathEnd,
    /// `GETTOOL`: the number of the tool.
    Tool(u32),
    /// `DRILLDEF`.
    DrillDefinition(DrillWords),
    /// `DRILL`.
    Drill(Words),
    /// `CYL`: the turning axis by index, the radius, and the linear axis that it replaces.
    Cylinder(Placed<usize>, Word, Option<Placed<usize>>),
    /// `HALT`: until the operator goes on.
    Halt,
    /// `ACCEL`: percent of the acceleration of each axis.
    Acceleration(Words),
    /// `SPINDLE`.
    Spindle(SpindleWords),
    /// `COOLANT`, `WPCLAMP`, `PUMP`, `LAMP`, `POPTIONn`: what is switched on or off.
    Switch(Accessory, bool),
    /// `METRIC`, `INCH`.
    Units(Units),
    /// `TOOLDEF`.
    ToolDefinition,
    /// `INITTOOL`.
    ToolInit,
    /// `TYPE …`, which means nothing here.
    Type,
    /// `PROGEND`: nothing after it counts.
    End,
}
