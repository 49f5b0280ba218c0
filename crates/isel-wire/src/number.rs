//! Numbers as the controllers read them: an optional sign and decimal digits.

use nom::branch::alt;
use nom::bytes::complete::take_while;
use nom::character::complete::{char, digit0, digit1};
use nom::combinator::{all_consuming, opt, success, value};
use nom::sequence::delimited;
use nom::{IResult, Parser};

use crate::dialect::Fractions;

/// The largest number a parameter can have unless its command says otherwise: 24 bits in two's
/// complement, as positions are reported (99 §2.2.6).
pub(crate) const LONG_MAX: i32 = (1 << 23) - 1;
/// The smallest, likewise.
pub(crate) const LONG_MIN: i32 = -(1 << 23);

/// The result type of nom here. Why a line cannot be read is never reported, so errors carry
/// nothing.
pub(crate) type Parsed<'a, T> = IResult<&'a [u8], T, ()>;

/// Any number of blanks, which mean nothing between tokens.
pub(crate) fn blanks(input: &[u8]) -> Parsed<'_, &[u8]> {
    take_while(|byte| byte == b' ').parse(input)
}

/// Reads a field as a number; `None` if it is none. A number too large for an `i64` becomes the
/// largest or smallest there is: either way it is out of every range.
pub(crate) fn read(field: &[u8], fractions: Fractions) -> Option<i64> {
    let (_, (number, fraction)) =
        all_consuming(delimited(blanks, (integer, opt(fraction)), blanks)).parse(field).ok()?;
    match fraction {
        Some(()) if fractions == Fractions::Reject => None,
        _ => Some(number),
    }
}

/// A sign or none, and at least one digit.
fn integer(input: &[u8]) -> Parsed<'_, i64> {
    let sign = alt((value(-1, char('-')), value(1, char('+')), success(1)));
    let magnitude = digit1.map(|digits: &[u8]| {
        digits.iter().fold(0_i64, |sum, digit| {
            sum.saturating_mul(10).saturating_add(i64::from(digit - b'0'))
        })
    });
    (sign, magnitude).map(|(sign, magnitude): (i64, i64)| sign * magnitude).parse(input)
}

/// A decimal point and what follows it, whatever its value.
fn fraction(input: &[u8]) -> Parsed<'_, ()> {
    value((), (char('.'), digit0)).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_a_sign_and_digits() {
        for (field, number) in [
            ("0", Some(0)),
            ("-0", Some(0)),
            ("+7", Some(7)),
            ("  -12 ", Some(-12)),
            ("007", Some(7)),
            ("8388608", Some(8_388_608)),
            ("99999999999999999999", Some(i64::MAX)),
            ("-99999999999999999999", Some(-i64::MAX)),
            ("", None),
            (" ", None),
            ("-", None),
            ("--1", None),
            ("+-1", None),
            ("- 1", None),
            ("1 2", None),
            ("5x", None),
            ("x5", None),
            ("0x10", None),
            ("1e3", None),
            ("\t1", None),
        ] {
            for fractions in [Fractions::Reject, Fractions::Truncate] {
                assert_eq!(read(field.as_bytes(), fractions), number, "{field:?}");
            }
        }
    }

    #[test]
    fn a_fraction_is_refused_or_dropped() {
        for (field, truncated) in [
            ("12.7", Some(12)),
            ("-12.7", Some(-12)),
            ("-0.5", Some(0)),
            ("5.", Some(5)),
            (".5", None),
            ("1.5.2", None),
            ("1.x", None),
            ("1,5", None),
        ] {
            assert_eq!(read(field.as_bytes(), Fractions::Truncate), truncated, "{field:?}");
            assert_eq!(read(field.as_bytes(), Fractions::Reject), None, "{field:?}");
        }
    }
}
