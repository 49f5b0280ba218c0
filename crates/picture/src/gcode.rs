//! The path as G-code.

use std::fmt::Write;

use crate::frame::Frame;
use crate::leg::{Leg, Purpose};
use crate::pieces::{Piece, parts};
use crate::plot::{MarkKind, Plot};

/// The words of the axes, in their order.
const WORDS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];

/// The words of a centre.
const CENTRE: [char; 3] = ['I', 'J', 'K'];

/// The path of a plot as G-code (RS-274): millimetres, absolute, feeds per minute. What moves on the way
/// and in reference runs is G0, lines are G1, parts of circles G2 and G3 of half a turn at the most, with
/// the speed at which each motion went for the most part. Stops, errors and tools are comments.
#[must_use]
pub fn gcode(plot: &Plot, frame: &Frame) -> String {
    let mut out = String::new();
    let origin = plot.origin();
    // Writing into a string cannot fail.
    let _ = writeln!(out, "({})", comment(&frame.title));
    if plot.astray() > 0 {
        let _ = writeln!(out, "(short motions are taken together within {} steps)", plot.astray());
    }
    let _ = writeln!(out, "G21 G90 G94 G17");
    let legs = plot.legs();
    // A viewer need not know axes that rest.
    let axes = (0..frame.axes.len().min(6))
        .filter(|axis| *axis < 3 || legs.iter().any(|leg| leg.travels(*axis)));
    let axes = axes.collect();
    let mut file = File { out, axes, place: [const { None }; 6], feed: None, plane: (0, 1) };
    let mut marks = plot.marks().into_iter().peekable();
    for leg in legs {
        while let Some(mark) = marks.next_if(|mark| mark.at <= leg.began) {
            file.mark(mark.kind, &mark.text, mark.at.as_secs_f64());
        }
        let from = std::array::from_fn(|axis| {
            (leg.from[axis] - origin[axis]) as f64 * frame.scales()[axis]
        });
        file.go("G0", &from);
        let feed = feed(leg, frame);
        for part in parts(leg, frame, &origin) {
            file.part(&part.piece, &part.to, leg.purpose, feed);
        }
    }
    for mark in marks {
        file.mark(mark.kind, &mark.text, mark.at.as_secs_f64());
    }
    file.out.push_str("M2\n");
    file.out
}

/// Units per minute, where a motion is in the middle.
fn feed(leg: &Leg, frame: &Frame) -> f64 {
    let pace = leg.pace(&frame.lengths());
    // What only turns goes in degrees.
    60.0 * if pace > 0.0 { pace } else { leg.pace(&frame.scales()) }
}

/// A file of G-code, and what holds where it ends.
struct File {
    out: String,
    /// Those that it is about.
    axes: Vec<usize>,
    /// The place, as it is written.
    place: [Option<String>; 6],
    feed: Option<String>,
    plane: (usize, usize),
}

impl File {
    /// A line with the words of the axes that change, if any does.
    fn go(&mut self, code: &str, to: &[f64; 6]) {
        let words = self.words(to);
        if !words.is_empty() {
            let _ = writeln!(self.out, "{code}{words}");
        }
    }

    fn words(&mut self, to: &[f64; 6]) -> String {
        let mut words = String::new();
        for axis in self.axes.iter().copied() {
            let value = number(to[axis], 5);
            if self.place[axis].as_ref() != Some(&value) {
                words += &format!(" {}{value}", WORDS[axis]);
                self.place[axis] = Some(value);
            }
        }
        words
    }

    fn part(&mut self, piece: &Piece, to: &[f64; 6], purpose: Purpose, feed: f64) {
        if purpose != Purpose::Work && *piece == Piece::Line {
            return self.go("G0", to);
        }
        let value = number(feed.max(0.1), 1);
        let feed = match self.feed.as_ref() == Some(&value) {
            true => String::new(),
            false => format!(" F{value}"),
        };
        let code = match piece {
            Piece::Line => "G1".to_owned(),
            Piece::Arc { plane, centre, counterclockwise } => {
                let select = match plane {
                    (0, 1) => "G17",
                    (0, 2) => "G18",
                    _ => "G19",
                };
                if std::mem::replace(&mut self.plane, *plane) != *plane {
                    let _ = writeln!(self.out, "{select}");
                }
                // Z is the first axis of G18.
                let is_left = *counterclockwise != (*plane == (0, 2));
                let here = |axis: usize| -> f64 {
                    self.place[axis].as_ref().and_then(|place| place.parse().ok()).unwrap_or(0.0)
                };
                let (one, other) =
                    (number(centre.0 - here(plane.0), 6), number(centre.1 - here(plane.1), 6));
                let words = self.words(to);
                let (code, first, second) =
                    (if is_left { "G3" } else { "G2" }, CENTRE[plane.0], CENTRE[plane.1]);
                let _ = writeln!(self.out, "{code}{words} {first}{one} {second}{other}{feed}");
                self.feed = Some(value);
                return;
            }
        };
        let words = self.words(to);
        if !words.is_empty() {
            let _ = writeln!(self.out, "{code}{words}{feed}");
            self.feed = Some(value);
        }
    }

    fn mark(&mut self, kind: MarkKind, text: &str, seconds: f64) {
        let what = match kind {
            MarkKind::Start | MarkKind::End => return,
            MarkKind::Stop => "stopped",
            MarkKind::Warning => "warning",
            MarkKind::Error => "error",
            MarkKind::Limit => "limit switch",
            MarkKind::Tool => "tool",
            MarkKind::Back => "put back",
        };
        let _ = writeln!(self.out, "({what} at {seconds:.3} s: {})", comment(text));
    }
}

/// A number with so many decimals and no idle zeros.
pub(crate) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// A text that is a comment to its end.
fn comment(text: &str) -> String {
    let plain = |letter: char| match letter {
        '(' => '[',
        ')' => ']',
        letter if letter.is_ascii_graphic() || letter == ' ' => letter,
        '·' => '-',
        _ => '?',
    };
    text.chars().map(plain).collect()
}
