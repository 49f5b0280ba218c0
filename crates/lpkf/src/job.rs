//! A command at work: stage by stage until it is done.

use vimc4_device::Time;

use crate::Controller;
use crate::state::{Activity, Job, Stage};
use crate::why::Why;

impl Controller {
    /// When what the command does now ends by itself.
    pub(crate) fn job_due(&self) -> Option<Time> {
        match &self.state.job.as_ref()?.activity {
            Activity::Between => Some(self.state.now),
            Activity::Moving(moving) => Some(moving.due()),
            Activity::Waiting(_, until) => Some(*until),
        }
    }

    /// What the command does now has come to its end.
    pub(crate) fn activity_ended(&mut self) {
        let Some(job) = &mut self.state.job else { return };
        match std::mem::replace(&mut job.activity, Activity::Between) {
            Activity::Moving(moving) => self.motion_ended(*moving),
            Activity::Waiting(..) | Activity::Between => {}
        }
    }

    /// Begins one stage after the other until one takes time or the command is done.
    pub(crate) fn work(&mut self) {
        while let Some(job) = &mut self.state.job {
            if job.activity != Activity::Between {
                // What ends as soon as it begins ends now: more may arrive at this instant.
                if self.job_due().is_some_and(|due| due > self.state.now) {
                    return;
                }
                self.activity_ended();
                continue;
            }
            job.stage = job.stages.pop_front();
            match job.stage.clone() {
                Some(stage) => self.begin_stage(stage),
                None => {
                    if let Some(job) = self.state.job.take().filter(|job| !job.silent) {
                        self.executed(job.command);
                    }
                }
            }
        }
    }

    fn begin_stage(&mut self, stage: Stage) {
        match stage {
            Stage::To(place) => self.begin_line(place),
            Stage::Arc(centre, angle) => self.begin_arc(centre, angle),
            Stage::Vectors(axes, vectors) => self.begin_vectors(axes, &vectors),
            Stage::Rest(links, speed, acceleration) => {
                self.begin_links(links, speed, acceleration);
            }
            Stage::Wait(_, 0) => {}
            Stage::Wait(pause, nanos) => {
                let until = self.state.now.after_nanos(nanos);
                self.set_activity(Activity::Waiting(pause, until));
            }
            Stage::Head(down) => self.move_head(down),
            Stage::Onto(axis, end, speed) => self.begin_drive(axis, end, speed, true),
            Stage::Off(axis, end, speed) => self.begin_drive(axis, end, speed, false),
            Stage::Free(axis, way, speed) => self.begin_free(axis, way, speed),
            Stage::Zero(axis) => self.set_zero(axis),
            Stage::Found(axis) => self.end_found(axis),
            Stage::Return(axis) => self.begin_return(axis),
            Stage::HardClipLimits(axis) => self.send_hard_clip_limits(axis),
        }
    }

    pub(crate) fn set_activity(&mut self, activity: Activity) {
        if let Some(job) = &mut self.state.job {
            job.activity = activity;
        }
    }

    /// The command fails, and no other is held up by that.
    pub(crate) fn fail(&mut self, why: Why) {
        if let Some(Job { command, .. }) = self.state.job.take() {
            self.answer_failed(command.form().mnemonic, why);
        }
    }
}
