//! Places in a row as people count them.

use std::fmt::{self, Display, Formatter};

/// `1st`, `2nd`, `3rd`, `4th`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nth(pub u64);

impl Nth {
    /// The number that a word such as `10th` says.
    #[must_use]
    pub fn read(word: &str) -> Option<u64> {
        let number = word.get(..word.len().checked_sub(2)?)?;
        let number = number.parse().ok().filter(|number| *number > 0)?;
        Nth(number).to_string().eq_ignore_ascii_case(word).then_some(number)
    }
}

impl Display for Nth {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let end = match (self.0 % 10, self.0 % 100) {
            (_, 11..=13) => "th",
            (1, _) => "st",
            (2, _) => "nd",
            (3, _) => "rd",
            _ => "th",
        };
        write!(f, "{}{end}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        for (number, word) in
            [(1, "1st"), (2, "2nd"), (3, "3rd"), (11, "11th"), (112, "112th"), (21, "21st")]
        {
            assert_eq!((Nth(number).to_string(), Nth::read(word)), (word.to_owned(), Some(number)));
        }
        for wrong in ["", "1", "st", "1th", "0th", "2st", "+1st", "1s\u{e9}"] {
            assert_eq!(Nth::read(wrong), None, "{wrong}");
        }
    }
}
