//! Moves: from a command to segments, and from segment to segment.

use vimc4_device::{
    AXES as PLACES, Event, FaultNumber, Kinds, Loss, MachineStrike, Motion, Point, StopCause,
    Warning,
};
use vimc4_isel_wire::{ArcArgs, AxisSet, Command, Direction, Pairs};
use vimc4_motion::{Arc, ArcState, Helix, Path, Profile, Segment, StraightLine, Turn};
use vimc4_plant::{End, Followed, Way};

use crate::activity::{Activity, Ending, Moving, Plan, PortCondition, Purpose};
use crate::axes::{AXES, AXIS_NAMES, along, moving_axes, wrap};
use crate::firmware::Firmware;
use crate::model::SpeedOf3d;
use crate::outcome::Outcome;
use crate::why::{By, Why};

impl Firmware {
    // --- from a command to a plan ---

    /// The partial moves of a command, without those of no length.
    pub(crate) fn plan_of(&self, command: &Command) -> Plan {
        let (parts, until) = match command {
            Command::RelativeMove(pairs) => (self.straight_parts(pairs, false), None),
            Command::AbsoluteMove(pairs) => (self.straight_parts(pairs, true), None),
            Command::Circle(args) => (vec![(Path::Arc(self.arc(args)), args.speed)], None),
            Command::Helix(args, steps) => {
                let helix = Helix::new(self.arc(args), self.state.plane.third(), i64::from(*steps));
                (vec![(Path::Helix(helix), args.speed)], None)
            }
            Command::MoveUntil { test, speed, steps, .. } => {
                let mut delta = Point::default();
                for (axis, steps) in self.state.axes.iter().zip(steps) {
                    delta[axis] = i64::from(*steps);
                }
                let parts = vec![(Path::Line(StraightLine::new(delta)), *speed)];
                (parts, Some(PortCondition::Mask(*test)))
            }
            _ => (Vec::new(), None),
        };
        Plan { parts: parts.into_iter().filter(|(path, _)| path.length() > 0).collect(), until }
    }

    /// Says so if the parameters of a circle or a helix are not those of a circle. The card takes them.
    pub(crate) fn warn_off_circle(&mut self, command: &Command) {
        let (Command::Circle(args) | Command::Helix(args, _)) = command else { return };
        if !self.wants(Kinds::WARNING) {
            return;
        }
        let turn = match self.state.direction {
            Direction::Clockwise => Turn::Clockwise,
            Direction::Counterclockwise => Turn::Counterclockwise,
        };
        if let Some(off) = self.arc(args).off_circle(turn) {
            self.emit(Event::Warning(off.into()));
        }
    }

    fn arc(&self, args: &ArcArgs) -> Arc {
        let (first, second) = self.state.plane.axes();
        let start = ArcState {
            x: i64::from(args.x),
            y: i64::from(args.y),
            d: i64::from(args.d),
            rx: args.rx,
            ry: args.ry,
        };
        Arc::new(first, second, u64::from(args.steps), start)
    }

    /// A straight move in its parts. In 3D all axes go together at the speed given first. In
    /// 2.5D X and Y go together at the speed of the longer way, then Z, then the second way of
    /// Z, or A (99 2.2.4). The second way of an absolute move does not exist (99 2.2.5).
    fn straight_parts(&self, pairs: &Pairs, absolute: bool) -> Vec<(Path, u32)> {
        let axes = self.state.axes;
        let pairs = pairs.as_slice();
        let second_z = axes.bits() == 0b0111;
        let mut delta = Point::default();
        let mut speed = [0u32; AXES];
        for (axis, pair) in axes.iter().zip(pairs) {
            delta[axis] = match absolute {
                true => self.state.zero[axis] + i64::from(pair.steps) - self.state.position[axis],
                false => i64::from(pair.steps),
            };
            speed[axis] = pair.speed;
        }
        let alone = |axis: usize| (Path::Line(along(axis, delta[axis])), speed[axis]);
        if self.state.three_d {
            let speed = pairs.first().map_or(0, |pair| pair.speed);
            return vec![(Path::Line(StraightLine::new(delta)), self.speed_of_3d(&delta, speed))];
        }
        let [x, y, ..] = delta;
        let longer = if y.abs() > x.abs() { 1 } else { 0 };
        let mut both = Point::default();
        (both[0], both[1]) = (x, y);
        let mut parts = vec![(Path::Line(StraightLine::new(both)), speed[longer]), alone(2)];
        match pairs.get(3).filter(|_| second_z) {
            Some(pair) if !absolute => {
                parts.push((Path::Line(along(2, i64::from(pair.steps))), pair.speed));
            }
            _ => parts.push(alone(3)),
        }
        parts
    }

    /// The step frequency of a 3D move, which is that of its longest way. Where X, Y and Z have the
    /// given speed, A makes its steps in the same time, up to the highest speed there is.
    fn speed_of_3d(&self, delta: &Point, speed: u32) -> u32 {
        let model = &self.state.model;
        let [x, y, z, a, ..] = delta.map(i64::unsigned_abs);
        let longest = x.max(y).max(z);
        if model.quirks.speed_of_3d == SpeedOf3d::Longest || longest == 0 || a <= longest {
            return speed;
        }
        let dragged = (u64::from(speed).saturating_mul(a) + longest / 2) / longest;
        u32::try_from(dragged).unwrap_or(u32::MAX).min(model.limits.speed_max)
    }

    // --- from segment to segment ---

    /// Begins a plan: its first segment, or its end if there is nothing to do.
    pub(crate) fn begin_plan(&mut self, job: Purpose, plan: Plan) -> Outcome {
        let met = plan.until.is_some_and(|condition| self.is_met(condition));
        if met || plan.parts.is_empty() {
            Outcome::Finished(job, Ok(()))
        } else if self.state.is_stop_held() && job != Purpose::SelfTest {
            let by = By::ButtonHeld;
            self.job_struck(job, by.cause(), job.moving());
            Outcome::Stopped(job, plan, by)
        } else {
            self.next_part(job, plan)
        }
    }

    fn next_part(&mut self, job: Purpose, mut plan: Plan) -> Outcome {
        let Some((path, speed)) = plan.parts.pop_front() else {
            return Outcome::Finished(job, Ok(()));
        };
        let profile = Profile::new(path.length(), speed, self.state.ramp);
        let segment = Segment { path, profile };
        self.state.plant.sets_out(&segment);
        let hit = if self.state.test_mode { None } else { self.first_hit(&segment.path, 0) };
        self.motion_begins(&segment);
        self.state.activity = Activity::Moving(Box::new(Moving {
            job,
            segment,
            began: self.state.now,
            hit,
            speed,
            plan,
            ending: Ending::Complete,
        }));
        self.expect_switch();
        Outcome::Nothing
    }

    /// The running segment has come to its end, or to a limit switch.
    pub(crate) fn segment_ended(&mut self) -> Outcome {
        let Activity::Moving(moving) = self.take_activity() else { return Outcome::Nothing };
        let steps = moving.segment.profile.steps();
        if let Some(step) = moving.hit.filter(|step| *step <= steps) {
            let hit = self.hit_with(&moving.segment.path, step);
            return self.halt_on_switch(&moving, step, hit, false);
        }
        let Moving { job, segment, speed, mut plan, ending, .. } = *moving;
        self.commit(&segment, steps, false);
        match ending {
            Ending::Complete => self.next_part(job, plan),
            Ending::Stop(by) => {
                let left = segment.path.after(steps);
                if left.length() > 0 {
                    plan.parts.push_front((left, speed));
                }
                Outcome::Stopped(job, plan, by)
            }
            Ending::Break(by) => {
                self.tell_cut_short(job, |c| c.breaker_in_words(by), true);
                match job {
                    Purpose::Program => Outcome::ProgramEnds(Ok(())),
                    _ => Outcome::Finished(job, Ok(())),
                }
            }
            Ending::Event => Outcome::Finished(job, Ok(())),
            Ending::Cover(opened) => Outcome::Finished(job, Err(Why::Cover(opened))),
        }
    }

    /// Carriages are on limit switches: the motion halts at this step without a ramp. No axis that
    /// moved knows its position any more, and the error of those on switches is kept until that is
    /// remedied.
    pub(crate) fn halt_on_switch(
        &mut self,
        moving: &Moving,
        step: u64,
        hit: [Option<End>; AXES],
        by_hand: bool,
    ) -> Outcome {
        let cause = if by_hand { StopCause::LimitByHand } else { StopCause::LimitSwitch };
        self.job_struck(moving.job, cause, moving.job.moving());
        let axes = self.commit(&moving.segment, step, true);
        self.state.unreference(axes);
        for axis in (0..AXES).filter(|axis| hit[*axis].is_some()) {
            self.state.latched = self.state.latched.union(AxisSet::of(axis));
        }
        let position = self.state.position;
        let hit = std::array::from_fn(|axis| hit[axis].map(|end| (end, position[axis])));
        Outcome::Finished(moving.job, Err(Why::Switch { hit, by_hand }))
    }

    /// Makes `steps` steps of a segment final: counters and carriages move. Halted without a ramp
    /// above the start-stop frequency, the carriage overshoots along the path by the way that
    /// braking would have taken, and the counters no longer agree with it. Returns the axes that
    /// moved.
    pub(crate) fn commit(&mut self, segment: &Segment, steps: u64, sudden: bool) -> AxisSet {
        let path = &segment.path;
        let offset = path.at(steps);
        let (low, high) = path.extent(steps);
        for (axis, offset) in offset.into_iter().enumerate() {
            let position = self.state.position[axis] + offset;
            let reads = wrap(position);
            self.state.position[axis] = reads;
            if reads != position && self.wants(Kinds::WARNING) {
                let name = AXIS_NAMES.get(axis).copied().unwrap_or("?").into();
                let axis = axis as u8;
                self.emit(Event::Warning(Warning::CounterWrapped { axis, name, reads }));
            }
        }
        let mut followed = self.move_carriages(path, steps, [false; PLACES]);
        let mut overran = [false; AXES];
        if sudden && self.state.model.quirks.lost_steps {
            let (overrun, limits) = (self.overrun(segment, steps), self.limits_at_rest());
            let rest = path.after(steps);
            let slip = rest.at(overrun);
            let stopped = self.move_carriages(&rest, overrun, followed.stood).lost;
            for axis in 0..AXES {
                followed.lost[axis] += stopped[axis] - slip[axis];
                overran[axis] = slip[axis] != stopped[axis];
            }
            self.tell_limits(&limits, &self.limits_at_rest());
        }
        self.warn_of_losses(&followed, overran);
        if self.wants(Kinds::MOTION) {
            self.emit(Event::Motion(Motion::Ends { steps }));
        }
        moving_axes(&low, &high)
    }

    /// The carriages follow the counters for this many steps of a path, except for stalled ones.
    fn move_carriages(&mut self, path: &Path, steps: u64, stand: [bool; PLACES]) -> Followed {
        let mut signs = self.state.carriage_signs();
        for (sign, _) in signs.iter_mut().zip(stand).filter(|(_, stands)| *stands) {
            *sign = 0;
        }
        self.state.plant.follow(&Way { path, signs: &signs }, steps)
    }

    /// Reports which carriages no longer agree with their counters.
    pub(crate) fn warn_of_losses(&mut self, followed: &Followed, overran: [bool; AXES]) {
        for axis in (0..AXES).filter(|axis| followed.lost[*axis] != 0) {
            let name = AXIS_NAMES.get(axis).copied().unwrap_or("?");
            let how = match (overran[axis], followed.stood[axis]) {
                (true, _) => Loss::Overran,
                (false, true) => Loss::Stalled,
                (false, false) => Loss::AtEnd,
            };
            if how == Loss::Stalled
                && let Some(number) = followed.because[axis]
            {
                self.stands(axis, number);
            }
            if self.wants(Kinds::WARNING) {
                let machine = self.state.plant.machine();
                let warning = machine.steps_lost(axis, name, -followed.lost[axis], how);
                self.emit(Event::Warning(warning));
            }
        }
    }

    /// How many steps the machine overshoots when the motor halts at a step without a ramp.
    fn overrun(&self, segment: &Segment, steps: u64) -> u64 {
        const MICRO: u128 = 1_000_000;
        let profile = &segment.profile;
        // The speed at the step itself; at the last one it is that of the step before.
        let nanos = profile.time_of(steps.min(profile.steps().saturating_sub(1)));
        let speed = u128::from(profile.speed_at(nanos));
        let start_stop = u128::from(self.state.ramp.start_stop) * MICRO;
        let squares = (speed * speed).saturating_sub(start_stop * start_stop);
        let per_step = 2_000 * u128::from(self.state.ramp.acceleration) * MICRO * MICRO;
        u64::try_from(squares / per_step).unwrap_or(u64::MAX)
    }

    pub(crate) fn motion_begins(&mut self, segment: &Segment) {
        if self.wants(Kinds::MOTION) {
            let segment = Box::new(segment.clone());
            self.emit(Event::Motion(Motion::Begins { origin: self.state.position, segment }));
        }
        for (axis, number) in self.state.plant.jams(segment, 0) {
            self.stands(axis, number);
        }
    }

    /// A fault lets the motor of an axis stand.
    pub(crate) fn stands(&mut self, axis: usize, number: FaultNumber) {
        let name = AXIS_NAMES.get(axis).copied().unwrap_or("?").to_owned();
        self.strikes(number, MachineStrike::Stands(axis as u8, name));
    }
}
