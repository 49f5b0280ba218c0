//! Arcs round a centre: the path that is nearest to the ideal circle at every step.
//!
//! Centre and start are whole steps, so the squared radius R² is an integer. The ideal circle
//! begins in the middle of the cell of the start and passes through the cells of the lattice one
//! after the other. The path visits exactly these: every place is a point of the circle, rounded
//! to the nearest step.
//!
//! # The rule
//!
//! In a quadrant one coordinate runs towards its zero, inward, and the other away from it, and
//! the circle leaves a cell through one of two sides that meet in the corner ahead. It leaves in
//! the inward direction if that corner is outside the circle:
//!
//! ```text
//! (2x + Rx)² + (2y + Ry)² > 4·R²
//! ```
//!
//! Both squares are odd, so the left side is 2 more than a multiple of 8 and the right side is a
//! multiple of 4: the circle never passes through a corner.
//!
//! # On the circle engine
//!
//! With `E = x² + y² - R²`, and `Rx·x = -|x|` inward, `Ry·y = |y|` outward, the rule is
//! `E - |x| + |y| ≥ 0` while x runs inward, and `E + |x| - |y| ≥ 0` while y does. The left sides
//! are twice the register D of the circle engine and twice its negative ([`fit`](crate::CircleFit)
//! has the formulas), and D changes with every step as the engine changes it. The engine makes a
//! step in x if its register is positive, so it follows the rule with the register
//!
//! ```text
//! floor(D) + 1   while x runs inward:  a step in x if D ≥ 0
//! ceil(D)        while y runs inward:  a step in x if D > 0
//! ```
//!
//! Where the circle crosses an axis of coordinates it is at R, and its cell at r = round(R): a
//! cell that the circle only pokes into beside the axis would need an integer R² strictly between
//! (r + ½)² and (r + ½)² + ¼. There the other coordinate begins to run inward and the register
//! is set anew, from the exact E. So an arc is a chain of engine runs, one for each quadrant.
//!
//! # The length
//!
//! A step of one axis is not the same way everywhere: where the circle runs along an axis it is a
//! step long, halfway between the axes 1/√2. So that the steps come at the pace of the way, a
//! quadrant is cut into equal sectors, each with the number of steps that lead through it. Within
//! a sector the pace of the way is even to a few percent.
//!
//! # The number of steps
//!
//! A quadrant takes 2r steps, and a place of it is `r - |inward| + |outward|` steps from its
//! beginning. So the place of the end, rounded, says how many steps lead to it. A half is rounded
//! away from the centre.

use std::ops::Neg;
use std::sync::OnceLock;

use crate::fit::Turn;
use crate::trig::{self, HALF_PI, QUARTER, RADIAN_BITS, SINE_BITS};
use crate::wide::saturated;
use crate::{AXES, Arc, ArcState, Chain, Path, Point, StraightLine, Stretch, chord, wide};

/// Largest radius, steps: the longest quadrant that an [`Arc`] can be.
const LARGEST: i64 = 1 << 27;

/// Largest angle, billionths of a degree.
const LARGEST_ANGLE: u64 = 4_000 * QUARTER;

/// How many sectors of equal pace a quadrant has.
const SECTORS: u64 = 16;

/// Arcs of more quarter turns are of one pace.
const MOST_QUARTERS: i64 = 400;

/// An arc about a centre, from where the axes are.
///
/// ```
/// use vimc4_motion::Sweep;
///
/// // A quarter turn to the left about a centre 100 steps ahead.
/// let sweep = Sweep::by_angle((0, 1), (100, 0), 90_000_000_000).expect("in range");
/// let path = sweep.path();
/// assert_eq!(path.at(path.length()), [100, -100, 0, 0, 0, 0]);
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Sweep {
    plane: (usize, usize),
    /// The arc, quadrant by quadrant, and the line after it.
    path: Chain,
    /// The line.
    rest: Point,
    /// R², square steps.
    square: i64,
    /// The angle between start and end, 2⁻⁶² radians.
    angle: i128,
    /// The angle of the start in its quadrant, 2⁻⁶² radians.
    begin: i128,
    /// How many steps the start is from the beginning of its quadrant.
    here: i64,
    /// r, steps.
    radius: i64,
}

/// The circle from its start, in a frame in which it runs counterclockwise and the start is in
/// the first quadrant.
struct Frame {
    /// The start, from the centre.
    start: (i64, i64),
    turn: Turn,
    /// R², square steps.
    square: i64,
    /// r, steps.
    radius: i64,
    /// By how many quarter turns, back, the frame is turned.
    quarters: i64,
    /// What the start is in the frame: how far it has to run inward, and has run outward.
    inward: i64,
    outward: i64,
}

impl Sweep {
    /// The arc about `centre`, in steps from where the axes of `plane` are, by an angle in
    /// billionths of a degree, positive counterclockwise: from the first axis to the second. It
    /// may be more than a turn, up to 360,000°. No motion if the centre is the start.
    ///
    /// `None` if the axes are equal or are none, for a radius of more than 2²⁷ steps, and for a
    /// larger angle.
    #[must_use]
    pub fn by_angle(plane: (usize, usize), centre: (i64, i64), billionths: i64) -> Option<Sweep> {
        let turn = if billionths < 0 { Turn::Clockwise } else { Turn::Counterclockwise };
        let billionths = billionths.unsigned_abs();
        check_plane(plane)?;
        if billionths > LARGEST_ANGLE {
            return None;
        }
        if centre == (0, 0) {
            return Some(Sweep::straight(plane, centre));
        }
        let frame = Frame::new(centre, turn)?;
        // Whole quarters are exact; the rest is less than one.
        let quarters = (billionths / QUARTER) as i64;
        let (sine, cosine) = trig::sine_and_cosine(billionths % QUARTER);
        let turned = |a: i64, b: i64| {
            i128::from(frame.inward) * i128::from(a) + i128::from(frame.outward) * i128::from(b)
        };
        let end = (turned(cosine, -sine), turned(sine, cosine));
        let rounded = |value: i128| {
            let half = 1 << (SINE_BITS - 1);
            ((value.abs() + half) >> SINE_BITS) as i64
        };
        let (quadrant, inward, outward) = quadrant(end);
        let quarters = quarters + quadrant;
        Some(Sweep {
            plane,
            path: frame.arc(plane, quarters, rounded(inward), rounded(outward)),
            rest: [0; AXES],
            square: frame.square,
            angle: trig::radians(billionths),
            begin: trig::angle(frame.inward, frame.outward),
            here: frame.here(),
            radius: frame.radius,
        })
    }

    /// The arc about `centre` to `end`, both in steps from where the axes of `plane` are. It goes
    /// to the place of the circle in the direction of the end and, if that is not the end, on to
    /// it in a straight line. An end at the start is a whole turn; another in the direction of
    /// the start needs no arc at all. If the centre is the start there is only the line.
    ///
    /// `None` if the axes are equal or are none, if the end is the centre, which is in no
    /// direction, and if start or end are more than 2²⁷ steps from the centre.
    #[must_use]
    pub fn to_point(
        plane: (usize, usize),
        centre: (i64, i64),
        end: (i64, i64),
        turn: Turn,
    ) -> Option<Sweep> {
        check_plane(plane)?;
        if centre == (0, 0) {
            let within = end.0.unsigned_abs().max(end.1.unsigned_abs()) <= LARGEST as u64;
            return within.then(|| Sweep::straight(plane, end));
        }
        let frame = Frame::new(centre, turn)?;
        let (x, y) = (end.0.checked_sub(centre.0)?, end.1.checked_sub(centre.1)?);
        let square_distance = square_within(x, y).filter(|&square| square > 0)?;
        let (x, y) = frame.to_frame(x, y);
        let (quadrant, inward, outward) = quadrant((x, y));
        // In the quadrant of the start the end may lie behind it, or be it.
        let across = frame.inward * y - frame.outward * x;
        let behind = quadrant == 0 && (across < 0 || end == (0, 0));
        let quarters = if behind { 4 } else { quadrant };
        let on_circle = |coordinate: i64| {
            // The nearest integer to √q, for the exact ratio q.
            let dividend = (i128::from(coordinate).pow(2) * i128::from(frame.square)) as u128;
            let divisor = square_distance as u128;
            let root = (dividend / divisor).isqrt();
            let up = 4 * dividend >= (2 * root + 1).pow(2) * divisor;
            (root + u128::from(up)) as i64
        };
        let arc = frame.arc(plane, quarters, on_circle(inward), on_circle(outward));
        let reached = arc.at(arc.length());
        let mut rest = [0; AXES];
        for (axis, there) in [(plane.0, end.0), (plane.1, end.1)] {
            rest[axis] = there - reached[axis];
        }
        let start_angle = trig::angle(frame.inward, frame.outward);
        let end_angle = i128::from(quarters) * HALF_PI + trig::angle(inward, outward);
        let angle = (end_angle - start_angle).max(0);
        let path = Chain::new([Path::Chain(arc), Path::Line(StraightLine::new(rest))]);
        let (here, radius) = (frame.here(), frame.radius);
        Some(Sweep {
            plane,
            path,
            rest,
            square: frame.square,
            angle,
            begin: start_angle,
            here,
            radius,
        })
    }

    /// No arc, only a line.
    fn straight(plane: (usize, usize), end: (i64, i64)) -> Sweep {
        let mut rest = [0; AXES];
        (rest[plane.0], rest[plane.1]) = end;
        let path = Chain::new([Path::Line(StraightLine::new(rest))]);
        Sweep { plane, path, rest, square: 0, angle: 0, begin: 0, here: 0, radius: 0 }
    }

    /// The path, from the start.
    #[must_use]
    pub fn path(&self) -> Path {
        Path::Chain(self.path.clone())
    }

    /// How long the ideal arc and the straight line after it are, in picometres, with `scale`
    /// picometres to a step of each axis; rounded down, `u64::MAX` if it is more. With different
    /// scales for its axes the circle is an ellipse, for which the root mean square of the two
    /// is taken.
    #[must_use]
    pub fn length(&self, scale: &[u64; AXES]) -> u64 {
        self.arc_length(self.angle, scale).saturating_add(chord(&self.rest, scale))
    }

    /// The length of an arc of so many 2⁻⁶² radians.
    fn arc_length(&self, angle: i128, scale: &[u64; AXES]) -> u64 {
        let (first, second) = (u128::from(scale[self.plane.0]), u128::from(scale[self.plane.1]));
        let mean = u128::midpoint(first * first, second * second).isqrt();
        // The radius in 2⁻³⁰ steps, the angle in 2⁻⁴⁰ radians.
        let radius = ((self.square as u128) << 60).isqrt();
        let angle = (angle >> (RADIAN_BITS - 40)) as u128;
        saturated(wide::quotient(wide::product(radius * angle, mean), 1 << (30 + 40)))
    }

    /// The steps of the path in stretches of even pace, in order: its sectors, and the line
    /// after them. Their lengths add up to [`length`](Sweep::length).
    #[must_use]
    pub fn stretches(&self, scale: &[u64; AXES]) -> Vec<Stretch> {
        let line = Stretch::line(&self.rest, scale);
        let steps = self.path.length() - line.steps;
        let whole = self.arc_length(self.angle, scale);
        // Angles in 2⁻⁴⁰ radians, so that a product with a length fits.
        let coarse = |angle: i128| (angle >> (RADIAN_BITS - 40)) as u128;
        let turned = coarse(self.angle).max(1);
        let mut stretches = Vec::new();
        let (mut step, mut way) = (0, 0);
        for (to_step, angle) in self.sectors(steps).chain([(steps, self.angle)]) {
            let to_way = saturated(u128::from(whole) * coarse(angle) / turned);
            // A sector in which there is no step makes the next one longer.
            if to_step > step {
                stretches.push(Stretch { steps: to_step - step, length: to_way - way });
                (step, way) = (to_step, to_way);
            }
        }
        if let Some(last) = stretches.last_mut() {
            last.length += whole - way;
        }
        if line.steps > 0 {
            stretches.push(line);
        }
        stretches
    }

    /// The ends of the sectors that lie within the arc: steps from its start, and the angle from
    /// there.
    fn sectors(&self, steps: u64) -> impl Iterator<Item = (u64, i128)> + use<> {
        let end = self.begin + self.angle;
        let most = if end / HALF_PI > i128::from(MOST_QUARTERS) { 0 } else { u64::MAX };
        // The radius in 2⁻³⁰ steps.
        let radius = ((self.square as u128) << 60).isqrt() as i128;
        let at = move |sine: i64| {
            let half = 1 << (SINE_BITS + 29);
            ((radius * i128::from(sine) + half) >> (SINE_BITS + 30)) as i64
        };
        let (begin, here, whole) = (self.begin, self.here, self.radius);
        (1..most)
            .map(move |number| {
                let (quarter, sector) = (number / SECTORS, number % SECTORS);
                let (sine, cosine) = (sine(sector), sine(SECTORS - sector));
                let place = 2 * whole * quarter as i64 + whole - at(cosine) + at(sine);
                let angle = i128::from(number) * HALF_PI / i128::from(SECTORS);
                ((place - here).clamp(0, steps as i64) as u64, angle - begin)
            })
            .skip_while(|(_, angle)| *angle <= 0)
            .take_while(move |(_, angle)| *angle < end - begin)
    }
}

/// The sine of so many sectors, 0 to a whole quadrant.
fn sine(sectors: u64) -> i64 {
    static SINES: OnceLock<[i64; SECTORS as usize + 1]> = OnceLock::new();
    let sine = |sectors: usize| match sectors as u64 {
        SECTORS => 1 << SINE_BITS,
        sectors => trig::sine_and_cosine(sectors * (QUARTER / SECTORS)).0,
    };
    let sines = SINES.get_or_init(|| std::array::from_fn(sine));
    sines.get(sectors as usize).copied().unwrap_or(0)
}

/// Two different axes, or `None`.
fn check_plane((first, second): (usize, usize)) -> Option<()> {
    (first != second && first < AXES && second < AXES).then_some(())
}

/// x² + y², unless a place is further from the centre than an arc can be.
fn square_within(x: i64, y: i64) -> Option<i64> {
    let possible = -LARGEST..=LARGEST;
    if !possible.contains(&x) || !possible.contains(&y) {
        return None;
    }
    let square = x * x + y * y;
    (square <= LARGEST * LARGEST).then_some(square)
}

/// The number of quarter turns to the quadrant of a place, and its inward and outward coordinate
/// there. A place on an axis of coordinates is at the beginning of the next quadrant.
fn quadrant<T: Copy + Default + Ord + Neg<Output = T>>((x, y): (T, T)) -> (i64, T, T) {
    let zero = T::default();
    if x > zero && y >= zero {
        (0, x, y)
    } else if y > zero {
        (1, y, -x)
    } else if x < zero {
        (2, -x, -y)
    } else {
        (3, -y, x)
    }
}

impl Frame {
    /// `None` if the radius is too large.
    fn new(centre: (i64, i64), turn: Turn) -> Option<Frame> {
        let start = (centre.0.checked_neg()?, centre.1.checked_neg()?);
        let square = square_within(start.0, start.1)?;
        let root = square.isqrt();
        // √square ≥ root + ½, squared; there is no tie.
        let radius = root + i64::from(square > root * root + root);
        let (quarters, inward, outward) = quadrant((start.0, start.1 * turn.sign()));
        Some(Frame { start, turn, square, radius, quarters, inward, outward })
    }

    /// How many steps the start is from the beginning of its quadrant.
    fn here(&self) -> i64 {
        self.radius - self.inward + self.outward
    }

    /// A place, from the centre, as it is in the frame.
    fn to_frame(&self, x: i64, y: i64) -> (i64, i64) {
        (0..self.quarters).fold((x, y * self.turn.sign()), |(x, y), _| (y, -x))
    }

    /// The arc to the place `inward` and `outward` of the quadrant that is `quarters` ahead.
    fn arc(
        &self,
        (first, second): (usize, usize),
        quarters: i64,
        inward: i64,
        outward: i64,
    ) -> Chain {
        let quadrant = 2 * self.radius;
        // Rounding may not lead out of the quadrant, nor back behind the start.
        let there = (self.radius - inward + outward).clamp(0, quadrant);
        let here = self.here();
        let mut left = (quarters * quadrant + there - here).max(0);
        let (mut x, mut y) = self.start;
        let mut arcs = Vec::new();
        while let Some((rx, ry)) = self.turn.directions(x, y).filter(|_| left > 0) {
            let outside = x * x + y * y - self.square;
            let x_inward = x * i64::from(rx) < 0;
            let (d, to_axis) = if x_inward {
                let twice = outside - x.abs() + y.abs();
                (twice.div_euclid(2) + 1, x.abs() + self.radius - y.abs())
            } else {
                let twice = -outside - x.abs() + y.abs();
                ((twice + 1).div_euclid(2), y.abs() + self.radius - x.abs())
            };
            let start = ArcState { x, y, d, rx, ry };
            let steps = left.min(to_axis);
            arcs.push(Path::Arc(Arc::new(first, second, steps as u64, start)));
            left -= steps;
            (x, y) = if x_inward {
                (0, self.radius * i64::from(ry))
            } else {
                (self.radius * i64::from(rx), 0)
            };
        }
        Chain::new(arcs)
    }
}
