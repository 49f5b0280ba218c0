//! Everything that ends a motion before its time: 253 and STOP, 254, 255, a condition, the
//! cover, an emergency, a switch that becomes active.

use vimc4_device::{Event, Kinds, Motion};
use vimc4_isel_wire::{Mode, Op, Reply};
use vimc4_motion::Path;
use vimc4_plant::End;

use crate::Controller;
use crate::admission::moving_axes;
use crate::command::Answer;
use crate::model::{StopButton, StopInMoveUntil, StopInReference, StopReply};
use crate::state::{Activity, Ending, Job, Moving, Plan, PortCondition, Wait};
use crate::why::{Breaker, By, Why};

impl Controller {
    /// 253, and the STOP button: halts along the ramp and keeps the remainder.
    pub(crate) fn stop(&mut self, by: By) {
        let quirks = &self.state.model.quirks;
        let forgets_until = quirks.stop_in_move_until == StopInMoveUntil::Forget;
        if let Activity::Referencing(run) = &self.state.activity {
            return match (run.job, quirks.stop_in_reference) {
                (Job::Program, StopInReference::End) => self.end_reference_of_program(by),
                _ => self.stand_in_for_switch(),
            };
        }
        if let Some(run) = self.state.run.as_mut().filter(|run| !run.paused) {
            run.stopping.get_or_insert(by);
        }
        match &self.state.activity {
            Activity::Moving(moving) => match (moving.job, moving.plan.until) {
                (Job::SelfTest, _) => {}
                (Job::Command(_), Some(PortCondition::Mask(_))) if forgets_until => {
                    self.brake(Ending::Break);
                }
                _ => self.brake(Ending::Stop(by)),
            },
            Activity::Waiting { what: Wait::Port | Wait::Character, .. } => self.pause(by),
            _ => {}
        }
    }

    /// 255: halts along the ramp and forgets the remainder; at rest it drops one.
    pub(crate) fn break_off(&mut self) {
        match &self.state.activity {
            Activity::Moving(moving) if moving.job == Job::SelfTest => {}
            Activity::Moving(_) => self.brake(Ending::Break),
            Activity::Referencing(_) => self.halt(Why::ReferenceBroken(Breaker::Line)),
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
            if ending.is_harder_than(moving.ending) {
                moving.ending = ending;
            }
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
        } else if !moving.plan.parts.is_empty() || !Ending::Break.is_harder_than(ending) {
            // This segment ends by itself at least as early; what follows it does not begin.
            moving.ending = ending;
        }
    }

    /// Halts whatever runs at once, without a ramp, and answers why.
    pub(crate) fn halt(&mut self, why: Why) {
        let now = self.state.now;
        match self.take_activity() {
            Activity::Moving(moving) => {
                let axes = self.commit(&moving.segment, moving.steps_at(now), true);
                self.unreference(axes);
                self.finish(moving.job, Err(why));
            }
            Activity::Referencing(run) => {
                self.commit_reference(&run);
                self.finish(run.job, Err(why));
            }
            Activity::Waiting { what: Wait::Erase, .. } => {
                self.refuse(Mode::Direct, Op::Erase, why);
            }
            other => {
                self.state.activity = other;
                if self.state.is_running() {
                    self.end_run(Err(why));
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
                if let Some(switch) = self.limit_after(path, step) {
                    self.halt_on_switch(&moving, step, switch, true);
                } else {
                    moving.hit = self.first_hit(path, step);
                    self.state.activity = Activity::Moving(moving);
                }
            }
            Activity::Referencing(run) => self.reference_switches_changed(run),
            other => self.state.activity = other,
        }
    }

    /// The limit switch on which, after some steps of a path, an axis is that it moves.
    fn limit_after(&self, path: &Path, step: u64) -> Option<(usize, End)> {
        let (low, high) = path.extent(path.length());
        let offset = path.at(step);
        moving_axes(&low, &high).iter().find_map(|axis| {
            let carriage = self.carriage_after(axis, &offset);
            Some((axis, self.active_limit_at(axis, carriage)?))
        })
    }

    /// The carriage is on a limit switch: the motion halts at this step without a ramp. No
    /// axis that moved knows any more where it is, and the error is kept until that is mended.
    pub(crate) fn halt_on_switch(
        &mut self,
        moving: &Moving,
        step: u64,
        (axis, end): (usize, End),
        by_hand: bool,
    ) {
        let axes = self.commit(&moving.segment, step, true);
        self.unreference(axes);
        self.state.latched = self.state.latched.union(axes);
        let at = self.state.position[axis];
        self.finish(moving.job, Err(Why::Switch { axis: axis as u8, end, at, by_hand }));
    }

    /// STOP is held, and no move makes a step as long as it is.
    pub(crate) fn is_stop_held(&self) -> bool {
        self.state.model.quirks.stop_button == StopButton::Held && self.state.plant.panel().stop
    }

    /// The motion stopped with something left of it.
    pub(crate) fn stopped(&mut self, job: Job, plan: Plan, by: By) {
        match job {
            Job::Command(op) => {
                self.state.remainder = Some(plan);
                self.answer_stopped(op, by);
            }
            Job::Answered(op) => {
                self.state.remainder = Some(plan);
                if self.tells_late_errors() {
                    self.answer_stopped(op, by);
                }
            }
            Job::Program => {
                if let Some(run) = &mut self.state.run {
                    run.remainder = Some(plan);
                }
                self.pause(by);
            }
            Job::SelfTest => self.self_test_ended(),
        }
    }

    pub(crate) fn answer_stopped(&mut self, op: Op, by: By) {
        let Answer(bytes) = match self.state.model.quirks.stop_reply {
            StopReply::F => Reply::Stopped.into(),
            StopReply::F0 => vec![Reply::Stopped.code(), Reply::Done.code()].into(),
        };
        let why = Why::Stopped(by);
        self.answer_why(bytes, |c| (c.mnemonic(Mode::Direct, op), c.in_words(why, None)));
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
