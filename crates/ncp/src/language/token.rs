//! The grammar of tokens.

use std::str::FromStr;

use nom::branch::alt;
use nom::bytes::complete::{tag, take_while, take_while_m_n, take_while1};
use nom::character::complete::{char, digit0, digit1, one_of, space0};
use nom::combinator::{all_consuming, opt, recognize, verify};
use nom::sequence::{pair, preceded, terminated};
use nom::{IResult, Parser};

use super::value::{NotAValue, Value};

/// A token and what follows it. The reader of the line says why there is none.
pub(super) type Token<'t, T> = IResult<&'t str, T, ()>;

/// Blanks and tabs, or nothing.
pub(super) fn blanks(input: &str) -> Token<'_, &str> {
    space0(input)
}

/// Whether it separates words.
pub(super) fn is_blank(c: char) -> bool {
    matches!(c, ' ' | '\t')
}

/// Letters.
pub(super) fn letters(input: &str) -> Token<'_, &str> {
    take_while1(|c: char| c.is_ascii_alphabetic())(input)
}

/// The name of a command, without the number in it or behind it.
pub(super) fn name(input: &str) -> Token<'_, &str> {
    take_while1(|c: char| c.is_ascii_alphabetic() || c == '_')(input)
}

/// The number of a line.
pub(super) fn line_number(input: &str) -> Token<'_, &str> {
    preceded(pair(one_of("Nn"), blanks), digit1).parse(input)
}

/// Digits.
pub(super) fn digits(input: &str) -> Token<'_, &str> {
    digit1(input)
}

/// What is between letters, up to the comment.
pub(super) fn no_letters(input: &str) -> Token<'_, &str> {
    take_while1(|c: char| c != ';' && !c.is_ascii_alphabetic())(input)
}

/// Something that is meant as a number, valid or not.
pub(super) fn numeral(input: &str) -> Token<'_, &str> {
    take_while1(|c: char| matches!(c, '0'..='9' | '+' | '-' | '.'))(input)
}

/// A numeral after an unknown word.
pub(super) fn next_numeral(input: &str) -> Token<'_, &str> {
    preceded(blanks, numeral).parse(input)
}

/// The comma between two limits.
pub(super) fn comma(input: &str) -> Token<'_, &str> {
    recognize((blanks, char(','), blanks)).parse(input)
}

/// The word that takes a work-piece zero from its register.
pub(super) fn act(input: &str) -> Token<'_, &str> {
    verify(letters, |word: &str| word.eq_ignore_ascii_case("ACT")).parse(input)
}

/// The word that leads back to the work-piece zero from outside.
pub(super) fn standard(input: &str) -> Token<'_, &str> {
    let word = verify(letters, |word: &str| word.eq_ignore_ascii_case("STANDARD"));
    preceded(blanks, word).parse(input)
}

/// A comment as other languages have it: in brackets, up to the end of the line or the semicolon.
pub(super) fn bracket_comment(input: &str) -> Token<'_, &str> {
    if !input.starts_with('(') {
        return Err(nom::Err::Error(()));
    }
    let (rest, code) = code(input)?;
    let comment = code.trim_end_matches(is_blank);
    match comment.ends_with(')') {
        true => Ok((rest, comment)),
        false => Err(nom::Err::Error(())),
    }
}

/// The value of a port; `None` if it is none.
pub(super) fn port_value(input: &str) -> Token<'_, Option<u32>> {
    let written = take_while1(|c: char| c.is_ascii_alphanumeric());
    written.map(port_value_of).parse(input)
}

/// The last letter tells the base, so that `10B` is 2, `10D` is 10 and `1BH` is 27.
fn port_value_of(written: &str) -> Option<u32> {
    let (digits, base) = match written.char_indices().next_back()? {
        (end, 'B' | 'b') => (written.get(..end)?, 2),
        (end, 'D' | 'd') => (written.get(..end)?, 10),
        (end, 'H' | 'h') => (written.get(..end)?, 16),
        _ => (written, 10),
    };
    let digits = digits.chars().map(|digit| digit.to_digit(base));
    let append =
        |sum: u32, digit: Option<u32>| Some(sum.saturating_mul(base).saturating_add(digit?));
    // Letters without digits are no value.
    digits.clone().next()?;
    digits.clone().try_fold(0, append)
}

/// `=` or `==`, which mean the same; there may be blanks around each.
pub(super) fn equals(input: &str) -> Token<'_, &str> {
    let equal = || terminated(char('='), blanks);
    recognize((blanks, equal(), opt(equal()))).parse(input)
}

/// The point between a port and its bit.
pub(super) fn point(input: &str) -> Token<'_, &str> {
    recognize((blanks, tag("."), blanks)).parse(input)
}

/// Everything up to the next blank.
pub(super) fn solid(input: &str) -> Token<'_, &str> {
    take_while1(|c: char| !is_blank(c) && c != ';')(input)
}

/// Everything up to the next blank, letter or beginning of a number: text that can belong to
/// nothing.
pub(super) fn junk(input: &str) -> Token<'_, &str> {
    let solid = |c: char| !is_blank(c) && !matches!(c, ';' | '+' | '-' | '.');
    take_while1(move |c: char| solid(c) && !c.is_ascii_alphanumeric())(input)
}

/// A single character that is no blank and no letter.
pub(super) fn punctuation(input: &str) -> Token<'_, &str> {
    let is_one = |c: char| !is_blank(c) && c != ';' && !c.is_ascii_alphabetic();
    take_while_m_n(1, 1, is_one)(input)
}

/// Everything up to the comment.
pub(super) fn code(input: &str) -> Token<'_, &str> {
    take_while(|c| c != ';')(input)
}

/// A number, and whether it is exactly what is written.
pub(super) struct Exact {
    pub(super) value: Value,
    pub(super) exact: bool,
}

/// The number that a numeral is; `None` if it is none. One beyond [`Value::MOST`] is beyond it,
/// but not by as much as is written.
pub(super) fn number(numeral: &str) -> Option<Exact> {
    let (_, (sign, whole, fraction)) = all_consuming(numeral_parts).parse(numeral).ok()?;
    let append = |sum: i64, digit: u8| (sum * 10 + i64::from(digit - b'0')).min(BEYOND);
    let units = whole.bytes().fold(0, append);
    let mut places = fraction.bytes();
    let kept = (0..3).fold(0, |sum, _| append(sum, places.next().unwrap_or(b'0')));
    let up = places.clone().next().is_some_and(|digit| digit >= b'5');
    let magnitude = units * 1_000 + kept + i64::from(up);
    let signed = if sign == Some('-') { -magnitude } else { magnitude };
    Some(Exact { value: Value::thousandths(signed), exact: places.all(|digit| digit == b'0') })
}

/// Where counting a number's digits ends: more than any value, and far from what an i64 holds.
const BEYOND: i64 = 10_000_000_000;

/// Sign, digits before the point, digits behind it; digits there must be.
fn numeral_parts(input: &str) -> Token<'_, (Option<char>, &str, &str)> {
    let fraction = alt((preceded(char('.'), digit0), tag("")));
    let parts = (opt(one_of("+-")), digit0, fraction);
    verify(parts, |(_, whole, fraction): &(_, &str, &str)| {
        !(whole.is_empty() && fraction.is_empty())
    })
    .parse(input)
}

/// As a file has it: `-2500`, `12.5`.
impl FromStr for Value {
    type Err = NotAValue;

    fn from_str(text: &str) -> Result<Value, NotAValue> {
        let number = number(text).filter(|number| number.exact).ok_or(NotAValue)?;
        number.value.times(1).ok_or(NotAValue)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numerals_are_exact_to_three_places() {
        let read = |text| number(text).map(|number| (number.value.in_thousandths(), number.exact));
        for (text, value) in [
            ("0", (0, true)),
            ("-02500", (-2_500_000, true)),
            ("+5", (5_000, true)),
            ("-0", (0, true)),
            (".5", (500, true)),
            ("5.", (5_000, true)),
            ("1.25", (1_250, true)),
            ("-0.001", (-1, true)),
            ("1.2340000", (1_234, true)),
            ("1.2344", (1_234, false)),
            ("1.2345", (1_235, false)),
            ("-1.2345", (-1_235, false)),
            ("0.9996", (1_000, false)),
            ("1000000000", (Value::MOST.in_thousandths(), true)),
        ] {
            assert_eq!(read(text), Some(value), "{text}");
        }
        for text in ["", "-", ".", "-.", "+-5", "5-", "1.2.3", "1..", "5 ", "x"] {
            assert_eq!(read(text), None, "{text}");
        }
        let endless = "9".repeat(400);
        assert!(read(&endless).is_some_and(|(value, _)| value > Value::MOST.in_thousandths()));
    }
}
