//! How a client understands an answer.

use crate::Model;
use crate::language::{Dialect, Reader, Status, why_refused};

/// `P19100,9000,0`, a line of its own, and in the echo mode another with `C`.
pub(super) fn read_position(answer: &[u8]) -> Option<Vec<i64>> {
    let text = std::str::from_utf8(answer).ok()?;
    let line = text.strip_suffix("\rC\r").or_else(|| text.strip_suffix('\r'))?;
    let places = line.strip_prefix('P')?.split(',').map(|place| place.trim().parse().ok());
    places.collect()
}

/// A command's answer is complete with `C` or a status, that of `IN` of an SMCU with `Z`; `!OC`
/// answers nothing.
pub(super) fn is_whole(sent: &[u8], answer: &[u8]) -> bool {
    let sent = sent.trim_ascii_start();
    if sent.starts_with(b"!OC") || sent.starts_with(b"IN") && answer.ends_with(b"Z") {
        return true;
    }
    let mut lines = answer.split_inclusive(|byte| *byte == b'\r');
    lines.any(|line| line.ends_with(b"\r") && matches!(line.first(), Some(b'C' | b'E')))
}

/// An answer begins with its kind; the kind of a status is its whole code.
pub(super) fn kind_of(answer: &[u8]) -> Option<String> {
    let answer = answer.strip_suffix(b"\r").unwrap_or(answer);
    let code = if answer.starts_with(b"E") { answer } else { answer.get(..1)? };
    Some(String::from_utf8_lossy(code).into_owned())
}

pub(super) fn refusal(answer: &[u8]) -> Option<String> {
    let code = kind_of(answer).filter(|code| code.starts_with('E'))?;
    let written = |status: &Status| {
        Dialect::ALL.into_iter().any(|dialect| {
            [false, true]
                .into_iter()
                .any(|decimal| status.written(dialect, decimal).is_some_and(|text| text == code))
        })
    };
    Some(match Status::ALL.iter().find(|status| written(status)) {
        Some(status) => format!("{code}: {}", status.meaning()),
        None => code,
    })
}

/// The same for a known command: its bytes may say more than the status.
pub(super) fn refusal_of(model: &Model, command: &[u8], answer: &[u8]) -> Option<String> {
    let refusal = refusal(answer)?;
    let status = Reader::new(model.grammar()).understand(command).err();
    let code = status.and_then(|status| Some((refusal.strip_suffix(status.meaning())?, status)));
    Some(match code {
        Some((code, status)) => format!("{code}{}", why_refused(command, model.grammar(), status)),
        None => refusal,
    })
}

/// Whether all of it is an answer to something unknown: lines with `E` and a number, or with `C`
/// alone.
pub(super) fn is_status(answer: &[u8]) -> bool {
    let Some(lines) = answer.strip_suffix(b"\r") else { return false };
    let is_status = |line: &[u8]| {
        line == b"C"
            || line.strip_prefix(b"E").is_some_and(|number| {
                matches!(number.len(), 1..=4) && number.iter().all(u8::is_ascii_hexdigit)
            })
    };
    lines.split(|byte| *byte == b'\r').all(is_status)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_read_as_they_are_answered() {
        assert_eq!(read_position(b"P19100,-9000,0\rC\r"), Some(vec![19_100, -9_000, 0]));
        assert_eq!(read_position(b"P1,2,3,4,5,6\r"), Some(vec![1, 2, 3, 4, 5, 6]));
        for wrong in [&b"C\r"[..], b"P1,2", b"P1,2\rC\rP1,2\rC\r", b"E0D\r", b"", b"Z"] {
            assert_eq!(read_position(wrong), None, "{}", wrong.escape_ascii());
        }
    }

    #[test]
    fn an_answer_is_whole_with_its_completion() {
        for (sent, answer, whole) in [
            ("PA1,2;", "", false),
            ("PA1,2;", "C\r", true),
            ("!ON0;", "P1,2,3\r", false),
            ("!ON0;", "P1,2,3\rC\r", true),
            ("PA1,2;", "E08\r", true),
            ("PA1,2;", "8\r", false),
            ("IN;", "Z", true),
            ("IN;", "C\r", true),
            ("!OC;", "", true),
        ] {
            assert_eq!(is_whole(sent.as_bytes(), answer.as_bytes()), whole, "{sent} {answer}");
        }
    }

    #[test]
    fn an_answer_says_what_is_wrong() {
        assert_eq!(refusal(b"C\r"), None);
        assert_eq!(refusal(b"P1,2,3\r"), None);
        assert!(refusal(b"E0D\r").unwrap().starts_with("E0D: "));
        assert!(refusal(b"E185\r").unwrap().starts_with("E185: "));
        assert_eq!(kind_of(b"E0D\r").unwrap(), "E0D");
        assert_eq!(kind_of(b"W1,2,3\r").unwrap(), "W");
    }

    #[test]
    fn a_status_is_told_from_other_answers() {
        for status in [&b"E0D\r"[..], b"E13\r", b"C\rE0D\r", b"E0D\rE0D\r"] {
            assert!(is_status(status));
        }
        for other in [&b"0"[..], b"5", b"E0D", b"isel IMC4\r\n0", b"E\r", b"EMC4\r", b"\r"] {
            assert!(!is_status(other), "{}", other.escape_ascii());
        }
    }
}
