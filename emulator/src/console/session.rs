//! A debugger and what it is opened on, as both faces of the console see it.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use vimc4_catalogue::{Details, Machine};
use vimc4_debug::{Answer, Candidate, Completion, DebugError, Debugger, Directive};
use vimc4_device::{Device, Time, View};

use super::screen;
use crate::text::shown;

/// A command of the console's own, beside those of the debugger.
pub(crate) struct Own {
    pub(crate) name: &'static str,
    pub(crate) arguments: &'static str,
    pub(crate) about: &'static str,
}

/// The console's own commands.
pub(crate) const OWN: &[Own] = &[
    Own {
        name: "screen",
        arguments: "",
        about: "fill the terminal with everything at once; `q` comes back",
    },
    Own {
        name: "picture",
        arguments: "FILE [WIDTHxHEIGHT]",
        about: "write that screen into a file, as SVG; 80x24 characters if nothing is said",
    },
    Own { name: "source", arguments: "FILE", about: "carry out the commands in a file" },
];

/// What came of a line.
#[derive(Debug)]
pub(crate) enum Outcome {
    /// This is to be said; it may be nothing.
    Said(String),
    /// The full screen is wanted.
    Screen,
    /// The commands of a file are wanted.
    Source(String),
    /// The end is wanted.
    Quit,
}

/// Why a line was not carried out: a sentence without its point.
#[derive(Debug)]
pub(crate) struct Wrong(pub(crate) String);

impl Wrong {
    fn new(message: impl Into<String>) -> Wrong {
        Wrong(message.into())
    }
}

impl From<DebugError> for Wrong {
    fn from(error: DebugError) -> Wrong {
        Wrong(error.to_string())
    }
}

/// Whether somebody wants what is under way to end.
#[derive(Clone, Default)]
pub(crate) struct Cancel {
    wished: Arc<AtomicBool>,
    /// Another place to look whether it is wished: the keyboard, where Ctrl-C is a key like others.
    pub(crate) look: Option<fn() -> bool>,
}

impl Cancel {
    pub(crate) fn wish(&self) {
        self.wished.store(true, Ordering::Relaxed);
    }

    /// Nobody wants that any more.
    pub(crate) fn forget(&self) {
        self.wished.store(false, Ordering::Relaxed);
    }

    pub(crate) fn is_wished(&self) -> bool {
        self.wished.load(Ordering::Relaxed) || self.look.is_some_and(|look| look())
    }
}

/// A debugger and what it is opened on.
pub(crate) struct Session {
    pub(crate) debugger: Debugger,
    pub(crate) machine: Arc<Machine>,
    pub(crate) cancel: Cancel,
    /// The line that was carried out last, which an empty one repeats.
    last: String,
}

impl Session {
    pub(crate) fn new(debugger: Debugger, machine: Arc<Machine>, cancel: Cancel) -> Session {
        Session { debugger, machine, cancel, last: String::new() }
    }

    /// Carries out a line. An empty one does the last one again, where somebody types; a comment
    /// does nothing.
    pub(crate) fn carry_out(&mut self, line: &str) -> Result<Outcome, Wrong> {
        let line = match line.trim() {
            "" => self.last.clone(),
            line => line.to_owned(),
        };
        self.last.clone_from(&line);
        self.carry_out_once(&line)
    }

    /// The same, where an empty line does nothing.
    pub(crate) fn carry_out_once(&mut self, line: &str) -> Result<Outcome, Wrong> {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match (word, rest.trim()) {
            ("screen", "") => return Ok(Outcome::Screen),
            ("source", "") => return Err(Wrong::new("how it is typed: source FILE")),
            ("source", file) => return Ok(Outcome::Source(file.to_owned())),
            ("picture", rest) => return self.picture(rest).map(Outcome::Said),
            ("help" | "h", name) if OWN.iter().any(|own| own.name == name) => {
                let own = OWN.iter().find(|own| own.name == name);
                return Ok(Outcome::Said(own.map_or(String::new(), Own::told)));
            }
            _ => {}
        }
        self.cancel.forget();
        let cancel = self.cancel.clone();
        let go_on = &mut |_: Time| match cancel.is_wished() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        match self.debugger.execute(line, go_on)? {
            Answer::Quit => Ok(Outcome::Quit),
            answer @ Answer::Help => {
                let own: Vec<String> = OWN.iter().map(Own::listed).collect();
                let (table, end) = answer.to_string().rsplit_once("\n\n").map_or_else(
                    || (answer.to_string(), String::new()),
                    |(table, end)| (table.to_owned(), end.to_owned()),
                );
                Ok(Outcome::Said(format!("{table}\n{}\n\n{end}", own.join("\n"))))
            }
            answer => Ok(Outcome::Said(shown(&answer.to_string()))),
        }
    }

    /// How a line can go on.
    pub(crate) fn complete(&self, line: &str, cursor: usize) -> Completion {
        let mut completion = self.debugger.complete(line, cursor);
        let begun = line.get(..cursor).unwrap_or(line);
        if completion.from == 0 {
            let own = OWN.iter().filter(|own| own.name.starts_with(begun) && own.name != begun);
            completion.candidates.extend(
                own.map(|own| Candidate { text: own.name.to_owned(), about: own.about.to_owned() }),
            );
        }
        completion
    }

    /// What can follow what is typed, to be shown behind it: the rest of the only word that it can
    /// be, or the arguments.
    pub(crate) fn hint(&self, line: &str) -> Option<String> {
        let word = line.strip_suffix(' ')?;
        let own = OWN.iter().find(|own| own.name == word).map(|own| own.arguments);
        let arguments = own.or_else(|| Some(Directive::named(word)?.arguments))?;
        (!arguments.is_empty()).then(|| arguments.to_owned())
    }

    /// What is seen now.
    pub(crate) fn view(&self) -> View<Details> {
        self.debugger.device().view(self.debugger.now())
    }

    /// Writes the full screen into a file.
    fn picture(&mut self, rest: &str) -> Result<String, Wrong> {
        let wrong = || {
            Wrong::new("how it is typed: picture FILE [WIDTHxHEIGHT], as in picture now.svg 80x24")
        };
        let (file, size) = rest.rsplit_once(' ').unwrap_or((rest, "80x24"));
        if file.is_empty() {
            return Err(wrong());
        }
        let (width, height) = size.split_once('x').ok_or_else(wrong)?;
        let number = |text: &str| text.parse().ok().filter(|number| (1..=1_000).contains(number));
        let size = (number(width).ok_or_else(wrong)?, number(height).ok_or_else(wrong)?);
        let svg = screen::as_svg(self, size);
        let written = fs::write(Path::new(file), svg);
        written.map_err(|error| Wrong::new(format!("cannot write {file}: {error}")))?;
        Ok(format!("written to {file}"))
    }
}

impl Own {
    fn usage(&self) -> String {
        match self.arguments {
            "" => self.name.to_owned(),
            arguments => format!("{} {arguments}", self.name),
        }
    }

    fn listed(&self) -> String {
        format!("  {:<18} {}", self.name, self.about)
    }

    fn told(&self) -> String {
        format!("{}\n    {}.", self.usage(), self.about)
    }
}
