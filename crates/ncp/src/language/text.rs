//! From the bytes of a file to its lines.

use std::borrow::Cow;
use std::ops::Range;

use super::command::Span;

/// What the editors of DOS put after the last byte of a text.
const END_OF_FILE: u8 = 0x1A;

/// What some editors put before the first byte of a text in UTF-8.
pub const BYTE_ORDER_MARK: &str = "\u{FEFF}";

/// The text of a file: UTF-8, or else Windows-1252, in which the programs for Windows wrote
/// umlauts in comments. An end of file as DOS has it ends the text.
#[must_use]
pub fn decode(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK.as_bytes()).unwrap_or(bytes);
    let end = bytes.iter().position(|&byte| byte == END_OF_FILE).unwrap_or(bytes.len());
    let (bytes, _) = bytes.split_at(end);
    match str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|&byte| windows_1252(byte)).collect()),
    }
}

/// The character of a byte. Five bytes have none and become the control characters that
/// ISO 8859-1 has there.
fn windows_1252(byte: u8) -> char {
    /// The characters of 0x80 to 0x9F.
    const UPPER: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8D}', 'Ž',
        '\u{8F}', '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9D}',
        'ž', 'Ÿ',
    ];
    let upper = byte.checked_sub(0x80).and_then(|place| UPPER.get(usize::from(place)));
    upper.copied().unwrap_or(char::from(byte))
}

/// A line of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextLine<'t> {
    /// Its number, from 1.
    pub number: u32,
    /// Where it begins, in bytes from the beginning of the text.
    pub offset: usize,
    /// What it says, without its end.
    pub text: &'t str,
    /// Whether it has an end. Only the last line of a text may have none.
    pub has_end: bool,
}

impl TextLine<'_> {
    /// Where a part of the line is, in bytes from the beginning of the text.
    #[must_use]
    pub fn in_text(&self, span: Span) -> Range<usize> {
        let Range { start, end } = span.range();
        self.offset + start..self.offset + end
    }
}

/// The lines of a text, one after the other: see [`lines`].
#[derive(Clone, Debug)]
pub struct Lines<'t> {
    rest: &'t str,
    number: u32,
    offset: usize,
}

/// The lines of a text, as editors count them: LF, CR LF and CR each end one. Some ways of copying
/// a file double its CRs, which puts an empty line after each. What follows the last end is a line
/// only if it is not empty.
#[must_use]
pub fn lines(text: &str) -> Lines<'_> {
    Lines { rest: text, number: 0, offset: 0 }
}

impl<'t> Iterator for Lines<'t> {
    type Item = TextLine<'t>;

    fn next(&mut self) -> Option<TextLine<'t>> {
        if self.rest.is_empty() {
            return None;
        }
        let length = self.rest.find(['\r', '\n']).unwrap_or(self.rest.len());
        let (text, end) = self.rest.split_at(length);
        let rest = end.strip_prefix("\r\n").or_else(|| end.get(1..)).unwrap_or_default();
        let offset = self.offset;
        self.number += 1;
        self.offset += self.rest.len() - rest.len();
        self.rest = rest;
        Some(TextLine { number: self.number, offset, text, has_end: !end.is_empty() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_utf_8_or_else_windows_1252() {
        assert_eq!(decode("; größer\n".as_bytes()), "; größer\n");
        assert_eq!(decode(b"; gr\xF6\xDFer \x80\x9C\x81"), "; größer €œ\u{81}");
        assert!(matches!(decode(b"REF X"), Cow::Borrowed("REF X")));
    }

    #[test]
    fn marks_of_editors_are_no_text() {
        assert_eq!(decode(b"\xEF\xBB\xBFREF X\x1A\x1A\xFF"), "REF X");
        assert_eq!(decode(b"\x1A"), "");
        assert_eq!(decode(b""), "");
    }

    #[test]
    fn lines_have_numbers_and_offsets() {
        let text = "a\r\n\nb\r\r\n c";
        let found: Vec<_> = lines(text).map(|line| (line.number, line.offset, line.text)).collect();
        assert_eq!(found, [(1, 0, "a"), (2, 3, ""), (3, 4, "b"), (4, 6, ""), (5, 8, " c")]);
        assert_eq!(lines("").count(), 0);
        let text = "a\rb\r\r c\n\r";
        let found: Vec<_> = lines(text).map(|line| (line.number, line.offset, line.text)).collect();
        assert_eq!(found, [(1, 0, "a"), (2, 2, "b"), (3, 4, ""), (4, 5, " c"), (5, 8, "")]);
        assert_eq!(lines("a\n").count(), 1);
    }

    #[test]
    fn a_place_in_a_line_is_a_place_in_the_text() {
        let text = "REF X\r\nVEL 500";
        let line = lines(text).nth(1).expect("two lines");
        assert_eq!(&text[line.in_text(Span { start: 4, end: 7 })], "500");
    }
}
