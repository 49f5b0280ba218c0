//! Commands in words, for traces and messages.
//!
//! The words are for people and may change; a program that needs something stable takes the mnemonic of
//! the table.

use std::fmt::{self, Display, Formatter};

use crate::axes::{AxisSet, LETTERS};
use crate::command::{
    ArcArgs, Bit, BitTest, Command, Direction, Init, Pairs, Plane, PortTest, Speeds,
};

impl Command {
    /// What it does, for people: `relative move X +5,000 steps at 900 Hz`.
    ///
    /// `axes` are the configured ones: they tell which axis a parameter is for.
    #[must_use]
    pub fn describe(&self, axes: AxisSet) -> String {
        Words { command: self, axes }.to_string()
    }
}

/// A command together with what its words depend on.
struct Words<'a> {
    command: &'a Command,
    axes: AxisSet,
}

impl Display for Words<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.command {
            Command::SetAxes(axes) => write!(f, "set axes {axes}"),
            Command::RelativeMove(pairs) => self.relative_move(pairs, f),
            Command::AbsoluteMove(pairs) => self.absolute_move(pairs, f),
            Command::ReadPort(port) => write!(f, "read port {port}"),
            Command::WritePort { port, value } => write!(f, "write {value} to port {port}"),
            Command::ReferenceSpeeds(speeds) => self.reference_speeds(speeds, f),
            Command::Diagnosis(code) => write!(f, "diagnosis {}", code.escape_ascii()),
            Command::Plane(Plane::Xy) => f.write_str("set plane of circles X+Y"),
            Command::Plane(Plane::Xz) => f.write_str("set plane of circles X+Z"),
            Command::Plane(Plane::Yz) => f.write_str("set plane of circles Y+Z"),
            Command::Direction(Direction::Clockwise) => f.write_str("set circles clockwise"),
            Command::Direction(Direction::Counterclockwise) => {
                f.write_str("set circles counterclockwise")
            }
            Command::Free(axes) => write!(f, "leave limit switch {axes}"),
            Command::Brake(true) => f.write_str("open brake"),
            Command::Brake(false) => f.write_str("close brake"),
            Command::DeviceNumber(number) => write!(f, "set device number {number}"),
            Command::LimitStatus => f.write_str("show limit switches"),
            Command::Status => f.write_str("show status"),
            Command::Store => f.write_str("store data field"),
            Command::Init(init) => init.fmt(f),
            Command::StartStop(hz) => write!(f, "set start-stop frequency {}", Hz(*hz)),
            Command::Acceleration(a) => write!(f, "set acceleration {}/ms", Hz(*a)),
            Command::Erase => f.write_str("erase program"),
            Command::Zero(axes) => write!(f, "set zero {axes}"),
            Command::SimulateReference(axes) => write!(f, "simulate reference run {axes}"),
            Command::Position => f.write_str("read position"),
            Command::Reference(axes) => write!(f, "reference run {axes}"),
            Command::Start => f.write_str("start"),
            Command::TestMode(on) => write!(f, "test mode {}", Switch(*on)),
            Command::UserInfo => f.write_str("show user info"),
            Command::Version => f.write_str("show version"),
            Command::SelfTest => f.write_str("self-test"),
            Command::Helix(arc, third) => {
                write!(f, "helix {arc}, third axis {} steps", Signed(*third))
            }
            Command::Circle(arc) => write!(f, "circle {arc}"),
            Command::Interpolation3d(on) => write!(f, "3D interpolation {}", Switch(*on)),
            Command::MoveUntil { test, speed, steps, count } => {
                f.write_str("relative move")?;
                for (place, steps) in steps.iter().take(usize::from(*count)).enumerate() {
                    write!(f, "{} {} {} steps", comma(place), self.label(place), Signed(*steps))?;
                }
                write!(f, " at {} until {test}", Hz(*speed))
            }
            Command::SendSync(character) => write!(f, "send {:?}", char::from(*character)),
            Command::AwaitSync { character, offset } => {
                let character = char::from(*character);
                write!(f, "wait for a character, if {character:?} jump by {}", Signed(*offset))
            }
            Command::Loop { count, offset } => {
                let (lines, times) = (offset.unsigned_abs().into(), Grouped((*count).into()));
                write!(f, "repeat the last {} lines, count {times}", Grouped(lines))
            }
            Command::Branch { offset } => write!(f, "jump by {}", Signed(*offset)),
            Command::Delay { tenths } => {
                write!(f, "wait {}.{} s", Grouped((tenths / 10).into()), tenths % 10)
            }
            Command::Until(test) => write!(f, "next move until {} = {}", test.place(), test.value),
            Command::SetPort(test) => write!(f, "set {} to {}", test.place(), test.value),
            Command::BranchIf { test, offset } => {
                write!(f, "if {} = {} jump by {}", test.place(), test.value, Signed(*offset))
            }
            Command::End => f.write_str("end of data field"),
        }
    }
}

impl Words<'_> {
    /// Which axis the parameter in this place is for. The fourth of three axes is Z once more.
    fn label(&self, place: usize) -> char {
        let z_again = Some(2).filter(|_| place == 3 && self.axes.contains(AxisSet::Z));
        self.axes.iter().nth(place).or(z_again).map_or('?', |axis| LETTERS[axis])
    }

    fn relative_move(&self, pairs: &Pairs, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("relative move")?;
        for (place, pair) in pairs.as_slice().iter().enumerate() {
            // The second way of Z is mostly 0, and then not mentioned.
            if place >= self.axes.count() && pair.steps == 0 {
                continue;
            }
            let (axis, steps, speed) = (self.label(place), Signed(pair.steps), Hz(pair.speed));
            write!(f, "{} {axis} {steps} steps at {speed}", comma(place))?;
        }
        Ok(())
    }

    fn absolute_move(&self, pairs: &Pairs, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("absolute move")?;
        // The second pair of Z is present but ignored.
        for (place, pair) in pairs.as_slice().iter().enumerate().take(self.axes.count()) {
            let (axis, target, speed) = (self.label(place), plain(pair.steps), Hz(pair.speed));
            write!(f, "{} {axis} to {target} at {speed}", comma(place))?;
        }
        Ok(())
    }

    fn reference_speeds(&self, speeds: &Speeds, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("set reference speeds")?;
        for (place, axis) in self.axes.iter().enumerate() {
            if let Some(speed) = speeds.of(axis, self.axes) {
                write!(f, "{} {} {}", comma(place), LETTERS[axis], Hz(speed))?;
            }
        }
        Ok(())
    }
}

impl Display for Init {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Directions(axes) => write!(f, "invert directions {axes}"),
            Self::References(axes) => write!(f, "invert reference directions {axes}"),
            Self::HardwareStatus(status) => write!(f, "set hardware status {status}"),
            Self::RotaryL(axes) => write!(f, "set rotary axes {axes}"),
            Self::DefaultSpeeds([x, y, z, a]) => {
                let (x, y, z, a) = (Hz(*x), Hz(*y), Hz(*z), Hz(*a));
                write!(f, "set default reference speeds X {x}, Y {y}, Z {z}, A {a}")
            }
            Self::FreeSteps([x, y, z, a]) => {
                let (x, y, z, a) = (plain(*x), plain(*y), plain(*z), plain(*a));
                write!(f, "set steps off the reference switches X {x}, Y {y}, Z {z}, A {a}")
            }
            Self::DefaultAcceleration(a) => write!(f, "set default acceleration {}/ms", Hz(*a)),
            Self::DefaultStartStop(hz) => {
                write!(f, "set default start-stop frequency {}", Hz(*hz))
            }
            Self::IoOnly(on) => write!(f, "ports only {}", Switch(*on)),
            Self::Limits(bits) => write!(f, "set limit switches {bits:#06x}"),
            Self::SwapLimits(axes) => write!(f, "swap limit switches {axes}"),
            Self::AxisTypes(axes) => write!(f, "set axis types, rotary {axes}"),
            Self::Abort(test) => write!(f, "abort unless {test}"),
            Self::ErrorSignal(PortTest { port, mask, value }) => {
                write!(f, "on error write {value} to port {port}, mask {mask}")
            }
            Self::Cover(test) => write!(f, "cover open unless {test}"),
            Self::Emergency(test) => write!(f, "emergency stop unless {test}"),
            Self::Baud9600(on) => write!(f, "9600 baud {}", Switch(*on)),
            Self::UserInfo(text) => {
                write!(f, "set user info \"{}\"", text.as_bytes().escape_ascii())
            }
            Self::Load => f.write_str("load parameters from flash"),
            Self::Write => f.write_str("write parameters to flash"),
            Self::Factory => f.write_str("restore factory parameters"),
        }
    }
}

impl Display for ArcArgs {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (steps, speed, d) = (Grouped(self.steps.into()), Hz(self.speed), plain(self.d));
        let (x, y) = (plain(self.x), plain(self.y));
        let (rx, ry) = (Signed(self.rx.into()), Signed(self.ry.into()));
        write!(f, "of {steps} steps at {speed} from {x} {y}, D {d}, Rx {rx}, Ry {ry}")
    }
}

impl Display for PortTest {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "port {} is {} (mask {})", self.port, self.value, self.mask)
    }
}

impl BitTest {
    fn place(&self) -> Place {
        Place { port: self.port, bit: self.bit }
    }
}

/// A port or a bit of it.
struct Place {
    port: u16,
    bit: Bit,
}

impl Display for Place {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.bit {
            Bit::One(bit) => write!(f, "port {} bit {bit}", self.port),
            Bit::Byte => write!(f, "port {}", self.port),
        }
    }
}

/// The separator before the element at this place of a list.
const fn comma(place: usize) -> &'static str {
    if place == 0 { "" } else { "," }
}

struct Switch(bool);

impl Display for Switch {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0 { "on" } else { "off" })
    }
}

/// With thousands separators; a minus if it is negative.
struct Grouped(i64);

impl Display for Grouped {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if self.0.unsigned_abs() < 1000 {
            return write!(f, "{}", self.0);
        }
        write!(f, "{},{:03}", Self(self.0 / 1000), (self.0 % 1000).unsigned_abs())
    }
}

fn plain(number: i32) -> Grouped {
    Grouped(number.into())
}

/// With thousands separators and a sign; 0 has none.
struct Signed(i32);

impl Display for Signed {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let sign = if self.0 > 0 { "+" } else { "" };
        write!(f, "{sign}{}", plain(self.0))
    }
}

struct Hz(u32);

impl Display for Hz {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{} Hz", Grouped(self.0.into()))
    }
}
