//! Position, speed and acceleration of each axis over time.

use vimc4_motion::Time;

use crate::frame::Frame;
use crate::leg::Leg;
use crate::path::{FAINT, GREY, INK, WIDTH, sign};
use crate::plot::{MarkKind, Plot};
use crate::scene::{Anchor, Area, Colour, Item, Scene, Spot, pen};
use crate::ticks::ticks;

const MARGIN: f64 = 80.0;
const HEIGHT: f64 = 150.0;

/// X, Y and Z as drawing programs colour them, and the others.
const AXIS_COLOURS: [Colour; 6] =
    [[220, 38, 38], [4, 120, 87], [29, 78, 216], [147, 51, 234], [217, 119, 6], [8, 145, 178]];

/// What is drawn of an axis.
#[derive(Clone, Copy, PartialEq)]
enum Quantity {
    Position,
    Speed,
    Acceleration,
}

/// Draws the three graphs below what is there.
pub(crate) fn graphs(scene: &mut Scene, plot: &Plot, frame: &Frame) {
    scene.width = WIDTH;
    if scene.height == 0.0 {
        scene.text((MARGIN, 26.0), frame.title.clone(), 15.0, INK, Anchor::Start);
        scene.height = 34.0;
    }
    let moves = |axis: &usize| plot.legs().iter().any(|leg| leg.travels(*axis));
    let moving: Vec<usize> = (0..frame.axes.len()).filter(moves).collect();
    let ends = plot.legs().first().zip(plot.legs().last());
    let (began, ended) =
        ends.map_or((Time::ZERO, Time::from_secs(1)), |(first, last)| (first.began, last.ends));
    let mut y = scene.height + 14.0;
    let mut x = MARGIN;
    for axis in &moving {
        let (colour, name) = (AXIS_COLOURS[*axis % AXIS_COLOURS.len()], frame.name(*axis));
        scene.line("legend", pen(colour, 2.0), [(x, y - 4.0), (x + 20.0, y - 4.0)]);
        scene.text((x + 26.0, y), name, 12.0, INK, Anchor::Start);
        x += 56.0 + name.len() as f64 * 7.2;
    }
    y += 14.0;
    for quantity in [Quantity::Position, Quantity::Speed, Quantity::Acceleration] {
        let width = WIDTH - MARGIN - 30.0;
        let area = Area { left: MARGIN, top: y + 16.0, width, height: HEIGHT };
        graph(scene, plot, frame, &moving, (began, ended), quantity, &area);
        y += HEIGHT + 52.0;
    }
    scene.height = y;
}

fn graph(
    scene: &mut Scene,
    plot: &Plot,
    frame: &Frame,
    moving: &[usize],
    (began, ended): (Time, Time),
    quantity: Quantity,
    area: &Area,
) {
    let span = ended.nanos_since(began).max(1);
    let mut curves = Vec::new();
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    for axis in moving {
        let curve = sampled(plot, frame, *axis, (began, span), quantity, area.width as u64);
        for (_, value) in &curve {
            (low, high) = (low.min(*value), high.max(*value));
        }
        curves.push((*axis, curve));
    }
    if high - low <= 0.0 {
        high = low + 1.0;
    }
    let pad = (high - low) * 0.06;
    let (low, high) = (low - pad, high + pad);
    let seconds = span as f64 / 1e9;
    let start = began.as_secs_f64();
    let spot = |(at, value): (f64, f64)| -> Spot {
        let x = area.left + (at - start) / seconds * area.width;
        (x, area.bottom() - (value - low) / (high - low) * area.height)
    };
    for (value, text) in ticks(low, high, 5) {
        let (_, y) = spot((start, value));
        scene.line("grid", pen(FAINT, 1.0), [(area.left, y), (area.right(), y)]);
        scene.text((area.left - 5.0, y + 4.0), text, 11.0, INK, Anchor::End);
    }
    for (value, text) in ticks(start, start + seconds, 10) {
        let (x, _) = spot((value, low));
        scene.line("grid", pen(FAINT, 1.0), [(x, area.top), (x, area.bottom())]);
        scene.text((x, area.bottom() + 15.0), text, 11.0, INK, Anchor::Middle);
    }
    scene.text((area.right() + 12.0, area.bottom() + 15.0), "s", 11.0, INK, Anchor::Start);
    scene.line("frame", pen(GREY, 1.0), area.outline());
    let (name, per) = match quantity {
        Quantity::Position => ("position", ""),
        Quantity::Speed => ("speed", "/s"),
        Quantity::Acceleration => ("acceleration", "/s²"),
    };
    let mut title = vec![name.to_owned()];
    title.extend(moving.iter().map(|axis| format!("{}{per}", frame.unit(*axis))));
    title.dedup();
    let title = title.join(", ");
    scene.text((area.left, area.top - 6.0), title, 12.0, INK, Anchor::Start);
    for (axis, curve) in curves {
        let line: Vec<Spot> = curve.into_iter().map(spot).collect();
        let pen = pen(AXIS_COLOURS[axis % AXIS_COLOURS.len()], 1.3);
        if line.len() > 1 {
            scene.items.push(Item::Lines { class: "curve", pen, lines: vec![line] });
        }
    }
    if quantity == Quantity::Position {
        let marks = plot.marks().into_iter();
        for mark in marks.filter(|mark| !matches!(mark.kind, MarkKind::Start | MarkKind::End)) {
            let (class, name, colour, outline) = sign(mark.kind);
            let (x, _) = spot((mark.at.as_secs_f64(), low));
            let title = format!("{name} at {:.3} s: {}", mark.at.as_secs_f64(), mark.text);
            let (at, outline) = ((x, area.top), outline.to_vec());
            scene.items.push(Item::Sign { class, at, outline, colour, title });
        }
    }
}

/// A quantity of an axis over time: of every column of pixels the first value, the smallest, the largest
/// and the last, so that nothing is lost that could be seen.
fn sampled(
    plot: &Plot,
    frame: &Frame,
    axis: usize,
    (began, span): (Time, u64),
    quantity: Quantity,
    columns: u64,
) -> Vec<(f64, f64)> {
    let scale = frame.scales()[axis];
    let zero = plot.origin()[axis];
    let mut curve = Curve::new(began, span, columns.max(1));
    for leg in plot.legs() {
        // At rest nothing moves, wherever the carriage is.
        let place = |at: i64| (at - zero) as f64 * scale;
        if quantity == Quantity::Position {
            curve.put(leg.began, place(leg.from[axis]));
        } else {
            curve.put(leg.began, 0.0);
        }
        let mut from = leg.began;
        for knee in leg.knees() {
            let length = knee.nanos_since(from);
            // Two a column, but a ramp is looked at closely however short it is.
            let across = u128::from(length) * u128::from(columns) / u128::from(span);
            let pieces = (u64::try_from(across).unwrap_or(columns).min(columns) * 2).max(16);
            for piece in 0..=pieces {
                let nanos = (u128::from(length) * u128::from(piece) / u128::from(pieces)) as u64;
                let at = from.after_nanos(nanos);
                let value = match quantity {
                    Quantity::Position => {
                        place(leg.from[axis] + leg.offset(leg.steps_at(at))[axis])
                    }
                    Quantity::Speed => speed(leg, axis, at) * scale,
                    Quantity::Acceleration => acceleration(leg, axis, at) * scale,
                };
                curve.put(at, value);
            }
            from = knee;
        }
        if quantity == Quantity::Position {
            curve.put(leg.ends, place(leg.to()[axis]));
        } else {
            curve.put(leg.ends, 0.0);
        }
    }
    curve.finish()
}

/// Steps per second of an axis.
fn speed(leg: &Leg, axis: usize, at: Time) -> f64 {
    leg.frequency(at) * leg.shares(leg.steps_at(at))[axis]
}

/// Steps per second squared of an axis: what its speed changes by in a millisecond or two. On a circle it
/// changes with each step, so there some steps are taken together. A motor that starts without a ramp has
/// none that could be drawn, so it counts from the first step to the last.
fn acceleration(leg: &Leg, axis: usize, at: Time) -> f64 {
    let length = leg.ends.nanos_since(leg.began);
    let some = if leg.is_straight() { 0.0 } else { 8e9 / leg.frequency(at).max(1.0) };
    let half = (length / 200).min((some as u64).max(1_000_000)).max(1);
    // At its last step a motion is at rest already.
    let most = length.saturating_sub(2 * half).max(half);
    let nanos = at.nanos_since(leg.began).clamp(half, most);
    let (from, to) = (leg.began.after_nanos(nanos - half), leg.began.after_nanos(nanos + half));
    (speed(leg, axis, to) - speed(leg, axis, from)) * 1e9 / (2 * half) as f64
}

/// A curve with four values a column.
struct Curve {
    began: Time,
    span: u64,
    columns: u64,
    points: Vec<(f64, f64)>,
    /// The column that is being filled: its number, then time and value of the first, the smallest, the
    /// largest and the last.
    open: Option<(u64, [(Time, f64); 4])>,
}

impl Curve {
    fn new(began: Time, span: u64, columns: u64) -> Curve {
        Curve { began, span, columns, points: Vec::new(), open: None }
    }

    fn put(&mut self, at: Time, value: f64) {
        // Four parts of a pixel each, so that what is steep stays steep.
        let columns = u128::from(self.columns) * 2;
        let column = u128::from(at.nanos_since(self.began)) * columns / u128::from(self.span);
        let column = column as u64;
        match &mut self.open {
            Some((number, [_, low, high, last])) if *number == column => {
                if value < low.1 {
                    *low = (at, value);
                }
                if value > high.1 {
                    *high = (at, value);
                }
                *last = (at, value);
            }
            _ => {
                self.close();
                self.open = Some((column, [(at, value); 4]));
            }
        }
    }

    fn close(&mut self) {
        let Some((_, mut four)) = self.open.take() else { return };
        let [_, low, high, _] = &mut four;
        if low.0 > high.0 {
            std::mem::swap(low, high);
        }
        for (at, value) in four {
            let point = (at.as_secs_f64(), value);
            if self.points.last() != Some(&point) {
                self.points.push(point);
            }
        }
    }

    /// The curve, without the points in the middle of what is level.
    fn finish(mut self) -> Vec<(f64, f64)> {
        self.close();
        let mut level: Vec<(f64, f64)> = Vec::with_capacity(self.points.len());
        for point in self.points {
            if let [.., before, last] = level.as_slice()
                && before.1 == last.1
                && last.1 == point.1
            {
                level.pop();
            }
            level.push(point);
        }
        level
    }
}
