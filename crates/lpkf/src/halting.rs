//! What aborts a command, and how it is continued afterwards.

use std::collections::VecDeque;

use vimc4_device::{CommandNumber, Point, Segment};
use vimc4_plant::End;

use crate::language::{Axis, Command};
use crate::model::AfterStatus;
use crate::state::{Activity, Broken, Meeting, Moving, Sought, Stage, State, Task};
use crate::why::{Stop, Why};

/// How a motion has ended.
pub(crate) enum Ending {
    /// It has reached its end, or what it looked for.
    Arrived,
    /// It has run onto a limit switch.
    OnLimit(Axis, End),
    /// It has come to a halt before its end.
    Halted(Stop, Why),
}

/// The consequence of an interruption from outside.
pub(crate) enum Interruption {
    /// Nothing now: the controller has already stopped, or the motion ends anyway.
    Nothing,
    /// The command is aborted now.
    Now,
    /// The motion brakes, and now runs like this.
    Brakes(Box<Segment>),
}

/// The consequence of a limit switch that is pressed or released by hand.
pub(crate) enum Pressed {
    /// Nothing that ends a motion.
    Nothing,
    /// A motion ends here, because it has found what it looked for.
    Found(Box<Moving>, u64),
    /// A motion ends here, because it must not go on.
    Blocked(Box<Moving>, u64),
}

/// How to continue after a command was aborted.
pub(crate) enum Resumed {
    /// No command was aborted.
    Nothing,
    /// The command is carried out once more.
    Again(Command),
    /// These things are done for the command, which began there.
    Stages(Command, Point, VecDeque<Stage>),
}

impl Moving {
    /// The step at which it ends by itself, and how.
    pub(crate) fn ending(&self) -> (u64, Ending) {
        let steps = self.segment.profile.steps();
        match (self.event.filter(|(step, _)| *step <= steps), self.braking, self.border) {
            (Some((step, Meeting::Edge)), ..) => (step, Ending::Arrived),
            (Some((step, Meeting::Limit(axis, end))), ..) => (step, Ending::OnLimit(axis, end)),
            (None, Some((stop, why)), _) => (steps, Ending::Halted(stop, why)),
            (None, None, Some((axis, side))) => {
                (steps, Ending::Halted(Stop::SoftFrame, Why::Border(axis, side)))
            }
            (None, None, None) => (steps, Ending::Arrived),
        }
    }
}

impl State {
    // --- aborting ---

    /// Aborts what is executing. Nothing is executed until `!GO`, unless commands go on as if
    /// nothing had happened. The remainder of a motion after its last step is kept. Returns the
    /// command whose answer gives the reason: its number and letters, if there is one.
    pub(crate) fn break_off(
        &mut self,
        motion: Option<(&Moving, u64)>,
        stop: Stop,
    ) -> Option<(CommandNumber, &'static str)> {
        let goes_on = self.model.quirks.after_status == AfterStatus::Execute;
        if !goes_on {
            self.stopped = Some(stop);
        }
        let Task { command, number, start, mut stages, stage, .. } = self.job.take()?;
        let whose = (number?, command.form().mnemonic);
        // Going back to the start of an aborted command leaves that command aborted.
        if !goes_on && command != Command::GoBack {
            if let Some(left) = stage.and_then(|stage| left_of(stage, motion)) {
                stages.push_front(left);
            }
            self.broken = Some(Broken { command, start, end: self.position, stages });
        }
        Some(whose)
    }

    /// Something from outside stops whatever executes, along the ramp if it moves.
    pub(crate) fn interrupt(&mut self, stop: Stop, why: Why) -> Interruption {
        let Some(job) = &mut self.job else {
            return if self.stopped.is_some() { Interruption::Nothing } else { Interruption::Now };
        };
        let Activity::Moving(moving) = &mut job.activity else { return Interruption::Now };
        if moving.braking.is_some() {
            return Interruption::Nothing;
        }
        moving.braking = Some((stop, why));
        match moving.segment.profile.brake(self.now.nanos_since(moving.began)) {
            None => Interruption::Nothing,
            Some(profile) => {
                moving.segment.profile = profile;
                let segment = moving.segment.clone();
                let made = moving.steps_at(self.now);
                if self.plant.goes_on(&segment, made) {
                    self.look_ahead_again();
                }
                Interruption::Brakes(Box::new(segment))
            }
        }
    }

    /// The motion that runs has ended, if one does.
    pub(crate) fn take_moving(&mut self) -> Option<Box<Moving>> {
        let activity = &mut self.job.as_mut()?.activity;
        match std::mem::replace(activity, Activity::Between) {
            Activity::Moving(moving) => Some(moving),
            other => {
                *activity = other;
                None
            }
        }
    }

    /// A limit switch was pressed or released by hand.
    pub(crate) fn switch_pressed(&mut self, axis: Axis, end: End, active: bool) -> Pressed {
        let Some(mut moving) = self.take_moving() else { return Pressed::Nothing };
        // The sought switch ends the way of an axis; any other is an obstacle.
        let sought = self.job.as_ref().and_then(Task::sought);
        let step = moving.steps_at(self.now);
        if sought == Some(Sought { axis, end, onto: active }) {
            return Pressed::Found(moving, step);
        }
        let path = &moving.segment.path;
        let (low, high) = path.extent(path.length());
        if active && low[axis.index()] != high[axis.index()] {
            return Pressed::Blocked(moving, step);
        }
        // The carriage may still run onto it.
        if !active && !matches!(moving.event, Some((_, Meeting::Edge))) {
            moving.event = self.meets(None, path, step);
        }
        self.set_activity(Activity::Moving(moving));
        self.expect_switch();
        Pressed::Nothing
    }

    /// The obstacles ahead of the running motion may differ from the forecast.
    pub(crate) fn look_ahead_again(&mut self) {
        let Some(mut moving) = self.take_moving() else { return };
        let sought = self.job.as_ref().and_then(Task::sought);
        moving.event = self.meets(sought, &moving.segment.path, moving.steps_at(self.now));
        self.set_activity(Activity::Moving(moving));
        self.expect_switch();
    }

    // --- continuing ---

    /// `!CS`, `!GB`, `!RC`: without an aborted command they have nothing to do.
    pub(crate) fn resume(&mut self, command: &Command) -> Resumed {
        let Some(broken) = &self.broken else { return Resumed::Nothing };
        if *command == Command::GoBack {
            return Resumed::Stages(
                Command::GoBack,
                self.position,
                [Stage::To(broken.start)].into(),
            );
        }
        self.stopped = None;
        match (self.broken.take(), command) {
            (None, _) => Resumed::Nothing,
            (Some(broken), Command::RepeatBroken) => Resumed::Again(broken.command),
            (Some(Broken { command, start, end, mut stages }), _) => {
                // `!GB` may have led away from where the command was aborted.
                if self.position != end {
                    stages.push_front(Stage::To(end));
                }
                Resumed::Stages(command, start, stages)
            }
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
        // These stages have absolute targets.
        stage => stage,
    })
}
