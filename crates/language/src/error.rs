//! Why a text cannot be read.

use std::error::Error;
use std::fmt;
use std::ops::Range;

use vimc4_device::parted;

/// How much of a wrong text a message shows, characters.
const SHOWN: usize = 80;

/// Why a text cannot be read: where it is wrong, what is expected there, and what to do about it.
///
/// ```
/// let names = vimc4_device::Names::numbered();
/// let error = vimc4_language::read_condition("z < five", names).unwrap_err();
/// assert_eq!(error.span, 4..8);
/// assert_eq!(error.expected, "a position in steps, as in `z < -5000`");
/// assert_eq!(error.to_string(), format!("`z < five` is wrong at `five`: {}", error.expected));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SyntaxError {
    /// The whole text.
    pub text: String,
    /// The bytes of the text that are wrong; empty if something is missing there.
    pub span: Range<usize>,
    /// What is expected there, or why the text is wrong.
    pub expected: String,
    /// What to do about it; empty if `expected` says enough.
    pub help: String,
}

impl SyntaxError {
    /// An error in a text. A message of the form `what is expected; help` gives both.
    pub(crate) fn new(text: &str, span: Range<usize>, message: &str) -> SyntaxError {
        let (expected, help) = parted(message).unwrap_or((message, ""));
        SyntaxError {
            text: text.to_owned(),
            span,
            expected: expected.to_owned(),
            help: help.to_owned(),
        }
    }

    /// What is expected, and the help.
    #[must_use]
    pub fn message(&self) -> String {
        match self.help.as_str() {
            "" => self.expected.clone(),
            help => format!("{}; {help}", self.expected),
        }
    }

    /// The problem and the remedy, as two sentences.
    #[must_use]
    pub fn problem_and_remedy(&self) -> (String, &str) {
        match self.help.as_str() {
            "" => (self.place(), &self.expected),
            help => (format!("{}: {}", self.place(), self.expected), help),
        }
    }

    /// The text, and where it is wrong.
    fn place(&self) -> String {
        let rest = self.text.get(self.span.start..).unwrap_or_default().trim();
        let shown = short(self.text.trim());
        match rest {
            "" if shown.is_empty() => "nothing is said".to_owned(),
            "" => format!("`{shown}` is not finished"),
            rest if rest == self.text.trim() => format!("`{shown}` is wrong"),
            rest => format!("`{shown}` is wrong at `{}`", short(rest)),
        }
    }
}

impl fmt::Display for SyntaxError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place(), self.message())
    }
}

impl Error for SyntaxError {}

/// The beginning of a text, without control characters.
fn short(text: &str) -> String {
    let mut shown = String::new();
    for c in text.chars().take(SHOWN) {
        match c {
            '"' | '\'' | '\\' => shown.push(c),
            c => shown.extend(c.escape_debug()),
        }
    }
    if text.chars().nth(SHOWN).is_some() { shown + "…" } else { shown }
}
