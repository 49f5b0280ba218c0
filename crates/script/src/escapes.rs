//! Escape sequences, with which HPGL sets up a plotter's line, and which printers and terminals have, too.

use std::ops::Range;

const ESC: u8 = 0x1B;
const BEL: u8 = 0x07;

/// Whether the escape sequence of a plotter begins here: ESC, a point and a character.
fn is_plotters(bytes: &[u8]) -> bool {
    matches!(bytes, [ESC, b'.', _, ..])
}

/// How long the escape sequence is that begins here; 0 if none does.
fn sequence(bytes: &[u8]) -> usize {
    let count =
        |bytes: &[u8], inner: fn(&u8) -> bool| bytes.iter().take_while(|b| inner(b)).count();
    match bytes {
        // A plotter's; some have numbers behind it, between semicolons, and a colon at the end.
        [ESC, b'.', letter, behind @ ..] => {
            let numbers = count(behind, |byte| byte.is_ascii_digit() || *byte == b';');
            let ends = b"@HIMNPT".contains(letter) && behind.get(numbers) == Some(&b':');
            3 + if ends { numbers + 1 } else { 0 }
        }
        // A terminal's, with numbers up to a letter.
        [ESC, b'[', behind @ ..] => {
            let numbers = count(behind, |byte| (b' '..=b'?').contains(byte));
            let ends = behind.get(numbers).is_some_and(|byte| (b'@'..=b'~').contains(byte));
            2 + numbers + usize::from(ends)
        }
        // A terminal's with text, such as the title of its window, up to BEL or ESC and a backslash.
        [ESC, b']', behind @ ..] => {
            let text = count(behind, |byte| !byte.is_ascii_control());
            let end = match behind.get(text..).unwrap_or_default() {
                [BEL, ..] => 1,
                [ESC, b'\\', ..] => 2,
                _ => return 2,
            };
            2 + text + end
        }
        // A printer's: a chain of small letters and values, and a capital one at its end.
        [ESC, b'!'..=b'/', behind @ ..] => {
            let chain = count(
                behind,
                |byte| matches!(byte, b'0'..=b'9' | b'+' | b'-' | b'.' | b'`'..=b'~'),
            );
            let ends = behind.get(chain).is_some_and(|byte| (b'@'..=b'^').contains(byte));
            2 + chain + usize::from(ends)
        }
        [ESC, b'0'..=b'~', ..] => 2,
        [ESC, ..] => 1,
        _ => 0,
    }
}

/// Where the escape sequences of a plotter are.
pub(crate) fn plotters(text: &[u8]) -> Vec<Range<usize>> {
    let begins = text.iter().enumerate().filter(|(_, byte)| **byte == ESC);
    let rests = begins.filter_map(|(start, _)| Some((start, text.get(start..)?)));
    let rests = rests.filter(|(_, rest)| is_plotters(rest));
    rests.map(|(start, rest)| start..start + sequence(rest)).collect()
}

/// A text from its first character that is of no escape sequence and that no reader passes over: blanks
/// and controls begin no command, and NULs fill plots up. A semicolon behind a plotter's sequence is
/// its end.
pub(crate) fn behind(text: &str) -> &str {
    let mut text = text;
    loop {
        text = text.trim_start_matches(|c: char| c == ' ' || c.is_ascii_control() && c != '\x1B');
        let length = sequence(text.as_bytes());
        let Some(rest) = text.get(length..).filter(|_| length > 0) else { return text };
        let end = if is_plotters(text.as_bytes()) { ";" } else { "" };
        text = rest.strip_prefix(end).unwrap_or(rest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequences_of_plotters_are_found() {
        // Without its colon it has no numbers.
        assert_eq!(plotters(b"\x1B.@;PA5\x1B.J;"), [0..3, 7..10]);
        assert_eq!(plotters(b"a\x1B.@;0:\x1B.J\x1B"), [1..7, 7..10]);
        assert_eq!(plotters(b"\x1BE\x1B%0B\x1B."), []);
    }

    #[test]
    fn what_stands_behind_sequences_is_found() {
        for before in [
            "",
            "\x1B.(",
            "\x1B.(;",
            "\x1B.Y\x1B.J",
            "\x1B.I81;;17:",
            "\x1BE",
            "\x1B%0B",
            "\x1B%-1B",
            "\x1B%-12345X",
            "\x1B&l1O",
            "\x1B&l2a1h3O",
            "\x1B(s0p10.5h3T",
            "\x1B[31m",
            "\x1B[1;31m",
            "\x1B[K",
            "\x1B]0;the wörkshop\x07",
            "\x1B]8;;file:///x\x1B\\",
            " \0\x0C\x1BE\r\n",
        ] {
            for text in ["IN;", "@07", "71", ""] {
                assert_eq!(behind(&format!("{before}{text}")), text, "{before:?}");
            }
        }
        assert_eq!(behind("\x1B[31m; red"), "; red");
        assert_eq!(behind("\x1B"), "");
        assert_eq!(behind("\x1Bä"), "ä");
        assert_eq!(behind("\x1B.ä"), "\x1B.ä");
    }
}
