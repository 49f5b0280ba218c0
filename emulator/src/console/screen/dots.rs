//! Dots in the terminal: eight to a character, as braille has them.

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;
use ratatui_core::style::Style;

/// The number of the first braille character, which has no dots.
const BRAILLE: u32 = 0x2800;

/// Which bit of a braille character a dot is: by row, left and right.
const BITS: [[u8; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

/// A sheet of dots. (0, 0) is at the lower left.
pub(super) struct Dots {
    area: Rect,
    cells: Vec<(u8, Style)>,
}

impl Dots {
    pub(super) fn new(area: Rect) -> Dots {
        Dots {
            area,
            cells: vec![(0, Style::new()); usize::from(area.width) * usize::from(area.height)],
        }
    }

    /// How many dots it is wide.
    pub(super) fn width(&self) -> i64 {
        i64::from(self.area.width) * 2
    }

    /// How many dots it is high.
    pub(super) fn height(&self) -> i64 {
        i64::from(self.area.height) * 4
    }

    /// Puts a dot. The style of a character is that of the dot that was put last.
    pub(super) fn dot(&mut self, x: i64, y: i64, style: Style) {
        let (width, height) = (self.width(), self.height());
        if !(0..width).contains(&x) || !(0..height).contains(&y) {
            return;
        }
        let row = height - 1 - y;
        let place = (row / 4) * i64::from(self.area.width) + x / 2;
        let cell = usize::try_from(place).ok().and_then(|place| self.cells.get_mut(place));
        if let Some((bits, own)) = cell {
            *bits |= BITS[(row % 4) as usize][(x % 2) as usize];
            *own = style;
        }
    }

    /// A straight line with every `every`th of its dots. What lies outside is left out before it is
    /// walked along, so that a line of any length takes no longer than one across the sheet.
    pub(super) fn line(&mut self, from: (f64, f64), to: (f64, f64), every: usize, style: Style) {
        let Some((from, to)) = self.clipped(from, to) else { return };
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let steps = dx.abs().max(dy.abs()).ceil().max(1.0);
        for step in (0..=steps as usize).step_by(every.max(1)) {
            let part = step as f64 / steps;
            let (x, y) = (from.0 + dx * part, from.1 + dy * part);
            self.dot(x.round() as i64, y.round() as i64, style);
        }
    }

    /// The part of a line that is on the sheet, and a dot around it (Liang and Barsky).
    fn clipped(&self, from: (f64, f64), to: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        if !dx.is_finite() || !dy.is_finite() {
            return None;
        }
        let (right, top) = (self.width() as f64, self.height() as f64);
        let (mut begin, mut end) = (0.0_f64, 1.0_f64);
        let edges =
            [(-dx, from.0 + 1.0), (dx, right - from.0), (-dy, from.1 + 1.0), (dy, top - from.1)];
        for (towards, distance) in edges {
            if towards == 0.0 {
                if distance < 0.0 {
                    return None;
                }
            } else if towards < 0.0 {
                begin = begin.max(distance / towards);
            } else {
                end = end.min(distance / towards);
            }
        }
        let at = |part: f64| (from.0 + dx * part, from.1 + dy * part);
        (begin <= end).then(|| (at(begin), at(end)))
    }

    /// Puts all characters that have dots onto the screen.
    pub(super) fn draw(&self, buffer: &mut Buffer) {
        for (place, (bits, style)) in
            self.cells.iter().enumerate().filter(|(_, (bits, _))| *bits > 0)
        {
            let (x, y) = (place as u16 % self.area.width, place as u16 / self.area.width);
            if let Some(cell) = buffer.cell_mut((self.area.x + x, self.area.y + y)) {
                cell.set_char(char::from_u32(BRAILLE + u32::from(*bits)).unwrap_or(' '));
                cell.set_style(*style);
            }
        }
    }
}

/// The dots of a character, if it is one of braille: column and row from above.
pub(super) fn dots_of(character: char) -> Option<impl Iterator<Item = (u8, u8)>> {
    let bits =
        u32::from(character).checked_sub(BRAILLE).and_then(|bits| u8::try_from(bits).ok())?;
    let places = (0..4).flat_map(|row| (0..2).map(move |column| (column, row)));
    Some(places.filter(move |&(column, row): &(u8, u8)| {
        bits & BITS[usize::from(row)][usize::from(column)] != 0
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(sheet: &Dots) -> Vec<String> {
        let mut buffer = Buffer::empty(sheet.area);
        sheet.draw(&mut buffer);
        let row = |y| (0..sheet.area.width).map(|x| buffer[(x, y)].symbol().to_owned()).collect();
        (0..sheet.area.height).map(row).collect()
    }

    #[test]
    fn a_dot_is_where_it_is_put() {
        let mut sheet = Dots::new(Rect::new(0, 0, 2, 2));
        assert_eq!((sheet.width(), sheet.height()), (4, 8));
        sheet.dot(0, 0, Style::new());
        sheet.dot(3, 7, Style::new());
        for outside in [(-1, 0), (4, 0), (0, 8), (0, -1)] {
            sheet.dot(outside.0, outside.1, Style::new());
        }
        assert_eq!(drawn(&sheet), [" ⠈", "⡀ "]);
    }

    #[test]
    fn a_line_is_cut_at_the_edges_and_goes_the_same_way() {
        let mut whole = Dots::new(Rect::new(0, 0, 3, 1));
        whole.line((0.0, 0.0), (5.0, 3.0), 1, Style::new());
        let mut longer = Dots::new(Rect::new(0, 0, 3, 1));
        longer.line((-5e9, -3e9), (5e9, 3e9), 1, Style::new());
        assert_eq!(drawn(&whole), ["⡠⠔⠊"]);
        assert_eq!(drawn(&longer)[0].chars().count(), 3);
        for (from, to) in [((-9.0, 9.0), (9.0, 19.0)), ((f64::NAN, 0.0), (1.0, 1.0))] {
            let mut none = Dots::new(Rect::new(0, 0, 3, 1));
            none.line(from, to, 1, Style::new());
            assert_eq!(drawn(&none), ["   "], "{from:?} {to:?}");
        }
    }

    #[test]
    fn the_dots_of_a_character_are_those_that_it_was_made_of() {
        let dots: Vec<_> = dots_of('⡀').into_iter().flatten().collect();
        assert_eq!(dots, [(0, 3)]);
        assert!(dots_of('x').is_none());
    }
}
