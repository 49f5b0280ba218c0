//! What is drawn, before it is known into what: lines, areas and texts in pixels, y downwards.

/// A colour: red, green, blue.
pub(crate) type Colour = [u8; 3];

/// A place in a picture, pixels from its upper left corner.
pub(crate) type Spot = (f64, f64);

/// How a line looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pen {
    pub(crate) colour: Colour,
    pub(crate) width: f64,
    /// How long it draws and does not, by turns, in pixels; empty for a whole line.
    pub(crate) dashes: &'static [f64],
}

/// Lines that are told apart without their colours, too.
pub(crate) const DASHED: &[f64] = &[6.0, 4.0];
pub(crate) const DOTTED: &[f64] = &[1.5, 2.5];
pub(crate) const CHAIN: &[f64] = &[14.0, 3.0, 2.0, 3.0];

/// A pen that draws a whole line.
pub(crate) const fn pen(colour: Colour, width: f64) -> Pen {
    Pen { colour, width, dashes: &[] }
}

/// Which end of a text is at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// A line of text. Its place is on the base line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Label {
    pub(crate) at: Spot,
    pub(crate) text: String,
    pub(crate) size: f64,
    pub(crate) colour: Colour,
    pub(crate) anchor: Anchor,
}

/// Something that is drawn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Item {
    /// Lines with one pen.
    Lines { class: &'static str, pen: Pen, lines: Vec<Vec<Spot>> },
    /// A sign with an outline, and what it says when it is asked.
    Sign { class: &'static str, at: Spot, outline: Vec<Spot>, colour: Colour, title: String },
    /// A text.
    Text(Label),
}

/// A picture, from back to front.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Scene {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) title: String,
    pub(crate) items: Vec<Item>,
}

impl Scene {
    pub(crate) fn line(&mut self, class: &'static str, pen: Pen, points: impl Into<Vec<Spot>>) {
        self.items.push(Item::Lines { class, pen, lines: vec![points.into()] });
    }

    pub(crate) fn text(
        &mut self,
        at: Spot,
        text: impl Into<String>,
        size: f64,
        colour: Colour,
        anchor: Anchor,
    ) {
        self.items.push(Item::Text(Label { at, text: text.into(), size, colour, anchor }));
    }
}

/// A rectangle in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Area {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Area {
    pub(crate) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(crate) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    pub(crate) fn outline(&self) -> Vec<Spot> {
        let (left, top, right, bottom) = (self.left, self.top, self.right(), self.bottom());
        vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]
    }

    /// The part of a straight line that is inside.
    pub(crate) fn clip(&self, from: Spot, to: Spot) -> Option<(Spot, Spot)> {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        let sides = [
            (-dx, from.0 - self.left),
            (dx, self.right() - from.0),
            (-dy, from.1 - self.top),
            (dy, self.bottom() - from.1),
        ];
        for (towards, room) in sides {
            if towards == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if towards < 0.0 {
                first = first.max(room / towards);
            } else {
                last = last.min(room / towards);
            }
        }
        let at = |share: f64| (from.0 + share * dx, from.1 + share * dy);
        (first <= last).then(|| (at(first), at(last)))
    }
}

/// Adds points to lines, but none that would not be seen.
#[derive(Debug, Default)]
pub(crate) struct Thinned {
    pub(crate) lines: Vec<Vec<Spot>>,
    /// The last point, if it was not far enough from the one before to be added yet.
    late: Option<Spot>,
}

/// Points that are nearer than this to the one before are not seen, in pixels.
const UNSEEN: f64 = 0.3;

impl Thinned {
    /// Begins a line, unless the last one is there already.
    pub(crate) fn begin(&mut self, at: Spot) {
        let goes_on = |line: &Vec<Spot>| self.late.or(line.last().copied()) == Some(at);
        if !self.lines.last().is_some_and(goes_on) {
            self.flush();
            self.lines.push(vec![at]);
        }
    }

    /// The line goes on to a point.
    pub(crate) fn go(&mut self, to: Spot) {
        let Some(line) = self.lines.last_mut() else { return self.lines.push(vec![to]) };
        let near = |last: &Spot| (last.0 - to.0).abs() < UNSEEN && (last.1 - to.1).abs() < UNSEEN;
        if line.last().is_some_and(near) {
            self.late = Some(to);
            return;
        }
        // Where it was last is its beginning, if it has been going round in one place until now.
        if let Some(late) = self.late.take().filter(|late| !near(late)) {
            line.push(late);
        }
        line.push(to);
    }

    fn flush(&mut self) {
        if let (Some(late), Some(line)) = (self.late.take(), self.lines.last_mut()) {
            line.push(late);
        }
    }

    pub(crate) fn finish(mut self) -> Vec<Vec<Spot>> {
        self.flush();
        self.lines.retain(|line| line.len() > 1);
        self.lines
    }
}
