//! The lexer of all grammars.

use std::ops::Range;
use std::str::FromStr;
use std::time::Duration;

use nom::branch::alt;
use nom::bytes::complete::{tag, take_till1, take_while1};
use nom::character::complete::{char, hex_digit1, none_of, one_of};
use nom::combinator::{map_opt, value, verify};
use nom::sequence::{delimited, preceded};
use nom::{IResult, Parser};
use vimc4_device::{Names, Nth, Signal, parse_duration};

use crate::SyntaxError;

pub(crate) type Read<T> = Result<T, SyntaxError>;

/// A text, and the part of it that is still to be read. Blanks around that part are skipped.
///
/// Copying a lexer marks a place to return to, or to report as wrong.
#[derive(Clone, Copy, Debug)]
pub struct Lexer<'t> {
    text: &'t str,
    at: usize,
    end: usize,
}

impl<'t> Lexer<'t> {
    /// Begins to read a text.
    #[must_use]
    pub fn new(text: &'t str) -> Lexer<'t> {
        Lexer { text, at: 0, end: 0 }.part(0..text.len())
    }

    /// A part of the text, without the blanks around it.
    fn part(self, range: Range<usize>) -> Lexer<'t> {
        let part = self.text.get(range.clone()).unwrap_or_default();
        let at = range.start + part.len() - part.trim_start().len();
        let end = (range.start + part.trim_end().len()).max(at.min(range.end));
        Lexer { at, end, ..self }
    }

    /// The text that is still to be read.
    #[must_use]
    pub fn rest(&self) -> &'t str {
        self.text.get(self.at..self.end).unwrap_or_default()
    }

    /// Where that begins in the whole text, in bytes.
    #[must_use]
    pub fn at(&self) -> usize {
        self.at
    }

    /// The end, where nothing is left.
    pub(crate) fn at_end(self) -> Lexer<'t> {
        Lexer { at: self.end, ..self }
    }

    /// Whether everything is read.
    #[must_use]
    pub fn is_at_end(&self) -> bool {
        self.at >= self.end
    }

    // --- tokens ---

    /// Skips this many bytes and the blanks behind them.
    pub(crate) fn skip(&mut self, length: usize) {
        *self = self.part(self.at + length..self.end);
    }

    /// Reads what a parser finds.
    fn take<T>(&mut self, parse: impl FnOnce(&'t str) -> IResult<&'t str, T>) -> Option<T> {
        let (left, found) = parse(self.rest()).ok()?;
        self.skip(self.rest().len() - left.len());
        Some(found)
    }

    /// The next word: all up to a blank, a bracket, a comparison or a quotation mark.
    pub fn word(&mut self) -> Option<&'t str> {
        self.take(|rest| take_while1(is_of_word).parse(rest))
    }

    /// All up to the next blank.
    pub(crate) fn chunk(&mut self) -> Option<&'t str> {
        self.take(|rest| take_till1(char::is_whitespace).parse(rest))
    }

    /// The next word, which is not read; empty if there is none.
    #[must_use]
    pub fn peek(&self) -> &'t str {
        let mut behind = *self;
        behind.word().unwrap_or_default()
    }

    /// Reads a keyword if it is next, in capital or small letters.
    pub fn keyword(&mut self, wanted: &str) -> bool {
        let keyword = |rest| {
            verify(take_while1(is_of_word), |word: &str| word.eq_ignore_ascii_case(wanted))
                .parse(rest)
        };
        self.take(keyword).is_some()
    }

    /// Reads a sign if it is next.
    pub fn sign(&mut self, wanted: &str) -> bool {
        self.take(|rest| tag(wanted).parse(rest)).is_some()
    }

    /// Reads the first of these signs that is next.
    pub(crate) fn sign_of(&mut self, signs: &[&'static str]) -> Option<&'static str> {
        signs.iter().find(|sign| self.sign(sign)).copied()
    }

    /// Reads a word if it means something.
    pub(crate) fn word_as<T>(&mut self, meaning: impl FnOnce(&'t str) -> Option<T>) -> Option<T> {
        let mut behind = *self;
        let found = meaning(behind.word()?)?;
        *self = behind;
        Some(found)
    }

    /// Reads a word that must mean something.
    pub(crate) fn expect<T>(
        &mut self,
        expected: &str,
        meaning: impl FnOnce(&'t str) -> Option<T>,
    ) -> Read<T> {
        self.word_as(meaning).ok_or_else(|| self.wrong(expected))
    }

    /// Reads a number, or another word that is the text of a value.
    pub(crate) fn value<T: FromStr>(&mut self) -> Option<T> {
        self.word_as(|word| word.parse().ok())
    }

    /// Reads the number that a word such as `10th` says.
    pub(crate) fn ordinal(&mut self) -> Option<u64> {
        self.word_as(Nth::read)
    }

    /// Reads a span of time in one word.
    pub(crate) fn span(&mut self, example: &str) -> Read<Duration> {
        self.expect(&format!("a time, as in `{example}`"), |word| parse_duration(word).ok())
    }

    /// Reads a span of time that is all the rest, perhaps with a blank before its unit.
    pub(crate) fn last_span(self, example: &str) -> Read<Duration> {
        let expected = format!("a time, as in `{example}`");
        parse_duration(self.rest()).map_err(|_| self.wrong(expected))
    }

    /// Reads the name of a signal, which may have blanks in it.
    pub(crate) fn signal<'n>(&mut self, names: &'n Names) -> Option<&'n Signal> {
        let rest = self.rest();
        let is_named = |signal: &&Signal| {
            let name = rest.get(..signal.name.len());
            let behind = rest.get(signal.name.len()..).unwrap_or_default();
            name.is_some_and(|name| name.eq_ignore_ascii_case(&signal.name))
                && !behind.starts_with(is_of_word)
        };
        let signals = names.signals().iter().filter(is_named);
        let signal = signals.max_by_key(|signal| signal.name.len())?;
        self.skip(signal.name.len());
        Some(signal)
    }

    /// Reads a text between quotation marks, if one is next.
    pub(crate) fn quoted(&mut self) -> Read<Option<String>> {
        if !self.rest().starts_with('"') {
            return Ok(None);
        }
        let (mut rest, mut text) = (self.rest().get(1..).unwrap_or_default(), String::new());
        while let Ok((left, c)) = character(rest) {
            text.push(c);
            rest = left;
        }
        let at = self.end - rest.len();
        match rest.chars().next() {
            Some('"') => {
                *self = self.part(at + 1..self.end);
                Ok(Some(text))
            }
            Some(_) => {
                Err(self.part(at..self.end).wrong(r#"`\"`, `\\`, `\r`, `\n`, `\t` or `\u{1b}`"#))
            }
            None => Err(self.part(at..self.end).wrong(r#"`"` at the end of the text"#)),
        }
    }

    // --- parts ---

    /// The places of characters outside of quotation marks.
    fn bare(self) -> impl Iterator<Item = usize> {
        let (mut is_quoted, mut is_escaped) = (false, false);
        self.rest().char_indices().filter_map(move |(at, c)| {
            let is_outside = !is_quoted;
            if is_escaped {
                is_escaped = false;
            } else if is_quoted && c == '\\' {
                is_escaped = true;
            } else if c == '"' {
                is_quoted = !is_quoted;
            }
            is_outside.then_some(self.at + at)
        })
    }

    /// The part before a place, and the part from it on.
    fn split(self, at: usize) -> (Lexer<'t>, Lexer<'t>) {
        (self.part(self.at..at), self.part(at..self.end))
    }

    /// The part before the first of some keywords, and the part that begins with that keyword.
    pub(crate) fn before_keyword(self, keywords: &[&str]) -> Option<(Lexer<'t>, Lexer<'t>)> {
        let is_keyword = |at: &usize| {
            let follows_blank = self
                .text
                .get(self.at..*at)
                .is_some_and(|before| before.ends_with(char::is_whitespace));
            let word = self.text.get(*at..self.end).and_then(|rest| rest.split_whitespace().next());
            let is_one = |word: &str| keywords.iter().any(|other| word.eq_ignore_ascii_case(other));
            follows_blank
                && !self.text.get(*at..).is_some_and(|rest| rest.starts_with(char::is_whitespace))
                && word.is_some_and(is_one)
        };
        Some(self.split(self.bare().find(is_keyword)?))
    }

    /// The part before the last word, and the last word.
    pub(crate) fn last_word(self) -> Option<(Lexer<'t>, Lexer<'t>)> {
        let last = self.rest().split_whitespace().next_back()?;
        Some(self.split(self.end - last.len()))
    }

    /// The part before a sign, and the part behind it.
    pub(crate) fn around_sign(
        self,
        sign: char,
        is_end: impl Fn(Option<char>) -> bool,
    ) -> Option<(Lexer<'t>, Lexer<'t>)> {
        let is_sign = |at: &usize| {
            let mut rest = self.text.get(*at..self.end).unwrap_or_default().chars();
            rest.next() == Some(sign) && is_end(rest.next())
        };
        let (before, mut behind) = self.split(self.bare().find(is_sign)?);
        behind.skip(sign.len_utf8());
        Some((before, behind))
    }

    /// The lines that are not empty.
    pub(crate) fn lines(self) -> impl Iterator<Item = Lexer<'t>> {
        let mut at = self.at;
        let lines = self.rest().split_inclusive('\n').map(move |line| {
            let begin = at;
            at += line.len();
            self.part(begin..at)
        });
        lines.filter(|line| !line.is_at_end())
    }

    // --- errors ---

    /// Whether everything is read; otherwise this is expected.
    pub(crate) fn finish(&self, expected: &str) -> Read<()> {
        if self.is_at_end() { Ok(()) } else { Err(self.wrong(expected)) }
    }

    /// The text is wrong here: something else is expected.
    #[must_use]
    pub fn wrong(&self, expected: impl AsRef<str>) -> SyntaxError {
        let mut behind = *self;
        let length = behind.chunk().map_or(0, str::len);
        SyntaxError::new(self.text, self.at..self.at + length, expected.as_ref())
    }

    /// Something is missing at the end.
    pub(crate) fn missing(&self, expected: impl AsRef<str>) -> SyntaxError {
        self.at_end().wrong(expected)
    }
}

pub(crate) fn is_of_word(c: char) -> bool {
    !c.is_whitespace() && !matches!(c, '(' | ')' | '<' | '>' | '=' | '"')
}

/// A character of a text between quotation marks.
fn character(input: &str) -> IResult<&str, char> {
    let code = |digits: &str| char::from_u32(u32::from_str_radix(digits, 16).ok()?);
    let unicode = map_opt(delimited(tag("u{"), hex_digit1, char('}')), code);
    let escaped = alt((
        value('\r', char('r')),
        value('\n', char('n')),
        value('\t', char('t')),
        one_of("\"\\"),
        unicode,
    ));
    alt((preceded(char('\\'), escaped), none_of("\"\\"))).parse(input)
}
