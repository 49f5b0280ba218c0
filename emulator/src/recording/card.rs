//! A difference, for people.

use std::fmt::Write;

use serde_json::Value;
use vimc4_device::{Event, Grouped, Motion, Time, escape};
use vimc4_timeline::recording::{Difference, FieldDifference, Said, SaidDifference, Told};

use crate::text::{shortened, shown_in_line};

/// The longest value of a field that is shown.
const LONGEST: usize = 60;

/// What the two sides are called.
pub(super) type Names<'a> = [&'a str; 2];

/// The card of a difference.
pub(super) fn card(difference: &Difference, names: Names<'_>) -> String {
    let mut card = String::new();
    if let Some(said) = &difference.said {
        card += &said_card(said, names);
    } else {
        card += "Every byte is equal.\n";
    }
    card + &led(Some(difference), names)
}

/// The field of a difference, and what led there.
pub(super) fn led(difference: Option<&Difference>, names: Names<'_>) -> String {
    let Some(difference) = difference else { return String::new() };
    let mut card = String::new();
    if let Some(field) = &difference.field {
        card += &field_card(field, names);
    }
    let sides = [&difference.one, &difference.other];
    let both = difference.one == difference.other;
    for (name, side) in names.iter().zip(sides).skip(usize::from(both)) {
        if !side.told.is_empty() {
            let side = if both { "on both sides" } else { name };
            let _ = writeln!(card, "What led there, {side}:");
        }
        for event in &side.told {
            let _ = writeln!(card, "  {:>16}  {}", seconds(event.at), told(event));
        }
    }
    card
}

/// The first field that differs.
pub(super) fn field_card(field: &FieldDifference, names: Names<'_>) -> String {
    let mut card = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        card,
        "First field of the state that differs, found at {} (line {}):\n  {}",
        seconds(field.at),
        field.line,
        field.field
    );
    for (name, value) in names.iter().zip([&field.one, &field.other]) {
        let _ = writeln!(card, "  {name:<9} {}", self::value(value));
    }
    if let Some(command) = &field.command {
        let _ = writeln!(card, "  {:<9} {}", "in", told(command));
    }
    card
}

/// The first byte that differs.
pub(super) fn said_card(said: &SaidDifference, names: Names<'_>) -> String {
    let mut card = String::new();
    let bytes = if said.before == 1 { "byte that is" } else { "bytes that are" };
    let line = if said.line == 0 { String::new() } else { format!(", at line {}", said.line) };
    let _ = writeln!(card, "They part after {} {bytes} equal{line}:", said.before);
    let sides = [said.one, said.other].into_iter().zip(&said.rest);
    for (name, (first, rest)) in names.iter().zip(sides) {
        let text = match first {
            Some(Said { at, .. }) => format!("{}  {}", seconds(at), escape(rest)),
            None => "nothing".to_owned(),
        };
        let _ = writeln!(card, "  {name:<9} {text}");
    }
    if let Some(command) = &said.command {
        let _ = writeln!(card, "  {:<9} {}", "in", told(command));
    }
    card
}

/// A time as every report has it, to the nanosecond.
pub(super) fn seconds(at: Time) -> String {
    let nanos = at.as_nanos();
    format!("{}.{:09} s", nanos / 1_000_000_000, nanos % 1_000_000_000)
}

/// What happened, in words.
fn told(told: &Told) -> String {
    let number = told.command.map_or_else(String::new, |number| format!("command {number}: "));
    match &told.event {
        Event::Command { bytes, .. } => {
            let means =
                if told.means.is_empty() { String::new() } else { format!("  {}", told.means) };
            format!("{number}{}{means}", escape(bytes))
        }
        Event::Answer { bytes, why, .. } => {
            let why = why.as_ref().map_or_else(String::new, |why| format!("  {why}"));
            format!("{number}answered {}{why}", escape(bytes))
        }
        Event::CutShort { mnemonic, why } => format!("{number}{mnemonic} was cut short: {why}"),
        Event::Ignored { bytes, why } => format!("{} was left alone: {why}", escape(bytes)),
        Event::Line { line, mnemonic } => format!("line {line} of the program: {mnemonic}"),
        Event::Signal { signal, value } => format!("signal {} became {value}", signal.0),
        Event::Warning(warning) => warning.to_string(),
        Event::Motion(Motion::Begins { segment, .. }) => {
            let steps = Grouped(i64::try_from(segment.profile.steps()).unwrap_or(i64::MAX));
            format!("{number}a motion of {steps} steps began")
        }
        Event::Motion(Motion::Changes { .. }) => format!("{number}the motion braked"),
        Event::Motion(Motion::Ends { steps }) => {
            let steps = Grouped(i64::try_from(*steps).unwrap_or(i64::MAX));
            format!("{number}the motion ended after {steps} steps")
        }
        Event::Switch { axis, positive, active } => {
            let (end, level) = (if *positive { '+' } else { '-' }, u8::from(*active));
            format!("{number}limit switch {end} of axis {axis} became {level}")
        }
        Event::Port { port, value } => format!("{number}port {port} became {value}"),
        Event::Flash { what } => format!("{number}flash memory: {what}"),
        Event::Baud { baud } => format!("{number}the line has {baud} baud"),
        Event::Fault { number, news } => format!("fault {number} {news}"),
        Event::Rule { rule, news } => format!("rule {rule} {news}"),
        _ => format!("{number}something else happened"),
    }
}

fn value(value: &Value) -> String {
    shortened(&shown_in_line(&value.to_string()), LONGEST).into_owned()
}
