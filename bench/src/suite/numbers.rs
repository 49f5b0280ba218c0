//! Numbers for people.

/// A count with its thousands set apart; two digits after the point below ten.
pub(crate) fn count(value: f64) -> String {
    if value.abs() < 10.0 && value.fract() != 0.0 {
        return format!("{value:.2}");
    }
    let digits = format!("{:.0}", value.abs());
    let mut text = if value < 0.0 { "-".to_owned() } else { String::new() };
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A count for each second.
pub(crate) fn rate(value: f64) -> String {
    format!("{} /s", count(value))
}

/// A span of nanoseconds, with three digits that mean something.
pub(crate) fn nanos(value: f64) -> String {
    let (scaled, unit) = match value.abs() {
        small if small < 1e3 => (value, "ns"),
        small if small < 1e6 => (value / 1e3, "µs"),
        small if small < 1e9 => (value / 1e6, "ms"),
        _ => (value / 1e9, "s"),
    };
    let places = match scaled.abs() {
        small if small < 10.0 => 2,
        small if small < 100.0 => 1,
        _ => 0,
    };
    format!("{scaled:.places$} {unit}")
}

/// A number of bytes, in units of 1,000.
pub(crate) fn bytes(value: f64) -> String {
    match value.abs() {
        small if small < 1e3 => format!("{value:.0} B"),
        small if small < 1e6 => format!("{:.1} kB", value / 1e3),
        _ => format!("{:.2} MB", value / 1e6),
    }
}

/// A number of bytes, in KiB.
pub(crate) fn kibibytes(value: f64) -> String {
    format!("{:.1} KiB", value / 1024.0)
}

/// How many times one thing is another.
pub(crate) fn times(ratio: f64) -> String {
    format!("{ratio:.2} ×")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_at_a_glance() {
        assert_eq!(count(1_234_567.4), "1,234,567");
        assert_eq!(count(999.0), "999");
        assert_eq!(count(-12_000.0), "-12,000");
        assert_eq!(count(1.5), "1.50");
        assert_eq!(nanos(512.0), "512 ns");
        assert_eq!(nanos(2_340.0), "2.34 µs");
        assert_eq!(nanos(41_700_000.0), "41.7 ms");
        assert_eq!(bytes(4_567_000.0), "4.57 MB");
        assert_eq!(kibibytes(16_384.0), "16.0 KiB");
    }
}
