//! How far the axes go from where they were.

use vimc4_device::{AXES, Motion, Point, Time};

/// The way of the axes since the beginning, in steps, as the motor windings see it: setting a
/// counter changes nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Travel {
    /// The lowest place of each axis, 0 or less.
    pub low: Point,
    /// The highest place of each axis, 0 or more. A way that was begun counts whole even if it was
    /// stopped, because what stops it may fail.
    pub high: Point,
    /// The highest step frequency, Hz.
    pub top: u64,
    /// Where the last motion that has ended ended.
    place: Point,
    running: Option<(Time, Box<vimc4_device::Segment>)>,
}

impl Travel {
    /// Takes note of a motion.
    pub fn watch(&mut self, at: Time, motion: &Motion) {
        match motion {
            Motion::Begins { segment, .. } => {
                let (low, high) = segment.path.extent(segment.path.length());
                for axis in 0..self.place.len() {
                    self.low[axis] = self.low[axis].min(self.place[axis] + low[axis]);
                    self.high[axis] = self.high[axis].max(self.place[axis] + high[axis]);
                }
                // A motion that runs to its end is fastest in its middle.
                let middle = segment.profile.speed_at(segment.profile.duration() / 2);
                self.top = self.top.max(middle.div_ceil(1_000_000));
                self.running = Some((at, segment.clone()));
            }
            Motion::Changes { segment } => {
                if let Some((_, running)) = &mut self.running {
                    *running = segment.clone();
                }
            }
            Motion::Ends { steps } => {
                if let Some((_, segment)) = self.running.take() {
                    self.place = sum(self.place, segment.path.at(*steps));
                }
            }
        }
    }

    /// Where the axes are, seen from where they began.
    #[must_use]
    pub fn place(&self, now: Time) -> Point {
        match &self.running {
            None => self.place,
            Some((began, segment)) => sum(self.place, segment.offset_at(now.nanos_since(*began))),
        }
    }

    /// Whether anything has moved.
    #[must_use]
    pub fn is_nothing(&self) -> bool {
        self.low == [0; AXES] && self.high == [0; AXES]
    }

    /// Merges another travel from the same beginning.
    pub fn include(&mut self, other: &Travel) {
        for axis in 0..self.low.len() {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
        self.top = self.top.max(other.top);
    }
}

fn sum(a: Point, b: Point) -> Point {
    std::array::from_fn(|axis| a[axis] + b[axis])
}
