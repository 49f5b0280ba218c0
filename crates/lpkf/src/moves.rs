//! Moves: from a place to a segment, what is in its way, and what it leaves behind.

use vimc4_device::{AXES, Event, Kinds, Motion, Point, Time};
use vimc4_motion::{Chain, Line, Path, Profile, Segment, Stretch, Sweep, Turn as Sense, chord};
use vimc4_plant::{End, Unit};

use crate::Controller;
use crate::language::{Axis, Turn, Vector};
use crate::model::CommandSet;
use crate::state::{Activity, Link, Meeting, Moving, State, Stop};
use crate::why::Why;

/// nm in a µm.
const PER_MICROMETRE: u64 = 1_000;
/// Thousandths of a second of arc in a tenth of a degree.
const PER_TENTH: u64 = 360_000;
/// nm in a mm.
const PER_MILLIMETRE: u64 = 1_000_000;
/// Thousandths of a second of arc in a thousandth of a radian: 648,000/π.
const PER_MILLIRADIAN: u64 = 206_265;

impl Moving {
    /// When it ends, by itself or because of what it meets.
    pub(crate) fn due(&self) -> Time {
        let profile = &self.segment.profile;
        let nanos = match self.event {
            Some((step, _)) if step <= profile.steps() => profile.time_of(step),
            _ => profile.duration(),
        };
        self.began.after_nanos(nanos)
    }

    /// How many steps have been made at `now`.
    pub(crate) fn steps_at(&self, now: Time) -> u64 {
        self.segment.profile.steps_at(now.nanos_since(self.began))
    }

    /// What is left of its path after so many steps.
    pub(crate) fn rest(&self, mut steps: u64) -> Vec<Link> {
        let mut rest = Vec::new();
        for Link { path, stretches } in &self.links {
            let made = steps.min(path.length());
            steps -= made;
            if made < path.length() {
                let stretches = cut(stretches, made, path.length());
                rest.push(Link { path: path.after(made), stretches });
            }
        }
        rest
    }
}

impl Link {
    /// A straight way.
    pub(crate) fn line(delta: &Point, scale: &[u64; AXES]) -> Link {
        let stretches = vec![Stretch::line(delta, scale)];
        Link { path: Path::Line(Line::new(*delta)), stretches }
    }
}

/// What lies between two steps of some stretches.
fn cut(stretches: &[Stretch], from: u64, to: u64) -> Vec<Stretch> {
    let mut behind = 0;
    let mut within = Vec::new();
    for stretch in stretches {
        let (begin, end) = (behind.max(from), (behind + stretch.steps).min(to));
        if begin < end {
            within.push(part(*stretch, end - begin));
        }
        behind += stretch.steps;
    }
    within
}

/// So many steps of a stretch.
fn part(stretch: Stretch, steps: u64) -> Stretch {
    let length = u128::from(stretch.length) * u128::from(steps) / u128::from(stretch.steps.max(1));
    Stretch { steps, length: u64::try_from(length).unwrap_or(u64::MAX) }
}

impl State {
    pub(crate) fn is_rotary(&self, axis: Axis) -> bool {
        self.plant.machine().axis(axis.index()).unit == Unit::Rotary
    }

    /// Steps a second of an axis at a speed in nm/s or thousandths of a second of arc a second.
    pub(crate) fn steps_per_second(&self, axis: Axis, speed: u64) -> u32 {
        let resolution = u128::from(self.settings.resolution[axis.index()]);
        let hertz = u128::from(speed) * 1_000 / resolution.max(1);
        u32::try_from(hertz).unwrap_or(u32::MAX).max(1)
    }
}

impl Controller {
    // --- speeds ---

    pub(crate) fn is_rotary(&self, axis: Axis) -> bool {
        self.state.is_rotary(axis)
    }

    /// The speed of an axis by itself, nm/s or thousandths of a second of arc a second.
    pub(crate) fn axis_speed(&self, axis: Axis) -> u64 {
        let speed = u64::from(self.state.settings.axis_speed[axis.index()]);
        speed * if self.is_rotary(axis) { PER_TENTH } else { PER_MICROMETRE }
    }

    /// Its acceleration, nm/s² or thousandths of a second of arc a second a second.
    pub(crate) fn axis_acceleration(&self, axis: Axis) -> u64 {
        let acceleration = u64::from(self.state.settings.acceleration[axis.index()]);
        acceleration * if self.is_rotary(axis) { PER_MILLIRADIAN } else { PER_MILLIMETRE }
    }

    /// The speed of X and Y together of an SMCU, nm/s.
    pub(crate) fn plane_speed(&self) -> u64 {
        let settings = &self.state.settings;
        let speed = if self.state.head_down { settings.speed_down } else { settings.speed_up };
        u64::from(speed) * PER_MICROMETRE
    }

    /// Speed and acceleration along a straight way. An SMCU keeps the speed of the path, and of Z
    /// on a way in space; in a MotionSystem each axis keeps within its own.
    fn pace(&self, delta: &Point) -> (u64, u64) {
        let in_plane = delta[0] != 0 || delta[1] != 0;
        let is_smcu = self.state.model.command_set == CommandSet::Smcu;
        if is_smcu && in_plane && delta[2] == 0 {
            return (self.plane_speed(), self.axis_acceleration(Axis::X));
        }
        let resolution = &self.state.settings.resolution;
        let whole = u128::from(chord(delta, resolution));
        let slowest = |of_axis: &dyn Fn(Axis) -> u64| {
            let moved = Axis::ALL.into_iter().filter(|axis| delta[axis.index()] != 0);
            let along = moved.map(|axis| {
                let steps = u128::from(delta[axis.index()].unsigned_abs());
                let share = steps * u128::from(resolution[axis.index()]);
                u128::from(of_axis(axis)) * whole / share.max(1)
            });
            u64::try_from(along.min().unwrap_or(1)).unwrap_or(u64::MAX)
        };
        if is_smcu {
            let of_z = |axis| if axis == Axis::Z0 { self.axis_speed(axis) } else { u64::MAX };
            let along = if in_plane { self.plane_speed() } else { u64::MAX };
            return (slowest(&of_z).min(along), self.axis_acceleration(Axis::Z0));
        }
        (slowest(&|axis| self.axis_speed(axis)), slowest(&|axis| self.axis_acceleration(axis)))
    }

    /// Speed and acceleration along a curve in the plane of two axes.
    fn pace_in_plane(&self, [a, b]: [Axis; 2]) -> (u64, u64) {
        let acceleration = self.axis_acceleration(a).min(self.axis_acceleration(b));
        match self.state.model.command_set {
            CommandSet::Smcu => (self.plane_speed(), acceleration),
            CommandSet::MotionSystem => (self.axis_speed(a).min(self.axis_speed(b)), acceleration),
        }
    }

    // --- from a stage to a segment ---

    pub(crate) fn begin_line(&mut self, to: Point) {
        let from = self.state.position;
        if to == from {
            return;
        }
        let delta: Point = std::array::from_fn(|axis| to[axis] - from[axis]);
        let (speed, acceleration) = self.pace(&delta);
        let link = Link::line(&delta, &self.state.settings.resolution);
        self.begin_links(vec![link], speed, acceleration);
    }

    pub(crate) fn begin_arc(&mut self, centre: [i64; 2], angle: i64) {
        let [x, y] = [0, 1].map(|axis| centre[axis] - self.state.position[axis]);
        let Some(sweep) = Sweep::by_angle((0, 1), (x, y), angle.saturating_mul(1_000)) else {
            return self.fail(Why::TooFar);
        };
        let (speed, acceleration) = self.pace_in_plane([Axis::X, Axis::Y]);
        let stretches = sweep.stretches(&self.state.settings.resolution);
        self.begin_links(vec![Link { path: sweep.path(), stretches }], speed, acceleration);
    }

    /// Follows vectors: one motion whose speed changes along each of them. It begins and, if the
    /// changes of speed make it so, ends at a standstill.
    pub(crate) fn begin_vectors(&mut self, axes: [Axis; 2], vectors: &[Vector]) {
        let plane = (axes[0].index(), axes[1].index());
        let scale = self.state.settings.resolution;
        let most = self.state.model.limits.speed_max;
        let (mut links, mut stretches, mut speeds) = (Vec::new(), Vec::new(), Vec::new());
        let (mut speed, mut top) = (0i64, 0);
        for vector in vectors {
            let [x, y] = vector.end.map(i64::from);
            let link = match vector.turn {
                Turn::Straight => {
                    let mut delta = Point::default();
                    (delta[plane.0], delta[plane.1]) = (x, y);
                    Link::line(&delta, &scale)
                }
                turn => {
                    let sense = match turn {
                        Turn::Clockwise => Sense::Clockwise,
                        _ => Sense::Counterclockwise,
                    };
                    let [i, j] = vector.centre.map(i64::from);
                    let Some(sweep) = Sweep::to_point(plane, (i, j), (x, y), sense) else {
                        return self.fail(Why::TooFar);
                    };
                    Link { path: sweep.path(), stretches: sweep.stretches(&scale) }
                }
            };
            speed += i64::from(vector.speed_change);
            if !(0..=i64::from(most)).contains(&speed) {
                return self.fail(Why::VectorSpeed { vector: links.len() as u32 + 1, speed });
            }
            let to = speed.unsigned_abs() * PER_MICROMETRE;
            top = top.max(to);
            if let Some(before) = link.stretches.len().checked_sub(1) {
                speeds.extend(std::iter::repeat_n(None, before).chain([Some(to)]));
            }
            stretches.extend_from_slice(&link.stretches);
            links.push(link);
        }
        let (_, acceleration) = self.pace_in_plane(axes);
        let Some(profile) = Profile::vectors(0, &stretches, &speeds, acceleration) else {
            // A vector that begins and ends at a standstill never ends.
            return self.fail(Why::VectorsStandStill);
        };
        self.begin_motion(links, profile, (top, acceleration));
    }

    /// From standstill to standstill along these links.
    pub(crate) fn begin_links(&mut self, links: Vec<Link>, speed: u64, acceleration: u64) {
        let stretches = links.iter().flat_map(|link| link.stretches.iter().copied());
        let profile = Profile::trapezoid(stretches, speed, acceleration);
        self.begin_motion(links, profile, (speed, acceleration));
    }

    fn begin_motion(&mut self, links: Vec<Link>, mut profile: Profile, pace: (u64, u64)) {
        let path = match links.as_slice() {
            [link] => link.path.clone(),
            links => Path::Chain(Chain::new(links.iter().map(|link| link.path.clone()))),
        };
        if path.length() == 0 {
            return;
        }
        let border = self.border_ahead(&path);
        if let Some((steps, _)) = border {
            // The end is known beforehand, so the motion halts there along its ramp.
            let stretches: Vec<Stretch> =
                links.iter().flat_map(|link| link.stretches.iter().copied()).collect();
            profile = Profile::trapezoid(cut(&stretches, 0, steps), pace.0, pace.1);
        }
        let border = border.map(|(_, border)| border);
        let event =
            self.switch_ahead(&path, 0).map(|(step, axis, end)| (step, Meeting::Limit(axis, end)));
        self.start(Segment { path, profile }, links, pace, event, border);
    }

    /// Starts a motion.
    pub(crate) fn start(
        &mut self,
        segment: Segment,
        links: Vec<Link>,
        pace: (u64, u64),
        event: Option<(u64, Meeting)>,
        border: Option<(Axis, End)>,
    ) {
        if self.wants(Kinds::MOTION) {
            let segment = Box::new(segment.clone());
            self.emit(Event::Motion(Motion::Begins { origin: self.state.position, segment }));
        }
        let began = self.state.now;
        let moving = Moving { segment, began, links, pace, event, border, braking: None };
        self.set_activity(Activity::Moving(Box::new(moving)));
    }

    // --- what is in the way ---

    /// After how many steps a path is about to leave the window or a range, and at which end of
    /// which axis. An axis that is outside already may come back.
    fn border_ahead(&self, path: &Path) -> Option<(u64, (Axis, End))> {
        Axis::ALL
            .into_iter()
            .flat_map(|axis| {
                let here = self.state.position[axis.index()];
                let (low, high) = self.state.settings.borders(axis.index());
                [
                    (axis, End::Negative, low.min(here) - 1 - here),
                    (axis, End::Positive, high.max(here) + 1 - here),
                ]
            })
            .filter_map(|(axis, end, beyond)| {
                Some((path.first_at(axis.index(), beyond)? - 1, (axis, end)))
            })
            .min_by_key(|(step, _)| *step)
    }

    /// The first step after `from` at which a path, which begins where the carriages stand, runs
    /// onto a limit switch. An axis that stands on one may not go further onto it.
    pub(crate) fn switch_ahead(&self, path: &Path, from: u64) -> Option<(u64, Axis, End)> {
        let rest = path.after(from);
        let done = path.at(from);
        let mut first: Option<(u64, Axis, End)> = None;
        for axis in self.state.fitted() {
            for end in [End::Negative, End::Positive] {
                let Some(step) = self.switch_of(&rest, axis, end, self.carriage_after(axis, &done))
                else {
                    continue;
                };
                if first.is_none_or(|(earliest, ..)| from + step < earliest) {
                    first = Some((from + step, axis, end));
                }
            }
        }
        first
    }

    /// The step at which a path meets one switch of an axis whose carriage is at a place.
    fn switch_of(&self, path: &Path, axis: Axis, end: End, place: i64) -> Option<u64> {
        let index = axis.index();
        let sign = self.state.carriage_sign(index);
        let outwards = if end == End::Positive { 1 } else { -1 };
        let edge = self.state.plant.machine().axis(index).switch(end);
        if !self.state.plant.pressed_at(index, end, place) {
            let edge = edge?;
            return path.first_at(index, sign * (edge - place));
        }
        // The last step before it would go further.
        let further = path.first_at(index, sign * outwards).map(|step| step.saturating_sub(1));
        // Or, once it has left the switch, the step back onto it.
        let again = edge.filter(|_| !self.state.plant.is_held(index, end)).and_then(|edge| {
            let left = path.first_at(index, sign * (edge - outwards - place))?;
            let back = path.after(left).first_at(index, sign * outwards)?;
            Some(left + back)
        });
        further.into_iter().chain(again).min()
    }

    /// Where the carriage of an axis is after an offset of the counters from standstill.
    pub(crate) fn carriage_after(&self, axis: Axis, offset: &Point) -> i64 {
        let index = axis.index();
        self.state.plant.carriage()[index] + self.state.carriage_sign(index) * offset[index]
    }

    // --- at the end ---

    /// A motion has come to its end, to a border or to a switch.
    pub(crate) fn motion_ended(&mut self, moving: Moving) {
        let steps = moving.segment.profile.steps();
        if let Some((step, meeting)) = moving.event.filter(|(step, _)| *step <= steps) {
            self.commit(&moving.segment, step);
            return match meeting {
                Meeting::Edge => {}
                Meeting::Limit(axis, end) => {
                    self.switch_event(axis, end, true);
                    let at = self.state.position[axis.index()];
                    let why = Why::Limit { axis, end, at, by_hand: false };
                    self.break_off(Some((&moving, step)), Stop::Limit, why);
                }
            };
        }
        self.commit(&moving.segment, steps);
        if let Some((stop, why)) = moving.braking {
            self.break_off(Some((&moving, steps)), stop, why);
        } else if let Some((axis, end)) = moving.border {
            self.break_off(Some((&moving, steps)), Stop::SoftFrame, Why::Border(axis, end));
        }
    }

    /// Makes `steps` steps of a segment final: counters and carriages move.
    pub(crate) fn commit(&mut self, segment: &Segment, steps: u64) {
        let offset = segment.path.at(steps);
        let (low, high) = segment.path.extent(steps);
        for (position, offset) in self.state.position.iter_mut().zip(offset) {
            *position += offset;
        }
        let signs = std::array::from_fn(|axis| self.state.carriage_sign(axis));
        let lost = self.state.plant.follow(&signs, &offset, &low, &high);
        if self.wants(Kinds::WARNING) {
            for (axis, &steps) in lost.iter().enumerate().filter(|(_, steps)| **steps != 0) {
                let name = Axis::from_index(axis).map_or("?", |axis| self.axis_name(axis));
                let machine = self.state.plant.machine();
                let warning = machine.steps_lost(axis, name, -steps, false);
                self.emit(Event::Warning(warning));
            }
        }
        if self.wants(Kinds::MOTION) {
            self.emit(Event::Motion(Motion::Ends { steps }));
        }
    }

    pub(crate) fn switch_event(&mut self, axis: Axis, end: End, active: bool) {
        if self.wants(Kinds::SWITCH) {
            let positive = end == End::Positive;
            self.emit(Event::Switch { axis: axis.index() as u8, positive, active });
        }
    }
}

/// A line of one axis.
pub(crate) fn along(axis: Axis, steps: i64) -> Path {
    let mut delta = [0; AXES];
    delta[axis.index()] = steps;
    Path::Line(Line::new(delta))
}
