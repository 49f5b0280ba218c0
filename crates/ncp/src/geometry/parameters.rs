//! What an arc or a helix is made from.

use super::engine::Wanted;
use super::{Circle, Scale, Speeds, Steps};
use crate::language::Value;

/// How many steps the given end may be beside the arc for the arc to lead to it. Otherwise a
/// separate line does.
const SLANT: f64 = 0.25;

/// What an arc or a helix is made from. Lengths in the world are in thousandths of a µm, and have
/// their origin where the counters have theirs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveParameters {
    /// The arc.
    pub circle: Circle,
    /// The scales of X, Y, Z and A.
    pub scales: [Scale; 4],
    /// Where the counters are: at the start of the arc, rounded.
    pub from: Steps,
    /// Where they must end.
    pub to: Steps,
    /// Where the third axis of a helix begins and ends.
    pub rise: Option<(Value, Value)>,
    /// The speed along the path, in thousandths of a µm a second.
    pub velocity: f64,
    /// What the controller takes.
    pub speeds: Speeds,
    /// Whether it has `w`.
    pub has_helix: bool,
}

impl CurveParameters {
    /// Where the third axis begins and ends, not rounded, if it is to move at all.
    pub(super) fn climb(&self) -> Option<(f64, f64)> {
        let third = self.circle.plane().third();
        let scale = self.scales[third];
        let moves = self.from[third] != self.to[third];
        self.rise.filter(|_| moves).map(|(from, to)| (scale.exact(from), scale.exact(to)))
    }

    /// The point of the plane at a part of the arc, rounded; the other axes at their end.
    pub(super) fn place(&self, fraction: f64) -> Steps {
        let (first, second) = self.circle.plane().axes();
        let [x, y] = self.circle.point(fraction);
        let mut place = self.to;
        place[first] = self.scales[first].round_f64(x);
        place[second] = self.scales[second].round_f64(y);
        place
    }

    /// Where the arc itself is to end.
    pub(super) fn landing(&self) -> Steps {
        if self.circle.end_beside() <= SLANT { self.to } else { self.place(1.0) }
    }

    /// The length of the path in the world.
    pub(super) fn length(&self) -> f64 {
        let (low, high) = self.rise.unwrap_or_default();
        let rise = high.in_thousandths() as f64 - low.in_thousandths() as f64;
        let length = self.circle.length();
        libm::sqrt(length * length + rise * rise)
    }

    /// The arc in steps; `None` if it is none there, because the steps of the axes are not equal.
    pub(super) fn wanted(&self) -> Option<Wanted> {
        let circle = &self.circle;
        let (first, second) = circle.plane().axes();
        let scales = [self.scales[first], self.scales[second]];
        if !scales[0].equals(scales[1]) {
            return None;
        }
        let exact = |place: [Value; 2]| place.map(|value| scales[0].exact(value));
        let landing = self.landing();
        let end = circle.point(1.0).map(|place| place / scales[0].step());
        Some(Wanted {
            turn: circle.turn(),
            centre: exact(circle.centre()),
            radius: circle.radius() / scales[0].step(),
            sweep: circle.sweep(),
            start: exact(circle.start()),
            ends: [end, exact(circle.end())],
            from: [self.from[first], self.from[second]],
            to: [self.to[first], self.to[second]],
            landing: [landing[first], landing[second]],
            climbs: self.climb().is_some(),
        })
    }
}
