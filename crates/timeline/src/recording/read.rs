//! Reading a recording, with errors that point at the place.

use std::sync::Arc;

use serde::{Deserialize, Deserializer};
use serde_json::Value;
use thiserror::Error;
use vimc4_device::Time;

use super::entry::{Entry, Given, Head, VERSION, What};
use super::text;

/// A recording that was read, or is to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Of which controller.
    pub head: Head,
    /// What happened, in order.
    pub entries: Vec<Entry>,
    /// The number of the last line if it was torn off: the program that wrote it was killed in the
    /// middle of it. It is left out.
    pub torn: Option<u32>,
}

/// Why a file is no recording, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: {message}; {help}")]
pub struct ReadError {
    /// The line, from 1.
    pub line: u32,
    /// The character of the line, from 1; 0 if it is about the line as a whole.
    pub column: u32,
    /// What is wrong, in one lower-case sentence.
    pub message: String,
    /// What would be right.
    pub help: String,
}

/// The one thing that every version of the format has.
#[derive(Deserialize)]
struct Version {
    recording: Option<Value>,
}

/// A line as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    at: Time,
    #[serde(default, rename = "in")]
    given: Option<String>,
    #[serde(default)]
    out: Option<String>,
    #[serde(default)]
    signal: Option<String>,
    #[serde(default)]
    value: Option<i32>,
    #[serde(default)]
    power: Option<bool>,
    #[serde(default)]
    wait: Option<bool>,
    #[serde(default, deserialize_with = "present")]
    state: Option<Value>,
    #[serde(default)]
    stands: Option<bool>,
    #[serde(default)]
    causes: Option<u32>,
    #[serde(default, deserialize_with = "present")]
    news: Option<Value>,
    #[serde(default)]
    mark: Option<String>,
    #[serde(default)]
    end: Option<String>,
    #[serde(default)]
    by: Option<Arc<str>>,
}

/// A value that is there, also if it is `null`.
fn present<'de, D: Deserializer<'de>>(value: D) -> Result<Option<Value>, D::Error> {
    Value::deserialize(value).map(Some)
}

impl Recording {
    /// Reads a recording.
    ///
    /// A last line without its end was torn off when whoever wrote it was killed: it is left out, and
    /// [said](Recording::torn).
    ///
    /// # Errors
    ///
    /// If it is no recording, one of another version, or a line of it is wrong.
    pub fn read(text: &[u8]) -> Result<Recording, ReadError> {
        let mut lines = text.split_inclusive(|byte| *byte == b'\n').zip(1..);
        let Some((first, _)) = lines.next() else {
            return Err(no_recording("the file is empty"));
        };
        let head = read_head(first)?;
        let mut recording = Recording { head, entries: Vec::new(), torn: None };
        // What happens has a time that does not go back, but for what came out late.
        let mut last = Time::ZERO;
        for (text, line) in lines {
            if text.trim_ascii().is_empty() {
                continue;
            }
            let entry = match read_entry(text, line) {
                Ok(entry) => entry,
                // Only the last line can have no end.
                Err(_) if !text.ends_with(b"\n") => {
                    recording.torn = Some(line);
                    break;
                }
                Err(error) => return Err(error),
            };
            match &entry.what {
                // Who goes back to a state goes back to its time.
                What::State { by: Some(_), .. } => last = Time::ZERO,
                What::Given { .. } if entry.at < last => {
                    return Err(ReadError {
                        line,
                        column: 1,
                        message: format!(
                            "its time, {}, is before that of what was given before, {}",
                            entry.at.as_nanos(),
                            last.as_nanos()
                        ),
                        help: "lines stand in the order in which they happened".to_owned(),
                    });
                }
                What::Given { .. } => last = entry.at,
                _ => {}
            }
            recording.entries.push(entry);
        }
        Ok(recording)
    }

    /// Writes it down.
    #[must_use]
    pub fn write(&self) -> Vec<u8> {
        let mut out = Vec::new();
        self.head.put(&mut out);
        self.entries.iter().for_each(|entry| entry.put(&mut out));
        out
    }

    /// Whether it goes up to an end that was written down; else whoever wrote it was killed, or is
    /// still writing.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        matches!(self.entries.last().map(|entry| &entry.what), Some(What::End(_)))
    }

    /// The state in which it begins.
    #[must_use]
    pub fn first_state(&self) -> Option<&Value> {
        self.entries.iter().find_map(|entry| match &entry.what {
            What::State { state, .. } => Some(state),
            _ => None,
        })
    }
}

fn no_recording(message: &str) -> ReadError {
    ReadError {
        line: 1,
        column: 0,
        message: format!("this is no recording: {message}"),
        help: "name a file that `--record` or `vimc4 record` has written".to_owned(),
    }
}

fn read_head(line: &[u8]) -> Result<Head, ReadError> {
    let version = serde_json::from_slice::<Version>(line);
    let Ok(Version { recording: Some(version) }) = version else {
        return Err(no_recording("its first line is no head"));
    };
    if version != VERSION {
        return Err(ReadError {
            line: 1,
            column: 0,
            message: format!("it is a recording of version {version}"),
            help: format!("this program reads version {VERSION}; take the one that has written it"),
        });
    }
    serde_json::from_slice(line).map_err(|error| wrong(&error, 1, "the head"))
}

fn read_entry(text: &[u8], line: u32) -> Result<Entry, ReadError> {
    let read: Line = serde_json::from_slice(text).map_err(|error| wrong(&error, line, "a line"))?;
    let error =
        |message: String, help: &str| ReadError { line, column: 0, message, help: help.to_owned() };
    let bytes = |written: &str, key: &str| {
        text::bytes(written).map_err(|c| {
            error(
                format!("`{key}` has the character {c:?}, which stands for no byte"),
                "a byte is the character with its number, up to \\u00ff",
            )
        })
    };
    let given = |given: Given, by: Option<Arc<str>>| What::Given {
        by: by.unwrap_or_else(|| Arc::from("")),
        given,
    };
    let Line { at, given: input, out, signal, value, power, wait, state, stands, causes, .. } =
        read;
    let Line { news, mark, end, by, .. } = read;
    let by_nobody = by.is_none();
    // Each field is one thing that a line can say.
    let mut said = Vec::new();
    if let Some(text) = input {
        said.push(given(Given::Bytes(bytes(&text, "in")?), by.clone()));
    }
    match (signal, value) {
        (Some(name), Some(value)) => said.push(given(Given::Signal { name, value }, by.clone())),
        (None, None) => {}
        _ => return Err(error("`signal` and `value` stand together".to_owned(), "name both")),
    }
    said.extend(power.map(|on| given(Given::Power(on), by.clone())));
    said.extend(wait.filter(|wait| *wait).map(|_| given(Given::Wait, by.clone())));
    said.extend(state.map(|state| What::State { by, state }));
    let done = said.len();
    if let Some(text) = out {
        said.push(What::Sent(bytes(&text, "out")?));
    }
    match (stands, causes) {
        (Some(true), causes) => said.push(What::Stands(causes)),
        (Some(false), None) => said.push(What::Goes),
        (None, None) => {}
        _ => {
            return Err(error(
                "`causes` is too much".to_owned(),
                "it belongs to `\"stands\":true`",
            ));
        }
    }
    said.extend(news.map(What::News));
    said.extend(mark.map(What::Mark));
    said.extend(end.map(What::End));
    let one = (said.len() == 1 && (done == 1 || by_nobody)).then(|| said.pop()).flatten();
    let Some(what) = one else {
        return Err(error(
            "it does not say one thing".to_owned(),
            "each line has `at` and one of `in`, `out`, `signal` with `value`, `power`, `wait`, \
             `state`, `stands`, `news`, `mark` and `end`; `by` belongs to what was done",
        ));
    };
    Ok(Entry { at, what, line })
}

fn wrong(error: &serde_json::Error, line: u32, what: &str) -> ReadError {
    let message = error.to_string();
    let message = message.split(" at line ").next().unwrap_or_default();
    ReadError {
        line,
        column: u32::try_from(error.column()).unwrap_or(u32::MAX),
        message: format!("{what} of a recording cannot be read: {message}"),
        help: "docs/recordings.md has every line that there is; put it right, or cut before it"
            .to_owned(),
    }
}
