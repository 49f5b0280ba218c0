//! The happenings of a condition, and the events that show them.

use super::{Condition, vocabulary};
use crate::{Event, Kinds};

impl Condition {
    /// The kinds of events that show its happenings; none if it has only states.
    #[must_use]
    pub fn kinds(&self) -> Kinds {
        match self {
            Condition::Command { .. } | Condition::Line { .. } => Kinds::COMMAND,
            Condition::Answered { .. } | Condition::Answer { .. } | Condition::Error { .. } => {
                Kinds::ANSWER
            }
            Condition::SignalChanges { .. } => Kinds::SIGNAL,
            Condition::All(parts) | Condition::Any(parts) => {
                parts.iter().fold(Kinds::NONE, |kinds, part| kinds.and(part.kinds()))
            }
            _ => Kinds::NONE,
        }
    }

    /// Whether it has happenings, so that it can begin to hold because of something from outside.
    #[must_use]
    pub fn has_happenings(&self) -> bool {
        self.kinds() != Kinds::NONE
    }

    /// Whether an event shows a happening.
    #[must_use]
    pub fn is_seen_in(&self, event: &Event) -> bool {
        let is = |wanted: &Option<String>, mnemonic: &str| {
            wanted.as_ref().is_none_or(|wanted| vocabulary::is_mnemonic(mnemonic, wanted))
        };
        match (self, event) {
            (Condition::Command { like }, Event::Command { mnemonic, bytes }) => {
                let begins = |like: &String| bytes.starts_with(like.as_bytes());
                is(like, mnemonic) || like.as_ref().is_some_and(begins)
            }
            (Condition::Answered { like }, Event::Answer { mnemonic, .. }) => is(like, mnemonic),
            (Condition::Answer { text }, Event::Answer { bytes, .. }) => {
                bytes.trim_ascii_end() == text.as_bytes()
            }
            (Condition::Error { code }, Event::Answer { bytes, why: Some(_), .. }) => {
                let text = bytes.trim_ascii_end();
                code.as_ref().is_none_or(|code| vocabulary::is_error(text, code.as_bytes()))
            }
            (Condition::Line { line: wanted }, Event::Line { line, .. }) => {
                wanted.is_none_or(|wanted| wanted == *line)
            }
            (Condition::SignalChanges { signal, to }, Event::Signal { signal: other, value }) => {
                signal == other && to.is_none_or(|to| to == *value)
            }
            _ => false,
        }
    }
}
