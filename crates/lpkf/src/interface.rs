//! The trackball.

use serde::{Deserialize, Serialize};
use vimc4_device::{AXES, Event, Kinds, Time, Warning};

use crate::Controller;
use crate::language::{Axis, Command, Status, Trackball};
use crate::model::CommandSet;
use crate::state::{Activity, Job, Stage};
use crate::why::Why;

/// How often a position is sent, ns.
const PERIOD: u64 = 1_000_000_000;

/// A trackball and what it is used for.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Ball {
    /// The axis that it moves.
    pub(crate) axis: u8,
    /// What it is open for.
    pub(crate) open: Option<Trackball>,
    /// When the next position is sent.
    pub(crate) due: Option<Time>,
    /// By how many steps it was turned while the axis still moved.
    pub(crate) waiting: i64,
}

impl Controller {
    /// `!OI`.
    pub(crate) fn open_interface(&mut self, use_of: Trackball) -> Result<(), Why> {
        if !self.state.model.interface.trackball {
            if self.state.model.command_set == CommandSet::MotionSystem {
                return Err(Why::NoTrackball);
            }
            // An SMCU has no status for it, as for a module that is not there.
            if self.wants(Kinds::WARNING) {
                let what = "no trackball is connected".into();
                self.emit(Event::Warning(Warning::NoEffect { what }));
            }
            return Ok(());
        }
        if self.state.faults.contains(&Status::JoystickNotConnected.code()) {
            return Err(Why::Fault(Status::JoystickNotConnected));
        }
        let reports = use_of == Trackball::MoveAndReport;
        self.state.ball.open = Some(use_of);
        self.state.ball.due = reports.then(|| self.state.now.after_nanos(PERIOD));
        Ok(())
    }

    /// `!CI`.
    pub(crate) fn close_interface(&mut self) {
        self.state.ball.open = None;
        self.state.ball.due = None;
        self.state.ball.waiting = 0;
    }

    /// A second has passed: the position of the axis is sent.
    pub(crate) fn ball_report_due(&mut self) {
        let Some(axis) = Axis::from_index(usize::from(self.state.ball.axis)) else { return };
        self.state.ball.due = Some(self.state.now.after_nanos(PERIOD));
        let place = self.actual_now(axis);
        self.send(format!("A{place}\r").into());
    }

    /// The ball was turned by so many steps each way.
    pub(crate) fn ball_turned(&mut self, x: i64, y: i64) {
        match self.state.ball.open {
            None => {}
            Some(Trackball::Report) => self.send(format!("B{x},{y}\r").into()),
            Some(_) => self.state.ball.waiting += x,
        }
    }

    /// Moves the axis by what the ball was turned, once it has come to rest. Returns whether it
    /// begins to.
    pub(crate) fn follow_ball(&mut self) -> bool {
        let axis = usize::from(self.state.ball.axis);
        let fitted = Axis::from_index(axis).is_some_and(|axis| self.state.is_fitted(axis));
        if self.state.job.is_some() || self.state.ball.waiting == 0 || !fitted {
            return false;
        }
        let mut to = self.state.position;
        to[axis] += std::mem::take(&mut self.state.ball.waiting);
        self.state.job = Some(Job {
            command: Command::OpenInterface(Trackball::Move),
            start: self.state.position,
            stages: [Stage::To(to)].into(),
            stage: None,
            activity: Activity::Between,
            silent: true,
            found: [0; AXES],
        });
        true
    }
}
