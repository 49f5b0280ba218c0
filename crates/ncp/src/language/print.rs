//! Commands as they are written.

use std::fmt::{self, Display, Formatter};

use vimc4_isel_wire::Plane;
use vimc4_motion::Turn;

use super::command::{
    Command, DrillWords, Frame, LETTERS, PortBit, Rate, SpindleWords, Units, Word, Words,
};

/// As files have it, in the usual order of words: `MOVEABS X20000 Y15000`.
impl Display for Command {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Command::Mark => f.write_str("IMF_PBL"),
            Command::Reference(groups) => {
                f.write_str("REF")?;
                groups.iter().filter(|group| **group != 0).try_for_each(|group| {
                    f.write_str(" ")?;
                    let members = (0_u8..).zip(LETTERS).filter(|(axis, _)| *group >> axis & 1 == 1);
                    members.into_iter().try_for_each(|(_, letter)| write!(f, "{letter}"))
                })
            }
            Command::Limit(limits) => {
                f.write_str("LIMIT")?;
                limits.iter().zip(LETTERS).try_for_each(|(limits, letter)| match limits {
                    Some((low, high)) => write!(f, " {letter}{},{}", low.value, high.value),
                    None => Ok(()),
                })
            }
            Command::Velocity(speed) => write!(f, "VEL {}", speed.value),
            Command::RapidVelocity(speed) => write!(f, "FASTVEL {}", speed.value),
            Command::Move(frame, Rate::Normal, to) => write!(f, "MOVE{frame}{}", Axes(to)),
            Command::Move(frame, Rate::Rapid, to) => write!(f, "FAST{frame}{}", Axes(to)),
            Command::Plane(Plane::Xy) => f.write_str("PLANE XY"),
            Command::Plane(Plane::Xz) => f.write_str("PLANE XZ"),
            Command::Plane(Plane::Yz) => f.write_str("PLANE YZ"),
            Command::Arc { frame, turn, helix, centre: [i, j, k], sweep, to } => {
                let helix = if *helix { "HLX" } else { "" };
                write!(f, "{}{helix}{frame}", turn_name(*turn))?;
                words(f, [("I", i), ("J", j), ("K", k), ("W", sweep)])?;
                write!(f, "{}", Axes(to))
            }
            Command::Wait(time) => write!(f, "WAIT {}", time.value),
            Command::ZeroHere => f.write_str("WPZERO"),
            Command::ZeroStandard => f.write_str("WPZERO STANDARD"),
            Command::ZeroAt(zero) => write!(f, "WPZEROABS{}", Axes(zero)),
            Command::ZeroClear => f.write_str("WPCLEAR"),
            Command::Store(register, zero) => write!(f, "WPREG{register}{}", Axes(zero)),
            Command::Recall(register) => write!(f, "WPREG{register}ACT"),
            Command::Teach => f.write_str("WPTEACH"),
            Command::SetPort(port, value) => write!(f, "SETPORT A{port}={value}D"),
            Command::SetBit(bit, true) => write!(f, "SETBIT A{bit}"),
            Command::SetBit(bit, false) => write!(f, "RESBIT A{bit}"),
            Command::WaitBit(bit, value) => write!(f, "WAITBIT E{bit}=={}", u8::from(*value)),
            Command::WaitPort(port, value) => write!(f, "WAITPORT E{port}=={value}D"),
            Command::Path => f.write_str("PATH"),
            Command::PathEnd => f.write_str("PATHEND"),
            Command::Tool(number) => write!(f, "GETTOOL {number}"),
            Command::DrillDefinition(words) => words.fmt(f),
            Command::Drill(at) => write!(f, "DRILL{}", Axes(at)),
            Command::Cylinder(turning, radius, linear) => {
                let letter = |axis: usize| LETTERS.get(axis).copied().unwrap_or_default();
                write!(f, "CYL {}{}", letter(turning.value), radius.value)?;
                linear.iter().try_for_each(|axis| write!(f, " {}", letter(axis.value)))
            }
            Command::Halt => f.write_str("HALT"),
            Command::Acceleration(percents) => write!(f, "ACCEL{}", Axes(percents)),
            Command::Spindle(words) => words.fmt(f),
            Command::Switch(accessory, on) => {
                write!(f, "{accessory} {}", if *on { "ON" } else { "OFF" })
            }
            Command::Units(Units::Metric) => f.write_str("METRIC"),
            Command::Units(Units::Inch) => f.write_str("INCH"),
            Command::ToolDefinition => f.write_str("TOOLDEF"),
            Command::ToolInit => f.write_str("INITTOOL"),
            Command::Type => f.write_str("TYPE"),
            Command::End => f.write_str("PROGEND"),
        }
    }
}

/// What names end with.
impl Display for Frame {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Frame::Absolute => "ABS",
            Frame::Relative => "REL",
        })
    }
}

impl Display for PortBit {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.port, self.bit)
    }
}

impl Display for DrillWords {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("DRILLDEF")?;
        words(
            f,
            [
                ("C", &self.cycle),
                ("P", &self.plane),
                ("D", &self.depth),
                ("T", &self.dwell),
                ("V", &self.speed),
                ("F", &self.first),
                ("O", &self.other),
                ("I", &self.decrease),
                ("R", &self.retreat),
                ("L", &self.lift),
                ("S", &self.safety),
            ],
        )
    }
}

impl Display for SpindleWords {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(if self.off { "SPINDLE OFF" } else { "SPINDLE ON" })?;
        if let Some(turn) = self.turn {
            write!(f, " {}", turn_name(turn.value))?;
        }
        words(f, [("RPM", &self.rpm), ("TIME", &self.time)])
    }
}

fn turn_name(turn: Turn) -> &'static str {
    match turn {
        Turn::Clockwise => "CW",
        Turn::Counterclockwise => "CCW",
    }
}

/// The words that are there, each with a blank before it.
fn words<'w>(
    f: &mut Formatter<'_>,
    words: impl IntoIterator<Item = (&'static str, &'w Option<Word>)>,
) -> fmt::Result {
    words.into_iter().try_for_each(|(name, word)| match word {
        Some(word) => write!(f, " {name}{}", word.value),
        None => Ok(()),
    })
}

/// The words of axes.
struct Axes<'w>(&'w Words);

impl Display for Axes<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        words(f, ["X", "Y", "Z", "A", "B", "C"].into_iter().zip(self.0))
    }
}
