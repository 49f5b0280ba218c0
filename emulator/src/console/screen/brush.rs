//! Writing into a rectangle of the screen.

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;

use super::ink::{Ink, Inks};
use crate::text::shown_in_line;

/// A rectangle to be written into line by line.
pub(super) struct Brush<'b> {
    pub(super) buffer: &'b mut Buffer,
    pub(super) area: Rect,
    pub(super) inks: Inks,
    row: u16,
}

impl<'b> Brush<'b> {
    pub(super) fn new(buffer: &'b mut Buffer, area: Rect, inks: Inks) -> Brush<'b> {
        let area = area.intersection(buffer.area);
        Brush { buffer, area, inks, row: 0 }
    }

    /// The same with a rule and a title above, if there is room.
    pub(super) fn titled(
        buffer: &'b mut Buffer,
        area: Rect,
        inks: Inks,
        title: &str,
        note: &str,
    ) -> Brush<'b> {
        let mut brush = Brush::new(buffer, area, inks);
        let width = usize::from(brush.area.width);
        if brush.area.is_empty() {
            return brush;
        }
        let (x, y) = (brush.area.x, brush.area.y);
        brush.put(x, y, width, &"─".repeat(width), Ink::Faint);
        let end = brush.put(x + 1, y, width.saturating_sub(2), &format!(" {title} "), Ink::Strong);
        let left = usize::from(brush.area.right().saturating_sub(end));
        let note_width = note.chars().count() + 3;
        if !note.is_empty() && note_width < left {
            let at = brush.area.right() - note_width as u16;
            brush.put(at, y, note_width, &format!(" {note} "), Ink::Faint);
        }
        brush.area.y += 1;
        brush.area.height -= 1;
        brush
    }

    /// How many lines there is still room for.
    pub(super) fn room(&self) -> usize {
        usize::from(self.area.height.saturating_sub(self.row))
    }

    /// Characters in a line.
    pub(super) fn width(&self) -> usize {
        usize::from(self.area.width)
    }

    /// Writes pieces of a line and goes to the next. What does not fit is cut off, and what a
    /// terminal would obey is replaced.
    pub(super) fn line<T: AsRef<str>>(&mut self, pieces: &[(T, Ink)]) {
        if self.room() == 0 {
            return;
        }
        let (mut x, y) = (self.area.x, self.area.y + self.row);
        for (text, ink) in pieces {
            let left = self.area.right().saturating_sub(x);
            x = self.put(x, y, left.into(), text.as_ref(), *ink);
        }
        self.row += 1;
    }

    /// Writes a line in one ink from edge to edge.
    pub(super) fn bar(&mut self, text: &str, ink: Ink) {
        let width = self.width();
        let length = text.chars().count();
        self.line(&[(format!("{text}{}", " ".repeat(width.saturating_sub(length))), ink)]);
    }

    fn put(&mut self, x: u16, y: u16, width: usize, text: &str, ink: Ink) -> u16 {
        let text = shown_in_line(text).replace('\t', " ");
        self.buffer.set_stringn(x, y, text, width, self.inks.style(ink)).0
    }
}

/// A text in so many characters, with a sign if it was cut.
pub(super) fn fitted(text: &str, width: usize) -> String {
    let length = text.chars().count();
    if length <= width {
        return text.to_owned();
    }
    let mut cut: String = text.chars().take(width.saturating_sub(1)).collect();
    if width > 0 {
        cut.push('…');
    }
    cut
}

/// A time in seconds, exact to the microsecond: finer than people read.
pub(super) fn seconds(nanos: u64) -> String {
    format!("{}.{:06} s", nanos / 1_000_000_000, nanos % 1_000_000_000 / 1_000)
}
