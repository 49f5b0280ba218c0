//! The messages of the protocol: requests that come; answers and events that go.

use std::fmt;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::framing::Frame;
use crate::reading;

/// The longest message from a client, in bytes: breakpoints in ten thousand lines fit.
pub const LARGEST: u64 = 1 << 20;

/// What a client says.
#[derive(Clone, Debug, PartialEq)]
pub enum Incoming {
    /// A request.
    Request(Request),
    /// Anything else: what is wrong with it, and its number, if that is known.
    Unreadable {
        /// The number of the message; 0 if it has none.
        seq: i64,
        /// The command, if that is known.
        command: String,
        /// What is wrong with it, and what would be right.
        refusal: Refusal,
    },
}

/// A request of a client.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Its number, which the answer names.
    pub seq: i64,
    /// The command.
    pub command: String,
    /// How.
    pub arguments: Value,
}

/// Why a request is refused, for people: what was wrong, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal(pub String);

impl Refusal {
    /// A sentence without its point.
    pub fn new(text: impl ToString) -> Refusal {
        Refusal(text.to_string())
    }

    /// It was cancelled.
    #[must_use]
    pub fn cancelled() -> Refusal {
        // The protocol has this word for it.
        Refusal::new("cancelled")
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Refusal {}

impl Incoming {
    /// What was read from the line.
    #[must_use]
    pub fn read(frame: Frame) -> Incoming {
        let unreadable = |seq, command, text: String| Incoming::Unreadable {
            seq,
            command,
            refusal: Refusal(text),
        };
        let bytes = match frame {
            Frame::Message(bytes) => bytes,
            Frame::NoLength => {
                let text = "a message begins with one line Content-Length: N, in digits, and an empty line";
                return unreadable(0, String::new(), text.to_owned());
            }
            Frame::TooLong => {
                let text = format!("a message has {LARGEST} bytes at most");
                return unreadable(0, String::new(), text);
            }
        };
        let mut message: Value = match serde_json::from_slice(&bytes) {
            Ok(message) => message,
            Err(error) => {
                let text = format!("this is no JSON: {error}");
                return unreadable(0, String::new(), text);
            }
        };
        let seq = message.get("seq").and_then(Value::as_i64);
        let command = message.get("command").and_then(Value::as_str).map(str::to_owned);
        let is_request = message.get("type").and_then(Value::as_str) == Some("request");
        match (seq, command) {
            (Some(seq), Some(command)) if is_request => {
                let arguments = message.get_mut("arguments").map(Value::take).unwrap_or_default();
                Incoming::Request(Request { seq, command, arguments })
            }
            (seq, command) => {
                let text = "a request has \"type\": \"request\", a number seq and a text command";
                unreadable(seq.unwrap_or(0), command.unwrap_or_default(), text.to_owned())
            }
        }
    }
}

impl Request {
    /// The arguments; missing ones have the protocol's defaults.
    ///
    /// # Errors
    ///
    /// If they are not what the request takes.
    pub(crate) fn read<T: DeserializeOwned>(&self) -> Result<T, Refusal> {
        let called = format!("the arguments of {}", self.command);
        reading::read(&called, self.arguments.clone()).map_err(Refusal)
    }
}

/// What is said to a client.
#[derive(Clone, Debug, PartialEq)]
pub enum Outgoing {
    /// The answer to a request.
    Answer {
        /// The number of the request.
        to: i64,
        /// The command.
        command: String,
        /// The result, or why it was refused.
        result: Result<Value, Refusal>,
    },
    /// Something that has happened.
    Event {
        /// What.
        event: &'static str,
        /// The body of the event.
        body: Value,
    },
}

impl Outgoing {
    /// Something that has happened.
    pub fn event(event: &'static str, body: impl Serialize) -> Outgoing {
        Outgoing::Event { event, body: serde_json::to_value(body).unwrap_or_default() }
    }

    /// The message as it is sent, with its number.
    #[must_use]
    pub fn text(&self, seq: i64) -> String {
        let mut message = match self {
            Outgoing::Answer { to, command, result: Ok(body) } => json!({
                "seq": seq, "type": "response", "request_seq": to, "success": true,
                "command": command, "body": body,
            }),
            Outgoing::Answer { to, command, result: Err(refusal) } => json!({
                "seq": seq, "type": "response", "request_seq": to, "success": false,
                "command": command, "message": refusal.0,
                "body": { "error": { "id": 1, "format": refusal.0, "showUser": true } },
            }),
            Outgoing::Event { event, body } => json!({
                "seq": seq, "type": "event", "event": event, "body": body,
            }),
        };
        if let Value::Object(parts) = &mut message
            && parts.get("body").is_some_and(Value::is_null)
        {
            parts.remove("body");
        }
        message.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Incoming {
        Incoming::read(Frame::Message(text.as_bytes().to_vec()))
    }

    #[test]
    fn requests_are_read() {
        let found = read(r#"{"seq":7,"type":"request","command":"next","arguments":{"a":1}}"#);
        let arguments = json!({ "a": 1 });
        assert_eq!(
            found,
            Incoming::Request(Request { seq: 7, command: "next".to_owned(), arguments })
        );
        let found = read(r#"{"seq":7,"type":"request","command":"threads"}"#);
        assert!(matches!(found, Incoming::Request(request) if request.arguments.is_null()));
    }

    #[test]
    fn what_is_no_request_says_what_is_wrong() {
        for (text, seq, command) in [
            ("{", 0, ""),
            ("[1]", 0, ""),
            (r#"{"seq":5}"#, 5, ""),
            (r#"{"seq":5,"command":"x"}"#, 5, "x"),
            (r#"{"seq":5,"type":"event","command":"x"}"#, 5, "x"),
            (r#"{"seq":"5","type":"request","command":"x"}"#, 0, "x"),
            (r#"{"seq":5,"type":"request","command":5}"#, 5, ""),
        ] {
            let Incoming::Unreadable { seq: found, command: wanted, refusal } = read(text) else {
                panic!("{text}");
            };
            assert_eq!((found, wanted.as_str()), (seq, command), "{text}");
            assert!(!refusal.0.is_empty());
        }
        for frame in [Frame::NoLength, Frame::TooLong] {
            assert!(matches!(Incoming::read(frame), Incoming::Unreadable { seq: 0, .. }));
        }
    }

    #[test]
    fn answers_and_events_are_as_the_protocol_has_them() {
        let command = "next".to_owned();
        let answer = Outgoing::Answer { to: 7, command: command.clone(), result: Ok(Value::Null) };
        let answer: Value = serde_json::from_str(&answer.text(3)).expect("JSON");
        assert_eq!(
            answer,
            json!({ "seq": 3, "type": "response", "request_seq": 7, "success": true, "command": "next" })
        );
        let refusal = Outgoing::Answer { to: 7, command, result: Err(Refusal::new("no")) };
        let refusal: Value = serde_json::from_str(&refusal.text(4)).expect("JSON");
        assert_eq!(refusal["message"], "no");
        assert_eq!(refusal["body"]["error"]["format"], "no");
        let event = Outgoing::event("stopped", json!({ "reason": "step" }));
        let event: Value = serde_json::from_str(&event.text(5)).expect("JSON");
        assert_eq!(event["body"]["reason"], "step");
    }
}
