//! The meaning of a command.
//!
//! A [`Command`] has passed the checks of its letters, of the number of its parameters and of
//! values that never fit. [`Command::check`] checks what depends on the machine; what it does is
//! the controller's business.

use serde::{Deserialize, Serialize};

use super::number::Number;
use super::table::{Form, Op};

/// An axis, by the number that parameters count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum Axis {
    /// 0.
    X,
    /// 1.
    Y,
    /// 2; the SMCU calls it Z.
    Z0,
    /// 3.
    Z1,
    /// 4.
    Z2,
    /// 5.
    Z3,
}

impl Axis {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z0, Self::Z1, Self::Z2, Self::Z3];

    /// Its number, 0 to 5.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The axis of a number, if there can be one.
    #[must_use]
    pub fn from_index(index: usize) -> Option<Self> {
        Self::ALL.get(index).copied()
    }

    /// Its name for people: `X`, `Z0`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::X => "X",
            Self::Y => "Y",
            Self::Z0 => "Z0",
            Self::Z1 => "Z1",
            Self::Z2 => "Z2",
            Self::Z3 => "Z3",
        }
    }
}

/// Which waiting times `PD` and `PU` take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// 0: those of `!TD`.
    Drilling,
    /// 1: those of `!TM`.
    Milling,
}

/// What the trackball does while it is open.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trackball {
    /// 1: moves the selected axis; its position is sent every second.
    MoveAndReport,
    /// 2: moves the selected axis.
    Move,
    /// 3: moves nothing, only its own data are sent.
    Report,
}

/// How the path of a following vector is curved.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Turn {
    /// −1: an arc in the clockwise sense.
    Clockwise,
    /// 0: not at all.
    #[default]
    Straight,
    /// 1: an arc in the counter-clockwise sense.
    Counterclockwise,
}

/// One record of `!PH`. Everything is relative to where the vector begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Vector {
    /// `X`, `Y`: the end, in steps along the two axes of the command.
    pub end: [i32; 2],
    /// `I`, `J`: the centre of the arc, in steps along the two axes; unused on a straight path.
    pub centre: [i32; 2],
    /// `F`: the speed at the end less the speed at the beginning, in µm/s.
    pub speed_change: i32,
    /// `O`: straight, or the sense of the arc.
    pub turn: Turn,
}

/// A command, understood.
///
/// Positions and ways are in steps. What the unit of a speed, an acceleration or a resolution is
/// depends on the kind of the axis, see [`Kind::unit`](super::Kind::unit). An axis of `None`
/// stands for all axes.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Command {
    /// `AA x,y,a`: an arc from here around an absolute centre.
    ArcAbsolute {
        /// X and Y of the centre, in steps.
        centre: [i32; 2],
        /// How far, in millionths of a degree; positive is counter-clockwise.
        angle: i64,
    },
    /// `AR x,y,a`: an arc from here around a centre relative to here.
    ArcRelative {
        /// X and Y of the centre, in steps from here.
        centre: [i32; 2],
        /// How far, in millionths of a degree; positive is counter-clockwise.
        angle: i64,
    },
    /// `CI r`: a circle around here.
    Circle(
        /// Its radius, in steps.
        i32,
    ),
    /// `EA x,y`: the edge of a rectangle between here and a place.
    EdgeAbsolute([i32; 2]),
    /// `ER x,y`: the edge of a rectangle between here and a place that far away.
    EdgeRelative([i32; 2]),
    /// `IN`: as after power-on.
    Initialize,
    /// `IW x0,y0,x1,y1`: the window X and Y may move in, by two corners in any order.
    Window([[i32; 2]; 2]),
    /// `OH`, `OH n`: find out how far the axes can go.
    HardClipLimits(Option<Axis>),
    /// `OS`: version, date and identity.
    OutputStatus,
    /// `PA x,y…`: move X and Y to one position after the other. At least one.
    PlotAbsolute(Vec<[i32; 2]>),
    /// `PR x,y…`: move X and Y by one way after the other. At least one.
    PlotRelative(Vec<[i32; 2]>),
    /// `PD`: lower the head.
    PenDown,
    /// `PU`: lift the head.
    PenUp,
    /// `VS v`: the speed of X and Y with the head down; see [`Number::speed`].
    PenSpeed(Number),
    /// `!AS a`, `!AS a,n`: acceleration.
    Acceleration {
        /// Of this axis.
        axis: Option<Axis>,
        /// mm/s² or mrad/s².
        acceleration: i32,
    },
    /// `!CC`, `!CC n`: close the second channel.
    CloseChannel(Option<i32>),
    /// `!CI`: close the trackball.
    CloseInterface,
    /// `!CM n`: which waiting times `PD` and `PU` take.
    SetMode(Mode),
    /// `!CS`: finish the aborted command.
    Continue,
    /// `!CT n`: echo mode on or off.
    Echo(bool),
    /// `!ES n`: enable or block the external stop.
    ExternalStop(bool),
    /// `!EM n`: spindle on or off.
    Spindle(bool),
    /// `!FP`: full phase current.
    FullCurrent,
    /// `!HP`: half the phase current.
    HalfCurrent,
    /// `!GB`: go back to the start of the aborted command.
    GoBack,
    /// `!IS`, `!IS n`: reference run.
    Reference(Option<Axis>),
    /// `!MA x,y,z0,z1,z2,z3`: move all axes to a position.
    MoveAllAbsolute([i32; 6]),
    /// `!MR x,y,z0,z1,z2,z3`: move all axes by a way.
    MoveAllRelative([i32; 6]),
    /// `!OA n`: the measured position.
    ActualPosition {
        /// Of this axis.
        axis: Option<Axis>,
        /// Whether it is that of the last trigger instead of that of now.
        triggered: bool,
    },
    /// `!OC`, `!OC n`: open the second channel.
    OpenChannel(Option<i32>),
    /// `!OI n`: open the trackball.
    OpenInterface(Trackball),
    /// `!ON n`: the nominal position.
    NominalPosition(Option<Axis>),
    /// `!PH a,b` and records: one continuous motion along many vectors.
    FollowVectors {
        /// The two axes, different ones.
        axes: [Axis; 2],
        /// One to [`VECTORS_MAX`](super::VECTORS_MAX) of them.
        vectors: Vec<Vector>,
    },
    /// `!RD a`: read a port; the upper four bits are the bank, the lower four the port.
    ReadPort(u8),
    /// `!RC`: repeat the aborted command.
    RepeatBroken,
    /// `!RS r`, `!RS r,n`: resolution, the way of one step.
    Resolution {
        /// Of this axis.
        axis: Option<Axis>,
        /// nm or thousandths of an arc second; half a nanometre a step is common.
        resolution: Number,
    },
    /// `!SR min,max,n`: how far an axis may move.
    Range {
        /// This axis.
        axis: Axis,
        /// The lowest position, in steps.
        min: i32,
        /// The highest position, in steps.
        max: i32,
    },
    /// `!TD t1,t2,t3,t4`: ms before and after lowering, before and after lifting, for drilling.
    DrillingTimes([u32; 4]),
    /// `!TM t1,t2,t3,t4`: the same for milling.
    MillingTimes([u32; 4]),
    /// `!TS t`: ms to settle after every move.
    SettlingTime(u32),
    /// `!TW t`: wait once, ms.
    Wait(u32),
    /// `!VU v`: the speed of X and Y with the head up, µm/s.
    TravelSpeed(i32),
    /// `!VZ v`: the speed of Z0, µm/s or 0.1°/s.
    ZSpeed(i32),
    /// `!VZ v,n`: the speed of an axis.
    AxisSpeed {
        /// This axis.
        axis: Axis,
        /// µm/s or 0.1°/s.
        speed: i32,
    },
    /// `!WR a,d`: write to a port.
    WritePort {
        /// The upper four bits are the bank, the lower four the port.
        port: u8,
        /// What is written.
        data: u16,
    },
    /// `!ZA k`: move Z0 to a position.
    MoveZAbsolute(i32),
    /// `!ZA k,n`: move an axis to a position.
    MoveAxisAbsolute {
        /// This axis.
        axis: Axis,
        /// The position, in steps.
        to: i32,
    },
    /// `!ZR k`: move Z0 by a way.
    MoveZRelative(i32),
    /// `!ZR k,n`: move an axis by a way.
    MoveAxisRelative {
        /// This axis.
        axis: Axis,
        /// The way, in steps.
        by: i32,
    },
    /// `!CB`: empty the buffer. Direct.
    ClearBuffer,
    /// `!GO`: go on after a stop. Direct.
    GoOn,
    /// `!RP`: repeat the last executed command. Direct.
    Repeat,
    /// `!ST`: stop when the running command has ended. Direct.
    Stop,
    /// `!TA x,y,z`: move X, Y and Z0 together to a position.
    SpaceAbsolute([i32; 3]),
    /// `!TR x,y,z`: move X, Y and Z0 together by a way.
    SpaceRelative([i32; 3]),
}

impl Command {
    /// Its form.
    #[must_use]
    pub const fn op(&self) -> Op {
        match self {
            Self::ArcAbsolute { .. } => Op::ArcAbsolute,
            Self::ArcRelative { .. } => Op::ArcRelative,
            Self::Circle(_) => Op::Circle,
            Self::EdgeAbsolute(_) => Op::EdgeAbsolute,
            Self::EdgeRelative(_) => Op::EdgeRelative,
            Self::Initialize => Op::Initialize,
            Self::Window(_) => Op::Window,
            Self::HardClipLimits(None) => Op::HardClipLimits,
            Self::HardClipLimits(Some(_)) => Op::HardClipLimitsOf,
            Self::OutputStatus => Op::OutputStatus,
            Self::PlotAbsolute(_) => Op::PlotAbsolute,
            Self::PlotRelative(_) => Op::PlotRelative,
            Self::PenDown => Op::PenDown,
            Self::PenUp => Op::PenUp,
            Self::PenSpeed(_) => Op::PenSpeed,
            Self::Acceleration { axis: None, .. } => Op::Acceleration,
            Self::Acceleration { axis: Some(_), .. } => Op::AccelerationOf,
            Self::CloseChannel(None) => Op::CloseChannel,
            Self::CloseChannel(Some(_)) => Op::CloseChannelOf,
            Self::CloseInterface => Op::CloseInterface,
            Self::SetMode(_) => Op::SetMode,
            Self::Continue => Op::Continue,
            Self::Echo(_) => Op::Echo,
            Self::ExternalStop(_) => Op::ExternalStop,
            Self::Spindle(_) => Op::Spindle,
            Self::FullCurrent => Op::FullCurrent,
            Self::HalfCurrent => Op::HalfCurrent,
            Self::GoBack => Op::GoBack,
            Self::Reference(None) => Op::Reference,
            Self::Reference(Some(_)) => Op::ReferenceOf,
            Self::MoveAllAbsolute(_) => Op::MoveAllAbsolute,
            Self::MoveAllRelative(_) => Op::MoveAllRelative,
            Self::ActualPosition { .. } => Op::ActualPosition,
            Self::OpenChannel(None) => Op::OpenChannel,
            Self::OpenChannel(Some(_)) => Op::OpenChannelOf,
            Self::OpenInterface(_) => Op::OpenInterface,
            Self::NominalPosition(_) => Op::NominalPosition,
            Self::FollowVectors { .. } => Op::FollowVectors,
            Self::ReadPort(_) => Op::ReadPort,
            Self::RepeatBroken => Op::RepeatBroken,
            Self::Resolution { axis: None, .. } => Op::Resolution,
            Self::Resolution { axis: Some(_), .. } => Op::ResolutionOf,
            Self::Range { .. } => Op::Range,
            Self::DrillingTimes(_) => Op::DrillingTimes,
            Self::MillingTimes(_) => Op::MillingTimes,
            Self::SettlingTime(_) => Op::SettlingTime,
            Self::Wait(_) => Op::Wait,
            Self::TravelSpeed(_) => Op::TravelSpeed,
            Self::ZSpeed(_) => Op::ZSpeed,
            Self::AxisSpeed { .. } => Op::AxisSpeed,
            Self::WritePort { .. } => Op::WritePort,
            Self::MoveZAbsolute(_) => Op::MoveZAbsolute,
            Self::MoveAxisAbsolute { .. } => Op::MoveAxisAbsolute,
            Self::MoveZRelative(_) => Op::MoveZRelative,
            Self::MoveAxisRelative { .. } => Op::MoveAxisRelative,
            Self::ClearBuffer => Op::ClearBuffer,
            Self::GoOn => Op::GoOn,
            Self::Repeat => Op::Repeat,
            Self::Stop => Op::Stop,
            Self::SpaceAbsolute(_) => Op::SpaceAbsolute,
            Self::SpaceRelative(_) => Op::SpaceRelative,
        }
    }

    /// Its row of the table of forms.
    #[must_use]
    pub fn form(&self) -> &'static Form {
        self.op().form()
    }

    /// Whether it bypasses the command buffer.
    #[must_use]
    pub fn is_direct(&self) -> bool {
        self.form().direct
    }
}
