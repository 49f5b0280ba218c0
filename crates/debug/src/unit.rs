//! Units of steps, and directions.

use std::fmt;
use std::time::Duration;

use vimc4_device::show_nanos;

/// What a step is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// One act: a byte or another input that comes, or one thing that the controller does by itself.
    Cause,
    /// A byte that comes.
    Byte,
    /// Something that happens and can be watched.
    Event,
    /// A command whose execution begins.
    Command,
    /// A line of the stored program, or of the file that the commands come from, that is begun.
    Line,
    /// A round of a loop of the stored program.
    Loop,
    /// The beginning or the end of a motion.
    Segment,
    /// A step of a motor: a change of a counter.
    Step,
    /// A span of time.
    Time(Duration),
}

impl Unit {
    /// Those with a name, and what a step of each is.
    pub const NAMED: [(&'static str, Unit, &'static str); 8] = [
        (
            "cause",
            Unit::Cause,
            "a byte or another input, or one thing the controller does by itself",
        ),
        ("byte", Unit::Byte, "a byte that comes"),
        ("event", Unit::Event, "something that happens"),
        ("command", Unit::Command, "a command that begins"),
        ("line", Unit::Line, "a line of the program or of the file that begins"),
        ("loop", Unit::Loop, "a round of a loop of the program"),
        ("segment", Unit::Segment, "a motion that begins or ends"),
        ("step", Unit::Step, "a step of a motor"),
    ];

    /// The one of a name, which may be a plural.
    #[must_use]
    pub fn named(name: &str) -> Option<Unit> {
        let single = name.strip_suffix('s').unwrap_or(name);
        let found = Unit::NAMED.into_iter().find(|(own, ..)| *own == name || *own == single);
        found.map(|(_, unit, _)| unit)
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = Unit::NAMED.into_iter().find(|(_, unit, _)| unit == self);
        match (self, named) {
            (Unit::Time(span), _) => {
                let nanos = u64::try_from(span.as_nanos()).unwrap_or(u64::MAX);
                f.write_str(&show_nanos(nanos))
            }
            (_, Some((name, ..))) => f.write_str(name),
            (_, None) => f.write_str("step"),
        }
    }
}

/// The two directions of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Into the future.
    Forward,
    /// Into the past.
    Back,
}

/// How a step by lines treats loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Depth {
    /// Every line counts.
    #[default]
    Into,
    /// Lines of loops that are not open now do not count.
    Over,
    /// Only lines outside the innermost loop that is open now count; if none is open, only what is
    /// outside the program.
    Out,
}
