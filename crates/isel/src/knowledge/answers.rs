//! How a client understands an answer.

use vimc4_device::{Heard, escape};
use vimc4_isel_wire::Reply;

use crate::{Model, PositionAxes, Unreferenced};

/// The error, if the answer is one.
pub(super) fn refusal(answer: &[u8]) -> Option<String> {
    let code = match answer {
        [b'0'] => return None,
        [code @ b'F', ..] | [code] => *code,
        _ => return None,
    };
    Some(match Reply::from_code(code) {
        Some(reply) => format!("{}: {}", char::from(code), reply.meaning()),
        None => escape(&[code]),
    })
}

/// What is wrong with a command. An absolute move of an axis without a reference point may be
/// answered as one that meets a limit switch.
pub(super) fn refusal_of(model: &Model, command: &[u8], answer: &[u8]) -> Option<String> {
    let refusal = refusal(answer)?;
    let is_absolute = matches!(letter(command), Some(b'M' | b'm'));
    let is_limit = answer == [Reply::LimitSwitch.code()];
    let may_be_either = model.quirks.unreferenced == Unreferenced::LimitSwitch;
    Some(match is_absolute && is_limit && may_be_either {
        true => format!("{refusal}, or no reference point"),
        false => refusal,
    })
}

/// The positions in the answer to `P`.
pub(super) fn read_position(model: &Model, answer: &[u8]) -> Option<Vec<i64>> {
    let fewest = match model.quirks.position_axes {
        PositionAxes::Three => 3,
        PositionAxes::Configured => 0,
    };
    let digits = std::str::from_utf8(answer.strip_prefix(b"0")?).ok()?;
    let is_whole = digits.len().is_multiple_of(6) && (fewest..=4).contains(&(digits.len() / 6));
    if !is_whole || !digits.bytes().all(is_hex) {
        return None;
    }
    let place = |at: usize| {
        let value = i64::from_str_radix(digits.get(at..at + 6)?, 16).ok()?;
        Some(if value < 1 << 23 { value } else { value - (1 << 24) })
    };
    (0..digits.len()).step_by(6).map(place).collect()
}

/// The letter of a command, blanks left out.
pub(super) fn letter(line: &[u8]) -> Option<u8> {
    let mut line = line.iter().copied().filter(|byte| *byte != b' ');
    let is_command = line.next() == Some(b'@');
    line.nth(1).filter(|_| is_command)
}

/// The form of the answer to a command that is carried out; a refused command answers with a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// `0`.
    Code,
    /// `0` and two hexadecimal digits.
    Byte,
    /// `0` and six hexadecimal digits for each axis.
    Places,
    /// Lines of text, behind a `0` or before it.
    Text,
}

impl Form {
    fn of(letter: u8) -> Form {
        match letter {
            b'b' | b'D' => Form::Byte,
            b'P' => Form::Places,
            b'V' | b'H' | b'h' | b'U' | b'?' => Form::Text,
            _ => Form::Code,
        }
    }
}

/// Whether a command of that letter asks for something and does nothing.
pub(super) fn is_question(letter: u8) -> bool {
    Form::of(letter) != Form::Code
}

/// How complete the answer to a command is.
pub(super) fn hear(model: &Model, sent: &[u8], answer: &[u8]) -> Heard {
    let whole = |is_one| if is_one { Heard::Whole } else { Heard::Strange };
    match answer {
        b"" => return Heard::Waits,
        // A motion that goes on by itself reports only its end.
        _ if sent.is_empty() => return whole(is_code(answer)),
        // Some controllers confirm a stop with a 0 of its own.
        b"F" => return Heard::Perhaps,
        _ => {}
    }
    let is_error = is_code(answer) && answer != b"0";
    let may_be_all = |is_one| if is_one || is_error { Heard::Perhaps } else { Heard::Part };
    match letter(sent).map_or(Form::Code, Form::of) {
        Form::Byte => match answer {
            [b'0', digits @ ..] if digits.len() < 2 => Heard::Part,
            [b'0', high, low] => whole(is_hex(*high) && is_hex(*low)),
            _ => whole(is_error),
        },
        Form::Places => may_be_all(read_position(model, answer).is_some()),
        Form::Text => may_be_all(
            answer.ends_with(b"\r\n0") || answer.starts_with(b"0") && answer.ends_with(b"\n"),
        ),
        Form::Code => whole(is_code(answer)),
    }
}

/// Whether this is the last answer of a command: a code, or the two of a stop.
fn is_code(answer: &[u8]) -> bool {
    match answer {
        b"F0" => true,
        [code] => Reply::from_code(*code).is_some(),
        _ => false,
    }
}

fn is_hex(digit: u8) -> bool {
    digit.is_ascii_digit() || (b'A'..=b'F').contains(&digit)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use vimc4_device::Model as _;

    use super::*;

    fn model(name: &str) -> Arc<Model> {
        Model::builtin(name).unwrap()
    }

    #[test]
    fn positions_are_read_as_they_are_answered() {
        let (later, old) = (model("imc4"), model("c142"));
        for model in [&later, &old] {
            let read = |answer| read_position(model, answer);
            assert_eq!(read(b"00003E8FFFFFF800000"), Some(vec![1_000, -1, -8_388_608]));
            assert_eq!(read(&[b'0'; 25]), Some(vec![0; 4]));
            // `P` of a controller in the middle of storing answers an error.
            for wrong in [&b"5"[..], b"8", b"000000000", b"00000e8FFFFFF800000", b"\xFF\x00"] {
                assert_eq!(read(wrong), None);
            }
            assert_eq!(read(&[b'0'; 31]), None);
        }
        // Some models report axes that are not configured, and some do not.
        for (answer, places) in
            [(&b"0"[..], vec![]), (b"0000064", vec![100]), (b"0000064FFFFFF", vec![100, -1])]
        {
            assert_eq!(read_position(&later, answer), None);
            assert_eq!(read_position(&old, answer), Some(places));
        }
    }

    #[test]
    fn an_answer_says_what_is_wrong() {
        assert_eq!(refusal(b"0"), None);
        assert_eq!(refusal(b"0000FA0000000000000"), None);
        assert_eq!(refusal(b"5").unwrap(), "5: unknown or malformed command");
        assert_eq!(refusal(b"F0").unwrap(), "F: stopped by the user");
        assert_eq!(refusal(b"\xFF").unwrap(), "\\xFF");
        assert_eq!(Model::kind_of(b"one\r\ntwo\r\n0").unwrap(), "0");
    }

    #[test]
    fn where_a_code_means_two_things_both_are_said() {
        let (later, new) = (model("imc4"), model("imc-s8"));
        let both = "2: limit switch, or no reference point";
        assert_eq!(refusal_of(&later, b"@0M5,300", b"2").unwrap(), both);
        assert_eq!(refusal_of(&later, b"@0m 5,300", b"2").unwrap(), both);
        assert_eq!(refusal_of(&later, b"@0A5,300", b"2").unwrap(), "2: limit switch");
        assert_eq!(refusal_of(&new, b"@0M5,300", b"2").unwrap(), "2: limit switch");
        assert_eq!(refusal_of(&later, b"@0M5,300", b"0"), None);
    }

    #[test]
    fn answers_have_the_form_of_their_command() {
        use Heard::{Part, Perhaps, Strange, Waits, Whole};
        let (later, old) = (model("imc4"), model("c142"));
        let place = [b'0'; 19];
        for (line, answer, heard) in [
            ("@0A5,900\r", &b""[..], Waits),
            ("@0A5,900\r", b"0", Whole),
            ("@07\r", b"4", Whole),
            ("35,-1\r", b"0", Whole),
            ("p0,1,1\r", b"8", Whole),
            ("@0A5,900\r", b"F", Perhaps),
            ("@0A5,900\r", b"F0", Whole),
            ("@0b0\r", b"0", Part),
            ("@0b0\r", b"01", Part),
            ("@0b0\r", b"01F", Whole),
            ("@ 0 D S0\r", b"000", Whole),
            ("@0b0\r", b"5", Whole),
            ("@0P\r", b"0", Part),
            ("@0P\r", b"5", Perhaps),
            ("@0P\r", &place, Perhaps),
            ("@0V\r", b"0", Part),
            ("@0V\r", b"isel", Part),
            ("@0V\r", b"isel\r\n0", Perhaps),
            ("@0V\r", b"0isel\r\n", Perhaps),
            ("@0A5,900\r", b"00", Strange),
            ("@07\r", b"FooBar 3000\r\n0", Strange),
            ("@07\r", b"00000", Strange),
            ("@07\r", b"X", Strange),
            ("@07\r", b"E0D\r", Strange),
            ("@0b0\r", b"01F0", Strange),
            ("@0b0\r", b"01f", Strange),
            ("o0,128,1,-1\r", b"01F", Strange),
            ("", b"0", Whole),
            ("", b"F0", Whole),
            ("", b"000", Strange),
        ] {
            let shown = answer.escape_ascii();
            assert_eq!(later.hear(line.as_bytes(), answer), heard, "{line} {shown}");
        }
        assert_eq!(old.hear(b"@0P\r", b"0"), Perhaps);
    }
}
