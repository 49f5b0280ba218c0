//! A scene as PNG.
//!
//! Lines are drawn by a rasteriser that computes with whole and IEEE numbers only, and texts with the
//! strokes of a font of our own: the bytes are the same on every computer.

use miniz_oxide::deflate::compress_to_vec_zlib;
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, PixmapMut, Stroke, StrokeDash,
    Transform,
};

use crate::font;
use crate::scene::{Anchor, Colour, Item, Label, Pen, Scene, Spot, pen};

/// Pixels of the file for one of the scene.
const SCALE: f64 = 2.0;

/// The most pixels of a side.
const MOST: f64 = 8_192.0;

/// How hard it is tried to make the file small: as usual.
const LEVEL: u8 = 6;

/// The picture as a file; `None` if it is larger than a picture can be.
pub(crate) fn png(scene: &Scene) -> Option<Vec<u8>> {
    let side = |length: f64| (length * SCALE).clamp(1.0, MOST) as u32;
    let (width, height) = (side(scene.width), side(scene.height));
    let mut pixels = Pixmap::new(width, height)?;
    pixels.fill(Color::WHITE);
    for item in &scene.items {
        put(&mut pixels.as_mut(), item);
    }
    Some(file(width, height, pixels.data()))
}

fn put(pixels: &mut PixmapMut<'_>, item: &Item) {
    match item {
        Item::Lines { pen, lines, .. } => {
            let mut path = PathBuilder::new();
            lines.iter().for_each(|line| trace(&mut path, line));
            stroke(pixels, path, pen);
        }
        Item::Sign { at, outline, colour, .. } => {
            let placed: Vec<Spot> =
                outline.iter().map(|point| (at.0 + point.0, at.1 + point.1)).collect();
            let mut path = PathBuilder::new();
            trace(&mut path, &placed);
            path.close();
            let Some(path) = path.finish() else { return };
            pixels.fill_path(
                &path,
                &paint(*colour),
                FillRule::Winding,
                Transform::identity(),
                None,
            );
            let white = Stroke { width: SCALE as f32, ..Stroke::default() };
            pixels.stroke_path(&path, &paint([255; 3]), &white, Transform::identity(), None);
        }
        Item::Text(label) => {
            let mut path = PathBuilder::new();
            letters(label).iter().for_each(|line| trace(&mut path, line));
            stroke(pixels, path, &pen(label.colour, label.size * 0.09));
        }
    }
}

/// The strokes of a text.
fn letters(label: &Label) -> Vec<Vec<Spot>> {
    let unit = label.size / f64::from(font::HEIGHT);
    let width = f64::from(font::ADVANCE) * unit * label.text.chars().count() as f64;
    let left = match label.anchor {
        Anchor::Start => label.at.0,
        Anchor::Middle => label.at.0 - width / 2.0,
        Anchor::End => label.at.0 - width,
    };
    let mut lines = Vec::new();
    for (letter, number) in label.text.chars().zip(0_u32..) {
        let from = left + f64::from(number * font::ADVANCE) * unit;
        for line in font::strokes(letter) {
            let place =
                |(x, y): (u8, i8)| (from + f64::from(x) * unit, label.at.1 - f64::from(y) * unit);
            lines.push(line.into_iter().map(place).collect());
        }
    }
    lines
}

fn trace(path: &mut PathBuilder, line: &[Spot]) {
    for (number, (x, y)) in line.iter().enumerate() {
        let (x, y) = ((x * SCALE) as f32, (y * SCALE) as f32);
        match number {
            0 => path.move_to(x, y),
            _ => path.line_to(x, y),
        }
    }
}

fn stroke(pixels: &mut PixmapMut<'_>, path: PathBuilder, pen: &Pen) {
    let Some(path) = path.finish() else { return };
    let scale = SCALE as f32;
    let (line_cap, line_join) = match pen.dashes {
        [] => (LineCap::Round, LineJoin::Round),
        _ => (LineCap::Butt, LineJoin::Miter),
    };
    // A whole line is no dash at all.
    let dashes = pen.dashes.iter().map(|length| *length as f32 * scale).collect();
    let dash = StrokeDash::new(dashes, 0.0);
    let width = pen.width as f32 * scale;
    let stroke = Stroke { width, line_cap, line_join, dash, ..Stroke::default() };
    pixels.stroke_path(&path, &paint(pen.colour), &stroke, Transform::identity(), None);
}

fn paint([red, green, blue]: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(red, green, blue, 255);
    paint
}

/// The file: opaque pixels of three bytes, each row as the difference from the one above.
fn file(width: u32, height: u32, pixels: &[u8]) -> Vec<u8> {
    let row = width as usize * 4;
    let mut raw = Vec::with_capacity(pixels.len());
    let mut above = vec![0_u8; row];
    for line in pixels.chunks_exact(row) {
        raw.push(2);
        let pairs = line.chunks_exact(4).zip(above.chunks_exact(4));
        for (pixel, above) in pairs {
            raw.extend(
                pixel.iter().zip(above).take(3).map(|(now, above)| now.wrapping_sub(*above)),
            );
        }
        above.copy_from_slice(line);
    }
    let mut header = Vec::new();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([8, 2, 0, 0, 0]);
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    chunk(&mut out, b"IHDR", &header);
    chunk(&mut out, b"IDAT", &compress_to_vec_zlib(&raw, LEVEL));
    chunk(&mut out, b"IEND", &[]);
    out
}

fn chunk(out: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
    out.extend(u32::try_from(data.len()).unwrap_or(u32::MAX).to_be_bytes());
    let begin = out.len();
    out.extend(kind);
    out.extend(data);
    let sum = crc(out.get(begin..).unwrap_or_default());
    out.extend(sum.to_be_bytes());
}

/// The check sum of PNG: CRC-32, bit by bit.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
            if sum & 1 == 1 { (sum >> 1) ^ 0xEDB8_8320 } else { sum >> 1 }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_check_sum_is_that_of_the_standard() {
        assert_eq!(crc(b"123456789"), 0xCBF4_3926);
    }
}
