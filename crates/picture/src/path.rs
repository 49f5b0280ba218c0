//! The path in space: projected, with scales, marks, the machine's envelope and a legend.

use vimc4_motion::{AXES, Point};

use crate::frame::{Frame, added, distance, scaled};
use crate::leg::{Leg, Purpose, Way};
use crate::plot::{Mark, MarkKind, Plot};
use crate::scene::{
    Anchor, Area, CHAIN, Colour, DASHED, DOTTED, Item, Pen, Scene, Spot, Thinned, pen,
};
use crate::ticks::{round_step, ticks};
use crate::view::{Colouring, View};

pub(crate) const INK: Colour = [34, 34, 34];
pub(crate) const GREY: Colour = [120, 120, 120];
pub(crate) const FAINT: Colour = [228, 228, 228];

/// The width of all pictures.
pub(crate) const WIDTH: f64 = 960.0;

/// Room for the numbers at the sides.
const MARGIN: f64 = 54.0;

/// Room above a view for its name and the steps.
const ABOVE: f64 = 44.0;

/// Room below a view for its numbers.
const BELOW: f64 = 40.0;

/// The room of one that stands alone, and its height at the least and the most.
const LOWEST: f64 = 160.0;
const HIGHEST: f64 = 620.0;

/// How far the drawn path may be beside the real one, in pixels.
const TOLERANCE: f64 = 0.25;

/// The groups of lines of a path that are drawn alike, from back to front.
const KINDS: [(&str, Pen); 4] = [
    ("reference", Pen { colour: [107, 114, 128], width: 1.4, dashes: DOTTED }),
    ("rapid", Pen { colour: [217, 119, 6], width: 1.0, dashes: DASHED }),
    ("feed", pen([29, 78, 216], 1.6)),
    ("arc", pen([4, 120, 87], 1.6)),
];

/// The ends of the machine, as drawings have the limits of what moves.
const ENVELOPE: Pen = Pen { colour: [150, 150, 150], width: 1.0, dashes: CHAIN };

/// Slow to fast: dark to bright, and different for people who tell no red from green.
const SPEEDS: [Colour; 10] = [
    [68, 1, 84],
    [72, 40, 120],
    [62, 74, 137],
    [49, 104, 142],
    [38, 130, 142],
    [31, 158, 137],
    [53, 183, 121],
    [110, 206, 88],
    [181, 222, 43],
    [240, 200, 30],
];

/// How a mark looks: its class and name, its colour and its outline.
pub(crate) fn sign(kind: MarkKind) -> (&'static str, &'static str, Colour, &'static [Spot]) {
    match kind {
        MarkKind::Start => (
            "mark start",
            "start",
            [22, 163, 74],
            &[
                (-3.0, -7.0),
                (3.0, -7.0),
                (7.0, -3.0),
                (7.0, 3.0),
                (3.0, 7.0),
                (-3.0, 7.0),
                (-7.0, 3.0),
                (-7.0, -3.0),
            ],
        ),
        MarkKind::End => {
            ("mark end", "end", INK, &[(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)])
        }
        MarkKind::Stop => (
            "mark stop",
            "stopped",
            [220, 38, 38],
            &[(0.0, -8.0), (8.0, 0.0), (0.0, 8.0), (-8.0, 0.0)],
        ),
        MarkKind::Error => (
            "mark error",
            "error",
            [220, 38, 38],
            &[
                (-7.0, -5.0),
                (-5.0, -7.0),
                (0.0, -2.0),
                (5.0, -7.0),
                (7.0, -5.0),
                (2.0, 0.0),
                (7.0, 5.0),
                (5.0, 7.0),
                (0.0, 2.0),
                (-5.0, 7.0),
                (-7.0, 5.0),
                (-2.0, 0.0),
            ],
        ),
        MarkKind::Warning => {
            ("mark warning", "warning", [217, 119, 6], &[(0.0, 8.0), (8.0, -6.0), (-8.0, -6.0)])
        }
        MarkKind::Limit => {
            ("mark limit", "limit switch", [147, 51, 234], &[(0.0, -8.0), (8.0, 6.0), (-8.0, 6.0)])
        }
        MarkKind::Tool => (
            "mark tool",
            "tool change",
            [8, 145, 178],
            &[
                (-7.0, -7.0),
                (7.0, -7.0),
                (7.0, -2.0),
                (2.5, -2.0),
                (2.5, 8.0),
                (-2.5, 8.0),
                (-2.5, -2.0),
                (-7.0, -2.0),
            ],
        ),
        MarkKind::Back => (
            "mark back",
            "put back",
            [217, 119, 6],
            &[
                (-8.0, 0.0),
                (0.0, -7.0),
                (0.0, -3.0),
                (8.0, -3.0),
                (8.0, 3.0),
                (0.0, 3.0),
                (0.0, 7.0),
            ],
        ),
    }
}

/// Where a place is seen: to the right and up, in the unit of the axes.
fn projected(view: View, [x, y, z]: [f64; 3]) -> Spot {
    /// The cosine of 30°.
    const COSINE: f64 = 0.866_025_403_784_438_6;
    match view {
        View::Top | View::Time => (x, y),
        View::Front => (x, z),
        View::Side => (y, z),
        View::Isometric => ((x + y) * COSINE, (y - x) / 2.0 + z),
    }
}

/// The axes to the right and up; nothing where they run across.
fn sides(view: View) -> Option<(usize, usize)> {
    match view {
        View::Top | View::Time => Some((0, 1)),
        View::Front => Some((0, 2)),
        View::Side => Some((1, 2)),
        View::Isometric => None,
    }
}

fn name(view: View) -> &'static str {
    match view {
        View::Top | View::Time => "from above",
        View::Front => "from the front",
        View::Side => "from the right",
        View::Isometric => "isometric",
    }
}

/// The smallest rectangle around everything that is shown: left, bottom, right, top.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Spot,
    high: Spot,
}

impl Bounds {
    const NONE: Bounds = Bounds { low: (f64::MAX, f64::MAX), high: (f64::MIN, f64::MIN) };

    fn include(&mut self, at: Spot) {
        self.low = (self.low.0.min(at.0), self.low.1.min(at.1));
        self.high = (self.high.0.max(at.0), self.high.1.max(at.1));
    }

    fn size(&self) -> Spot {
        (self.high.0 - self.low.0, self.high.1 - self.low.1)
    }

    /// With air around, and never without an extent.
    fn padded(mut self) -> Bounds {
        if self.low.0 > self.high.0 {
            self = Bounds { low: (0.0, 0.0), high: (1.0, 1.0) };
        }
        let (width, height) = self.size();
        let most = if width.max(height) > 0.0 { width.max(height) } else { 1.0 };
        let pad = |size: f64| (size * 0.06).max(most * 0.04);
        let (x, y) = (pad(width), pad(height));
        Bounds { low: (self.low.0 - x, self.low.1 - y), high: (self.high.0 + x, self.high.1 + y) }
    }
}

/// One view on its place in the picture.
struct Panel<'p> {
    view: View,
    area: Area,
    bounds: Bounds,
    /// Pixels a unit.
    scale: f64,
    frame: &'p Frame,
    origin: Point,
}

impl Panel<'_> {
    fn spot(&self, at: Spot) -> Spot {
        let x = self.area.left + (at.0 - self.bounds.low.0) * self.scale;
        (x, self.area.bottom() - (at.1 - self.bounds.low.1) * self.scale)
    }

    fn place(&self, place: &Point) -> Spot {
        self.spot(projected(self.view, spatial(place, &self.origin, &self.frame.lengths())))
    }
}

/// Where a place is in space, from the origin.
fn spatial(place: &Point, origin: &Point, lengths: &[f64; AXES]) -> [f64; 3] {
    std::array::from_fn(|axis| (place[axis] - origin[axis]) as f64 * lengths[axis])
}

/// Draws views, two side by side.
pub(crate) fn views(
    scene: &mut Scene,
    plot: &Plot,
    frame: &Frame,
    wanted: &[View],
    colouring: Colouring,
) {
    let wanted = if wanted.is_empty() { &[View::Top] } else { wanted };
    let origin = plot.origin();
    scene.width = WIDTH;
    let mut top = scene.height;
    header(scene, plot, frame, &mut top);
    let fastest = match colouring {
        Colouring::Speed => fastest(plot, frame),
        Colouring::Kind => 0.0,
    };
    let bounds: Vec<Bounds> = wanted.iter().map(|view| bounds(plot, frame, *view)).collect();
    for (row, bounds) in wanted.chunks(2).zip(bounds.chunks(2)) {
        let width = WIDTH / row.len() as f64 - 2.0 * MARGIN;
        let aspect = bounds.iter().map(|bounds| bounds.size().1 / bounds.size().0);
        let tallest = aspect.fold(0.0_f64, f64::max) * width;
        let height = tallest.clamp(LOWEST, HIGHEST);
        for ((view, bounds), column) in row.iter().zip(bounds).zip(0..) {
            let (wide, high) = bounds.size();
            let scale = (width / wide).min(height / high);
            let left = f64::from(column) * WIDTH / row.len() as f64 + MARGIN;
            let area = Area {
                left: left + (width - wide * scale) / 2.0,
                top: top + ABOVE + (height - high * scale) / 2.0,
                width: wide * scale,
                height: high * scale,
            };
            let panel = Panel { view: *view, area, bounds: *bounds, scale, frame, origin };
            draw(scene, plot, &panel, fastest, colouring);
        }
        top += ABOVE + height + BELOW;
    }
    scene.height = top;
    legend(scene, plot, frame, fastest, colouring);
}

/// What it is, how far and how long.
fn header(scene: &mut Scene, plot: &Plot, frame: &Frame, top: &mut f64) {
    scene.text((MARGIN, *top + 26.0), frame.title.clone(), 15.0, INK, Anchor::Start);
    let ends = plot.legs().first().zip(plot.legs().last());
    let took = ends.map_or(0, |(first, last)| last.ends.nanos_since(first.began));
    let motions = plot.motions();
    let s = if motions == 1 { "" } else { "s" };
    let mut said = format!("{motions} motion{s}, {:.3} s", took as f64 / 1e9);
    let references = plot.legs().iter().filter(|leg| leg.purpose == Purpose::Reference);
    let referenced: u64 = references.map(|leg| leg.ends.nanos_since(leg.began)).sum();
    if referenced > 0 {
        said += &format!(", of which {:.3} s in reference runs", referenced as f64 / 1e9);
    }
    if plot.astray() > 0 {
        said += &format!(", short ones taken together within {} steps", plot.astray());
    }
    scene.text((WIDTH - MARGIN, *top + 26.0), said, 12.0, GREY, Anchor::End);
    *top += 34.0;
}

/// Everything that is to be seen: the path, and the envelope unless the path would be lost in it.
fn bounds(plot: &Plot, frame: &Frame, view: View) -> Bounds {
    let (lengths, origin) = (frame.lengths(), plot.origin());
    let mut path = Bounds::NONE;
    for leg in plot.legs() {
        let (low, high) = leg.extent();
        for corner in 0..8 {
            let corner: [f64; 3] = std::array::from_fn(|axis| {
                let place = if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                (place - origin[axis]) as f64 * lengths[axis]
            });
            path.include(projected(view, corner));
        }
    }
    let mut whole = path;
    for edge in edges(frame) {
        edge.into_iter().for_each(|end| whole.include(projected(view, end)));
    }
    let (path_size, size) = (path.size(), whole.size());
    let is_lost = path_size.0.max(path_size.1) * 2.0 < size.0.max(size.1);
    let fits = path.low.0 > path.high.0 || !is_lost;
    if fits { whole.padded() } else { path.padded() }
}

/// The edges of the envelope as far as the machine has ends.
fn edges(frame: &Frame) -> Vec<[[f64; 3]; 2]> {
    let envelope = frame.envelope();
    let ends = envelope.map(|(low, high)| low.zip(high));
    let corners = |axis: usize| match ends[axis] {
        Some((low, high)) => vec![low, high],
        None => vec![0.0],
    };
    let mut edges = Vec::new();
    for axis in 0..3 {
        let Some((low, high)) = ends[axis] else { continue };
        let (one, other) = ((axis + 1) % 3, (axis + 2) % 3);
        for first in corners(one) {
            for second in corners(other) {
                let end = |value: f64| {
                    let mut end = [0.0; 3];
                    (end[axis], end[one], end[other]) = (value, first, second);
                    end
                };
                edges.push([end(low), end(high)]);
            }
        }
    }
    edges
}

fn draw(scene: &mut Scene, plot: &Plot, panel: &Panel<'_>, fastest: f64, colouring: Colouring) {
    let Panel { area, view, frame, .. } = panel;
    scales(scene, panel);
    let edges = edges(frame).into_iter().filter_map(|edge| {
        let [from, to] = edge.map(|end| panel.spot(projected(*view, end)));
        area.clip(from, to).filter(|(from, to)| from != to).map(|(from, to)| vec![from, to])
    });
    let lines: Vec<Vec<Spot>> = edges.collect();
    if !lines.is_empty() {
        scene.items.push(Item::Lines { class: "envelope", pen: ENVELOPE, lines });
    }
    match colouring {
        Colouring::Kind => by_kind(scene, plot, panel),
        Colouring::Speed => by_speed(scene, plot, panel, fastest),
    }
    // What is more telling is further in front.
    let mut marks = plot.marks();
    marks.sort_by_key(|mark| mark.kind);
    for mark in marks {
        let (class, name, colour, outline) = sign(mark.kind);
        let at = panel.place(&mark.place);
        let title = said(&mark, name, frame, &panel.origin);
        let outline = outline.to_vec();
        scene.items.push(Item::Sign { class, at, outline, colour, title });
    }
}

/// What a mark says: what, when, where and why.
fn said(mark: &Mark, name: &str, frame: &Frame, origin: &Point) -> String {
    let mut said = format!("{name} at {:.3} s", mark.at.as_secs_f64());
    for (axis, scale) in frame.scales().iter().enumerate().take(frame.axes.len()) {
        let place = (mark.place[axis] - origin[axis]) as f64 * scale;
        said += &format!(", {} {:.3} {}", frame.name(axis), place + 0.0, frame.unit(axis));
    }
    if !mark.text.is_empty() {
        said += &format!(": {}", mark.text);
    }
    said
}

/// The frame of a view with what its axes measure: the unit at the bottom and the left, steps at the top
/// and the right.
fn scales(scene: &mut Scene, panel: &Panel<'_>) {
    let Panel { area, view, frame, bounds, .. } = *panel;
    let middle = area.left + area.width / 2.0;
    let Some((right, up)) = sides(view) else {
        scene.line("frame", pen(FAINT, 1.0), area.outline());
        scene.text((middle, area.top - 22.0), name(view), 12.0, GREY, Anchor::Middle);
        return compass(scene, panel);
    };
    for (axis, is_across) in [(right, true), (up, false)] {
        let (unit, per_step) = (frame.unit(axis), frame.scales()[axis]);
        let (low, high) = match is_across {
            true => (bounds.low.0, bounds.high.0),
            false => (bounds.low.1, bounds.high.1),
        };
        let length = if is_across { area.width } else { area.height };
        let about = (length / if is_across { 80.0 } else { 50.0 }) as usize;
        for (value, text) in ticks(low, high, about) {
            let (x, y) = panel.spot((value, value));
            let (line, at, anchor) = match is_across {
                true => {
                    ([(x, area.top), (x, area.bottom())], (x, area.bottom() + 15.0), Anchor::Middle)
                }
                false => {
                    ([(area.left, y), (area.right(), y)], (area.left - 5.0, y + 4.0), Anchor::End)
                }
            };
            scene.line("grid", pen(FAINT, 1.0), line);
            scene.text(at, text, 11.0, INK, anchor);
        }
        let title = format!("{} {unit}", frame.name(axis));
        match is_across {
            true => scene.text((middle, area.bottom() + 31.0), title, 12.0, INK, Anchor::Middle),
            false => scene.text((area.left - 5.0, area.top - 6.0), title, 12.0, INK, Anchor::End),
        }
        if unit == "steps" || per_step <= 0.0 {
            continue;
        }
        for (steps, text) in ticks(low / per_step, high / per_step, about.min(6)) {
            let (x, y) = panel.spot((steps * per_step, steps * per_step));
            let (line, at, anchor) = match is_across {
                true => ([(x, area.top), (x, area.top + 5.0)], (x, area.top - 5.0), Anchor::Middle),
                false => {
                    let right = area.right();
                    ([(right, y), (right - 5.0, y)], (right + 5.0, y + 4.0), Anchor::Start)
                }
            };
            scene.line("steps", pen(GREY, 1.0), line);
            scene.text(at, text, 10.0, GREY, anchor);
        }
    }
    scene.line("frame", pen(GREY, 1.0), area.outline());
    let steps = if frame.unit(right) == "steps" { "" } else { ", steps at the top and the right" };
    let title = format!("{}{steps}", name(view));
    scene.text((middle, area.top - 22.0), title, 12.0, GREY, Anchor::Middle);
}

/// The directions of the axes and a bar of a round length, where the sides are no scales.
fn compass(scene: &mut Scene, panel: &Panel<'_>) {
    let Panel { area, view, frame, scale, .. } = *panel;
    let (length, decimals) = round_step(area.width / 8.0 / scale);
    let foot = (area.left + 10.0, area.bottom() + 12.0);
    let end = (foot.0 + length * scale, foot.1);
    scene.line("scale", pen(INK, 2.0), [foot, end]);
    let text = format!("{length:.decimals$} {}", frame.unit(0));
    scene.text((end.0 + 6.0, end.1 + 4.0), text, 11.0, INK, Anchor::Start);
    let centre = (area.right() - 34.0, area.bottom() + 26.0);
    for axis in 0..3.min(frame.axes.len()) {
        let mut along = [0.0; 3];
        along[axis] = 1.0;
        let (right, up) = projected(view, along);
        let at = |far: f64| (centre.0 + right * far, centre.1 - up * far);
        scene.line("compass", pen(GREY, 1.0), [centre, at(15.0)]);
        let (x, y) = at(23.0);
        scene.text((x, y + 4.0), frame.name(axis), 11.0, GREY, Anchor::Middle);
    }
}

/// Which of the [`KINDS`] it is.
fn kind(purpose: Purpose, way: Way) -> usize {
    match (purpose, way) {
        (Purpose::Reference, _) => 0,
        (Purpose::Rapid, _) => 1,
        (Purpose::Work, Way::Straight) => 2,
        (Purpose::Work, Way::Round | Way::Again) => 3,
    }
}

fn by_kind(scene: &mut Scene, plot: &Plot, panel: &Panel<'_>) {
    let mut groups: [Thinned; 4] = std::array::from_fn(|_| Thinned::default());
    let lengths = panel.frame.lengths();
    for leg in plot.legs() {
        let mut from = panel.place(&leg.from);
        for vertex in leg.vertices(&lengths, TOLERANCE / panel.scale) {
            let to = panel.place(&added(&leg.from, &vertex.offset));
            if vertex.way != Way::Again {
                let group = &mut groups[kind(leg.purpose, vertex.way)];
                group.begin(from);
                group.go(to);
            }
            from = to;
        }
    }
    for (group, (class, pen)) in groups.into_iter().zip(KINDS) {
        let lines = group.finish();
        if !lines.is_empty() {
            scene.items.push(Item::Lines { class, pen, lines });
        }
    }
}

/// The pieces of a motion with the speed of each: from, to, and units per second.
fn paces(leg: &Leg, frame: &Frame, tolerance: f64, mut put: impl FnMut(&Point, &Point, f64, Way)) {
    /// How many pieces a straight line has at the most.
    const PIECES: u64 = 24;
    let lengths = frame.lengths();
    let (mut step, mut from) = (0, leg.from);
    let span = |from: &Point, to: &Point| distance(&scaled(from, &lengths), &scaled(to, &lengths));
    for vertex in leg.vertices(&lengths, tolerance) {
        let steps = vertex.step - step;
        let whole = span(&from, &added(&leg.from, &vertex.offset));
        // Ramps are seen where a line is long enough.
        let pieces = match vertex.way {
            Way::Straight => ((whole / tolerance / 16.0) as u64).clamp(1, PIECES).min(steps.max(1)),
            Way::Round | Way::Again => 1,
        };
        for piece in 1..=pieces {
            let last = vertex.step - steps + steps * piece / pieces;
            let to = match piece == pieces {
                true => added(&leg.from, &vertex.offset),
                false => added(&leg.from, &leg.offset(last)),
            };
            // What takes no time has no speed that would be known.
            let pace = match leg.time_of(last).nanos_since(leg.time_of(step)) {
                0 => 0.0,
                nanos => span(&from, &to) * 1e9 / nanos as f64,
            };
            put(&from, &to, pace, vertex.way);
            (step, from) = (last, to);
        }
    }
}

/// The highest speed of a path.
fn fastest(plot: &Plot, frame: &Frame) -> f64 {
    let mut fastest = 0.0_f64;
    for leg in plot.legs() {
        // Single steps say nothing about a speed.
        let is_long = leg.made > 8;
        paces(leg, frame, f64::MAX, |_, _, pace, way| {
            if way != Way::Again && is_long {
                fastest = fastest.max(pace);
            }
        });
        fastest = fastest.max(leg.pace(&frame.lengths()));
    }
    fastest
}

fn by_speed(scene: &mut Scene, plot: &Plot, panel: &Panel<'_>, fastest: f64) {
    let mut groups: [Thinned; SPEEDS.len()] = std::array::from_fn(|_| Thinned::default());
    for leg in plot.legs() {
        paces(leg, panel.frame, TOLERANCE / panel.scale, |from, to, pace, way| {
            let shade = pace / fastest.max(f64::MIN_POSITIVE) * SPEEDS.len() as f64;
            let shade = (shade as usize).min(SPEEDS.len() - 1);
            if way != Way::Again {
                groups[shade].begin(panel.place(from));
                groups[shade].go(panel.place(to));
            }
        });
    }
    for (group, colour) in groups.into_iter().zip(SPEEDS) {
        let lines = group.finish();
        if !lines.is_empty() {
            scene.items.push(Item::Lines { class: "speed", pen: pen(colour, 1.8), lines });
        }
    }
}

/// What the colours and signs mean that are in the picture.
fn legend(scene: &mut Scene, plot: &Plot, frame: &Frame, fastest: f64, colouring: Colouring) {
    let y = scene.height + 8.0;
    let mut x = MARGIN;
    match colouring {
        Colouring::Kind => {
            for (class, pen) in KINDS {
                let is_there =
                    |item: &Item| matches!(item, Item::Lines { class: is, .. } if *is == class);
                if scene.items.iter().any(is_there) {
                    scene.line("legend", pen, [(x, y - 4.0), (x + 24.0, y - 4.0)]);
                    scene.text((x + 30.0, y), class, 12.0, INK, Anchor::Start);
                    x += 48.0 + class.len() as f64 * 7.2;
                }
            }
        }
        Colouring::Speed => {
            scene.text((x, y), "0", 12.0, INK, Anchor::Start);
            x += 14.0;
            for colour in SPEEDS {
                scene.line("legend", pen(colour, 8.0), [(x, y - 4.0), (x + 14.0, y - 4.0)]);
                x += 14.0;
            }
            let text = format!("{fastest:.1} {}/s", frame.unit(0));
            scene.text((x + 10.0, y), text.clone(), 12.0, INK, Anchor::Start);
            x += 34.0 + text.len() as f64 * 7.2;
        }
    }
    let marks = plot.marks();
    let kinds = [
        MarkKind::Start,
        MarkKind::End,
        MarkKind::Stop,
        MarkKind::Warning,
        MarkKind::Error,
        MarkKind::Limit,
        MarkKind::Tool,
        MarkKind::Back,
    ];
    for kind in kinds {
        let count = marks.iter().filter(|mark| mark.kind == kind).count();
        if count == 0 {
            continue;
        }
        let (_, name, colour, outline) = sign(kind);
        let text = if count == 1 { name.to_owned() } else { format!("{name} ×{count}") };
        let (class, outline, title) = ("legend", outline.to_vec(), String::new());
        scene.items.push(Item::Sign { class, at: (x + 6.0, y - 4.0), outline, colour, title });
        scene.text((x + 18.0, y), text.clone(), 12.0, INK, Anchor::Start);
        x += 36.0 + text.chars().count() as f64 * 7.2;
    }
    if plot.marks_left_out() > 0 {
        let text = format!("{} marks more", plot.marks_left_out());
        scene.text((x, y), text.clone(), 12.0, INK, Anchor::Start);
        x += 20.0 + text.len() as f64 * 7.2;
    }
    if !edges(frame).is_empty() {
        scene.line("legend", ENVELOPE, [(x, y - 4.0), (x + 24.0, y - 4.0)]);
        scene.text((x + 30.0, y), "ends of the machine", 12.0, INK, Anchor::Start);
    }
    scene.height = y + 18.0;
}
