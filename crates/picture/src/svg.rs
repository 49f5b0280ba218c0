//! A scene as SVG: text that any browser shows, with no script and nothing from outside.

use std::fmt::Write;

use crate::scene::{Anchor, Colour, Item, Scene, Spot};

/// The picture as text.
pub(crate) fn svg(scene: &Scene) -> String {
    let mut out = String::new();
    let (width, height) = (tenths(scene.width), tenths(scene.height));
    let (width, height) = (number(width), number(height));
    // Writing into a string cannot fail.
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" font-family=\"sans-serif\">\n\
         <title>{}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>",
        escaped(&scene.title)
    );
    for item in &scene.items {
        put(&mut out, item);
    }
    out.push_str("</svg>\n");
    out
}

fn put(out: &mut String, item: &Item) {
    match item {
        Item::Lines { class, pen, lines } => {
            let _ = write!(
                out,
                "<path class=\"{class}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"",
                colour(pen.colour),
                number(tenths(pen.width)),
            );
            if pen.dashes.is_empty() {
                out.push_str(" stroke-linejoin=\"round\" stroke-linecap=\"round\"");
            } else {
                let dashes: Vec<String> =
                    pen.dashes.iter().map(|length| number(tenths(*length))).collect();
                let _ = write!(out, " stroke-dasharray=\"{}\"", dashes.join(" "));
            }
            out.push_str(" d=\"");
            lines.iter().for_each(|line| polyline(out, line));
            out.push_str("\"/>\n");
        }
        Item::Sign { class, at, outline, colour: fill, title } => {
            let _ = write!(
                out,
                "<path class=\"{class}\" fill=\"{}\" stroke=\"#fff\" d=\"",
                colour(*fill)
            );
            let placed: Vec<Spot> =
                outline.iter().map(|point| (at.0 + point.0, at.1 + point.1)).collect();
            polyline(out, &placed);
            let _ = writeln!(out, "z\"><title>{}</title></path>", escaped(title));
        }
        Item::Text(label) => {
            let anchor = match label.anchor {
                Anchor::Start => "",
                Anchor::Middle => " text-anchor=\"middle\"",
                Anchor::End => " text-anchor=\"end\"",
            };
            let (x, y) = (number(tenths(label.at.0)), number(tenths(label.at.1)));
            let _ = writeln!(
                out,
                "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" fill=\"{}\"{anchor}>{}</text>",
                number(tenths(label.size)),
                colour(label.colour),
                escaped(&label.text)
            );
        }
    }
}

/// A line in tenths of a pixel. What is left out of one difference is in the next one.
fn polyline(out: &mut String, points: &[Spot]) {
    let mut last: Option<(i64, i64)> = None;
    for point in points {
        let (x, y) = (tenths(point.0), tenths(point.1));
        match last {
            None => {
                let _ = write!(out, "M{} {}", number(x), number(y));
                if points.len() > 1 {
                    out.push('l');
                }
            }
            Some((before_x, before_y)) => {
                let (x, y) = (number(x - before_x), number(y - before_y));
                let apart = if out.ends_with('l') || x.starts_with('-') { "" } else { " " };
                let between = if y.starts_with('-') { "" } else { " " };
                let _ = write!(out, "{apart}{x}{between}{y}");
            }
        }
        last = Some((x, y));
    }
}

fn tenths(value: f64) -> i64 {
    (value * 10.0).round() as i64
}

fn number(tenths: i64) -> String {
    let sign = if tenths < 0 { "-" } else { "" };
    match (tenths.abs() / 10, tenths.abs() % 10) {
        (whole, 0) => format!("{sign}{whole}"),
        (0, tenth) => format!("{sign}.{tenth}"),
        (whole, tenth) => format!("{sign}{whole}.{tenth}"),
    }
}

fn colour([red, green, blue]: Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // XML has no way to write the others.
            letter if letter.is_control() => out.push('\u{FFFD}'),
            letter => out.push(letter),
        }
    }
    out
}
