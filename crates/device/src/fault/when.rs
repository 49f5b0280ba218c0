//! When a fault strikes.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::Condition;

/// When a fault strikes: what has to come before, and which of the opportunities it takes then.
///
/// An opportunity of a fault of the line is a byte that goes its way.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct When {
    /// What has to come before it strikes, one after the other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub after: Vec<Awaited>,
    /// The first opportunity that it takes, from 1.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub first: u64,
    /// From that one on it takes every n-th, 1 for all of them.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub every: u64,
    /// Of those it takes each with this probability.
    #[serde(default, skip_serializing_if = "Chance::is_certain")]
    pub chance: Chance,
    /// It strikes no more often than this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<u64>,
    /// It is over this long after its prerequisites have come.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lasts: Option<Duration>,
    /// It strikes while this state holds, each time it holds. A happening never holds.
    #[serde(default, rename = "while", skip_serializing_if = "Option::is_none")]
    pub during: Option<Box<Condition>>,
    /// The random seed; 0 for the number of the fault. Equal seeds strike equally.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub seed: u64,
}

fn one() -> u64 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_one(number: &u64) -> bool {
    *number == 1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_zero(number: &u64) -> bool {
    *number == 0
}

impl When {
    /// At every opportunity, until it is ended.
    pub const ALWAYS: When = When {
        after: Vec::new(),
        first: 1,
        every: 1,
        chance: Chance::CERTAIN,
        times: None,
        lasts: None,
        during: None,
        seed: 0,
    };

    /// At the first opportunity.
    #[must_use]
    pub fn once() -> When {
        When::times(1)
    }

    /// At this many first opportunities.
    #[must_use]
    pub fn times(times: u64) -> When {
        When { times: Some(times), ..When::ALWAYS }
    }

    /// The same, with one more prerequisite after those that it already has.
    #[must_use]
    pub fn after(mut self, condition: Condition) -> When {
        self.after.push(Awaited { condition, times: 1 });
        self
    }

    /// The same, while this holds, each time it holds.
    #[must_use]
    pub fn during(self, condition: Condition) -> When {
        When { during: Some(Box::new(condition)), ..self }
    }
}

/// A prerequisite.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Awaited {
    /// What. A state has come when it is so, or, where it is waited for several times, becomes so.
    pub condition: Condition,
    /// How often, from 1.
    pub times: u32,
}

/// A probability in millionths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Chance(u32);

impl Chance {
    /// Always.
    pub const CERTAIN: Chance = Chance(1_000_000);

    /// This many millionths; more than a million are certain.
    #[must_use]
    pub const fn millionths(millionths: u32) -> Chance {
        if millionths > 1_000_000 { Chance::CERTAIN } else { Chance(millionths) }
    }

    /// This many percent; more than a hundred are certain.
    #[must_use]
    pub const fn percent(percent: u32) -> Chance {
        Chance::millionths(percent.saturating_mul(10_000))
    }

    /// In millionths.
    #[must_use]
    pub const fn as_millionths(self) -> u32 {
        self.0
    }

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
    fn is_certain(&self) -> bool {
        *self >= Chance::CERTAIN
    }
}

impl Default for Chance {
    fn default() -> Chance {
        Chance::CERTAIN
    }
}
