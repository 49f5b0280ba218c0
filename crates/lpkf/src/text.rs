//! Lines of data, built without an allocation.

use bytes::Bytes;

/// The longest line: a letter, a blank, six positions of ten digits with signs and commas.
const LONGEST: usize = 80;

/// A line that is being written.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnswerLine {
    bytes: [u8; LONGEST],
    length: usize,
}

impl AnswerLine {
    /// A line that begins with a letter.
    pub(crate) fn new(letter: u8) -> AnswerLine {
        let mut line = AnswerLine { bytes: [0; LONGEST], length: 0 };
        line.push(letter);
        line
    }

    /// Adds a character; what is beyond the longest line is left out.
    pub(crate) fn push(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length += 1;
        }
    }

    /// Adds a number in decimal digits, with zeros in front up to `least` digits.
    pub(crate) fn number(&mut self, number: i64, least: usize) {
        let mut digits = [b'0'; 20];
        let (mut rest, mut first) = (number.unsigned_abs(), digits.len());
        while rest > 0 || digits.len() - first < least.clamp(1, digits.len()) {
            first -= 1;
            digits[first] = b'0' + (rest % 10) as u8;
            rest /= 10;
        }
        if number < 0 {
            self.push(b'-');
        }
        digits[first..].iter().for_each(|digit| self.push(*digit));
    }

    /// Adds a number that is not negative in hexadecimal digits.
    pub(crate) fn hexadecimal(&mut self, number: u32) {
        let digits = (number.max(1).ilog2() / 4) + 1;
        for place in (0..digits).rev() {
            self.push(b"0123456789ABCDEF"[(number >> (4 * place) & 15) as usize]);
        }
    }

    /// Adds numbers with commas between them.
    pub(crate) fn numbers(&mut self, numbers: &[i64]) {
        for (index, number) in numbers.iter().enumerate() {
            if index > 0 {
                self.push(b',');
            }
            self.number(*number, 1);
        }
    }

    /// The whole line with its CR.
    pub(crate) fn finish(mut self) -> Bytes {
        self.push(b'\r');
        Bytes::copy_from_slice(&self.bytes[..self.length])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_do() {
        let mut line = AnswerLine::new(b'P');
        line.numbers(&[0, -5, 19_100, i64::from(i32::MIN)]);
        assert_eq!(&line.finish()[..], b"P0,-5,19100,-2147483648\r");
        let mut line = AnswerLine::new(b'S');
        line.hexadecimal(0);
        line.hexadecimal(0x29C8);
        line.hexadecimal(u32::MAX);
        assert_eq!(&line.finish()[..], b"S029C8FFFFFFFF\r");
        let mut line = AnswerLine::new(b'R');
        line.number(7, 4);
        assert_eq!(&line.finish()[..], b"R0007\r");
        let mut line = AnswerLine::new(b'P');
        line.numbers(&[i64::from(i32::MIN); 6]);
        assert_eq!(line.finish().len(), 1 + 6 * 11 + 5 + 1);
        let mut line = AnswerLine::new(b'P');
        line.number(i64::MIN, 0);
        assert_eq!(&line.finish()[..], b"P-9223372036854775808\r");
    }
}
