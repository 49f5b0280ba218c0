//! Numbers as job files have them.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A length in nm, an angle in thousandths of an arc second, a time in µs, or any other number of
/// a job file in thousandths: what the file says, exactly.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Value(i64);

impl Value {
    /// Nothing.
    pub const ZERO: Value = Value(0);
    /// The largest magnitude a file can give, 10⁹ units: a kilometre, 772 turns.
    pub const MOST: Value = Value(1_000_000_000_000);

    /// This many whole units: µm, arc seconds, ms.
    #[must_use]
    pub const fn whole(units: i64) -> Value {
        Value(units * 1_000)
    }

    /// This many thousandths of a unit.
    #[must_use]
    pub const fn thousandths(thousandths: i64) -> Value {
        Value(thousandths)
    }

    /// In thousandths of a unit.
    #[must_use]
    pub const fn in_thousandths(self) -> i64 {
        self.0
    }

    /// A multiple of it; `None` beyond [`Value::MOST`].
    #[must_use]
    pub fn times(self, factor: i64) -> Option<Value> {
        let product = self.0.checked_mul(factor)?;
        (product.unsigned_abs() <= Value::MOST.0.unsigned_abs()).then_some(Value(product))
    }

    /// In units.
    #[must_use]
    pub fn as_f64(self) -> f64 {
        self.0 as f64 / 1_000.0
    }
}

/// As a file has it: `-2500`, `12.5`.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (whole, rest) = (self.0.unsigned_abs() / 1_000, self.0.unsigned_abs() % 1_000);
        let sign = if self.0 < 0 { "-" } else { "" };
        if rest == 0 {
            return write!(f, "{sign}{whole}");
        }
        write!(f, "{sign}{whole}.{}", format!("{rest:03}").trim_end_matches('0'))
    }
}

/// Why a text is not a [`Value`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this is not a number with three decimal places at most")]
pub struct NotAValue;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_print_as_files_have_them() {
        for (thousandths, text) in
            [(0, "0"), (-2_500_000, "-2500"), (12_500, "12.5"), (-1, "-0.001"), (70, "0.07")]
        {
            assert_eq!(Value::thousandths(thousandths).to_string(), text);
        }
    }
}
