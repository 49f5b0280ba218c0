//! Commands in words, for traces and messages.
//!
//! The words are for people and may change; a program that needs something stable takes the mnemonic of
//! the table.

use std::fmt::{self, Display, Formatter};

use vimc4_device::Grouped;

use super::command::{Axis, Command, Mode, Trackball, Turn, Vector};
use super::number::Number;

/// More positions or records than this are counted instead of listed.
const TOLD: usize = 4;

impl Command {
    /// What it does, for people: `move to X 1,000 Y 2,000`.
    #[must_use]
    pub fn describe(&self) -> String {
        self.to_string()
    }
}

impl Display for Command {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Window([[x0, y0], [x1, y1]]) => {
                let (x0, y0, x1, y1) = (plain(*x0), plain(*y0), plain(*x1), plain(*y1));
                write!(f, "window from X {x0} Y {y0} to X {x1} Y {y1}")
            }
            Self::HardClipLimits(axis) => write!(f, "find limits of {}", Of(*axis)),
            Self::PenSpeed(speed) => write!(f, "speed with the pen down {}", PenSpeed(*speed)),
            Self::Acceleration { axis, acceleration } => {
                let value = plain(*acceleration);
                write!(f, "acceleration of {} {value} (mm/s² or mrad/s²)", Of(*axis))
            }
            Self::CloseChannel(Some(channel)) => write!(f, "close channel {channel}"),
            Self::OpenChannel(Some(channel)) => write!(f, "open channel {channel}"),
            Self::CloseInterface => f.write_str("close trackball"),
            Self::OpenInterface(does) => write!(f, "open trackball: {}", does.name()),
            Self::SetMode(Mode::Drilling) => f.write_str("drilling mode"),
            Self::SetMode(Mode::Milling) => f.write_str("milling mode"),
            Self::Continue => f.write_str("finish the broken-off command"),
            Self::GoBack => f.write_str("go back to the start of the broken-off command"),
            Self::RepeatBroken => f.write_str("repeat the broken-off command"),
            Self::Repeat => f.write_str("repeat the last command"),
            Self::Echo(on) => write!(f, "echo {}", Switch(*on)),
            Self::ExternalStop(on) => write!(f, "external stop {}", Switch(*on)),
            Self::Spindle(on) => write!(f, "spindle {}", Switch(*on)),
            Self::Reference(axis) => write!(f, "reference run of {}", Of(*axis)),
            Self::ActualPosition { axis, triggered } => {
                let when = if *triggered { " at the last trigger" } else { "" };
                write!(f, "read actual position of {}{when}", Of(*axis))
            }
            Self::NominalPosition(axis) => write!(f, "read nominal position of {}", Of(*axis)),
            Self::ReadPort(port) => write!(f, "read {}", Port(*port)),
            Self::WritePort { port, data } => {
                write!(f, "write {} to {}", Grouped((*data).into()), Port(*port))
            }
            Self::Resolution { axis, resolution } => {
                write!(f, "resolution of {} {resolution} (nm or 0.001″)", Of(*axis))
            }
            Self::Range { axis, min, max } => {
                write!(f, "range of {} from {} to {}", axis.name(), plain(*min), plain(*max))
            }
            Self::DrillingTimes(times) => all_times(f, "drilling", *times),
            Self::MillingTimes(times) => all_times(f, "milling", *times),
            Self::SettlingTime(time) => write!(f, "settling time {}", Time(*time)),
            Self::Wait(time) => write!(f, "wait {}", Time(*time)),
            Self::TravelSpeed(speed) => write!(f, "speed with the pen up {} µm/s", plain(*speed)),
            Self::ZSpeed(speed) => axis_speed(f, Axis::Z0, *speed),
            Self::AxisSpeed { axis, speed } => axis_speed(f, *axis, *speed),
            command => command.motion(f),
        }
    }
}

impl Command {
    /// Where a command moves to; the title of one that moves nothing.
    fn motion(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::ArcAbsolute { centre: [x, y], angle } => {
                write!(f, "arc around X {} Y {}, {}", plain(*x), plain(*y), Angle(*angle))
            }
            Self::ArcRelative { centre: [x, y], angle } => {
                let (x, y) = (Signed(*x), Signed(*y));
                write!(f, "arc around X {x} Y {y} from here, {}", Angle(*angle))
            }
            Self::Circle(radius) => write!(f, "circle with the radius {}", plain(*radius)),
            Self::EdgeAbsolute(place) => places(f, "rectangle to", &AXES, place.map(plain)),
            Self::EdgeRelative(way) => places(f, "rectangle by", &AXES, way.map(Signed)),
            Self::PlotAbsolute(positions) => plot(f, "to", positions, plain),
            Self::PlotRelative(ways) => plot(f, "by", ways, Signed),
            Self::MoveAllAbsolute(positions) => places(f, "move to", &AXES, positions.map(plain)),
            Self::MoveAllRelative(ways) => places(f, "move by", &AXES, ways.map(Signed)),
            Self::SpaceAbsolute(place) => places(f, "move to", &["X", "Y", "Z"], place.map(plain)),
            Self::SpaceRelative(way) => places(f, "move by", &["X", "Y", "Z"], way.map(Signed)),
            Self::MoveZAbsolute(to) => places(f, "move to", &["Z"], [plain(*to)]),
            Self::MoveZRelative(by) => places(f, "move by", &["Z"], [Signed(*by)]),
            Self::MoveAxisAbsolute { axis, to } => {
                places(f, "move to", &[axis.name()], [plain(*to)])
            }
            Self::MoveAxisRelative { axis, by } => {
                places(f, "move by", &[axis.name()], [Signed(*by)])
            }
            Self::FollowVectors { axes, vectors } => follow(f, *axes, vectors),
            command => f.write_str(command.form().title),
        }
    }
}

impl Trackball {
    fn name(self) -> &'static str {
        match self {
            Self::MoveAndReport => "move and report",
            Self::Move => "move",
            Self::Report => "report",
        }
    }
}

fn plot<T: Display>(
    f: &mut Formatter<'_>,
    how: &str,
    pairs: &[[i32; 2]],
    show: impl Fn(i32) -> T,
) -> fmt::Result {
    write!(f, "move {how}")?;
    for (place, [x, y]) in pairs.iter().take(TOLD).enumerate() {
        write!(f, "{} X {} Y {}", comma(place), show(*x), show(*y))?;
    }
    more(f, pairs.len())
}

fn follow(f: &mut Formatter<'_>, [a, b]: [Axis; 2], vectors: &[Vector]) -> fmt::Result {
    let (a, b) = (a.name(), b.name());
    f.write_str("follow")?;
    for (place, vector) in vectors.iter().take(TOLD).enumerate() {
        let ([x, y], [i, j]) = (vector.end.map(Signed), vector.centre.map(Signed));
        write!(f, "{} {a} {x} {b} {y}", comma(place))?;
        match vector.turn {
            Turn::Straight => {}
            Turn::Clockwise => write!(f, " clockwise around {a} {i} {b} {j}")?,
            Turn::Counterclockwise => write!(f, " counter-clockwise around {a} {i} {b} {j}")?,
        }
        if vector.speed_change != 0 {
            write!(f, " speed {} µm/s", Signed(vector.speed_change))?;
        }
    }
    more(f, vectors.len())
}

/// How many have not been listed.
fn more(f: &mut Formatter<'_>, count: usize) -> fmt::Result {
    if count > TOLD { write!(f, " and {} more", count - TOLD) } else { Ok(()) }
}

/// The names of the axes, in the order of their numbers.
const AXES: [&str; 6] = ["X", "Y", "Z0", "Z1", "Z2", "Z3"];

fn places<T: Display, const N: usize>(
    f: &mut Formatter<'_>,
    what: &str,
    axes: &[&str],
    values: [T; N],
) -> fmt::Result {
    f.write_str(what)?;
    axes.iter().zip(values).try_for_each(|(axis, value)| write!(f, " {axis} {value}"))
}

fn all_times(f: &mut Formatter<'_>, what: &str, times: [u32; 4]) -> fmt::Result {
    let [t1, t2, t3, t4] = times.map(Time);
    write!(f, "times for {what}: {t1} and {t2} around lowering, {t3} and {t4} around lifting")
}

fn axis_speed(f: &mut Formatter<'_>, axis: Axis, speed: i32) -> fmt::Result {
    write!(f, "speed of {} {} (µm/s or 0.1°/s)", axis.name(), plain(speed))
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

/// An axis, or all of them.
struct Of(Option<Axis>);

impl Display for Of {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.map_or("all axes", Axis::name))
    }
}

/// Bank and port, as the halves of an address.
struct Port(u8);

impl Display for Port {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "bank {} port {}", self.0 >> 4, self.0 & 15)
    }
}

/// A speed of the head. A value below 1 may be in m/s; that is a quirk that is unknown here.
struct PenSpeed(Number);

impl Display for PenSpeed {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (literal, metres) = (self.0.speed(false), self.0.speed(true));
        if literal == metres {
            write!(f, "{} µm/s", plain(literal))
        } else {
            write!(f, "{} (m/s or µm/s)", self.0)
        }
    }
}

/// With as many decimals as it needs, and its sense.
struct Angle(i64);

impl Display for Angle {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let degrees = Number { millionths: self.0.saturating_abs() };
        let sense = if self.0 < 0 { "clockwise" } else { "counter-clockwise" };
        write!(f, "{degrees}° {sense}")
    }
}

struct Time(u32);

impl Display for Time {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{} ms", Grouped(self.0.into()))
    }
}

/// With thousands separators; a minus if it is negative.
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
