//! The registers with which the circle engine comes nearest to an arc.
//!
//! # How far it is beside the arc
//!
//! The engine's circle has a centre and an R² in whole steps. Its difference register D stays
//! within `-|x| < D ≤ |y|`, whereby each of its places is within `(½, ½)` step, along a diagonal,
//! of a point of a circle about its centre: the one whose square is
//!
//! ```text
//! N² = x² + y² - (2·D + |x| - |y|)    while x runs towards zero
//! N² = x² + y² + (2·D + |x| - |y|)    while y runs towards zero
//! ```
//!
//! which is the same at all places of a quadrant. The engine crosses the axes of coordinates at the
//! whole number r, and there the sign of the bracket changes: in the next quadrant the square is
//! `2·r² - N²`, in the one after it N² again. So no place is further from the arc than
//!
//! ```text
//! |centre of the engine - centre| + greatest |N - R| + √½ + 1 / R
//! ```
//!
//! of the quadrants that are visited, the last term being for circles so small that they bend
//! within a step. This takes a few operations, however long the arc is.
//!
//! A helix needs the place that belongs to an angle. A point of the circle of radius r has as many
//! steps behind it as the place on the same diagonal. Between the circles of r and N the diagonal
//! is up to √2 times as long as their distance, because it crosses them at an angle.
//!
//! # The choice
//!
//! The centre is one of the four whole places around the true one. The square is that of the true
//! radius, which is best within a quadrant, or of a whole number next to it, with which N = r in
//! all quadrants; and if the start is not on that circle, the square of the nearest one that it is
//! on. The least bound wins.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, SQRT_2, TAU};

use vimc4_isel_wire::ArcArgs;
use vimc4_motion::{ArcState, CircleFit, Path, StraightLine, Turn};

use super::MOST_STEPS;

/// An arc in the plane, in steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    pub(super) turn: Turn,
    pub(super) centre: [f64; 2],
    pub(super) radius: f64,
    /// In radians.
    pub(super) sweep: f64,
    pub(super) start: [f64; 2],
    /// Where the arc ends, and the end that was given for it.
    pub(super) ends: [[f64; 2]; 2],
    /// Where the counters are and where they must end.
    pub(super) from: [i64; 2],
    pub(super) to: [i64; 2],
    /// Where the arc itself is to end.
    pub(super) landing: [i64; 2],
    /// Whether it is that of a helix.
    pub(super) climbs: bool,
}

/// How the engine makes an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trace {
    fit: CircleFit,
    /// The number of steps.
    pub(super) steps: u64,
    /// How far it is from the arc at most, in steps; in a helix, from where that is after as many
    /// steps.
    pub(super) off: f64,
}

/// How far a point is from another.
fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    libm::sqrt(x * x + y * y)
}

/// How far a state has come in its quadrant: the magnitude of the coordinate that runs towards its
/// zero, and of the other.
fn inward_and_outward(state: &ArcState) -> (i64, i64) {
    let (x, y) = (state.x.abs(), state.y.abs());
    if x_runs_inward(state) { (x, y) } else { (y, x) }
}

fn x_runs_inward(state: &ArcState) -> bool {
    state.x * i64::from(state.rx) < 0
}

impl Wanted {
    /// The engine run with the least bound among those within `room` steps of the arc, including
    /// the line from there to the end; `None` if there is none.
    pub(super) fn trace(&self, room: f64) -> Option<Trace> {
        let mut best: Option<Trace> = None;
        for centre in self.centres() {
            let beside = distance(centre.map(|steps| steps as f64), self.centre);
            let floor = beside + FRAC_1_SQRT_2;
            if best.is_some_and(|best| best.off <= floor) {
                break;
            }
            for square in self.squares() {
                let Some(trace) = self.traced(centre, beside, square) else { continue };
                if best.is_none_or(|best| trace.off < best.off) {
                    best = Some(trace);
                }
            }
        }
        best.filter(|trace| trace.off <= room && self.can_be_ended(trace, room))
    }

    /// Whether any engine run stays within `room` steps of the arc. The first one found is enough,
    /// which is faster than finding the best.
    pub(super) fn has_trace(&self, room: f64) -> bool {
        self.centres().any(|centre| {
            let beside = distance(centre.map(|steps| steps as f64), self.centre);
            self.squares().any(|square| {
                let trace = self.traced(centre, beside, square);
                trace.is_some_and(|trace| trace.off <= room && self.can_be_ended(&trace, room))
            })
        })
    }

    /// The whole places around the centre, the nearest first.
    fn centres(&self) -> impl Iterator<Item = [i64; 2]> {
        let [x, y] = self.centre.map(|centre| {
            let near = libm::round(centre);
            let other = if near < centre { near + 1.0 } else { near - 1.0 };
            [near, if near == centre { near } else { other }]
        });
        let mut all = [[x[0], y[0]], [x[0], y[1]], [x[1], y[0]], [x[1], y[1]]];
        all.sort_by(|a, b| distance(*a, self.centre).total_cmp(&distance(*b, self.centre)));
        let mut last = None;
        all.into_iter()
            .filter(move |centre| last.replace(*centre) != Some(*centre))
            .map(|centre| centre.map(|steps| steps as i64))
    }

    /// The squares of radii that are tried.
    fn squares(&self) -> impl Iterator<Item = i64> {
        let (floor, ceil) = (libm::floor(self.radius), libm::ceil(self.radius));
        let all = [self.radius * self.radius, floor * floor, ceil * ceil];
        let count = if floor == ceil { 1 } else { all.len() };
        all.into_iter().take(count).map(|square| libm::round(square) as i64)
    }

    /// The engine around a centre that is `beside` the true one, with a radius as near to that of
    /// `square` as its start allows.
    fn traced(&self, centre: [i64; 2], beside: f64, square: i64) -> Option<Trace> {
        let relative = |place: [i64; 2]| {
            (place[0].saturating_sub(centre[0]), place[1].saturating_sub(centre[1]))
        };
        let (x, y) = relative(self.from);
        let counted = -MOST_STEPS..=MOST_STEPS;
        if !counted.contains(&x) || !counted.contains(&y) {
            return None;
        }
        let (own, slack) = (x * x + y * y, x.abs() + y.abs());
        let fit = CircleFit::new(x, y, square.clamp(own - slack, own + slack), self.turn)?;
        let crossing = fit.steps_per_turn() as i64 / 8;
        if crossing > MOST_STEPS {
            return None;
        }
        let steps = self.steps(&fit, relative(self.landing));

        let start = fit.start();
        let (inward, outward) = inward_and_outward(&start);
        let part = 2 * start.d + start.x.abs() - start.y.abs();
        let first = own - if x_runs_inward(&start) { part } else { -part };
        let second = (2 * crossing * crossing - first).max(0);
        let visited = if steps as i64 > crossing + inward - outward { second } else { first };
        let radii = [first, visited].map(|square| libm::sqrt(square as f64));
        let r = crossing as f64;
        let greatest = |to: f64| (radii[0] - to).abs().max((radii[1] - to).abs());
        let circle = if self.climbs {
            (r - self.radius).abs() + SQRT_2 * greatest(r)
        } else {
            greatest(self.radius)
        };
        let off = beside + circle + FRAC_1_SQRT_2 + 1.0 / self.radius;
        Some(Trace { fit, steps, off })
    }

    /// After how many steps the engine is nearest to the landing. The sweep tells whether an end
    /// beside the start is at the beginning or at the end of a turn.
    fn steps(&self, fit: &CircleFit, landing: (i64, i64)) -> u64 {
        let turn = fit.steps_per_turn();
        let expected = (self.sweep / TAU * turn as f64) as u64;
        let near = fit.steps_near(landing, 0);
        let (low, high) = (*near.start(), *near.end());
        let (low, high) = if u64::midpoint(low, high) + turn / 2 < expected {
            fit.steps_near(landing, 1).into_inner()
        } else if u64::midpoint(low, high) > expected + turn / 2 {
            (low.saturating_sub(turn), high.saturating_sub(turn))
        } else {
            (low, high)
        };
        let mut state = fit.after(low);
        let (mut nearest, mut steps) = (i64::MAX, low);
        for step in low..=high {
            let (x, y) = (state.x - landing.0, state.y - landing.1);
            let square = x * x + y * y;
            if square < nearest {
                (nearest, steps) = (square, step);
            }
            state.step();
        }
        steps
    }

    /// Whether the line from where the engine ends is within `room` steps of the end of the arc or
    /// of the given one.
    fn can_be_ended(&self, trace: &Trace, room: f64) -> bool {
        let (start, end) = (trace.fit.start(), trace.fit.after(trace.steps));
        let at = [self.from[0] + end.x - start.x, self.from[1] + end.y - start.y];
        let is_near = |place: [i64; 2]| {
            let place = place.map(|steps| steps as f64);
            self.ends.into_iter().any(|end| distance(place, end) <= room)
        };
        let by = [self.to[0] - at[0], self.to[1] - at[1], 0, 0, 0, 0];
        let line = Path::Line(StraightLine::new(by));
        // The bound of the engine is for the circle, which may go on beyond its end.
        is_near(at) && line.steps().all(|way| is_near([at[0] + way[0], at[1] + way[1]]))
    }
}

impl Trace {
    /// The parameters with which a controller goes on after some steps.
    pub(super) fn parameters(&self, done: u64, steps: u64, speed: u32) -> ArcArgs {
        let ArcState { x, y, d, rx, ry } = self.fit.after(done);
        // The crossing is within 24 bits, so all registers are.
        let (x, y, d) = (x as i32, y as i32, d as i32);
        ArcArgs { steps: steps as u32, speed, d, x, y, rx, ry }
    }

    /// Where the engine crosses the axes of coordinates, in steps.
    pub(super) fn crossing(&self) -> i64 {
        self.fit.steps_per_turn() as i64 / 8
    }

    /// How many steps a quadrant takes.
    pub(super) fn quadrant(&self) -> u64 {
        self.fit.steps_per_turn() / 4
    }

    /// How many steps it takes to the end of the first quadrant.
    pub(super) fn first_quadrant(&self) -> u64 {
        let (inward, outward) = inward_and_outward(&self.fit.start());
        (self.crossing() + inward - outward).max(1) as u64
    }

    /// The angle at which the engine is after some steps, in radians from where the quadrant of
    /// its start begins: that of the point of the circle of radius r that has as many steps behind
    /// it.
    pub(super) fn angle(&self, steps: u64) -> f64 {
        let progress = self.quadrant().saturating_sub(self.first_quadrant()) + steps;
        let (quadrants, rest) = (progress / self.quadrant(), progress % self.quadrant());
        // Inward it came as far as from r to r·cos, outward to r·sin: rest = r - r·cos + r·sin.
        let slant = rest as f64 / self.crossing() as f64 - 1.0;
        quadrants as f64 * FRAC_PI_2 + FRAC_PI_4 + libm::asin(slant * FRAC_1_SQRT_2)
    }

    /// The angle at which the arc itself begins, counted likewise.
    pub(super) fn beginning(&self, wanted: &Wanted) -> f64 {
        let [x, y] = [0, 1].map(|axis: usize| wanted.start[axis] - wanted.centre[axis]);
        let start = self.fit.start();
        let (rx, ry) = (f64::from(start.rx), f64::from(start.ry));
        if x_runs_inward(&start) {
            libm::atan2(y * ry, -x * rx)
        } else {
            libm::atan2(x * rx, -y * ry)
        }
    }
}
