//! Mistakes in how a line is written.

use std::fmt;

use strsim::levenshtein;

use super::reference;
use super::value::Value;
use crate::Severity;

/// A problem with how a line is written.
///
/// It owns what it quotes of the line, shortened if necessary, and is still as cheap to copy as a
/// number: a file may be full of problems.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, thiserror::Error)]
pub enum Problem {
    /// The line does not begin with the name of a command.
    #[error("this is not a command")]
    NoCommand,
    /// A comment in brackets.
    #[error("a comment in brackets")]
    BracketComment,
    /// The file is in another language.
    #[error("this is G-code, not the isel NC format: nothing of it can be read")]
    GCode,
    /// There is no command of this name.
    #[error("unknown command {0}")]
    UnknownCommand(Excerpt),
    /// The command takes no such word.
    #[error("{command} takes no {word}")]
    UnknownWord {
        /// The name of the command.
        command: &'static str,
        /// The text.
        word: Excerpt,
    },
    /// There is no such axis.
    #[error("{0} is not an axis")]
    UnknownAxis(Excerpt),
    /// A plane that is not a pair of linear axes.
    #[error("{0} is not a plane")]
    UnknownPlane(Excerpt),
    /// A word is there twice.
    #[error("{0} is given twice")]
    GivenTwice(&'static str),
    /// Two words of which only one can be true.
    #[error("{0} and {1} contradict each other")]
    Contradiction(&'static str, &'static str),
    /// A word or a command without its value.
    #[error("{0} has no value")]
    MissingValue(&'static str),
    /// A command that lacks something necessary.
    #[error("{command} has no {missing}")]
    MissingWord {
        /// The name of the command.
        command: &'static str,
        /// What it lacks.
        missing: &'static str,
    },
    /// A command that changes nothing because it names nothing.
    #[error("{0} names nothing and does nothing")]
    NothingNamed(&'static str),
    /// A number that belongs to no word.
    #[error("a number without a letter before it")]
    StrayNumber(&'static str),
    /// Characters that belong to nothing.
    #[error("unexpected {0}")]
    Unexpected(Excerpt),
    /// Something after the last word that the command takes.
    #[error("{0} takes nothing more")]
    Surplus(&'static str),
    /// A command after one whose text goes on to the end of the line.
    #[error("{command} is not done: everything up to the end of the line belongs to {by}")]
    Swallowed {
        /// The name of the command whose text it is.
        by: &'static str,
        /// The name of the command that is in it.
        command: &'static str,
    },
    /// Digits, signs and points that are not a number, or no digits where a number is expected.
    #[error("{0} is not a number")]
    NotANumber(Excerpt),
    /// A number with decimals where only whole ones make sense.
    #[error("{0} takes whole numbers only")]
    NotWhole(&'static str),
    /// A number that is beyond what is read.
    #[error("this number is too large")]
    TooLarge,
    /// A number with more decimals than are kept.
    #[error("this number has more than three decimal places and is rounded")]
    Rounded,
    /// A value beyond what the word takes.
    #[error("{what} is out of range")]
    OutOfRange {
        /// The word, or the name of the command.
        what: &'static str,
        /// The lowest value.
        least: Value,
        /// The highest value.
        most: Value,
    },
    /// The lower limit is above the upper one.
    #[error("the lower limit of {0} is above the upper limit")]
    LimitsReversed(&'static str),
    /// Something else where a portis expected: `A`, or `E` if it is to be read.
    #[error("this is not an {} port", if *.0 == 'A' { "output" } else { "input" })]
    NotAPort(char),
    /// A rotary axis where one of X, Y, Zis expected.
    #[error("{0} is not a linear axis")]
    NotLinear(Excerpt),
    /// Only one limit of an axis.
    #[error("the upper limit of {0} is missing")]
    MissingUpperLimit(&'static str),
    /// A port without a bit where oneis expected.
    #[error("the bit of the port is missing")]
    MissingBit,
    /// No `=` where oneis expected.
    #[error("the equals sign is missing")]
    MissingEquals,
    /// No value behind the equals sign.
    #[error("the value is missing")]
    MissingPortValue,
    /// Something else where the value of a portis expected.
    #[error("{0} is not a value of a port")]
    NotAPortValue(Excerpt),
}

impl Problem {
    /// Its severity.
    #[must_use]
    pub fn severity(self) -> Severity {
        match self {
            Problem::Rounded | Problem::NothingNamed(_) | Problem::Swallowed { .. } => {
                Severity::Warning
            }
            _ => Severity::Error,
        }
    }

    /// A name that programs and people can search for.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            Problem::NoCommand => "no-command",
            Problem::BracketComment => "bracket-comment",
            Problem::GCode => "g-code",
            Problem::UnknownCommand(_) => "unknown-command",
            Problem::UnknownWord { .. } => "unknown-word",
            Problem::UnknownAxis(_) => "unknown-axis",
            Problem::UnknownPlane(_) => "unknown-plane",
            Problem::GivenTwice(_) => "given-twice",
            Problem::Contradiction(..) => "contradiction",
            Problem::MissingValue(_) => "missing-value",
            Problem::MissingWord { .. } => "missing-word",
            Problem::NothingNamed(_) => "nothing-named",
            Problem::StrayNumber(_) => "stray-number",
            Problem::Unexpected(_) => "unexpected-text",
            Problem::Surplus(_) => "surplus-text",
            Problem::Swallowed { .. } => "swallowed",
            Problem::NotANumber(_) => "not-a-number",
            Problem::NotWhole(_) => "not-whole",
            Problem::TooLarge => "too-large",
            Problem::Rounded => "rounded",
            Problem::OutOfRange { .. } => "value-out-of-range",
            Problem::LimitsReversed(_) => "limits-reversed",
            Problem::NotAPort(_) => "not-a-port",
            Problem::NotLinear(_) => "not-linear",
            Problem::MissingUpperLimit(_) => "missing-upper-limit",
            Problem::MissingBit => "missing-bit",
            Problem::MissingEquals => "missing-equals",
            Problem::MissingPortValue => "missing-port-value",
            Problem::NotAPortValue(_) => "not-a-port-value",
        }
    }

    /// What is probably meant by it, as a replacement for it.
    #[must_use]
    pub fn meant(self) -> Option<String> {
        match self {
            Problem::UnknownCommand(name) => meant(name.as_str()),
            _ => None,
        }
    }

    /// What would be right.
    #[must_use]
    pub fn help(self) -> Option<String> {
        if let Some(meant) = self.meant() {
            return Some(format!("perhaps {meant} is meant"));
        }
        Some(match self {
            Problem::NoCommand => "a line is `N` and a number, a command with its words, and a \
                                   comment behind `;`; each may be missing"
                .to_owned(),
            Problem::BracketComment => "a comment begins with `;`".to_owned(),
            Problem::GCode => {
                "choose the post-processor for isel, with files that end in .ncp, in \
                               the program that has written it"
                    .to_owned()
            }
            Problem::UnknownCommand(_) => "text that is not a command goes after `;`".to_owned(),
            Problem::UnknownWord { command, .. }
            | Problem::MissingWord { command, .. }
            | Problem::NothingNamed(command)
            | Problem::StrayNumber(command) => pattern(command)?,
            Problem::MissingValue(word) => {
                pattern(word).unwrap_or_else(|| format!("write a number after {word}"))
            }
            Problem::UnknownAxis(_) => "axes are X, Y, Z, A, B and C".to_owned(),
            Problem::UnknownPlane(_) => "planes are XY, XZ and YZ".to_owned(),
            Problem::GivenTwice(word) => format!("leave one {word}"),
            Problem::Contradiction(one, other) => format!("leave {one} or {other}"),
            Problem::Unexpected(text) if text.as_str().starts_with(',') => {
                "decimal places follow a point, and blanks separate words".to_owned()
            }
            Problem::Unexpected(_) | Problem::Surplus(_) => "a comment begins with `;`".to_owned(),
            Problem::Swallowed { command, .. } => format!("write {command} in a line of its own"),
            Problem::NotANumber(_) => {
                "numbers are such as 2500, -2500 and 12.5, without a unit".to_owned()
            }
            Problem::NotWhole(_) => "leave the decimal places away".to_owned(),
            Problem::TooLarge => format!("numbers go up to {}", Value::MOST),
            Problem::Rounded => "three places are kept".to_owned(),
            Problem::OutOfRange { least, most, .. } => format!("from {least} to {most}"),
            Problem::LimitsReversed(axis) => {
                format!("the lower limit comes first, such as {axis}0,250000")
            }
            Problem::NotAPort(letter) => {
                format!("write {letter}1, {letter}2, {letter}3 or {letter}4")
            }
            Problem::NotLinear(_) => "a cylinder replaces X, Y or Z".to_owned(),
            Problem::MissingUpperLimit(axis) => {
                format!("write both limits with a comma between them, such as {axis}0,250000")
            }
            Problem::MissingBit => "write the port, a point and a bit from 1 to 8: A1.4".to_owned(),
            Problem::MissingEquals => "write `=` and the value after the port".to_owned(),
            Problem::MissingPortValue | Problem::NotAPortValue(_) => {
                "values are such as 42 or 42D, 2AH in hexadecimal and 101010B in binary".to_owned()
            }
        })
    }
}

/// How a command is written.
fn pattern(name: &str) -> Option<String> {
    reference::find(name).map(|info| format!("it is written {}", info.pattern()))
}

/// A piece of a line to be shown in a message: as much as fits.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Excerpt {
    bytes: [u8; Excerpt::ROOM],
    length: u8,
    cut: bool,
}

impl Excerpt {
    /// More than the longest name of a command.
    const ROOM: usize = 22;

    /// As much of the text as fits.
    pub(super) fn of(text: &str) -> Excerpt {
        let ends = text.char_indices().map(|(start, character)| start + character.len_utf8());
        let end = ends.take_while(|end| *end <= Excerpt::ROOM).last().unwrap_or(0);
        let mut bytes = [0; Excerpt::ROOM];
        for (to, from) in bytes.iter_mut().zip(text.bytes().take(end)) {
            *to = from;
        }
        Excerpt { bytes, length: end as u8, cut: end < text.len() }
    }

    /// The text, or the beginning of it.
    #[must_use]
    pub fn as_str(&self) -> &str {
        let kept = self.bytes.get(..usize::from(self.length)).unwrap_or_default();
        str::from_utf8(kept).unwrap_or_default()
    }
}

/// In quotation marks, with an ellipsis if it is cut off.
impl fmt::Display for Excerpt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ellipsis = if self.cut { "…" } else { "" };
        write!(f, "`{}{ellipsis}`", self.as_str().escape_debug())
    }
}

impl fmt::Debug for Excerpt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// What an unknown name may have meant: a similar command, or a command without a blank after it.
#[must_use]
pub fn meant(name: &str) -> Option<String> {
    glued(name).or_else(|| nearest(name).map(str::to_owned))
}

/// A command and its first word without a blank between them: `MOVEABSX1000`.
fn glued(name: &str) -> Option<String> {
    let upper = name.to_ascii_uppercase();
    let known = reference::COMMANDS.iter().filter_map(|info| {
        let rest = upper.strip_prefix(info.name)?;
        let word = rest.trim_end_matches(|c: char| c.is_ascii_digit());
        let takes = info.parameters.iter().any(|parameter| parameter.name == word);
        (takes && !word.is_empty()).then_some((info.name, rest))
    });
    let (command, word) = known.max_by_key(|(command, _)| command.len())?;
    Some(format!("{command} {word}"))
}

/// The name of a command that is written nearly so: a letter in three may be wrong.
fn nearest(name: &str) -> Option<&'static str> {
    let name = name.to_ascii_uppercase();
    let known = reference::COMMANDS.iter().map(|info| info.name);
    let (distance, known) = known.map(|known| (levenshtein(&name, known), known)).min()?;
    (distance * 3 <= known.len()).then_some(known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_nearly_right_are_found() {
        for (name, known) in [
            ("movabs", Some("MOVEABS")),
            ("FASTREAL", Some("FASTREL")),
            ("PROGRAMEND", None),
            ("PRGEND", Some("PROGEND")),
            ("REEF", Some("REF")),
            ("Werkzeug", None),
            ("G00", None),
        ] {
            assert_eq!(nearest(name), known, "{name}");
        }
    }

    #[test]
    fn excerpts_are_cut_between_characters() {
        assert_eq!(Excerpt::of("").to_string(), "``");
        assert_eq!(Excerpt::of("größer").to_string(), "`größer`");
        let long = "ä".repeat(12);
        assert_eq!(Excerpt::of(&long).to_string(), format!("`{}…`", "ä".repeat(11)));
        let odd = format!("a{long}");
        assert_eq!(Excerpt::of(&odd).to_string(), format!("`a{}…`", "ä".repeat(10)));
        assert_eq!(Excerpt::of("\u{1b}[2J").to_string(), "`\\u{1b}[2J`");
    }
}
