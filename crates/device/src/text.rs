//! Bytes as readable text.

use std::fmt::Write;

/// Bytes in a form that can be read and copied: printable characters as they are, the others as
/// `\r`, `\n`, `\t`, `\\` or `\xFD`.
///
/// ```
/// assert_eq!(vimc4_device::escape(b"@07\r\n\\\xFD\x1B[2J"), r"@07\r\n\\\xFD\x1B[2J");
/// ```
#[must_use]
pub fn escape(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len());
    for &byte in bytes {
        match byte {
            b'\r' => text.push_str("\\r"),
            b'\n' => text.push_str("\\n"),
            b'\t' => text.push_str("\\t"),
            b'\\' => text.push_str("\\\\"),
            b' '..=b'~' => text.push(char::from(byte)),
            // Writing to a string cannot fail.
            _ => drop(write!(text, "\\x{byte:02X}")),
        }
    }
    text
}

/// The bytes that [`escape`] writes so; `\'` and `\"` are read as well.
///
/// ```
/// assert_eq!(vimc4_device::unescape(r"@07\r\xFD"), Ok(b"@07\r\xFD".to_vec()));
/// assert_eq!(vimc4_device::unescape(r"@07\q"), Err(r"\q"));
/// ```
///
/// # Errors
///
/// The text from the first backslash that begins no escape.
pub fn unescape(text: &str) -> Result<Vec<u8>, &str> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('\\') {
        let (plain, escaped) = rest.split_at(at);
        let (byte, after) = unescape_first(escaped).ok_or(escaped)?;
        bytes.extend_from_slice(plain.as_bytes());
        bytes.push(byte);
        rest = after;
    }
    bytes.extend_from_slice(rest.as_bytes());
    Ok(bytes)
}

/// The byte of the escape at the beginning of a text, and the text after it.
#[must_use]
pub fn unescape_first(text: &str) -> Option<(u8, &str)> {
    let code = text.strip_prefix('\\')?;
    let byte = match code.as_bytes().first()? {
        b'r' => b'\r',
        b'n' => b'\n',
        b't' => b'\t',
        literal @ (b'\\' | b'\'' | b'"') => *literal,
        b'x' => {
            let digits = code.get(1..3).filter(|hex| hex.bytes().all(|c| c.is_ascii_hexdigit()))?;
            return Some((u8::from_str_radix(digits, 16).ok()?, &code[3..]));
        }
        _ => return None,
    };
    Some((byte, &code[1..]))
}

/// Splits an error of the form `what is wrong; what would be right`. Text between backquotes may contain
/// semicolons.
///
/// ```
/// use vimc4_device::parted;
///
/// let text = "`cover a; b` is wrong at `a; b`; it can be open or closed";
/// assert_eq!(parted(text), Some(("`cover a; b` is wrong at `a; b`", "it can be open or closed")));
/// ```
#[must_use]
pub fn parted(text: &str) -> Option<(&str, &str)> {
    let is_outside = |place: usize| text[..place].matches('`').count().is_multiple_of(2);
    let (place, between) = text.match_indices("; ").find(|(place, _)| is_outside(*place))?;
    Some((&text[..place], &text[place + between.len()..]))
}

/// How many characters are shown of what a controller says.
const SHOWN: usize = 120;

/// What a controller says, in one line of readable length, without the codes and line ends around
/// it.
///
/// ```
/// assert_eq!(vimc4_device::said(b"isel IMC4\r\nVersion 2.00\r\n0"), "isel IMC4 Version 2.00");
/// assert_eq!(vimc4_device::said(b"S310,10696,100001\rC\r"), "S310,10696,100001");
/// ```
#[must_use]
pub fn said(answer: &[u8]) -> String {
    let text = answer.split(|byte| matches!(byte, b'\r' | b'\n'));
    let lines = text.filter(|line| !line.is_empty() && *line != b"0" && *line != b"C");
    let text = lines.map(escape).collect::<Vec<_>>().join(" ");
    let text = text.trim_start_matches('0').trim();
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{} ...", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_shown_in_part() {
        let said = said(&[b'x'; 4_000]);
        assert!(said.len() < 200 && said.ends_with(" ..."), "{said}");
    }
}
