//! One motion of a plot, and the curve that it is.

use vimc4_motion::{AXES, ArcState, Path, Point, Segment, Time};

use crate::frame::{added, distance, scaled};

/// What a motion is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Purpose {
    /// A reference run.
    Reference,
    /// On the way: with the head up, at the rapid speed of a job, or by its own momentum.
    Rapid,
    /// Anything else.
    #[default]
    Work,
}

/// One motion.
#[derive(Clone, Debug)]
pub struct Leg {
    /// When it began.
    pub began: Time,
    /// When it ended.
    pub ends: Time,
    /// Where it began, in steps.
    pub from: Point,
    /// How it went.
    pub(crate) course: Course,
    /// How many clock steps were made.
    pub made: u64,
    /// What of its motion had been made before.
    pub(crate) over: Over,
    /// What it was for.
    pub purpose: Purpose,
}

/// What of a motion was over before a leg begins: clock steps and nanoseconds. That is nothing, unless
/// somebody went back into the middle of it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Over {
    pub(crate) steps: u64,
    pub(crate) nanos: u64,
}

impl Over {
    /// What is left of a motion: its whole profile, and the rest of its path.
    pub(crate) fn rest(self, segment: &Segment) -> Box<Segment> {
        let path = segment.path.after(self.steps);
        Box::new(Segment { path, profile: segment.profile.clone() })
    }

    /// How many clock steps of the rest have been made when so much time has passed in it.
    pub(crate) fn steps_at(self, rest: &Segment, nanos: u64) -> u64 {
        rest.profile.steps_at(nanos.saturating_add(self.nanos)).saturating_sub(self.steps)
    }
}

/// How a motion went.
#[derive(Clone, Debug)]
pub(crate) enum Course {
    /// So.
    Made(Box<Segment>),
    /// Several short ones were taken together: straight by so much.
    Together(Point),
}

/// A place of a motion: after how many clock steps, and where, from its beginning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vertex {
    /// Clock steps.
    pub step: u64,
    /// Steps of the axes.
    pub offset: Point,
    /// How it is reached.
    pub way: Way,
}

/// How a vertex is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// On a straight line.
    Straight,
    /// On a part of a circle.
    Round,
    /// On turns of a circle that has been gone round before.
    Again,
}

/// Whether a place is near a chord.
type Near<'n> = &'n dyn Fn(&Point, &Point, &Point) -> bool;

impl Leg {
    /// Where it ends.
    #[must_use]
    pub fn to(&self) -> Point {
        added(&self.from, &self.offset(self.made))
    }

    /// Where it is after a number of clock steps, from its beginning.
    pub(crate) fn offset(&self, step: u64) -> Point {
        match &self.course {
            Course::Made(segment) => segment.path.at(step.min(self.made)),
            Course::Together(way) => {
                way.map(|way| (way as f64 * step as f64 / self.made.max(1) as f64) as i64)
            }
        }
    }

    /// When a clock step was made.
    pub(crate) fn time_of(&self, step: u64) -> Time {
        match &self.course {
            _ if step == 0 => self.began,
            Course::Made(segment) => {
                let nanos = segment.profile.time_of(step.saturating_add(self.over.steps));
                self.began.after_nanos(nanos.saturating_sub(self.over.nanos))
            }
            Course::Together(_) => {
                let span = self.ends.nanos_since(self.began) as f64;
                self.began.after_nanos((span * step as f64 / self.made.max(1) as f64) as u64)
            }
        }
    }

    /// How many clock steps were made at a time.
    pub(crate) fn steps_at(&self, at: Time) -> u64 {
        let nanos = at.nanos_since(self.began);
        match &self.course {
            Course::Made(segment) => self.over.steps_at(segment, nanos).min(self.made),
            Course::Together(_) => {
                let span = self.ends.nanos_since(self.began).max(1);
                let steps = u128::from(self.made) * u128::from(nanos.min(span)) / u128::from(span);
                u64::try_from(steps).unwrap_or(self.made)
            }
        }
    }

    /// The step frequency at a time, Hz; 0 of what takes no time.
    pub(crate) fn frequency(&self, at: Time) -> f64 {
        match &self.course {
            Course::Made(segment) => {
                let nanos = at.nanos_since(self.began).saturating_add(self.over.nanos);
                segment.profile.speed_at(nanos) as f64 / 1e6
            }
            Course::Together(_) => match self.ends.nanos_since(self.began) {
                0 => 0.0,
                nanos => self.made as f64 * 1e9 / nanos as f64,
            },
        }
    }

    /// How fast it goes along its way when half of its time is over, in the units of `scales` a second.
    pub(crate) fn pace(&self, scales: &[f64; AXES]) -> f64 {
        let half = self.ends.nanos_since(self.began) / 2;
        let even = match &self.course {
            Course::Made(segment) => {
                let steps = self.over.steps..self.over.steps.saturating_add(self.made);
                let nanos = half.saturating_add(self.over.nanos);
                segment.profile.even_speed_at(nanos, steps) as f64 / 1e6
            }
            Course::Together(_) => self.frequency(self.began),
        };
        even * self.length(scales) / self.made.max(1) as f64
    }

    /// When its ramps begin and end, its own end included.
    pub(crate) fn knees(&self) -> Vec<Time> {
        let steps = match &self.course {
            Course::Made(segment) => segment.profile.knees(),
            Course::Together(_) => Vec::new(),
        };
        let here = steps.into_iter().filter_map(|step| step.checked_sub(self.over.steps));
        let before = here.filter(|step| *step < self.made);
        let mut knees: Vec<Time> = before.map(|step| self.time_of(step)).collect();
        knees.push(self.ends);
        knees
    }

    /// Whether the axes keep their shares of the way.
    pub(crate) fn is_straight(&self) -> bool {
        !matches!(&self.course, Course::Made(segment) if !matches!(segment.path, Path::Line(_)))
    }

    /// How much of a step each axis makes with a clock step, on average around one.
    pub(crate) fn shares(&self, step: u64) -> [f64; AXES] {
        match &self.course {
            Course::Made(segment) => {
                let (part, step) = segment.path.link_at(step);
                shares(part, step)
            }
            Course::Together(way) => way.map(|way| way as f64 / self.made.max(1) as f64),
        }
    }

    /// The vertices of a polyline from which the curve is nowhere further away than `tolerance` in
    /// the units of `scales`, or than a step and a half where that is more. The beginning is not
    /// among them.
    #[must_use]
    pub fn vertices(&self, scales: &[f64; AXES], tolerance: f64) -> Vec<Vertex> {
        let step = scales.iter().fold(0.0_f64, |most, scale| most.max(*scale));
        let tolerance = tolerance.max(1.5 * step);
        let near = |from: &Point, to: &Point, at: &Point| -> bool {
            beside(&scaled(from, scales), &scaled(to, scales), &scaled(at, scales)) <= tolerance
        };
        let mut vertices = Vec::new();
        match &self.course {
            Course::Together(way) => {
                vertices.push(Vertex { step: self.made, offset: *way, way: Way::Straight });
            }
            Course::Made(segment) => curve(&segment.path, self.made, &near, &mut vertices),
        }
        vertices
    }

    /// The lowest and the highest places of its axes.
    pub(crate) fn extent(&self) -> (Point, Point) {
        match &self.course {
            Course::Made(segment) => {
                let (low, high) = segment.path.extent(self.made);
                (added(&self.from, &low), added(&self.from, &high))
            }
            Course::Together(way) => {
                let to = added(&self.from, way);
                (
                    std::array::from_fn(|axis| to[axis].min(self.from[axis])),
                    std::array::from_fn(|axis| to[axis].max(self.from[axis])),
                )
            }
        }
    }

    /// Whether an axis moves.
    pub(crate) fn travels(&self, axis: usize) -> bool {
        let (low, high) = self.extent();
        low[axis] != high[axis]
    }

    /// How long it is in the units of `scales`.
    pub(crate) fn length(&self, scales: &[f64; AXES]) -> f64 {
        let mut last = [0.0; AXES];
        let mut sum = 0.0;
        for vertex in self.vertices(scales, 0.0) {
            let next = scaled(&vertex.offset, scales);
            sum += distance(&last, &next);
            last = next;
        }
        sum
    }

    /// Whether the next motion can be taken together with this one without leaving its beginning by
    /// more than `reach` steps.
    pub(crate) fn takes(&self, next: &Leg, reach: i64) -> bool {
        let ends = [self.extent(), next.extent()];
        let mut ends = ends.iter().flat_map(|(low, high)| [low, high]);
        self.purpose == next.purpose
            && self.to() == next.from
            && ends.all(|end| (0..AXES).all(|axis| (end[axis] - self.from[axis]).abs() <= reach))
    }

    /// Takes the next motion together with this one.
    pub(crate) fn take(&mut self, next: &Leg) {
        let end = next.to();
        self.course = Course::Together(std::array::from_fn(|axis| end[axis] - self.from[axis]));
        self.ends = next.ends;
        self.made += next.made;
    }
}

/// See [`Leg::shares`]. On a circle the axes share the steps as its tangent says.
fn shares(path: &Path, step: u64) -> [f64; AXES] {
    let length = path.length();
    let even = path.at(length).map(|way| way as f64 / length.max(1) as f64);
    let Some(((first, second), ArcState { x, y, rx, ry, .. })) = path.circle_at(step) else {
        return even;
    };
    let travel = path.travel(length);
    let round = (travel[first] + travel[second]) as f64 / length.max(1) as f64;
    let whole = (x.abs() + y.abs()).max(1) as f64;
    let mut shares = even;
    shares[first] = round * f64::from(rx) * y.abs() as f64 / whole;
    shares[second] = round * f64::from(ry) * x.abs() as f64 / whole;
    shares
}

/// The vertices of the first clock steps of a path.
fn curve(path: &Path, made: u64, near: Near<'_>, vertices: &mut Vec<Vertex>) {
    let made = made.min(path.length());
    match path {
        Path::Line(_) => {
            vertices.push(Vertex { step: made, offset: path.at(made), way: Way::Straight })
        }
        Path::Chain(chain) => {
            let (mut before, mut start) = (0, [0; AXES]);
            for link in Vec::from(chain.clone()) {
                if before >= made {
                    break;
                }
                let first = vertices.len();
                curve(&link, made - before, near, vertices);
                for vertex in vertices.iter_mut().skip(first) {
                    vertex.step += before;
                    vertex.offset = added(&start, &vertex.offset);
                }
                before += link.length();
                start = added(&start, &link.at(link.length()));
            }
        }
        Path::Arc(_) | Path::Helix(_) => {
            let new = made.min(path.new_places());
            let ends = [0, new].map(|step| (step, path.at(step), path.travel(step)));
            bend(path, &ends[0], &ends[1], near, vertices);
            if new < made {
                vertices.push(Vertex { step: made, offset: path.at(made), way: Way::Again });
            }
        }
    }
}

/// A clock step of a path, where it is, and how far the axes have travelled.
type Moment = (u64, Point, Point);

/// The vertices of a part of a circle or a helix.
///
/// It is one chord if no axis turns round and a few places on it are near; such a part has no more than
/// a quarter of a circle.
fn bend(path: &Path, from: &Moment, to: &Moment, near: Near<'_>, vertices: &mut Vec<Vertex>) {
    let (first, last) = (from.0, to.0);
    let is_straight = || {
        let turns =
            (0..AXES).any(|axis| to.2[axis] - from.2[axis] != (to.1[axis] - from.1[axis]).abs());
        !turns
            && [2, 4, 6].iter().all(|eighth| {
                let at = first + ((last - first) / 8) * eighth + ((last - first) % 8) * eighth / 8;
                near(&from.1, &to.1, &path.at(at))
            })
    };
    if last - first <= 2 || is_straight() {
        vertices.push(Vertex { step: last, offset: to.1, way: Way::Round });
        return;
    }
    let middle = first + (last - first) / 2;
    let middle = (middle, path.at(middle), path.travel(middle));
    bend(path, from, &middle, near, vertices);
    bend(path, &middle, to, near, vertices);
}

/// How far a place is beside the chord between two others.
fn beside(from: &[f64; AXES], to: &[f64; AXES], at: &[f64; AXES]) -> f64 {
    let dot = |one: &[f64; AXES], other: &[f64; AXES]| -> f64 {
        one.iter().zip(other).map(|(one, other)| one * other).sum()
    };
    let less =
        |one: &[f64; AXES]| -> [f64; AXES] { std::array::from_fn(|axis| one[axis] - from[axis]) };
    let (chord, way) = (less(to), less(at));
    let square = dot(&chord, &chord);
    let share = if square > 0.0 { (dot(&chord, &way) / square).clamp(0.0, 1.0) } else { 0.0 };
    let foot: [f64; AXES] = std::array::from_fn(|axis| from[axis] + share * chord[axis]);
    distance(&foot, at)
}
