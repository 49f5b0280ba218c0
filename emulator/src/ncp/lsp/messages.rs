//! The messages of the Language Server Protocol: JSON-RPC.
//!
//! After any input, reading goes on with the next message.

use std::io::{self, BufRead, Write};

use serde::Serialize;
use serde_json::{Value, json};
use vimc4_dap::framing::{Decoder, Frame};

use crate::framing;

/// The longest message; no job file is as long.
pub(super) const LARGEST: u64 = 256 << 20;

/// What the client says.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Incoming {
    /// It wants an answer.
    Request {
        /// What the answer is to be marked with, a number or a text.
        id: Value,
        method: String,
        params: Value,
    },
    /// It wants none.
    Notification { method: String, params: Value },
    /// An answer, though nothing is ever asked.
    Answer,
    /// Something else: what is wrong with it, and what it is marked with, if that is known.
    Unreadable { id: Value, error: Refusal },
}

impl Incoming {
    /// Whether it ends the server.
    pub(super) fn is_exit(&self) -> bool {
        matches!(self, Incoming::Notification { method, .. } if method == "exit")
    }
}

/// Why a request is not answered.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Refusal {
    code: i32,
    message: String,
}

impl Refusal {
    /// It is not JSON.
    fn parse(message: impl ToString) -> Refusal {
        Refusal { code: -32_700, message: message.to_string() }
    }

    /// It is not a message, or one that has no place here.
    pub(super) fn request(message: impl ToString) -> Refusal {
        Refusal { code: -32_600, message: message.to_string() }
    }

    /// There is no such method.
    pub(super) fn method(method: &str) -> Refusal {
        Refusal { code: -32_601, message: format!("there is no method {method}") }
    }

    /// The parameters are wrong.
    pub(super) fn params(message: impl ToString) -> Refusal {
        Refusal { code: -32_602, message: message.to_string() }
    }

    /// `initialize` has not been said.
    pub(super) fn uninitialized() -> Refusal {
        Refusal { code: -32_002, message: "initialize comes first".to_owned() }
    }
}

/// The next message; `None` at the end of the input.
pub(super) fn read(
    input: &mut impl BufRead,
    decoder: &mut Decoder,
) -> io::Result<Option<Incoming>> {
    Ok(framing::read(input, decoder)?.map(|frame| {
        let error = match frame {
            Frame::Message(bytes) => return message(&bytes),
            Frame::NoLength => Refusal::parse("a message begins with Content-Length"),
            Frame::TooLong => Refusal::request(format!("a message has {LARGEST} bytes at most")),
        };
        Incoming::Unreadable { id: Value::Null, error }
    }))
}

/// What the bytes of a message say.
fn message(bytes: &[u8]) -> Incoming {
    let mut message: Value = match serde_json::from_slice(bytes) {
        Ok(message) => message,
        Err(error) => {
            return Incoming::Unreadable { id: Value::Null, error: Refusal::parse(error) };
        }
    };
    let mut part = |name| message.get_mut(name).map(Value::take);
    let (id, method, params) = (part("id"), part("method"), part("params"));
    let params = params.unwrap_or_default();
    match (id, method) {
        (Some(id), Some(Value::String(method))) => Incoming::Request { id, method, params },
        (None, Some(Value::String(method))) => Incoming::Notification { method, params },
        (Some(_), None) if part("result").or(part("error")).is_some() => Incoming::Answer,
        (id, _) => {
            let error = Refusal::request("this is not a message of JSON-RPC");
            Incoming::Unreadable { id: id.unwrap_or_default(), error }
        }
    }
}

/// What the server says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Outgoing(Value);

impl Outgoing {
    /// The answer to a request.
    pub(super) fn answer(id: Value, result: Result<Value, Refusal>) -> Outgoing {
        Outgoing(match result {
            Ok(result) => json!({ "jsonrpc": "2.0", "id": id, "result": result }),
            Err(Refusal { code, message }) => {
                json!({ "jsonrpc": "2.0", "id": id, "error": { "code": code, "message": message } })
            }
        })
    }

    /// Something that wants no answer.
    pub(super) fn notification(method: &str, params: impl Serialize) -> Outgoing {
        Outgoing(json!({ "jsonrpc": "2.0", "method": method, "params": params }))
    }

    /// Sends it.
    pub(super) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        framing::write(out, &self.0.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(mut bytes: &[u8]) -> Vec<Incoming> {
        let mut decoder = Decoder::new(LARGEST);
        let mut next = || read(&mut bytes, &mut decoder).expect("memory can be read");
        std::iter::from_fn(&mut next).collect()
    }

    fn framed(body: &str) -> String {
        format!("Content-Length: {}\r\n\r\n{body}", body.len())
    }

    #[test]
    fn messages_are_told_apart() {
        let input = [
            r#"{"id":1,"method":"a","params":{"b":2}}"#,
            r#"{"id":"x","method":"a"}"#,
            r#"{"method":"exit","params":null}"#,
            r#"{"id":1,"result":null}"#,
        ];
        let input: String = input.iter().map(|body| framed(body)).collect();
        let request = |id, params| Incoming::Request { id, method: "a".to_owned(), params };
        assert_eq!(
            all(input.as_bytes()),
            [
                request(json!(1), json!({ "b": 2 })),
                request(json!("x"), Value::Null),
                Incoming::Notification { method: "exit".to_owned(), params: Value::Null },
                Incoming::Answer,
            ]
        );
        assert!(all(input.as_bytes())[2].is_exit());
    }

    #[test]
    fn what_is_no_message_is_told_and_the_next_is_read() {
        for (wrong, code) in [
            (framed("{"), -32_700),
            (framed("[1]"), -32_600),
            (framed(r#"{"id":5}"#), -32_600),
            (framed(r#"{"method":5}"#), -32_600),
            ("Content-Type: x\r\n\r\n".to_owned(), -32_700),
            ("Content-Length: -5\r\n\r\n".to_owned(), -32_700),
            ("\r\n".to_owned(), -32_700),
        ] {
            let input = wrong.clone() + &framed(r#"{"method":"next"}"#);
            let found = all(input.as_bytes());
            assert_eq!(found.len(), 2, "{wrong}");
            let Incoming::Unreadable { error, .. } = &found[0] else { panic!("{wrong}") };
            assert_eq!(error.code, code, "{wrong}");
            assert!(matches!(&found[1], Incoming::Notification { method, .. } if method == "next"));
        }
    }

    #[test]
    fn answers_are_framed() {
        let mut bytes = Vec::new();
        let answer = Outgoing::answer(json!(7), Err(Refusal::method("ä")));
        answer.write(&mut bytes).expect("memory can be written");
        let text = String::from_utf8(bytes).expect("JSON is UTF-8");
        let (header, body) = text.split_once("\r\n\r\n").expect("a header");
        assert_eq!(header, format!("Content-Length: {}", body.len()));
        let body: Value = serde_json::from_str(body).expect("JSON");
        assert_eq!(body["error"]["code"], -32_601);
        assert_eq!(body["id"], 7);
    }
}
