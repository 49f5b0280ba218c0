//! Commands as they are written.

use std::fmt::{self, Display, Formatter};

use vimc4_isel_wire::Plane;
use vimc4_motion::Turn;

use super::command::{
    DrillWords, Frame, Instruction, LETTERS, PortBit, Rate, SpindleWords, Units, Word, Words,
};

/// As files have it, in the usual order of words: `MOVEABS X20000 Y15000`.
impl Display for Instruction {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Instruction::Mark => f.write_str("IMF_PBL"),
            Instruction::Reference(groups) => {
                f.write_str("REF")?;
                groups.iter().filter(|group| **group != 0).try_for_each(|group| {
                    f.write_str(" ")?;
                    let members = (0_u8..).zip(LETTERS).filter(|(axis, _)| *group >> axis & 1 == 1);
                    members.into_iter().try_for_each(|(_, letter)| write!(f, "{letter}"))
                })
            }
            Instruction::Limit(limits) => {
                f.write_str("LIMIT")?;
                limits.iter().zip(LETTERS).try_for_each(|(limits, letter)| match limits {
                    Some((low, high)) => write!(f, " {letter}{},{}", low.value, high.value),
                    None => Ok(()),
                })
            }
            Instruction::Velocity(speed) => write!(f, "VEL {}", speed.value),
            Instruction::RapidVelocity(speed) => write!(f, "FASTVEL {}", speed.value),
            Instruction::Move(frame, Rate::Normal, to) => write!(f, "MOVE{frame}{}", Axes(to)),
            Instruction::Move(frame, Rate::Rapid, to) => write!(f, "FAST{frame}{}", Axes(to)),
            Instruction::Plane(Plane::Xy) => f.write_str("PLANE XY"),
            Instruction::Plane(Plane::Xz) => f.write_str("PLANE XZ"),
            Instruction::Plane(Plane::Yz) => f.write_str("PLANE YZ"),
            Instruction::Arc { frame, turn, helix, centre: [i, j, k], sweep, to } => {
                let helix = if *helix { "HLX" } else { "" };
                write!(f, "{}{helix}{frame}", turn_name(*turn))?;
                words(f, [("I", i), ("J", j), ("K", k), ("W", sweep)])?;
                write!(f, "{}", Axes(to))
            }
            Instruction::Wait(time) => write!(f, "WAIT {}", time.value),
            Instruction::ZeroHere => f.write_str("WPZERO"),
            Instruction::ZeroStandard => f.write_str("WPZERO STANDARD"),
            Instruction::ZeroAt(zero) => write!(f, "WPZEROABS{}", Axes(zero)),
            Instruction::ZeroClear => f.write_str("WPCLEAR"),
            Instruction::Store(register, zero) => write!(f, "WPREG{register}{}", Axes(zero)),
            Instruction::Recall(register) => write!(f, "WPREG{register}ACT"),
            Instruction::Teach => f.write_str("WPTEACH"),
            Instruction::SetPort(port, value) => write!(f, "SETPORT A{port}={value}D"),
            Instruction::SetBit(bit, true) => write!(f, "SETBIT A{bit}"),
            Instruction::SetBit(bit, false) => write!(f, "RESBIT A{bit}"),
            Instruction::WaitBit(bit, value) => write!(f, "WAITBIT E{bit}=={}", u8::from(*value)),
            Instruction::WaitPort(port, value) => write!(f, "WAITPORT E{port}=={value}D"),
            Instruction::Path => f.write_str("PATH"),
            Instruction::PathEnd => f.write_str("PATHEND"),
            Instruction::Tool(number) => write!(f, "GETTOOL {number}"),
            Instruction::DrillDefinition(words) => words.fmt(f),
            Instruction::Drill(at) => write!(f, "DRILL{}", Axes(at)),
            Instruction::Cylinder(turning, radius, linear) => {
                let letter = |axis: usize| LETTERS.get(axis).copied().unwrap_or_default();
                write!(f, "CYL {}{}", letter(turning.value), radius.value)?;
                linear.iter().try_for_each(|axis| write!(f, " {}", letter(axis.value)))
            }
            Instruction::Halt => f.write_str("HALT"),
            Instruction::Acceleration(percents) => write!(f, "ACCEL{}", Axes(percents)),
            Instruction::Spindle(words) => words.fmt(f),
            Instruction::Switch(accessory, on) => {
                write!(f, "{accessory} {}", if *on { "ON" } else { "OFF" })
            }
            Instruction::Units(Units::Metric) => f.write_str("METRIC"),
            Instruction::Units(Units::Inch) => f.write_str("INCH"),
            Instruction::ToolDefinition => f.write_str("TOOLDEF"),
            Instruction::ToolInit => f.write_str("INITTOOL"),
            Instruction::Type => f.write_str("TYPE"),
            Instruction::End => f.write_str("PROGEND"),
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
