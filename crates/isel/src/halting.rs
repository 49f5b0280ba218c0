//! Everything that ends a motion early: 253 and STOP, 254, 255, a condition, the cover, an
//! emergency, a switch that becomes active.

use vimc4_device::{Event, Kinds, Motion, StopCause};
use vimc4_isel_wire::{Mode, Op};
use vimc4_motion::Path;
use vimc4_plant::End;

use crate::activity::{Activity, Ending, PortCondition, Purpose, Wait};
use crate::axes::{AXES, moving_axes};
use crate::firmware::Firmware;
use crate::model::{StopInMoveUntil, StopInReference};
use crate::outcome::Outcome;
use crate::state::Run;
use crate::why::{Breaker, By, Why};

impl Firmware {
    /// 253, and the STOP button: halts along the ramp and keeps the remainder.
    pub(crate) fn stop(&mut self, by: By) -> Outcome {
        let quirks = &self.state.model.quirks;
        let forgets_until = quirks.stop_in_move_until == StopInMoveUntil::Forget;
        if let Activity::Referencing(run) = &self.state.activity {
            return match (run.job, quirks.stop_in_reference) {
                (Purpose::Program, StopInReference::End) => self.end_reference_of_program(by),
                _ => self.stand_in_for_switch(by),
            };
        }
        let goes_on = |run: &&mut Run| !run.paused && run.stopping.is_none();
        if let Some(run) = self.state.run.as_mut().filter(goes_on) {
            run.stopping = Some(by);
            // A motion is struck when it brakes, and what waits for nothing is not at all.
            let waits = matches!(self.state.activity, Activity::Waiting { what, .. } if what != Wait::Forever);
            if waits {
                self.struck(by.cause());
            }
        }
        match &self.state.activity {
            Activity::Moving(moving) => match (moving.job, moving.plan.until) {
                (Purpose::SelfTest, _) => Outcome::Nothing,
                (Purpose::Command(_), Some(PortCondition::Mask(_))) if forgets_until => {
                    self.brake(Ending::Break(Breaker::Stop(by)))
                }
                _ => self.brake(Ending::Stop(by)),
            },
            Activity::Waiting { what: Wait::Port | Wait::Character, .. } => {
                Outcome::ProgramHalts(by)
            }
            _ => Outcome::Nothing,
        }
    }

    /// 255: halts along the ramp and forgets the remainder; at rest it drops one.
    pub(crate) fn break_off(&mut self) -> Outcome {
        match &self.state.activity {
            Activity::Moving(moving) if moving.job == Purpose::SelfTest => Outcome::Nothing,
            Activity::Moving(_) => self.brake(Ending::Break(Breaker::Line)),
            Activity::Referencing(_) => self.halt(Why::ReferenceBroken(Breaker::Line)),
            _ if self.state.is_running() => {
                self.struck_by(Ending::Break(Breaker::Line));
                self.tell_cut_short(Purpose::Program, |c| c.breaker_in_words(Breaker::Line), true);
                Outcome::ProgramEnds(Ok(()))
            }
            Activity::Idle => {
                self.state.forget_stopped_motion();
                self.answer_control("255", self.state.model.quirks.break_reply);
                Outcome::Nothing
            }
            _ => Outcome::Nothing,
        }
    }

    /// 254: everything stops at once, as after power-on.
    pub(crate) fn software_reset(&mut self) {
        self.struck(StopCause::ResetByte);
        self.tell_unanswered("254 from the line");
        self.halt_motors();
        self.reset();
        self.answer_control("254", self.state.model.quirks.reset_reply);
    }

    /// Puts the controller into the state after power-on and reports what that changed.
    pub(crate) fn reset(&mut self) {
        let (baud, outputs, limits) = (self.state.baud, self.state.driven(), self.limits());
        self.state.reset();
        self.tell_limits(&limits, &self.limits());
        if baud != self.state.baud && self.wants(Kinds::LINE) {
            self.emit(Event::Baud { baud: self.state.baud });
        }
        self.outputs_changed(outputs);
    }

    /// The running motion brakes and ends in a given way. A harder way overrules a softer one.
    pub(crate) fn brake(&mut self, ending: Ending) -> Outcome {
        let now = self.state.now;
        let wanted = self.wants(Kinds::MOTION);
        let Activity::Moving(moving) = &mut self.state.activity else { return Outcome::Nothing };
        if moving.ending != Ending::Complete {
            if ending.is_harder_than(moving.ending) {
                moving.ending = ending;
                self.struck_by(ending);
            }
            return Outcome::Nothing;
        }
        let nanos = now.nanos_since(moving.began);
        if let Some(profile) = moving.segment.profile.brake(nanos) {
            moving.segment.profile = profile;
            moving.ending = ending;
            let made = moving.segment.profile.steps_at(nanos);
            let otherwise = self.state.plant.goes_on(&moving.segment, made);
            let at_once = moving.segment.profile.duration() <= nanos;
            if wanted {
                let segment = Box::new(moving.segment.clone());
                self.emit(Event::Motion(Motion::Changes { segment }));
            }
            self.struck_by(ending);
            if otherwise {
                self.look_ahead_again();
                self.expect_switch();
            }
            if at_once {
                return self.segment_ended();
            }
        } else if !moving.plan.parts.is_empty()
            || !Ending::Break(Breaker::Line).is_harder_than(ending)
        {
            // This segment ends by itself at least as early; the next one does not begin.
            moving.ending = ending;
            self.struck_by(ending);
        } else if moving.job == Purpose::Program {
            // The program halts after it.
            self.struck_by(ending);
        }
        Outcome::Nothing
    }

    /// A motor follows differently from the forecast: the running motion may run onto another
    /// switch.
    pub(crate) fn look_ahead_again(&mut self) {
        let Activity::Moving(moving) = &self.state.activity else { return };
        if !self.state.test_mode {
            let hit = self.first_hit(&moving.segment.path, moving.steps_at(self.state.now));
            if let Activity::Moving(moving) = &mut self.state.activity {
                moving.hit = hit;
            }
        }
    }

    /// Halts all motion at once, without a ramp, and says why.
    pub(crate) fn halt(&mut self, why: Why) -> Outcome {
        if let Some(cause) = why.cause() {
            self.struck(cause);
        }
        if let Some(job) = self.halt_motors() {
            return Outcome::Finished(job, Err(why));
        }
        if let Activity::Waiting { what: Wait::Erase, .. } = self.state.activity {
            self.state.activity = Activity::Idle;
            self.refuse(Mode::Direct, Op::Erase, why);
        } else if self.state.is_running() {
            return Outcome::ProgramEnds(Err(why));
        }
        Outcome::Nothing
    }

    /// The motors halt where they are, without a ramp, as when the power is gone or the processor
    /// restarts; returns what they moved for. The carriages keep what the counters lose.
    pub(crate) fn halt_motors(&mut self) -> Option<Purpose> {
        let now = self.state.now;
        match self.take_activity() {
            Activity::Moving(moving) => {
                let axes = self.commit(&moving.segment, moving.steps_at(now), true);
                self.state.unreference(axes);
                Some(moving.job)
            }
            Activity::Referencing(run) => {
                self.commit_reference(&run);
                Some(run.job)
            }
            other => {
                self.state.activity = other;
                None
            }
        }
    }

    /// A limit switch was pressed or released by hand while the axes move.
    pub(crate) fn limits_changed(&mut self) -> Outcome {
        let now = self.state.now;
        match self.take_activity() {
            Activity::Moving(mut moving) if !self.state.test_mode => {
                let step = moving.steps_at(now);
                let path = &moving.segment.path;
                if let Some((axis, end)) = self.limit_after(path, step) {
                    let mut hit = [None; AXES];
                    hit[axis] = Some(end);
                    return self.halt_on_switch(&moving, step, hit, true);
                }
                moving.hit = self.first_hit(path, step);
                self.state.activity = Activity::Moving(moving);
            }
            Activity::Referencing(run) => return self.reference_switches_changed(run),
            other => self.state.activity = other,
        }
        Outcome::Nothing
    }

    /// The limit switch on which a moved axis is after some steps of a path.
    fn limit_after(&self, path: &Path, step: u64) -> Option<(usize, End)> {
        let (low, high) = path.extent(path.length());
        moving_axes(&low, &high).iter().find_map(|axis| {
            let slide = self.slide_after(axis, path, step);
            Some((axis, self.active_limit_at(axis, &slide)?))
        })
    }
}
