//! Errors for people: one message, the place, the remedy.

use std::io::Write;
use std::process::ExitCode;

use annotate_snippets::Level;
use thiserror::Error;
use vimc4_answers::problem::parted;

use crate::excerpt::{self, Excerpt};
use crate::text;

/// A reason to end with an exit code.
#[derive(Debug, Error)]
#[error("{message}")]
pub(crate) struct Failure {
    message: String,
    help: Option<String>,
    place: Option<Box<Excerpt>>,
    code: u8,
}

impl Failure {
    /// The command could not begin; nothing has changed. A message of the form
    /// `what is wrong; what to do` becomes message and help.
    pub(crate) fn usage(text: impl ToString) -> Failure {
        Failure::new(&text.to_string(), 2)
    }

    /// The command ended too early.
    pub(crate) fn midway(text: impl ToString) -> Failure {
        Failure::new(&text.to_string(), 1)
    }

    /// The command ended too early because of a line of a file, counted from 1.
    pub(crate) fn at_line(text: impl ToString, name: &str, source: &str, line: u32) -> Failure {
        let mut failure = Failure::new(&text.to_string(), 1);
        // The same line for any line end.
        let source = text::shown(&source.replace("\r\n", "\n").replace('\r', "\n"));
        let before = line.saturating_sub(1) as usize;
        let start = source.split_inclusive('\n').take(before).map(str::len).sum::<usize>();
        let length = source.get(start..).and_then(|rest| rest.lines().next()).map_or(0, str::len);
        let name = text::shown_in_line(name);
        failure.place = Some(Box::new(Excerpt::around(name, &source, start..start + length)));
        failure
    }

    /// The same at the end of a command that has done its work.
    pub(crate) fn at_the_end(self) -> Failure {
        Failure { code: 1, ..self }
    }

    /// The same where nothing has begun yet.
    pub(crate) fn begins_nothing(self) -> Failure {
        Failure { code: 2, ..self }
    }

    /// A program that was to be run cannot be; the code says so as shells do.
    #[cfg(unix)]
    pub(crate) fn of_program(text: impl ToString, code: u8) -> Failure {
        Failure::new(&text.to_string(), code)
    }

    fn new(text: &str, code: u8) -> Failure {
        // It contains names of files and lines of jobs, which are foreign text.
        let text = &text::shown(text);
        let (message, help) = match parted(text) {
            Some((message, help)) => (message.to_owned(), Some(help.to_owned())),
            None => (text.to_owned(), None),
        };
        Failure { message, help, place: None, code }
    }

    /// The failure in one line, for other displays.
    pub(crate) fn text(&self) -> String {
        match &self.help {
            Some(help) => format!("{}; {help}", self.message),
            None => self.message.clone(),
        }
    }

    /// Prints it and says with which code to exit.
    pub(crate) fn report(self) -> ExitCode {
        let code = ExitCode::from(self.code);
        let (place, help) = (self.place.as_deref(), self.help.as_deref());
        let message = excerpt::message(Level::ERROR, None, &self.message, place, help);
        // If it cannot be printed, there is still the code.
        let _ = writeln!(anstream::stderr(), "{message}");
        code
    }
}

impl From<vimc4::Error> for Failure {
    fn from(error: vimc4::Error) -> Failure {
        let vimc4::Error::Profile(profile) = error else { return Failure::usage(error) };
        let span = profile.error.span.clone().unwrap_or(0..0);
        // What is shown may be longer than what is written.
        let shown_before =
            |end: usize| text::shown(profile.text.get(..end).unwrap_or(&profile.text)).len();
        // An empty place at the end of the file has nothing to point at.
        let end = span.end.min(profile.text.len());
        let span = shown_before(span.start.min(end))..shown_before(end);
        let text = text::shown(&profile.text);
        let name = text::shown_in_line(&profile.path.display().to_string());
        let message = format!("{name}, line {}: {}", profile.line, profile.error.message);
        Failure {
            message: text::shown(&message),
            help: Some(text::shown(&profile.error.help)),
            place: Some(Box::new(Excerpt::around(name, &text, span))),
            code: 2,
        }
    }
}
