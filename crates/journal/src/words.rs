//! A conversation for people: the lines of `serve -v`.

use std::fmt::{self, Display};
use std::time::Duration;

use bytes::Bytes;
use vimc4_device::{CommandNumber, Deed, Event, Time, escape};

use crate::begun::{Answered, Begun};

/// Puts what happens into words, one line after the other: an answer is shown with its command and
/// how long that took.
#[derive(Debug, Default)]
pub struct Words {
    begun: Begun,
}

impl Words {
    /// Takes note of a command, so that its answer is shown with it.
    pub fn heard(&mut self, at: Time, number: CommandNumber, bytes: &Bytes) {
        self.begun.begin(number, bytes, at);
    }

    /// The words for an event, without its time; `None` for what the log leaves out. `explain`
    /// describes a command for people.
    pub fn event(
        &mut self,
        at: Time,
        command: Option<CommandNumber>,
        event: &Event,
        explain: impl FnOnce(&[u8]) -> String,
    ) -> Option<String> {
        Some(match event {
            Event::Command { bytes, .. } => {
                if let Some(number) = command {
                    self.heard(at, number, bytes);
                }
                format!("{}  {}", escape(bytes), explain(bytes))
            }
            Event::Ignored { bytes, why } => format!("{}  {why}", Excerpt(bytes)),
            Event::Line { line, mnemonic } => format!("line {line}: {mnemonic}"),
            Event::Answer { bytes, why, .. } => {
                let Answered { to, took: span } =
                    command.map_or(Answered::default(), |number| self.begun.answer(number, at));
                let to = to.map(|command| format!("to {}", Excerpt(command)));
                let about: Vec<String> = to.into_iter().chain(span.map(took)).collect();
                let about = about.join(", ");
                let (colon, why) = match why {
                    Some(why) if about.is_empty() => ("", &**why),
                    Some(why) => (": ", &**why),
                    None => ("", ""),
                };
                let blanks = if about.is_empty() && why.is_empty() { "" } else { "  " };
                format!("{}{blanks}{about}{colon}{why}", escape(bytes))
            }
            Event::CutShort { why, .. } => format!("        cut short: {why}"),
            Event::Flash { what } => format!("flash: {what}"),
            Event::Fault { number, news } => format!("fault {number} {news}"),
            Event::Rule { rule, news } => format!("rule {rule} {news}"),
            Event::Baud { baud } => format!("line: {baud} baud"),
            Event::Warning(warning) => format!("warning: {warning}"),
            _ => return None,
        })
    }
}

/// The words for an act. `explain` describes an immediate byte for people.
pub fn deed(by: &impl Display, deed: &Deed, explain: impl FnOnce(&[u8]) -> String) -> String {
    match deed {
        Deed::Byte(byte) => format!("{by}: {byte}  {}", explain(&[*byte])),
        Deed::Several { what, signals } => {
            let signals: Vec<String> =
                signals.iter().map(|(signal, value)| format!("{signal} {value}")).collect();
            format!("{by}: {what} ({})", signals.join(", "))
        }
        deed => format!("{by}: {deed}"),
    }
}

/// A line, with its time in seconds.
pub fn line(at: Time, text: impl Display) -> String {
    format!("{:>15}  {text}", seconds(at))
}

/// A time as in the log: `1.250000 s`.
pub(crate) fn seconds(at: Time) -> String {
    let micros = at.as_nanos() / 1_000;
    format!("{}.{:06} s", micros / 1_000_000, micros % 1_000_000)
}

/// A line, shortened to what a person reads.
#[derive(Clone, Copy, Debug)]
pub struct Excerpt<'a>(pub &'a [u8]);

impl Display for Excerpt<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.get(..100) {
            Some(beginning) => write!(f, "{}…", escape(beginning)),
            None => f.write_str(&escape(self.0)),
        }
    }
}

/// Words that mean something of their own behind `answered`.
pub(crate) const OF_ANSWERS: [&str; 3] = ["with", "within", "error"];

/// A text, between quotation marks if it is more than a word, or one that means something.
pub(crate) fn quoted(text: &str) -> String {
    let is_word = !text.is_empty() && !text.contains(char::is_whitespace);
    let is_word = is_word && !OF_ANSWERS.contains(&text);
    if is_word { text.to_owned() } else { format!("\"{text}\"") }
}

/// `after 5.6 s`, in two digits or as many as the whole part has.
pub(crate) fn took(span: Duration) -> String {
    if span.is_zero() {
        return "at once".to_owned();
    }
    format!("after {}", short(span))
}

/// `5.6 s`, in two digits or as many as the whole part has.
pub(crate) fn short(span: Duration) -> String {
    let nanos = span.as_nanos();
    let (unit, name) = match nanos {
        0..1_000_000 => (1_000, "µs"),
        1_000_000..1_000_000_000 => (1_000_000, "ms"),
        _ => (1_000_000_000, "s"),
    };
    let value = nanos as f64 / f64::from(unit);
    let text = if value < 9.95 { format!("{value:.1}") } else { format!("{value:.0}") };
    format!("{} {name}", text.strip_suffix(".0").unwrap_or(&text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_short() {
        let text = |nanos| took(Duration::from_nanos(nanos));
        assert_eq!(text(0), "at once");
        assert_eq!(text(520_834), "after 521 µs");
        assert_eq!(text(1_040_000), "after 1 ms");
        assert_eq!(text(9_960_000_000), "after 10 s");
        assert_eq!(text(600_000_000_000), "after 600 s");
    }
}
