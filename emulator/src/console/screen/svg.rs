//! The screen as a picture: its cells, character by character, as SVG.

use std::fmt::Write;

use ratatui_core::buffer::{Buffer, Cell};
use ratatui_core::style::{Color, Modifier};

use super::dots::dots_of;

/// The size of a cell.
const CELL: (u16, u16) = (8, 17);

/// How far below the upper edge of a cell letters stand.
const BASE: u16 = 13;

/// What is around the screen.
const EDGE: u16 = 8;

/// The colours, on a light background and, for whom the dark one is right, on that.
const HEAD: &str = "\
<style>
 svg { --paper: #fdfdfb; --ink: #1d1f21; --red: #b3261e; --green: #1a7f37; --cyan: #0b6e80; --magenta: #8a2be2 }
 @media (prefers-color-scheme: dark) {
  svg { --paper: #16181a; --ink: #e4e4e0; --red: #ff7b72; --green: #56d364; --cyan: #56c8d8; --magenta: #d2a8ff }
 }
 text { font: 13px ui-monospace, SFMono-Regular, Menlo, Consolas, 'DejaVu Sans Mono', monospace; white-space: pre }
</style>
";

/// How a run of cells looks.
#[derive(Clone, Copy, PartialEq)]
struct Look {
    ink: &'static str,
    is_reversed: bool,
    is_bold: bool,
    is_faint: bool,
    is_underlined: bool,
}

impl Look {
    fn of(cell: &Cell) -> Look {
        let has = |modifier| cell.modifier.contains(modifier);
        let ink = match cell.fg {
            Color::Red => "var(--red)",
            Color::Green => "var(--green)",
            Color::Cyan => "var(--cyan)",
            Color::Magenta => "var(--magenta)",
            _ => "var(--ink)",
        };
        Look {
            ink,
            is_reversed: has(Modifier::REVERSED),
            is_bold: has(Modifier::BOLD),
            is_faint: has(Modifier::DIM),
            is_underlined: has(Modifier::UNDERLINED),
        }
    }
}

/// The whole of it. `title` is for those who cannot see it.
pub(crate) fn svg(buffer: &Buffer, title: &str) -> String {
    let area = buffer.area;
    let (width, height) = (area.width * CELL.0 + 2 * EDGE, area.height * CELL.1 + 2 * EDGE);
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" role=\"img\">\n<title>{}</title>",
        escaped(title)
    );
    out.push_str(HEAD);
    let _ = writeln!(
        out,
        "<rect width=\"{width}\" height=\"{height}\" rx=\"6\" fill=\"var(--paper)\"/>"
    );
    for row in 0..area.height {
        let cells: Vec<&Cell> =
            (0..area.width).filter_map(|x| buffer.cell((area.x + x, area.y + row))).collect();
        let mut begin = 0;
        while begin < cells.len() {
            let look = Look::of(cells[begin]);
            let is_dots = |cell: &Cell| dots(cell).is_some();
            let same =
                |cell: &&&Cell| Look::of(cell) == look && is_dots(cell) == is_dots(cells[begin]);
            let length = cells[begin..].iter().take_while(same).count().max(1);
            run(&mut out, &cells[begin..begin + length], begin as u16, row, look);
            begin += length;
        }
    }
    out.push_str("</svg>\n");
    out
}

/// Cells of one look, beside each other.
fn run(out: &mut String, cells: &[&Cell], column: u16, row: u16, look: Look) {
    let (x, y) = (EDGE + column * CELL.0, EDGE + row * CELL.1);
    let width = cells.len() as u16 * CELL.0;
    let opacity = if look.is_faint { " opacity=\".55\"" } else { "" };
    if look.is_reversed {
        let _ = writeln!(
            out,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{}\" fill=\"{}\"/>",
            CELL.1, look.ink
        );
    }
    let ink = if look.is_reversed { "var(--paper)" } else { look.ink };
    if cells.iter().any(|cell| dots(cell).is_some()) {
        let mut path = String::new();
        for (place, cell) in (0..).zip(cells) {
            for (dx, dy) in dots(cell).into_iter().flatten() {
                let left = x + place * CELL.0 + 1 + u16::from(dx) * 4;
                let top = y + 1 + u16::from(dy) * 4;
                let _ = write!(path, "M{left} {top}h2v2h-2z");
            }
        }
        let _ = writeln!(out, "<path d=\"{path}\" fill=\"{ink}\"{opacity}/>");
        return;
    }
    let text: String = cells.iter().map(|cell| cell.symbol()).collect();
    if text.trim().is_empty() {
        return;
    }
    let bold = if look.is_bold { " font-weight=\"bold\"" } else { "" };
    let underline = if look.is_underlined { " text-decoration=\"underline\"" } else { "" };
    let _ = writeln!(
        out,
        "<text x=\"{x}\" y=\"{}\" textLength=\"{width}\" lengthAdjust=\"spacingAndGlyphs\" \
         xml:space=\"preserve\" fill=\"{ink}\"{bold}{underline}{opacity}>{}</text>",
        y + BASE,
        escaped(&text)
    );
}

fn dots(cell: &Cell) -> Option<impl Iterator<Item = (u8, u8)>> {
    dots_of(cell.symbol().chars().next()?)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use ratatui_core::layout::Rect;
    use ratatui_core::style::Style;

    use super::*;

    #[test]
    fn letters_and_dots_stand_where_their_cells_are() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 6, 2));
        buffer.set_string(0, 0, "a<b", Style::new().add_modifier(Modifier::REVERSED));
        buffer.set_string(4, 1, "⡀", Style::new().fg(Color::Red));
        let svg = svg(&buffer, "x & y");
        assert!(svg.contains("<title>x &amp; y</title>"), "{svg}");
        assert!(
            svg.contains("<rect x=\"8\" y=\"8\" width=\"24\" height=\"17\" fill=\"var(--ink)\"/>")
        );
        assert!(svg.contains(">a&lt;b</text>"), "{svg}");
        // The lower left dot of the fifth cell of the second row.
        assert!(svg.contains("<path d=\"M41 38h2v2h-2z\" fill=\"var(--red)\"/>"), "{svg}");
    }
}
