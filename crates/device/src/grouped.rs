//! Numbers as people read them.

use std::fmt::{self, Display, Formatter};

/// A number with thousands separators: `-24,001`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grouped(pub i64);

impl Display for Grouped {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let mut rest = self.0.unsigned_abs();
        let mut digits = String::new();
        while rest >= 1_000 {
            digits.insert_str(0, &format!(",{:03}", rest % 1_000));
            rest /= 1_000;
        }
        let sign = if self.0 < 0 { "-" } else { "" };
        // With a width it stands right, as every number does.
        let text = format!("{sign}{rest}{digits}");
        match f.width() {
            Some(width) => write!(f, "{text:>width$}"),
            None => f.write_str(&text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_separated() {
        for (number, text) in [
            (0, "0"),
            (-999, "-999"),
            (1_000, "1,000"),
            (-24_001, "-24,001"),
            (1_234_567, "1,234,567"),
            (i64::MIN, "-9,223,372,036,854,775,808"),
        ] {
            assert_eq!(Grouped(number).to_string(), text);
        }
        assert_eq!(format!("{:>7}|{:8}", Grouped(-1_000), Grouped(1)), " -1,000|       1");
    }
}
