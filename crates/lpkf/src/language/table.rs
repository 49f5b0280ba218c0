//! Which commands there are: every form of every command, and which models have it.
//!
//! A form is a command with a number of parameters. The manual says of each whether a model has
//! it; what it calls "in preparation" counts as no, except where other machines of the family have
//! it: then the profile says so, see [`Grammar`](super::Grammar). Letters that the scanned manual
//! shows as `I` and two more are `!` and these two.

use serde::{Deserialize, Serialize};

use super::dialect::Dialect;
use super::parameter::{Kind, Parameter};

// The list below is a table, and reads like one without these prefixes.
use Answer::{Actual, Done, HardClip, Nominal, Port, Silence, Status};
use Dialect::{MotionSystem, Smcu};

/// A form of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Op {
    /// `AA x,y,a`.
    ArcAbsolute,
    /// `AR x,y,a`.
    ArcRelative,
    /// `CI r`.
    Circle,
    /// `EA x,y`.
    EdgeAbsolute,
    /// `ER x,y`.
    EdgeRelative,
    /// `IN`.
    Initialize,
    /// `IW x0,y0,x1,y1`.
    Window,
    /// `OH`.
    HardClipLimits,
    /// `OH n`.
    HardClipLimitsOf,
    /// `OS`.
    OutputStatus,
    /// `PA x,y…`.
    PlotAbsolute,
    /// `PD`.
    PenDown,
    /// `PR x,y…`.
    PlotRelative,
    /// `PU`.
    PenUp,
    /// `VS v`.
    PenSpeed,
    /// `!AS a,n`.
    AccelerationOf,
    /// `!AS a`.
    Acceleration,
    /// `!CC`.
    CloseChannel,
    /// `!CC n`.
    CloseChannelOf,
    /// `!CI`.
    CloseInterface,
    /// `!CM n`.
    SetMode,
    /// `!CS`.
    Continue,
    /// `!CT n`.
    Echo,
    /// `!ES n`.
    ExternalStop,
    /// `!EM n`.
    Spindle,
    /// `!FP`.
    FullCurrent,
    /// `!GB`.
    GoBack,
    /// `!HP`.
    HalfCurrent,
    /// `!IS`.
    Reference,
    /// `!IS n`.
    ReferenceOf,
    /// `!MA x,y,z0,z1,z2,z3`.
    MoveAllAbsolute,
    /// `!MR x,y,z0,z1,z2,z3`.
    MoveAllRelative,
    /// `!OA n`.
    ActualPosition,
    /// `!OC`.
    OpenChannel,
    /// `!OC n`.
    OpenChannelOf,
    /// `!OI n`.
    OpenInterface,
    /// `!ON n`.
    NominalPosition,
    /// `!PH a,b` and records.
    FollowVectors,
    /// `!RD a`.
    ReadPort,
    /// `!RC`.
    RepeatBroken,
    /// `!RS r,n`.
    ResolutionOf,
    /// `!RS r`.
    Resolution,
    /// `!SR min,max,n`.
    Range,
    /// `!TD td1,td2,td3,td4`.
    DrillingTimes,
    /// `!TM tm1,tm2,tm3,tm4`.
    MillingTimes,
    /// `!TS t`.
    SettlingTime,
    /// `!TW t`.
    Wait,
    /// `!VZ v,n`.
    AxisSpeed,
    /// `!VU v`.
    TravelSpeed,
    /// `!VZ v`.
    ZSpeed,
    /// `!WR a,d`.
    WritePort,
    /// `!ZA k,n`.
    MoveAxisAbsolute,
    /// `!ZA k`.
    MoveZAbsolute,
    /// `!ZR k,n`.
    MoveAxisRelative,
    /// `!ZR k`.
    MoveZRelative,
    /// `!CB`.
    ClearBuffer,
    /// `!GO`.
    GoOn,
    /// `!RP`.
    Repeat,
    /// `!ST`.
    Stop,
    /// `!TA x,y,z`.
    SpaceAbsolute,
    /// `!TR x,y,z`.
    SpaceRelative,
}

impl Op {
    /// Its row of the table.
    #[must_use]
    pub fn form(self) -> &'static Form {
        // The rows are in the order of the operations; a test holds them together.
        &FORMS[self as usize]
    }
}

/// How many parameters a form takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Count {
    /// As many as the form lists.
    Listed,
    /// Those listed, once or more often.
    Repeated,
}

/// What a command sends when it has succeeded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// `C` in echo mode, as all the others but [`Answer::Silence`] do after their data.
    Done,
    /// Nothing at all.
    Silence,
    /// `W` and how far the axes can go.
    HardClip,
    /// `S`, version, date and identity.
    Status,
    /// `P` and nominal positions.
    Nominal,
    /// `A` and measured positions.
    Actual,
    /// `R` and what a port shows.
    Port,
}

impl Answer {
    /// The letter its data begin with, if it has any.
    #[must_use]
    pub const fn letter(self) -> Option<char> {
        match self {
            Done | Silence => None,
            HardClip => Some('W'),
            Status => Some('S'),
            Nominal => Some('P'),
            Actual => Some('A'),
            Port => Some('R'),
        }
    }
}

/// The properties of one form of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// Which it is.
    pub op: Op,
    /// A short name that never changes: the letters, and where a command has several forms the
    /// number of parameters: `PA`, `!AS/2`.
    pub mnemonic: &'static str,
    /// Its name for people, in lower case.
    pub title: &'static str,
    /// What it takes, in order. The records of `!PH` come on top.
    pub parameters: &'static [Parameter],
    /// How often it takes them.
    pub count: Count,
    /// Who has it.
    pub models: &'static [Dialect],
    /// What it sends when it has succeeded.
    pub answer: Answer,
    /// Whether it bypasses the command buffer.
    pub direct: bool,
    /// The evidence for it: `D` for documented, `F` for seen in the field.
    pub evidence: &'static str,
    /// The chapter of the manual that describes it, by its heading, or `field`.
    pub source: &'static str,
}

impl Form {
    /// The letters it is written with: `PA`, `!AS`.
    #[must_use]
    pub fn letters(&self) -> &'static str {
        self.mnemonic.split('/').next().unwrap_or_default()
    }

    /// Whether a model has it.
    #[must_use]
    pub fn known_to(&self, model: Dialect) -> bool {
        self.models.contains(&model)
    }

    /// The fewest parameters it can have.
    pub(super) const fn least(&self) -> usize {
        self.parameters.len()
    }

    /// Whether it can have parameters.
    fn takes_parameters(&self) -> bool {
        !self.parameters.is_empty()
    }
}

/// Every form of every command, in the order of the manual.
#[must_use]
pub fn forms() -> &'static [Form] {
    FORMS
}

/// The forms of the command with these letters; none if there is no such command.
pub(super) fn forms_of(letters: &[u8]) -> impl Iterator<Item = &'static Form> + Clone {
    let rows = place_of(letters).map_or(&NO_ROWS, |place| &INDEX[place]);
    rows.iter().filter_map(|&row| FORMS.get(usize::from(row)))
}

/// The rows of [`FORMS`] with the same letters; numbers beyond the last are not rows.
type Rows = [u8; 2];

const NO_ROWS: Rows = [u8::MAX; 2];

/// The number of letters in the index.
const LETTERS: usize = 26;

/// The rows by letters: reading is only as fast as finding commands here.
static INDEX: [Rows; 2 * LETTERS * LETTERS] = index();

const fn index() -> [Rows; 2 * LETTERS * LETTERS] {
    let mut index = [NO_ROWS; 2 * LETTERS * LETTERS];
    let mut row = 0;
    while row < FORMS.len() {
        let mnemonic = FORMS[row].mnemonic.as_bytes();
        let letters = if mnemonic[0] == b'!' {
            [mnemonic[1], mnemonic[2]]
        } else {
            [mnemonic[0], mnemonic[1]]
        };
        let place = place(mnemonic[0] == b'!', letters);
        let second = (index[place][0] != u8::MAX) as usize;
        // A command with a third form would find no place, and this would not compile.
        assert!(index[place][second] == u8::MAX);
        index[place][second] = row as u8;
        row += 1;
    }
    index
}

const fn place(special: bool, [first, second]: [u8; 2]) -> usize {
    let letters = (first - b'A') as usize * LETTERS + (second - b'A') as usize;
    if special { LETTERS * LETTERS + letters } else { letters }
}

fn place_of(letters: &[u8]) -> Option<usize> {
    let (special, letters) = match letters {
        [b'!', rest @ ..] => (true, rest),
        letters => (false, letters),
    };
    let letters: [u8; 2] = letters.try_into().ok()?;
    letters.iter().all(u8::is_ascii_uppercase).then(|| place(special, letters))
}

/// Whether the command with these letters exists and takes no parameters in any form on any
/// model, so that it is complete with its last letter.
pub(super) fn is_complete(letters: &[u8]) -> bool {
    let mut forms = forms_of(letters).peekable();
    forms.peek().is_some() && !forms.any(Form::takes_parameters)
}

// What follows is the list itself, and what makes its rows short.

const BOTH: &[Dialect] = &[Smcu, MotionSystem];
const SMCU: &[Dialect] = &[Smcu];
const MOTION: &[Dialect] = &[MotionSystem];

const fn a(name: &'static str, kind: Kind) -> Parameter {
    Parameter { name, kind }
}

const X: Parameter = a("x", Kind::Coordinate);
const Y: Parameter = a("y", Kind::Coordinate);
const K: Parameter = a("k", Kind::Coordinate);
const ANGLE: Parameter = a("a", Kind::Angle);
const SPEED: Parameter = a("v", Kind::Speed);
const ACCELERATION: Parameter = a("a", Kind::Acceleration);
const RESOLUTION: Parameter = a("r", Kind::Resolution);
const TIME: Parameter = a("t", Kind::Time);
const AXIS: Parameter = a("n", Kind::Axis);
const SWITCH: Parameter = a("n", Kind::Switch);
const CHANNEL: Parameter = a("n", Kind::Channel);
const PORT: Parameter = a("a", Kind::Port);
const ARC: &[Parameter] = &[X, Y, ANGLE];
const SPACE: &[Parameter] = &[X, Y, a("z", Kind::Coordinate)];
const WINDOW: &[Parameter] = &[
    a("x0", Kind::Coordinate),
    a("y0", Kind::Coordinate),
    a("x1", Kind::Coordinate),
    a("y1", Kind::Coordinate),
];
const ALL_AXES: &[Parameter] = &[
    X,
    Y,
    a("z0", Kind::Coordinate),
    a("z1", Kind::Coordinate),
    a("z2", Kind::Coordinate),
    a("z3", Kind::Coordinate),
];
const RANGE: &[Parameter] = &[a("min", Kind::Coordinate), a("max", Kind::Coordinate), AXIS];
const DRILLING: &[Parameter] =
    &[a("td1", Kind::Time), a("td2", Kind::Time), a("td3", Kind::Time), a("td4", Kind::Time)];
const MILLING: &[Parameter] =
    &[a("tm1", Kind::Time), a("tm2", Kind::Time), a("tm3", Kind::Time), a("tm4", Kind::Time)];

/// A documented form that answers only `C`. Its chapter follows from its letters.
const fn form(
    op: Op,
    mnemonic: &'static str,
    title: &'static str,
    parameters: &'static [Parameter],
    models: &'static [Dialect],
) -> Form {
    let source = if mnemonic.as_bytes()[0] == b'!' { "Sonderbefehle" } else { "Standardbefehle" };
    Form {
        op,
        mnemonic,
        title,
        parameters,
        count: Count::Listed,
        models,
        answer: Done,
        direct: false,
        evidence: "D",
        source,
    }
}

impl Form {
    const fn repeated(mut self) -> Self {
        self.count = Count::Repeated;
        self
    }

    const fn answers(mut self, answer: Answer) -> Self {
        self.answer = answer;
        self
    }

    const fn direct(mut self) -> Self {
        self.direct = true;
        self.source = "Direkt-Befehle";
        self
    }

    const fn seen_in_the_field(mut self) -> Self {
        self.evidence = "F";
        self.source = "field";
        self
    }
}

#[rustfmt::skip]
const FORMS: &[Form] = &[
    form(Op::ArcAbsolute, "AA", "arc around absolute centre", ARC, BOTH),
    form(Op::ArcRelative, "AR", "arc around relative centre", ARC, BOTH),
    form(Op::Circle, "CI", "circle around here", &[a("r", Kind::Coordinate)], SMCU).seen_in_the_field(),
    form(Op::EdgeAbsolute, "EA", "rectangle to a place", &[X, Y], SMCU).seen_in_the_field(),
    form(Op::EdgeRelative, "ER", "rectangle by a way", &[X, Y], SMCU).seen_in_the_field(),
    form(Op::Initialize, "IN", "initialize", &[], BOTH),
    form(Op::Window, "IW", "set window", WINDOW, BOTH),
    form(Op::HardClipLimits, "OH/0", "find limits of all axes", &[], BOTH).answers(HardClip),
    form(Op::HardClipLimitsOf, "OH/1", "find limit of axis", &[AXIS], MOTION).answers(HardClip),
    form(Op::OutputStatus, "OS", "read status", &[], BOTH).answers(Status),
    form(Op::PlotAbsolute, "PA", "absolute move", &[X, Y], BOTH).repeated(),
    form(Op::PenDown, "PD", "lower head", &[], SMCU),
    form(Op::PlotRelative, "PR", "relative move", &[X, Y], BOTH).repeated(),
    form(Op::PenUp, "PU", "lift head", &[], SMCU).seen_in_the_field(),
    form(Op::PenSpeed, "VS", "set speed with head down", &[SPEED], SMCU).seen_in_the_field(),
    form(Op::AccelerationOf, "!AS/2", "set acceleration of axis", &[ACCELERATION, AXIS], MOTION),
    form(Op::Acceleration, "!AS/1", "set acceleration", &[ACCELERATION], SMCU),
    form(Op::CloseChannel, "!CC/0", "close channel", &[], BOTH),
    form(Op::CloseChannelOf, "!CC/1", "close numbered channel", &[CHANNEL], MOTION),
    form(Op::CloseInterface, "!CI", "close interface", &[], BOTH),
    form(Op::SetMode, "!CM", "set drilling or milling mode", &[a("n", Kind::Mode)], SMCU),
    form(Op::Continue, "!CS", "finish broken-off command", &[], MOTION),
    form(Op::Echo, "!CT", "switch echo mode", &[SWITCH], BOTH),
    form(Op::ExternalStop, "!ES", "enable external stop", &[SWITCH], BOTH),
    form(Op::Spindle, "!EM", "switch spindle", &[SWITCH], BOTH),
    form(Op::FullCurrent, "!FP", "full phase current", &[], SMCU),
    form(Op::GoBack, "!GB", "go back to start of broken-off command", &[], MOTION),
    form(Op::HalfCurrent, "!HP", "half phase current", &[], SMCU),
    form(Op::Reference, "!IS/0", "reference run of all axes", &[], BOTH),
    form(Op::ReferenceOf, "!IS/1", "reference run of axis", &[AXIS], MOTION),
    form(Op::MoveAllAbsolute, "!MA", "absolute move of all axes", ALL_AXES, MOTION),
    form(Op::MoveAllRelative, "!MR", "relative move of all axes", ALL_AXES, MOTION),
    form(Op::ActualPosition, "!OA", "read actual position", &[a("n", Kind::Actual)], MOTION)
        .answers(Actual),
    form(Op::OpenChannel, "!OC/0", "open channel", &[], BOTH).answers(Silence),
    form(Op::OpenChannelOf, "!OC/1", "open numbered channel", &[CHANNEL], MOTION).answers(Silence),
    form(Op::OpenInterface, "!OI", "open interface", &[a("n", Kind::Interface)], BOTH),
    form(Op::NominalPosition, "!ON", "read nominal position", &[a("n", Kind::Nominal)], BOTH)
        .answers(Nominal),
    form(Op::FollowVectors, "!PH", "follow vectors", &[a("a", Kind::Axis), a("b", Kind::Axis)], MOTION),
    form(Op::ReadPort, "!RD", "read port", &[PORT], BOTH).answers(Port),
    form(Op::RepeatBroken, "!RC", "repeat broken-off command", &[], MOTION),
    form(Op::ResolutionOf, "!RS/2", "set resolution of axis", &[RESOLUTION, AXIS], MOTION),
    form(Op::Resolution, "!RS/1", "set resolution", &[RESOLUTION], SMCU),
    form(Op::Range, "!SR", "set range of axis", RANGE, MOTION),
    form(Op::DrillingTimes, "!TD", "set times for drilling", DRILLING, SMCU),
    form(Op::MillingTimes, "!TM", "set times for milling", MILLING, SMCU),
    form(Op::SettlingTime, "!TS", "set settling time", &[TIME], BOTH),
    form(Op::Wait, "!TW", "wait", &[TIME], BOTH),
    form(Op::AxisSpeed, "!VZ/2", "set speed of axis", &[SPEED, AXIS], MOTION),
    form(Op::TravelSpeed, "!VU", "set speed with head up", &[SPEED], SMCU),
    form(Op::ZSpeed, "!VZ/1", "set speed of Z", &[SPEED], SMCU),
    form(Op::WritePort, "!WR", "write port", &[PORT, a("d", Kind::Word)], BOTH),
    form(Op::MoveAxisAbsolute, "!ZA/2", "absolute move of axis", &[K, AXIS], MOTION),
    form(Op::MoveZAbsolute, "!ZA/1", "absolute move of Z", &[K], SMCU),
    form(Op::MoveAxisRelative, "!ZR/2", "relative move of axis", &[K, AXIS], MOTION),
    form(Op::MoveZRelative, "!ZR/1", "relative move of Z", &[K], SMCU),
    form(Op::ClearBuffer, "!CB", "clear buffer", &[], BOTH).direct(),
    form(Op::GoOn, "!GO", "go on", &[], BOTH).direct(),
    form(Op::Repeat, "!RP", "repeat last command", &[], MOTION).direct(),
    form(Op::Stop, "!ST", "stop after this command", &[], BOTH).direct(),
    form(Op::SpaceAbsolute, "!TA", "absolute move in space", SPACE, BOTH).seen_in_the_field(),
    form(Op::SpaceRelative, "!TR", "relative move in space", SPACE, BOTH).seen_in_the_field(),
];
