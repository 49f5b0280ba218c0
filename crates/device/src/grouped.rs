//! Numbers as people read them.

use std::fmt::{self, Display, Formatter};

/// A number with thousands separators: `-24,001`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grouped(pub i64);

impl Display for Grouped {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Grouped(number) = *self;
        if number.unsigned_abs() < 1_000 {
            return write!(f, "{number}");
        }
        write!(f, "{},{:03}", Grouped(number / 1_000), (number % 1_000).unsigned_abs())
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
    }
}
