//! Bytes as a string of JSON.
//!
//! Each byte is the character with its number, U+0000 to U+00FF, and anything but printable ASCII
//! is written with the escapes of JSON: `"@0P\r"`, `"\u00fd"`. So there is a single level of
//! escapes, any JSON reader gives the bytes back, one for each character, and the file is plain
//! ASCII, which no editor or terminal changes.

use bytes::Bytes;

/// Adds the string, with its quotation marks.
pub(super) fn put(out: &mut Vec<u8>, bytes: &[u8]) {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    out.push(b'"');
    for &byte in bytes {
        match byte {
            b'"' | b'\\' => out.extend([b'\\', byte]),
            b' '..=b'~' => out.push(byte),
            b'\r' => out.extend(b"\\r"),
            b'\n' => out.extend(b"\\n"),
            b'\t' => out.extend(b"\\t"),
            _ => {
                out.extend(b"\\u00");
                out.extend([byte >> 4, byte & 15].map(|digit| DIGITS[usize::from(digit)]));
            }
        }
    }
    out.push(b'"');
}

/// The bytes of a string, or the first character that is not a byte.
pub(super) fn bytes(text: &str) -> Result<Bytes, char> {
    text.chars()
        .map(|c| u8::try_from(u32::from(c)).map_err(|_| c))
        .collect::<Result<Vec<u8>, _>>()
        .map(Bytes::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_comes_back_and_is_ascii() {
        let all: Vec<u8> = (0..=255).collect();
        let mut out = Vec::new();
        put(&mut out, &all);
        assert!(out.is_ascii() && !out.contains(&b'\n'));
        let text: String = serde_json::from_slice(&out).unwrap();
        assert_eq!(bytes(&text).unwrap(), all);
        assert_eq!(bytes("a\u{2192}"), Err('\u{2192}'));
    }
}
