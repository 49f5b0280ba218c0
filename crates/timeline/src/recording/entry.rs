//! The lines of a recording: its head and its entries.

use std::sync::Arc;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use vimc4_device::{Names, OwnedInput, Time};
use vimc4_language::{read_faulting, read_ruling};

use super::text;

/// The version of the format that is written, and the highest that is read.
pub const VERSION: u32 = 1;

/// The [clock](Head::clock) of what was heard on the line of a real controller, whose times are those
/// of the computer.
pub const WALL: &str = "wall";

/// The first line: which controller was recorded, and by what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// The version of the format.
    pub recording: u32,
    /// The program that wrote it, with its version.
    pub program: String,
    /// The family of the controller.
    pub family: String,
    /// The complete profile of the model with its quirks, so that editing a profile file later
    /// changes no recording.
    pub model: Value,
    /// The complete profile of the machine.
    pub machine: Value,
    /// The clock, as on the command line: `real`, `8x`, `manual`, `instant`; [`WALL`] for what was
    /// heard on the line of a real controller.
    pub clock: String,
    /// Whether characters take time on the line.
    pub line: LineSort,
    /// The seed of the random numbers, if there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// What made the recording: `serve`, `run`, `library`, a device.
    pub from: String,
    /// The name of the controller, where there are several.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub controller: String,
    /// The number of the file, from 1, of a recording in several files.
    #[serde(default = "first", skip_serializing_if = "is_first")]
    pub part: u32,
    /// When it began, in seconds since the beginning of 1970.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub began: Option<u64>,
}

fn first() -> u32 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_first(part: &u32) -> bool {
    *part == 1
}

/// How fast characters pass on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LineSort {
    /// They take no time.
    Ideal,
    /// Each takes ten bit times.
    Paced,
}

/// One line after the head.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The model time.
    pub at: Time,
    /// What.
    pub what: What,
    /// Its line in the file, from 1; 0 if it is in no file.
    pub line: u32,
}

/// What a line tells.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// Something went in.
    Given {
        /// Where it came from.
        by: Arc<str>,
        /// What.
        given: Given,
    },
    /// Bytes left on the line.
    Sent(Bytes),
    /// The whole state. The first one is where everything begins. One with `by` was put into the
    /// controller; any other records how the controller was then.
    State {
        /// What put the controller into this state.
        by: Option<Arc<str>>,
        /// The serialised state.
        state: Value,
    },
    /// From here on the controller is led cause by cause, because its time is paused or may be. It
    /// has done everything that was due before this instant, and this many causes of those due at
    /// this instant; `None` means all of them.
    Stands(Option<u32>),
    /// It is no longer led: everything that is due is done.
    Goes,
    /// Something happened to the clients of the line.
    News(Value),
    /// A note.
    Mark(String),
    /// The recording ends here, because the controller ended or there is no room for more.
    End(String),
}

/// An input. A signal is recorded by its name, which other controllers understand too.
#[derive(Clone, Debug, PartialEq)]
pub enum Given {
    /// Bytes on the line.
    Bytes(Bytes),
    /// A signal takes a value.
    Signal {
        /// Its name, as in `start` or `input 0.3`.
        name: String,
        /// Its value.
        value: i32,
    },
    /// The mains switch.
    Power(bool),
    /// A fault begins or ends, in the words that
    /// [`write_faulting`](vimc4_device::Names::write_faulting) finds with the names of the controller.
    Fault(String),
    /// A scenario begins or ends, in the words that
    /// [`write_ruling`](vimc4_device::Names::write_ruling) finds with the names of the controller.
    Rule(String),
    /// Time has passed because an order said so.
    Wait,
}

impl Given {
    /// The recorded form of an input to a device with these names.
    #[must_use]
    pub fn of(input: &OwnedInput, names: impl FnOnce() -> Names) -> Given {
        match input {
            OwnedInput::Bytes(bytes) => Given::Bytes(bytes.clone()),
            OwnedInput::Signal(id, value) => {
                let names = names();
                let known = names.signals().iter().find(|signal| signal.id == *id);
                let name = known.map_or_else(String::new, |signal| signal.name.clone());
                Given::Signal { name, value: *value }
            }
            OwnedInput::Power(on) => Given::Power(*on),
            OwnedInput::Fault(faulting) => Given::Fault(names().write_faulting(faulting)),
            OwnedInput::Rule(ruling) => Given::Rule(names().write_ruling(ruling)),
            OwnedInput::Wake => Given::Wait,
        }
    }

    /// The input that it means for a device with these names.
    ///
    /// # Errors
    ///
    /// If the device has no such signal or fault: what is missing, for people.
    pub fn input(&self, names: impl FnOnce() -> Names) -> Result<OwnedInput, String> {
        Ok(match self {
            Given::Bytes(bytes) => OwnedInput::Bytes(bytes.clone()),
            Given::Power(on) => OwnedInput::Power(*on),
            Given::Wait => OwnedInput::Wake,
            Given::Signal { name, value } => {
                let names = names();
                let signal = names.signals().iter().find(|signal| signal.name == *name);
                OwnedInput::Signal(signal.ok_or_else(|| format!("signal {name}"))?.id, *value)
            }
            Given::Fault(words) => {
                let faulting = read_faulting(words, &names());
                OwnedInput::Fault(faulting.map_err(|_| format!("fault {words}"))?)
            }
            Given::Rule(words) => {
                let ruling = read_ruling(words, &names());
                OwnedInput::Rule(ruling.map_err(|_| format!("rule {words}"))?)
            }
        })
    }
}

impl Head {
    /// Adds the line.
    pub fn put(&self, out: &mut Vec<u8>) {
        // Serialising plain values cannot fail.
        out.extend(serde_json::to_vec(self).unwrap_or_default());
        out.push(b'\n');
    }
}

impl Entry {
    /// An entry that is in no file yet.
    #[must_use]
    pub fn new(at: Time, what: What) -> Entry {
        Entry { at, what, line: 0 }
    }

    /// Adds the line.
    pub fn put(&self, out: &mut Vec<u8>) {
        put(out, self.at, &self.what);
    }

    /// Adds a line for input bytes, without making an entry of them.
    pub fn put_given_bytes(out: &mut Vec<u8>, at: Time, bytes: &[u8], by: &str) {
        put_bytes(out, at, "in", bytes);
        put_by(out, by);
        out.extend(b"}\n");
    }

    /// Adds a line for output bytes, without making an entry of them.
    pub fn put_sent(out: &mut Vec<u8>, at: Time, bytes: &[u8]) {
        put_bytes(out, at, "out", bytes);
        out.extend(b"}\n");
    }
}

fn put_at(out: &mut Vec<u8>, at: Time) {
    out.extend(b"{\"at\":");
    put_json(out, &at.as_nanos());
}

fn put_bytes(out: &mut Vec<u8>, at: Time, key: &str, bytes: &[u8]) {
    put_at(out, at);
    put_key(out, key);
    text::put(out, bytes);
}

fn put_by(out: &mut Vec<u8>, by: &str) {
    put_key(out, "by");
    put_json(out, by);
}

fn put_key(out: &mut Vec<u8>, key: &str) {
    out.extend(b",\"");
    out.extend(key.as_bytes());
    out.extend(b"\":");
}

/// Adds a line.
fn put(out: &mut Vec<u8>, at: Time, what: &What) {
    put_at(out, at);
    let key = put_key;
    let by = match what {
        What::Given { by, given } => {
            match given {
                Given::Bytes(bytes) => {
                    key(out, "in");
                    text::put(out, bytes);
                }
                Given::Signal { name, value } => {
                    key(out, "signal");
                    put_json(out, name);
                    key(out, "value");
                    put_json(out, value);
                }
                Given::Power(on) => {
                    key(out, "power");
                    put_json(out, on);
                }
                Given::Fault(words) => {
                    key(out, "fault");
                    put_json(out, words);
                }
                Given::Rule(words) => {
                    key(out, "rule");
                    put_json(out, words);
                }
                Given::Wait => {
                    key(out, "wait");
                    put_json(out, &true);
                }
            }
            Some(by)
        }
        What::Sent(bytes) => {
            key(out, "out");
            text::put(out, bytes);
            None
        }
        What::State { by, state } => {
            key(out, "state");
            put_json(out, state);
            by.as_ref()
        }
        What::Stands(causes) => {
            key(out, "stands");
            put_json(out, &true);
            if let Some(causes) = causes {
                key(out, "causes");
                put_json(out, causes);
            }
            None
        }
        What::Goes => {
            key(out, "stands");
            put_json(out, &false);
            None
        }
        What::News(news) => {
            key(out, "news");
            put_json(out, news);
            None
        }
        What::Mark(mark) => {
            key(out, "mark");
            put_json(out, mark);
            None
        }
        What::End(why) => {
            key(out, "end");
            put_json(out, why);
            None
        }
    };
    if let Some(by) = by {
        put_by(out, by);
    }
    out.extend(b"}\n");
}

fn put_json<T: Serialize + ?Sized>(out: &mut Vec<u8>, value: &T) {
    // Serialising strings, numbers and values into a vector cannot fail.
    let _ = serde_json::to_writer(out, value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_without_an_entry_are_those_of_one() {
        let (at, bytes, by) = (Time::from_nanos(7), b"@0\"\r\xFD", "tcp \"1\": 127.0.0.1:4");
        let [given, sent] = [
            What::Given { by: by.into(), given: Given::Bytes(Bytes::from_static(bytes)) },
            What::Sent(Bytes::from_static(bytes)),
        ]
        .map(|what| {
            let mut line = Vec::new();
            Entry::new(at, what).put(&mut line);
            line
        });
        let mut line = Vec::new();
        Entry::put_given_bytes(&mut line, at, bytes, by);
        assert_eq!(line, given);
        line.clear();
        Entry::put_sent(&mut line, at, bytes);
        assert_eq!(line, sent);
    }
}
