//! Everything that ends a motion before its time: 253 and STOP, 254, 255, a condition, the
//! cover, an emergency, a switch that becomes active.

use vimc4_device::{Event, Kinds, Motion};
use vimc4_isel_wire::{Mode, Op, Reply};
use vimc4_motion::Path;

use crate::Controller;
use crate::admission::moving_axes;
use crate::command::Answer;
use crate::model::{StopButton, StopInMoveUntil, StopInReference, StopReply};
use crate::state::{Activity, Ending, Job, Moving, Plan, PortCondition, Wait};

impl Controller {
    /// 253, and the STOP button: halts along the ramp and keeps the remainder.
    pub(crate) fn stop(&mut self) {
        let quirks = &self.state.model.quirks;
        let forgets_until = quirks.stop_in_move_until == StopInMoveUntil::Forget;
        if let Activity::Referencing(run) = &self.state.activity {
            return match (run.job, quirks.stop_in_reference) {
                (Job::Program, StopInReference::End) => self.end_reference_of_program(),
                _ => self.stand_in_for_switch(),
            };
        }
        if let Some(run) = self.state.run.as_mut().filter(|run| !run.paused) {
            run.stopping = true;
        }
        match &self.state.activity {
            Activity::Moving(moving) => match (moving.job, moving.plan.until) {
                (Job::SelfTest, _) => {}
                (Job::Command(_), Some(PortCondition::Mask(_))) if forgets_until => {
                    self.brake(Ending::Break);
                }
                _ => self.brake(Ending::Stop),
            },
            Activity::Waiting { what: Wait::Port | Wait::Character, .. } => self.pause(),
            _ => {}
        }
    }

    /// 255: halts along the ramp and forgets the remainder; at rest it drops one.
    pub(crate) fn break_off(&mut self) {
        match &self.state.activity {
            Activity::Moving(moving) if moving.job == Job::SelfTest => {}
            Activity::Moving(_) => self.brake(Ending::Break),
            Activity::Referencing(_) => self.halt(Reply::LimitSwitch),
            _ if self.state.is_running() => self.end_run(Ok(())),
            Activity::Idle => {
                self.forget_stopped_motion();
                self.answer_control("255", self.state.model.quirks.break_reply);
            }
            _ => {}
        }
    }

    /// 254: everything stops at once, as after power-on.
    pub(crate) fn software_reset(&mut self) {
        self.abandon_motion();
        self.reset();
        self.answer_control("254", self.state.model.quirks.reset_reply);
    }

    /// Puts the controller into the state after power-on and tells what that changed.
    pub(crate) fn reset(&mut self) {
        let (baud, outputs) = (self.state.baud, self.state.driven());
        self.state.reset();
        if baud != self.state.baud && self.wants(Kinds::LINE) {
            self.emit(Event::Baud { baud: self.state.baud });
        }
        self.outputs_changed(outputs);
    }

    /// The running motion brakes and ends in a certain way. A harder way overrules a softer.
    pub(crate) fn brake(&mut self, ending: Ending) {
        let now = self.state.now;
        let Activity::Moving(moving) = &mut self.state.activity else { return };
        if moving.ending != Ending::Complete {
            moving.ending = moving.ending.max(ending);
            return;
        }
        let nanos = now.nanos_since(moving.began);
        if let Some(profile) = moving.segment.profile.brake(nanos) {
            moving.segment.profile = profile;
            moving.ending = ending;
            let at_once = moving.segment.profile.duration() <= nanos;
            let segment = moving.segment.clone();
            if self.wants(Kinds::MOTION) {
                self.emit(Event::Motion(Motion::Changes { segment: Box::new(segment) }));
            }
            if at_once {
                self.segment_ended();
            }
        } else if !moving.plan.parts.is_empty() || ending >= Ending::Break {
            // This segment ends by itself at least as early; what follows it does not begin.
            moving.ending = ending;
        }
    }

    /// Halts whatever runs at once, without a ramp, and answers `reply`.
    pub(crate) fn halt(&mut self, reply: Reply) {
        let now = self.state.now;
        match self.take_activity() {
            Activity::Moving(moving) => {
                let axes = self.commit(&moving.segment, moving.steps_at(now), true);
                self.unreference(axes);
                self.finish(moving.job, Err(reply));
            }
            Activity::Referencing(run) => {
                self.commit_reference(&run);
                self.finish(run.job, Err(reply));
            }
            Activity::Waiting { what: Wait::Erase, .. } => {
                self.answer(Mode::Direct, Op::Erase, reply);
            }
            other => {
                self.state.activity = other;
                if self.state.is_running() {
                    self.end_run(Err(reply));
                }
            }
        }
    }

    /// A limit switch was pressed or released by hand while the axes move.
    pub(crate) fn limits_changed(&mut self) {
        let now = self.state.now;
        match self.take_activity() {
            Activity::Moving(mut moving) if !self.state.test_mode => {
                let step = moving.steps_at(now);
                let path = &moving.segment.path;
                if self.stands_on_limit(path, step) {
                    self.halt_on_switch(&moving, step);
                } else {
                    moving.hit = self.first_hit(path, step);
                    self.state.activity = Activity::Moving(moving);
                }
            }
            Activity::Referencing(run) => self.reference_switches_changed(run),
            other => self.state.activity = other,
        }
    }

    /// Whether, after some steps of a path, an axis that it moves is on a limit switch.
    fn stands_on_limit(&self, path: &Path, step: u64) -> bool {
        let (low, high) = path.extent(path.length());
        let offset = path.at(step);
        moving_axes(&low, &high).iter().any(|axis| {
            let carriage = self.carriage_after(axis, &offset);
            [vimc4_plant::End::Negative, vimc4_plant::End::Positive]
                .into_iter()
                .any(|end| self.limit_active_at(axis, end, carriage))
        })
    }

    /// The carriage is on a limit switch: the motion halts at this step without a ramp. No
    /// axis that moved knows any more where it is, and the error is kept until that is mended.
    pub(crate) fn halt_on_switch(&mut self, moving: &Moving, step: u64) {
        let axes = self.commit(&moving.segment, step, true);
        self.unreference(axes);
        self.state.latched = self.state.latched.union(axes);
        self.finish(moving.job, Err(Reply::LimitSwitch));
    }

    /// STOP is held, and no move makes a step as long as it is.
    pub(crate) fn is_stop_held(&self) -> bool {
        self.state.model.quirks.stop_button == StopButton::Held && self.state.plant.panel().stop
    }

    /// The motion stopped with something left of it.
    pub(crate) fn stopped(&mut self, job: Job, plan: Plan) {
        match job {
            Job::Command(op) => {
                self.state.remainder = Some(plan);
                self.answer_stopped(op);
            }
            Job::Answered(op) => {
                self.state.remainder = Some(plan);
                if self.tells_late_errors() {
                    self.answer_stopped(op);
                }
            }
            Job::Program => {
                if let Some(run) = &mut self.state.run {
                    run.remainder = Some(plan);
                }
                self.pause();
            }
            Job::SelfTest => self.self_test_ended(),
        }
    }

    pub(crate) fn answer_stopped(&mut self, op: Op) {
        let answer: Answer = match self.state.model.quirks.stop_reply {
            StopReply::F => Reply::Stopped.into(),
            StopReply::F0 => vec![Reply::Stopped.code(), Reply::Done.code()].into(),
        };
        self.answer_bytes(Mode::Direct, op, answer.0);
    }

    /// The power is gone or the processor restarts: motors stop where they are, nothing is
    /// answered. The carriages know what the counters forget.
    pub(crate) fn abandon_motion(&mut self) {
        let now = self.state.now;
        match self.take_activity() {
            Activity::Moving(moving) => {
                self.commit(&moving.segment, moving.steps_at(now), true);
            }
            Activity::Referencing(run) => self.commit_reference(&run),
            _ => {}
        }
    }
}
