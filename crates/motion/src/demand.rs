//! What a motion demands of the motors, and where it overloads one.
//!
//! A motion consists of phases in which the step frequency only rises, only falls or stays, and the
//! acceleration is always the same. So of a motor that pulls less the faster it turns, the first
//! step that it does not make is found with one search in each phase.

use crate::Segment;
use crate::phase::{Share, Trend};

/// µHz in a Hz.
const MICRO: u128 = 1_000_000;
/// Hz/s in a Hz/ms.
const PER_SECOND: u64 = 1_000;

/// The limits of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pull<'a> {
    /// Up to which acceleration in Hz/ms it follows at a frequency in Hz: ascending frequencies, and
    /// accelerations that do not ascend. Between two of them the acceleration is on the line from
    /// one to the other, below the first it is that of the first, and above the last there is none.
    /// Without any it follows everything.
    pub curve: &'a [(u32, u32)],
    /// The highest frequency in Hz with which it can start.
    pub start: Option<u32>,
    /// Its extra load, as the acceleration in Hz/ms that would load it as much. It helps braking.
    pub load: u32,
}

impl Pull<'_> {
    /// The highest frequency at which it pulls what an acceleration in Hz/s asks for, µHz; `None` if
    /// there is none.
    fn highest(&self, need: u128) -> Option<u128> {
        let in_micro = |&(frequency, pull): &(u32, u32)| {
            (u128::from(frequency) * MICRO, u128::from(pull) * u128::from(PER_SECOND))
        };
        let able = self.curve.partition_point(|point| in_micro(point).1 >= need);
        let (low, pull) = in_micro(self.curve.get(able.checked_sub(1)?)?);
        Some(self.curve.get(able).map(in_micro).map_or(low, |(high, less)| {
            // It falls from a pull that is enough to one that is not.
            low + (high - low) * (pull - need) / (pull - less).max(1)
        }))
    }
}

impl Segment {
    /// After how many clock steps, at least `from`, an axis overloads its motor; `None` if it never
    /// does.
    #[must_use]
    pub fn exceeds(&self, axis: usize, from: u64, pull: &Pull<'_>) -> Option<u64> {
        let Segment { path, profile } = self;
        let shares = path.shares(axis);
        let frequency = |step: u64| u128::from(profile.speed_at(profile.time_of(step)));
        if let (0, Some(start), Some(first)) = (from, pull.start, shares.first())
            && frequency(0) * u128::from(first.steps)
                > u128::from(start) * MICRO * u128::from(first.of)
        {
            return Some(0);
        }
        if pull.curve.is_empty() {
            return None;
        }
        let mut begin = from;
        for phase in profile.phases() {
            for &Share { to, steps, of } in &shares {
                let end = phase.to.min(to);
                if end <= begin || steps == 0 {
                    begin = begin.max(end);
                    continue;
                }
                let own = phase.acceleration * u128::from(steps) / u128::from(of);
                let load = u128::from(pull.load) * u128::from(PER_SECOND);
                let need = match phase.trend {
                    Trend::Rises | Trend::Stays => own + load,
                    Trend::Falls => own.saturating_sub(load),
                };
                let highest = pull.highest(need);
                // Compared as products, for a share is not a whole number.
                let is_too_much = |step: u64| {
                    let asked = frequency(step) * u128::from(steps);
                    highest.is_none_or(|highest| asked > highest * u128::from(of))
                };
                // The first step begins in the phase before; the trend is that of the others.
                let last = end - 1;
                let second = last.min(begin + 1);
                for step in [begin, second] {
                    if is_too_much(step) {
                        return Some(step);
                    }
                }
                if phase.trend != Trend::Falls && is_too_much(last) {
                    return Some(first(second, last, is_too_much));
                }
                begin = end;
            }
        }
        None
    }
}

/// The first number for which a condition holds that does not hold at `low` and does at `high`.
fn first(mut low: u64, mut high: u64, is_so: impl Fn(u64) -> bool) -> u64 {
    while high - low > 1 {
        let between = u64::midpoint(low, high);
        if is_so(between) {
            high = between;
        } else {
            low = between;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_straight_between_its_points() {
        let pull = Pull { curve: &[(1_000, 400), (5_000, 200), (9_000, 0)], start: None, load: 0 };
        let highest = |need: u128| pull.highest(need * 1_000).map(|hertz| hertz / MICRO);
        assert_eq!(highest(401), None);
        assert_eq!(highest(400), Some(1_000));
        assert_eq!(highest(300), Some(3_000));
        assert_eq!(highest(200), Some(5_000));
        assert_eq!(highest(50), Some(8_000));
        assert_eq!(highest(0), Some(9_000));
    }
}
