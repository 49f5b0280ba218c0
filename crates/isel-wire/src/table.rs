//! Which commands there are: one list of them all, and the six tables that follow from it.
//!
//! The manuals describe three dialects of one language. The list below has a row for every
//! operation, with a column for each dialect in the shape of the section that describes it;
//! an empty section means that the dialect lacks the command. Tables and letters are picked
//! from it when the crate is compiled, so that a command cannot be known to one and unknown to
//! the other.

use serde::{Deserialize, Serialize};

use crate::axes::AxisSet;
use crate::dialect::{Dialect, Mode};
use crate::reply::Reply;

// The list below is a table, and reads like one without these prefixes.
use Class::{Motion, Output, Program, Query, Setting};
use Fields::{Just, Pairs, Speeds, TestAndSteps};
use Reply::{
    Axis, Count, Cover, DataField, Done, LimitSwitch, MemoryFull, NoAxes, Number, Plant, Reference,
    Speed, Stopped, Syntax,
};

/// An operation of a controller, independent of its letter and mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Op {
    /// `@axes`: configure axes.
    SetAxes,
    /// `@A`, `0`: relative move.
    RelativeMove,
    /// `@M`, `m`: absolute move.
    AbsoluteMove,
    /// `@b`: read a port.
    ReadPort,
    /// `@B`: write a port.
    WritePort,
    /// `@d`, `d`: reference speeds.
    ReferenceSpeeds,
    /// `@D`: diagnosis.
    Diagnosis,
    /// `@e`, `e`: plane of circles.
    Plane,
    /// `@f`, `f`: direction of circles.
    Direction,
    /// `@F`: leave a limit switch.
    Free,
    /// `@g`, `g`: brake.
    Brake,
    /// `@G`: device number.
    DeviceNumber,
    /// `@h`: show the limit switches.
    LimitStatus,
    /// `@H`: show the state.
    Status,
    /// `@i`: store a data field.
    Store,
    /// `@ID`: inverted directions.
    InitDirections,
    /// `@IR`: inverted reference directions.
    InitReferences,
    /// `@IS`: internal hardware status byte.
    InitHardwareStatus,
    /// `@IL` of the imc4-m: rotary axes.
    InitRotaryL,
    /// `@Id`: default reference speeds.
    InitDefaultSpeeds,
    /// `@IF`: steps away from the reference switches.
    InitFreeSteps,
    /// `@IJ`: default acceleration.
    InitDefaultAcceleration,
    /// `@Ij`: default start-stop frequency.
    InitDefaultStartStop,
    /// `@IO`: ports only.
    InitIoOnly,
    /// `@IE`: limit switches and their levels.
    InitLimits,
    /// `@Ie`: swapped limit switches.
    InitSwapLimits,
    /// `@IT`: axis types.
    InitAxisTypes,
    /// `@IA`: abort input.
    InitAbort,
    /// `@Ia`: error output.
    InitErrorSignal,
    /// `@IH`: cover input.
    InitCover,
    /// `@IN`: emergency stop input.
    InitEmergency,
    /// `@IC`: 9600 baud.
    InitBaud9600,
    /// `@IU`: the user's text.
    InitUserInfo,
    /// `@IL` of the iMC-xx: load from the flash.
    InitLoad,
    /// `@IW`: write to the flash.
    InitWrite,
    /// `@IX`: factory values.
    InitFactory,
    /// `@j`, `j`: start-stop frequency.
    StartStop,
    /// `@J`, `J`: acceleration.
    Acceleration,
    /// `@k`: erase the stored program.
    Erase,
    /// `@n`, `n`: set the zero.
    Zero,
    /// `@N`, `N`: simulate a reference run.
    SimulateReference,
    /// `@P`: position.
    Position,
    /// `@R`, `7`: reference run.
    Reference,
    /// `@S`: go on, or start the stored program.
    Start,
    /// `@T`, `T`: test mode.
    TestMode,
    /// `@U`: show the user's text.
    UserInfo,
    /// `@V`, on the iMC-xx also `@?`: version.
    Version,
    /// `@?` of the imc4 and the imc4-m: self-test.
    SelfTest,
    /// `@w`, `w`: helix.
    Helix,
    /// `@y`, `y`: circle.
    Circle,
    /// `@z`, `z`: 3D interpolation.
    Interpolation3d,
    /// `@Z`: move until a port has a value.
    MoveUntil,
    /// `1`: send a character.
    SendSync,
    /// `2`: wait for a character.
    AwaitSync,
    /// `3`: loop, or branch.
    Loop,
    /// `5`: delay.
    Delay,
    /// `6`: condition for the next move.
    Until,
    /// `p`: set a port.
    SetPort,
    /// `o`: branch on a port.
    BranchIf,
    /// `9`: end of the data field.
    End,
}

/// What a command does to the machine, as far as the order of errors needs to know.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// Reports something and changes nothing.
    Query,
    /// Changes a setting; nothing moves.
    Setting,
    /// Steps the motors: refused with `9` or `H` when the plant is not ready. `@S` counts as
    /// one, whether or not there is anything to go on with. A stored line that moves belongs
    /// here too, but storing it moves nothing.
    Motion,
    /// Writes an output. Whether that switches the spindle or the power stages on, which the plant
    /// can refuse like a motion, only the ports tell.
    Output,
    /// Begins, ends, erases or directs the stored program.
    Program,
}

/// How many fields a command has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fields {
    /// This many. The code of a diagnosis and the text of `IU` do not count.
    Just(u8),
    /// A way and a speed for each axis, and for Z of X, Y and Z a second time, so that one line
    /// moves, plunges and lifts (99 §2.2.4).
    Pairs,
    /// A speed for each axis, or four.
    Speeds,
    /// Port, mask, value and speed, and a way for each axis.
    TestAndSteps,
}

impl Fields {
    /// The two numbers of fields that are right while these axes are configured, which are mostly
    /// the same; `None` where they depend on axes and there are none.
    pub(crate) fn counts(self, axes: AxisSet) -> Option<(usize, usize)> {
        let count = Some(axes.count()).filter(|count| *count > 0);
        let right = match self {
            Just(count) => usize::from(count),
            Pairs if axes.bits() == 0b0111 => 8,
            Pairs => 2 * count?,
            Speeds => return Some((count?, 4)),
            TestAndSteps => 4 + count?,
        };
        Some((right, right))
    }
}

/// What there is to know about one command of one dialect in one mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommandSpec {
    /// The operation.
    pub op: Op,
    /// A short name that never changes: `@A`, `@axes`, `@ID`, stored `0`, `7`.
    pub mnemonic: &'static str,
    /// Its name for people, in lower case.
    pub title: &'static str,
    /// What it does to the machine.
    pub class: Class,
    /// How many fields it has.
    pub fields: Fields,
    /// Whether it is refused with `4` until axes are configured.
    pub needs_axes: bool,
    /// Where this dialect's manual describes it.
    pub sections: &'static str,
    /// Every reply it can be answered with in this mode, in the order of [`Reply::ALL`].
    pub replies: &'static [Reply],
}

/// The commands of a dialect in a mode, in a fixed order.
#[must_use]
pub fn table(dialect: Dialect, mode: Mode) -> &'static [CommandSpec] {
    vocabulary(dialect, mode).specs
}

/// The row of an operation in the table of a dialect and a mode, if it has one.
#[must_use]
pub fn spec(dialect: Dialect, mode: Mode, op: Op) -> Option<&'static CommandSpec> {
    table(dialect, mode).iter().find(|spec| spec.op == op)
}

/// Whether a dialect knows a diagnosis code (99 §2.2.19, 05 §2.2.19, 12 §2.2.6).
///
/// 12 lists the limit switches only, but has `S0` in its example; it is assumed to exist.
pub(crate) fn knows_diagnosis(dialect: Dialect, code: [u8; 2]) -> bool {
    let codes = diagnosis_codes(dialect);
    codes.chunks_exact(2).any(|known| known == code)
}

/// The diagnosis codes of a dialect, two characters each, one after the other.
pub(crate) const fn diagnosis_codes(dialect: Dialect) -> &'static [u8] {
    match dialect {
        Dialect::Imc4 => b"RpRnP0P1O0S0",
        Dialect::Imc4M => b"RpRnP0P1P2O0O1S0H0SL",
        Dialect::ImcXx => b"RpRnS0",
    }
}

/// A table, and the way from a letter to its rows.
pub(crate) struct Vocabulary {
    specs: &'static [CommandSpec],
    letters: Letters,
}

impl Vocabulary {
    /// The command of a letter of a direct line, or of a code of a stored one.
    pub(crate) fn command(&self, letter: u8) -> Option<&'static CommandSpec> {
        self.at(&self.letters.commands, letter)
    }

    /// The command of a letter that follows `I`.
    pub(crate) fn init(&self, letter: u8) -> Option<&'static CommandSpec> {
        self.at(&self.letters.inits, letter)
    }

    fn at(&self, index: &[u8; 128], letter: u8) -> Option<&'static CommandSpec> {
        self.specs.get(usize::from(*index.get(usize::from(letter))?))
    }
}

/// For every ASCII letter the row of its command; [`NO_ROW`] where there is none.
struct Letters {
    commands: [u8; 128],
    inits: [u8; 128],
}

/// Beyond every table.
const NO_ROW: u8 = u8::MAX;

/// A row of the list: an operation in all dialects and both modes.
#[derive(Clone, Copy)]
struct Row {
    op: Op,
    title: &'static str,
    class: Class,
    fields: Fields,
    needs_axes: bool,
    direct: Form,
    stored: Form,
}

/// How an operation looks in one mode.
#[derive(Clone, Copy)]
struct Form {
    mnemonic: &'static str,
    /// In the manuals of 1999, 2005 and 2012; empty where the dialect lacks it.
    sections: [&'static str; 3],
    replies: &'static [Reply],
}

impl Form {
    const NONE: Self = Self { mnemonic: "", sections: [""; 3], replies: &[] };
}

const fn row(op: Op, title: &'static str, class: Class, fields: Fields) -> Row {
    Row { op, title, class, fields, needs_axes: false, direct: Form::NONE, stored: Form::NONE }
}

impl Row {
    const fn needs_axes(mut self) -> Self {
        self.needs_axes = true;
        self
    }

    const fn direct(
        mut self,
        mnemonic: &'static str,
        sections: [&'static str; 3],
        replies: &'static [Reply],
    ) -> Self {
        self.direct = Form { mnemonic, sections, replies };
        self
    }

    const fn stored(
        mut self,
        mnemonic: &'static str,
        sections: [&'static str; 3],
        replies: &'static [Reply],
    ) -> Self {
        self.stored = Form { mnemonic, sections, replies };
        self
    }

    const fn form(&self, mode: Mode) -> &Form {
        match mode {
            Mode::Direct => &self.direct,
            Mode::Stored => &self.stored,
        }
    }
}

// Replies that many commands share.

/// No parameters, nothing that can fail.
const PLAIN: &[Reply] = &[Done, Count];
/// Numbers in a range.
const NUMBERS: &[Reply] = &[Done, Number, Count];
/// Numbers, one of them a speed.
const SPEEDS: &[Reply] = &[Done, Number, Count, Speed];
/// A set of axes that nothing moves.
const AXES: &[Reply] = &[Done, Number, Axis, NoAxes, Count];
/// A straight move.
const MOVE: &[Reply] = &[Done, Number, LimitSwitch, NoAxes, Count, Plant, Speed, Stopped, Cover];
/// A straight move of the iMC-xx, which may ask for a reference run.
const MOVE_XX: &[Reply] =
    &[Done, Number, LimitSwitch, NoAxes, Count, Plant, Speed, Stopped, Cover, Reference];
/// A circle: the axes of its plane may not be configured.
const CIRCLE: &[Reply] =
    &[Done, Number, LimitSwitch, Axis, NoAxes, Count, Plant, Speed, Stopped, Cover];
/// A circle or a helix of the iMC-xx, which may ask for a reference run.
const CIRCLE_XX: &[Reply] =
    &[Done, Number, LimitSwitch, Axis, NoAxes, Count, Plant, Speed, Stopped, Cover, Reference];
/// A motion along given axes that STOP does not interrupt with `F`: on a reference run STOP
/// replaces the switch.
const AXIS_MOTION: &[Reply] = &[Done, Number, LimitSwitch, Axis, NoAxes, Count, Plant, Cover];
/// A stored line without parameters.
const STORED_PLAIN: &[Reply] = &[Done, MemoryFull, Count];
/// A stored line with numbers in a range.
const STORED_NUMBERS: &[Reply] = &[Done, Number, MemoryFull, Count];
/// A stored line with numbers, one of them a speed.
const STORED_SPEEDS: &[Reply] = &[Done, Number, MemoryFull, Count, Speed];
/// A stored circle or helix.
const STORED_ARC: &[Reply] = &[Done, Number, Axis, MemoryFull, Count, Speed];
/// A stored line with a set of axes.
const STORED_AXES: &[Reply] = &[Done, Number, Axis, MemoryFull, Count];

/// Every command there is, in the order of the letters.
#[rustfmt::skip]
const ROWS: &[Row] = &[
    row(Op::SetAxes, "set axes", Setting, Just(1))
        .direct("@axes", ["2.2.1", "2.2.1", "2.2.1"], &[Done, Number, Axis, Count]),
    row(Op::RelativeMove, "relative move", Motion, Pairs).needs_axes()
        .direct("@A", ["2.2.4", "2.2.4", ""], MOVE)
        .stored("0", ["3.2.3", "3.2.3", "3.2.2"], STORED_SPEEDS),
    row(Op::RelativeMove, "relative move", Motion, Pairs).needs_axes()
        .direct("@A", ["", "", "2.2.2"], MOVE_XX),
    row(Op::ReadPort, "read port", Query, Just(1))
        .direct("@b", ["2.2.13", "2.2.13", "2.2.3"], NUMBERS),
    row(Op::WritePort, "write port", Output, Just(2))
        .direct("@B", ["2.2.14", "2.2.14", "2.2.4"], &[Done, Number, Count, Plant, Cover]),
    row(Op::ReferenceSpeeds, "set reference speeds", Setting, Speeds).needs_axes()
        .direct("@d", ["2.2.3", "2.2.3", "2.2.5"], &[Done, Number, NoAxes, Count, Speed])
        .stored("d", ["", "", "3.2.10"], STORED_SPEEDS),
    row(Op::Diagnosis, "diagnosis", Query, Just(0))
        .direct("@D", ["2.2.19", "2.2.19", "2.2.6"], &[Done, Syntax]),
    row(Op::Plane, "set plane of circles", Setting, Just(1))
        .direct("@e", ["2.2.9", "2.2.9", "2.2.7"], NUMBERS)
        .stored("e", ["3.2.7", "3.2.7", "3.2.11"], STORED_NUMBERS),
    row(Op::Direction, "set direction of circles", Setting, Just(1))
        .direct("@f", ["2.2.10", "2.2.10", "2.2.8"], NUMBERS)
        .stored("f", ["3.2.8", "3.2.8", "3.2.12"], STORED_NUMBERS),
    row(Op::Free, "leave limit switch", Motion, Just(1)).needs_axes()
        .direct("@F", ["", "", "2.2.9"], AXIS_MOTION),
    row(Op::Brake, "switch brake", Output, Just(1))
        .direct("@g", ["", "", "2.2.10"], NUMBERS)
        .stored("g", ["", "", "3.2.13"], STORED_NUMBERS),
    row(Op::DeviceNumber, "set device number", Setting, Just(1))
        .direct("@G", ["", "", "2.2.11"], NUMBERS),
    row(Op::LimitStatus, "show limit switches", Query, Just(0))
        .direct("@h", ["", "2.2.16", "2.2.12"], PLAIN),
    row(Op::Status, "show status", Query, Just(0))
        .direct("@H", ["2.2.16", "2.2.16", "2.2.12"], PLAIN),
    row(Op::Store, "store data field", Program, Just(0)).needs_axes()
        .direct("@i", ["3.2.1", "3.2.1", "2.2.13, 3.2.1"], &[Done, NoAxes, Count, DataField]),
    row(Op::InitAbort, "set abort input", Setting, Just(3))
        .direct("@IA", ["", "", "4.2.11"], NUMBERS),
    row(Op::InitErrorSignal, "set error output", Setting, Just(3))
        .direct("@Ia", ["", "", "4.2.12"], NUMBERS),
    row(Op::InitBaud9600, "set 9600 baud", Setting, Just(1))
        .direct("@IC", ["", "", "4.2.15"], NUMBERS),
    row(Op::InitDefaultSpeeds, "set default reference speeds", Setting, Just(4))
        .direct("@Id", ["", "", "2.2.14, 4.2.1"], SPEEDS),
    row(Op::InitDirections, "invert directions", Setting, Just(1))
        .direct("@ID", ["2.2.18", "2.2.18", "2.2.14, 4.2.8"], NUMBERS),
    row(Op::InitSwapLimits, "swap limit switches", Setting, Just(1))
        .direct("@Ie", ["", "", "2.2.14, 4.2.7"], NUMBERS),
    row(Op::InitLimits, "set limit switches", Setting, Just(1))
        .direct("@IE", ["", "", "2.2.14, 4.2.6"], NUMBERS),
    row(Op::InitFreeSteps, "set steps off the reference switches", Setting, Just(4))
        .direct("@IF", ["", "", "2.2.14, 4.2.2"], NUMBERS),
    row(Op::InitCover, "set cover input", Setting, Just(3))
        .direct("@IH", ["", "", "4.2.13"], NUMBERS),
    row(Op::InitDefaultStartStop, "set default start-stop frequency", Setting, Just(1))
        .direct("@Ij", ["", "", "2.2.14, 4.2.4"], SPEEDS),
    row(Op::InitDefaultAcceleration, "set default acceleration", Setting, Just(1))
        .direct("@IJ", ["", "", "2.2.14, 4.2.3"], NUMBERS),
    row(Op::InitRotaryL, "set rotary axes", Setting, Just(1))
        .direct("@IL", ["", "2.2.18", ""], NUMBERS),
    row(Op::InitLoad, "load parameters from flash", Setting, Just(0))
        .direct("@IL", ["", "", "2.2.14, 4.2.17"], PLAIN),
    row(Op::InitEmergency, "set emergency stop input", Setting, Just(3))
        .direct("@IN", ["", "", "4.2.14"], NUMBERS),
    row(Op::InitIoOnly, "set ports only", Setting, Just(1))
        .direct("@IO", ["", "", "2.2.14, 4.2.5"], NUMBERS),
    row(Op::InitReferences, "invert reference directions", Setting, Just(1))
        .direct("@IR", ["2.2.18", "2.2.18", "2.2.14, 4.2.9"], NUMBERS),
    row(Op::InitHardwareStatus, "set hardware status", Setting, Just(1))
        .direct("@IS", ["2.2.18", "2.2.18", ""], NUMBERS),
    row(Op::InitAxisTypes, "set axis types", Setting, Just(1))
        .direct("@IT", ["", "", "2.2.14, 4.2.10"], NUMBERS),
    row(Op::InitUserInfo, "set user info", Setting, Just(0))
        .direct("@IU", ["", "", "4.2.16"], &[Done, Number]),
    row(Op::InitWrite, "write parameters to flash", Setting, Just(0))
        .direct("@IW", ["", "", "2.2.14, 4.2.18"], PLAIN),
    row(Op::InitFactory, "restore factory parameters", Setting, Just(0))
        .direct("@IX", ["", "", "2.2.14, 4.2.19"], PLAIN),
    row(Op::StartStop, "set start-stop frequency", Setting, Just(1))
        .direct("@j", ["", "", "2.2.15"], SPEEDS)
        .stored("j", ["", "", "3.2.14"], STORED_SPEEDS),
    row(Op::Acceleration, "set acceleration", Setting, Just(1))
        .direct("@J", ["", "", "2.2.16"], NUMBERS)
        .stored("J", ["", "", "3.2.15"], STORED_NUMBERS),
    row(Op::Erase, "erase program", Program, Just(0))
        .direct("@k", ["", "2.2.22", "2.2.17"], PLAIN),
    row(Op::AbsoluteMove, "absolute move", Motion, Pairs).needs_axes()
        .direct("@M", ["2.2.5", "2.2.5", ""], MOVE)
        .stored("m", ["3.2.4", "3.2.4", "3.2.16"], STORED_SPEEDS),
    row(Op::AbsoluteMove, "absolute move", Motion, Pairs).needs_axes()
        .direct("@M", ["", "", "2.2.18"], MOVE_XX),
    row(Op::Zero, "set zero", Setting, Just(1)).needs_axes()
        .direct("@n", ["2.2.7", "2.2.7", "2.2.19"], AXES)
        .stored("n", ["3.2.5", "3.2.5", "3.2.17"], STORED_AXES),
    row(Op::SimulateReference, "simulate reference run", Setting, Just(1)).needs_axes()
        .direct("@N", ["", "", "2.2.20"], AXES)
        .stored("N", ["", "", "3.2.18"], STORED_AXES),
    row(Op::Position, "read position", Query, Just(0))
        .direct("@P", ["2.2.6", "2.2.6", "2.2.21"], PLAIN),
    row(Op::Reference, "reference run", Motion, Just(1)).needs_axes()
        .direct("@R", ["2.2.2", "2.2.2", "2.2.22"], AXIS_MOTION)
        .stored("7", ["3.2.2", "3.2.2", "3.2.8"], STORED_AXES),
    // A program ends with what its own lines can end with: an absolute move without reference
    // with `R` or `2`, a circle in a plane that is not configured with `3`.
    row(Op::Start, "go on with stopped motion or program", Motion, Just(0))
        .direct("@S", ["2.2.12", "2.2.12", ""], &[
            Done, LimitSwitch, Axis, Count, Plant, Stopped, DataField, Cover,
        ]),
    row(Op::Start, "go on with stopped motion or run program", Motion, Just(0))
        .direct("@S", ["", "", "2.2.23"], &[
            Done, LimitSwitch, Axis, Count, Plant, Stopped, DataField, Cover, Reference,
        ]),
    row(Op::TestMode, "switch test mode", Setting, Just(1))
        .direct("@T", ["2.2.15", "2.2.15", "2.2.24"], NUMBERS)
        .stored("T", ["", "", "3.2.21"], STORED_NUMBERS),
    row(Op::UserInfo, "show user info", Query, Just(0))
        .direct("@U", ["", "", "2.2.25"], PLAIN),
    row(Op::Version, "show version", Query, Just(0))
        .direct("@V", ["2.2.17", "2.2.17", "2.2.26"], PLAIN),
    row(Op::Helix, "helix", Motion, Just(8)).needs_axes()
        .direct("@w", ["", "", "2.2.27"], CIRCLE_XX)
        .stored("w", ["", "", "3.2.22"], STORED_ARC),
    row(Op::Circle, "circle", Motion, Just(7)).needs_axes()
        .direct("@y", ["2.2.11", "2.2.11", ""], CIRCLE)
        .stored("y", ["3.2.9", "3.2.9", "3.2.23"], STORED_ARC),
    row(Op::Circle, "circle", Motion, Just(7)).needs_axes()
        .direct("@y", ["", "", "2.2.28"], CIRCLE_XX),
    row(Op::Interpolation3d, "switch 3D interpolation", Setting, Just(1))
        .direct("@z", ["2.2.8", "2.2.8", "2.2.29"], NUMBERS)
        .stored("z", ["3.2.6", "3.2.6", "3.2.24"], STORED_NUMBERS),
    row(Op::MoveUntil, "move until port", Motion, TestAndSteps).needs_axes()
        .direct("@Z", ["", "2.2.23", ""], MOVE),
    row(Op::MoveUntil, "move until port", Motion, TestAndSteps).needs_axes()
        .direct("@Z", ["", "", "2.2.30"], MOVE_XX),
    // It streams text until the reset and so is never done.
    row(Op::SelfTest, "self-test", Motion, Just(0))
        .direct("@?", ["2.2.20", "2.2.20", ""], &[Count, Plant, Cover]),
    row(Op::SendSync, "send character", Program, Just(1))
        .stored("1", ["", "", "3.2.3"], STORED_NUMBERS),
    row(Op::AwaitSync, "wait for character", Program, Just(2))
        .stored("2", ["", "", "3.2.4"], STORED_NUMBERS),
    row(Op::Loop, "loop or branch", Program, Just(2))
        .stored("3", ["3.2.10", "3.2.10", "3.2.5"], STORED_NUMBERS),
    row(Op::Delay, "delay", Program, Just(1))
        .stored("5", ["3.2.11", "3.2.11", "3.2.6"], STORED_NUMBERS),
    row(Op::Until, "condition of next move", Program, Just(3))
        .stored("6", ["", "", "3.2.7"], STORED_NUMBERS),
    row(Op::End, "end of data field", Program, Just(0))
        .stored("9", ["3.2.14", "3.2.14", "3.2.9"], STORED_PLAIN),
    row(Op::BranchIf, "branch on port", Program, Just(4))
        .stored("o", ["3.2.13", "3.2.13", "3.2.19"], STORED_NUMBERS),
    row(Op::SetPort, "set port", Output, Just(3))
        .stored("p", ["3.2.12", "3.2.12", "3.2.20"], STORED_NUMBERS),
];

// What follows runs in the compiler only. It uses loops because iterators are not const.

const fn has(row: &Row, dialect: Dialect, mode: Mode) -> bool {
    !row.form(mode).sections[dialect as usize].is_empty()
}

const fn count(dialect: Dialect, mode: Mode) -> usize {
    let (mut count, mut at) = (0, 0);
    while at < ROWS.len() {
        if has(&ROWS[at], dialect, mode) {
            count += 1;
        }
        at += 1;
    }
    count
}

const fn pick<const N: usize>(dialect: Dialect, mode: Mode) -> [CommandSpec; N] {
    const BLANK: CommandSpec = CommandSpec {
        op: Op::SetAxes,
        mnemonic: "",
        title: "",
        class: Class::Query,
        fields: Just(0),
        needs_axes: false,
        sections: "",
        replies: &[],
    };
    let mut specs = [BLANK; N];
    let (mut place, mut at) = (0, 0);
    while at < ROWS.len() {
        let row = &ROWS[at];
        if has(row, dialect, mode) {
            let form = row.form(mode);
            specs[place] = CommandSpec {
                op: row.op,
                mnemonic: form.mnemonic,
                title: row.title,
                class: row.class,
                fields: row.fields,
                // While a data field is stored there are axes: `@i` makes sure of that.
                needs_axes: row.needs_axes && matches!(mode, Mode::Direct),
                sections: form.sections[dialect as usize],
                replies: form.replies,
            };
            place += 1;
        }
        at += 1;
    }
    specs
}

const fn letters(dialect: Dialect, mode: Mode, specs: &[CommandSpec]) -> Letters {
    // Every row of a table needs a number below that.
    assert!(specs.len() <= NO_ROW as usize);
    let mut letters = Letters { commands: [NO_ROW; 128], inits: [NO_ROW; 128] };
    let mut at = 0;
    while at < specs.len() {
        let (row, name) = (at as u8, specs[at].mnemonic.as_bytes());
        match (mode, name.len()) {
            (Mode::Stored, 1) => letters.commands[name[0] as usize] = row,
            (Mode::Direct, 2) => {
                letters.commands[name[1] as usize] = row;
                // Only these letters are given in both cases by the manuals.
                let both = matches!(name[1], b'A' | b'R' | b'S')
                    || name[1] == b'M' && matches!(dialect, Dialect::ImcXx);
                if both {
                    letters.commands[name[1].to_ascii_lowercase() as usize] = row;
                }
                if name[1] == b'V' && matches!(dialect, Dialect::ImcXx) {
                    letters.commands[b'?' as usize] = row;
                }
            }
            (Mode::Direct, 3) => letters.inits[name[2] as usize] = row,
            // `@axes` has no letter.
            _ => {}
        }
        at += 1;
    }
    letters
}

/// The vocabulary of a dialect in a mode.
pub(crate) fn vocabulary(dialect: Dialect, mode: Mode) -> &'static Vocabulary {
    match (dialect, mode) {
        (Dialect::Imc4, Mode::Direct) => &IMC4_DIRECT,
        (Dialect::Imc4, Mode::Stored) => &IMC4_STORED,
        (Dialect::Imc4M, Mode::Direct) => &IMC4M_DIRECT,
        (Dialect::Imc4M, Mode::Stored) => &IMC4M_STORED,
        (Dialect::ImcXx, Mode::Direct) => &IMCXX_DIRECT,
        (Dialect::ImcXx, Mode::Stored) => &IMCXX_STORED,
    }
}

macro_rules! vocabularies {
    ($($name:ident: $dialect:ident, $mode:ident;)*) => {$(
        static $name: Vocabulary = {
            const SPECS: &[CommandSpec] =
                &pick::<{ count(Dialect::$dialect, Mode::$mode) }>(Dialect::$dialect, Mode::$mode);
            Vocabulary {
                specs: SPECS,
                letters: letters(Dialect::$dialect, Mode::$mode, SPECS),
            }
        };
    )*};
}

vocabularies! {
    IMC4_DIRECT: Imc4, Direct;
    IMC4_STORED: Imc4, Stored;
    IMC4M_DIRECT: Imc4M, Direct;
    IMC4M_STORED: Imc4M, Stored;
    IMCXX_DIRECT: ImcXx, Direct;
    IMCXX_STORED: ImcXx, Stored;
}
