//! What the controller is doing: a motion, a reference run, a wait.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use vimc4_device::{Activity as Doing, Point, Segment, Time};
use vimc4_isel_wire::{BitTest, Op, PortTest};
use vimc4_motion::Path;

use crate::why::{Breaker, By, Opened};

/// What the controller is doing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Activity {
    /// It waits for a command, or runs a program whose next line is due.
    Idle,
    /// A motion runs.
    Moving(Box<Moving>),
    /// A reference run, or an axis that leaves its switch.
    Referencing(Box<Referencing>),
    /// Nothing moves until a time.
    Waiting {
        /// What it waits for.
        what: Wait,
        /// Until when; `None` if only an input ends it.
        until: Option<Time>,
    },
    /// The self-test has ended in its echo.
    Echo,
}

/// What the controller can wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Wait {
    /// The reset to be over.
    Boot,
    /// The controller to be ready after it was switched on.
    PowerUp,
    /// The flash memory to be erased by command.
    Erase,
    /// The flash memory to be erased by the panel.
    PanelErase,
    /// The delay of a program's line to be over.
    Delay,
    /// The least time of a program's line to be over.
    Line,
    /// A port of a program's conditional branch to change.
    Port,
    /// A character for a program's line.
    Character,
    /// Nothing: a line of a program branches to itself.
    Forever,
}

/// What a motion was made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Purpose {
    /// The host: it gets an answer.
    Command(Op),
    /// The host, which had its answer before the motion began: only an error is still reported.
    Answered(Op),
    /// The program: it goes on.
    Program,
    /// The self-test: it goes on.
    SelfTest,
}

/// The motions still to come, one after the other, each with its own ramp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plan {
    /// Path and speed in Hz.
    pub(crate) parts: VecDeque<(Path, u32)>,
    /// The condition that ends them early.
    pub(crate) until: Option<PortCondition>,
}

impl Plan {
    /// The direction in which the motions first take each axis; 0 for an axis that they do not
    /// move. An axis that comes back to where it was has moved.
    pub(crate) fn way(&self) -> Point {
        let mut way = Point::default();
        for (path, _) in &self.parts {
            let there = path.at(path.length());
            let (low, high) = path.extent(path.length());
            for (axis, way) in way.iter_mut().enumerate().filter(|(_, way)| **way == 0) {
                let places = [there[axis], high[axis], low[axis]];
                *way = places.into_iter().find(|place| *place != 0).unwrap_or(0);
            }
        }
        way
    }

    /// Whether it is a full turn, so that no axis only moves away from where it stands.
    pub(crate) fn turns(&self) -> bool {
        self.parts.iter().any(|(path, _)| !matches!(path, Path::Line(_)))
    }
}

/// A condition on a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum PortCondition {
    /// Of the command `Z`.
    Mask(PortTest),
    /// Of the program's command `6`.
    Bit(BitTest),
}

/// A running motion: a segment and its start, never a position and a last update.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Moving {
    pub(crate) job: Purpose,
    pub(crate) segment: Segment,
    pub(crate) began: Time,
    /// The step at which a carriage runs onto a limit switch.
    pub(crate) hit: Option<u64>,
    /// The speed of the segment, for what is left of it.
    pub(crate) speed: u32,
    /// What comes after this segment.
    pub(crate) plan: Plan,
    /// What happens at the end of the segment instead of going on.
    pub(crate) ending: Ending,
}

/// What happens at the end of a segment, the softest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Ending {
    /// The next one begins, or the command is done.
    Complete,
    /// The motion was stopped: what is left is kept.
    Stop(By),
    /// The condition of the motion was met: what is left is forgotten.
    Event,
    /// The motion was aborted: what is left is forgotten.
    Break(Breaker),
    /// The cover was opened: what is left is forgotten.
    Cover(Opened),
}

impl Ending {
    /// Whether it overrules another one. Of two equal ones the first counts.
    pub(crate) fn is_harder_than(self, other: Ending) -> bool {
        let hardness = |ending| match ending {
            Ending::Complete => 0,
            Ending::Stop(_) => 1,
            Ending::Event => 2,
            Ending::Break(_) => 3,
            Ending::Cover(_) => 4,
        };
        hardness(self) > hardness(other)
    }
}

/// This many steps stand for "without end": half a year at the highest speed.
pub(crate) const ON_AND_ON: u64 = 1 << 40;

/// Axes that look for their reference points, or one that leaves its switch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Referencing {
    pub(crate) job: Purpose,
    /// Whether this is a reference run; otherwise an axis just leaves its switch.
    pub(crate) whole: bool,
    /// The axes still to come after the present one, in order.
    pub(crate) next: VecDeque<u8>,
    pub(crate) axis: usize,
    pub(crate) phase: Phase,
    pub(crate) segment: Segment,
    pub(crate) began: Time,
    /// The step at which the phase ends, if the way leads there.
    pub(crate) goal: Option<u64>,
    /// The step at which the carriage runs onto the wrong switch.
    pub(crate) wrong: Option<u64>,
}

/// The phases of a reference run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Phase {
    /// Towards the switch at the reference speed.
    Approach,
    /// Out of the switch at the start-stop frequency.
    StepOut,
    /// The free steps, at the reference speed.
    Free,
}

impl Moving {
    /// When the segment ends, by itself or at a limit switch.
    pub(crate) fn due(&self) -> Time {
        let nanos = match self.hit {
            Some(step) if step <= self.segment.profile.steps() => {
                self.segment.profile.time_of(step)
            }
            _ => self.segment.profile.duration(),
        };
        self.began.after_nanos(nanos)
    }

    /// How many steps have been made at `now`.
    pub(crate) fn steps_at(&self, now: Time) -> u64 {
        self.segment.profile.steps_at(now.nanos_since(self.began))
    }
}

impl Referencing {
    /// The step at which the present phase ends.
    pub(crate) fn last_step(&self) -> u64 {
        let whole = self.segment.profile.steps();
        whole.min(self.goal.unwrap_or(whole)).min(self.wrong.unwrap_or(whole))
    }

    /// When the present phase ends: never, where no switch is ahead.
    pub(crate) fn due(&self) -> Time {
        match self.last_step() {
            ON_AND_ON => Time::NEVER,
            step => self.began.after_nanos(self.segment.profile.time_of(step)),
        }
    }
}

impl Purpose {
    /// What a motion for this is.
    pub(crate) fn moving(self) -> Doing {
        match self {
            Purpose::Program => Doing::ProgramMove,
            Purpose::SelfTest => Doing::SelfTest,
            Purpose::Command(_) | Purpose::Answered(_) => Doing::Move,
        }
    }
}

impl Referencing {
    /// What it is doing.
    pub(crate) fn doing(&self) -> Doing {
        match self.phase {
            _ if !self.whole => Doing::LeavingLimitSwitch,
            Phase::Approach => Doing::ReferenceTowardsSwitch,
            Phase::StepOut => Doing::ReferenceOutOfSwitch,
            Phase::Free => Doing::ReferenceFreeSteps,
        }
    }
}
