//! Lines from bytes: the receive routine against its description.

use vimc4_isel_wire::{Control, LINE_MAX, LineBuffer, ReceivedLine, control};

/// Bytes as they come over the line become the lines that a plain reading of the rules finds.
pub fn lexer(data: &[u8]) {
    let mut buffer = LineBuffer::default();
    let mut lines = Vec::new();
    let mut rest = Vec::new();
    for &byte in data {
        match control(byte) {
            Some(Control::Stop) => assert_eq!(byte, 253),
            Some(Control::Break) => assert_eq!(byte, 255),
            Some(Control::Reset) => {
                assert_eq!(byte, 254);
                buffer.clear();
                assert_eq!(buffer, LineBuffer::default(), "something is left of a line");
                rest.clear();
            }
            None => {
                rest.push(byte);
                lines.extend(buffer.push(byte));
                assert_eq!(buffer.is_empty(), is_nothing(&rest), "{rest:?}");
                if byte == b'\r' {
                    assert_eq!(buffer, LineBuffer::default(), "something is left of a line");
                    assert_eq!(lines.pop(), line(&rest), "{rest:?}");
                    rest.clear();
                }
                assert!(lines.is_empty(), "a line without its end: {lines:?}");
            }
        }
    }
}

/// Whether a buffer that was given these bytes since the last CR holds nothing.
fn is_nothing(bytes: &[u8]) -> bool {
    bytes.last() == Some(&b'\r') || bytes.iter().all(|&byte| byte == b'\n')
}

/// The line that some bytes up to their CR are: LF is nowhere part of it, blanks alone are none.
fn line(bytes: &[u8]) -> Option<ReceivedLine> {
    let text: Vec<u8> = bytes.iter().copied().filter(|byte| !b"\r\n".contains(byte)).collect();
    if text.len() > LINE_MAX {
        Some(ReceivedLine::TooLong(text[..40].to_vec()))
    } else if text.iter().all(|&byte| byte == b' ') {
        None
    } else {
        Some(ReceivedLine::Text(text))
    }
}
