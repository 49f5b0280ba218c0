//! Faults of the line.
//!
//! ```text
//! KIND = "drop" | "garble" ["flip" MASK | "into" BYTE] | "duplicate" | "delay" TIME | "insert" BYTES
//!      | "split" TIME | "merge" TIME | ("parity" | "framing") ["as-is" | "dropped" | "zero" | "marked"]
//!      | "cut" | "break" TIME | "speed" BAUD
//! ```

use vimc4_device::{BadByte, Damage, Garbling, unescape};

use crate::Lexer;
use crate::lexer::Read;

/// The kinds, as they are typed, and what each does.
pub(crate) const KINDS: [(&str, &str); 12] = [
    ("drop", "bytes do not arrive"),
    ("garble", "other bytes arrive, also with `flip 0x20` or `into ?`"),
    ("duplicate", "bytes arrive twice"),
    ("delay", "bytes arrive later, as in `delay 50ms`"),
    ("insert", r"bytes arrive that nobody sent, as in `insert \xFF`"),
    ("split", "bytes arrive with pauses between them, as in `split 2ms`"),
    ("merge", "bytes are held back and arrive in one piece, as in `merge 16ms`"),
    ("parity", "a bit is turned over; a receiver that looks takes as-is|dropped|zero|marked"),
    ("framing", "a spike is taken for a start bit; the same words may follow"),
    ("cut", "nothing arrives"),
    ("break", "the line is held low, as in `break 250ms`"),
    ("speed", "the host has another speed, as in `speed 9600`"),
];

/// What a kind and the words behind it do to the line; `None` if there is no such kind.
pub(crate) fn damage(kind: &str, lexer: &mut Lexer<'_>) -> Option<Read<Damage>> {
    Some(match kind {
        "drop" => Ok(Damage::Drop),
        "garble" => garbling(lexer).map(Damage::Garble),
        "duplicate" => Ok(Damage::Duplicate),
        "delay" => lexer.span("delay 50ms").map(Damage::Delay),
        "insert" => {
            let expected = r#"bytes, as in `insert \xFF` or `insert "0\r"`"#;
            bytes(lexer, expected).map(|bytes| Damage::Insert(bytes.into()))
        }
        "split" => lexer.span("split 2ms").map(Damage::Split),
        "merge" => lexer.span("merge 16ms").map(Damage::Merge),
        "parity" => Ok(Damage::Parity(bad_byte(lexer))),
        "framing" => Ok(Damage::Framing(bad_byte(lexer))),
        "cut" => Ok(Damage::Cut),
        "break" => lexer.span("break 250ms").map(Damage::Break),
        "speed" => {
            let here = *lexer;
            match lexer.value() {
                Some(0) => Err(here.wrong("at least 1 bit a second, as in `speed 9600`")),
                Some(speed) => Ok(Damage::Speed(speed)),
                None => Err(here.wrong("bits a second, as in `speed 9600`")),
            }
        }
        _ => return None,
    })
}

fn garbling(lexer: &mut Lexer<'_>) -> Read<Garbling> {
    if lexer.keyword("flip") {
        let mask = |word: &str| {
            let mask = match word.strip_prefix("0x") {
                Some(hex) => u8::from_str_radix(hex, 16).ok(),
                None => word.parse().ok(),
            };
            mask.filter(|mask| *mask != 0)
        };
        return lexer.expect("the bits to turn over, as in `flip 0x20`", mask).map(Garbling::Flip);
    }
    if lexer.keyword("into") {
        let here = *lexer;
        let expected = r"one byte, as in `into ?` or `into \xFF`";
        return match bytes(lexer, expected)?.as_slice() {
            [byte] => Ok(Garbling::Into(*byte)),
            _ => Err(here.wrong(expected)),
        };
    }
    Ok(Garbling::Bit)
}

fn bad_byte(lexer: &mut Lexer<'_>) -> BadByte {
    let named = BadByte::ALL.into_iter().find(|(_, name)| lexer.keyword(name));
    named.map_or(BadByte::AsIs, |(bad, _)| bad)
}

/// Bytes as [`escape`](vimc4_device::escape) writes them, between quotation marks or up to a blank.
fn bytes(lexer: &mut Lexer<'_>, expected: &str) -> Read<Vec<u8>> {
    let here = *lexer;
    let written = match lexer.rest().strip_prefix('"') {
        Some(quoted) => {
            let written = quoted.split_once('"').map(|(written, _)| written);
            written.inspect(|written| lexer.skip(written.len() + 2))
        }
        None => lexer.chunk(),
    };
    let is_plain = |text: &&str| !text.is_empty() && text.bytes().all(|c| matches!(c, b' '..=b'~'));
    let bytes = written.filter(is_plain).and_then(|written| unescape(written).ok());
    bytes.ok_or_else(|| here.wrong(expected))
}
