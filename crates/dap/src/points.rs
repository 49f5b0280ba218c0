//! Breakpoints as a client has them, and what they are for a controller.

use serde::Serialize;
use vimc4_debug::{BreakpointId, Debugger, Expression, Field, Hits, Options, Trigger};
use vimc4_device::Condition;

use crate::arguments::With;
use crate::held::{Held, Text};

/// What a client wants to stop at.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Spot {
    /// A line of a text of one controller or several.
    Line(Vec<(usize, Text)>, i64),
    /// A command, or a condition.
    Function(String),
    /// A field of a controller.
    Data(usize, String),
    /// Error replies, or those of these codes.
    Errors(String),
    /// Something that is not waited for, and why.
    Never(String),
}

/// A breakpoint of a client.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Its number, from 1.
    pub(crate) id: u32,
    pub(crate) spot: Spot,
    pub(crate) with: With,
    /// What it is for the controllers.
    pub(crate) on: Vec<(usize, BreakpointId)>,
    /// The line that it is at.
    pub(crate) line: Option<u32>,
    /// Why it is at none.
    pub(crate) message: Option<String>,
}

/// A breakpoint as a client is told of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Told {
    id: u32,
    verified: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<i64>,
}

impl Point {
    /// The breakpoint as told to a client that counts lines from `first`.
    pub(crate) fn told(&self, first: i64) -> Told {
        Told {
            id: self.id,
            verified: !self.on.is_empty(),
            message: self.message.clone(),
            line: self.line.map(|line| i64::from(line) - 1 + first),
        }
    }

    /// Waits for it.
    pub(crate) fn set(&mut self, held: &mut [Held]) {
        self.message = None;
        let mut set = |number: usize, held: &mut Held, trigger: Result<Trigger, String>| {
            let debugger = held.debugger();
            let with = trigger.and_then(|trigger| Ok((trigger, options(&self.with, debugger)?)));
            match with {
                Ok((trigger, options)) => {
                    self.on.push((number, debugger.add_breakpoint(trigger, options)));
                }
                Err(message) => self.message = Some(message),
            }
        };
        match &self.spot {
            Spot::Line(texts, line) => {
                for (number, text) in texts {
                    let Some(held) = held.get_mut(*number) else { continue };
                    let found = u32::try_from(*line).ok().filter(|line| *line > 0);
                    let found = found.ok_or_else(|| format!("there is no line {line}"));
                    let found = found.and_then(|line| {
                        held.at_line(*text, line).map_err(|error| error.to_string())
                    });
                    if let Ok((_, line)) = &found {
                        self.line = Some(*line);
                    }
                    set(*number, held, found.map(|(trigger, _)| trigger));
                }
            }
            Spot::Never(why) => self.message = Some(why.clone()),
            Spot::Function(name) => {
                for (number, held) in held.iter_mut().enumerate() {
                    let trigger = command(name, held.debugger());
                    set(number, held, trigger);
                }
            }
            Spot::Data(number, path) => {
                if let Some(held) = held.get_mut(*number) {
                    let field = Field::parse(path, held.debugger().device());
                    set(*number, held, field.map(Trigger::Change).map_err(|e| e.to_string()));
                }
            }
            Spot::Errors(codes) => {
                for (number, held) in held.iter_mut().enumerate() {
                    let trigger = errors(codes, held.debugger());
                    set(number, held, trigger);
                }
            }
        }
        if self.on.is_empty() && self.message.is_none() {
            let why = match (&self.spot, held.is_empty()) {
                (_, true) => "no program is open yet",
                (Spot::Line(..), false) => "no controller is given commands from this file",
                (_, false) => "there is no such controller",
            };
            self.message = Some(why.to_owned());
        }
        // Where it waits in one controller it is not a fault that another does not know it.
        if !self.on.is_empty() {
            self.message = None;
        }
    }

    /// Waits for it no longer.
    pub(crate) fn clear(&mut self, held: &mut [Held]) {
        for (number, id) in self.on.drain(..) {
            if let Some(held) = held.get_mut(number) {
                held.debugger().remove_breakpoint(id);
            }
        }
    }

    /// The protocol's reason for a stop at it.
    pub(crate) fn reason(&self) -> &'static str {
        match self.spot {
            Spot::Line(..) => "breakpoint",
            Spot::Function(_) => "function breakpoint",
            Spot::Data(..) | Spot::Never(_) => "data breakpoint",
            Spot::Errors(_) => "exception",
        }
    }
}

/// A command by its name or what its line begins with; else any condition.
fn command(name: &str, debugger: &Debugger) -> Result<Trigger, String> {
    let name = name.trim();
    let trigger = match debugger.command_trigger(name) {
        Ok(trigger) if !name.is_empty() => return Ok(trigger),
        Ok(_) => return Err("the name of a command is missing, such as @0A".to_owned()),
        Err(error) => error,
    };
    // What has several words is hardly a command.
    debugger.read_trigger(name).map_err(|other| match name.contains(char::is_whitespace) {
        true => other.to_string(),
        false => trigger.to_string(),
    })
}

/// Error replies of these codes, with commas or blanks between them; all, if there are none.
fn errors(codes: &str, debugger: &Debugger) -> Result<Trigger, String> {
    let mut any = Vec::new();
    for code in codes.split(',').filter(|_| !codes.trim().is_empty()) {
        if code.trim().is_empty() {
            return Err(format!("a code is missing in `{codes}`: they are as in 3, 5"));
        }
        for code in code.split_whitespace() {
            let condition = debugger.error(code);
            let condition = condition
                .map_err(|right| format!("`{code}` is not {right}; several are as in 3, 5"))?;
            any.push(condition);
        }
    }
    Ok(Trigger::Condition(match any.len() {
        0 => Condition::Error { code: None },
        1 => any.remove(0),
        _ => Condition::Any(any),
    }))
}

/// The further properties of a breakpoint.
fn options(with: &With, debugger: &Debugger) -> Result<Options, String> {
    let condition = match with.condition.trim() {
        "" => None,
        text => {
            let read = Expression::parse(text, debugger.device());
            Some(read.map_err(|error| format!("the condition: {error}"))?)
        }
    };
    let log = Some(with.log_message.clone()).filter(|log| !log.is_empty());
    Ok(Options { condition, hits: hits(&with.hit_condition)?, log })
}

/// Which hits count: `5` or `= 5` is the fifth only, `>= 5` and `> 4` mean the fifth and later, `%
/// 5` every fifth.
pub(crate) fn hits(text: &str) -> Result<Hits, String> {
    let text = text.trim();
    let wrong = || {
        format!(
            "`{text}` is not a hit count; `5` is the 5th time, `>= 5` from then on, `% 5` every 5th"
        )
    };
    let operators = [">=", ">", "==", "=", "%", ""];
    let (operator, number) = operators
        .iter()
        .find_map(|operator| Some((*operator, text.strip_prefix(operator)?)))
        .ok_or_else(wrong)?;
    if text.is_empty() {
        return Ok(Hits::All);
    }
    let number: u64 = number.trim().parse().ok().filter(|n| *n > 0).ok_or_else(wrong)?;
    Ok(match operator {
        ">=" => Hits::From(number),
        ">" => Hits::From(number.saturating_add(1)),
        "%" => Hits::Every(number),
        _ => Hits::Only(number),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hit_counts_are_read() {
        for (text, hits) in [
            ("", Hits::All),
            (" 5 ", Hits::Only(5)),
            ("= 5", Hits::Only(5)),
            ("==5", Hits::Only(5)),
            (">5", Hits::From(6)),
            (">= 5", Hits::From(5)),
            ("% 5", Hits::Every(5)),
        ] {
            assert_eq!(super::hits(text), Ok(hits), "{text}");
        }
        for text in ["x", "0", "-1", "< 5", "> ", "5 5"] {
            let refused = super::hits(text).expect_err(text);
            assert!(refused.contains("is not a hit count"), "{refused}");
        }
    }
}
