//! Spans of time as people write them.

use std::fmt::{self, Display, Formatter};
use std::time::Duration;

use crate::Time;

/// Why a text is not a span of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotADuration {
    /// A number without `ns`, `us` or `µs`, `ms`, `s`, `min` or `h`.
    NoUnit,
    /// No number before the unit.
    NoNumber,
    /// Finer than a nanosecond.
    TooFine,
    /// Longer than a clock of nanoseconds can run, 584 years.
    TooLong,
}

impl Display for NotADuration {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            NotADuration::NoUnit => "has no unit of time",
            NotADuration::NoNumber => "is no time",
            NotADuration::TooFine => "is finer than a nanosecond",
            NotADuration::TooLong => "is too long",
        })
    }
}

impl std::error::Error for NotADuration {}

/// Reads a number with a unit: `250ms`, `1.5s`, `2 min`.
///
/// # Errors
///
/// If it has no unit, is not a number, is finer than a nanosecond or too long for [`Time`].
///
/// ```
/// # use std::time::Duration;
/// assert_eq!(vimc4_device::parse_duration("1.5s"), Ok(Duration::from_millis(1_500)));
/// ```
pub fn parse_duration(text: &str) -> Result<Duration, NotADuration> {
    let is_unit = |c: char| c.is_ascii_alphabetic() || c == 'µ';
    let (number, unit) = text.split_at(text.find(is_unit).unwrap_or(text.len()));
    let scale: u128 = match unit {
        "ns" => 1,
        "us" | "µs" => 1_000,
        "ms" => 1_000_000,
        "s" => 1_000_000_000,
        "min" => 60_000_000_000,
        "h" => 3_600_000_000_000,
        _ => return Err(NotADuration::NoUnit),
    };
    let number = number.trim();
    let (whole, places) = number.split_once('.').unwrap_or((number, "0"));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    if !is_number(whole) || !is_number(places) {
        return Err(NotADuration::NoNumber);
    }
    // No unit has more nanoseconds than fit in 19 digits.
    let places = places.trim_end_matches('0');
    let tenths = u32::try_from(places.len()).ok().filter(|places| *places < 19);
    let tenths = 10_u128.pow(tenths.ok_or(NotADuration::TooFine)?);
    let part = places.parse().unwrap_or(0) * scale;
    if !part.is_multiple_of(tenths) {
        return Err(NotADuration::TooFine);
    }
    let whole = whole.parse::<u64>().map_err(|_| NotADuration::TooLong)?;
    let nanos = u64::try_from(u128::from(whole) * scale + part / tenths).ok();
    let nanos = nanos.filter(|nanos| *nanos < Time::NEVER.as_nanos());
    nanos.map(Duration::from_nanos).ok_or(NotADuration::TooLong)
}

/// Writes a number of nanoseconds so that [`parse_duration`] reads the same: `594.09ms`.
#[must_use]
pub fn show_nanos(nanos: u64) -> String {
    let (unit, places) = match nanos {
        0 => ("ms", 0),
        1_000_000_000.. => ("s", 9),
        1_000_000.. => ("ms", 6),
        1_000.. => ("us", 3),
        _ => ("ns", 0),
    };
    let scale = 10_u64.pow(places);
    let part = format!(".{:0width$}", nanos % scale, width = places as usize);
    let part = part.trim_end_matches('0').trim_end_matches('.');
    format!("{}{part}{unit}", nanos / scale)
}

/// A span of time as [`show_nanos`] writes it.
pub(crate) struct Span(pub(crate) Duration);

impl Display for Span {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&show_nanos(u64::try_from(self.0.as_nanos()).unwrap_or(u64::MAX)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn spans_of_time() {
        for (text, nanos) in [
            ("7ns", 7),
            ("0.25us", 250),
            ("20µs", 20_000),
            ("594.09ms", 594_090_000),
            ("1.5 s", 1_500_000_000),
            ("2min", 120_000_000_000),
            ("0.1h", 360_000_000_000),
            ("1.000h", 3_600_000_000_000),
        ] {
            assert_eq!(parse_duration(text), Ok(Duration::from_nanos(nanos)), "{text}");
        }
        for (text, wrong) in [
            ("", NotADuration::NoUnit),
            ("5", NotADuration::NoUnit),
            ("5 days", NotADuration::NoUnit),
            ("ms", NotADuration::NoNumber),
            ("1.ms", NotADuration::NoNumber),
            (".5ms", NotADuration::NoNumber),
            ("-5ms", NotADuration::NoNumber),
            ("1.2.3ms", NotADuration::NoNumber),
            ("0.5ns", NotADuration::TooFine),
            ("0.00000000000000000001h", NotADuration::TooFine),
            ("99999999h", NotADuration::TooLong),
            ("99999999999999999999ns", NotADuration::TooLong),
        ] {
            assert_eq!(parse_duration(text), Err(wrong), "{text}");
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(nanos in 0..u64::MAX) {
            let nanos = nanos >> (nanos % 64);
            prop_assert_eq!(parse_duration(&show_nanos(nanos)), Ok(Duration::from_nanos(nanos)));
        }
    }
}
