//! The path from above and from the side, in true proportions.

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;
use vimc4_catalogue::Machine;
use vimc4_device::{AXES, Point, Time};

use super::brush::Brush;
use super::dots::Dots;
use super::ink::{Ink, Inks};

/// One motion of the history.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stroke {
    /// Where the carriages are, and when, from its beginning to its end.
    pub(crate) points: Vec<(Time, Point)>,
}

/// What of the path is shown, in the units of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gaze {
    /// How many times larger than what fits.
    zoom: f64,
    /// How far the middle is moved, in parts of the width that is seen.
    moved: (f64, f64),
}

impl Default for Gaze {
    fn default() -> Gaze {
        Gaze { zoom: 1.0, moved: (0.0, 0.0) }
    }
}

impl Gaze {
    /// The magnifications that there are.
    const ZOOMS: (f64, f64) = (1.0, 65_536.0);

    pub(crate) fn nearer(&mut self) {
        self.zoom = (self.zoom * 2.0).min(Gaze::ZOOMS.1);
        self.moved = (self.moved.0 * 2.0, self.moved.1 * 2.0);
    }

    pub(crate) fn farther(&mut self) {
        let before = self.zoom;
        self.zoom = (self.zoom / 2.0).max(Gaze::ZOOMS.0);
        let part = self.zoom / before;
        self.moved = (self.moved.0 * part, self.moved.1 * part);
    }

    /// Moves what is seen by a quarter of it.
    pub(crate) fn move_by(&mut self, right: i8, up: i8) {
        self.moved.0 += f64::from(right) / 4.0;
        self.moved.1 += f64::from(up) / 4.0;
    }
}

/// From where to where, in the units of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    low: f64,
    high: f64,
}

impl Range {
    fn length(self) -> f64 {
        (self.high - self.low).max(f64::MIN_POSITIVE)
    }

    fn middle(self) -> f64 {
        f64::midpoint(self.low, self.high)
    }

    fn with(self, place: f64) -> Range {
        Range { low: self.low.min(place), high: self.high.max(place) }
    }
}

/// What the pane is drawn from.
pub(super) struct Path<'p> {
    pub(super) machine: &'p Machine,
    pub(super) strokes: &'p [Stroke],
    pub(super) now: Time,
    /// The carriages now.
    pub(super) here: Point,
    pub(super) gaze: Gaze,
}

/// A rectangle of the screen and what it shows: a plane of two axes.
struct View {
    area: Rect,
    axes: (usize, usize),
    /// The place that is in the middle of it.
    middle: (f64, f64),
}

impl Path<'_> {
    pub(super) fn draw(&self, buffer: &mut Buffer, area: Rect, inks: Inks) {
        let area = area.intersection(buffer.area);
        let ranges = self.ranges();
        let (inner, side) = parts(area, &ranges);
        let scale = self.scale(inner, side, &ranges);
        let note = format!("{} per dot", length(scale));
        Brush::titled(buffer, area, inks, "path X Y | Z Y", &note);
        let plane = |x: usize, y: usize, area: Rect| {
            let width = |area: Rect| f64::from(area.width) * 2.0 * scale;
            let height = |area: Rect| f64::from(area.height) * 4.0 * scale;
            let moved = (self.gaze.moved.0 * width(inner), self.gaze.moved.1 * height(inner));
            let right = if x == 0 { moved.0 } else { 0.0 };
            View {
                area,
                axes: (x, y),
                middle: (ranges[x].middle() + right, ranges[y].middle() + moved.1),
            }
        };
        self.draw_plane(buffer, &plane(0, 1, inner), scale, inks);
        if let Some(side) = side {
            for y in side.top()..side.bottom() {
                buffer.set_string(side.x - 1, y, "│", inks.style(Ink::Faint));
            }
            self.draw_plane(buffer, &plane(2, 1, side), scale, inks);
        }
    }

    fn draw_plane(&self, buffer: &mut Buffer, view: &View, scale: f64, inks: Inks) {
        let View { area, axes, middle } = view;
        if area.is_empty() {
            return;
        }
        let mut dots = Dots::new(*area);
        let (width, height) = (dots.width() as f64, dots.height() as f64);
        let measures = self.machine.measures();
        let place = |x: f64, y: f64| {
            ((x - middle.0) / scale + width / 2.0, (y - middle.1) / scale + height / 2.0)
        };
        let at = |point: &Point| {
            let [x, y] = [axes.0, axes.1].map(|axis| point[axis] as f64 * measures[axis].per_step);
            place(x, y)
        };
        // Where the switches are.
        let (x, y) = (self.travel(axes.0), self.travel(axes.1));
        let edge = inks.style(Ink::Faint);
        let far = 1e12;
        let (low_y, high_y) = (y.0.unwrap_or(-far), y.1.unwrap_or(far));
        let (low_x, high_x) = (x.0.unwrap_or(-far), x.1.unwrap_or(far));
        for x in [x.0, x.1].into_iter().flatten() {
            dots.line(place(x, low_y), place(x, high_y), 2, edge);
        }
        for y in [y.0, y.1].into_iter().flatten() {
            dots.line(place(low_x, y), place(high_x, y), 2, edge);
        }
        for stroke in self.strokes {
            for pair in stroke.points.windows(2) {
                let [(begun, from), (ended, to)] = pair else { continue };
                if *ended <= self.now {
                    dots.line(at(from), at(to), 1, inks.style(Ink::Plain));
                } else if *begun < self.now {
                    dots.line(at(from), at(&self.here), 1, inks.style(Ink::Plain));
                    dots.line(at(&self.here), at(to), 3, inks.style(Ink::Faint));
                } else {
                    dots.line(at(from), at(to), 3, inks.style(Ink::Faint));
                }
            }
        }
        dots.draw(buffer);
        let (x, y) = at(&self.here);
        let (column, row) = ((x / 2.0).floor(), ((height - 1.0 - y.round()) / 4.0).floor());
        let is_in = (0.0..f64::from(area.width)).contains(&column)
            && (0.0..f64::from(area.height)).contains(&row);
        if is_in {
            let (x, y) = (area.x + column as u16, area.y + row as u16);
            buffer.set_string(x, y, "◉", inks.style(Ink::Alarm));
        }
    }

    /// Between which places the carriage of an axis presses no switch, in units of the machine.
    fn travel(&self, axis: usize) -> (Option<f64>, Option<f64>) {
        let unit = self.machine.measures()[axis].per_step;
        let axis = self.machine.axis(axis);
        let in_units = |steps: i64| steps as f64 * unit;
        let low = axis.negative_switch.or(axis.lowest);
        let high = axis.positive_switch.or(axis.highest);
        (low.map(in_units), high.map(in_units))
    }

    /// What there is to see of each axis: where it can go, where it has been and where it will go.
    fn ranges(&self) -> [Range; AXES] {
        let measures = self.machine.measures();
        std::array::from_fn(|axis| {
            let unit = measures[axis].per_step;
            let here = self.here[axis] as f64 * unit;
            let mut range = Range { low: here, high: here };
            let points = self.strokes.iter().flat_map(|stroke| &stroke.points);
            for (_, point) in points {
                range = range.with(point[axis] as f64 * unit);
            }
            let (low, high) = self.travel(axis);
            for end in [low, high].into_iter().flatten() {
                range = range.with(end);
            }
            if range.high <= range.low {
                range = Range { low: range.low - unit, high: range.high + unit };
            }
            range
        })
    }

    /// So many units of the machine are a dot, in all directions.
    fn scale(&self, inner: Rect, side: Option<Rect>, ranges: &[Range; AXES]) -> f64 {
        // A dot at each edge for what lies on it.
        let dots = |cells: u16, each: f64| (f64::from(cells) * each - 2.0).max(1.0);
        let fits = (ranges[0].length() / dots(inner.width, 2.0))
            .max(ranges[1].length() / dots(inner.height, 4.0));
        let fits = side.map_or(fits, |side| fits.max(ranges[2].length() / dots(side.width, 2.0)));
        fits / self.gaze.zoom
    }
}

/// Where X and Y are seen, and where Z and Y, if that has room beside it.
fn parts(area: Rect, ranges: &[Range; AXES]) -> (Rect, Option<Rect>) {
    let inner = Rect { y: area.y + 1, height: area.height.saturating_sub(1), ..area };
    if inner.width < 16 || inner.height == 0 {
        return (inner, None);
    }
    let part = ranges[2].length() / (ranges[0].length() + ranges[2].length());
    let width = (f64::from(inner.width) * part) as u16;
    let width = width.clamp(5, inner.width / 3);
    let left = inner.width - width - 1;
    let side = Rect { x: inner.x + left + 1, width, ..inner };
    (Rect { width: left, ..inner }, Some(side))
}

/// A length in mm with as many digits as say something.
fn length(mm: f64) -> String {
    match mm {
        mm if mm >= 10.0 => format!("{mm:.0} mm"),
        mm if mm >= 0.1 => format!("{mm:.2} mm"),
        mm => format!("{:.1} µm", mm * 1_000.0),
    }
}

#[cfg(test)]
mod tests {
    use ratatui_core::style::Modifier;

    use super::super::dots::dots_of;
    use super::*;

    /// A pane in which a square of 75 mm was gone around, clear of all switches.
    fn drawn(width: u16, height: u16, gaze: Gaze) -> Buffer {
        let machine = Machine::builtin("mill").unwrap_or_else(|| unreachable!("it is built in"));
        let corners = [(9, 5), (15, 5), (15, 11), (9, 11), (9, 5)];
        let points = (0..).zip(corners);
        let points = points
            .map(|(at, (x, y))| (Time::from_millis(at), [x * 1_000, y * 1_000, -5_000, 0, 0, 0]));
        let strokes = [Stroke { points: points.collect() }];
        let area = Rect::new(0, 0, width, height);
        let mut buffer = Buffer::empty(area);
        let now = Time::from_millis(10);
        let here = [20_000, 14_000, -5_000, 0, 0, 0];
        let path = Path { machine: &machine, strokes: &strokes, now, here, gaze };
        path.draw(&mut buffer, area, Inks { colour: false });
        buffer
    }

    /// How wide and how high the square is in dots.
    fn extent(buffer: &Buffer) -> (usize, usize) {
        let mut dots = Vec::new();
        let side = (0..buffer.area.width).find(|x| buffer[(*x, 1)].symbol() == "│");
        for y in 1..buffer.area.height {
            for x in 0..side.unwrap_or(buffer.area.width) {
                let cell = &buffer[(x, y)];
                let character = cell.symbol().chars().next().unwrap_or(' ');
                // The switches are drawn faintly.
                if cell.modifier.contains(Modifier::DIM) {
                    continue;
                }
                for (dx, dy) in dots_of(character).into_iter().flatten() {
                    dots.push((
                        usize::from(2 * x) + usize::from(dx),
                        usize::from(4 * y) + usize::from(dy),
                    ));
                }
            }
        }
        let span = |of: fn(&(usize, usize)) -> usize| {
            let (least, most) = (dots.iter().map(of).min(), dots.iter().map(of).max());
            most.unwrap_or(0) - least.unwrap_or(0)
        };
        (span(|dot| dot.0), span(|dot| dot.1))
    }

    #[test]
    fn a_square_is_a_square_in_any_pane() {
        for (width, height) in [(38, 12), (120, 40), (60, 50), (100, 9)] {
            let (wide, high) = extent(&drawn(width, height, Gaze::default()));
            assert!(wide >= 6 && wide.abs_diff(high) <= 1, "{wide} x {high} in {width} x {height}");
        }
    }

    #[test]
    fn nearer_is_twice_as_large_and_back_again_the_same() {
        let mut gaze = Gaze::default();
        let before = drawn(60, 20, gaze);
        gaze.nearer();
        let nearer = drawn(60, 20, gaze);
        assert!(extent(&nearer).0.abs_diff(2 * extent(&before).0) <= 2);
        gaze.move_by(-1, 1);
        assert_ne!(drawn(60, 20, gaze), nearer);
        gaze.move_by(1, -1);
        gaze.farther();
        assert_eq!(drawn(60, 20, gaze), before);
    }
}
