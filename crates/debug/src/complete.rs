//! Completion of a line that has been begun.

use vimc4_language::complete;

use crate::debugger::Debugger;
use crate::field::names_after;
use crate::table::{Directive, Follows, TABLE};
use crate::unit::Unit;

/// How a line can continue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Completion {
    /// Where the completed word begins in the line, in bytes.
    pub from: usize,
    /// The possible words, each with a short description.
    pub candidates: Vec<Candidate>,
}

/// A possible word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// The word.
    pub text: String,
    /// A short description; may be empty.
    pub about: String,
}

impl Debugger {
    /// Completes the word that ends at `cursor`, an offset in bytes.
    #[must_use]
    pub fn complete(&self, line: &str, cursor: usize) -> Completion {
        let begun = line.get(..cursor.min(line.len())).unwrap_or(line);
        let words: Vec<&str> = begun.split_whitespace().collect();
        let begins_word = begun.is_empty() || begun.ends_with(char::is_whitespace);
        let word = if begins_word { "" } else { words.last().copied().unwrap_or_default() };
        let from = begun.len() - word.len();
        let place = words.len() - usize::from(!begins_word);
        let mut candidates = match words.first().filter(|_| place > 0) {
            None => {
                let directive = |directive: &Directive| Candidate {
                    text: directive.name.to_owned(),
                    about: directive.about.to_owned(),
                };
                let mut all: Vec<Candidate> = TABLE.iter().map(directive).collect();
                all.extend(self.orders(begun, from));
                all
            }
            Some(first) => match Directive::named(first) {
                Some(directive) => {
                    let rest = begun.trim_start().get(first.len()..).unwrap_or_default();
                    self.candidates(directive.follows, word, rest.trim_start(), place)
                }
                None => self.orders(begun, from),
            },
        };
        candidates.retain(|candidate| candidate.text.starts_with(word) && candidate.text != word);
        candidates.dedup();
        Completion { from, candidates }
    }

    /// Completes the orders of the panel, from an offset of the line on.
    fn orders(&self, begun: &str, from: usize) -> Vec<Candidate> {
        let from = from.saturating_sub(begun.len() - begun.trim_start().len());
        let begun = begun.trim_start();
        let ways = complete(begun, self.names()).into_iter();
        let known = |text: &str| TABLE.iter().any(|directive| directive.name == text);
        let words = ways.filter_map(|way| {
            let text = way.line.get(from.min(begun.len())..)?.trim_end().to_owned();
            (!known(&text) && !text.is_empty()).then_some(Candidate { text, about: way.about })
        });
        words.collect()
    }

    /// Completes a condition.
    fn conditions(&self, rest: &str, word: &str) -> Vec<Candidate> {
        const UNTIL: &str = "run until ";
        let begun = format!("{UNTIL}{rest}");
        let from = begun.len() - word.len();
        self.orders(&begun, from)
    }

    fn candidates(&self, follows: Follows, word: &str, rest: &str, place: usize) -> Vec<Candidate> {
        let plain = |text: &str| Candidate { text: text.to_owned(), about: String::new() };
        let of = |texts: &[&str]| texts.iter().map(|text| plain(text)).collect::<Vec<_>>();
        match follows {
            Follows::Nothing => Vec::new(),
            Follows::Unit => {
                let named = Unit::NAMED.iter().map(|(name, _, about)| Candidate {
                    text: (*name).to_owned(),
                    about: (*about).to_owned(),
                });
                named.chain(of(&["over", "out"])).collect()
            }
            Follows::Condition => self.conditions(rest, word),
            Follows::Trigger => {
                let mut all = self.conditions(rest, word);
                if place == 1 {
                    all.extend(of(&["change"]));
                } else {
                    all.extend(of(&["if", "log", "hit", "every", "from"]));
                }
                all.extend(self.fields(word));
                all
            }
            Follows::Field => self.fields(word),
            Follows::Breakpoint => {
                let ids = self.breakpoints().iter().map(|breakpoint| Candidate {
                    text: breakpoint.id.to_string(),
                    about: breakpoint.describe(self.names()),
                });
                ids.chain(of(&["all"])).collect()
            }
            Follows::Place => {
                let marks = self.marks().keys().map(|name| plain(name));
                let branches = self.history().branches().map(|branch| plain(&branch.name));
                let words = of(&["start", "end", "command", "difference", "line"]);
                words.into_iter().chain(marks).chain(branches).collect()
            }
            Follows::Mark => self.marks().keys().map(|name| plain(name)).collect(),
            Follows::Branch => self.history().branches().map(|b| plain(&b.name)).collect(),
            Follows::Words(words) => of(words),
            Follows::Directive => TABLE.iter().map(|other| plain(other.name)).collect(),
        }
    }

    /// Completes the path of a field.
    fn fields(&self, word: &str) -> Vec<Candidate> {
        let (before, _) = word.rsplit_once('.').unwrap_or(("", word));
        let path = |name: String| match before {
            "" => name,
            before => format!("{before}.{name}"),
        };
        let names = names_after(self.device(), before).into_iter();
        let candidate = |name| Candidate { text: path(name), about: String::new() };
        names.map(candidate).collect()
    }
}
