//! All commands, for reading and for writing them: one table.
//!
//! The parser, the services for editors and the documentation all use it.

use vimc4_motion::Turn;

use super::command::{Accessory, Frame, Instruction, LETTERS, Rate, Units};
use super::value::Value;

// The list below is a table, and reads like one without these prefixes.
use Frame::{Absolute, Relative};
use Rate::{Normal, Rapid};
use Source::{Field, Manual};
use Turn::{Clockwise, Counterclockwise};

/// A command as listed in the reference.
#[derive(Debug)]
pub struct CommandInfo {
    /// Its name, in capitals.
    pub name: &'static str,
    /// What may follow the name; optional parts are in brackets.
    pub words: &'static str,
    /// What it does, in a sentence.
    pub meaning: &'static str,
    /// The words it takes, in the order in which they are usually written.
    pub parameters: &'static [Parameter],
    /// Where it is known from.
    pub source: Source,
    /// A correct line.
    pub example: &'static str,
    /// What is read after the name.
    pub(super) form: Form,
}

/// Where a command is known from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The manual.
    Manual,
    /// Files that are in use.
    Field,
}

impl Source {
    /// The mark of the contract: `D` or `F`.
    #[must_use]
    pub fn mark(self) -> char {
        match self {
            Manual => 'D',
            Field => 'F',
        }
    }
}

/// A word of a command.
#[derive(Debug)]
pub struct Parameter {
    /// Its letter or its letters; nothing if the value follows the name of the command.
    pub name: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// The value it takes; `None` if the word has no value.
    pub value: Option<Number>,
}

/// What the number of a word may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Number {
    /// What it counts, such as `µm`; empty if it counts nothing.
    pub unit: &'static str,
    /// The least.
    pub least: Value,
    /// The greatest.
    pub most: Value,
    /// Whether it must be a whole number.
    pub whole: bool,
}

/// What is read after the name of a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    /// Nothing.
    Plain(Instruction),
    /// Anything at all, up to the end of the line.
    Anything(Instruction),
    Reference,
    Limit,
    Velocity,
    RapidVelocity,
    Move(Frame, Rate),
    Plane,
    Arc {
        frame: Frame,
        turn: Turn,
        helix: bool,
    },
    Wait,
    ZeroAt,
    Register,
    SetPort,
    /// The value to which it sets the bit.
    SetBit(bool),
    WaitBit,
    WaitPort,
    Tool,
    DrillDefinition,
    Drill,
    Cylinder,
    Acceleration,
    Spindle,
    /// On or off.
    Switch(Accessory),
    /// A number, then on or off.
    Numbered(&'static [Accessory]),
    ZeroHere,
    ToolDefinition,
}

/// The most words a command takes.
pub(super) const MOST_WORDS: usize = 11;

/// The name that a file mark begins with.
pub(super) const MARK: &str = "IMF_PBL";

/// The file mark as other programs insist on it.
pub(crate) const WHOLE_MARK: &str = "IMF_PBL_V1.0";

/// The command of this name, in capitals or not.
#[must_use]
pub fn find(name: &str) -> Option<&'static CommandInfo> {
    let begins_file =
        || name.get(..MARK.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(MARK));
    let known = COMMANDS.iter().find(|info| info.name.eq_ignore_ascii_case(name));
    known.or_else(|| COMMANDS.iter().find(|info| info.name == MARK && begins_file()))
}

/// All commands as a table in Markdown, with the mark of where each is known from.
#[must_use]
pub fn markdown() -> String {
    let row = |info: &CommandInfo| {
        let pattern = info.pattern().replace('|', "\\|");
        format!("| `{pattern}` | {} | {} |\n", info.meaning, info.source.mark())
    };
    let rows: String = COMMANDS.iter().map(row).collect();
    format!("| Instruction | Meaning | |\n|---|---|---|\n{rows}")
}

impl CommandInfo {
    /// The name and what may follow it.
    #[must_use]
    pub fn pattern(&self) -> String {
        // The number of a register follows its name at once.
        let at_once = matches!(self.form, Form::Register | Form::Numbered(_));
        let blank = if self.words.is_empty() || at_once { "" } else { " " };
        format!("{}{blank}{}", self.name, self.words)
    }

    /// Which axis a word of it belongs to, if it belongs to one.
    pub(super) fn axis(&self, parameter: &Parameter) -> Option<usize> {
        // A table of axes has them in their order; the C of a drilling cycle stands elsewhere.
        let mut axes = self.parameters.iter().zip(LETTERS).enumerate();
        let is_it = |(_, (known, letter)): &(usize, (&Parameter, char))| {
            known.name == parameter.name && known.name.chars().eq([*letter])
        };
        axes.find(is_it).map(|(axis, _)| axis)
    }

    /// Whether the tool does the same without it.
    #[must_use]
    pub(crate) fn is_accessory(&self) -> bool {
        match self.form {
            Form::Plain(command) | Form::Anything(command) => command.is_accessory(),
            Form::Switch(_)
            | Form::Numbered(_)
            | Form::SetPort
            | Form::SetBit(_)
            | Form::ToolDefinition => true,
            _ => false,
        }
    }

    /// The words that it takes at a place among its words, counted from 0.
    pub(super) fn words_at(&self, place: usize) -> &'static [Parameter] {
        match self.form {
            Form::Cylinder if place > 0 => LINEAR_AXES,
            Form::Register if place == 0 => REGISTER_WORDS,
            _ => self.parameters,
        }
    }
}

const fn number(unit: &'static str) -> Option<Number> {
    let least = Value::thousandths(-Value::MOST.in_thousandths());
    Some(Number { unit, least, most: Value::MOST, whole: false })
}

const fn from(unit: &'static str, least: Value) -> Option<Number> {
    Some(Number { unit, least, most: Value::MOST, whole: false })
}

const fn range(unit: &'static str, least: i64, most: i64) -> Option<Number> {
    Some(Number { unit, least: Value::whole(least), most: Value::whole(most), whole: true })
}

const fn word(name: &'static str, value: Option<Number>, meaning: &'static str) -> Parameter {
    Parameter { name, meaning, value }
}

/// The smallest value above nothing.
const ABOVE_ZERO: Value = Value::thousandths(1);

pub(super) const WAY: &str = "µm, of a rotary axis arc seconds";
pub(super) const SPEED: &str = "µm/s, of rotary axes alone arc seconds/s";

const NOTHING: &[Parameter] = &[];

/// A place of each axis, from the work-piece zero.
const PLACES: &[Parameter] = &[
    word("X", number(WAY), "where X goes"),
    word("Y", number(WAY), "where Y goes"),
    word("Z", number(WAY), "where Z goes"),
    word("A", number(WAY), "where the fourth axis goes"),
    word("B", number(WAY), "where the fifth axis goes"),
    word("C", number(WAY), "where the sixth axis goes"),
];

/// A way of each axis, from where the tool is.
const WAYS: &[Parameter] = &[
    word("X", number(WAY), "how far X goes"),
    word("Y", number(WAY), "how far Y goes"),
    word("Z", number(WAY), "how far Z goes"),
    word("A", number(WAY), "how far the fourth axis goes"),
    word("B", number(WAY), "how far the fifth axis goes"),
    word("C", number(WAY), "how far the sixth axis goes"),
];

/// The end of an arc and its centre, from the work-piece zero.
const ARC_PLACES: &[Parameter] = HELIX_PLACES.split_at(9).0;

/// The same of a helix.
const HELIX_PLACES: &[Parameter] = &[
    word("X", number(WAY), "where the arc ends in X"),
    word("Y", number(WAY), "where the arc ends in Y"),
    word("Z", number(WAY), "where the arc ends in Z"),
    word("A", number(WAY), "not used by arcs"),
    word("B", number(WAY), "not used by arcs"),
    word("C", number(WAY), "not used by arcs"),
    word("I", number(WAY), "where the centre is on the first axis of the plane"),
    word("J", number(WAY), "where the centre is on the second axis of the plane"),
    word("K", number(WAY), "where the centre is in Z; beside it I belongs to X and J to Y"),
    word("W", from("degrees", Value::ZERO), "how far it goes round, if more than a turn too"),
];

/// The end of an arc and its centre, from where the tool is.
const ARC_WAYS: &[Parameter] = HELIX_WAYS.split_at(9).0;

/// The same of a helix.
const HELIX_WAYS: &[Parameter] = &[
    word("X", number(WAY), "how far away the arc ends in X"),
    word("Y", number(WAY), "how far away the arc ends in Y"),
    word("Z", number(WAY), "how far away the arc ends in Z"),
    word("A", number(WAY), "not used by arcs"),
    word("B", number(WAY), "not used by arcs"),
    word("C", number(WAY), "not used by arcs"),
    word("I", number(WAY), "how far away the centre is on the first axis of the plane"),
    word("J", number(WAY), "how far away the centre is on the second axis of the plane"),
    word("K", number(WAY), "how far away the centre is in Z; beside it I belongs to X and J to Y"),
    word("W", from("degrees", Value::ZERO), "how far it goes round, if more than a turn too"),
];

/// A machine coordinate of each axis.
const ZEROS: &[Parameter] = &ZEROS_BY_AXIS;

/// The same, axis by axis.
const ZEROS_BY_AXIS: [Parameter; 6] = [
    word("X", number(WAY), "machine coordinate of the work-piece zero in X"),
    word("Y", number(WAY), "machine coordinate of the work-piece zero in Y"),
    word("Z", number(WAY), "machine coordinate of the work-piece zero in Z"),
    word("A", number(WAY), "machine coordinate of the work-piece zero of the fourth axis"),
    word("B", number(WAY), "machine coordinate of the work-piece zero of the fifth axis"),
    word("C", number(WAY), "machine coordinate of the work-piece zero of the sixth axis"),
];

/// What can stand first behind a register.
const REGISTER_WORDS: &[Parameter] = &{
    let [x, y, z, a, b, c] = ZEROS_BY_AXIS;
    [x, y, z, a, b, c, word("ACT", None, "the zero in the register counts from now on")]
};

const LIMITS: &[Parameter] = &[
    word("X", number(WAY), "lowest and highest machine coordinate of X"),
    word("Y", number(WAY), "lowest and highest machine coordinate of Y"),
    word("Z", number(WAY), "lowest and highest machine coordinate of Z"),
    word("A", number(WAY), "lowest and highest machine coordinate of the fourth axis"),
    word("B", number(WAY), "lowest and highest machine coordinate of the fifth axis"),
    word("C", number(WAY), "lowest and highest machine coordinate of the sixth axis"),
];

const ACCELERATIONS: &[Parameter] = &[
    word("X", range("%", 5, 100), "acceleration of X"),
    word("Y", range("%", 5, 100), "acceleration of Y"),
    word("Z", range("%", 5, 100), "acceleration of Z"),
    word("A", range("%", 5, 100), "acceleration of the fourth axis"),
    word("B", range("%", 5, 100), "acceleration of the fifth axis"),
    word("C", range("%", 5, 100), "acceleration of the sixth axis"),
];

const AXES: &[Parameter] = &[
    word("X", None, "the X axis"),
    word("Y", None, "the Y axis"),
    word("Z", None, "the Z axis"),
    word("A", None, "the fourth axis"),
    word("B", None, "the fifth axis"),
    word("C", None, "the sixth axis"),
];

const PLANES: &[Parameter] = &[
    word("XY", None, "circles in X and Y; I belongs to X, J to Y"),
    word("XZ", None, "circles in X and Z; I belongs to X, J to Z"),
    word("YZ", None, "circles in Y and Z; I belongs to Y, J to Z"),
];

const RADII: &[Parameter] = &[
    word("X", from("µm", Value::ZERO), "radius of the cylinder that X turns"),
    word("Y", from("µm", Value::ZERO), "radius of the cylinder that Y turns"),
    word("Z", from("µm", Value::ZERO), "radius of the cylinder that Z turns"),
    word("A", from("µm", Value::ZERO), "radius of the cylinder that the fourth axis turns"),
    word("B", from("µm", Value::ZERO), "radius of the cylinder that the fifth axis turns"),
    word("C", from("µm", Value::ZERO), "radius of the cylinder that the sixth axis turns"),
];

const LINEAR_AXES: &[Parameter] = &[
    word("X", None, "goes around the cylinder"),
    word("Y", None, "goes around the cylinder"),
    word("Z", None, "goes around the cylinder"),
];

const DRILL_PLACES: &[Parameter] = &[
    word("X", number("µm"), "where the hole is in X"),
    word("Y", number("µm"), "where the hole is in Y"),
];

const DRILL_WORDS: &[Parameter] = &[
    word("C", range("", 1, 3), "cycle: 1 drills at once, 2 clears the chips, 3 breaks them"),
    word("P", number("µm"), "height of the reference plane above the work-piece zero"),
    word("D", number("µm"), "depth of the hole below the reference plane"),
    word("T", from("ms", Value::ZERO), "how long the drill stays at the bottom"),
    word("V", from("µm/s", ABOVE_ZERO), "speed of drilling"),
    word("F", number("µm"), "depth of the first step"),
    word("O", number("µm"), "depth of the second step"),
    word("I", number("µm"), "how much shallower each further step is"),
    word("R", number("µm"), "how far the drill is lifted to break chips, or slows down early"),
    word("L", number("µm"), "height between steps, above the reference plane"),
    word("S", number("µm"), "height before and after, above the reference plane"),
];

const SPINDLE_WORDS: &[Parameter] = &[
    word("ON", None, "the spindle runs"),
    word("OFF", None, "the spindle stops"),
    word("CW", None, "it turns clockwise"),
    word("CCW", None, "it turns counterclockwise"),
    word("RPM", from("turns/min", Value::ZERO), "its speed"),
    word("TIME", from("ms", Value::ZERO), "how long to wait until it has that speed"),
];

const SWITCH: &[Parameter] =
    &[word("ON", None, "it is switched on"), word("OFF", None, "it is switched off")];

const STANDARD: &[Parameter] = &[word(
    "STANDARD",
    None,
    "the zero that was there before the job: the machine's, or the one from outside",
)];

const TOOL_WORDS: &[Parameter] = &[
    word("T", range("", 0, TOOLS), "number of the tool"),
    word("L", number("µm"), "length of the tool"),
    word("R", number("µm"), "radius of the tool"),
];

/// The highest number of a tool: nine digits.
const TOOLS: i64 = 999_999_999;

const SPEEDS: &[Parameter] = &[word("", from(SPEED, ABOVE_ZERO), "the speed along the way")];
const DELAY: &[Parameter] = &[word("", from("ms", Value::ZERO), "how long")];
const TOOL: &[Parameter] = &[word("", range("", 0, TOOLS), "number of the tool")];

const MOVE: &str = "[Xn] [Yn] [Zn] [An]";
const ARC: &str = "[In] [Jn] [Kn] [Xn] [Yn] [Zn]";
const HELIX: &str = "[In] [Jn] [Kn] [Wn] [Xn] [Yn] [Zn]";
const ON_OFF: &str = "ON | OFF";

/// The coolants by number.
const COOLANTS: &[Accessory] =
    &[Accessory::Coolant, Accessory::Coolant2, Accessory::Coolant3, Accessory::Coolant4];

/// The options of the periphery by number.
const OPTIONS: &[Accessory] =
    &[Accessory::Poption1, Accessory::Poption2, Accessory::Poption3, Accessory::Poption4];

const fn row(
    name: &'static str,
    words: &'static str,
    form: Form,
    parameters: &'static [Parameter],
    example: &'static str,
    meaning: &'static str,
) -> CommandInfo {
    CommandInfo { name, words, meaning, parameters, source: Manual, example, form }
}

/// The same, known from files that are in use.
const fn field(info: CommandInfo) -> CommandInfo {
    CommandInfo { source: Field, ..info }
}

const fn arc(frame: Frame, turn: Turn, helix: bool) -> Form {
    Form::Arc { frame, turn, helix }
}

/// Every command. The most frequent ones come first, because they are looked up most.
pub static COMMANDS: &[CommandInfo] = &[
    row(
        "MOVEABS",
        MOVE,
        Form::Move(Absolute, Normal),
        PLACES,
        "MOVEABS X20000 Y15000 Z-5000",
        "Moves in a straight line to a place at the normal speed; an axis that is not named rests.",
    ),
    row(
        "MOVEREL",
        MOVE,
        Form::Move(Relative, Normal),
        WAYS,
        "MOVEREL Y69625",
        "Moves in a straight line by a way at the normal speed; an axis that is not named rests.",
    ),
    row(
        "FASTABS",
        MOVE,
        Form::Move(Absolute, Rapid),
        PLACES,
        "FASTABS X53375 Y0 Z-3000",
        "Moves to a place at the rapid speed; an axis that is not named rests.",
    ),
    row(
        "FASTREL",
        MOVE,
        Form::Move(Relative, Rapid),
        WAYS,
        "FASTREL Z5000",
        "Moves by a way at the rapid speed; an axis that is not named rests.",
    ),
    row(
        "VEL",
        "speed",
        Form::Velocity,
        SPEEDS,
        "VEL 5000",
        "Sets the normal speed, that of straight moves, arcs and helices.",
    ),
    row(
        "FASTVEL",
        "speed",
        Form::RapidVelocity,
        SPEEDS,
        "FASTVEL 50000",
        "Sets the rapid speed, that of FASTABS and FASTREL.",
    ),
    row(
        "CWABS",
        ARC,
        arc(Absolute, Clockwise, false),
        ARC_PLACES,
        "CWABS I75000 J50000",
        "Moves along a clockwise arc to a place; without an end it is a full circle.",
    ),
    row(
        "CCWABS",
        ARC,
        arc(Absolute, Counterclockwise, false),
        ARC_PLACES,
        "CCWABS I75000 J50000 X75000 Y75000",
        "Moves along a counterclockwise arc to a place; without an end it is a full circle.",
    ),
    row(
        "CWREL",
        ARC,
        arc(Relative, Clockwise, false),
        ARC_WAYS,
        "CWREL I20000 J0",
        "Moves along a clockwise arc, centre and end counted from where the tool is; without an end it is a full circle.",
    ),
    row(
        "CCWREL",
        ARC,
        arc(Relative, Counterclockwise, false),
        ARC_WAYS,
        "CCWREL I20000 X20000 Y20000",
        "Moves along a counterclockwise arc, centre and end counted from where the tool is; without an end it is a full circle.",
    ),
    row(
        "CWHLXABS",
        HELIX,
        arc(Absolute, Clockwise, true),
        HELIX_PLACES,
        "CWHLXABS I75000 J50000 X75000 Y75000 Z-2000",
        "Moves along a clockwise helix to a place: an arc while the third axis moves evenly.",
    ),
    row(
        "CCWHLXABS",
        HELIX,
        arc(Absolute, Counterclockwise, true),
        HELIX_PLACES,
        "CCWHLXABS I75000 J50000 Z-2000",
        "Moves along a counterclockwise helix to a place: an arc while the third axis moves evenly.",
    ),
    row(
        "CWHLXREL",
        HELIX,
        arc(Relative, Clockwise, true),
        HELIX_WAYS,
        "CWHLXREL I20000 Z-2000",
        "Moves along a clockwise helix, centre and end counted from where the tool is.",
    ),
    row(
        "CCWHLXREL",
        HELIX,
        arc(Relative, Counterclockwise, true),
        HELIX_WAYS,
        "CCWHLXREL I20000 Z-2000",
        "Moves along a counterclockwise helix, centre and end counted from where the tool is.",
    ),
    row(
        "PLANE",
        "plane",
        Form::Plane,
        PLANES,
        "PLANE XY",
        "Chooses the plane of the arcs and helices that follow.",
    ),
    row(
        "REF",
        "axes [axes …]",
        Form::Reference,
        AXES,
        "REF Z XY",
        "Makes reference runs, group by group; within a group Z, Y and X go first, in this order.",
    ),
    row(
        "LIMIT",
        "[Xn,n] [Yn,n] [Zn,n] [An,n]",
        Form::Limit,
        LIMITS,
        "LIMIT X0,250000 Y0,200000 Z-80000,0",
        "Sets software limits for the moves that follow, as machine coordinates.",
    ),
    row("WAIT", "time", Form::Wait, DELAY, "WAIT 2000", "Waits before the job goes on."),
    row(
        "WPZERO",
        "[STANDARD]",
        Form::ZeroHere,
        STANDARD,
        "WPZERO",
        "Makes the place of the tool the work-piece zero; with STANDARD it is again where it was before the job.",
    ),
    row(
        "WPZEROABS",
        MOVE,
        Form::ZeroAt,
        ZEROS,
        "WPZEROABS X5000 Y5000 Z-5000",
        "Sets the work-piece zero to machine coordinates; an axis that is not named keeps its own.",
    ),
    row(
        "WPCLEAR",
        "",
        Form::Plain(Instruction::ZeroClear),
        NOTHING,
        "WPCLEAR",
        "Makes the machine's zero the work-piece zero again.",
    ),
    row(
        "WPREG",
        "n [Xn] [Yn] [Zn] [An] | WPREGnACT",
        Form::Register,
        ZEROS,
        "WPREG1 X100000 Y50000 Z-50000",
        "Keeps a work-piece zero in a register, 1 to 8; with ACT the one in the register counts from now on.",
    ),
    row(
        "WPTEACH",
        "",
        Form::Plain(Instruction::Teach),
        NOTHING,
        "WPTEACH",
        "Lets the operator move the tool to a new work-piece zero.",
    ),
    row(
        "SETPORT",
        "An=value",
        Form::SetPort,
        NOTHING,
        "SETPORT A1=100101B",
        "Writes a value to an output port, 1 to 4: binary with B, hexadecimal with H, otherwise decimal.",
    ),
    row(
        "SETBIT",
        "An.b",
        Form::SetBit(true),
        NOTHING,
        "SETBIT A1.4",
        "Sets a bit, 1 to 8, of an output port to 1.",
    ),
    row(
        "RESBIT",
        "An.b",
        Form::SetBit(false),
        NOTHING,
        "RESBIT A1.4",
        "Sets a bit, 1 to 8, of an output port to 0.",
    ),
    row(
        "WAITBIT",
        "En.b==v",
        Form::WaitBit,
        NOTHING,
        "WAITBIT E1.4==1",
        "Waits until a bit, 1 to 8, of an input port, 1 to 4, is 0 or 1.",
    ),
    row(
        "WAITPORT",
        "En==value",
        Form::WaitPort,
        NOTHING,
        "WAITPORT E1==00100101B",
        "Waits until an input port, 1 to 4, has a value.",
    ),
    row("GETTOOL", "number", Form::Tool, TOOL, "GETTOOL 3", "Changes the tool."),
    row(
        "SPINDLE",
        "[ON | OFF] [CW | CCW] [RPMn] [TIMEn]",
        Form::Spindle,
        SPINDLE_WORDS,
        "SPINDLE ON TIME2000",
        "Starts or stops the spindle.",
    ),
    row(
        "COOLANT",
        "[n] ON | OFF",
        Form::Numbered(COOLANTS),
        SWITCH,
        "COOLANT ON",
        "Starts or stops a coolant pump; without a number, the first of four.",
    ),
    field(row(
        "WPCLAMP",
        ON_OFF,
        Form::Switch(Accessory::Wpclamp),
        SWITCH,
        "WPCLAMP ON",
        "Clamps the work-piece, or lets it go.",
    )),
    field(row(
        "PUMP",
        ON_OFF,
        Form::Switch(Accessory::Pump),
        SWITCH,
        "PUMP ON",
        "Starts or stops a pump, such as that of a vacuum table.",
    )),
    field(row(
        "LAMP",
        ON_OFF,
        Form::Switch(Accessory::Lamp),
        SWITCH,
        "LAMP ON",
        "Switches the light.",
    )),
    field(row(
        "POPTION",
        "n ON | OFF",
        Form::Numbered(OPTIONS),
        SWITCH,
        "POPTION1 ON",
        "Switches something else at the machine, 1 to 4.",
    )),
    field(row(
        "METRIC",
        "",
        Form::Plain(Instruction::Units(Units::Metric)),
        NOTHING,
        "METRIC",
        "Lengths are in µm from now on, as they are at first.",
    )),
    field(row(
        "INCH",
        "",
        Form::Plain(Instruction::Units(Units::Inch)),
        NOTHING,
        "INCH",
        "Lengths are in thousandths of an inch from now on, speeds in thousandths of an inch a second.",
    )),
    row(
        "DRILLDEF",
        "[Cn] [Pn] [Dn] [Tn] [Vn] [Fn] [On] [In] [Rn] [Ln] [Sn]",
        Form::DrillDefinition,
        DRILL_WORDS,
        "DRILLDEF C2 P2000 D20000 F7000 O5000",
        "Sets how DRILL drills; what is not named stays as it is.",
    ),
    row(
        "DRILL",
        "[Xn] [Yn]",
        Form::Drill,
        DRILL_PLACES,
        "DRILL X10000 Y30000",
        "Drills a hole as DRILLDEF says; an axis that is not named rests.",
    ),
    row(
        "HALT",
        "",
        Form::Plain(Instruction::Halt),
        NOTHING,
        "HALT ; turn the work piece",
        "Waits for the operator; the comments on this line and the next tell what to do.",
    ),
    row(
        "CYL",
        "axis radius [axis]",
        Form::Cylinder,
        RADII,
        "CYL A5000 Y",
        "Wraps the moves of a linear axis, named second, around a cylinder that the first axis turns; radius 0 ends it.",
    ),
    row(
        "ACCEL",
        "[Xn] [Yn] [Zn] [An]",
        Form::Acceleration,
        ACCELERATIONS,
        "ACCEL X50 Y50",
        "Sets the acceleration of axes in percent of the machine's.",
    ),
    row(
        "PATH",
        "",
        Form::Plain(Instruction::Path),
        NOTHING,
        "PATH",
        "Begins a section that was made for servo controllers; here its moves run as they are written.",
    ),
    row(
        "PATHEND",
        "",
        Form::Plain(Instruction::PathEnd),
        NOTHING,
        "PATHEND",
        "Ends what PATH began.",
    ),
    row(
        "TOOLDEF",
        "[Tn] [Ln] [Rn]",
        Form::ToolDefinition,
        TOOL_WORDS,
        "TOOLDEF T1 L40000 R1500",
        "Describes a tool; it has no effect.",
    ),
    row(
        "INITTOOL",
        "",
        Form::Plain(Instruction::ToolInit),
        NOTHING,
        "INITTOOL",
        "Prepares a tool changer; it has no effect.",
    ),
    row(
        "IMF_PBL",
        "…",
        Form::Anything(Instruction::Mark),
        NOTHING,
        WHOLE_MARK,
        "Marks the file as a job; it is the first line, with any text after it.",
    ),
    field(row(
        "TYPE",
        "…",
        Form::Anything(Instruction::Type),
        NOTHING,
        "TYPE 3",
        "Tells something of the program that wrote the file; it has no effect.",
    )),
    row(
        "PROGEND",
        "",
        Form::Anything(Instruction::End),
        NOTHING,
        "PROGEND",
        "Ends the job; nothing behind it counts.",
    ),
];
