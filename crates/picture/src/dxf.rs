//! The path as DXF.

use std::fmt::Write;

use vimc4_motion::AXES;

use crate::frame::{Frame, distance};
use crate::gcode::number;
use crate::leg::Purpose;
use crate::pieces::{Piece, parts};
use crate::plot::Plot;

/// The layers, each with its colour: grey, yellow and blue.
const LAYERS: [(&str, u8); 3] = [("REFERENCE", 8), ("RAPID", 2), ("FEED", 5)];

/// The path of a plot as DXF R12 in millimetres: lines, and arcs as arcs where they lie in the XY plane;
/// what climbs or lies in another plane is lines. Each purpose is a layer.
#[must_use]
pub fn dxf(plot: &Plot, frame: &Frame) -> String {
    let mut out = String::new();
    put(&mut out, 999, &frame.title.replace(['\n', '\r'], " "));
    put(&mut out, 999, "all lengths are millimetres");
    for (code, text) in [
        (0, "SECTION"),
        (2, "HEADER"),
        (9, "$ACADVER"),
        (1, "AC1009"),
        (0, "ENDSEC"),
        (0, "SECTION"),
        (2, "TABLES"),
        (0, "TABLE"),
        (2, "LAYER"),
        (70, "3"),
    ] {
        put(&mut out, code, text);
    }
    for (name, colour) in LAYERS {
        put(&mut out, 0, "LAYER");
        put(&mut out, 2, name);
        put(&mut out, 70, "0");
        put(&mut out, 62, &colour.to_string());
        put(&mut out, 6, "CONTINUOUS");
    }
    for (code, text) in [(0, "ENDTAB"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES")] {
        put(&mut out, code, text);
    }
    let (origin, lengths) = (plot.origin(), frame.lengths());
    // What turns has no place in a drawing.
    let mut linear = frame.clone();
    for (axis, length) in linear.axes.iter_mut().zip(lengths) {
        axis.per_step = length;
    }
    for leg in plot.legs() {
        let layer = match leg.purpose {
            Purpose::Reference => LAYERS[0].0,
            Purpose::Rapid => LAYERS[1].0,
            Purpose::Work => LAYERS[2].0,
        };
        let mut from: [f64; AXES] =
            std::array::from_fn(|axis| (leg.from[axis] - origin[axis]) as f64 * lengths[axis]);
        for part in parts(leg, &linear, &origin) {
            match part.piece {
                Piece::Arc { plane: (0, 1), centre, counterclockwise } if part.to[2] == from[2] => {
                    arc(&mut out, layer, &from, &part.to, centre, counterclockwise);
                }
                Piece::Arc { plane, centre, counterclockwise } => {
                    for next in chords(&from, &part.to, plane, centre, counterclockwise) {
                        line(&mut out, layer, &from, &next);
                        from = next;
                    }
                }
                Piece::Line => line(&mut out, layer, &from, &part.to),
            }
            from = part.to;
        }
    }
    put(&mut out, 0, "ENDSEC");
    put(&mut out, 0, "EOF");
    out
}

/// A group: its code and its value.
fn put(out: &mut String, code: u16, value: &str) {
    // Writing into a string cannot fail.
    let _ = writeln!(out, "{code:>3}\n{value}");
}

fn line(out: &mut String, layer: &str, from: &[f64; AXES], to: &[f64; AXES]) {
    if from[..3] == to[..3] {
        return;
    }
    put(out, 0, "LINE");
    put(out, 8, layer);
    for (place, codes) in [(from, [10, 20, 30]), (to, [11, 21, 31])] {
        for (code, value) in codes.into_iter().zip(place) {
            put(out, code, &number(*value, 6));
        }
    }
}

/// Arcs of DXF go counterclockwise from one angle to another.
fn arc(
    out: &mut String,
    layer: &str,
    from: &[f64; AXES],
    to: &[f64; AXES],
    centre: (f64, f64),
    counterclockwise: bool,
) {
    let (first, last) = if counterclockwise { (from, to) } else { (to, from) };
    let angle = |place: &[f64; AXES]| {
        let degrees = libm::atan2(place[1] - centre.1, place[0] - centre.0).to_degrees();
        if degrees < 0.0 { degrees + 360.0 } else { degrees }
    };
    let radius = distance(&from[..2], &[centre.0, centre.1]);
    put(out, 0, "ARC");
    put(out, 8, layer);
    for (code, value) in [(10, centre.0), (20, centre.1), (30, from[2]), (40, radius)] {
        put(out, code, &number(value, 6));
    }
    put(out, 50, &number(angle(first), 8));
    put(out, 51, &number(angle(last), 8));
}

/// Places on an arc that DXF R12 has no word for, five degrees apart at the most.
fn chords(
    from: &[f64; AXES],
    to: &[f64; AXES],
    (one, other): (usize, usize),
    centre: (f64, f64),
    counterclockwise: bool,
) -> Vec<[f64; AXES]> {
    let arm = (from[one] - centre.0, from[other] - centre.1);
    let radius = distance(&[0.0, 0.0], &[arm.0, arm.1]);
    let begin = libm::atan2(arm.1, arm.0);
    let end = libm::atan2(to[other] - centre.1, to[one] - centre.0);
    let turn = std::f64::consts::TAU;
    let mut sweep = end - begin;
    if counterclockwise && sweep < 0.0 {
        sweep += turn;
    } else if !counterclockwise && sweep > 0.0 {
        sweep -= turn;
    }
    let count = (sweep.abs() / 5.0_f64.to_radians()).ceil().max(1.0);
    let mut places = Vec::new();
    for number in 1..count as u32 {
        let share = f64::from(number) / count;
        let angle = begin + share * sweep;
        let mut place: [f64; AXES] =
            std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis]));
        place[one] = centre.0 + radius * libm::cos(angle);
        place[other] = centre.1 + radius * libm::sin(angle);
        places.push(place);
    }
    places.push(*to);
    places
}
