//! Arcs and helices as a controller makes them.
//!
//! An arc is one `y` and, if the circle engine does not reach the end, a line to it. Where the
//! engine would be too far from the arc, or cannot make it, it is chords. A helix is `w` where the
//! controller has it.

use std::f64::consts::SQRT_2;

use vimc4_isel_wire::Plane;

use super::chords::Chords;
use super::climb::{Climb, ROUNDING};
use super::engine::Trace;
use super::parameters::CurveParameters;
use super::stairs::Stairs;
use super::{COMMAND, Delay, Fitted, MOST_STEPS, Motion, ROOM, Speeds, Steps};

/// The motions that make up an arc or a helix.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    parameters: CurveParameters,
    /// Where the motions so far lead to.
    at: Steps,
    course: Course,
}

/// How it is made.
#[derive(Clone, Debug, PartialEq)]
enum Course {
    Engine(Pieces),
    Stairs(Stairs),
    Chords(Chords),
}

/// What the circle engine makes, in one piece or several.
#[derive(Clone, Debug, PartialEq)]
struct Pieces {
    trace: Trace,
    done: u64,
    /// The length of the first piece, in steps of the engine.
    first: u64,
    /// The length of the others.
    stride: u64,
    /// Steps of the engine a second.
    frequency: f64,
    climb: Option<Climb>,
}

impl Pieces {
    /// What the circle engine is to make; `None` if it cannot.
    fn of(parameters: &CurveParameters) -> Option<Pieces> {
        let wanted = parameters.wanted()?;
        // The counter of a third axis that rests, or has come to its end, is rounded.
        let rounding = if parameters.rise.is_some() { ROUNDING / 2.0 } else { 0.0 };
        let room = libm::sqrt(ROOM * ROOM - rounding * rounding);
        let Some(ends) = parameters.climb() else {
            let trace = wanted.trace(room)?;
            return Some(Pieces::divided(
                parameters,
                trace,
                (MOST_STEPS as u64, MOST_STEPS as u64),
                None,
            ));
        };
        let third = parameters.circle.plane().third();
        let rise = parameters.to[third] - parameters.from[third];
        if !parameters.has_helix || rise.abs() > MOST_STEPS {
            return None;
        }
        let trace = wanted.trace(room)?;
        let climb = Climb::new(ends, &trace, &wanted);
        let lengths = climb.lengths(&trace, &wanted)?;
        Some(Pieces::divided(parameters, trace, lengths, Some(climb)))
    }

    /// About how long they take, in seconds, if the third axis makes this many steps.
    fn seconds(&self, rise: u64, speeds: Speeds) -> f64 {
        let (number, steps) = (self.number() as f64, self.trace.steps as f64);
        // Where the third axis has more steps, it is its steps that the frequency counts.
        let clock = (rise as f64 / steps).max(1.0);
        let speed = (self.frequency * clock).min(f64::from(speeds.highest));
        number * (speeds.seconds(steps * clock / number, speed) + COMMAND)
    }

    /// The trace in pieces of these lengths.
    fn divided(
        parameters: &CurveParameters,
        trace: Trace,
        (first, stride): (u64, u64),
        climb: Option<Climb>,
    ) -> Pieces {
        let frequency = trace.steps as f64 * parameters.velocity / parameters.length();
        // Rounding can make an arc that is shorter than a step one of a step. That takes as long as
        // a step does; on a slope of 45 degrees the engine makes √2 steps for the way of one.
        let most = SQRT_2 * parameters.velocity / parameters.circle.step();
        let frequency = frequency.min(most);
        Pieces { trace, done: 0, first, stride, frequency, climb }
    }

    /// How many pieces there are.
    fn number(&self) -> u64 {
        1 + self.trace.steps.saturating_sub(self.first).div_ceil(self.stride)
    }

    /// The next piece; `third` is where the third axis is and where it must end.
    fn next(
        &mut self,
        plane: Plane,
        third: (i64, i64),
        speeds: Speeds,
    ) -> Option<(Motion, Fitted)> {
        let wanted = if self.done == 0 { self.first } else { self.stride };
        let steps = wanted.min(self.trace.steps - self.done);
        if steps == 0 {
            return None;
        }
        let done = self.done;
        self.done += steps;
        let Some(climb) = self.climb else {
            let (speed, fitted) = speeds.fit(self.frequency);
            let args = self.trace.parameters(done, steps, speed);
            return Some((Motion::Arc(plane, args), fitted));
        };
        let (at, to) = third;
        let is_last = self.done == self.trace.steps;
        let rise = if is_last { to } else { climb.counter(&self.trace, self.done) } - at;
        // Where the third axis has more steps, it is its steps that the frequency counts.
        let clock = rise.unsigned_abs().max(steps) as f64 / steps as f64;
        let (speed, fitted) = speeds.fit(self.frequency * clock);
        let args = self.trace.parameters(done, steps, speed);
        Some((Motion::Helix(plane, args, rise as i32), fitted))
    }
}

/// Why a curve is not one motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The axes of its plane have steps of different lengths, and the circle engine makes circles
    /// of steps.
    UnequalSteps,
    /// The controller has no command for helices.
    NoHelix,
    /// The third axis would not follow the angle.
    Steep,
    /// No circle of whole numbers is near enough.
    OffTheCircle,
}

/// This many chords are made to measure their time; for more it is estimated.
const FEW: f64 = 400.0;

impl Course {
    /// The way that takes least time.
    fn of(parameters: CurveParameters) -> Course {
        let engine = Pieces::of(&parameters);
        let engine = match (engine, parameters.climb()) {
            (Some(pieces), None) => return Course::Engine(pieces),
            (Some(pieces), _) if pieces.number() == 1 => return Course::Engine(pieces),
            (engine, _) => engine,
        };
        let speeds = parameters.speeds;
        let third = parameters.circle.plane().third();
        let rise = (parameters.to[third] - parameters.from[third]).unsigned_abs();
        let chords = Chords::new(parameters);
        let number = chords.number();
        // The longest axis of a chord has some nine tenths of the steps of its length.
        let steps = 0.9 * parameters.circle.length() / parameters.circle.step();
        let speed = 0.9 * parameters.velocity / parameters.circle.step();
        let speed = speed.min(f64::from(speeds.highest));
        let guess = number * (speeds.seconds(steps / number, speed) + COMMAND);
        if number <= FEW {
            // So few take little time.
            let courses = [Some(Course::Chords(chords)), engine.map(Course::Engine)];
            let stairs =
                Stairs::of(&parameters).filter(|stairs| stairs.seconds(rise, speeds) < 2.0 * guess);
            let courses = courses.into_iter().flatten().chain(stairs.map(Course::Stairs));
            let timed = courses.map(|course| {
                let curve = Curve { parameters, at: parameters.from, course };
                let made = curve.made();
                (made.takes + made.pieces as f64 * COMMAND, curve.course)
            });
            let quickest = timed.reduce(|best, other| if other.0 < best.0 { other } else { best });
            return quickest.map_or(Course::Chords(Chords::new(parameters)), |(_, course)| course);
        }
        let mut best = (guess, Course::Chords(chords));
        let engine = engine.map(|pieces| (pieces.seconds(rise, speeds), Course::Engine(pieces)));
        let stairs = Stairs::of(&parameters);
        let stairs = stairs.map(|stairs| (stairs.seconds(rise, speeds), Course::Stairs(stairs)));
        for other in [engine, stairs].into_iter().flatten() {
            if other.0 <= best.0 {
                best = other;
            }
        }
        best.1
    }
}

impl Curve {
    /// The arc or helix with these parameters.
    #[must_use]
    pub fn new(parameters: CurveParameters) -> Curve {
        Curve { parameters, at: parameters.from, course: Course::of(parameters) }
    }

    /// Whether a curve with these parameters is an arc that the controller makes at once.
    #[must_use]
    pub(crate) fn is_one_circle(parameters: &CurveParameters) -> bool {
        let flat = parameters.rise.is_none();
        flat && parameters.wanted().is_some_and(|wanted| wanted.has_trace(ROOM))
    }

    /// The cost of making it in pieces; `None` if it is one motion.
    #[must_use]
    pub fn delay(&self) -> Option<Delay> {
        if let Course::Engine(pieces) = &self.course
            && pieces.number() == 1
        {
            return None;
        }
        Some(self.made()).filter(|delay| delay.pieces > 1)
    }

    /// All pieces, and how long they take.
    fn made(&self) -> Delay {
        let CurveParameters { speeds, velocity, circle, .. } = self.parameters;
        let mut rest = self.clone();
        let (mut delay, mut steps) = (Delay::default(), 0);
        while let Some((motion, _)) = rest.part() {
            let length = motion.path().length();
            delay.pieces += 1;
            delay.takes += speeds.seconds(length as f64, f64::from(motion.speed()));
            // A pure lift of the tool would be done on the way.
            let lifts = matches!(motion, Motion::Line { by, .. }
                if by.iter().enumerate().all(|(axis, steps)| *steps == 0 || axis == circle.plane().third()));
            steps += if lifts { 0 } else { length };
        }
        let speed = steps as f64 * velocity / self.parameters.length();
        let speed = speed.clamp(f64::from(speeds.lowest), f64::from(speeds.highest));
        delay.could_take = speeds.seconds(steps as f64, speed);
        delay
    }

    /// Why it is made in pieces.
    #[must_use]
    pub fn reason(&self) -> Reason {
        let (first, second) = self.parameters.circle.plane().axes();
        let scales = &self.parameters.scales;
        match (scales[first].equals(scales[second]), self.parameters.rise) {
            (false, _) => Reason::UnequalSteps,
            (true, Some(_)) if self.parameters.has_helix => Reason::Steep,
            (true, Some(_)) => Reason::NoHelix,
            (true, None) => Reason::OffTheCircle,
        }
    }

    /// How the speed had to be changed: the greatest change of any part. Finding it takes as long
    /// as making all motions.
    #[must_use]
    pub fn fitted(&self) -> Fitted {
        let mut rest = self.clone();
        std::iter::from_fn(|| rest.part()).map(|(_, fitted)| fitted).max().unwrap_or_default()
    }

    /// The next motion of the arc or helix itself.
    fn part(&mut self) -> Option<(Motion, Fitted)> {
        let CurveParameters { circle, to, speeds, .. } = self.parameters;
        let third = circle.plane().third();
        let (motion, fitted) = match &mut self.course {
            Course::Engine(pieces) => {
                pieces.next(circle.plane(), (self.at[third], to[third]), speeds)?
            }
            Course::Stairs(stairs) => {
                stairs.next(circle.plane(), (self.at[third], to[third]), speeds)?
            }
            Course::Chords(chords) => {
                let at = self.at;
                let target = chords.find(|target| *target != at)?;
                self.line_to(target)
            }
        };
        let path = motion.path();
        let by = path.at(path.length());
        for (at, by) in self.at.iter_mut().zip(by) {
            *at += by;
        }
        Some((motion, fitted))
    }

    /// The straight line to a place.
    fn line_to(&self, target: Steps) -> (Motion, Fitted) {
        let by: Steps = std::array::from_fn(|axis| target[axis] - self.at[axis]);
        let longest = by.iter().fold(0, |longest, steps| steps.abs().max(longest));
        let square = by.iter().zip(self.parameters.scales).fold(0.0, |sum, (steps, scale)| {
            let way = *steps as f64 * scale.step();
            sum + way * way
        });
        let frequency = self.parameters.velocity * longest as f64 / libm::sqrt(square);
        let (speed, fitted) = self.parameters.speeds.fit(frequency);
        (Motion::Line { by, speed }, fitted)
    }
}

impl Iterator for Curve {
    type Item = Motion;

    fn next(&mut self) -> Option<Motion> {
        if let Some((motion, _)) = self.part() {
            return Some(motion);
        }
        let to = self.parameters.to;
        if self.at == to {
            return None;
        }
        let (correction, _) = self.line_to(to);
        self.at = to;
        Some(correction)
    }
}
