//! How a client handles a controller besides sending it commands.

use std::time::Duration;

use vimc4_device::Point;
use vimc4_isel::Model;

/// What a client of a family of controllers knows to send when it must stop, reset, erase or
/// find one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Handling {
    /// Halts a motion along its ramp; it can be gone on with.
    pub halt: u8,
    /// Halts a motion along its ramp and forgets the rest of it.
    pub abandon: u8,
    /// Makes the controller as it is after power-on, at once, without an answer.
    pub reset: u8,
    /// How long it may be deaf after that.
    pub boot: Duration,
    /// Asks where the axes are; it is never refused at rest and changes nothing.
    pub position: &'static str,
    /// These lines erase the stored program and bring the saved settings back to the factory's.
    /// A model answers `0` to those that it has; one that has none erases at its panel only.
    pub erase: &'static [&'static str],
    /// These lines, as far as a model has them, leave a program and saved settings that differ
    /// from the factory's in what they do.
    pub fill: &'static [&'static str],
    /// This line starts the stored program on models that can do so by a command.
    pub start: &'static str,
}

const ERASE: &[&str] = &["@0k", "@0IX", "@0IW"];
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

impl Handling {
    /// How this model is handled.
    #[must_use]
    pub fn of(model: &Model) -> Handling {
        Handling {
            halt: 253,
            abandon: 255,
            reset: 254,
            boot: Duration::from_millis(model.timing.boot_ms),
            position: "@0P",
            erase: ERASE,
            fill: FILL,
            start: "@0S",
        }
    }

    /// The places in an answer to [`position`](Handling::position), X first; `None` if it is no
    /// such answer.
    #[must_use]
    pub fn read_position(&self, answer: &[u8]) -> Option<Vec<i64>> {
        let digits = std::str::from_utf8(answer.strip_prefix(b"0")?).ok()?;
        let hex = |digit: u8| digit.is_ascii_digit() || (b'A'..=b'F').contains(&digit);
        if !matches!(digits.len(), 18 | 24) || !digits.bytes().all(hex) {
            return None;
        }
        let place = |at: usize| {
            let value = i64::from_str_radix(digits.get(at..at + 6)?, 16).ok()?;
            Some(if value < 1 << 23 { value } else { value - (1 << 24) })
        };
        (0..digits.len()).step_by(6).map(place).collect()
    }

    /// The lines, each to be answered `0`, with which a controller that has just been reset
    /// moves its axes by so many steps, the fastest of them at `speed` Hz.
    #[must_use]
    pub fn moving(&self, by: Point, speed: u64) -> Vec<String> {
        let [x, y, z, a] = by;
        let mut lines = vec!["@07".to_owned()];
        if a != 0 {
            lines.push("@08".to_owned());
        }
        // With three axes the fourth way is the second of Z, and nothing.
        lines.push(format!("@0A{x},{speed},{y},{speed},{z},{speed},{a},{speed}"));
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_read_as_they_are_answered() {
        let model = Model::builtin("imc4").unwrap();
        let handling = Handling::of(&model);
        assert_eq!(
            handling.read_position(b"00003E8FFFFFF800000"),
            Some(vec![1_000, -1, -8_388_608])
        );
        assert_eq!(handling.read_position(&[b'0'; 25]), Some(vec![0; 4]));
        for wrong in [&b"0"[..], b"5", b"0000000000000000", b"00000e8FFFFFF800000", b"\xFF\x00"] {
            assert_eq!(handling.read_position(wrong), None);
        }
        // `P` of a controller in the middle of storing answers an error.
        assert_eq!(handling.read_position(b"8"), None);
    }
}
