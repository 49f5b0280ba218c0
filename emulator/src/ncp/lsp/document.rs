//! A file as the editor has it, and places in it.

use std::ops;

use lsp_types::{Position, Range, TextDocumentContentChangeEvent, Uri};

/// What some editors put before the first character of a text.
const BYTE_ORDER_MARK: char = '\u{FEFF}';

/// A file that is open in the editor.
///
/// Editors count lines that end with LF, CR LF or CR, and UTF-16 code units in them; everything
/// else here counts bytes.
#[derive(Clone, Debug)]
pub(super) struct Document {
    pub(super) uri: Uri,
    pub(super) version: i32,
    /// Whether it has changed since it was checked.
    pub(super) is_new: bool,
    text: String,
    /// Where its lines begin.
    starts: Vec<usize>,
}

impl Document {
    pub(super) fn new(uri: Uri, version: i32, text: String) -> Document {
        let mut document = Document { uri, version, is_new: true, text, starts: Vec::new() };
        document.read();
        document
    }

    /// What the editor has.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// Follows a change. Without a range the whole text is new.
    pub(super) fn change(&mut self, change: TextDocumentContentChangeEvent) {
        match change.range {
            Some(range) => self.text.replace_range(self.bytes(range), &change.text),
            None => self.text = change.text,
        }
        self.read();
        self.is_new = true;
    }

    /// Takes in a text that is new. A byte order mark says nothing: a blank, which counts as many units,
    /// takes its place.
    fn read(&mut self) {
        if self.text.starts_with(BYTE_ORDER_MARK) {
            self.text.replace_range(..BYTE_ORDER_MARK.len_utf8(), " ");
        }
        self.starts = starts(&self.text);
    }

    /// The byte at a position; a position beyond a line is at its end.
    pub(super) fn offset(&self, position: Position) -> usize {
        let line = self.line(position.line as usize);
        let text = self.text.get(line.clone()).unwrap_or_default().trim_end_matches(['\r', '\n']);
        let mut units = 0;
        let before = text.char_indices().find(|(_, character)| {
            units += character.len_utf16();
            units > position.character as usize
        });
        line.start + before.map_or(text.len(), |(at, _)| at)
    }

    /// The position of a byte.
    pub(super) fn position(&self, offset: usize) -> Position {
        let line = self.starts.partition_point(|start| *start <= offset).saturating_sub(1);
        let start = self.line(line).start;
        let before = self.text.get(start..offset).unwrap_or_default();
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

    /// The bytes of a line with its end; nothing, behind everything, for a line there is not.
    fn line(&self, number: usize) -> ops::Range<usize> {
        let start = |number| self.starts.get(number).copied().unwrap_or(self.text.len());
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
