//! The words that faults are written in, one by one.

use std::error::Error;
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use bytes::Bytes;

use super::Chance;
use crate::condition::excerpt;
use crate::nth::Nth;
use crate::{parse_duration, show_nanos, unescape};

/// Why a text is not a fault: where it goes wrong, and what would be right there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultError {
    text: String,
    /// What follows the place up to which it was read.
    rest: String,
    right: String,
}

impl FaultError {
    /// What would be right, for people.
    #[must_use]
    pub fn right(&self) -> &str {
        &self.right
    }

    /// What follows the place up to which it was read.
    pub(crate) fn rest(&self) -> &str {
        &self.rest
    }
}

impl fmt::Display for FaultError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        excerpt(f, &self.text, &self.rest, &self.right)
    }
}

impl Error for FaultError {}

/// A span of time as it is read.
pub(super) struct Span(pub(super) Duration);

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&show_nanos(u64::try_from(self.0.as_nanos()).unwrap_or(u64::MAX)))
    }
}

/// Reads the whole of a text.
pub(super) fn whole<T>(
    text: &str,
    read: impl FnOnce(&mut Words<'_>) -> Result<T, FaultError>,
) -> Result<T, FaultError> {
    let text = text.trim();
    let mut words = Words { text, rest: text };
    let read = read(&mut words)?;
    match words.rest {
        "" => Ok(read),
        _ => Err(words.wrong("nothing more")),
    }
}

/// A text and what of it is to be read, which begins with no blank.
pub(super) struct Words<'t> {
    text: &'t str,
    pub(super) rest: &'t str,
}

impl<'t> Words<'t> {
    pub(super) fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    pub(super) fn wrong(&self, right: impl Into<String>) -> FaultError {
        self.wrong_at(self.rest, right)
    }

    pub(super) fn wrong_at(&self, rest: &str, right: impl Into<String>) -> FaultError {
        FaultError { text: self.text.to_owned(), rest: rest.to_owned(), right: right.into() }
    }

    pub(super) fn peek(&self) -> &'t str {
        self.rest.split_whitespace().next().unwrap_or_default()
    }

    pub(super) fn word(&mut self) -> Option<&'t str> {
        let word = self.rest.split_whitespace().next()?;
        self.rest = self.rest.get(word.len()..).unwrap_or_default().trim_start();
        Some(word)
    }

    pub(super) fn take_if(&mut self, wanted: &str) -> bool {
        let is = self.peek().eq_ignore_ascii_case(wanted);
        if is {
            self.word();
        }
        is
    }

    pub(super) fn take_parsed<T: FromStr>(&mut self) -> Option<T> {
        let parsed = self.peek().parse().ok()?;
        self.word();
        Some(parsed)
    }

    pub(super) fn parsed<T: FromStr>(&mut self, right: &str) -> Result<T, FaultError> {
        self.take_parsed().ok_or_else(|| self.wrong(right))
    }

    /// A number from 1 on with one of these words behind it, if there is one. Of 0, and of a number that
    /// is too large, it says so; `least` is said of 0.
    pub(super) fn counted(
        &mut self,
        units: &[&str],
        least: &str,
    ) -> Result<Option<u64>, FaultError> {
        let here = self.rest;
        let number = self.word().unwrap_or_default();
        let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
        if !is_number || !units.iter().any(|unit| self.take_if(unit)) {
            self.rest = here;
            return Ok(None);
        }
        match number.parse() {
            Ok(0) => Err(self.wrong_at(here, least)),
            Ok(number) => Ok(Some(number)),
            Err(_) => Err(self.wrong_at(here, "a smaller number, up to 18446744073709551615")),
        }
    }

    /// What is wrong with a word that was meant for a probability or for one of many bytes.
    pub(super) fn amiss(&self) -> Option<FaultError> {
        let word = self.peek();
        let digits = word.bytes().take_while(u8::is_ascii_digit).count();
        let (number, end) =
            word.split_at_checked(digits).filter(|(number, _)| !number.is_empty())?;
        if let Some(percent) = word.strip_suffix('%') {
            return Some(self.wrong(match percent.parse::<f64>() {
                Ok(percent) if percent > 100.0 => "no more than 100%",
                _ => "a probability with at most four places, as in `5%` or `0.5%`",
            }));
        }
        if !["st", "nd", "rd", "th"].contains(&end) {
            return None;
        }
        let nth = number.parse().unwrap_or(1).max(1);
        Some(self.wrong(format!("which byte, as in `{} byte`", Nth(nth))))
    }

    /// The number that a word such as `10th` says.
    pub(super) fn peek_ordinal(&self) -> Option<u64> {
        Nth::read(self.peek())
    }

    /// `10th`, or `10`.
    pub(super) fn ordinal(&mut self) -> Option<u64> {
        let plain = || self.peek().parse().ok().filter(|number| *number > 0);
        let number = self.peek_ordinal().or_else(plain)?;
        self.word();
        Some(number)
    }

    pub(super) fn nth_byte(&mut self) -> Option<u64> {
        let here = self.rest;
        let number = self.peek_ordinal();
        self.word();
        if number.is_some() && self.take_if("byte") {
            return number;
        }
        self.rest = here;
        None
    }

    pub(super) fn chance(&mut self) -> Option<Chance> {
        let number = self.peek().strip_suffix('%')?;
        let (whole, places) = number.split_once('.').unwrap_or((number, ""));
        let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        if whole.is_empty() || places.len() > 4 || !is_number(whole) || !is_number(places) {
            return None;
        }
        let places = format!("{places:0<4}").parse().ok()?;
        let millionths = whole.parse::<u32>().ok()?.checked_mul(10_000)?.checked_add(places)?;
        (millionths <= 1_000_000).then(|| self.word())?;
        Some(Chance::millionths(millionths))
    }

    pub(super) fn time(&mut self, example: &str) -> Result<Duration, FaultError> {
        let time = parse_duration(self.peek());
        let time = time.map_err(|_| self.wrong(format!("a time, as in `{example}`")))?;
        self.word();
        Ok(time)
    }

    /// Bytes as [`escape`] writes them, between quotation marks or up to a blank.
    pub(super) fn bytes(&mut self, right: &str) -> Result<Bytes, FaultError> {
        let (written, rest) = match self.rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').ok_or_else(|| self.wrong(right))?,
            None => self.rest.split_at(self.peek().len()),
        };
        let is_plain = !written.is_empty() && written.bytes().all(|c| matches!(c, b' '..=b'~'));
        let bytes = is_plain.then(|| unescape(written).ok()).flatten();
        let bytes = bytes.ok_or_else(|| self.wrong(right))?;
        self.rest = rest.trim_start();
        Ok(bytes.into())
    }
}

/// A text up to one of some words outside of quotation marks, and what is left from that word on.
pub(super) fn up_to<'t>(text: &'t str, ends: &[&str]) -> (&'t str, &'t str) {
    let (mut quoted, mut escaped) = (false, false);
    for (at, c) in text.char_indices() {
        if escaped {
            escaped = false;
        } else if quoted && c == '\\' {
            escaped = true;
        } else if c == '"' {
            quoted = !quoted;
        } else if !quoted && c.is_whitespace() {
            let rest = text.get(at..).unwrap_or_default().trim_start();
            if ends.contains(&rest.split_whitespace().next().unwrap_or_default()) {
                return (text.get(..at).unwrap_or_default(), rest);
            }
        }
    }
    (text, "")
}
