//! The words of a command and their values.

use super::command::{Placed, Span, Word};
use super::problem::Problem;
use super::reader::Reader;
use super::reference::{CommandInfo, MOST_WORDS, Number, Parameter};
use super::token;
use super::value::Value;

/// What was found for each word of a command, in the order of [`CommandInfo::parameters`].
pub(super) type Found<T> = [Option<T>; MOST_WORDS];

impl<'t> Reader<'t, '_> {
    /// The words of a command, each with its number, in any order.
    pub(super) fn words(&mut self, info: &'static CommandInfo) -> Found<Word> {
        self.words_with(info, Reader::word)
    }

    /// The same; a warning if there is none.
    pub(super) fn some_words(&mut self, info: &'static CommandInfo, name: Span) -> Found<Word> {
        let found = self.words(info);
        self.want_any(&found, info, name);
        found
    }

    /// The words of `LIMIT`, each with two numbers.
    pub(super) fn limits(&mut self, info: &'static CommandInfo, name: Span) -> Found<(Word, Word)> {
        let found = self.words_with(info, Reader::pair);
        self.want_any(&found, info, name);
        found
    }

    fn want_any<T>(&mut self, found: &Found<T>, info: &'static CommandInfo, name: Span) {
        if found.iter().all(Option::is_none) && !self.failed() {
            self.say(name, Problem::NothingNamed(info.name));
        }
    }

    fn words_with<T: Copy>(
        &mut self,
        info: &'static CommandInfo,
        read: fn(&mut Self, &'static Parameter, Span) -> Option<T>,
    ) -> Found<T> {
        let mut found = [None; MOST_WORDS];
        while !self.ends() {
            let Some(name) = self.take(token::letters) else {
                self.no_word(info);
                continue;
            };
            let mut known = info.parameters.iter().zip(&mut found);
            let known = known.find(|(word, _)| word.name.eq_ignore_ascii_case(name.value));
            let Some((parameter, place)) = known else {
                self.unknown_word(info, name.span);
                continue;
            };
            let value = read(self, parameter, name.span);
            if place.is_some() {
                self.say(self.since(name.span), Problem::GivenTwice(parameter.name));
            }
            *place = value;
        }
        found
    }

    /// Text that does not begin with a letter where a word is expected.
    fn no_word(&mut self, info: &'static CommandInfo) {
        if let Some(numeral) = self.take(token::numeral) {
            self.say(numeral.span, Problem::StrayNumber(info.name));
        } else if let Some(junk) = self.take(token::junk) {
            self.say(junk.span, Problem::Unexpected(self.excerpt(junk.span)));
        }
    }

    /// A word that the command does not take. Its number goes with it.
    fn unknown_word(&mut self, info: &'static CommandInfo, name: Span) {
        let word = self.excerpt(name);
        let end = self.take(token::next_numeral).map_or(name.end, |numeral| numeral.span.end);
        let span = Span { end, ..name };
        self.say(span, Problem::UnknownWord { command: info.name, word });
    }

    /// The number of a word; for a word that takes none, nothing.
    fn word(&mut self, parameter: &'static Parameter, name: Span) -> Option<Word> {
        let Some(allowed) = parameter.value else {
            return Some(Placed { value: Value::ZERO, span: name });
        };
        let value = self.value(parameter.name, allowed, name)?.value;
        Some(Placed { value, span: self.since(name) })
    }

    /// Two numbers with a comma between them, the lower first.
    fn pair(&mut self, parameter: &'static Parameter, name: Span) -> Option<(Word, Word)> {
        let allowed = parameter.value?;
        let low = self.value(parameter.name, allowed, name);
        let span = self.since(name);
        if self.take(token::comma).is_none() {
            self.say(span, Problem::MissingUpperLimit(parameter.name));
            return None;
        }
        let high = self.value(parameter.name, allowed, name)?;
        let low = Placed { span, ..low? };
        if low.value > high.value {
            self.say(self.since(name), Problem::LimitsReversed(parameter.name));
        }
        Some((low, high))
    }

    /// The number of a command that takes one without a letter.
    pub(super) fn only_value(&mut self, info: &'static CommandInfo, name: Span) -> Option<Word> {
        let allowed = info.parameters.first()?.value?;
        if !self.ends() && !self.next_is(token::numeral) {
            let text = self.pass_over();
            self.say(text, Problem::NotANumber(self.excerpt(text)));
            return None;
        }
        // Digits that are not a value here may be part of something else, which only the whole
        // shows.
        let is_value = |numeral: &str| {
            let number = token::number(numeral);
            number.is_none_or(|number| misfit(info.name, number.value, allowed).is_none())
        };
        if let Ok((behind, numeral)) = token::numeral(self.rest())
            && token::code(behind).is_ok_and(|(_, code)| !code.trim().is_empty())
            && !is_value(numeral)
        {
            let text = self.pass_over();
            self.say(text, Problem::NotANumber(self.excerpt(text)));
            return None;
        }
        self.value(info.name, allowed, name)
    }

    /// A number, for the word or the command `what` before it.
    pub(super) fn value(
        &mut self,
        what: &'static str,
        allowed: Number,
        behind: Span,
    ) -> Option<Word> {
        self.ends();
        let Some(numeral) = self.take(token::numeral) else {
            self.say(behind, Problem::MissingValue(what));
            return None;
        };
        let span = numeral.span;
        let Some(token::Exact { value, exact }) = token::number(numeral.value) else {
            self.say(span, Problem::NotANumber(self.excerpt(span)));
            return None;
        };
        if !exact {
            self.say(span, Problem::Rounded);
        }
        if let Some(problem) = misfit(what, value, allowed) {
            self.say(span, problem);
            return None;
        }
        Some(Placed { value, span })
    }
}

/// Why a word does not take a value.
fn misfit(what: &'static str, value: Value, allowed: Number) -> Option<Problem> {
    let Number { least, most, whole, .. } = allowed;
    if value.in_thousandths().abs() > Value::MOST.in_thousandths() {
        Some(Problem::TooLarge)
    } else if !(least..=most).contains(&value) {
        Some(Problem::OutOfRange { what, least, most })
    } else if whole && value.in_thousandths() % 1_000 != 0 {
        Some(Problem::NotWhole(what))
    } else {
        None
    }
}
