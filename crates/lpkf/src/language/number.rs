//! Numbers as the controllers read them.
//!
//! A number is an optional sign, digits, and optionally a point and digits. Assumed, because
//! the manual says no more: the digits before the point may be missing, a sign or a second point
//! begins the next number, and a sign or a point without any digit is nothing but a separator.

use std::fmt::{self, Display, Formatter};

use serde::{Deserialize, Serialize};

/// Millionths in a whole.
const WHOLE: i64 = 1_000_000;

/// The decimals that are kept: those of a millionth.
const DECIMALS: usize = 6;

/// A decimal number, exact to a millionth.
///
/// The seventh decimal rounds it, halves away from zero; a number with more than twelve digits
/// before the point becomes the largest or smallest there is, which is out of every range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Number {
    /// Its value in millionths.
    pub millionths: i64,
}

impl Number {
    /// The nearest whole number, halves away from zero, within the 32 bits that the controllers
    /// calculate with. Assumed: a parameter beyond them is clipped, not wrapped.
    #[must_use]
    pub fn whole(self) -> i32 {
        clip(self.nearest())
    }

    /// Whether it is beyond the 32 bits.
    #[must_use]
    pub(crate) fn is_clipped(self) -> bool {
        i64::from(self.whole()) != self.nearest()
    }

    /// A speed in µm/s. With `metres`, as an early program in the field took it, a number below 1 is
    /// in m/s: `0.005` is 5,000 µm/s.
    #[must_use]
    pub fn speed(self, metres: bool) -> i32 {
        if metres && self.millionths.unsigned_abs() < WHOLE.unsigned_abs() {
            clip(self.millionths)
        } else {
            self.whole()
        }
    }

    /// The nearest number of thousandths; 0 for a negative one.
    #[must_use]
    pub fn thousandths(self) -> u64 {
        (self.millionths() + 500) / 1_000
    }

    /// The number of millionths; 0 for a negative one.
    #[must_use]
    pub fn millionths(self) -> u64 {
        u64::try_from(self.millionths).unwrap_or(0)
    }

    fn nearest(self) -> i64 {
        let half = if self.millionths < 0 { -WHOLE / 2 } else { WHOLE / 2 };
        self.millionths.saturating_add(half) / WHOLE
    }
}

impl Display for Number {
    /// As it can be read again, with as many decimals as it needs.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let sign = if self.millionths < 0 { "-" } else { "" };
        let (magnitude, whole) = (self.millionths.unsigned_abs(), WHOLE.unsigned_abs());
        write!(f, "{sign}{}", magnitude / whole)?;
        let decimals = format!("{:06}", magnitude % whole);
        match decimals.trim_end_matches('0') {
            "" => Ok(()),
            decimals => write!(f, ".{decimals}"),
        }
    }
}

impl From<i32> for Number {
    fn from(whole: i32) -> Self {
        Self { millionths: i64::from(whole) * WHOLE }
    }
}

/// The nearest number of 32 bits.
fn clip(number: i64) -> i32 {
    i32::try_from(number).unwrap_or(if number < 0 { i32::MIN } else { i32::MAX })
}

/// The numbers among these bytes, in order: what a controller makes of the parameters of a command.
pub fn numbers(bytes: &[u8]) -> impl Iterator<Item = Number> {
    let mut rest = bytes;
    std::iter::from_fn(move || {
        while !rest.is_empty() {
            let (number, length) = number(rest);
            rest = rest.get(length..).unwrap_or_default();
            if number.is_some() {
                return number;
            }
        }
        None
    })
}

/// The number that begins here, if one does, and the bytes that are done with it; at least one.
fn number(bytes: &[u8]) -> (Option<Number>, usize) {
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits(bytes, sign);
    let had_point = bytes.get(sign + whole.len()) == Some(&b'.');
    let decimals = if had_point { digits(bytes, sign + whole.len() + 1) } else { &[] };
    let length = sign + whole.len() + usize::from(had_point) + decimals.len();
    if whole.is_empty() && decimals.is_empty() {
        return (None, length.max(1));
    }
    // Most numbers are short and whole.
    if decimals.is_empty() && whole.len() <= 9 {
        let magnitude = whole.iter().fold(0, |sum, digit| sum * 10 + i64::from(digit - b'0'));
        let whole = if bytes.first() == Some(&b'-') { -magnitude } else { magnitude };
        return (Some(Number { millionths: whole * WHOLE }), length);
    }
    let kept = decimals.iter().copied().chain([b'0'; DECIMALS]).take(DECIMALS);
    let magnitude =
        whole.iter().copied().chain(kept).fold(0_i64, |sum, digit| {
            sum.saturating_mul(10).saturating_add(i64::from(digit - b'0'))
        });
    let round = i64::from(decimals.get(DECIMALS).is_some_and(|&digit| digit >= b'5'));
    let magnitude = magnitude.saturating_add(round);
    let millionths = if bytes.first() == Some(&b'-') { -magnitude } else { magnitude };
    (Some(Number { millionths }), length)
}

/// The digits from here on.
fn digits(bytes: &[u8], from: usize) -> &[u8] {
    let bytes = bytes.get(from..).unwrap_or_default();
    let end = bytes.iter().position(|byte| !byte.is_ascii_digit()).unwrap_or(bytes.len());
    &bytes[..end]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Vec<i64> {
        numbers(text.as_bytes()).map(|number| number.millionths).collect()
    }

    fn wholes(text: &str) -> Vec<i32> {
        numbers(text.as_bytes()).map(Number::whole).collect()
    }

    #[test]
    fn a_number_is_a_sign_digits_and_decimals() {
        assert_eq!(read("0.005000"), [5_000]);
        assert_eq!(read("90.000000"), [90_000_000]);
        assert_eq!(read("90"), [90_000_000]);
        assert_eq!(read("-0.0000015"), [-2]);
        assert_eq!(read("0.0000014999"), [1]);
        assert_eq!(read("5."), [5_000_000]);
        assert_eq!(read(".5"), [500_000]);
        assert_eq!(read("-.5"), [-500_000]);
    }

    #[test]
    fn everything_else_separates() {
        assert_eq!(wholes("1,2"), [1, 2]);
        assert_eq!(wholes(" 1 \t,; 2x3\u{e4}4"), [1, 2, 3, 4]);
        assert_eq!(wholes("1-2+3"), [1, -2, 3]);
        assert_eq!(read("1.5.25"), [1_500_000, 250_000]);
        for nothing in ["", " ", ",", "-", "+", ".", "-.", "--", "..", "e"] {
            assert!(read(nothing).is_empty(), "{nothing:?}");
        }
        assert_eq!(wholes("--1"), [-1]);
        assert_eq!(wholes("+-1"), [-1]);
        assert_eq!(wholes("- 1"), [1]);
        assert_eq!(wholes("1e3"), [1, 3]);
    }

    #[test]
    fn whole_numbers_are_rounded_and_clipped() {
        assert_eq!(wholes("1.499999 1.5 -1.499999 -1.5 0.4 -0.4"), [1, 2, -1, -2, 0, 0]);
        assert_eq!(
            wholes("2147483647 2147483648 -2147483648 -2147483649"),
            [i32::MAX, i32::MAX, i32::MIN, i32::MIN]
        );
        assert_eq!(wholes("99999999999999999999 -99999999999999999999"), [i32::MAX, i32::MIN]);
    }

    #[test]
    fn a_speed_below_one_may_be_in_metres() {
        let speed = |text: &str, metres| {
            numbers(text.as_bytes()).map(|number| number.speed(metres)).collect::<Vec<_>>()
        };
        assert_eq!(
            speed("0.005000 0.999999 1.0 5000 5000.0 0", true),
            [5_000, 999_999, 1, 5_000, 5_000, 0]
        );
        assert_eq!(speed("0.005000 0.999999 5000", false), [0, 1, 5_000]);
        assert_eq!(speed("-0.005", true), [-5_000]);
    }
}
