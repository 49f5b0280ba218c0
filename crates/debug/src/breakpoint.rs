//! Where to stop.

use std::fmt;

use vimc4_device::{Condition, Names, Time};

use crate::{Expression, Field};

/// The number of a breakpoint, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BreakpointId(pub u32);

impl fmt::Display for BreakpointId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// What a breakpoint waits for.
#[derive(Clone, Debug, PartialEq)]
pub enum Trigger {
    /// A condition begins to hold, or what happens in it happens. When that is within a motion is
    /// computed, so it is met at its instant.
    Condition(Condition),
    /// A line of the file that the commands come from is begun, from 1.
    SourceLine(u32),
    /// A field has another value than before.
    Change(Field),
    /// An expression becomes so, looked at whenever something happens, and 32 times in each motion.
    /// When it is in between is narrowed down to its instant.
    Expression(Expression),
}

/// How often it must have come before it counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hits {
    /// It counts each time.
    #[default]
    All,
    /// This time only, counted from 1.
    Only(u64),
    /// From this time on, counted from 1.
    From(u64),
    /// Every time that this divides.
    Every(u64),
}

impl Hits {
    /// Whether it counts this time.
    #[must_use]
    pub fn allow(self, time: u64) -> bool {
        match self {
            Hits::All => true,
            Hits::Only(only) => time == only,
            Hits::From(from) => time >= from,
            Hits::Every(every) => every > 0 && time.is_multiple_of(every),
        }
    }
}

/// A place where to stop, or only to note that it was passed.
#[derive(Clone, Debug, PartialEq)]
pub struct Breakpoint {
    /// Its number.
    pub id: BreakpointId,
    /// What it waits for.
    pub trigger: Trigger,
    /// What must be so as well.
    pub condition: Option<Expression>,
    /// How often it must have come. On the way back each time counts.
    pub hits: Hits,
    /// Nobody stops, but this is noted, with the values of expressions in braces.
    pub log: Option<String>,
    /// Whether it is heeded.
    pub is_enabled: bool,
    /// How often it has come on the way forward, with its condition being so.
    pub count: u64,
}

impl Breakpoint {
    /// It for people, with the names of a controller.
    #[must_use]
    pub fn describe(&self, names: &Names) -> String {
        let mut text = match &self.trigger {
            Trigger::Condition(condition) => names.write(condition).to_string(),
            Trigger::SourceLine(line) => format!("line {line} of the file"),
            Trigger::Change(field) => format!("change {field}"),
            Trigger::Expression(expression) => expression.to_string(),
        };
        if let Some(condition) = &self.condition {
            text += &format!(" if {condition}");
        }
        match self.hits {
            Hits::All => {}
            Hits::Only(time) => text += &format!(" hit {time}"),
            Hits::From(time) => text += &format!(" from {time}"),
            Hits::Every(time) => text += &format!(" every {time}"),
        }
        if let Some(log) = &self.log {
            text += &format!(" log {log}");
        }
        text
    }
}

/// What a breakpoint that only logs has noted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// By which.
    pub by: BreakpointId,
    /// When.
    pub at: Time,
    /// What.
    pub text: String,
}
