//! Reading a recording. Errors name the line and column.

use std::sync::Arc;

use serde::{Deserialize, Deserializer};
use serde_json::Value;
use thiserror::Error;
use vimc4_device::Time;

use super::entry::{Entry, Given, Head, VERSION, WALL, What};
use super::text;

/// A recording in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Which controller was recorded.
    pub head: Head,
    /// What happened, in order.
    pub entries: Vec<Entry>,
    /// The number of the last line if it was torn off: the program that wrote it was killed in the
    /// middle of it. It is left out.
    pub torn: Option<u32>,
}

/// Why a file is not a recording, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: {message}; {help}")]
pub struct ReadError {
    /// The line, from 1.
    pub line: u32,
    /// The column of the line, from 1; 0 if the error concerns the line as a whole.
    pub column: u32,
    /// What is wrong, in one lower-case sentence.
    pub message: String,
    /// What would be right.
    pub help: String,
}

/// The field that every version of the format has.
#[derive(Deserialize)]
struct Version {
    recording: Option<Value>,
}

/// A line as it stands in the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenLine {
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
    fault: Option<String>,
    #[serde(default)]
    rule: Option<String>,
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

/// A field that is present, even if it is `null`.
fn present<'de, D: Deserializer<'de>>(value: D) -> Result<Option<Value>, D::Error> {
    Value::deserialize(value).map(Some)
}

impl Recording {
    /// Reads a recording.
    ///
    /// A last line without its end was torn off when the writing program was killed: it is left
    /// out, and its number is in [`Recording::torn`].
    ///
    /// # Errors
    ///
    /// If it is not a recording, one of another version, or a line of it is wrong.
    pub fn read(text: &[u8]) -> Result<Recording, ReadError> {
        let mut lines = text.split_inclusive(|byte| *byte == b'\n');
        let mut reader = Reader::begin(lines.next().unwrap_or_default())?;
        let mut entries = Vec::new();
        for line in lines {
            entries.extend(reader.line(line)?);
        }
        let torn = reader.torn();
        Ok(Recording { head: reader.into_head(), entries, torn })
    }

    /// Writes it down.
    #[must_use]
    pub fn write(&self) -> Vec<u8> {
        let mut out = Vec::new();
        self.head.put(&mut out);
        self.entries.iter().for_each(|entry| entry.put(&mut out));
        out
    }

    /// Whether it has an `end` line; otherwise the program that wrote it was killed or is still
    /// writing.
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

/// Reads a recording line by line without keeping the lines.
///
/// ```
/// use vimc4_timeline::recording::Reader;
///
/// assert!(Reader::begin(b"y\n").is_err());
/// # let head = br#"{"recording":1,"program":"a","family":"isel","model":{},"machine":{},"clock":"real","line":"ideal","from":"b"}"#;
/// let mut reader = Reader::begin(head)?;
/// assert!(reader.line(b"{\"at\":0,\"out\":\"0\"}\n")?.is_some());
/// // What is torn off is left out.
/// assert!(reader.line(b"{\"at\":9,\"o")?.is_none());
/// assert_eq!(reader.torn(), Some(3));
/// # Ok::<(), vimc4_timeline::recording::ReadError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Reader {
    head: Head,
    /// The number of the line that was read last.
    line: u32,
    /// How far time has come, and the line that says so.
    last: (Time, u32),
    has_ended: bool,
    torn: Option<u32>,
}

impl Reader {
    /// The longest line that is read, in bytes. States are the longest lines; with everything that
    /// a controller has stored they reach some hundred thousand.
    pub const LONGEST_LINE: usize = 8 << 20;

    /// Begins with the first line, the head.
    ///
    /// # Errors
    ///
    /// If it is none, or one of another version.
    pub fn begin(line: &[u8]) -> Result<Reader, ReadError> {
        if line.is_empty() {
            return Err(no_recording("the file is empty"));
        }
        too_long(line, 1)?;
        let head = read_head(line)?;
        Ok(Reader { head, line: 1, last: (Time::ZERO, 1), has_ended: false, torn: None })
    }

    /// Reads the next line, including its line end. Only the last line can lack it: that line was
    /// torn off and yields nothing. An empty line yields nothing either.
    ///
    /// # Errors
    ///
    /// If it is not a line of a recording.
    pub fn line(&mut self, text: &[u8]) -> Result<Option<Entry>, ReadError> {
        self.line = self.line.saturating_add(1);
        let line = self.line;
        too_long(text, line)?;
        if text.trim_ascii().is_empty() {
            return Ok(None);
        }
        let entry = match read_entry(text, line) {
            Ok(entry) => entry,
            Err(_) if !text.ends_with(b"\n") => {
                self.torn = Some(line);
                return Ok(None);
            }
            Err(error) => return Err(error),
        };
        if self.has_ended {
            return Err(ReadError {
                line,
                column: 0,
                message: format!("line {line} comes after the end"),
                help: "a recording ends with its line `end`; a second one is a file of its own"
                    .to_owned(),
            });
        }
        let (time, of) = self.last;
        // What a real controller says is on its way for a while.
        let may_be_late = matches!(entry.what, What::Sent(_)) && self.head.clock == WALL;
        if entry.at < time && !may_be_late {
            return Err(ReadError {
                line,
                column: 1,
                message: format!(
                    "its time, {}, is before that of line {of}, {}",
                    entry.at.as_nanos(),
                    time.as_nanos()
                ),
                help: "lines are in the order in which things happened".to_owned(),
            });
        }
        match &entry.what {
            // Going back to a state goes back to its time.
            What::State { by: Some(_), .. } => self.last = (Time::ZERO, line),
            // Clients come and go by the clock, and the controller may not have come so far.
            What::News(_) => {}
            _ if entry.at > time => self.last = (entry.at, line),
            _ => {}
        }
        self.has_ended = matches!(entry.what, What::End(_));
        Ok(Some(entry))
    }

    /// The first line.
    #[must_use]
    pub fn head(&self) -> &Head {
        &self.head
    }

    /// The same, where nothing more is read.
    #[must_use]
    pub fn into_head(self) -> Head {
        self.head
    }

    /// The number of the last line if it was torn off.
    #[must_use]
    pub fn torn(&self) -> Option<u32> {
        self.torn
    }

    /// Whether the `end` line has been read.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.has_ended
    }
}

fn too_long(text: &[u8], line: u32) -> Result<(), ReadError> {
    if text.len() <= Reader::LONGEST_LINE {
        return Ok(());
    }
    let message = format!("it has more than {} MiB", Reader::LONGEST_LINE >> 20);
    let help = "no line of a recording is so long; break what goes in into several lines";
    Err(ReadError { line, column: 0, message, help: help.to_owned() })
}

fn no_recording(message: &str) -> ReadError {
    ReadError {
        line: 1,
        column: 0,
        message: format!("this is not a recording: {message}"),
        help: "name a file that `--record` or `vimc4 record` has written".to_owned(),
    }
}

/// Some editors put this before a text in UTF-8. It is none of the text.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

fn read_head(line: &[u8]) -> Result<Head, ReadError> {
    let line = line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(line);
    if let [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] | [b'{', 0, ..] | [0, b'{', ..] = line {
        return Err(ReadError {
            help: "save it as plain text, which is UTF-8".to_owned(),
            ..no_recording("it is text in UTF-16")
        });
    }
    let version = serde_json::from_slice::<Version>(line);
    let Ok(Version { recording: Some(version) }) = version else {
        return Err(no_recording("its first line is not a head"));
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
    let read: WrittenLine =
        serde_json::from_slice(text).map_err(|error| wrong(&error, line, "a line"))?;
    let error =
        |message: String, help: &str| ReadError { line, column: 0, message, help: help.to_owned() };
    let bytes = |written: &str, key: &str| {
        text::bytes(written).map_err(|c| {
            error(
                format!("`{key}` has the character {c:?}, which is not a byte"),
                "a byte is the character with its number, up to \\u00ff",
            )
        })
    };
    let given = |given: Given, by: Option<Arc<str>>| What::Given {
        by: by.unwrap_or_else(|| Arc::from("")),
        given,
    };
    let WrittenLine {
        at,
        given: input,
        out,
        signal,
        value,
        power,
        fault,
        rule,
        wait,
        state,
        stands,
        ..
    } = read;
    let WrittenLine { causes, news, mark, end, by, .. } = read;
    let by_nobody = by.is_none();
    // Each field is one kind of content that a line can have.
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
    said.extend(fault.map(|words| given(Given::Fault(words), by.clone())));
    said.extend(rule.map(|words| given(Given::Rule(words), by.clone())));
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
            "each line has `at` and one of `in`, `out`, `signal` with `value`, `power`, `fault`, \
             `rule`, `wait`, `state`, `stands`, `news`, `mark` and `end`; `by` belongs to what was done",
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
