//! Work-piece zeros from outside: from the command line, or from the machine's profile.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use vimc4_plant::{JobZero, Machine};

use crate::language::{LETTERS, Value};

/// A work-piece zero: machine coordinates in thousandths of a µm or of an arc second. An axis that
/// has none keeps the one it has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Zero(pub [Option<Value>; 4]);

/// Why a text is not a work-piece zero.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoZero {
    /// A coordinate is not a number.
    #[error("{text:?} is not a coordinate of {axis}; 100000 is, in µm, and 100mm")]
    NotANumber {
        /// The axis.
        axis: char,
        /// The text.
        text: String,
    },
    /// There are more coordinates than axes.
    #[error("there are four axes at most: X,Y,Z,A")]
    TooMany,
    /// Something else than a register before the equals sign.
    #[error("{0:?} is not a register; 1 to 8 are, as in 1=100000,50000,-20000")]
    NoRegister(String),
    /// A register with nothing to put in it.
    #[error("register {0} is given nothing; write {0}=100000,50000,-20000")]
    NothingForRegister(u8),
}

impl Zero {
    /// The zero of a machine's profile.
    pub(super) fn of(zero: &JobZero) -> Zero {
        let axes = [zero.x, zero.y, zero.z, zero.a];
        Zero(axes.map(|coordinate| coordinate.map(|units| Value::whole(units.into()))))
    }

    /// Whether it names no axis.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }

    /// This one, and where it names no axis, the other.
    #[must_use]
    pub fn or(self, other: Zero) -> Zero {
        let mut both = self;
        for (own, other) in both.0.iter_mut().zip(other.0) {
            *own = own.or(other);
        }
        both
    }

    /// The first axis that it names and the machine lacks.
    #[must_use]
    pub fn beyond(&self, machine: &Machine) -> Option<char> {
        let named = |axis: &usize| self.0.get(*axis).is_some_and(Option::is_some);
        let axis = (0..4).filter(named).find(|axis| !machine.fits(*axis))?;
        LETTERS.get(axis).copied()
    }
}

/// Coordinates of X, Y, Z and A with commas between them: `100000,50000,-20000`, in µm, A in arc
/// seconds, or with a unit, `100mm,50mm,-20mm`. An axis may be left out: `,,-20mm`.
impl FromStr for Zero {
    type Err = NoZero;

    fn from_str(text: &str) -> Result<Zero, NoZero> {
        let mut zero = Zero::default();
        let mut axes = zero.0.iter_mut().zip(LETTERS);
        for part in text.split(',').map(str::trim) {
            let (coordinate, axis) = axes.next().ok_or(NoZero::TooMany)?;
            if part.is_empty() {
                continue;
            }
            let (number, millimetres) = match part.strip_suffix("mm") {
                Some(number) if axis != 'A' => (number.trim_end(), true),
                _ => (part.strip_suffix("um").unwrap_or(part).trim_end(), false),
            };
            let value = number.parse().ok().and_then(|value: Value| match millimetres {
                true => value.times(1_000),
                false => Some(value),
            });
            let wrong = || NoZero::NotANumber { axis, text: part.to_owned() };
            *coordinate = Some(value.ok_or_else(wrong)?);
        }
        Ok(zero)
    }
}

/// As it is read: µm, and arc seconds for A.
impl fmt::Display for Zero {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let last = self.0.iter().rposition(Option::is_some).unwrap_or(0);
        for (place, value) in self.0.iter().take(last + 1).enumerate() {
            if place > 0 {
                f.write_str(",")?;
            }
            value.iter().try_for_each(|value| value.fmt(f))?;
        }
        Ok(())
    }
}

/// A register with its work-piece zero: `1=100000,50000,-20000`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Register {
    /// Its number, 1 to 8.
    pub number: u8,
    /// What is in it.
    pub zero: Zero,
}

impl FromStr for Register {
    type Err = NoZero;

    fn from_str(text: &str) -> Result<Register, NoZero> {
        let (number, zero) = text.split_once('=').unwrap_or((text, ""));
        let number = number.trim();
        let known = number.parse().ok().filter(|number| (1..=8).contains(number));
        let number = known.ok_or_else(|| NoZero::NoRegister(number.to_owned()))?;
        let zero: Zero = zero.parse()?;
        match zero.is_empty() {
            true => Err(NoZero::NothingForRegister(number)),
            false => Ok(Register { number, zero }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_are_read_as_they_are_shown() {
        for (text, shown) in [
            ("100000,50000,-20000", "100000,50000,-20000"),
            ("100mm, 50 mm,-20.5mm", "100000,50000,-20500"),
            (",,-20mm", ",,-20000"),
            ("0,0,0,3600", "0,0,0,3600"),
            ("12.5um", "12.5"),
            ("", ""),
        ] {
            let zero: Zero = text.parse().unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(zero.to_string(), shown);
            assert_eq!(shown.parse(), Ok(zero));
        }
        for text in ["x", "1;2", "1,2,3,4,5", "1m", "0,0,0,3mm", "1000000000mm", "1e5"] {
            assert!(text.parse::<Zero>().is_err(), "{text}");
        }
    }

    #[test]
    fn registers_have_numbers() {
        let zero = Zero([None, Some(Value::whole(5)), None, None]);
        assert_eq!("8=,5".parse(), Ok(Register { number: 8, zero }));
        for text in ["9=1", "0=1", "=1", "1", "1=", "1=,,", "a=1", "1=b"] {
            assert!(text.parse::<Register>().is_err(), "{text}");
        }
    }
}
