//! The meaning of a line.
//!
//! A [`Command`] is what is left when a line has been split, counted, read and checked: numbers are
//! in their ranges, ports exist, speeds are within their limits. What it does depends on the state
//! of the controller and is not the business of this crate.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::axes::AxisSet;
use crate::dialect::Mode;
use crate::receive::control;
use crate::table::Op;

/// One way and its speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Pair {
    /// Steps to go, or the position to go to; −8,388,608 to 8,388,607.
    pub steps: i32,
    /// Speed in Hz (steps per second), within the limits of the model.
    pub speed: u32,
}

/// A list that must hold one to four values held none or more than four.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{0} values given: one to four are possible")]
pub struct WrongLength(pub usize);

/// One to four pairs, as a straight move has them (99 §2.2.4).
///
/// X takes one pair, X+Y two. X+Y+Z takes four, of which the last two are both Z, and so does
/// X+Y+Z+A. Any other set takes one pair for each of its axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "Vec<Pair>", into = "Vec<Pair>")]
pub struct Pairs {
    // Unused places are zero, so that derived equality compares the values only.
    values: [Pair; 4],
    count: u8,
}

impl Pairs {
    /// These pairs; `None` unless there are one to four.
    #[must_use]
    pub fn new(pairs: &[Pair]) -> Option<Self> {
        let (values, count) = up_to_four(pairs)?;
        Some(Self { values, count })
    }

    /// The pairs, in the order of the line.
    #[must_use]
    pub fn as_slice(&self) -> &[Pair] {
        &self.values[..usize::from(self.count)]
    }
}

impl TryFrom<Vec<Pair>> for Pairs {
    type Error = WrongLength;

    fn try_from(pairs: Vec<Pair>) -> Result<Self, WrongLength> {
        Self::new(&pairs).ok_or(WrongLength(pairs.len()))
    }
}

impl From<Pairs> for Vec<Pair> {
    fn from(pairs: Pairs) -> Self {
        pairs.as_slice().to_vec()
    }
}

/// One to four reference speeds in Hz (99 §2.2.3).
///
/// Either one for each configured axis, in the order X, Y, Z, A, or four, one for each possible
/// axis. Of four, those for axes that are not configured mean nothing and are 0 here, regardless of
/// the line. [`Speeds::of`] tells them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "Vec<u32>", into = "Vec<u32>")]
pub struct Speeds {
    // Unused places are zero, so that derived equality compares the values only.
    values: [u32; 4],
    count: u8,
}

impl Speeds {
    /// These speeds; `None` unless there are one to four.
    #[must_use]
    pub fn new(speeds: &[u32]) -> Option<Self> {
        let (values, count) = up_to_four(speeds)?;
        Some(Self { values, count })
    }

    /// The speeds, in the order of the line.
    #[must_use]
    pub fn as_slice(&self) -> &[u32] {
        &self.values[..usize::from(self.count)]
    }

    /// The speed given for an axis (0 X … 3 A) when `axes` are configured; `None` for an axis
    /// that is not configured.
    #[must_use]
    pub fn of(&self, axis: usize, axes: AxisSet) -> Option<u32> {
        if !axes.has(axis) {
            return None;
        }
        let place = if self.count == 4 { axis } else { axes.iter().position(|a| a == axis)? };
        self.as_slice().get(place).copied()
    }
}

impl TryFrom<Vec<u32>> for Speeds {
    type Error = WrongLength;

    fn try_from(speeds: Vec<u32>) -> Result<Self, WrongLength> {
        Self::new(&speeds).ok_or(WrongLength(speeds.len()))
    }
}

impl From<Speeds> for Vec<u32> {
    fn from(speeds: Speeds) -> Self {
        speeds.as_slice().to_vec()
    }
}

/// Copies one to four values into an array, with their number.
fn up_to_four<T: Copy + Default>(values: &[T]) -> Option<([T; 4], u8)> {
    let count = u8::try_from(values.len()).ok().filter(|&count| count > 0)?;
    let mut array = [T::default(); 4];
    array.get_mut(..values.len())?.copy_from_slice(values);
    Some((array, count))
}

/// The plane of circles (99 §2.2.9).
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Plane {
    /// `e0`, the default.
    #[default]
    Xy,
    /// `e1`.
    Xz,
    /// `e2`.
    Yz,
}

impl Plane {
    /// The indices of its first and second axis.
    #[must_use]
    pub const fn axes(self) -> (usize, usize) {
        match self {
            Self::Xy => (0, 1),
            Self::Xz => (0, 2),
            Self::Yz => (1, 2),
        }
    }

    /// The index of the axis that is not in it: the third axis of a helix.
    #[must_use]
    pub const fn third(self) -> usize {
        match self {
            Self::Xy => 2,
            Self::Xz => 1,
            Self::Yz => 0,
        }
    }
}

/// The direction of circles (99 §2.2.10).
///
/// It is stored, but the travel follows Rx and Ry alone.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// `f0`, and `f1` too; the default.
    #[default]
    Clockwise,
    /// `f-1`.
    Counterclockwise,
}

/// The parameters of a circle (99 §2.2.11, §2.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ArcArgs {
    /// B: the length of the arc in single-axis steps, 0 to 8,388,607.
    pub steps: u32,
    /// V: the speed in Hz.
    pub speed: u32,
    /// D: what the difference register starts with, 24 bits.
    pub d: i32,
    /// Xs: the start relative to the centre, first axis of the plane, in steps, 24 bits.
    pub x: i32,
    /// Ys: the start relative to the centre, second axis of the plane, in steps, 24 bits.
    pub y: i32,
    /// Rx: the direction of the first axis at the start, −1 or 1.
    pub rx: i8,
    /// Ry: the direction of the second axis at the start, −1 or 1.
    pub ry: i8,
}

/// A port, a mask and a value, each 0 to 255 but the port (12 §2.2.30, §4.2.11 to 4.2.14).
///
/// As a condition it is met when `(port & mask) == (value & mask)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct PortTest {
    /// The number of the port.
    pub port: u16,
    /// The bits that count.
    pub mask: u8,
    /// What they are compared with.
    pub value: u8,
}

/// A bit of a port, or all of it (99 §3.2.12, §3.2.13).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bit {
    /// The bit with this number, 0 to 7.
    One(u8),
    /// The whole byte; 128 on the line.
    Byte,
}

/// A port, a bit of it, and a value to write or to compare with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct BitTest {
    /// The number of the port.
    pub port: u16,
    /// The bit. On a logical port every bit is its one bit.
    pub bit: Bit,
    /// 0 or 1 for one bit, 0 to 255 for the byte; 0 or 1 for all of a logical port.
    pub value: u8,
}

/// Up to 32 bytes of text, exactly as they were sent (12 §4.2.16).
///
/// Bytes that no line can carry (CR, LF and the control bytes 253 to 255) cannot be in it, so
/// that every text can be printed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "Vec<u8>", into = "Vec<u8>")]
pub struct Text32(Vec<u8>);

/// A text that `IU` cannot set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a text has at most 32 bytes, none of them CR, LF or 253 to 255")]
pub struct WrongText;

impl Text32 {
    /// The longest text, in bytes.
    pub const MAX: usize = 32;

    /// This text; `None` if it is longer than 32 bytes or has a byte that no line can carry.
    #[must_use]
    pub fn new(text: &[u8]) -> Option<Self> {
        let carried = |&byte: &u8| !matches!(byte, b'\r' | b'\n') && control(byte).is_none();
        (text.len() <= Self::MAX && text.iter().all(carried)).then(|| Self(text.to_vec()))
    }

    /// The bytes.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }
}

impl TryFrom<Vec<u8>> for Text32 {
    type Error = WrongText;

    fn try_from(text: Vec<u8>) -> Result<Self, WrongText> {
        Self::new(&text).ok_or(WrongText)
    }
}

impl From<Text32> for Vec<u8> {
    fn from(text: Text32) -> Self {
        text.0
    }
}

/// The commands that begin with `I` (99 §2.2.18, 05 §2.2.18, 12 §4).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Init {
    /// `ID`: axes whose direction is inverted.
    Directions(AxisSet),
    /// `IR`: axes whose reference run goes the other way.
    References(AxisSet),
    /// `IS`: the internal hardware status byte, 0 to 255 (99, 05); bit 0 lets the cover be opened.
    HardwareStatus(u8),
    /// `IL` of the imc4-m: rotary axes.
    RotaryL(AxisSet),
    /// `Id`: reference speeds of X, Y, Z, A after power-on, in Hz.
    DefaultSpeeds([u32; 4]),
    /// `IF`: steps away from the reference switch for X, Y, Z, A, each 0 to 8,388,607.
    FreeSteps([i32; 4]),
    /// `IJ`: acceleration after power-on, 1 to 4000 Hz/ms.
    DefaultAcceleration(u32),
    /// `Ij`: start-stop frequency after power-on, 20 to 4000 Hz.
    DefaultStartStop(u32),
    /// `IO`: whether only the ports are used.
    IoOnly(bool),
    /// `IE`: which limit switches are enabled, and their levels; one nibble for each axis.
    Limits(u16),
    /// `Ie`: axes whose two limit switches are swapped.
    SwapLimits(AxisSet),
    /// `IT`: axes that are rotary.
    AxisTypes(AxisSet),
    /// `IA`: the input whose mismatch ends a program.
    Abort(PortTest),
    /// `Ia`: the output that shows an error.
    ErrorSignal(PortTest),
    /// `IH`: the input whose mismatch counts as an open cover.
    Cover(PortTest),
    /// `IN`: the input whose mismatch counts as an emergency stop.
    Emergency(PortTest),
    /// `IC`: 9600 baud instead of 19200, after `IW` and a reset.
    Baud9600(bool),
    /// `IU`: the text that `U` shows.
    UserInfo(Text32),
    /// `IL` of the iMC-xx: loads the values from the flash.
    Load,
    /// `IW`: writes the values to the flash.
    Write,
    /// `IX`: restores the factory's values, in memory only.
    Factory,
}

/// What a line asks for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Command {
    /// `@07`: configures axes and initialises the controller again.
    SetAxes(AxisSet),
    /// `@0A`, stored `0`: moves by this many steps.
    RelativeMove(Pairs),
    /// `@0M`, stored `m`: moves to a position.
    AbsoluteMove(Pairs),
    /// `@0b`: reads a port.
    ReadPort(u16),
    /// `@0B`: writes a port.
    WritePort {
        /// The number of the port.
        port: u16,
        /// What is written to it.
        value: u8,
    },
    /// `@0d`, stored `d`: speeds of reference runs.
    ReferenceSpeeds(Speeds),
    /// `@0D`: diagnosis; the two characters of its code.
    Diagnosis([u8; 2]),
    /// `@0e`, stored `e`: the plane of circles.
    Plane(Plane),
    /// `@0f`, stored `f`: the direction of circles.
    Direction(Direction),
    /// `@0F`: leaves an active limit switch; exactly one axis.
    Free(AxisSet),
    /// `@0g`, stored `g`: energises (opens) the brake or not.
    Brake(bool),
    /// `@0G`: the number the controller is addressed with, 0 to 9.
    DeviceNumber(u8),
    /// `@0h`: shows the limit switches.
    LimitStatus,
    /// `@0H`: shows the state of the controller.
    Status,
    /// `@0i`: begins to store a data field.
    Store,
    /// `@0I…`: sets a parameter.
    Init(Init),
    /// `@0j`, stored `j`: start-stop frequency in Hz, 20 to 4000.
    StartStop(u32),
    /// `@0J`, stored `J`: acceleration in Hz/ms, 1 to 4000.
    Acceleration(u32),
    /// `@0k`: erases the stored program.
    Erase,
    /// `@0n`, stored `n`: makes the current point the zero of absolute moves.
    Zero(AxisSet),
    /// `@0N`, stored `N`: makes the current point the reference point.
    SimulateReference(AxisSet),
    /// `@0P`: reads the position.
    Position,
    /// `@0R`, stored `7`: drives to the reference switches.
    Reference(AxisSet),
    /// `@0S`: finishes a stopped motion; on the iMC-xx also runs the stored program.
    Start,
    /// `@0T`, stored `T`: test mode.
    TestMode(bool),
    /// `@0U`: shows the user's text.
    UserInfo,
    /// `@0V`, on the iMC-xx also `@0?`: shows the version.
    Version,
    /// `@0?` of the imc4 and the imc4-m: self-test.
    SelfTest,
    /// `@0w`, stored `w`: a circle while the third axis makes this many steps (24 bits).
    Helix(ArcArgs, i32),
    /// `@0y`, stored `y`: a circle or a part of one.
    Circle(ArcArgs),
    /// `@0z`, stored `z`: all axes interpolated together or not.
    Interpolation3d(bool),
    /// `@0Z`: a relative move of all axes together that ends when a port has a value.
    MoveUntil {
        /// The condition that ends it.
        test: PortTest,
        /// The speed in Hz.
        speed: u32,
        /// Steps for each configured axis in the order X, Y, Z, A, 24 bits; unused places are 0.
        steps: [i32; 4],
        /// How many of them there are: as many as axes are configured, 1 to 4.
        count: u8,
    },

    /// `1`: sends a character, 33 to 126.
    SendSync(u8),
    /// `2`: waits for a character and jumps if it is this one.
    AwaitSync {
        /// The character, 33 to 126.
        character: u8,
        /// How far to jump, in lines, from the line **after** this one.
        offset: i32,
    },
    /// `3` with a count: repeats the block before it.
    Loop {
        /// How often, 1 to 32,767.
        count: u16,
        /// Where the block begins, −32,768 to −1 lines from this one.
        offset: i32,
    },
    /// `3` without a count: jumps.
    Branch {
        /// How far, −32,768 to 32,767 lines from this one.
        offset: i32,
    },
    /// `5`: waits.
    Delay {
        /// How long in tenths of a second, 0 to 8,388,607.
        tenths: u32,
    },
    /// `6`: the condition that ends the next move.
    Until(BitTest),
    /// `p`: sets a port or a bit of it.
    SetPort(BitTest),
    /// `o`: jumps if a port or a bit of it has a value.
    BranchIf {
        /// The condition.
        test: BitTest,
        /// How far, −32,768 to 32,767 lines from the line **after** this one.
        offset: i32,
    },
    /// `9`: ends the data field.
    End,
}

impl Command {
    /// The operation it is, under which the tables list it.
    ///
    /// An operation has one [`Op`] in both modes, so `mode` makes no difference today. It is
    /// asked for because only both together name a row of a table.
    #[must_use]
    pub const fn op(&self, _mode: Mode) -> Op {
        match self {
            Self::SetAxes(_) => Op::SetAxes,
            Self::RelativeMove(_) => Op::RelativeMove,
            Self::AbsoluteMove(_) => Op::AbsoluteMove,
            Self::ReadPort(_) => Op::ReadPort,
            Self::WritePort { .. } => Op::WritePort,
            Self::ReferenceSpeeds(_) => Op::ReferenceSpeeds,
            Self::Diagnosis(_) => Op::Diagnosis,
            Self::Plane(_) => Op::Plane,
            Self::Direction(_) => Op::Direction,
            Self::Free(_) => Op::Free,
            Self::Brake(_) => Op::Brake,
            Self::DeviceNumber(_) => Op::DeviceNumber,
            Self::LimitStatus => Op::LimitStatus,
            Self::Status => Op::Status,
            Self::Store => Op::Store,
            Self::Init(init) => init.op(),
            Self::StartStop(_) => Op::StartStop,
            Self::Acceleration(_) => Op::Acceleration,
            Self::Erase => Op::Erase,
            Self::Zero(_) => Op::Zero,
            Self::SimulateReference(_) => Op::SimulateReference,
            Self::Position => Op::Position,
            Self::Reference(_) => Op::Reference,
            Self::Start => Op::Start,
            Self::TestMode(_) => Op::TestMode,
            Self::UserInfo => Op::UserInfo,
            Self::Version => Op::Version,
            Self::SelfTest => Op::SelfTest,
            Self::Helix(..) => Op::Helix,
            Self::Circle(_) => Op::Circle,
            Self::Interpolation3d(_) => Op::Interpolation3d,
            Self::MoveUntil { .. } => Op::MoveUntil,
            Self::SendSync(_) => Op::SendSync,
            Self::AwaitSync { .. } => Op::AwaitSync,
            Self::Loop { .. } | Self::Branch { .. } => Op::Loop,
            Self::Delay { .. } => Op::Delay,
            Self::Until(_) => Op::Until,
            Self::SetPort(_) => Op::SetPort,
            Self::BranchIf { .. } => Op::BranchIf,
            Self::End => Op::End,
        }
    }
}

impl Init {
    /// The operation it is.
    const fn op(&self) -> Op {
        match self {
            Self::Directions(_) => Op::InitDirections,
            Self::References(_) => Op::InitReferences,
            Self::HardwareStatus(_) => Op::InitHardwareStatus,
            Self::RotaryL(_) => Op::InitRotaryL,
            Self::DefaultSpeeds(_) => Op::InitDefaultSpeeds,
            Self::FreeSteps(_) => Op::InitFreeSteps,
            Self::DefaultAcceleration(_) => Op::InitDefaultAcceleration,
            Self::DefaultStartStop(_) => Op::InitDefaultStartStop,
            Self::IoOnly(_) => Op::InitIoOnly,
            Self::Limits(_) => Op::InitLimits,
            Self::SwapLimits(_) => Op::InitSwapLimits,
            Self::AxisTypes(_) => Op::InitAxisTypes,
            Self::Abort(_) => Op::InitAbort,
            Self::ErrorSignal(_) => Op::InitErrorSignal,
            Self::Cover(_) => Op::InitCover,
            Self::Emergency(_) => Op::InitEmergency,
            Self::Baud9600(_) => Op::InitBaud9600,
            Self::UserInfo(_) => Op::InitUserInfo,
            Self::Load => Op::InitLoad,
            Self::Write => Op::InitWrite,
            Self::Factory => Op::InitFactory,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_have_one_to_four_elements() {
        let pair = Pair { steps: 1, speed: 900 };
        for count in 0..=6 {
            let right = (1..=4).contains(&count);
            let pairs = vec![pair; count];
            assert_eq!(Pairs::new(&pairs).map(Vec::from), right.then(|| pairs.clone()));
            assert_eq!(Pairs::try_from(pairs).is_ok(), right);
            let speeds = vec![900; count];
            assert_eq!(Speeds::new(&speeds).map(Vec::from), right.then(|| speeds.clone()));
            assert_eq!(Speeds::try_from(speeds).is_ok(), right);
        }
        assert_eq!(Pairs::new(&vec![pair; 1000]), None);
    }

    #[test]
    fn a_text_is_short_and_fits_a_line() {
        assert_eq!(Text32::new(b"a, b").unwrap().as_bytes(), b"a, b");
        assert!(Text32::new(&[b'x'; 32]).is_some());
        assert!(Text32::new(&[b'x'; 33]).is_none());
        for byte in 0..=u8::MAX {
            let carried = !matches!(byte, b'\r' | b'\n' | 253..=255);
            assert_eq!(Text32::try_from(vec![byte]).is_ok(), carried, "{byte}");
        }
    }

    #[test]
    fn a_plane_has_two_axes_and_the_helix_the_third() {
        for (plane, axes, third) in
            [(Plane::Xy, (0, 1), 2), (Plane::Xz, (0, 2), 1), (Plane::Yz, (1, 2), 0)]
        {
            assert_eq!((plane.axes(), plane.third()), (axes, third));
        }
    }
}
