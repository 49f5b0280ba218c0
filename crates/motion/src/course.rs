//! Speeds along the real way: of a tool moved by several axes, not of a single motor.
//!
//! # The way
//!
//! A path is divided into stretches, each of a number of clock steps and a length. The places of
//! the steps of a stretch are evenly spaced along it: step `j` of `n` is at `length·j/n`, rounded
//! up to whole picometres.
//!
//! # The motion
//!
//! It consists of pieces of constant acceleration, each of which begins at a whole nanosecond.
//! A piece of the way L between the speeds v and w ≥ v lasts T = 2·L/(v + w), rounded up to whole
//! nanoseconds. At t from its slow end the way from there is
//!
//! ```text
//! m(t) = v·t + (w - v)·t²/(2·T)
//! ```
//!
//! and at T it is L or more. So a rising piece makes the way m(t), and where that is more than L,
//! L; a falling one makes L - m(T - t), and where m is more than L, nothing. Every place is
//! reached, none is out by more than the nanosecond that is rounded for each piece, and that
//! nanosecond is spent at the fast end: at the slow end, if that is standstill, an error in the
//! way would be its square root in the time.
//!
//! # When a place is reached
//!
//! Multiplied by T the speed at t is V = v·T + (w - v)·t, and the way m from the slow end is made
//! where V² = (v·T)² + 2·(w - v)·T·m. So it takes one square root to find the time of a place.
//!
//! # Braking
//!
//! From the way and the speed at that time one more piece leads to standstill. The way is rounded
//! down, so that the places before it keep their times. The speed is rounded up, and two
//! picometres and the way of a nanosecond are added: a motion that brakes by itself, in
//! pieces that were rounded, is not to end a step earlier because it is braked.
//!
//! # Sizes
//!
//! Lengths are in pm, times in ns, speeds in pm/s, so that ways are also counted in 10⁻⁹ pm. A
//! speed is less than 2⁴⁴, the way of a stretch less than 2⁶⁴, of all of them less than 2⁹⁰.
//! Whatever the speeds of a piece are, T times the larger of them is hardly more than twice its
//! way: less than 2¹²² in 10⁻⁹ pm. Squares of that, and other products that may take more than 128
//! bits, are [`wide`].

use std::ops::Range;
use std::sync::Arc as Shared;

use serde::{Deserialize, Serialize};

use crate::phase::{Phase, Trend};
use crate::wide;
use crate::wide::saturated;
use crate::{AXES, Path, Point, StraightLine};

/// The largest number of steps of a stretch.
const MOST_STEPS: u64 = 1 << 40;
/// The largest speed, nm/s.
const FASTEST: u64 = 10_000_000_000;
/// The largest acceleration, nm/s².
const STEEPEST: u64 = 1_000_000_000_000_000;
/// Picometres in a nanometre.
const PICO: u128 = 1_000;
/// Nanoseconds in a second.
const NANO: u128 = 1_000_000_000;
/// µHz in a Hz.
const MICRO: u128 = 1_000_000;

/// A number of clock steps and the length of their way.
///
/// Axes that turn have thousandths of an arc second for nanometres, in lengths, speeds and
/// accelerations alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Stretch {
    /// Clock steps, 0 to 2⁴⁰.
    pub steps: u64,
    /// Picometres, at least one for each step. What is outside these ranges counts as the nearest
    /// within.
    pub length: u64,
}

impl Stretch {
    /// A straight line to `delta` as [`StraightLine::new`] makes it, with `scale` picometres to a step of
    /// each axis.
    #[must_use]
    pub fn line(delta: &Point, scale: &[u64; AXES]) -> Stretch {
        Stretch {
            steps: Path::Line(StraightLine::new(*delta)).length(),
            length: chord(delta, scale),
        }
    }
}

/// The straight distance to `delta`, in steps, with `scale` picometres to a step of each axis:
/// picometres, rounded down, `u64::MAX` if it is more.
#[must_use]
pub fn chord(delta: &Point, scale: &[u64; AXES]) -> u64 {
    let ways = delta.iter().zip(scale);
    let ways = ways.map(|(steps, &scale)| u128::from(steps.unsigned_abs()) * u128::from(scale));
    // What is longer than 2¹⁰⁰ is too long alone, and is cut so that the squares can be added.
    let squares = ways.map(|way| wide::square(way.min(1 << 100)));
    saturated(wide::root(squares.fold((0, 0), wide::sum)))
}

/// A motion along stretches, see [`Profile`](crate::Profile).
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "Order", into = "Order")]
pub(crate) struct Course {
    order: Order,
    plan: Shared<Plan>,
}

/// The request. Everything else follows from it.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
struct Order {
    stretches: Shared<[Stretch]>,
    drive: Drive,
    /// When braking began, nanoseconds after the start; `None` while the motion runs its course.
    braked_at: Option<u64>,
}

/// Speeds in nm/s, accelerations in nm/s².
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Drive {
    Trapezoid { speed: u64, acceleration: u64 },
    Vectors { from: u64, speeds: Shared<[Option<u64>]>, braking: u64 },
}

impl Course {
    pub(crate) fn trapezoid(
        stretches: impl IntoIterator<Item = Stretch>,
        speed: u64,
        acceleration: u64,
    ) -> Course {
        let stretches: Shared<[Stretch]> = stretches.into_iter().collect();
        let places = places(&stretches);
        let pieces = trapezoid(whole_way(&places), speed, acceleration);
        let drive = Drive::Trapezoid { speed, acceleration };
        let plan = Shared::new(Plan::new(places, pieces));
        Course { order: Order { stretches, drive, braked_at: None }, plan }
    }

    pub(crate) fn vectors(
        from: u64,
        stretches: &[Stretch],
        speeds: &[Option<u64>],
        braking: u64,
    ) -> Option<Course> {
        if stretches.len() != speeds.len() || speeds.last().is_some_and(Option::is_none) {
            return None;
        }
        let places = places(stretches);
        let mut placed = places.iter();
        let mut pieces = Pieces::default();
        let (mut speed, mut way) = (speed_in_pm(from), 0);
        for (stretch, end) in stretches.iter().zip(speeds) {
            if stretch.steps > 0 {
                way += placed.next()?.length;
            }
            // A vector of no length is left out, with its speed.
            let Some(end) = end.map(speed_in_pm).filter(|_| way > 0) else { continue };
            if speed + end == 0 {
                return None;
            }
            pieces.add(way, speed, end);
            (speed, way) = (end, 0);
        }
        let drive = Drive::Vectors { from, speeds: speeds.into(), braking };
        let order = Order { stretches: stretches.into(), drive, braked_at: None };
        Some(Course { order, plan: Shared::new(Plan::new(places, pieces)) })
    }

    pub(crate) fn steps(&self) -> u64 {
        self.plan.steps
    }

    pub(crate) fn steps_at(&self, nanos: u64) -> u64 {
        let plan = &self.plan;
        plan.steps_within(plan.way_at(u128::from(nanos))).min(plan.steps)
    }

    pub(crate) fn time_of(&self, k: u64) -> u64 {
        let place = self.plan.place(k.min(self.plan.steps));
        saturated(self.plan.time_of(place))
    }

    pub(crate) fn speed_at(&self, nanos: u64) -> u64 {
        let plan = &self.plan;
        let way = plan.way_at(u128::from(nanos));
        let stretch = last_that(&plan.places, |stretch| stretch.way <= way);
        stretch.map_or(0, |stretch| plan.frequency_at(nanos, stretch.steps, stretch.length))
    }

    pub(crate) fn even_speed_at(&self, nanos: u64, steps: Range<u64>) -> u64 {
        let plan = &self.plan;
        let [from, to] = [steps.start, steps.end.min(plan.steps)].map(|step| plan.place(step));
        let count = steps.end.min(plan.steps).saturating_sub(steps.start);
        plan.frequency_at(nanos, count, to.saturating_sub(from))
    }

    pub(crate) fn brake(&self, nanos: u64) -> Option<Course> {
        if self.order.braked_at.is_some() {
            return None;
        }
        let deceleration = match self.order.drive {
            Drive::Trapezoid { acceleration, .. } => acceleration,
            Drive::Vectors { braking, .. } => braking,
        };
        let pieces = self.plan.braked(u128::from(nanos), acceleration_in_pm(deceleration));
        let plan = Plan::new(self.plan.places.clone(), pieces);
        let order = Order { braked_at: Some(nanos), ..self.order.clone() };
        (plan.steps < self.steps()).then(|| Course { order, plan: Shared::new(plan) })
    }

    /// See [`Profile::phases`](crate::Profile).
    pub(crate) fn phases(&self) -> Vec<Phase> {
        let plan = &self.plan;
        let mut phases = Vec::new();
        for piece in &plan.pieces {
            let (begin, end) = (piece.before, piece.before + piece.way);
            let first = plan.places.partition_point(|place| place.way + place.length <= begin);
            let within = plan.places.iter().skip(first).take_while(|place| place.way < end);
            for place in within {
                let change = piece.change * NANO / piece.duration.max(1);
                phases.push(Phase {
                    to: plan.steps_within(end.min(place.way + place.length)).min(plan.steps),
                    acceleration: change * u128::from(place.steps) / place.length,
                    trend: match piece.change {
                        0 => Trend::Stays,
                        _ if piece.rising => Trend::Rises,
                        _ => Trend::Falls,
                    },
                });
            }
        }
        phases
    }

    pub(crate) fn clock(&self) -> CourseClock {
        CourseClock { plan: Shared::clone(&self.plan) }
    }
}

impl TryFrom<Order> for Course {
    type Error = &'static str;

    fn try_from(order: Order) -> Result<Course, &'static str> {
        let course = match &order.drive {
            &Drive::Trapezoid { speed, acceleration } => {
                Some(Course::trapezoid(order.stretches.iter().copied(), speed, acceleration))
            }
            Drive::Vectors { from, speeds, braking } => {
                Course::vectors(*from, &order.stretches, speeds, *braking)
            }
        };
        let course = course.ok_or("a profile with a stretch on which nothing moves")?;
        match order.braked_at {
            None => Ok(course),
            Some(nanos) => course.brake(nanos).ok_or("a profile that is braked after its end"),
        }
    }
}

impl From<Course> for Order {
    fn from(course: Course) -> Order {
        course.order
    }
}

/// From nm/s to pm/s, within the range.
fn speed_in_pm(nanometres: u64) -> u128 {
    u128::from(nanometres.min(FASTEST)) * PICO
}

/// From nm/s² to pm/s², within the range.
fn acceleration_in_pm(nanometres: u64) -> u128 {
    u128::from(nanometres.clamp(1, STEEPEST)) * PICO
}

/// A stretch that has steps, and where it begins.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Placed {
    /// Clock steps before it.
    before: u64,
    /// The way before it, pm.
    way: u128,
    steps: u64,
    /// Picometres.
    length: u128,
}

/// The stretches that have steps, one after the other.
fn places(stretches: &[Stretch]) -> Vec<Placed> {
    let (mut before, mut way) = (0, 0);
    let moving = stretches.iter().filter(|stretch| stretch.steps > 0);
    let placed = moving.map(|stretch| {
        let steps = stretch.steps.min(MOST_STEPS);
        let length = u128::from(stretch.length.max(steps));
        let placed = Placed { before, way, steps, length };
        (before, way) = (before + steps, way + length);
        placed
    });
    placed.collect()
}

/// The way of all stretches together, pm.
fn whole_way(places: &[Placed]) -> u128 {
    places.last().map_or(0, |last| last.way + last.length)
}

/// A stretch of time with constant acceleration.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Piece {
    /// When it begins, ns.
    start: u128,
    /// The way before it, pm.
    before: u128,
    /// How much of L is made before another piece begins, usually all; pm.
    way: u128,
    /// L, pm.
    whole: u128,
    /// v, pm/s.
    slow: u128,
    /// w - v, pm/s.
    change: u128,
    /// Whether it begins with its slow end.
    rising: bool,
    /// T, ns.
    duration: u128,
}

impl Piece {
    /// The time since or until the slow end, at `t` nanoseconds from the start.
    fn time_off_slow_end(&self, t: u128) -> u128 {
        let t = t.min(self.duration);
        if self.rising { t } else { self.duration - t }
    }

    /// m, times 2·T·10⁹.
    fn way_off_slow_end(&self, t: u128) -> wide::Wide {
        wide::product(t, 2 * self.slow * self.duration + self.change * t)
    }

    /// The way made after `t` nanoseconds, pm, rounded down.
    fn way_at(&self, t: u128) -> u128 {
        let way = self.way_off_slow_end(self.time_off_slow_end(t));
        let rounded_down = |way| wide::quotient(way, 2 * self.duration) / NANO;
        let way = if self.rising {
            rounded_down(way)
        } else if way == (0, 0) {
            self.whole
        } else {
            self.whole.saturating_sub(rounded_down(wide::difference(way, (0, 1))) + 1)
        };
        way.min(self.way)
    }

    /// Whether `way`, pm, is made after `t` nanoseconds.
    fn has_made(&self, way: u128, t: u128) -> bool {
        let there = self.way_off_slow_end(self.time_off_slow_end(t));
        let scaled = |way| wide::product(2 * self.duration, way * NANO);
        if way > self.way {
            false
        } else if self.rising {
            there >= scaled(way)
        } else {
            there <= scaled(self.whole - way)
        }
    }

    /// The first nanosecond at which `way`, pm, is made; no more than that of the piece.
    fn time_of(&self, way: u128) -> u128 {
        let way = if self.rising { way } else { self.whole - way } * NANO;
        if self.change == 0 {
            return way.div_ceil(self.slow);
        }
        let level = self.slow * self.duration;
        let rise = wide::product(2 * self.change * self.duration, way);
        let square = wide::sum(wide::square(level), rise);
        if self.rising {
            (wide::ceil_root(square) - level).div_ceil(self.change)
        } else {
            self.duration - ((wide::root(square) - level) / self.change).min(self.duration)
        }
    }

    /// The speed after `t` nanoseconds times T.
    fn speed_at(&self, t: u128) -> u128 {
        self.slow * self.duration + self.change * self.time_off_slow_end(t)
    }
}

/// Pieces, one after the other.
#[derive(Default)]
struct Pieces {
    pieces: Vec<Piece>,
    /// When the last of them ends, ns.
    end: u128,
    /// The way of all of them, pm.
    way: u128,
}

impl Pieces {
    /// Adds a piece of a way in pm between speeds in pm/s, not both 0; none if there is no way.
    fn add(&mut self, way: u128, from: u128, to: u128) {
        if way == 0 {
            return;
        }
        let duration = (2 * way * NANO).div_ceil(from + to);
        self.pieces.push(Piece {
            start: self.end,
            before: self.way,
            way,
            whole: way,
            slow: from.min(to),
            change: from.abs_diff(to),
            rising: from <= to,
            duration,
        });
        self.end += duration;
        self.way += way;
    }
}

/// Up to the speed and down to standstill within a way in pm.
fn trapezoid(way: u128, speed: u64, acceleration: u64) -> Pieces {
    let (speed, acceleration) = (speed_in_pm(speed.max(1)), acceleration_in_pm(acceleration));
    let mut pieces = Pieces::default();
    let ramp = (speed.pow(2) / (2 * acceleration)).max(1);
    if 2 * ramp <= way {
        pieces.add(ramp, 0, speed);
        pieces.add(way - 2 * ramp, speed, speed);
        pieces.add(ramp, speed, 0);
    } else {
        // The top of the triangle. It is rounded up, so that it does not fall more gently than
        // it is braked, and is at least 1.
        let square = acceleration * way;
        let root = square.isqrt();
        let top = (root + u128::from(root * root < square)).clamp(1, speed);
        pieces.add(way / 2, 0, top);
        pieces.add(way - way / 2, top, 0);
    }
    pieces
}

/// Places and pieces of one motion.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Plan {
    places: Vec<Placed>,
    pieces: Vec<Piece>,
    /// How many steps are made until the motion has halted.
    steps: u64,
}

/// The last item that fulfils a condition, where those that do come first.
fn last_that<T>(items: &[T], condition: impl Fn(&T) -> bool) -> Option<&T> {
    items.partition_point(condition).checked_sub(1).and_then(|last| items.get(last))
}

impl Plan {
    fn new(places: Vec<Placed>, Pieces { pieces, way, .. }: Pieces) -> Plan {
        let mut plan = Plan { places, pieces, steps: 0 };
        plan.steps = plan.steps_within(way);
        plan
    }

    /// The place of step `k`, pm.
    fn place(&self, k: u64) -> u128 {
        last_that(&self.places, |stretch| stretch.before < k).map_or(0, |stretch| {
            let made = u128::from((k - stretch.before).min(stretch.steps));
            stretch.way + (stretch.length * made).div_ceil(u128::from(stretch.steps))
        })
    }

    /// How many places a way passes, its end included.
    fn steps_within(&self, way: u128) -> u64 {
        last_that(&self.places, |stretch| stretch.way <= way).map_or(0, |stretch| {
            let made = (way - stretch.way) * u128::from(stretch.steps) / stretch.length;
            stretch.before + saturated(made).min(stretch.steps)
        })
    }

    /// The piece that is under way at `nanos`, or the last; `None` if there are none.
    fn piece_at(&self, nanos: u128) -> Option<&Piece> {
        last_that(&self.pieces, |piece| piece.start <= nanos)
    }

    /// The way made at `nanos`, pm, rounded down.
    fn way_at(&self, nanos: u128) -> u128 {
        self.piece_at(nanos).map_or(0, |piece| piece.before + piece.way_at(nanos - piece.start))
    }

    /// The step frequency, µHz, at which steps come that lie evenly along a way in pm; 0 at the end.
    fn frequency_at(&self, nanos: u64, steps: u64, way: u128) -> u64 {
        let nanos = u128::from(nanos);
        match self.piece_at(nanos) {
            Some(piece) if way > 0 && self.steps_within(self.way_at(nanos)) < self.steps => {
                let speed = piece.speed_at(nanos - piece.start) / piece.duration;
                saturated(speed * u128::from(steps) * MICRO / way)
            }
            _ => 0,
        }
    }

    /// When a place is reached, ns; 0 for the start.
    fn time_of(&self, place: u128) -> u128 {
        let piece = last_that(&self.pieces, |piece| piece.before < place);
        piece.map_or(0, |piece| piece.start + piece.time_of(place - piece.before))
    }

    /// The pieces up to `nanos`, and one that leads to standstill; pm/s².
    fn braked(&self, nanos: u128, deceleration: u128) -> Pieces {
        let mut pieces: Vec<Piece> =
            self.pieces.iter().take_while(|piece| piece.start <= nanos).cloned().collect();
        let Some(last) = pieces.last_mut() else {
            return Pieces::default();
        };
        let t = nanos - last.start;
        let speed = last.speed_at(t).div_ceil(last.duration);
        last.way = last.way_at(t);
        let mut pieces = Pieces { way: last.before + last.way, end: nanos, pieces };
        if speed > 0 {
            let way = speed.pow(2).div_ceil(2 * deceleration) + speed.div_ceil(NANO) + 2;
            pieces.add(way, speed, 0);
        }
        pieces
    }
}

/// Whether a place is reached, by the definition: without a formula for a time and without a
/// square root.
#[derive(Clone, Debug)]
pub(crate) struct CourseClock {
    plan: Shared<Plan>,
}

impl CourseClock {
    /// The place of step `k`, pm.
    pub(crate) fn place(&self, k: u64) -> u128 {
        self.plan.place(k)
    }

    /// Whether the motion has reached a place at `nanos`.
    pub(crate) fn reached(&self, place: u128, nanos: u64) -> bool {
        let nanos = u128::from(nanos);
        self.plan.piece_at(nanos).is_some_and(|piece| {
            place <= piece.before || piece.has_made(place - piece.before, nanos - piece.start)
        })
    }
}
