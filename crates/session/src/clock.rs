//! Whose time the device lives in.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use thiserror::Error;

/// How model time relates to the time on the wall.
///
/// ```
/// use vimc4_session::{Clock, Rate};
///
/// assert_eq!("real".parse(), Ok(Clock::Real));
/// assert_eq!("8x".parse(), Ok(Clock::Scaled(Rate::new(8, 1).unwrap())));
/// assert_eq!("0.5x".parse(), Ok(Clock::Scaled(Rate::new(1, 2).unwrap())));
/// assert!("fast".parse::<Clock>().is_err());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// Model time is wall time. A late wake-up shifts nothing, because outputs carry the time at
    /// which they happened in the model; a suspended computer suspends the device with it.
    #[default]
    Real,
    /// Model time runs faster or slower than wall time.
    Scaled(Rate),
    /// Model time stands still while there is something to read and jumps to the next deadline
    /// when there is not, so a ten-minute job is done in milliseconds with the same bytes.
    Instant,
    /// Model time moves only when told, so a test can stop a motion at exactly step 2,500.
    Manual,
}

impl Clock {
    /// The rate of a clock that runs by itself.
    pub fn rate(self) -> Option<Rate> {
        match self {
            Clock::Real => Some(Rate { model: 1, wall: 1 }),
            Clock::Scaled(rate) => Some(rate),
            Clock::Instant | Clock::Manual => None,
        }
    }
}

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Clock::Real => f.write_str("real"),
            Clock::Scaled(rate) => rate.fmt(f),
            Clock::Instant => f.write_str("instant"),
            Clock::Manual => f.write_str("manual"),
        }
    }
}

impl FromStr for Clock {
    type Err = ClockError;

    fn from_str(text: &str) -> Result<Clock, ClockError> {
        match text {
            "real" => Ok(Clock::Real),
            "instant" => Ok(Clock::Instant),
            "manual" => Ok(Clock::Manual),
            _ => text
                .strip_suffix('x')
                .and_then(Rate::parse)
                .map(Clock::Scaled)
                .ok_or_else(|| ClockError(text.to_owned())),
        }
    }
}

/// A word that names no clock.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{0}` is not a clock; use manual, instant, {speeds}", speeds = ClockError::SPEEDS)]
pub struct ClockError(String);

impl ClockError {
    /// The clocks that run by themselves, for people.
    pub const SPEEDS: &str = "real, or a factor from 0.001x to 1000000x such as 8x or 0.5x";
}

/// Model time per wall time, as an exact fraction: rounding a factor such as 0.1 would make the
/// times of a long run depend on the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    model: u64,
    wall: u64,
}

impl Rate {
    /// `model` seconds in the device for every `wall` seconds outside; `None` if the factor is
    /// not between a thousandth and a million.
    #[must_use]
    pub fn new(model: u64, wall: u64) -> Option<Rate> {
        let (m, w) = (u128::from(model), u128::from(wall));
        if m == 0 || w == 0 || m * 1_000 < w || m > w * 1_000_000 {
            return None;
        }
        let divisor = gcd(model, wall);
        Some(Rate { model: model / divisor, wall: wall / divisor })
    }

    /// Reads a decimal factor with up to nine places.
    fn parse(text: &str) -> Option<Rate> {
        let (whole, places) = text.split_once('.').unwrap_or((text, ""));
        let digits = |part: &str| part.bytes().all(|b| b.is_ascii_digit());
        if whole.is_empty() || !digits(whole) || !digits(places) || places.len() > 9 {
            return None;
        }
        if text.ends_with('.') {
            return None;
        }
        let wall = 10_u64.pow(u32::try_from(places.len()).ok()?);
        let fraction = if places.is_empty() { 0 } else { places.parse::<u64>().ok()? };
        Rate::new(whole.parse::<u64>().ok()?.checked_mul(wall)?.checked_add(fraction)?, wall)
    }

    /// How much model time passes in `wall`.
    #[must_use]
    pub fn model(self, wall: Duration) -> Duration {
        nanos(wall.as_nanos().saturating_mul(u128::from(self.model)) / u128::from(self.wall))
    }

    /// How long to wait until `model` has passed, rounded up: waking too early would be in vain.
    #[must_use]
    pub fn wall(self, model: Duration) -> Duration {
        let wide = model.as_nanos().saturating_mul(u128::from(self.wall));
        nanos(wide.div_ceil(u128::from(self.model)))
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x", self.model as f64 / self.wall as f64)
    }
}

fn nanos(value: u128) -> Duration {
    Duration::from_nanos(u64::try_from(value).unwrap_or(u64::MAX))
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_exact_fractions() {
        let tenth: Clock = "0.1x".parse().unwrap();
        assert_eq!(tenth, Clock::Scaled(Rate::new(1, 10).unwrap()));
        assert_eq!(tenth.to_string(), "0.1x");
        assert_eq!("2.50x".parse(), Ok(Clock::Scaled(Rate::new(5, 2).unwrap())));
        let rate = Rate::new(1, 3).unwrap();
        assert_eq!(rate.model(Duration::from_nanos(9)), Duration::from_nanos(3));
        assert_eq!(rate.wall(Duration::from_nanos(3)), Duration::from_nanos(9));
    }

    #[test]
    fn waiting_is_rounded_up_so_that_nobody_wakes_too_early() {
        for (model, wall) in [(8, 1), (3, 7), (1_000, 999), (1, 1)] {
            let rate = Rate::new(model, wall).unwrap();
            for span in [1, 2, 3, 10, 520_834, 1_000_000_007] {
                let span = Duration::from_nanos(span);
                assert!(rate.model(rate.wall(span)) >= span, "{rate} {span:?}");
            }
        }
    }

    #[test]
    fn what_is_no_factor_is_refused_with_the_remedy() {
        for text in [
            "",
            "x",
            "0x",
            "-1x",
            "1.x",
            ".5x",
            "1e3x",
            "8",
            "0.0001x",
            "1000001x",
            "nanx",
            "99999999999999999999x",
            "0.1234567891x",
            "Real",
        ] {
            let error = text.parse::<Clock>().unwrap_err();
            assert!(error.to_string().contains("such as 8x"), "{text}: {error}");
        }
    }
}
