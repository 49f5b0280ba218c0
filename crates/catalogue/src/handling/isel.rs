//! What a client knows of isel's controllers.

use std::time::Duration;

use vimc4_device::Point;
use vimc4_isel::PositionAxes;

use super::{Effects, Handling};
use crate::Model;

/// A control code ends what was begun, or is none of it.
const ENDS: &[u8] = b"\r\xFD\xFE\xFF";

const FILL: &[&str] = &[
    "@07",
    "@0i",
    "040,400,40,400,0,400,0,400",
    "9",
    "@0Ij500",
    "@0IJ20",
    "@0Id700,700,700,700",
    "@0IF3,3,3,3",
    "@0IUthe owner's",
    "@0IW",
];

pub(super) fn handling(model: Model, inner: &vimc4_isel::Model) -> Handling {
    Handling {
        model,
        ends: ENDS,
        instead_of_line_feed: Some((
            ENDS,
            "CR does: printf '@07\\r', or in socat crnl behind the address, as in \
             ./vimc4.pty,rawer,crnl",
        )),
        halt: &[253],
        halting: "253 was sent, so that a motion brakes along its ramp: 254 or switching off makes \
                  the controller forget the rest of it",
        warning: "Ctrl-C halts a motion along its ramp and ends this.",
        abandon: &[255],
        reset: &[254],
        ready: &[],
        homing: None,
        boot: Duration::from_millis(inner.timing.boot_ms),
        running: Duration::ZERO,
        position: "@0P",
        names: &["@0V", "@0?", "@0U"],
        done: b"0",
        speeds: &[19_200, 9_600, 38_400],
        erase: &["@0k", "@0IX", "@0IW"],
        fill: FILL,
        start_resumes: inner.quirks.start_resumes_dnc,
        start: &["@07", "@0S"],
    }
}

pub(super) fn read_position(model: &vimc4_isel::Model, answer: &[u8]) -> Option<Vec<i64>> {
    let fewest = match model.quirks.position_axes {
        PositionAxes::Three => 3,
        PositionAxes::Configured => 0,
    };
    let digits = std::str::from_utf8(answer.strip_prefix(b"0")?).ok()?;
    let hex = |digit: u8| digit.is_ascii_digit() || (b'A'..=b'F').contains(&digit);
    let is_whole = digits.len().is_multiple_of(6) && (fewest..=4).contains(&(digits.len() / 6));
    if !is_whole || !digits.bytes().all(hex) {
        return None;
    }
    let place = |at: usize| {
        let value = i64::from_str_radix(digits.get(at..at + 6)?, 16).ok()?;
        Some(if value < 1 << 23 { value } else { value - (1 << 24) })
    };
    (0..digits.len()).step_by(6).map(place).collect()
}

pub(super) fn moving(by: Point, speed: u64) -> Vec<String> {
    let [x, y, z, a, ..] = by;
    let mut lines = vec!["@07".to_owned()];
    if a != 0 {
        lines.push("@08".to_owned());
    }
    // With three axes the fourth way is the second of Z, and nothing.
    lines.push(format!("@0A{x},{speed},{y},{speed},{z},{speed},{a},{speed}"));
    lines
}

pub(super) fn effects_of(sent: &[u8]) -> Effects {
    let mut effects = Effects::default();
    let mut storing = false;
    // What a controller leaves out of a line is not in it.
    let heard: Vec<u8> =
        sent.iter().copied().filter(|byte| !matches!(byte, b' ' | b'\n' | 253..=255)).collect();
    for line in heard.split(|&byte| byte == b'\r') {
        effects.of_line(line, &mut storing);
    }
    effects
}

impl Effects {
    /// Adds those of one line, which is given without its blanks.
    fn of_line(&mut self, line: &[u8], storing: &mut bool) {
        match line {
            [b'@', _, letter, rest @ ..] => {
                let setting = (*letter == b'I').then(|| rest.first().copied()).flatten();
                self.moves |= b"AaMmRrSsywZF?".contains(letter);
                self.reference |= b"RrF".contains(letter);
                self.starts |= b"Ss".contains(letter);
                self.outputs |= b"Bg".contains(letter) || matches!(setting, Some(b'a' | b'S'));
                self.writes_flash |= b"ik".contains(letter) || setting == Some(b'W');
                self.switches |= setting.is_some_and(|code| b"EeDR".contains(&code));
                *storing |= *letter == b'i';
            }
            // A stored line does nothing before the program is started.
            [code, ..] if *storing => {
                self.reference |= *code == b'7';
                self.outputs |= matches!(code, b'p' | b'g');
            }
            _ => {}
        }
    }
}

pub(super) fn effects_of_signal(name: &str) -> Effects {
    Effects {
        moves: name == "start",
        // Held with STOP, ON erases.
        writes_flash: name == "on",
        ..Effects::default()
    }
}

/// A text reply ends with its code, every other begins with it.
pub(super) fn kind_of(answer: &[u8]) -> Option<String> {
    let code = if answer.ends_with(b"\r\n0") { b'0' } else { *answer.first()? };
    Some(char::from(code).to_string())
}

pub(super) fn refusal(answer: &[u8]) -> Option<String> {
    let code = match answer {
        [b'0'] => return None,
        [code @ b'F', ..] | [code] => char::from(*code),
        _ => return None,
    };
    let meaning = match code {
        '1' => "a number that is unreadable or out of range",
        '2' => "limit switch",
        '3' => "an axis that is not configured, or not possible",
        '4' => "no axes configured",
        '5' => "unknown or malformed command",
        '6' => "program memory full",
        '7' => "wrong number of parameters",
        '8' => "not a command that can be stored",
        '9' => "the plant is not ready",
        'D' => "a speed out of range",
        'F' => "stopped by the user",
        'G' => "invalid data field",
        'H' => "the cover is open",
        'R' => "a reference run is needed",
        _ => return Some(vimc4_device::escape(code.to_string().as_bytes())),
    };
    Some(format!("{code}: {meaning}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_read_as_they_are_answered() {
        let model = |name| vimc4_isel::Model::builtin(name).unwrap();
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
        // Axes that are not configured are told of by one, and not by the other.
        for (answer, places) in
            [(&b"0"[..], vec![]), (b"0000064", vec![100]), (b"0000064FFFFFF", vec![100, -1])]
        {
            assert_eq!(read_position(&later, answer), None);
            assert_eq!(read_position(&old, answer), Some(places));
        }
    }

    #[test]
    fn effects_follow_from_the_lines() {
        let of = |text: &str| effects_of(text.as_bytes());
        assert!(of("@0 A5,900\r").moves);
        assert!(!of("@0P\r").moves);
        assert!(of("@0i\r").writes_flash);
        assert!(effects_of(b"@0\x20I\n\xFDW\r").writes_flash);
        assert!(of("@0B0,8\r").outputs && !of("@0b0\r").outputs);
        assert!(of("@0r1\r").reference && of("@0r1\r").moves);
        assert!(!of("77\r").reference);
        let stored = of("@0i\r7 7\rp0,1,1\r@0Ie1");
        assert!(stored.reference && stored.outputs && stored.switches && !stored.moves);
    }

    #[test]
    fn an_answer_says_what_is_wrong() {
        assert_eq!(refusal(b"0"), None);
        assert_eq!(refusal(b"0000FA0000000000000"), None);
        assert_eq!(refusal(b"5").unwrap(), "5: unknown or malformed command");
        assert_eq!(refusal(b"F0").unwrap(), "F: stopped by the user");
        assert_eq!(kind_of(b"one\r\ntwo\r\n0").unwrap(), "0");
    }
}
