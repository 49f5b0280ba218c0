//! Bytes as people read them.

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
