//! What can follow a line that has been begun.

use vimc4_device::{Device, SignalKind};

use crate::debugger::Debugger;
use crate::field::names_after;
use crate::table::{Directive, Follows, TABLE};
use crate::unit::Unit;

/// How a line can go on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Completion {
    /// Where in the line the word begins that is completed, in bytes.
    pub from: usize,
    /// What can stand there, with a few words about it.
    pub candidates: Vec<Candidate>,
}

/// A word that can stand somewhere.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// The word.
    pub text: String,
    /// What it is; may be empty.
    pub about: String,
}

impl Debugger {
    /// What the word can be that ends at `cursor`, a place in bytes.
    #[must_use]
    pub fn complete(&self, line: &str, cursor: usize) -> Completion {
        let begun = line.get(..cursor.min(line.len())).unwrap_or(line);
        let words: Vec<&str> = begun.split_whitespace().collect();
        let begins_word = begun.is_empty() || begun.ends_with(char::is_whitespace);
        let word = if begins_word { "" } else { words.last().copied().unwrap_or_default() };
        let from = begun.len() - word.len();
        let place = words.len() - usize::from(!begins_word);
        let plain = |text: &str| Candidate { text: text.to_owned(), about: String::new() };
        let mut candidates = match words.first().filter(|_| place > 0) {
            None => {
                let directive = |directive: &Directive| Candidate {
                    text: directive.name.to_owned(),
                    about: directive.about.to_owned(),
                };
                let mut all: Vec<Candidate> = TABLE.iter().map(directive).collect();
                let signals = self.device().signals();
                let switches = signals.iter().filter(|signal| signal.positions.is_some());
                all.extend(switches.map(|switch| Candidate {
                    text: switch.name.clone(),
                    about: switch.about.clone(),
                }));
                all
            }
            Some(first) => match Directive::named(first) {
                Some(directive) => self.candidates(directive.follows, word, place),
                None => {
                    let signals = self.device().signals();
                    let switch = signals.iter().find(|signal| signal.name == *first);
                    let positions = switch.and_then(|switch| switch.positions.clone());
                    positions.iter().flatten().map(|position| plain(position)).collect()
                }
            },
        };
        candidates.retain(|candidate| candidate.text.starts_with(word) && candidate.text != word);
        candidates.dedup();
        Completion { from, candidates }
    }

    fn candidates(&self, follows: Follows, word: &str, place: usize) -> Vec<Candidate> {
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
            Follows::Condition | Follows::Trigger if place == 1 => {
                let mut all = of(&[
                    "command", "answered", "answer", "line", "outside", "port", "limit", "signal",
                    "idle", "at",
                ]);
                if follows == Follows::Trigger {
                    all.extend(of(&["change"]));
                }
                let axes = self.device().view(self.now()).axes;
                all.extend(axes.iter().map(|axis| plain(&axis.name.to_lowercase())));
                all
            }
            Follows::Condition | Follows::Trigger => {
                let mut all = self.signal_names();
                if follows == Follows::Trigger {
                    all.extend(self.fields(word));
                    all.extend(of(&["if", "log", "hit", "every", "from"]));
                }
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
                let words = of(&["start", "end", "command", "line"]);
                words.into_iter().chain(marks).chain(branches).collect()
            }
            Follows::Mark => self.marks().keys().map(|name| plain(name)).collect(),
            Follows::Branch => self.history().branches().map(|b| plain(&b.name)).collect(),
            Follows::Button => {
                let signals = self.device().signals();
                let buttons = signals.iter().filter(|signal| signal.kind == SignalKind::Button);
                let buttons = buttons.map(|button| Candidate {
                    text: button.name.clone(),
                    about: button.about.clone(),
                });
                buttons.collect()
            }
            Follows::Signal => self.signal_names(),
            Follows::Words(words) => of(words),
            Follows::Directive => TABLE.iter().map(|other| plain(other.name)).collect(),
        }
    }

    fn signal_names(&self) -> Vec<Candidate> {
        let signals = self.device().signals();
        let names = signals
            .iter()
            .map(|signal| Candidate { text: signal.name.clone(), about: signal.about.clone() });
        names.collect()
    }

    /// The fields that a path which has been begun can be.
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
