//! Moves: from a target to a motion, the obstacles on its way, and its effects.

use vimc4_device::Point;
use vimc4_motion::{
    Chain, Path, Profile, Segment, StraightLine, Stretch, Sweep, Turn as Sense, chord,
};
use vimc4_plant::{End, Followed, Slide, Way};

use crate::language::{Axis, Side, Turn, Vector};
use crate::state::{ChainLink, Meeting, Moving, Sought, State};
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
    /// The rest of its path after this many steps.
    pub(crate) fn rest(&self, mut steps: u64) -> Vec<ChainLink> {
        let mut rest = Vec::new();
        for ChainLink { path, stretches } in &self.links {
            let made = steps.min(path.length());
            steps -= made;
            if made < path.length() {
                let stretches = cut(stretches, made, path.length());
                rest.push(ChainLink { path: path.after(made), stretches });
            }
        }
        rest
    }
}

/// The part of some stretches between two steps.
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

/// This many steps of a stretch.
fn part(stretch: Stretch, steps: u64) -> Stretch {
    let length = u128::from(stretch.length) * u128::from(steps) / u128::from(stretch.steps.max(1));
    Stretch { steps, length: u64::try_from(length).unwrap_or(u64::MAX) }
}

impl State {
    // --- speeds ---

    /// Steps a second of an axis at a speed in nm/s or thousandths of a second of arc a second.
    pub(crate) fn steps_per_second(&self, axis: Axis, speed: u64) -> u32 {
        let resolution = u128::from(self.settings.resolution[axis.index()]);
        let hertz = u128::from(speed) * 1_000 / resolution.max(1);
        u32::try_from(hertz).unwrap_or(u32::MAX).max(1)
    }

    /// The speed of an axis by itself, nm/s or thousandths of a second of arc a second.
    pub(crate) fn axis_speed(&self, axis: Axis) -> u64 {
        let speed = u64::from(self.settings.axis_speed[axis.index()]);
        speed * if self.is_rotary(axis) { PER_TENTH } else { PER_MICROMETRE }
    }

    /// Its acceleration, nm/s² or thousandths of a second of arc a second a second.
    pub(crate) fn axis_acceleration(&self, axis: Axis) -> u64 {
        let acceleration = u64::from(self.settings.acceleration[axis.index()]);
        acceleration * if self.is_rotary(axis) { PER_MILLIRADIAN } else { PER_MILLIMETRE }
    }

    /// The acceleration of reference runs: that after power-on, whatever the host has set since.
    fn reference_acceleration(&self, axis: Axis) -> u64 {
        let defaults = &self.model.defaults;
        match self.is_rotary(axis) {
            true => u64::from(defaults.turn_acceleration) * PER_MILLIRADIAN,
            false => u64::from(defaults.acceleration) * PER_MILLIMETRE,
        }
    }

    /// The speed of X and Y together of an SMCU, nm/s.
    fn plane_speed(&self) -> u64 {
        let settings = &self.settings;
        let speed = if self.outputs.head_down { settings.speed_down } else { settings.speed_up };
        u64::from(speed) * PER_MICROMETRE
    }

    /// Speed and acceleration along a straight way. An SMCU keeps the speed of the path, and of Z
    /// on a way in space; in a MotionSystem each axis keeps within its own.
    fn pace(&self, delta: &Point) -> (u64, u64) {
        let in_plane = delta[0] != 0 || delta[1] != 0;
        let is_smcu = self.is_smcu();
        if is_smcu && in_plane && delta[2] == 0 {
            return (self.plane_speed(), self.axis_acceleration(Axis::X));
        }
        let resolution = &self.settings.resolution;
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
        match self.is_smcu() {
            true => (self.plane_speed(), acceleration),
            false => (self.axis_speed(a).min(self.axis_speed(b)), acceleration),
        }
    }

    // --- from a stage to a motion ---

    /// Straight to a place, unless all axes are there.
    pub(crate) fn line_to(&mut self, to: Point) -> Option<Moving> {
        let from = self.position;
        if to == from {
            return None;
        }
        let delta: Point = std::array::from_fn(|axis| to[axis] - from[axis]);
        let (speed, acceleration) = self.pace(&delta);
        self.along_links(vec![self.straight(delta)], speed, acceleration)
    }

    /// Round a centre (X and Y, absolute, steps) by millionths of a degree.
    pub(crate) fn arc(&mut self, centre: [i64; 2], angle: i64) -> Result<Option<Moving>, Why> {
        let [x, y] = [0, 1].map(|axis| centre[axis] - self.position[axis]);
        let sweep = Sweep::by_angle((0, 1), (x, y), angle.saturating_mul(1_000));
        let link = self.swept(&sweep.ok_or(Why::TooFar)?);
        let (speed, acceleration) = self.pace_in_plane([Axis::X, Axis::Y]);
        Ok(self.along_links(vec![link], speed, acceleration))
    }

    /// Along vectors: one motion whose speed changes along each of them. It begins and, if the
    /// changes of speed make it so, ends at a standstill.
    pub(crate) fn along_vectors(
        &mut self,
        axes: [Axis; 2],
        vectors: &[Vector],
    ) -> Result<Option<Moving>, Why> {
        let plane = (axes[0].index(), axes[1].index());
        let most = self.model.limits.speed_max;
        let (mut links, mut stretches, mut speeds) = (Vec::new(), Vec::new(), Vec::new());
        let (mut speed, mut top) = (0i64, 0);
        for vector in vectors {
            let (end, centre) = (vector.end.map(i64::from), vector.centre.map(i64::from));
            let link = match vector.turn {
                Turn::Straight => self.straight(in_plane(plane, end)),
                Turn::Clockwise => self.swept(&sweep(plane, centre, end, Sense::Clockwise)?),
                Turn::Counterclockwise => {
                    self.swept(&sweep(plane, centre, end, Sense::Counterclockwise)?)
                }
            };
            speed += i64::from(vector.speed_change);
            if !(0..=i64::from(most)).contains(&speed) {
                return Err(Why::VectorSpeed { vector: links.len() as u32 + 1, speed });
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
        // A vector that begins and ends at a standstill never ends.
        let profile =
            Profile::vectors(0, &stretches, &speeds, acceleration).ok_or(Why::VectorsStandStill)?;
        Ok(self.motion(links, profile, (top, acceleration)))
    }

    /// From standstill to standstill along these links.
    pub(crate) fn along_links(
        &mut self,
        links: Vec<ChainLink>,
        speed: u64,
        acceleration: u64,
    ) -> Option<Moving> {
        let stretches = links.iter().flat_map(|link| link.stretches.iter().copied());
        let profile = Profile::trapezoid(stretches, speed, acceleration);
        self.motion(links, profile, (speed, acceleration))
    }

    /// Along these links up to the first obstacle; `None` if that leaves no way.
    fn motion(
        &mut self,
        links: Vec<ChainLink>,
        mut profile: Profile,
        pace: (u64, u64),
    ) -> Option<Moving> {
        let path = match links.as_slice() {
            [link] => link.path.clone(),
            links => Path::Chain(Chain::new(links.iter().map(|link| link.path.clone()))),
        };
        if path.length() == 0 {
            return None;
        }
        let border = self.border_ahead(&path);
        if let Some((steps, _)) = border {
            // The end is known beforehand, so the motion halts there along its ramp.
            let stretches: Vec<Stretch> =
                links.iter().flat_map(|link| link.stretches.iter().copied()).collect();
            profile = Profile::trapezoid(cut(&stretches, 0, steps), pace.0, pace.1);
        }
        let border = border.map(|(_, border)| border);
        let (segment, began) = (Segment { path, profile }, self.now);
        self.plant.sets_out(&segment);
        let event = self.meets(None, &segment.path, 0);
        Some(Moving { segment, began, links, pace, event, border, braking: None })
    }

    /// A straight way of one axis up to a number of steps a second, with the ramp of the profile, which
    /// meets something or ends at the border of the counter. On a switch the axis halts at once.
    pub(crate) fn creep(
        &mut self,
        axis: Axis,
        (way, border): (i64, Option<(Axis, Side)>),
        speed: u32,
        sought: Option<Sought>,
    ) -> Moving {
        let ChainLink { path, stretches } = self.straight(along(axis, way));
        let resolution = u128::from(self.settings.resolution[axis.index()]);
        let speed = u64::try_from(u128::from(speed) * resolution / 1_000).unwrap_or(u64::MAX);
        let profile = Profile::trapezoid(stretches, speed, self.reference_acceleration(axis));
        let (segment, began) = (Segment { path, profile }, self.now);
        self.plant.sets_out(&segment);
        let event = self.meets(sought, &segment.path, 0);
        Moving { segment, began, links: Vec::new(), pace: (0, 0), event, border, braking: None }
    }

    pub(crate) fn straight(&self, delta: Point) -> ChainLink {
        let stretches = vec![Stretch::line(&delta, &self.settings.resolution)];
        ChainLink { path: Path::Line(StraightLine::new(delta)), stretches }
    }

    fn swept(&self, sweep: &Sweep) -> ChainLink {
        ChainLink { path: sweep.path(), stretches: sweep.stretches(&self.settings.resolution) }
    }

    // --- obstacles ---

    /// After how many steps a path is about to leave the window or a range, and at which end of
    /// which axis. An axis that is outside already may come back.
    fn border_ahead(&self, path: &Path) -> Option<(u64, (Axis, Side))> {
        Axis::ALL
            .into_iter()
            .flat_map(|axis| {
                let here = self.position[axis.index()];
                let (low, high) = self.settings.borders(axis.index());
                [
                    (axis, Side::Negative, low.min(here) - 1 - here),
                    (axis, Side::Positive, high.max(here) + 1 - here),
                ]
            })
            .filter_map(|(axis, side, beyond)| {
                Some((path.first_at(axis.index(), beyond)? - 1, (axis, side)))
            })
            .min_by_key(|(step, _)| *step)
    }

    /// The first step after `from` at which a path, which begins where the carriages stand, runs
    /// onto a limit switch. An axis that stands on one may not go further onto it.
    fn switch_ahead(&self, path: &Path, from: u64) -> Option<(u64, Axis, End)> {
        let mut first: Option<(u64, Axis, End)> = None;
        for axis in self.fitted() {
            for end in [End::Negative, End::Positive] {
                let Some(step) = self.switch_of(path, axis, end, from) else { continue };
                if first.is_none_or(|(earliest, ..)| step < earliest) {
                    first = Some((step, axis, end));
                }
            }
        }
        first
    }

    /// What a motion meets first from a step on: what it looks for, or a switch in its way. Of two at
    /// the same step it is what it looks for.
    pub(crate) fn meets(
        &self,
        sought: Option<Sought>,
        path: &Path,
        from: u64,
    ) -> Option<(u64, Meeting)> {
        let other = self.switch_ahead(path, from);
        let other = other.filter(|(_, _, met)| sought.is_none_or(|sought| sought.end != *met));
        let other = other.map(|(step, axis, met)| (step, Meeting::Limit(axis, met)));
        // A switch that is held by hand does not change, and the axis goes on without end.
        let goal = sought.and_then(|Sought { axis, end, onto }| {
            let (index, signs) = (axis.index(), self.carriage_signs());
            let is_so = |slide: &Slide| self.plant.pressed(index, end, slide) == onto;
            self.plant.first(index, &Way { path, signs: &signs }, from, is_so)
        });
        let goal = goal.map(|step| (step, Meeting::Edge));
        goal.into_iter().chain(other).min_by_key(|(step, _)| *step)
    }

    /// The first step from `from` on at which a path meets one switch of an axis.
    fn switch_of(&self, path: &Path, axis: Axis, end: End, from: u64) -> Option<u64> {
        let (index, signs) = (axis.index(), self.carriage_signs());
        let way = Way { path, signs: &signs };
        let pressed = |slide: &Slide| self.plant.pressed(index, end, slide);
        let met = |from| self.plant.first(index, &way, from, pressed);
        if !pressed(&self.plant.slide_after(index, &way, from)) {
            return met(from);
        }
        // The last step before it would go further.
        let outwards = if end == End::Positive { signs[index] } else { -signs[index] };
        let further = path.after(from).first_at(index, outwards);
        let further = further.map(|step| from + step.saturating_sub(1));
        // Or, once it has left the switch, the step back onto it.
        let left = self.plant.first(index, &way, from, |slide| !pressed(slide));
        further.into_iter().chain(left.and_then(met)).min()
    }

    // --- at the end ---

    /// Makes `steps` steps of a segment final: counters and carriages move.
    pub(crate) fn commit(&mut self, segment: &Segment, steps: u64) -> Followed {
        let offset = segment.path.at(steps);
        for (position, offset) in self.position.iter_mut().zip(offset) {
            *position += offset;
        }
        let signs = self.carriage_signs();
        self.plant.follow(&Way { path: &segment.path, signs: &signs }, steps)
    }
}

fn sweep(
    plane: (usize, usize),
    [i, j]: [i64; 2],
    [x, y]: [i64; 2],
    sense: Sense,
) -> Result<Sweep, Why> {
    Sweep::to_point(plane, (i, j), (x, y), sense).ok_or(Why::TooFar)
}

fn in_plane(plane: (usize, usize), [x, y]: [i64; 2]) -> Point {
    let mut delta = Point::default();
    (delta[plane.0], delta[plane.1]) = (x, y);
    delta
}

/// This many steps of one axis.
pub(crate) fn along(axis: Axis, steps: i64) -> Point {
    let mut delta = Point::default();
    delta[axis.index()] = steps;
    delta
}
