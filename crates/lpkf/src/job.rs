//! The stages of an executing command: what each of them begins.

use vimc4_device::{Point, Time};

use crate::language::{Axis, Command, Trackball};
use crate::state::{Activity, Moving, Pause, Stage, State, Task};
use crate::text::AnswerLine;
use crate::why::Why;

/// What the beginning of a stage results in.
pub(crate) enum Begun {
    /// Nothing that takes time: it is over.
    Over,
    /// A motion.
    Motion(Box<Moving>),
    /// A pause.
    Pause(Pause, Time),
    /// A line of data; the stage is over.
    Says(AnswerLine),
}

impl From<Option<Moving>> for Begun {
    fn from(moving: Option<Moving>) -> Begun {
        moving.map_or(Begun::Over, |moving| Begun::Motion(Box::new(moving)))
    }
}

impl State {
    /// The next stage of the command that executes begins; `None` if there is none left.
    pub(crate) fn next_stage(&mut self) -> Option<Result<Begun, Why>> {
        let job = self.job.as_mut()?;
        job.activity = Activity::Between;
        job.stage = job.stages.pop_front();
        let stage = job.stage.clone()?;
        Some(self.begin_stage(stage))
    }

    fn begin_stage(&mut self, stage: Stage) -> Result<Begun, Why> {
        let moving = match stage {
            Stage::To(place) => self.line_to(place),
            Stage::Arc(centre, angle) => self.arc(centre, angle)?,
            Stage::Vectors(axes, vectors) => self.along_vectors(axes, &vectors)?,
            Stage::Rest(links, speed, acceleration) => self.along_links(links, speed, acceleration),
            Stage::Wait(_, 0) => None,
            Stage::Wait(pause, nanos) => {
                return Ok(Begun::Pause(pause, self.now.after_nanos(nanos)));
            }
            Stage::Head(down) => {
                self.outputs.head_down = down;
                None
            }
            Stage::Onto(axis, end, speed) => self.drive(axis, end, speed, true),
            Stage::Off(axis, end, speed) => self.drive(axis, end, speed, false),
            Stage::Free(axis, way, speed) => self.free(axis, way, speed),
            Stage::Zero(axis) => {
                self.set_zero(axis);
                None
            }
            Stage::Found(axis) => {
                let place = self.last_place(axis);
                if let Some(job) = &mut self.job {
                    job.found[axis.index()] = place;
                }
                None
            }
            Stage::Return(axis) => self.back_to_zero(axis),
            Stage::HardClipLimits(axis) => return Ok(Begun::Says(self.hard_clip_line(axis))),
        };
        Ok(moving.into())
    }

    /// `W` and what `OH` has found.
    fn hard_clip_line(&self, only: Option<Axis>) -> AnswerLine {
        let mut line = AnswerLine::new(b'W');
        if self.model.quirks.hard_clip_blank {
            line.push(b' ');
        }
        let found = self.job.as_ref().map(|job| job.found).unwrap_or_default();
        match only {
            Some(axis) => line.number(found[axis.index()], 1),
            None => {
                let values = self.model.language.hard_clip_values.min(found.len());
                line.numbers(&found[..values]);
            }
        }
        line
    }

    /// Where the axis is to go because the trackball was turned.
    pub(crate) fn ball_way(&self) -> Option<Point> {
        let axis = Axis::from_index(self.ball.axis.into()).filter(|axis| self.is_fitted(*axis));
        let mut to = self.position;
        to[axis.filter(|_| self.ball.waiting != 0)?.index()] += self.ball.waiting;
        Some(to)
    }

    /// The axis moves as the trackball was turned. No command asks for it.
    pub(crate) fn follow_ball(&mut self) {
        if let Some(to) = self.ball_way() {
            self.ball.waiting = 0;
            let command = Command::OpenInterface(Trackball::Move);
            self.job = Some(Task::new(command, None, self.position, [Stage::To(to)].into()));
        }
    }

    /// A machine that homes by itself makes a reference run that no command asked for.
    pub(crate) fn home(&mut self) {
        let stages = self.homing_stages();
        if !stages.is_empty() {
            self.job = Some(Task::new(Command::Initialize, None, self.position, stages));
        }
    }
}
