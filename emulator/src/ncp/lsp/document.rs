//! A file as the editor has it, and places in it.

use std::ops;

use lsp_types::{Position, Range, TextDocumentContentChangeEvent, Uri};
use vimc4_ncp::language::BYTE_ORDER_MARK;

/// A file that is open in the editor.
///
/// Editors count lines that end with LF, CR LF or CR, and UTF-16 code units in them; everything
/// else here counts bytes. Where a file has a byte order mark, editors count it too, and its text
/// begins behind it.
#[derive(Clone, Debug)]
pub(super) struct Document {
    pub(super) uri: Uri,
    pub(super) version: i32,
    /// Whether it has changed since it was checked.
    pub(super) is_new: bool,
    /// All that the editor has.
    whole: String,
    /// Where the lines of that begin.
    starts: Vec<usize>,
}

impl Document {
    pub(super) fn new(uri: Uri, version: i32, whole: String) -> Document {
        let starts = starts(&whole);
        Document { uri, version, is_new: true, whole, starts }
    }

    /// What the file says.
    pub(super) fn text(&self) -> &str {
        self.whole.get(self.begins()..).unwrap_or_default()
    }

    /// Follows a change. Without a range the whole text is new.
    pub(super) fn change(&mut self, change: TextDocumentContentChangeEvent) {
        match change.range {
            Some(range) => {
                let (start, end) = (self.place(range.start), self.place(range.end));
                self.whole.replace_range(start..end.max(start), &change.text);
            }
            None => self.whole = change.text,
        }
        self.starts = starts(&self.whole);
        self.is_new = true;
    }

    /// The byte of the text at a position; a position beyond a line is at its end, and one before a
    /// byte order mark is behind it.
    pub(super) fn offset(&self, position: Position) -> usize {
        self.place(position).saturating_sub(self.begins())
    }

    /// The position of a byte of the text.
    pub(super) fn position(&self, offset: usize) -> Position {
        let place = self.begins() + offset;
        let line = self.starts.partition_point(|start| *start <= place).saturating_sub(1);
        let start = self.line(line).start;
        let before = self.whole.get(start..place).unwrap_or_default();
        Position { line: line as u32, character: before.encode_utf16().count() as u32 }
    }

    /// The range of bytes.
    pub(super) fn range(&self, bytes: ops::Range<usize>) -> Range {
        Range { start: self.position(bytes.start), end: self.position(bytes.end) }
    }

    /// The bytes of a range.
    pub(super) fn bytes(&self, range: Range) -> ops::Range<usize> {
        let (start, end) = (self.offset(range.start), self.offset(range.end));
        start..end.max(start)
    }

    /// Where the text begins in the whole.
    fn begins(&self) -> usize {
        if self.whole.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 }
    }

    /// The byte of the whole at a position.
    fn place(&self, position: Position) -> usize {
        let line = self.line(position.line as usize);
        let text = self.whole.get(line.clone()).unwrap_or_default().trim_end_matches(['\r', '\n']);
        let mut units = 0;
        let before = text.char_indices().find(|(_, character)| {
            units += character.len_utf16();
            units > position.character as usize
        });
        line.start + before.map_or(text.len(), |(at, _)| at)
    }

    /// The bytes of a line of the whole with its end; nothing, behind everything, for a line there
    /// is not.
    fn line(&self, number: usize) -> ops::Range<usize> {
        let start = |number| self.starts.get(number).copied().unwrap_or(self.whole.len());
        start(number)..start(number.saturating_add(1))
    }
}

/// Where lines begin.
fn starts(text: &str) -> Vec<usize> {
    let bytes = text.as_bytes();
    let ends = bytes.iter().zip(1..).filter(|(byte, next)| match byte {
        b'\n' => true,
        b'\r' => bytes.get(*next) != Some(&b'\n'),
        _ => false,
    });
    std::iter::once(0).chain(ends.map(|(_, next)| next)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document(text: &str) -> Document {
        let uri = "file:///part.ncp".parse().expect("a name");
        Document::new(uri, 1, text.to_owned())
    }

    fn at(line: u32, character: u32) -> Position {
        Position { line, character }
    }

    #[test]
    fn positions_count_utf_16() {
        let document = document("aä€𝄞b\r\nx\ry\n");
        for (offset, position) in [
            (0, at(0, 0)),
            (1, at(0, 1)),
            (3, at(0, 2)),
            (6, at(0, 3)),
            (10, at(0, 5)),
            (11, at(0, 6)),
            (13, at(1, 0)),
            (15, at(2, 0)),
            (16, at(2, 1)),
            (17, at(3, 0)),
        ] {
            assert_eq!(document.position(offset), position, "{offset}");
            assert_eq!(document.offset(position), offset, "{position:?}");
        }
    }

    #[test]
    fn positions_that_are_not_there_are_the_nearest() {
        let document = document("a𝄞\r\nb");
        assert_eq!(document.offset(at(0, 2)), 1, "within a character");
        assert_eq!(document.offset(at(0, 99)), 5, "before the end of the line");
        assert_eq!(document.offset(at(1, 99)), 8);
        assert_eq!(document.offset(at(9, 0)), 8);
        assert_eq!(document.offset(at(u32::MAX, u32::MAX)), 8);
        assert_eq!(document.position(99), at(1, 0));
    }

    #[test]
    fn the_text_begins_behind_a_byte_order_mark() {
        let mut document = document("\u{FEFF}REF X\nHALT");
        assert_eq!(document.text(), "REF X\nHALT");
        for (offset, position) in [(0, at(0, 1)), (5, at(0, 6)), (6, at(1, 0)), (10, at(1, 4))] {
            assert_eq!(document.position(offset), position, "{offset}");
            assert_eq!(document.offset(position), offset, "{position:?}");
        }
        assert_eq!(document.offset(at(0, 0)), 0);
        // It is as much the editor's as all else.
        let mut change = |start, end, text: &str| {
            let (range, text) = (Some(Range { start, end }), text.to_owned());
            document.change(TextDocumentContentChangeEvent { range, range_length: None, text });
            (document.text().to_owned(), document.position(0))
        };
        assert_eq!(change(at(0, 1), at(0, 4), "REF Y"), ("REF Y X\nHALT".to_owned(), at(0, 1)));
        assert_eq!(change(at(0, 0), at(0, 8), "VEL"), ("VEL\nHALT".to_owned(), at(0, 0)));
        assert_eq!(change(at(0, 0), at(0, 0), "\u{FEFF}"), ("VEL\nHALT".to_owned(), at(0, 1)));
    }

    #[test]
    fn changes_are_followed() {
        let mut document = document("REF X\nVEL 5\n");
        let mut change = |range: Option<(Position, Position)>, text: &str| {
            let range = range.map(|(start, end)| Range { start, end });
            let text = text.to_owned();
            document.change(TextDocumentContentChangeEvent { range, range_length: None, text });
            document.text().to_owned()
        };
        assert_eq!(change(Some((at(1, 4), at(1, 5))), "70\nHALT"), "REF X\nVEL 70\nHALT\n");
        assert_eq!(change(Some((at(2, 4), at(2, 4))), " ; x"), "REF X\nVEL 70\nHALT ; x\n");
        assert_eq!(change(Some((at(0, 0), at(1, 0))), ""), "VEL 70\nHALT ; x\n");
        assert_eq!(change(Some((at(1, 0), at(0, 0))), "!"), "VEL 70\n!HALT ; x\n");
        assert_eq!(change(None, "VEL 1"), "VEL 1");
        assert_eq!(change(Some((at(0, 5), at(0, 5))), "0"), "VEL 10");
    }
}
