//! Where to stop.

use vimc4_device::{Condition, Names, Time};
use vimc4_session::BreakpointId;
use vimc4_timeline::Place;

use crate::{Expression, Field};

/// What a breakpoint waits for.
#[derive(Clone, Debug, PartialEq)]
pub enum Trigger {
    /// A condition begins to hold, or an event in it happens. Instants within a motion are
    /// computed, so it stops exactly there.
    Condition(Condition),
    /// A line of the file that the commands come from is begun, from 1.
    SourceLine(u32),
    /// A field has another value than before.
    Change(Field),
    /// An expression becomes true. It is evaluated whenever something happens and 32 times in each
    /// motion; an instant in between is then narrowed down exactly.
    Expression(Expression),
}

/// Which hits count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hits {
    /// Every hit.
    #[default]
    All,
    /// This hit only, counted from 1 at the beginning of the history.
    Only(u64),
    /// This hit and all later ones, counted from 1.
    From(u64),
    /// Every hit whose number this divides.
    Every(u64),
}

impl Hits {
    /// Whether the hit of a number counts.
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

/// The further properties of a breakpoint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// A condition that must hold too.
    pub condition: Option<Expression>,
    /// Which hits count.
    pub hits: Hits,
    /// Instead of stopping, log this text.
    pub log: Option<String>,
}

/// A place to stop at, or only to log when passing.
#[derive(Clone, Debug, PartialEq)]
pub struct Breakpoint {
    /// Its number.
    pub id: BreakpointId,
    /// What it waits for.
    pub trigger: Trigger,
    /// A condition that must hold too.
    pub condition: Option<Expression>,
    /// Which hits count, from the beginning of the history: the same ones forward and back.
    pub hits: Hits,
    /// Instead of stopping, log this text, with the values of expressions in braces.
    pub log: Option<String>,
    /// Whether it is enabled.
    pub is_enabled: bool,
    /// How often it was hit, with its condition true, on the way to where that was counted last.
    pub count: u64,
    /// Where `count` was counted, if that is known.
    pub(crate) counted: Option<Counted>,
}

/// Where hits were counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Counted {
    pub(crate) place: Place,
    /// How many of the questions of the host at this place belong to it.
    pub(crate) asked: usize,
}

impl Breakpoint {
    /// One that was not hit yet.
    pub(crate) fn new(id: BreakpointId, trigger: Trigger, options: Options) -> Breakpoint {
        let Options { condition, hits, log } = options;
        let (is_enabled, count, counted) = (true, 0, None);
        Breakpoint { id, trigger, condition, hits, log, is_enabled, count, counted }
    }

    /// Whether not every hit counts.
    pub(crate) fn is_limited(&self) -> bool {
        self.is_enabled && self.hits != Hits::All
    }

    /// Its description for people, with the names of a controller.
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

/// A note of a breakpoint that only logs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// By which.
    pub by: BreakpointId,
    /// When.
    pub at: Time,
    /// What.
    pub text: String,
}
