//! What the lines of a recording say.

use std::sync::Arc;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use vimc4_device::{Names, OwnedInput, Time};

use super::text;

/// The version of the format that is written, and the highest that is read.
pub const VERSION: u32 = 1;

/// The first line: of which controller it is a recording, and where it comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// The version of the format.
    pub recording: u32,
    /// The program that has written it, with its version.
    pub program: String,
    /// The family of the controller.
    pub family: String,
    /// The profile of the model, whole, with its quirks: a profile file that is edited later
    /// changes no recording.
    pub model: Value,
    /// The profile of the machine, whole.
    pub machine: Value,
    /// The clock, as on the command line: `real`, `8x`, `manual`, `instant`; `wall` for what was
    /// heard on the line of a real controller, whose times are those of this computer.
    pub clock: String,
    /// Whether characters take their time on the line.
    pub line: LineSort,
    /// What chance began with, where there is chance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Who has recorded: `serve`, `run`, `library`, a device.
    pub from: String,
    /// Which of several controllers, by its name.
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

/// How fast characters are on a line.
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
    /// On which line of the file it stands, from 1; 0 if it stands in none.
    pub line: u32,
}

/// What a line tells.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// Something went in.
    Given {
        /// Who has done it.
        by: Arc<str>,
        /// What.
        given: Given,
    },
    /// Bytes left on the line.
    Sent(Bytes),
    /// The whole state. The first is where everything begins; with `by`, somebody has put the
    /// controller into it; any other says how it was then.
    State {
        /// Who has put it into the state.
        by: Option<Arc<str>>,
        /// The state, as it is written down.
        state: Value,
    },
    /// From here on the controller is led cause by cause, because its time is paused or may be: it
    /// has done everything that was due before, and of what is due at this instant so many causes more;
    /// `None` if all of it.
    Stands(Option<u32>),
    /// It is not led any more: all that is due is done.
    Goes,
    /// Something about the clients of the line.
    News(Value),
    /// A note.
    Mark(String),
    /// The recording ends here, with the controller or because there is no room for more.
    End(String),
}

/// What went in. A signal has its name, which says the same to other controllers.
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
    /// Time has passed because somebody has ordered it.
    Wait,
}

impl Given {
    /// An input, as it is written down for a device with these names.
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
            OwnedInput::Wake => Given::Wait,
        }
    }

    /// The input that it is to a device with these names.
    ///
    /// # Errors
    ///
    /// If it has no such signal, or knows no such fault: what it does not have, for people.
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
                let faulting = names().read_faulting(words);
                OwnedInput::Fault(faulting.map_err(|_| format!("fault {words}"))?)
            }
        })
    }
}

impl Head {
    /// Adds the line.
    pub fn put(&self, out: &mut Vec<u8>) {
        // A structure of values can always be written.
        out.extend(serde_json::to_vec(self).unwrap_or_default());
        out.push(b'\n');
    }
}

impl Entry {
    /// An entry that stands in no file yet.
    #[must_use]
    pub fn new(at: Time, what: What) -> Entry {
        Entry { at, what, line: 0 }
    }

    /// Adds the line.
    pub fn put(&self, out: &mut Vec<u8>) {
        put(out, self.at, &self.what);
    }

    /// Adds the line of bytes that were given, without an entry of them.
    pub fn put_given_bytes(out: &mut Vec<u8>, at: Time, bytes: &[u8], by: &str) {
        put_bytes(out, at, "in", bytes);
        put_by(out, by);
        out.extend(b"}\n");
    }

    /// Adds the line of bytes that left, without an entry of them.
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
    // Strings, numbers and values can always be written, and there is always room.
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
