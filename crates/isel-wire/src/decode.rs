//! From fields to a [`Command`]: counting, reading, checking.
//!
//! When several things are wrong, the first of a fixed order answers: the number of parameters
//! (`7`), then numbers that cannot be read or are out of range (`1`), then speeds (`D`), then
//! sets of axes (`3`). That order holds over the whole line, not field by field, so every
//! command reads all its fields before it looks at a speed.

use std::ops::RangeInclusive;

use crate::axes::AxisSet;
use crate::command::{
    ArcArgs, Bit, BitTest, Command, Direction, Init, Pair, Pairs, Plane, PortTest, Speeds, Text32,
};
use crate::dialect::Fractions;
use crate::fault::{Fault, WrongAxes, WrongNumber};
use crate::frame::Frame;
use crate::number::{self, LONG_MAX, LONG_MIN};
use crate::table::Op;

/// What must be known to decode a line.
#[derive(Clone)]
pub struct Context<'a> {
    /// The configured axes.
    pub axes: AxisSet,
    /// The limits of speeds in Hz.
    pub speeds: RangeInclusive<u32>,
    /// How numbers with a decimal point are treated.
    pub fractions: Fractions,
    /// The ports of the model.
    pub ports: &'a dyn PortMap,
    /// Whether command `6` counts bits from 1 to 8 instead of 0 to 7; 12 §3.2.7 says both.
    pub bit_base_one: bool,
    /// Whether a single bit of a port may be given every value of a byte, of which 0 clears it and
    /// any other sets it, as the tables of 99 §3.2.12 have it; otherwise 0 and 1 only.
    pub any_bit_value: bool,
    /// Whether `@0<n>` takes every set of X, Y and Z; else these axes come one after the other, X,
    /// X+Y, X+Y+Z (99 §2.2.1).
    pub any_axes: bool,
    /// Whether `@02` sets X and Y; else, if it is a set at all, Y.
    pub two_is_xy: bool,
    /// Whether 0 is a speed for an axis of a straight move that stays where it is. Of an absolute
    /// move only the position tells which do, so there every speed may be 0.
    pub zero_at_rest: bool,
    /// The number, from 0, of the line of the data field that is being stored, to detect jumps to
    /// before its beginning; `None` if it does not matter.
    pub line: Option<u32>,
}

/// Which ports a model has (99 §2.2.13, §2.2.14; 05 the same; 12 §2.2.3, §2.2.4).
pub trait PortMap {
    /// Whether the port can be read.
    fn reads(&self, port: u16) -> bool;

    /// Whether the port can be written and takes this value. Every port that can be written
    /// takes 0.
    fn writes(&self, port: u16, value: u16) -> bool;

    /// Whether what is **read** from the port is one bit, 0 or 1, which every bit number (0 to
    /// 7 and 128) means.
    ///
    /// For writing this does not matter: [`PortMap::writes`] says which values the port takes as a
    /// whole, and a single bit is 0 or 1 anyway. On the iMC-xx a number such as 2 is eight bits to
    /// read and one bit to write.
    fn is_logical(&self, port: u16) -> bool;
}

/// The start-stop frequencies there are, in Hz (12 §2.2.15).
const START_STOP: RangeInclusive<u32> = 20..=4000;
/// The accelerations there are, in Hz/ms (12 §2.2.16).
const ACCELERATION: RangeInclusive<i64> = 1..=4000;
/// The offsets there are, in lines (99 §3.2.10).
const OFFSET: RangeInclusive<i64> = -32_768..=32_767;
/// The loop counts there are (99 §3.2.10).
const LOOP_COUNT: RangeInclusive<i64> = 1..=32_767;
/// The characters that can be sent and awaited: visible ASCII (12 §3.2.3).
const CHARACTER: RangeInclusive<i64> = 33..=126;
/// The number that stands for the whole byte where a bit number is expected (99 §3.2.12).
pub(crate) const WHOLE_BYTE: u8 = 128;

/// The most fields a command has: `w`, and `Z` and straight moves with four axes.
const FIELDS_MAX: usize = 8;

impl Frame<'_> {
    /// Whether the number of fields is right while these axes are configured.
    ///
    /// # Errors
    ///
    /// [`Fault::Count`], or [`Fault::CountWithoutAxes`].
    pub fn check_count(&self, axes: AxisSet) -> Result<(), Fault> {
        let (right, or) = self.spec().fields.counts(axes).ok_or(Fault::CountWithoutAxes)?;
        match self.field_count() {
            count if count == right || count == or => Ok(()),
            _ => Err(Fault::Count { right: right as u8, or: or as u8 }),
        }
    }

    /// Reads the whole line.
    ///
    /// # Errors
    ///
    /// The first that applies: of those of [`check_count`](Self::check_count), then those that
    /// answer `1`, `D` and `3`.
    pub fn decode(&self, ctx: &Context<'_>) -> Result<Command, Fault> {
        self.check_count(ctx.axes)?;
        let values = Values::read(self, ctx)?;
        let v = &values;
        Ok(match self.op() {
            Op::SetAxes => Command::SetAxes(match v.raw(0) {
                bits @ (1 | 3 | 7 | 8) => axis_set(bits).ok_or(NO_CONFIGURATION)?,
                2 if ctx.two_is_xy => axis_set(0b11).ok_or(NO_CONFIGURATION)?,
                bits @ 1..=8 if ctx.any_axes => axis_set(bits).ok_or(NO_CONFIGURATION)?,
                _ => return Err(NO_CONFIGURATION),
            }),
            Op::RelativeMove => Command::RelativeMove(v.pairs(|steps| steps == 0)?),
            Op::AbsoluteMove => Command::AbsoluteMove(v.pairs(|_| true)?),
            Op::ReadPort => Command::ReadPort(v.readable(0)?),
            Op::WritePort => {
                let (port, value) = v.writable(0, 1)?;
                Command::WritePort { port, value }
            }
            Op::ReferenceSpeeds => Command::ReferenceSpeeds(v.reference_speeds()?),
            Op::Diagnosis => {
                Command::Diagnosis(<[u8; 2]>::try_from(self.text()).map_err(|_| Fault::NoCommand)?)
            }
            Op::Plane => Command::Plane(match v.raw(0) {
                0 => Plane::Xy,
                1 => Plane::Xz,
                2 => Plane::Yz,
                _ => return Err(outside(0, 0..=2)),
            }),
            Op::Direction => Command::Direction(match v.raw(0) {
                -1 => Direction::Counterclockwise,
                0 | 1 => Direction::Clockwise,
                _ => return Err(Fault::number(0, WrongNumber::NoSign { zero: true })),
            }),
            Op::Free => {
                let axes = v.configured(0)?;
                if axes.count() != 1 {
                    return Err(Fault::Axes { field: 0, wrong: WrongAxes::NotSingle });
                }
                Command::Free(axes)
            }
            Op::Brake => Command::Brake(v.switch(0)?),
            Op::DeviceNumber => Command::DeviceNumber(v.within(0, 0..=9)?),
            Op::LimitStatus => Command::LimitStatus,
            Op::Status => Command::Status,
            Op::Store => Command::Store,
            Op::StartStop => Command::StartStop(v.start_stop()?),
            Op::Acceleration => Command::Acceleration(v.within(0, ACCELERATION)?),
            Op::Erase => Command::Erase,
            Op::Zero => Command::Zero(v.configured(0)?),
            Op::SimulateReference => Command::SimulateReference(v.configured(0)?),
            Op::Position => Command::Position,
            Op::Reference => Command::Reference(v.configured(0)?),
            Op::Start => Command::Start,
            Op::TestMode => Command::TestMode(v.switch(0)?),
            Op::UserInfo => Command::UserInfo,
            Op::Version => Command::Version,
            Op::SelfTest => Command::SelfTest,
            Op::Helix => {
                let (steps, third) = (v.long(0)?, v.long(7)?);
                if steps == 0 && third != 0 {
                    return Err(Fault::number(7, WrongNumber::HelixWithoutArc));
                }
                Command::Helix(v.arc()?, third)
            }
            Op::Circle => Command::Circle(v.arc()?),
            Op::Interpolation3d => Command::Interpolation3d(v.switch(0)?),
            Op::MoveUntil => v.move_until()?,
            Op::SendSync => Command::SendSync(v.within(0, CHARACTER)?),
            Op::AwaitSync => {
                let character = v.within(0, CHARACTER)?;
                Command::AwaitSync { character, offset: v.jump(1, 1)? }
            }
            Op::Loop => v.repeat()?,
            Op::Delay => Command::Delay { tenths: v.within(0, 0..=i64::from(LONG_MAX))? },
            Op::Until => Command::Until(v.until()?),
            Op::SetPort => Command::SetPort(v.set_port()?),
            Op::BranchIf => Command::BranchIf { test: v.branch_test()?, offset: v.jump(3, 1)? },
            Op::End => Command::End,
            init => Command::Init(self.decode_init(init, v)?),
        })
    }

    /// The commands that begin with `I`.
    fn decode_init(&self, op: Op, v: &Values<'_>) -> Result<Init, Fault> {
        Ok(match op {
            Op::InitDirections => Init::Directions(v.mask()?),
            Op::InitReferences => Init::References(v.mask()?),
            Op::InitHardwareStatus => Init::HardwareStatus(v.byte(0)?),
            Op::InitRotaryL => Init::RotaryL(v.mask()?),
            Op::InitDefaultSpeeds => {
                for index in 0..4 {
                    v.long(index)?;
                }
                Init::DefaultSpeeds([v.speed(0)?, v.speed(1)?, v.speed(2)?, v.speed(3)?])
            }
            Op::InitFreeSteps => {
                let steps = |index| v.within(index, 0..=i64::from(LONG_MAX));
                Init::FreeSteps([steps(0)?, steps(1)?, steps(2)?, steps(3)?])
            }
            Op::InitDefaultAcceleration => Init::DefaultAcceleration(v.within(0, ACCELERATION)?),
            Op::InitDefaultStartStop => Init::DefaultStartStop(v.start_stop()?),
            Op::InitIoOnly => Init::IoOnly(v.switch(0)?),
            Op::InitLimits => Init::Limits(v.within(0, 0..=65_535)?),
            Op::InitSwapLimits => Init::SwapLimits(v.mask()?),
            Op::InitAxisTypes => Init::AxisTypes(v.mask()?),
            Op::InitAbort => Init::Abort(v.port_test()?),
            Op::InitErrorSignal => {
                let port = v.port(0)?;
                v.require(v.ctx.ports.writes(port, 0), 0, WrongNumber::NotWritable)?;
                Init::ErrorSignal(PortTest { port, mask: v.byte(1)?, value: v.byte(2)? })
            }
            Op::InitCover => Init::Cover(v.port_test()?),
            Op::InitEmergency => Init::Emergency(v.port_test()?),
            Op::InitBaud9600 => Init::Baud9600(v.switch(0)?),
            Op::InitUserInfo => Init::UserInfo(Text32::new(self.text()).ok_or(Fault::Text)?),
            Op::InitLoad => Init::Load,
            Op::InitWrite => Init::Write,
            Op::InitFactory => Init::Factory,
            // `decode` handles everything that does not begin with `I`.
            _ => return Err(Fault::NoCommand),
        })
    }
}

/// The numbers of a line, all readable, and what their ranges depend on.
struct Values<'a> {
    ctx: &'a Context<'a>,
    numbers: [i64; FIELDS_MAX],
    count: usize,
}

impl<'a> Values<'a> {
    /// Reads every field; `1` if one of them is not a number.
    fn read(frame: &Frame<'_>, ctx: &'a Context<'a>) -> Result<Self, Fault> {
        let mut numbers = [0; FIELDS_MAX];
        for (index, (place, field)) in numbers.iter_mut().zip(frame.fields()).enumerate() {
            *place = number::read(field, ctx.fractions).ok_or_else(|| {
                let is_fraction = number::read(field, Fractions::Truncate).is_some();
                let wrong =
                    if is_fraction { WrongNumber::Fraction } else { WrongNumber::Unreadable };
                Fault::number(index, wrong)
            })?;
        }
        Ok(Self { ctx, numbers, count: frame.field_count() })
    }

    /// The number as it is.
    fn raw(&self, index: usize) -> i64 {
        self.numbers.get(index).copied().unwrap_or_default()
    }

    fn require(&self, right: bool, field: usize, wrong: WrongNumber) -> Result<(), Fault> {
        if right { Ok(()) } else { Err(Fault::number(field, wrong)) }
    }

    /// A number in a range.
    fn within<T: TryFrom<i64>>(
        &self,
        index: usize,
        range: RangeInclusive<i64>,
    ) -> Result<T, Fault> {
        let number = Some(self.raw(index)).filter(|number| range.contains(number));
        number.and_then(|number| T::try_from(number).ok()).ok_or_else(|| outside(index, range))
    }

    /// A number in the default range.
    fn long(&self, index: usize) -> Result<i32, Fault> {
        self.within(index, i64::from(LONG_MIN)..=i64::from(LONG_MAX))
    }

    fn byte(&self, index: usize) -> Result<u8, Fault> {
        self.within(index, 0..=255)
    }

    /// 0 or 1.
    fn switch(&self, index: usize) -> Result<bool, Fault> {
        Ok(self.within::<u8>(index, 0..=1)? == 1)
    }

    /// A number that is a speed. All numbers of the line must have been checked before.
    fn speed(&self, index: usize) -> Result<u32, Fault> {
        self.speed_in(index, &self.ctx.speeds)
    }

    fn speed_in(&self, index: usize, limits: &RangeInclusive<u32>) -> Result<u32, Fault> {
        let speed = u32::try_from(self.long(index)?).ok().filter(|speed| limits.contains(speed));
        let (low, high) = (*limits.start(), *limits.end());
        speed.ok_or(Fault::Speed { field: index as u8, low, high })
    }

    /// The start-stop frequency: a speed with limits of its own.
    fn start_stop(&self) -> Result<u32, Fault> {
        self.speed_in(0, &START_STOP)
    }

    /// The axes of `R`, `7`, `n`, `N`, `F`: X, Y and Z together or A alone, all configured.
    fn configured(&self, index: usize) -> Result<AxisSet, Fault> {
        let wrong = |wrong| Fault::Axes { field: index as u8, wrong };
        let axes = Some(self.raw(index)).filter(|bits| matches!(bits, 1..=8)).and_then(axis_set);
        let axes = axes.ok_or(wrong(WrongAxes::NoSet))?;
        match axes.without(self.ctx.axes) {
            AxisSet::NONE => Ok(axes),
            missing => Err(wrong(WrongAxes::NotConfigured(missing))),
        }
    }

    /// A bit for each of the four axes, configured or not.
    fn mask(&self) -> Result<AxisSet, Fault> {
        axis_set(self.raw(0)).ok_or_else(|| outside(0, 0..=i64::from(AxisSet::ALL.bits())))
    }

    /// One to four ways with their speeds. `rests` says for which steps the axis may stay where it
    /// is.
    fn pairs(&self, rests: impl Fn(i32) -> bool) -> Result<Pairs, Fault> {
        let count = (self.count / 2).min(4);
        for index in 0..2 * count {
            self.long(index)?;
        }
        let mut pairs = [Pair::default(); 4];
        for (place, pair) in pairs.iter_mut().enumerate().take(count) {
            let steps = self.long(2 * place)?;
            let speed = match self.raw(2 * place + 1) {
                0 if self.ctx.zero_at_rest && rests(steps) => 0,
                _ => self.speed(2 * place + 1)?,
            };
            *pair = Pair { steps, speed };
        }
        Pairs::new(&pairs[..count]).ok_or(Fault::CountWithoutAxes)
    }

    /// One speed for each configured axis, or four, of which only those of configured axes
    /// count.
    fn reference_speeds(&self) -> Result<Speeds, Fault> {
        let count = self.count.min(4);
        let counts = |index: &usize| count < 4 || self.ctx.axes.has(*index);
        for index in (0..count).filter(counts) {
            self.long(index)?;
        }
        let mut speeds = [0; 4];
        for index in (0..count).filter(counts) {
            speeds[index] = self.speed(index)?;
        }
        Speeds::new(&speeds[..count]).ok_or(Fault::CountWithoutAxes)
    }

    fn port(&self, index: usize) -> Result<u16, Fault> {
        self.within(index, 0..=65_535)
    }

    fn readable(&self, index: usize) -> Result<u16, Fault> {
        let port = self.port(index)?;
        self.require(self.ctx.ports.reads(port), index, WrongNumber::NotReadable)?;
        Ok(port)
    }

    /// A port and a value that can be written to it.
    fn writable(&self, port: usize, value: usize) -> Result<(u16, u8), Fault> {
        let written = (self.port(port)?, self.byte(value)?);
        self.require_writable((port, written.0), (value, written.1))?;
        Ok(written)
    }

    /// Checks that a port takes a value; each of them comes with its field.
    fn require_writable(
        &self,
        (port_field, port): (usize, u16),
        (value_field, value): (usize, u8),
    ) -> Result<(), Fault> {
        let takes = |value| self.ctx.ports.writes(port, u16::from(value));
        let field = if takes(0) { value_field } else { port_field };
        self.require(takes(value), field, WrongNumber::NotWritable)
    }

    /// Port, mask and value at the beginning of the line.
    fn port_test(&self) -> Result<PortTest, Fault> {
        Ok(PortTest { port: self.readable(0)?, mask: self.byte(1)?, value: self.byte(2)? })
    }

    fn move_until(&self) -> Result<Command, Fault> {
        let test = self.port_test()?;
        let count = self.ctx.axes.count();
        let mut steps = [0; 4];
        for (place, steps) in steps.iter_mut().enumerate().take(count) {
            *steps = self.long(4 + place)?;
        }
        let count = u8::try_from(count).map_err(|_| Fault::CountWithoutAxes)?;
        Ok(Command::MoveUntil { test, speed: self.speed(3)?, steps, count })
    }

    /// The seven parameters of a circle.
    fn arc(&self) -> Result<ArcArgs, Fault> {
        let steps = self.within(0, 0..=i64::from(LONG_MAX))?;
        self.long(1)?;
        let (d, x, y) = (self.long(2)?, self.long(3)?, self.long(4)?);
        let (rx, ry) = (self.sign(5)?, self.sign(6)?);
        Ok(ArcArgs { steps, speed: self.speed(1)?, d, x, y, rx, ry })
    }

    /// −1 or 1.
    fn sign(&self, index: usize) -> Result<i8, Fault> {
        match self.raw(index) {
            -1 => Ok(-1),
            1 => Ok(1),
            _ => Err(Fault::number(index, WrongNumber::NoSign { zero: false })),
        }
    }

    /// How far to jump, counted from this many lines after the present one. A target before the
    /// data field is a wrong number; one beyond its end is noticed only when the program runs.
    fn jump(&self, index: usize, after: i64) -> Result<i32, Fault> {
        let offset = self.within::<i64>(index, OFFSET)?;
        let inside = self.ctx.line.is_none_or(|line| i64::from(line) + after + offset >= 0);
        self.require(inside, index, WrongNumber::BeforeProgram)?;
        i32::try_from(offset).map_err(|_| outside(index, OFFSET))
    }

    /// Command `3`: a branch without a count, a loop with one.
    fn repeat(&self) -> Result<Command, Fault> {
        let offset = self.jump(1, 0)?;
        if self.raw(0) == 0 {
            return Ok(Command::Branch { offset });
        }
        let count = self.within(0, LOOP_COUNT)?;
        // At least the line before must be repeated, and no line ahead can be.
        self.require(offset < 0, 1, WrongNumber::LoopAhead)?;
        Ok(Command::Loop { count, offset })
    }

    /// A bit number from 0, or the whole byte.
    fn bit(&self, index: usize) -> Result<Bit, Fault> {
        if self.raw(index) == i64::from(WHOLE_BYTE) {
            return Ok(Bit::Byte);
        }
        let bit = self.within(index, 0..=7);
        bit.map(Bit::One).map_err(|_| Fault::number(index, WrongNumber::NoBit))
    }

    /// A value that the bit can have.
    fn bit_value(&self, index: usize, bit: Bit) -> Result<u8, Fault> {
        match bit {
            Bit::One(_) => self.within(index, 0..=1),
            Bit::Byte => self.byte(index),
        }
    }

    /// Command `p`.
    fn set_port(&self) -> Result<BitTest, Fault> {
        let (port, bit) = (self.port(0)?, self.bit(1)?);
        let value = match bit {
            Bit::One(_) if self.ctx.any_bit_value => self.byte(2)?,
            _ => self.bit_value(2, bit)?,
        };
        // A value above 1 is for a port of eight bits.
        self.require_writable((0, port), (2, value))?;
        let value = match bit {
            Bit::One(_) => u8::from(value != 0),
            Bit::Byte => value,
        };
        Ok(BitTest { port, bit, value })
    }

    /// The condition of command `o`.
    fn branch_test(&self) -> Result<BitTest, Fault> {
        let (port, bit) = (self.readable(0)?, self.bit(1)?);
        let value = self.bit_value(2, bit)?;
        let fits = value <= 1 || !self.ctx.ports.is_logical(port);
        self.require(fits, 2, WrongNumber::Outside { low: 0, high: 1 })?;
        Ok(BitTest { port, bit, value })
    }

    /// The condition of command `6`, which only port 0 can have.
    fn until(&self) -> Result<BitTest, Fault> {
        let port = self.within(0, 0..=0)?;
        let bit = if self.ctx.bit_base_one && self.raw(1) != i64::from(WHOLE_BYTE) {
            Bit::One(self.within::<u8>(1, 1..=8)? - 1)
        } else {
            self.bit(1)?
        };
        Ok(BitTest { port, bit, value: self.bit_value(2, bit)? })
    }
}

fn axis_set(bits: i64) -> Option<AxisSet> {
    AxisSet::from_bits(u8::try_from(bits).ok()?)
}

/// `@0<n>` with a number that is none of its own.
const NO_CONFIGURATION: Fault = Fault::Axes { field: 0, wrong: WrongAxes::NoConfiguration };

fn outside(field: usize, range: RangeInclusive<i64>) -> Fault {
    Fault::number(field, WrongNumber::Outside { low: *range.start(), high: *range.end() })
}
