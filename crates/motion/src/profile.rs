//! When step `k` happens: constant speed, ramps, braking.

use serde::{Deserialize, Serialize};

/// The two values every ramp is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Ramp {
    /// Start-stop frequency in Hz: up to here motors start and stop without a ramp.
    pub start_stop: u32,
    /// Acceleration in Hz/ms.
    pub acceleration: u32,
}

/// The times of the steps of one motion, from its start to its halt.
///
/// Speeds up to the start-stop frequency run constantly. Above, the frequency rises from the
/// start-stop frequency to the speed and falls again to it at the end; a short motion is a
/// triangle. Step `k` happens at the first nanosecond at which the integral of the frequency
/// has reached `k`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Profile {
    // the helper may reshape this private part
    steps: u64,
    speed: u32,
    ramp: Ramp,
    /// When braking began, nanoseconds after the start; `None` while the motion runs its course.
    braked_at: Option<u64>,
}

impl Profile {
    /// `steps` steps at `speed` Hz (1 to 1,000,000) with ramps.
    #[must_use]
    pub fn new(_steps: u64, _speed: u32, _ramp: Ramp) -> Profile {
        todo!()
    }

    /// `steps` steps at exactly `speed` Hz from first to last, without ramps.
    #[must_use]
    pub fn constant(_steps: u64, _speed: u32) -> Profile {
        todo!()
    }

    /// How many steps are made until the motion has halted.
    #[must_use]
    pub fn steps(&self) -> u64 {
        todo!()
    }

    /// Nanoseconds from the start to the last step; 0 for no steps. Saturates at `u64::MAX`.
    #[must_use]
    pub fn duration(&self) -> u64 {
        todo!()
    }

    /// How many steps have been made `nanos` nanoseconds after the start, that instant included.
    #[must_use]
    pub fn steps_at(&self, _nanos: u64) -> u64 {
        todo!()
    }

    /// Nanoseconds from the start to step `k` (1 to `steps()`); 0 for `k` = 0. Saturates at
    /// `u64::MAX`.
    #[must_use]
    pub fn time_of(&self, _k: u64) -> u64 {
        todo!()
    }

    /// The step frequency in µHz `nanos` nanoseconds after the start, rounded down; 0 from the
    /// last step on.
    #[must_use]
    pub fn speed_at(&self, _nanos: u64) -> u64 {
        todo!()
    }

    /// The same motion braked along the ramp from `nanos` on: it halts on the last whole step
    /// within the way that braking from the present speed down to the start-stop frequency
    /// takes; at or below that frequency it halts where it is. The steps up to `nanos` keep
    /// their times.
    ///
    /// `None` if the motion ends by itself at least as early: no fewer steps remain than
    /// braking takes, so braking changes nothing.
    #[must_use]
    pub fn brake(&self, _nanos: u64) -> Option<Profile> {
        todo!()
    }

    /// The times of steps 1, 2, 3 … stepwise, straight from the definition.
    #[must_use]
    pub fn times(&self) -> ProfileTimes {
        todo!()
    }
}

/// Iterator over the times of a profile's steps. See [`Profile::times`].
#[derive(Clone, Debug)]
pub struct ProfileTimes {}

impl Iterator for ProfileTimes {
    type Item = u64;

    fn next(&mut self) -> Option<u64> {
        todo!()
    }
}
