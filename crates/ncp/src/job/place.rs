//! Where the tool is: the exact places of the file, and the counters they are rounded to.

use super::target::Target;
use crate::geometry::Steps;
use crate::language::Value;

/// A place: X, Y, Z and A in machine coordinates, in thousandths of a µm or of an arc second.
pub(super) type Place = [Value; 4];

/// A cylinder unrolled by a rotary axis: a linear axis of the file stands for its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cylinder {
    /// The turning axis.
    pub(super) turning: usize,
    /// The linear axis that it replaces.
    pub(super) linear: usize,
    /// The radius, more than 0.
    pub(super) radius: Value,
    /// Where the linear axis stood at the beginning; it stays there.
    pub(super) from: Value,
}

/// Thousandths of an arc second in a radian: 1,296,000,000 / 2π.
const RADIAN: f64 = 206_264_806.247_096_36;

impl Cylinder {
    /// The angle of the rotary axis, in thousandths of an arc second from its first place, when the
    /// tool is at `surface`.
    fn turned(&self, surface: Value) -> f64 {
        let way = surface.in_thousandths() - self.from.in_thousandths();
        way as f64 / self.radius.in_thousandths() as f64 * RADIAN
    }

    /// Where the axes really are when the tool is at a place on the surface. The angle is rounded
    /// to a [`Value`].
    pub(super) fn unrolled(&self, place: &Place) -> Place {
        let mut real = *place;
        let turned = libm::round(self.turned(place[self.linear])) as i64;
        let angle = place[self.turning].in_thousandths().saturating_add(turned);
        real[self.turning] = Value::thousandths(angle);
        real[self.linear] = self.from;
        real
    }
}

/// The way between two places: its length, and its steps before rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Way {
    /// In thousandths of a µm; of an arc second where only turning axes move.
    pub(super) length: f64,
    pub(super) steps: [f64; 4],
}

impl Way {
    /// The way from one place to another.
    pub(super) fn between(
        from: &Place,
        to: &Place,
        target: &Target,
        cylinder: Option<&Cylinder>,
    ) -> Way {
        let (mut squares, mut turned) = (0.0, 0.0);
        let mut steps = [0.0; 4];
        for axis in 0..4 {
            let way = to[axis].in_thousandths().saturating_sub(from[axis].in_thousandths());
            if way == 0 {
                continue;
            }
            let (per_axis, way) = (target.scales[axis], way as f64);
            match cylinder.filter(|cylinder| cylinder.linear == axis) {
                Some(cylinder) => {
                    let angle = way / cylinder.radius.in_thousandths() as f64 * RADIAN;
                    steps[cylinder.turning] += angle / target.scales[cylinder.turning].step();
                    squares += way * way;
                }
                None if target.rotary.has(axis) => {
                    steps[axis] += way / per_axis.step();
                    turned += way * way;
                }
                None => {
                    steps[axis] = way / per_axis.step();
                    squares += way * way;
                }
            }
        }
        let length = libm::sqrt(if squares > 0.0 { squares } else { turned });
        Way { length, steps }
    }

    /// The frequency of the longest of X, Y and Z, and that of A, in Hz, if the way is made at a
    /// speed in thousandths a second.
    pub(super) fn frequencies(&self, velocity: Value) -> (f64, f64) {
        let [x, y, z, a] = self.steps.map(libm::fabs);
        let rate = velocity.in_thousandths() as f64 / self.length;
        (x.max(y).max(z) * rate, a * rate)
    }
}

/// The counters at a place.
pub(super) fn counters(place: &Place, target: &Target, cylinder: Option<&Cylinder>) -> Steps {
    let mut steps = target.round(place);
    if let Some(cylinder) = cylinder {
        let turning = cylinder.turning;
        let scale = target.scales[turning];
        let turned = cylinder.turned(place[cylinder.linear]) / scale.step();
        steps[turning] = libm::round(scale.exact(place[turning]) + turned) as i64;
        steps[cylinder.linear] = target.scales[cylinder.linear].round(cylinder.from);
    }
    steps
}
