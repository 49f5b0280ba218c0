//! Reference runs, and axes that leave their switches.
//!
//! Axis by axis, Z, Y, X, A: towards the reference switch at the reference speed, halt on its
//! step; out of it at the start-stop frequency until it closes; on by the free steps. That
//! place is 0 (12 4.2.2).

use std::collections::VecDeque;

use vimc4_device::{Event, Kinds, StopCause, Warning};
use vimc4_isel_wire::AxisSet;
use vimc4_motion::{Path, Profile, Segment};
use vimc4_plant::{End, Reference, Slide, Way};

use crate::activity::{Activity, ON_AND_ON, Phase, Purpose, Referencing};
use crate::axes::{AXES, AXIS_NAMES, along};
use crate::firmware::Firmware;
use crate::outcome::Outcome;
use crate::why::{By, Why};

/// The order in which axes look for their reference points (99 2.2.2).
const ORDER: [usize; AXES] = [2, 1, 0, 3];

impl Firmware {
    /// Begins a reference run. In test mode nothing moves and the current point becomes the
    /// reference point (99 2.2.15).
    pub(crate) fn begin_reference(&mut self, job: Purpose, axes: AxisSet) -> Outcome {
        if self.state.test_mode {
            self.simulate_reference(axes);
            return Outcome::Finished(job, Ok(()));
        }
        self.state.three_d = false;
        let axes = ORDER.into_iter().filter(|&axis| axes.has(axis)).map(|axis| axis as u8);
        self.reference_next(job, axes.collect())
    }

    /// Does what a reference run does, without moving (12 2.2.20).
    pub(crate) fn simulate_reference(&mut self, axes: AxisSet) {
        self.state.three_d = false;
        axes.iter().for_each(|axis| self.set_reference_point(axis));
    }

    /// The current point of an axis becomes its reference point.
    pub(crate) fn set_reference_point(&mut self, axis: usize) {
        self.state.position[axis] = 0;
        self.state.zero[axis] = 0;
        let axis = AxisSet::of(axis);
        self.state.referenced = self.state.referenced.union(axis);
        self.state.latched = self.state.latched.without(axis);
        self.state.freed = self.state.freed.without(axis);
    }

    /// Begins to drive an axis out of whichever limit switch it is on (12 2.2.9).
    pub(crate) fn begin_free(&mut self, job: Purpose, axes: AxisSet) -> Outcome {
        let Some(axis) = axes.iter().next() else { return Outcome::Finished(job, Ok(())) };
        if self.active_limit(axis).is_none() {
            return Outcome::Finished(job, Ok(()));
        }
        self.begin_phase(job, false, VecDeque::new(), axis, Phase::StepOut)
    }

    fn reference_next(&mut self, job: Purpose, mut next: VecDeque<u8>) -> Outcome {
        let Some(axis) = next.pop_front() else { return Outcome::Finished(job, Ok(())) };
        let axis = usize::from(axis);
        self.state.unreference(AxisSet::of(axis));
        let on_switch = self.limit_active(axis, self.reference_end(axis));
        let begin_outside =
            on_switch && self.state.plant.machine().axis(axis).reference != Reference::Home;
        let phase = if begin_outside { Phase::StepOut } else { Phase::Approach };
        self.begin_phase(job, true, next, axis, phase)
    }

    /// The end at which an axis looks for its reference switch; `IR` makes it the other.
    fn reference_end(&self, axis: usize) -> End {
        let end = match self.state.plant.machine().axis(axis).reference {
            Reference::Positive => End::Positive,
            _ => End::Negative,
        };
        if self.state.settings.references.has(axis) { end.other() } else { end }
    }

    fn begin_phase(
        &mut self,
        job: Purpose,
        whole: bool,
        next: VecDeque<u8>,
        axis: usize,
        phase: Phase,
    ) -> Outcome {
        let home = whole && self.state.plant.machine().axis(axis).reference == Reference::Home;
        let end = self.switch_to_leave(axis, whole);
        let inwards = if end == End::Negative { -1 } else { 1 };
        let steps = match phase {
            Phase::Approach if home => {
                self.state.plant.way_to(axis, 0) * self.state.carriage_sign(axis)
            }
            Phase::Approach => inwards * ON_AND_ON as i64,
            Phase::StepOut => -inwards * ON_AND_ON as i64,
            Phase::Free => -inwards * i64::from(self.state.settings.free_steps[axis]),
        };
        let speed = match phase {
            Phase::StepOut if whole => self.state.ramp.start_stop,
            _ => self.state.speeds[axis],
        };
        let path = Path::Line(along(axis, steps));
        let profile = Profile::constant(path.length(), speed);
        let segment = Segment { path, profile };
        self.state.plant.sets_out(&segment);
        let began = self.state.now;
        let mut run =
            Referencing { job, whole, next, axis, phase, segment, began, goal: None, wrong: None };
        if run.segment.path.length() == 0 {
            return self.phase_reached(run);
        }
        if !home {
            // Between two active switches there is no way out.
            if phase != Phase::Approach && self.limit_active(axis, end.other()) {
                return self.wrong_switch(&run);
            }
            self.watch_switches(&mut run, 0);
        }
        let endless = phase == Phase::Approach && run.goal.is_none() && run.wrong.is_none();
        if endless && !home && self.wants(Kinds::WARNING) {
            let name = AXIS_NAMES.get(axis).copied().unwrap_or("?").into();
            let axis = axis as u8;
            self.emit(Event::Warning(Warning::EndlessReference { axis, name }));
        }
        self.motion_begins(&run.segment);
        self.state.activity = Activity::Referencing(Box::new(run));
        self.expect_switch();
        Outcome::Nothing
    }

    /// The end whose switch a phase is about.
    fn switch_to_leave(&self, axis: usize, whole: bool) -> End {
        match self.active_limit(axis) {
            Some(end) if !whole => end,
            _ => self.reference_end(axis),
        }
    }

    /// Solves for the steps at which the phase meets its switch, and the wrong one, after
    /// `from` steps.
    fn watch_switches(&self, run: &mut Referencing, from: u64) {
        let axis = run.axis;
        let inwards = run.segment.path.at(run.segment.path.length())[axis];
        let (ahead, behind) = if inwards > 0 {
            (End::Positive, End::Negative)
        } else {
            (End::Negative, End::Positive)
        };
        let signs = self.state.carriage_signs();
        let way = Way { path: &run.segment.path, signs: &signs };
        // What already holds does not begin to hold.
        let change = |end: End, wanted: bool| {
            let is_so = |slide: &Slide| self.limit_active_at(axis, end, slide) == wanted;
            self.state.plant.first(axis, &way, from, is_so).filter(|step| *step > from)
        };
        let (goal, wrong) = match run.phase {
            Phase::Approach if ahead == self.reference_end(axis) => {
                (change(ahead, true), change(behind, true))
            }
            Phase::Approach => (None, change(ahead, true)),
            Phase::StepOut => (change(behind, false), change(ahead, true)),
            Phase::Free => (None, change(ahead, true)),
        };
        (run.goal, run.wrong) = (goal, wrong);
    }

    /// The present phase has come to its end.
    pub(crate) fn reference_phase_ended(&mut self) -> Outcome {
        let Activity::Referencing(run) = self.take_activity() else { return Outcome::Nothing };
        let step = run.last_step();
        self.commit(&run.segment, step, false);
        if run.wrong == Some(step) && run.goal != Some(step) {
            return self.wrong_switch(&run);
        }
        self.phase_reached(*run)
    }

    fn wrong_switch(&mut self, run: &Referencing) -> Outcome {
        self.job_struck(run.job, StopCause::WrongSwitch, run.doing());
        let axis = AxisSet::of(run.axis);
        self.state.unreference(axis);
        self.state.latched = self.state.latched.union(axis);
        let both = [End::Negative, End::Positive].map(|end| self.limit_active(run.axis, end));
        let end = self.active_limit(run.axis).filter(|_| both != [true; 2]);
        let (axis, referencing) = (run.axis as u8, run.whole);
        Outcome::Finished(run.job, Err(Why::WrongSwitch { axis, end, referencing }))
    }

    /// A phase is done; the counters are where it ended.
    fn phase_reached(&mut self, run: Referencing) -> Outcome {
        let Referencing { job, whole, next, axis, phase, .. } = run;
        if !whole {
            let axes = AxisSet::of(axis);
            self.state.unreference(axes);
            self.state.latched = self.state.latched.without(axes);
            self.state.freed = self.state.freed.union(axes);
            return Outcome::Finished(job, Ok(()));
        }
        let home = self.state.plant.machine().axis(axis).reference == Reference::Home;
        match phase {
            Phase::Approach if !home && self.limit_active(axis, self.reference_end(axis)) => {
                self.begin_phase(job, whole, next, axis, Phase::StepOut)
            }
            Phase::Approach | Phase::StepOut => {
                self.begin_phase(job, whole, next, axis, Phase::Free)
            }
            Phase::Free => {
                self.set_reference_point(axis);
                self.reference_next(job, next)
            }
        }
    }

    /// STOP is taken for the reference switch: the present phase ends here (99 2.2.2).
    pub(crate) fn stand_in_for_switch(&mut self, by: By) -> Outcome {
        let Activity::Referencing(run) = self.take_activity() else { return Outcome::Nothing };
        if run.phase == Phase::Free {
            self.state.activity = Activity::Referencing(run);
            return Outcome::Nothing;
        }
        self.job_struck(run.job, by.cause(), run.doing());
        self.commit_reference(&run);
        self.warn_of_false_reference(&run);
        self.phase_reached(*run)
    }

    /// Reports that STOP replaced an existing switch of an axis. Without a switch, or on a machine
    /// without ends, STOP is the way to make the reference point.
    fn warn_of_false_reference(&mut self, run: &Referencing) {
        let gear = self.state.plant.machine().axis(run.axis);
        let name = AXIS_NAMES.get(run.axis).copied().filter(|_| self.wants(Kinds::WARNING));
        if let Some(name) = name
            && run.whole
            && gear.reference != Reference::None
        {
            let axis = run.axis as u8;
            self.emit(Event::Warning(Warning::FalseReference { axis, name: name.into() }));
        }
    }

    /// STOP ends the reference run of a program (99 3.2.2): the axis stays without a reference
    /// point, and those after it are not driven. The program halts, and goes on after this line.
    pub(crate) fn end_reference_of_program(&mut self, by: By) -> Outcome {
        let Activity::Referencing(run) = self.take_activity() else { return Outcome::Nothing };
        self.job_struck(run.job, by.cause(), run.doing());
        self.commit_reference(&run);
        if let Some(run) = &mut self.state.run {
            run.line += 1;
        }
        Outcome::ProgramHalts(by)
    }

    /// Makes the steps up to now final.
    pub(crate) fn commit_reference(&mut self, run: &Referencing) {
        let nanos = self.state.now.nanos_since(run.began);
        self.commit(&run.segment, run.segment.profile.steps_at(nanos), false);
    }

    /// A limit switch was pressed or released by hand during a reference run.
    pub(crate) fn reference_switches_changed(&mut self, mut run: Box<Referencing>) -> Outcome {
        let axis = run.axis;
        if run.whole && self.state.plant.machine().axis(axis).reference == Reference::Home {
            self.state.activity = Activity::Referencing(run);
            return Outcome::Nothing;
        }
        let nanos = self.state.now.nanos_since(run.began);
        let step = run.segment.profile.steps_at(nanos);
        let slide = self.slide_after(axis, &run.segment.path, step);
        let way = run.segment.path.at(run.segment.path.length())[axis];
        let ahead = if way > 0 { End::Positive } else { End::Negative };
        let active = |end| self.limit_active_at(axis, end, &slide);
        let reached = match run.phase {
            Phase::Approach => ahead == self.reference_end(axis) && active(ahead),
            Phase::StepOut => !active(ahead.other()),
            Phase::Free => false,
        };
        if reached {
            self.commit(&run.segment, step, false);
            self.phase_reached(*run)
        } else if active(ahead) {
            self.commit(&run.segment, step, false);
            self.wrong_switch(&run)
        } else {
            self.watch_switches(&mut run, step);
            self.state.activity = Activity::Referencing(run);
            Outcome::Nothing
        }
    }
}
