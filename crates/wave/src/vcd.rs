//! Value change dumps: the text of IEEE 1364, which every viewer reads.

use vimc4_device::Time;

use crate::scene::{Id, Kind, Scene, Value};
use crate::sheet::{Ink, Paper, Sheet, put_decimal, put_signed};

/// A value change dump. Numbers are of the type `real`, which has a sign everywhere and is drawn as a
/// curve; texts are of the type `string`, which GTKWave, Surfer and others have added to the
/// standard.
pub struct Vcd<P> {
    ink: Ink<P>,
    /// What stands behind a value: the letters for its signal, and the end of the line.
    codes: Vec<Vec<u8>>,
    now: Option<Time>,
}

impl<P: Paper> Vcd<P> {
    /// A dump that is written there.
    pub fn new(paper: P) -> Vcd<P> {
        Vcd { ink: Ink::new(paper), codes: Vec::new(), now: None }
    }

    fn time(&mut self, at: Time) {
        if self.now != Some(at) {
            self.now = Some(at);
            self.ink.flow();
            self.ink.text.push(b'#');
            put_decimal(&mut self.ink.text, at.as_nanos());
            self.ink.text.push(b'\n');
        }
    }
}

/// The first and the number of the letters of which identifiers are made.
const LETTERS: (u8, usize) = (b'!', 94);

fn code(id: Id) -> Vec<u8> {
    let (mut rest, mut code) = (id, Vec::new());
    loop {
        code.push(LETTERS.0 + (rest % LETTERS.1) as u8);
        rest /= LETTERS.1;
        if rest == 0 {
            return code;
        }
        rest -= 1;
    }
}

impl<P: Paper> Sheet for Vcd<P> {
    fn begin(&mut self, scene: &Scene, at: Time) {
        self.ink.put(b"$version vimc4 $end\n$timescale 1 ns $end\n");
        self.ink.put(format!("$scope module {} $end\n", scene.name).as_bytes());
        let mut group = "";
        for (id, signal) in scene.signals.iter().enumerate() {
            if signal.group != group {
                if !group.is_empty() {
                    self.ink.put(b"$upscope $end\n");
                }
                group = &signal.group;
                self.ink.put(format!("$scope module {group} $end\n").as_bytes());
            }
            let code = code(id);
            let kind = match signal.kind {
                Kind::Bit => "wire 1",
                Kind::Byte => "wire 8",
                Kind::Number => "real 64",
                Kind::Text => "string 1",
            };
            let text = String::from_utf8_lossy(&code);
            let bits = if signal.kind == Kind::Byte { " [7:0]" } else { "" };
            self.ink.put(format!("$var {kind} {text} {}{bits} $end\n", signal.name).as_bytes());
            self.codes.push([&code[..], b"\n"].concat());
        }
        if !group.is_empty() {
            self.ink.put(b"$upscope $end\n");
        }
        self.ink.put(b"$upscope $end\n$enddefinitions $end\n");
        self.time(at);
    }

    #[inline]
    fn set(&mut self, at: Time, signal: Id, value: Value<'_>) {
        self.time(at);
        let Some(code) = self.codes.get(signal) else { return };
        let text = &mut self.ink.text;
        match value {
            Value::Bit(bit) => text.push(b'0' + u8::from(bit)),
            Value::Byte(byte) => {
                text.push(b'b');
                text.extend((0..8).rev().map(|bit| b'0' + (byte >> bit & 1)));
                text.push(b' ');
            }
            Value::Number(number) => {
                text.push(b'r');
                put_signed(text, number);
                text.push(b' ');
            }
            Value::Text(words) => {
                text.push(b's');
                put_words(text, words);
                text.push(b' ');
            }
        }
        text.extend_from_slice(code);
    }

    fn flush(&mut self) {
        self.ink.dry();
    }

    fn end(&mut self, at: Time) {
        self.time(at);
        self.ink.dry();
    }
}

/// Adds a text as one word, with the escapes of C where it would be none. That is how programs that
/// read such texts have them.
fn put_words(text: &mut Vec<u8>, words: &str) {
    for byte in words.bytes() {
        match byte {
            b'\\' => text.extend_from_slice(b"\\\\"),
            b'!'..=b'~' => text.push(byte),
            _ => text.extend_from_slice(format!("\\x{byte:02X}").as_bytes()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_signal_has_letters_of_its_own() {
        let codes: BTreeSet<Vec<u8>> = (0..100_000).map(code).collect();
        assert_eq!(codes.len(), 100_000);
        assert!(codes.iter().flatten().all(u8::is_ascii_graphic));
        assert_eq!([code(0), code(93), code(94)], [b"!".to_vec(), b"~".to_vec(), b"!!".to_vec()]);
    }

    #[test]
    fn a_text_is_one_word() {
        let mut text = Vec::new();
        put_words(&mut text, "@0A 5,9\\r ö");
        assert_eq!(text, b"@0A\\x205,9\\\\r\\x20\\xC3\\xB6");
    }
}
