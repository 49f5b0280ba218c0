//! A path run with a profile.

use serde::{Deserialize, Serialize};

use crate::{Path, PathSteps, Point, Profile, ProfileTimes};

/// One motion from standstill to standstill: a path and the times of its steps.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Segment {
    /// Where.
    pub path: Path,
    /// When. Its number of steps is the path's length, or less if the motion is braked.
    pub profile: Profile,
}

/// One step of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The number of the clock step, from 1.
    pub number: u64,
    /// Nanoseconds since the start of the segment.
    pub nanos: u64,
    /// The offset from the segment's start after this step.
    pub offset: Point,
}

impl Segment {
    /// The offset from the start `nanos` nanoseconds after it.
    #[must_use]
    pub fn offset_at(&self, nanos: u64) -> Point {
        self.path.at(self.profile.steps_at(nanos))
    }

    /// Nanoseconds from the start to the first step at which `axis` is `offset` steps from the
    /// start; `None` if the segment halts before.
    #[must_use]
    pub fn time_at(&self, axis: usize, offset: i64) -> Option<u64> {
        let k = self.path.first_at(axis, offset)?;
        (k <= self.profile.steps()).then(|| self.profile.time_of(k))
    }

    /// Every step with its time and place, in order.
    #[must_use]
    pub fn steps(&self) -> SegmentSteps {
        SegmentSteps { number: 0, path: self.path.steps(), times: self.profile.times() }
    }
}

/// Iterator over a segment. See [`Segment::steps`].
#[derive(Clone, Debug)]
pub struct SegmentSteps {
    number: u64,
    path: PathSteps,
    times: ProfileTimes,
}

impl Iterator for SegmentSteps {
    type Item = Step;

    #[inline]
    fn next(&mut self) -> Option<Step> {
        let (nanos, offset) = (self.times.next()?, self.path.next()?);
        self.number += 1;
        Some(Step { number: self.number, nanos, offset })
    }
}
