//! A table for spreadsheets and scripts: one row for each change.

use vimc4_device::Time;

use crate::scene::{Id, Scene, Signal, Value};
use crate::sheet::{Ink, Paper, Sheet, put_decimal, put_signed};

/// A table `seconds,signal,value`. Step pulses and the bits on the line are not in it; the positions
/// and the commands and answers are. A text that is no longer there is an empty value.
pub struct Csv<P> {
    ink: Ink<P>,
    /// What stands between time and value; nothing for a signal that is left out.
    names: Vec<Vec<u8>>,
}

impl<P: Paper> Csv<P> {
    /// A table that is written there.
    pub fn new(paper: P) -> Csv<P> {
        Csv { ink: Ink::new(paper), names: Vec::new() }
    }
}

impl<P: Paper> Sheet for Csv<P> {
    fn begin(&mut self, scene: &Scene, _at: Time) {
        self.ink.put(b"seconds,signal,value\n");
        let name = |signal: &Signal| match (signal.in_tables, signal.group.as_str()) {
            (false, _) => Vec::new(),
            (true, "") => format!(",{},", signal.name).into_bytes(),
            (true, group) => format!(",{group}.{},", signal.name).into_bytes(),
        };
        self.names = scene.signals.iter().map(name).collect();
    }

    fn set(&mut self, at: Time, signal: Id, value: Value<'_>) {
        let Some(name) = self.names.get(signal).filter(|name| !name.is_empty()) else { return };
        let text = &mut self.ink.text;
        put_seconds(text, at);
        text.extend_from_slice(name);
        match value {
            Value::Bit(bit) => text.push(b'0' + u8::from(bit)),
            Value::Byte(byte) => put_decimal(text, byte.into()),
            Value::Number(number) => put_signed(text, number),
            Value::Text(words) => put_field(text, words),
        }
        text.push(b'\n');
        self.ink.flow();
    }

    fn flush(&mut self) {
        self.ink.dry();
    }

    fn end(&mut self, _at: Time) {
        self.ink.dry();
    }
}

/// Adds a time with nine places.
fn put_seconds(text: &mut Vec<u8>, at: Time) {
    let nanos = at.as_nanos();
    put_decimal(text, nanos / 1_000_000_000);
    let fraction = nanos % 1_000_000_000;
    text.push(b'.');
    let mut place = 100_000_000;
    while place > 0 {
        text.push(b'0' + (fraction / place % 10) as u8);
        place /= 10;
    }
}

/// Adds a text, in quotes where it needs them (RFC 4180).
fn put_field(text: &mut Vec<u8>, words: &str) {
    if words.contains([',', '"', '\n', '\r']) {
        text.push(b'"');
        text.extend_from_slice(words.replace('"', "\"\"").as_bytes());
        text.push(b'"');
    } else {
        text.extend_from_slice(words.as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_nine_places_and_texts_their_quotes() {
        let mut text = Vec::new();
        put_seconds(&mut text, Time::from_nanos(12_000_000_345));
        put_field(&mut text, " a,\"b\"");
        put_field(&mut text, " c");
        assert_eq!(text, b"12.000000345\" a,\"\"b\"\"\" c");
    }
}
