//! What a line may do, with any parameters.

use vimc4_device::{Effects, Travel};
use vimc4_isel_wire::control;

use super::answers::{is_question, letter};
use crate::model::Model;
use crate::wiring::{Output, Wire};

/// What sending these bytes may do.
pub(super) fn of(sent: &[u8]) -> Effects {
    let mut effects = Effects::default();
    let mut storing = false;
    // What a controller ignores in a line has no effect.
    let is_heard = |byte: &u8| !matches!(byte, b' ' | b'\n') && control(*byte).is_none();
    let heard: Vec<u8> = sent.iter().copied().filter(is_heard).collect();
    for line in heard.split(|&byte| byte == b'\r') {
        add(&mut effects, line, &mut storing);
    }
    effects
}

/// Adds those of one line, which is given without its blanks.
fn add(effects: &mut Effects, line: &[u8], storing: &mut bool) {
    match line {
        [b'@', _, letter, rest @ ..] => {
            let setting = (*letter == b'I').then(|| rest.first().copied()).flatten();
            effects.moves |= b"AaMmRrSsywZF?".contains(letter);
            effects.reference |= b"RrF".contains(letter);
            effects.starts |= b"Ss".contains(letter);
            effects.outputs |= b"Bg".contains(letter) || matches!(setting, Some(b'a' | b'S'));
            effects.writes_flash |= b"ik".contains(letter) || setting == Some(b'W');
            effects.switches |= setting.is_some_and(|code| b"EeDR".contains(&code));
            *storing |= *letter == b'i';
        }
        // A stored line does nothing before the program is started.
        [code, ..] if *storing => {
            effects.reference |= *code == b'7';
            effects.outputs |= matches!(code, b'p' | b'g');
        }
        _ => {}
    }
}

/// What setting the signal of that name may do.
pub(super) fn of_signal(name: &str) -> Effects {
    Effects {
        moves: name == "start",
        // Held with STOP, ON erases.
        writes_flash: name == "on",
        ..Effects::default()
    }
}

/// The lasting effect of a command.
pub(super) fn travel_of(command: &[u8]) -> Travel {
    match letter(command) {
        Some(b'A' | b'a' | b'y' | b'w') => Travel::Relative,
        Some(b'M' | b'm') => Travel::Absolute,
        Some(b'R' | b'r') => Travel::Reference(number(command)),
        Some(b'S' | b's' | b'F') => Travel::Unknown,
        Some(letter) if is_question(letter) => Travel::Question,
        _ => Travel::None,
    }
}

/// Whether a command switches the spindle on or off, if it does either.
pub(super) fn spindle_after(model: &Model, command: &[u8]) -> Option<bool> {
    letter(command).filter(|letter| *letter == b'B')?;
    let text = std::str::from_utf8(command).ok()?.replace([' ', '\r'], "");
    let (port, value) = text.split_once('B')?.1.split_once(',')?;
    let (port, value): (u16, u8) = (port.parse().ok()?, value.parse().ok()?);
    let wires = model.ports.writable(port)?;
    let bit = wires.iter().position(|wire| *wire == Wire::Output(Output::SPINDLE))?;
    Some(if wires.len() == 1 { value != 0 } else { value >> bit & 1 == 1 })
}

/// The number behind the letter of a command.
fn number(command: &[u8]) -> u8 {
    let behind = command.iter().skip_while(|byte| !byte.is_ascii_alphabetic()).skip(1);
    let digits = behind.filter(|byte| byte.is_ascii_digit());
    digits.fold(0, |number: u8, digit| number.saturating_mul(10).saturating_add(digit - b'0'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_follow_from_the_lines() {
        let of = |text: &str| super::of(text.as_bytes());
        assert!(of("@0 A5,900\r").moves);
        assert!(!of("@0P\r").moves);
        assert!(of("@0i\r").writes_flash);
        assert!(super::of(b"@0\x20I\n\xFDW\r").writes_flash);
        assert!(of("@0B0,8\r").outputs && !of("@0b0\r").outputs);
        assert!(of("@0r1\r").reference && of("@0r1\r").moves);
        assert!(!of("77\r").reference);
        let stored = of("@0i\r7 7\rp0,1,1\r@0Ie1");
        assert!(stored.reference && stored.outputs && stored.switches && !stored.moves);
    }

    #[test]
    fn what_lasts_follows_from_the_letter() {
        let of = |text: &str| travel_of(text.as_bytes());
        assert_eq!(of("@0A5,900\r"), Travel::Relative);
        assert_eq!(of("@ 0m5,900\r"), Travel::Absolute);
        assert_eq!(of("@0R7\r"), Travel::Reference(7));
        assert_eq!(of("@0 r 1 5\r"), Travel::Reference(15));
        assert_eq!(of("@0S\r"), Travel::Unknown);
        assert_eq!(of("@0P\r"), Travel::Question);
        assert_eq!(of("@0k\r"), Travel::None);
        assert_eq!(of("77\r"), Travel::None);
    }
}
