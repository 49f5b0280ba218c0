//! Whether motions lie on the circle or the helix that a job asks for.

use std::f64::consts::TAU;

use vimc4_device::{Point, Segment};
use vimc4_ncp::job::Target;
use vimc4_tests::jobs::Circle;

/// How far beside it a tool may be, in steps.
const MOST: f64 = 2.0;

/// A circle in the counters of a machine.
pub(crate) struct Course {
    /// The axes of the plane, and the third one.
    axes: [usize; 3],
    /// µm a step, of each of these.
    step: [f64; 3],
    /// In µm.
    centre: [f64; 2],
    radius: f64,
    helix: Option<Helix>,
}

/// How the third axis moves while the others go round once.
struct Helix {
    from: f64,
    to: f64,
    /// 1 counterclockwise, -1 clockwise.
    sense: f64,
}

impl Course {
    /// The course that a job asks for on a machine.
    pub(crate) fn new(circle: &Circle, target: &Target) -> Result<Course, String> {
        let axes = match circle.plane.as_str() {
            "xy" => [0, 1, 2],
            "xz" => [0, 2, 1],
            "yz" => [1, 2, 0],
            other => return Err(format!("{other:?} is not a plane; xy, xz and yz are")),
        };
        let helix = match (&circle.rise, circle.turn.as_deref()) {
            (None, None) => None,
            (Some([from, to]), Some(turn @ ("cw" | "ccw"))) => {
                Some(Helix { from: from.0, to: to.0, sense: if turn == "cw" { -1.0 } else { 1.0 } })
            }
            _ => return Err("a helix has a rise and a turn, cw or ccw".to_owned()),
        };
        Ok(Course {
            axes,
            // Scales are in thousandths of a µm.
            step: axes.map(|axis| target.scales[axis].step() / 1_000.0),
            centre: circle.centre.map(|number| number.0),
            radius: circle.radius.0,
            helix,
        })
    }

    /// Holds every step of a motion that began at `origin` against the course.
    pub(crate) fn check(&self, origin: &Point, segment: &Segment) -> Result<(), String> {
        for step in segment.steps() {
            let place: [f64; 3] = std::array::from_fn(|index| {
                let axis = self.axes[index];
                (origin[axis] + step.offset[axis]) as f64 * self.step[index]
            });
            let beside = self.beside(place);
            if beside > MOST {
                return Err(format!(
                    "at {place:?} um it is {beside:.2} steps beside the arc; {MOST} are allowed"
                ));
            }
        }
        Ok(())
    }

    /// How far a place is beside the course, in steps.
    fn beside(&self, [first, second, third]: [f64; 3]) -> f64 {
        let (u, v) = (first - self.centre[0], second - self.centre[1]);
        let distance = u.hypot(v);
        let off = (distance - self.radius) / distance;
        let across = (u * off / self.step[0]).hypot(v * off / self.step[1]);
        let Some(helix) = &self.helix else { return across };
        // From the positive first axis, where the helices of the fixtures begin.
        let turned = (helix.sense * v.atan2(u)).rem_euclid(TAU) / TAU;
        let rise = helix.to - helix.from;
        let off = |turned: f64| (third - helix.from - rise * turned).abs();
        // Beginning and end have the same angle, which rounding may put before either.
        let off = match turned {
            ..0.01 => off(turned).min(off(1.0)),
            0.99.. => off(turned).min(off(0.0)),
            _ => off(turned),
        };
        // A steep helix is nearer than it is above.
        let steepness = rise / (TAU * self.radius);
        across.hypot(off / self.step[2] / steepness.hypot(1.0))
    }
}
