//! How messages follow each other on a line: a header with the length, an empty line, the message.
//!
//! The protocol of debuggers and that of language servers have this in common. Whatever arrives,
//! reading goes on with the next message.
//!
//! ```
//! use vimc4_dap::framing::{Decoder, Frame, framed};
//!
//! let bytes = framed("{}") + "Content-Length: 2\r\n";
//! let mut bytes = bytes.as_bytes();
//! let mut decoder = Decoder::new(1_000);
//! assert_eq!(decoder.decode(&mut bytes), Ok(Some(Frame::Message(b"{}".to_vec()))));
//! assert_eq!(decoder.decode(&mut bytes), Ok(None));
//! ```

use std::fmt;

/// The longest line of a header, in bytes.
const LONGEST: usize = 8_192;

/// Something that was read whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Frame {
    /// The message after a header.
    Message(Vec<u8>),
    /// A header without the length of its message. What follows is read as a header.
    NoLength,
    /// A message beyond the permitted length, which is skipped.
    TooLong,
}

/// The input is not a header: the other side speaks another protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    /// A line of a header does not end.
    EndlessLine,
    /// The first line of all is not one of a header, as that of a request of HTTP.
    FirstLine,
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Foreign::EndlessLine => "a header has a line without an end",
            Foreign::FirstLine => "the first line is neither Content-Length nor Content-Type",
        })
    }
}

impl std::error::Error for Foreign {}

/// Finds the messages in a stream that comes in pieces.
#[derive(Clone, Debug)]
pub struct Decoder {
    /// The longest message, in bytes.
    largest: u64,
    within: Within,
    /// Whether a line of a header has come.
    has_begun: bool,
}

#[derive(Clone, Debug)]
enum Within {
    /// In a header: the line so far, and the length that an earlier line gave, if it is the only one.
    Header { line: Vec<u8>, length: Option<Option<u64>> },
    /// In a message: what has come, and how much is still to come.
    Message { bytes: Vec<u8>, left: u64 },
    /// In a message that is skipped.
    Skipped { left: u64 },
}

impl Within {
    fn nothing() -> Within {
        Within::Header { line: Vec::new(), length: None }
    }
}

impl Decoder {
    /// A decoder before the first message. Messages longer than `largest` bytes are skipped.
    #[must_use]
    pub fn new(largest: u64) -> Decoder {
        Decoder { largest, within: Within::nothing(), has_begun: false }
    }

    /// Whether no part of a message has come yet.
    #[must_use]
    pub fn is_between(&self) -> bool {
        matches!(&self.within, Within::Header { line, length: None } if line.is_empty())
    }

    /// Takes bytes from the beginning until a message is complete. If none is, all bytes are taken,
    /// and the rest is expected next time.
    ///
    /// # Errors
    ///
    /// If a line of a header does not end, or the first line is not one. Nothing more can be read then.
    pub fn decode(&mut self, bytes: &mut &[u8]) -> Result<Option<Frame>, Foreign> {
        loop {
            match &mut self.within {
                Within::Header { line, length } => {
                    let end = bytes.iter().position(|byte| *byte == b'\n');
                    let taken = end.map_or(bytes.len(), |end| end + 1);
                    if line.len() + taken > LONGEST {
                        return Err(Foreign::EndlessLine);
                    }
                    line.extend_from_slice(&bytes[..taken]);
                    *bytes = &bytes[taken..];
                    if end.is_none() {
                        return Ok(None);
                    }
                    let whole = std::mem::take(line);
                    let whole = whole.trim_ascii();
                    if !whole.is_empty() {
                        if !self.has_begun && !is_header(whole) {
                            return Err(Foreign::FirstLine);
                        }
                        self.has_begun = true;
                        if let Some(said) = said(whole) {
                            *length = Some(said.filter(|_| length.is_none()));
                        }
                        continue;
                    }
                    let Some(left) = length.take().flatten() else {
                        return Ok(Some(Frame::NoLength));
                    };
                    if left > self.largest {
                        // Said now: it may never come.
                        self.within = Within::Skipped { left };
                        return Ok(Some(Frame::TooLong));
                    }
                    // Memory is allocated for what arrives, not for the announced length.
                    self.within = Within::Message { bytes: Vec::new(), left };
                }
                Within::Message { bytes: message, left } => {
                    message.extend_from_slice(take(bytes, left));
                    if *left > 0 {
                        return Ok(None);
                    }
                    let message = std::mem::take(message);
                    self.within = Within::nothing();
                    return Ok(Some(Frame::Message(message)));
                }
                Within::Skipped { left } => {
                    take(bytes, left);
                    if *left > 0 {
                        return Ok(None);
                    }
                    self.within = Within::nothing();
                }
            }
        }
    }
}

/// The beginning of the input, up to `left` bytes, which count down.
fn take<'b>(bytes: &mut &'b [u8], left: &mut u64) -> &'b [u8] {
    let count = usize::try_from(*left).unwrap_or(usize::MAX).min(bytes.len());
    let (taken, rest) = bytes.split_at(count);
    *bytes = rest;
    *left -= count as u64;
    taken
}

/// Whether a line is one of the headers that there are.
fn is_header(line: &[u8]) -> bool {
    let name = line.split(|byte| *byte == b':').next().unwrap_or_default().trim_ascii();
    [&b"Content-Length"[..], b"Content-Type"].iter().any(|known| known.eq_ignore_ascii_case(name))
}

/// The length that a line of a header says; if it is about that and says none, nothing within.
fn said(line: &[u8]) -> Option<Option<u64>> {
    let line = String::from_utf8_lossy(line);
    let (name, value) = line.split_once(':')?;
    let is_length = name.trim_end().eq_ignore_ascii_case("Content-Length");
    let value = value.trim();
    // A sign is no digit.
    let is_number = value.bytes().all(|byte| byte.is_ascii_digit());
    is_length.then(|| value.parse().ok().filter(|_| is_number))
}

/// A message with its header.
#[must_use]
pub fn framed(message: &str) -> String {
    format!("Content-Length: {}\r\n\r\n{message}", message.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Everything that is found in these bytes, given in pieces of this size.
    fn found(bytes: &[u8], size: usize) -> Vec<Frame> {
        let mut decoder = Decoder::new(20);
        let mut found = Vec::new();
        for mut piece in bytes.chunks(size) {
            while let Some(frame) = decoder.decode(&mut piece).expect("a header ends") {
                found.push(frame);
            }
            assert!(piece.is_empty());
        }
        found
    }

    #[test]
    fn messages_are_found_however_they_come() {
        let long = "x".repeat(21);
        let bytes = [
            framed("one"),
            "content-length : 3\nContent-Type: x\n\ntwo".to_owned(),
            "Content-Type: x\r\n\r\n".to_owned(),
            "Content-Length: -5\r\n\r\n".to_owned(),
            "Content-Length: +5\r\n\r\n".to_owned(),
            "Content-Length: 5\r\nContent-Length: 6\r\n\r\n".to_owned(),
            "Content-Length: 5\r\nContent-Length: x\r\n\r\n".to_owned(),
            "Content-Length: 2\r\nContent-Length: 2\r\n\r\n".to_owned(),
            framed(&long),
            "\r\n".to_owned(),
            framed(""),
            framed("ä"),
            "Content-Length: 5\r\n\r\ntorn".to_owned(),
        ];
        let bytes = bytes.concat();
        let message = |text: &str| Frame::Message(text.as_bytes().to_vec());
        for size in 1..bytes.len() {
            assert_eq!(
                found(bytes.as_bytes(), size),
                [
                    message("one"),
                    message("two"),
                    Frame::NoLength,
                    Frame::NoLength,
                    Frame::NoLength,
                    Frame::NoLength,
                    Frame::NoLength,
                    Frame::NoLength,
                    Frame::TooLong,
                    Frame::NoLength,
                    message(""),
                    message("ä"),
                ],
                "pieces of {size}"
            );
        }
    }

    #[test]
    fn a_message_that_is_too_long_is_told_of_before_it_comes() {
        let mut decoder = Decoder::new(20);
        let mut bytes: &[u8] = b"Content-Length: 999999999\r\n\r\n";
        assert_eq!(decoder.decode(&mut bytes), Ok(Some(Frame::TooLong)));
        assert_eq!(decoder.decode(&mut &b"the beginning of it"[..]), Ok(None));
    }

    #[test]
    fn no_length_makes_it_ask_for_memory() {
        let mut decoder = Decoder::new(u64::MAX);
        let text = format!("Content-Length: {}\r\n\r\n{{}}", u64::MAX);
        assert_eq!(decoder.decode(&mut text.as_bytes()), Ok(None));
        assert!(!decoder.is_between());
    }

    #[test]
    fn a_line_without_an_end_is_another_language() {
        let mut decoder = Decoder::new(20);
        let noise = vec![b'x'; 5_000];
        assert_eq!(decoder.decode(&mut noise.as_slice()), Ok(None));
        assert_eq!(decoder.decode(&mut noise.as_slice()), Err(Foreign::EndlessLine));
    }

    #[test]
    fn a_request_of_http_is_another_language() {
        let post = b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\n\r\n{}";
        let decode = |bytes: &[u8]| Decoder::new(20).decode(&mut &*bytes);
        assert_eq!(decode(post), Err(Foreign::FirstLine));
        assert_eq!(decode(b"Content-Type: x\r\nHost: x\r\n"), Ok(None));
    }
}
