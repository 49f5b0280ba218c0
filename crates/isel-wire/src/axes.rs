//! Sets of axes, as the controllers number them: bit 0 is X, 1 Y, 2 Z, 3 A.

use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The letters of the axes, by index.
pub(crate) const LETTERS: [char; 4] = ['X', 'Y', 'Z', 'A'];

/// A set of the four axes.
///
/// Axes are counted X = 0, Y = 1, Z = 2, A = 3, which is also their bit in commands such as
/// `@0R7` (99 §2.2.1).
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(try_from = "u8", into = "u8")]
pub struct AxisSet(u8);

/// A number that is not a set of axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{0} is not a set of axes: 0 to 15 are")]
pub struct NoAxisSet(pub u8);

impl AxisSet {
    /// No axis: a controller after power-on.
    pub const NONE: Self = Self(0);
    /// The X axis.
    pub const X: Self = Self(1);
    /// The Y axis.
    pub const Y: Self = Self(2);
    /// The Z axis.
    pub const Z: Self = Self(4);
    /// The A axis.
    pub const A: Self = Self(8);
    /// All four.
    pub const ALL: Self = Self(15);

    /// The set with these bits; `None` above 15.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Option<Self> {
        if bits <= Self::ALL.0 { Some(Self(bits)) } else { None }
    }

    /// The axis with this index (0 X … 3 A) alone; nothing above 3.
    #[must_use]
    pub const fn of(axis: usize) -> Self {
        if axis < 4 { Self(1 << axis) } else { Self::NONE }
    }

    /// The bits of the set, 0 to 15.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether every axis of `other` is in this set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether the axis with this index (0 X … 3 A) is in this set.
    #[must_use]
    pub const fn has(self, axis: usize) -> bool {
        axis < 4 && self.0 & (1 << axis) != 0
    }

    /// How many axes there are, 0 to 4.
    #[must_use]
    pub const fn count(self) -> usize {
        self.0.count_ones() as usize
    }

    /// The indices of the axes, ascending.
    pub fn iter(self) -> impl DoubleEndedIterator<Item = usize> + Clone {
        (0..4).filter(move |&axis| self.has(axis))
    }

    /// The axes of both sets.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The axes of this set that are not in the other.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether there is no axis in it.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl TryFrom<u8> for AxisSet {
    type Error = NoAxisSet;

    fn try_from(bits: u8) -> Result<Self, NoAxisSet> {
        Self::from_bits(bits).ok_or(NoAxisSet(bits))
    }
}

impl From<AxisSet> for u8 {
    fn from(axes: AxisSet) -> Self {
        axes.0
    }
}

impl fmt::Display for AxisSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("none");
        }
        for (place, axis) in self.iter().enumerate() {
            let plus = if place == 0 { "" } else { "+" };
            write!(f, "{plus}{}", LETTERS[axis])?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_bits() {
        for bits in 0..=u8::MAX {
            assert_eq!(AxisSet::from_bits(bits).map(AxisSet::bits), (bits <= 15).then_some(bits));
            assert_eq!(AxisSet::try_from(bits).is_ok(), bits <= 15);
        }
        let xz = AxisSet::X.union(AxisSet::Z);
        assert_eq!(xz.iter().collect::<Vec<_>>(), [0, 2]);
        assert_eq!((xz.count(), xz.has(2), xz.has(1), xz.has(64)), (2, true, false, false));
        assert!(xz.contains(AxisSet::Z) && xz.contains(AxisSet::NONE));
        assert!(!xz.contains(AxisSet::ALL) && !xz.is_empty() && AxisSet::NONE.is_empty());
    }

    #[test]
    fn sets_have_names() {
        for (bits, name) in [(0, "none"), (1, "X"), (3, "X+Y"), (8, "A"), (15, "X+Y+Z+A")] {
            assert_eq!(AxisSet(bits).to_string(), name);
        }
    }
}
