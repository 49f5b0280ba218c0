//! The texts with lines: files, and listings shown from memory.

use serde_json::{Value, json};

use crate::arguments::SourceName;
use crate::held::{Held, Text};
use crate::message::Refusal;
use crate::state::Session;

/// The number of a text that is in no file. Two belong to each controller.
fn reference(thread: usize, text: Text) -> i64 {
    let of_thread = i64::try_from(thread).unwrap_or(i64::MAX / 4) * 2;
    of_thread + if text == Text::Program { 1 } else { 2 }
}

/// The text of a number.
fn referred(reference: i64) -> Option<(usize, Text)> {
    let number = usize::try_from(reference.checked_sub(1)?).ok()?;
    Some((number / 2, if number % 2 == 0 { Text::Program } else { Text::Source }))
}

impl Session {
    /// A text as it is described to a client.
    pub(crate) fn source(&self, thread: usize, text: Text) -> Value {
        let Some(held) = self.held.get(thread) else { return Value::Null };
        let name = |held: &Held| held.opened.debugger.source().map(|source| source.name.clone());
        match text {
            Text::Source if held.opened.is_file => {
                let path = name(held).unwrap_or_default();
                let short = path.rsplit(['/', '\\']).next().unwrap_or(&path).to_owned();
                json!({ "name": short, "path": path })
            }
            Text::Source => {
                let name = name(held).unwrap_or_default();
                json!({ "name": name, "sourceReference": reference(thread, text),
                    "origin": "what was recorded" })
            }
            Text::Program => {
                let name = match self.held.len() {
                    1 => "stored program".to_owned(),
                    _ => format!("stored program of {}", held.opened.name),
                };
                json!({ "name": name, "sourceReference": reference(thread, text),
                    "origin": "the controller's memory" })
            }
        }
    }

    /// The texts that a client means.
    pub(crate) fn texts(&self, source: &SourceName) -> Vec<(usize, Text)> {
        if source.reference > 0 {
            let found = referred(source.reference);
            return found.filter(|(thread, _)| *thread < self.held.len()).into_iter().collect();
        }
        let is_meant = |held: &Held| {
            let own = held.opened.debugger.source().filter(|_| held.opened.is_file);
            own.is_some_and(|own| self.opener.is_same_file(&own.name, &source.path))
        };
        let found = self.held.iter().enumerate().filter(|(_, held)| is_meant(held));
        found.map(|(thread, _)| (thread, Text::Source)).collect()
    }

    /// The lines of a text that is in no file.
    pub(crate) fn text(&self, reference: i64) -> Result<String, Refusal> {
        let found = referred(reference);
        let held = found.and_then(|(thread, text)| Some((self.held.get(thread)?, text)));
        let (held, text) =
            held.ok_or_else(|| Refusal(format!("there is no source {reference}")))?;
        let debugger = &held.opened.debugger;
        let lines = match text {
            Text::Source => debugger.source().map(|source| source.lines.clone()),
            Text::Program => debugger
                .program()
                .map(|listing| listing.lines.into_iter().map(|line| line.text).collect()),
        };
        Ok(lines.unwrap_or_default().join("\n"))
    }
}
