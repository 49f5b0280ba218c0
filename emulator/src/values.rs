//! The values of options that several commands have.

use std::time::Duration;

use vimc4_device::{NotADuration, parse_duration};

/// A number of bytes: `500k`, `64M`, `2G`.
pub(crate) fn size(text: &str) -> Result<u64, String> {
    let help = || "a number of bytes is needed, as in 500k, 64M or 2G".to_owned();
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let factor = match text.get(digits.len()..).unwrap_or_default() {
        "" => 1,
        "k" | "K" | "kB" => 1_000,
        "M" | "MB" => 1_000_000,
        "G" | "GB" => 1_000_000_000,
        _ => return Err(help()),
    };
    let size = digits.parse::<u64>().ok().and_then(|number| number.checked_mul(factor));
    size.filter(|size| *size > 0).ok_or_else(help)
}

/// A span of time in the usual form.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    parse_duration(text).map_err(|error| match error {
        NotADuration::TooFine | NotADuration::TooLong => format!("it {error}"),
        _ => "a number with a unit is needed, as in 250ms, 2s, 5min or 1h".to_owned(),
    })
}
