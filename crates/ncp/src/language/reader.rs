//! A line, how far it has been read, and what has been reported about it.

use super::command::{Placed, Span};
use super::problem::{Excerpt, Problem};
use super::reference::CommandInfo;
use super::token::{self, Token};
use crate::Severity;

/// A line that is being read.
pub(super) struct Reader<'t, 'p> {
    line: &'t str,
    rest: &'t str,
    failed: bool,
    report: &'p mut dyn FnMut(Span, Problem),
}

impl<'t, 'p> Reader<'t, 'p> {
    /// Nothing of the line is read.
    pub(super) fn new(line: &'t str, report: &'p mut dyn FnMut(Span, Problem)) -> Reader<'t, 'p> {
        Reader { line, rest: line, failed: false, report }
    }

    /// What has not been read.
    pub(super) fn rest(&self) -> &'t str {
        self.rest
    }

    /// Whether there has been an error.
    pub(super) fn failed(&self) -> bool {
        self.failed
    }

    /// Reports a problem.
    pub(super) fn say(&mut self, span: Span, problem: Problem) {
        self.failed |= problem.severity() == Severity::Error;
        (self.report)(span, problem);
    }

    /// Reports that a command lacks something, unless that may be the part that was wrong before.
    pub(super) fn missing(&mut self, info: &'static CommandInfo, name: Span, what: &'static str) {
        if !self.failed {
            self.say(name, Problem::MissingWord { command: info.name, missing: what });
        }
    }

    /// What has been read, in bytes.
    pub(super) fn place(&self) -> u32 {
        (self.line.len() - self.rest.len()) as u32
    }

    /// From the beginning of something to what is read next.
    pub(super) fn since(&self, beginning: Span) -> Span {
        Span { end: self.place(), ..beginning }
    }

    /// A part of the line.
    pub(super) fn text(&self, span: Span) -> &'t str {
        self.line.get(span.range()).unwrap_or_default()
    }

    /// A part of the line, for a message.
    pub(super) fn excerpt(&self, span: Span) -> Excerpt {
        Excerpt::of(self.text(span))
    }

    /// Reads a token if there is one.
    pub(super) fn take<T>(&mut self, token: impl Fn(&'t str) -> Token<'t, T>) -> Option<Placed<T>> {
        let start = self.place();
        let (rest, value) = token(self.rest).ok()?;
        self.rest = rest;
        Some(Placed { value, span: Span { start, end: self.place() } })
    }

    /// Whether a token is next.
    pub(super) fn next_is<T>(&self, token: impl Fn(&'t str) -> Token<'t, T>) -> bool {
        token(self.rest).is_ok()
    }

    /// Reads blanks, and returns whether at most a comment follows them.
    pub(super) fn ends(&mut self) -> bool {
        self.take(token::blanks);
        self.rest.is_empty() || self.rest.starts_with(';') || self.next_is(token::bracket_comment)
    }

    /// Skips everything up to the comment, and returns where it was.
    pub(super) fn pass_over(&mut self) -> Span {
        let start = Span { start: self.place(), end: self.place() };
        self.take(token::code);
        self.until_here(start)
    }

    /// From the beginning of something to what is read next, without the blanks before that.
    pub(super) fn until_here(&self, beginning: Span) -> Span {
        let text = self.text(self.since(beginning)).trim_end_matches(token::is_blank);
        Span { end: beginning.start + text.len() as u32, ..beginning }
    }

    /// From the beginning of something to the comment.
    pub(super) fn whole_line(&self, beginning: Span) -> Span {
        let code = token::code(self.rest).map_or(0, |(_, code)| code.len() as u32);
        Span { end: self.place() + code, ..beginning }
    }

    /// Skips the rest of the line.
    pub(super) fn pass_over_all(&mut self) {
        self.rest = "";
    }
}
