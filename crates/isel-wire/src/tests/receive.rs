//! The receive routine.

use crate::{Control, LineBuffer, ReceivedLine, control};

/// What comes out of a stream of bytes.
fn lines(bytes: &[u8]) -> Vec<ReceivedLine> {
    let mut buffer = LineBuffer::default();
    bytes.iter().filter_map(|&byte| buffer.push(byte)).collect()
}

fn text(text: &str) -> ReceivedLine {
    ReceivedLine::Text(text.as_bytes().to_vec())
}

#[test]
fn three_bytes_act_at_once() {
    for byte in 0..=u8::MAX {
        let expected = match byte {
            253 => Some(Control::Stop),
            254 => Some(Control::Reset),
            255 => Some(Control::Break),
            _ => None,
        };
        assert_eq!(control(byte), expected);
        assert!(expected.is_none_or(|control| control as u8 == byte));
    }
}

#[test]
fn a_line_ends_with_cr_and_lf_is_nothing() {
    assert_eq!(lines(b"@07\r@0R7\r"), [text("@07"), text("@0R7")]);
    assert_eq!(lines(b"@07\r\n@0R7\r\n"), [text("@07"), text("@0R7")]);
    assert_eq!(lines(b"\n@0\n7\n\r"), [text("@07")]);
    assert_eq!(lines(b"@07"), []);
}

#[test]
fn an_empty_line_is_ignored() {
    assert_eq!(lines(b"\r\r\n \r   \r"), []);
    assert_eq!(lines(b" @0P \r"), [text(" @0P ")]);
}

#[test]
fn a_line_has_255_bytes_at_most() {
    let fits = [b'5'; 255];
    assert_eq!(lines(&[&fits[..], b"\r"].concat()), [ReceivedLine::Text(fits.to_vec())]);
    assert_eq!(lines(&[&fits[..], b"\n\n\r"].concat()), [ReceivedLine::Text(fits.to_vec())]);
    // Of a longer one the beginning is kept, so that people can be shown which it was.
    let too_long = || ReceivedLine::TooLong(fits[..40].to_vec());
    assert_eq!(lines(&[&fits[..], b"5\r@0P\r"].concat()), [too_long(), text("@0P")]);
    assert_eq!(lines(&[&fits[..], &fits[..], b"\r"].concat()), [too_long()]);
}

#[test]
fn what_is_collected_can_be_forgotten() {
    let mut buffer = LineBuffer::default();
    assert!(buffer.is_empty());
    for byte in b"@0" {
        assert_eq!(buffer.push(*byte), None);
    }
    assert!(!buffer.is_empty());
    buffer.clear();
    assert_eq!(buffer, LineBuffer::default());
    for _ in 0..1000 {
        assert_eq!(buffer.push(b'x'), None);
    }
    assert!(!buffer.is_empty());
    buffer.clear();
    assert!(buffer.is_empty());
    assert_eq!(buffer.push(b'\r'), None);
}
