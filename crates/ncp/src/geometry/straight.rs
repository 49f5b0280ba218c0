//! Straight moves of X, Y, Z and A.
//!
//! A controller moves A after the other axes, or without keeping time with them. Here the two move
//! in turn, in pieces so short that neither is ever more than one step from its place in a common
//! move.
//!
//! # The pieces
//!
//! Of X, Y, Z the longest stands for all three: the others follow it. Of that axis and A, call the
//! one with more steps, M, the major, the one with fewer, m, the minor. Moved together, the minor
//! would be at step `j` while the major is near `j·M / m`. So the major goes on until the minor is
//! one step behind, the minor makes two steps and is one step ahead, and so on: the major halts
//! near the steps 1, 3, 5 … of the minor, and the minor goes to 2, 4, 6 …. These are `m + 1`
//! pieces. Fewer are not enough: each but the first and the last can make up for two steps of the
//! minor, and those two for one. Where k steps are allowed instead of one, it is the steps k, 3k,
//! 5k … and 2k, 4k, 6k …, which are a kth of the pieces.

use vimc4_motion::{AXES, Path, StraightLine};

use super::{Delay, MOST_STEPS, Motion, Speeds, Steps};

/// What a straight move is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StraightParameters {
    /// The way of each axis.
    pub by: Steps,
    /// The speed of the longest of X, Y and Z, in Hz.
    pub speed: u32,
    /// The speed of A, in Hz.
    pub a_speed: u32,
    /// Whether it is at the rapid speed.
    pub is_rapid: bool,
    /// How many steps either may be from where it would be together with the other, 1 or more.
    pub apart: u32,
}

/// The motions that make up a straight move, computed one by one: there may be millions.
#[derive(Clone, Debug, PartialEq)]
pub struct Straight {
    parameters: StraightParameters,
    /// X, Y and Z as one line, from the beginning to the end.
    line: Path,
    /// How many steps the longest of X, Y, Z has and how many it has made.
    linear: Way,
    /// The same of A, without its sign.
    a: Way,
}

/// The progress of one of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Way {
    whole: i64,
    made: i64,
}

impl Way {
    fn new(whole: i64) -> Way {
        Way { whole, made: 0 }
    }

    fn is_over(self) -> bool {
        self.made == self.whole
    }
}

/// Where the major is to halt, so that the minor is this many steps behind.
fn halt(major: Way, minor: Way, apart: i64) -> i64 {
    let step = i128::from(minor.made.saturating_add(apart));
    if step > i128::from(minor.whole) {
        return major.whole;
    }
    // Rounded to the nearest: together, the minor would be at that very step.
    let twice = 2 * step * i128::from(major.whole) / i128::from(minor.whole);
    // No more than the whole way, which is an `i64`.
    i64::try_from((twice + 1) / 2).unwrap_or(major.whole)
}

impl Straight {
    /// The move with these parameters.
    #[must_use]
    pub fn new(parameters: StraightParameters) -> Straight {
        let [x, y, z, a] = parameters.by;
        let line = Path::Line(StraightLine::new([x, y, z, 0, 0, 0]));
        let linear = Way::new(x.abs().max(y.abs()).max(z.abs()));
        Straight { parameters, line, linear, a: Way::new(a.abs()) }
    }

    /// Whether it is at the rapid speed.
    #[must_use]
    pub fn is_rapid(&self) -> bool {
        self.parameters.is_rapid
    }

    /// The cost of moving A separately from the others; `None` where only one of the two moves. It
    /// is quickly computed for any number of pieces.
    #[must_use]
    pub fn delay(&self, speeds: Speeds) -> Option<Delay> {
        let StraightParameters { speed, a_speed, apart, .. } = self.parameters;
        if self.linear.whole == 0 || self.a.whole == 0 {
            return None;
        }
        let linear = (self.linear, f64::from(speed));
        let a = (self.a, f64::from(a_speed));
        let ((major, fast), (minor, slow)) =
            if self.a.whole <= self.linear.whole { (linear, a) } else { (a, linear) };
        let apart = i64::from(apart.max(1));
        let mut delay = Delay {
            could_take: [linear, a].into_iter().fold(0.0, |most: f64, (way, speed)| {
                most.max(speeds.seconds(way.whole as f64, speed))
            }),
            ..Delay::default()
        };
        let mut add = |number: i64, steps: i64, speed: f64| {
            if number > 0 && steps > 0 {
                delay.pieces += number.unsigned_abs();
                delay.takes += number as f64 * speeds.seconds(steps as f64, speed);
            }
        };
        // The minor is alternately as far behind as it may be, and ahead.
        let times = if minor.whole < apart { 0 } else { (minor.whole - apart) / (2 * apart) + 1 };
        let place = |time: i64| halt(major, Way { made: 2 * apart * time, ..minor }, apart);
        if times == 0 {
            add(1, major.whole, fast);
        } else {
            let (first, last) = (place(0), place(times - 1));
            add(1, first, fast);
            // All between have the same length, or a step more.
            let between = (times - 1).max(1);
            let (length, more) = ((last - first) / between, (last - first) % between);
            add(more, length + 1, fast);
            add(times - 1 - more, length, fast);
            add(1, major.whole - last, fast);
            add(times - 1, 2 * apart, slow);
            add(1, (minor.whole - 2 * apart * (times - 1)).min(2 * apart), slow);
        }
        add(1, minor.whole - 2 * apart * times, slow);
        Some(delay)
    }

    /// Moves X, Y and Z on to a step of their longest, or as far as one command goes.
    fn move_linear(&mut self, target: i64) -> Motion {
        let from = self.linear.made;
        self.linear.made = target.min(from + MOST_STEPS);
        let place = |made: i64| self.line.at(made.unsigned_abs());
        let (here, there): ([i64; AXES], _) = (place(from), place(self.linear.made));
        let by = [there[0] - here[0], there[1] - here[1], there[2] - here[2], 0];
        Motion::Line { by, speed: self.parameters.speed }
    }

    /// Moves A on to one of its steps, or as far as one command goes.
    fn move_a(&mut self, target: i64) -> Motion {
        let from = self.a.made;
        self.a.made = target.min(from + MOST_STEPS);
        let sign = self.parameters.by[3].signum();
        let by = [0, 0, 0, sign * (self.a.made - from)];
        Motion::Line { by, speed: self.parameters.a_speed }
    }
}

impl Iterator for Straight {
    type Item = Motion;

    fn next(&mut self) -> Option<Motion> {
        if self.linear.is_over() && self.a.is_over() {
            return None;
        }
        let a_is_minor = self.a.whole <= self.linear.whole;
        let (major, minor) = if a_is_minor { (self.linear, self.a) } else { (self.a, self.linear) };
        let apart = i64::from(self.parameters.apart.max(1));
        let halt = halt(major, minor, apart);
        let (major_moves, target) = match major.made < halt {
            true => (true, halt),
            false => (false, minor.whole.min(minor.made.saturating_add(2 * apart))),
        };
        Some(if major_moves == a_is_minor { self.move_linear(target) } else { self.move_a(target) })
    }
}
