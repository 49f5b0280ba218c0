//! Why a command of the debugger was not carried out.

use std::error::Error;
use std::fmt;

/// What was wrong, where, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DebugError {
    message: String,
    remedy: Option<Remedy>,
    failed: bool,
}

/// What lists what there is, where that would be right. Those who type lines have it as a line; who asks in
/// another way has another way to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remedy {
    /// The commands of the debugger are listed.
    Help,
    /// The commands that the controller got are listed, with their numbers.
    Numbers,
}

/// What is said where somebody has had enough before it was done, which is nobody's mistake.
pub const CANCELLED: &str = "cancelled";

/// A text in one line, shortened to a readable length.
pub(crate) fn shortened(text: String) -> String {
    /// How many characters are shown.
    const SHOWN: usize = 120;
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text,
    }
}

/// For those who type lines.
impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Remedy::Help => "`help` lists them",
            Remedy::Numbers => "`list commands` shows some with their numbers",
        })
    }
}

impl DebugError {
    /// A sentence without its full stop, which begins in lower case. What it quotes is shortened.
    pub(crate) fn new(message: impl Into<String>) -> DebugError {
        let message: String = message.into();
        let parts = message.split('`').enumerate();
        let parts: Vec<String> = parts
            .map(
                |(place, part)| {
                    if place % 2 == 1 { shortened(part.to_owned()) } else { part.to_owned() }
                },
            )
            .collect();
        DebugError { message: parts.join("`"), remedy: None, failed: false }
    }

    /// Somebody has had enough.
    pub(crate) fn cancelled() -> DebugError {
        DebugError::new(CANCELLED)
    }

    /// The same with what lists what there is.
    pub(crate) fn with(self, remedy: Remedy) -> DebugError {
        DebugError { remedy: Some(remedy), ..self }
    }

    /// An assertion does not hold.
    pub(crate) fn failed(message: impl Into<String>) -> DebugError {
        DebugError { failed: true, ..DebugError::new(message) }
    }

    /// Whether it is an `assert` that does not hold, and not a mistyped command.
    #[must_use]
    pub fn is_failed_assertion(&self) -> bool {
        self.failed
    }

    /// The sentence, with the remedy in the words of whoever was asked.
    #[must_use]
    pub fn worded(&self, remedy: impl FnOnce(Remedy) -> String) -> String {
        match self.remedy {
            Some(own) => format!("{}; {}", self.message, remedy(own)),
            None => self.message.clone(),
        }
    }
}

/// For those who type lines.
impl fmt::Display for DebugError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.worded(|remedy| remedy.to_string()))
    }
}

impl Error for DebugError {}
