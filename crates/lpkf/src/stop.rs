//! What breaks a command off, and how it goes on afterwards.

use std::collections::VecDeque;

use vimc4_device::{Event, Kinds, Motion};
use vimc4_plant::End;

use crate::Controller;
use crate::language::{Axis, Command, Side};
use crate::model::AfterStatus;
use crate::state::{Activity, Broken, Job, Moving, Stage, Stop};
use crate::why::Why;

impl Controller {
    /// Which end of the counter's range an end of the carriage's travel is.
    pub(crate) fn side(&self, axis: Axis, end: End) -> Side {
        match (end, self.state.carriage_sign(axis.index())) {
            (End::Negative, 1) | (End::Positive, -1) => Side::Negative,
            _ => Side::Positive,
        }
    }

    // --- breaking off ---

    /// Whatever executes is broken off and answers why; without a command it is sent by
    /// itself. Nothing is executed from now on until `!GO`, unless commands go on as if nothing had
    /// been. What was left of a motion after its last step is kept.
    pub(crate) fn break_off(&mut self, motion: Option<(&Moving, u64)>, stop: Stop, why: Why) {
        let job = self.state.job.take();
        let executes = self.state.model.quirks.after_status == AfterStatus::Execute;
        if !executes {
            self.state.stopped = Some(stop);
        }
        match &job {
            Some(job) if !job.silent => {
                self.answer_failed(job.command.form().mnemonic, why);
            }
            _ => self.report(why),
        }
        if executes {
            return;
        }
        let Some(Job { command, start, mut stages, stage, silent: false, .. }) = job else {
            return;
        };
        // Going back to the start of a broken command leaves that command broken.
        if command == Command::GoBack {
            return;
        }
        if let Some(left) = stage.and_then(|stage| left_of(stage, motion)) {
            stages.push_front(left);
        }
        let end = self.state.position;
        self.state.broken = Some(Broken { command, start, end, stages });
    }

    /// Something from outside stops whatever executes, along the ramp if it moves.
    pub(crate) fn interrupt(&mut self, stop: Stop, why: Why) {
        let now = self.state.now;
        if self.state.job.is_none() && self.state.stopped.is_some() {
            return;
        }
        let Some(Activity::Moving(moving)) = self.state.job.as_mut().map(|job| &mut job.activity)
        else {
            return self.break_off(None, stop, why);
        };
        if moving.braking.is_some() {
            return;
        }
        moving.braking = Some((stop, why));
        if let Some(profile) = moving.segment.profile.brake(now.nanos_since(moving.began)) {
            moving.segment.profile = profile;
            let segment = Box::new(moving.segment.clone());
            if self.wants(Kinds::MOTION) {
                self.emit(Event::Motion(Motion::Changes { segment }));
            }
        }
    }

    /// Something from outside takes the motors' ability to move: they halt where they are.
    pub(crate) fn halt(&mut self, why: Why) {
        let now = self.state.now;
        let activity = self
            .state
            .job
            .as_mut()
            .map(|job| std::mem::replace(&mut job.activity, Activity::Between));
        match activity {
            Some(Activity::Moving(moving)) => {
                let steps = moving.steps_at(now);
                self.commit(&moving.segment, steps);
                self.break_off(Some((&moving, steps)), Stop::Limit, why);
            }
            Some(_) => self.break_off(None, Stop::Limit, why),
            None => self.report(why),
        }
    }

    /// A limit switch was pressed or released by hand.
    pub(crate) fn switch_changed(&mut self, axis: Axis, end: End, active: bool) {
        self.switch_event(axis, end, active);
        let now = self.state.now;
        let Some(job) = &mut self.state.job else { return };
        match std::mem::replace(&mut job.activity, Activity::Between) {
            Activity::Moving(mut moving) => {
                // What an axis looks for ends its way; everything else is in the way.
                let seeks = match job.stage {
                    Some(Stage::Onto(seeking, wanted, _)) => {
                        seeking == axis && wanted == end && active
                    }
                    Some(Stage::Off(seeking, wanted, _)) => {
                        seeking == axis && wanted == end && !active
                    }
                    _ => false,
                };
                let step = moving.steps_at(now);
                if seeks {
                    return self.commit(&moving.segment, step);
                }
                let path = &moving.segment.path;
                let (low, high) = path.extent(path.length());
                let moves = low[axis.index()] != high[axis.index()];
                if active && moves {
                    self.commit(&moving.segment, step);
                    let at = self.state.position[axis.index()];
                    let why = Why::Limit { axis, end, at, by_hand: true };
                    return self.break_off(Some((&moving, step)), Stop::Limit, why);
                }
                if !active {
                    // The carriage may still run onto it.
                    let ahead = self.switch_ahead(path, step);
                    moving.event = match moving.event {
                        Some((at, crate::state::Meeting::Edge)) => {
                            Some((at, crate::state::Meeting::Edge))
                        }
                        _ => ahead.map(|(step, axis, end)| {
                            (step, crate::state::Meeting::Limit(axis, end))
                        }),
                    };
                }
                self.set_activity(Activity::Moving(moving));
            }
            other => job.activity = other,
        }
    }

    // --- going on ---

    /// `!CS`, `!GB`, `!RC`: without a broken command they have nothing to do.
    pub(crate) fn resume(&mut self, command: Command) {
        let Some(broken) = self.state.broken.clone() else {
            return self.executed(command);
        };
        match command {
            Command::GoBack => self.begin(command, VecDeque::from([Stage::To(broken.start)])),
            Command::RepeatBroken => {
                self.state.stopped = None;
                self.state.broken = None;
                self.execute(broken.command);
            }
            _ => {
                self.state.stopped = None;
                self.state.broken = None;
                let mut stages = broken.stages;
                // `!GB` may have led away from where it was broken off.
                if self.state.position != broken.end {
                    stages.push_front(Stage::To(broken.end));
                }
                self.begin(broken.command, stages);
                if let Some(job) = &mut self.state.job {
                    job.start = broken.start;
                }
            }
        }
    }

    /// The power is gone: motors stop where they are, nothing is answered.
    pub(crate) fn abandon_motion(&mut self) {
        let now = self.state.now;
        if let Some(Job { activity: Activity::Moving(moving), .. }) = self.state.job.take() {
            self.commit(&moving.segment, moving.steps_at(now));
        }
    }
}

/// What is left of a stage.
fn left_of(stage: Stage, motion: Option<(&Moving, u64)>) -> Option<Stage> {
    let Some((moving, steps)) = motion else { return Some(stage) };
    Some(match stage {
        Stage::To(_) | Stage::Arc(..) | Stage::Vectors(..) | Stage::Rest(..) => {
            let rest = moving.rest(steps);
            if rest.is_empty() {
                return None;
            }
            Stage::Rest(rest, moving.pace.0, moving.pace.1)
        }
        Stage::Free(axis, way, speed) => {
            let done = moving.segment.path.at(steps)[axis.index()];
            Stage::Free(axis, way - done, speed)
        }
        // They know where they lead to.
        stage => stage,
    })
}
